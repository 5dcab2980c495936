"""Volumes whose surfaces are known, and a slow and obvious marching tetrahedra to compare with.

The slow one takes any list of tetrahedra; see `naive_lattices`. A surface vertex is the lattice
edge that it lies on, a pair of lattice points; nothing is numbered and nothing is shared with the
package.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Point = tuple[int, int, int]
LatticeEdge = tuple[Point, Point]
LatticeFace = tuple[LatticeEdge, LatticeEdge, LatticeEdge]

CLEARANCE = 1e-4
"""How near to a sample a vertex may come, as documented, in units of the lattice edge."""


# ---------------------------------------------------------------------------- known surfaces
# All are positive inside.


def axes(shape: Sequence[int], half_width: float | Sequence[float] = 1.0) -> list[NDArray]:
    """Coordinates of the samples of a box around the origin, ready to broadcast."""
    widths = np.broadcast_to(half_width, 3)
    spans = [np.linspace(-w, w, n) for w, n in zip(widths, shape, strict=True)]
    return list(np.meshgrid(*spans, indexing="ij", sparse=True))


def spacing_of(shape: Sequence[int], half_width: float | Sequence[float] = 1.0) -> NDArray:
    """Distances between the samples of `axes`."""
    return 2 * np.broadcast_to(half_width, 3) / (np.array(shape) - 1)


def ball(n: int, radius: float = 0.8) -> NDArray[np.float64]:
    """Squared distances, so that the gradient is smooth at the surface and far from it."""
    x, y, z = axes((n, n, n))
    return radius**2 - x**2 - y**2 - z**2


def torus(shape: Sequence[int], half_width: Sequence[float], tube: float) -> NDArray[np.float64]:
    """The distance to a torus of radius 1 around the last axis, whose tube has radius `tube`."""
    x, y, z = axes(shape, half_width)
    return tube - np.hypot(np.hypot(x, y) - 1, z)


def two_sheets(shape: Sequence[int], half_width: Sequence[float]) -> NDArray[np.float64]:
    """The hyperboloid of two sheets z^2 = 1 + x^2 + y^2, solid in the two cups."""
    x, y, z = axes(shape, half_width)
    return z**2 - x**2 - y**2 - 1


def gyroid(n: int, periods: float = 2.0) -> NDArray[np.float64]:
    """A gyroid of some periods a side."""
    x, y, z = axes((n, n, n), np.pi * periods)
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


# ---------------------------------------------------------------------------- marching


def marching_tetrahedra(
    samples: Mapping[Point, float], tetrahedra: Iterator[tuple[Point, ...]], level: float
) -> list[LatticeFace]:
    """Return the faces between what is above the level and what is not, seen from without.

    A quadrilateral is cut along the diagonal from the vertex between the first inside and the
    first outside corner of its tetrahedron.
    """
    faces = []
    for corners in tetrahedra:
        inside = [p for p in corners if samples[p] > level]
        outside = [p for p in corners if not samples[p] > level]
        if not inside or not outside:
            continue
        if len(inside) == 2:
            (i, j), (o, q) = inside, outside
            cut = [((i, o), (i, q), (j, q)), ((i, o), (j, q), (j, o))]
        else:
            cut = [tuple((p, q) for p in inside for q in outside)]
        outwards = np.mean(outside, axis=0) - np.mean(inside, axis=0)
        for ends in cut:
            a, b, c = (np.add(p, q) for p, q in ends)  # twice the middles of the lattice edges
            first, second, third = (as_lattice_edge(p, q) for p, q in ends)
            if np.cross(b - a, c - a) @ outwards < 0:
                second, third = third, second
            faces.append((first, second, third))
    return faces


def as_lattice_edge(p: Point, q: Point) -> LatticeEdge:
    """Return the edge between two lattice points, the lower one first."""
    return (p, q) if p < q else (q, p)


def position(samples: Mapping[Point, float], level: float, edge: LatticeEdge) -> NDArray:
    """Return where a lattice edge has the level, in units of the lattice."""
    p, q = edge
    t = (level / 2 - samples[p] / 2) / (samples[q] / 2 - samples[p] / 2)
    t = min(max(t, CLEARANCE), 1 - CLEARANCE)
    return np.array(p) + t * np.subtract(q, p)


# ---------------------------------------------------------------------------- the interpolant


def interpolated(volume: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Return the values at points given in indices, linear in each tetrahedron of `kuhn`.

    From the first corner of its cube, the path to the last one goes along the axes in the order
    of the fractional parts of the point, the largest one first.
    """
    array = np.asarray(volume, dtype=np.float64)
    at = np.asarray(points, dtype=np.float64)
    corner = np.clip(np.floor(at).astype(int), 0, np.array(array.shape) - 2)
    part = at - corner
    order = np.argsort(-part, axis=1)
    rows = np.arange(len(at))
    value = array[tuple(corner.T)]
    for axis in order.T:
        before = array[tuple(corner.T)]
        corner[rows, axis] += 1
        value = value + part[rows, axis] * (array[tuple(corner.T)] - before)
    return value


# ---------------------------------------------------------------------------- measures


def normals(vertices: ArrayLike, faces: ArrayLike) -> NDArray[np.float64]:
    """Return the normals of faces, as long as twice their areas."""
    a, b, c = np.moveaxis(np.asarray(vertices)[np.asarray(faces)], 1, 0)
    return np.cross(b - a, c - a)


def areas(vertices: ArrayLike, faces: ArrayLike) -> NDArray[np.float64]:
    """Return the areas of faces."""
    return np.linalg.norm(normals(vertices, faces), axis=1) / 2


def signed_volume(vertices: ArrayLike, faces: ArrayLike) -> float:
    """Return the volume that a closed surface encloses, positive when normals point outward."""
    first = np.asarray(vertices)[np.asarray(faces)[:, 0]]
    return float((first * normals(vertices, faces)).sum() / 6)


def lengths(vertices: ArrayLike, faces: ArrayLike) -> NDArray[np.float64]:
    """Return the lengths of the three edges of each face."""
    corners = np.asarray(vertices)[np.asarray(faces)]
    return np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
