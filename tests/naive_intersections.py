"""Slow and obvious oracles for self-intersections, in rational numbers.

Nothing is shared with the package. A triangle is clipped by the half-spaces whose intersection
the other one is; what is left is what the two have in common.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

Point = tuple[Fraction, ...]
Constraint = tuple[Point, Fraction]  # n, d: the half-space of all x with n x >= d


def exactly(position: Iterable[float]) -> Point:
    """Return a position as rational numbers."""
    return tuple(Fraction(float(x)) for x in position)


def minus(p: Point, q: Point) -> Point:
    return tuple(x - y for x, y in zip(p, q, strict=True))


def dot(p: Point, q: Point) -> Fraction:
    return sum((x * y for x, y in zip(p, q, strict=True)), Fraction(0))


def cross(p: Point, q: Point) -> Point:
    return (
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    )


def sign(x: Fraction) -> int:
    return (x > 0) - (x < 0)


def orientation(*points: Point) -> int:
    """Return the sign of the determinant of the differences to the last point."""
    *others, last = points
    rows = [minus(p, last) for p in others]
    if len(rows) == 2:
        return sign(rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0])
    return sign(dot(rows[0], cross(rows[1], rows[2])))


def plane(normal: Point, point: Point) -> list[Constraint]:
    """Return a plane as two half-spaces."""
    offset = dot(normal, point)
    return [(normal, offset), (tuple(-x for x in normal), -offset)]


def as_half_spaces(corners: list[Point]) -> list[Constraint]:
    """Return a triangle, segment or point as an intersection of half-spaces."""
    a, b, c = corners
    normal = cross(minus(b, a), minus(c, a))
    if any(normal):
        found = plane(normal, a)
        for p, q in ((a, b), (b, c), (c, a)):
            inward = cross(normal, minus(q, p))
            found.append((inward, dot(inward, p)))
        return found
    p, q = min(corners), max(corners)  # along a line, tuples are in the order of the points
    along = minus(q, p)
    found = []
    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        found += plane(cross(along, exactly(axis)) if p != q else exactly(axis), p)
    return [*found, (along, dot(along, p)), (minus(p, q), dot(minus(p, q), q))]


def clipped(polygon: list[Point], constraint: Constraint) -> list[Point]:
    """Return the part of a convex polygon in a half-space (Sutherland and Hodgman)."""
    normal, offset = constraint
    found = []
    for k, p in enumerate(polygon):
        q = polygon[k - 1]
        p_height, q_height = dot(normal, p) - offset, dot(normal, q) - offset
        if p_height * q_height < 0:
            t = q_height / (q_height - p_height)
            found.append(tuple(x + t * (y - x) for x, y in zip(q, p, strict=True)))
        if p_height >= 0:
            found.append(p)
    return found


def common_points(p: list[Point], q: list[Point]) -> list[Point]:
    """Return points whose convex hull is what two triangles have in common."""
    for constraint in as_half_spaces(q):
        p = clipped(p, constraint)
    return p


def is_between(x: Point, p: Point, q: Point) -> bool:
    """Whether x is on the segment from p to q."""
    return not any(cross(minus(x, p), minus(q, p))) and dot(minus(p, x), minus(q, x)) <= 0


def faces_cross(vertices: ArrayLike, a: Iterable[int], b: Iterable[int]) -> bool:
    """Whether two faces meet elsewhere than in the vertex or edge that they share."""
    positions = np.asarray(vertices, dtype=np.float64)
    a, b = [int(v) for v in a], [int(v) for v in b]
    shared = sorted(set(a) & set(b))
    if len(shared) == 3:
        return True
    common = common_points([exactly(positions[v]) for v in a], [exactly(positions[v]) for v in b])
    if not shared:
        return bool(common)
    ends = [exactly(positions[v]) for v in shared]
    return not all(is_between(x, ends[0], ends[-1]) for x in common)


def crossing_pairs(vertices: ArrayLike, faces: ArrayLike) -> list[tuple[int, int]]:
    """Return all pairs of faces that cross, by trying all pairs whose boxes meet."""
    triangles = np.asarray(faces).reshape(-1, 3)
    corners = np.asarray(vertices)[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    return [
        (f, g)
        for f, g in combinations(range(len(triangles)), 2)
        if (low[f] <= high[g]).all() and (low[g] <= high[f]).all()
        if faces_cross(vertices, triangles[f], triangles[g])
    ]
