"""Lattices written down once more, slow and obvious, for `models.marching_tetrahedra`.

Coordinates are twice those of the volume: samples are even, centres of cubes are odd. The corners
of each tetrahedron come in the order of the package, which decides how quadrilaterals are cut.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations, product

import numpy as np
from numpy.typing import ArrayLike, NDArray

import models
from tetsimplify import Mesh

Point = models.Point
Tetrahedron = tuple[Point, ...]
CORNERS = [(c >> 2 & 1, c >> 1 & 1, c & 1) for c in range(8)]


def cubes(shape: Sequence[int]) -> Iterator[Point]:
    """The indices of the cubes of a volume."""
    yield from product(*(range(n - 1) for n in shape))


def corner(cube: Point, offset: Sequence[int]) -> Point:
    z, y, x = (2 * (i + d) for i, d in zip(cube, offset, strict=True))
    return z, y, x


def centre(cube: Point, offset: Sequence[int] = (0, 0, 0)) -> Point:
    z, y, x = (2 * (i + d) + 1 for i, d in zip(cube, offset, strict=True))
    return z, y, x


def kuhn(shape: Sequence[int]) -> Iterator[Tetrahedron]:
    """Shortest paths from the first corner of a cube to its last."""
    for cube in cubes(shape):
        for order in permutations(np.eye(3, dtype=int)):
            steps = np.cumsum([(0, 0, 0), *order], axis=0)
            yield tuple(corner(cube, step) for step in steps)


def five(shape: Sequence[int]) -> Iterator[Tetrahedron]:
    """The corners of odd or even parity, and each of the others with its three neighbours.

    The parity is that of the coordinates in the volume, so it is the same in every cube.
    """
    for cube in cubes(shape):
        mirror = sum(cube) % 2
        in_order = [CORNERS[c ^ mirror] for c in range(8)]
        inner = [in_order[c] for c in (0, 3, 5, 6)]
        yield tuple(corner(cube, offset) for offset in inner)
        for alone in (1, 2, 4, 7):
            near = [o for o in inner if np.abs(np.subtract(o, in_order[alone])).sum() == 1]
            number = {offset: c for c, offset in enumerate(in_order)}
            tetrahedron = sorted([*near, in_order[alone]], key=number.__getitem__)
            yield tuple(corner(cube, offset) for offset in tetrahedron)


def bcc(shape: Sequence[int]) -> Iterator[Tetrahedron]:
    """Between two centres and an edge of the common side; pyramids in two on the sides."""
    for cube in cubes(shape):
        for axis, high in product(range(3), range(2)):
            b, c = (other for other in range(3) if other != axis)
            rim = []
            for db, dc in ((0, 0), (1, 0), (1, 1), (0, 1)):
                offset = [0, 0, 0]
                offset[axis], offset[b], offset[c] = high, db, dc
                rim.append(corner(cube, offset))
            step = [0, 0, 0]
            step[axis] = 1
            if cube[axis] == (shape[axis] - 2 if high else 0):
                yield centre(cube), rim[0], rim[1], rim[2]
                yield centre(cube), rim[0], rim[3], rim[2]
            elif high:
                for k in range(4):
                    yield centre(cube), centre(cube, step), rim[k], rim[(k + 1) % 4]


LATTICES = {"kuhn": kuhn, "five": five, "bcc": bcc}


def as_samples(volume: ArrayLike, centres: ArrayLike | None, level: float) -> dict[Point, float]:
    """The values at all points. The mean of eight samples is on their side of the level."""
    array = np.asarray(volume, np.float64)
    samples = {corner(index, (0, 0, 0)): float(array[index]) for index in np.ndindex(array.shape)}
    for cube in cubes(array.shape):
        around = [array[tuple(np.add(cube, offset))] for offset in CORNERS]
        value = np.sum([value / 8 for value in around])
        if centres is not None:
            value = np.asarray(centres)[cube]
        elif all(v > level for v in around) or not any(v > level for v in around):
            value = np.clip(value, min(around), max(around))
        samples[centre(cube)] = float(value)
    return samples


def isosurface(
    volume: ArrayLike, level: float, lattice: str, centres: ArrayLike | None = None
) -> Mesh:
    """The surface, by `models.marching_tetrahedra`."""
    shape = np.shape(volume)
    samples = as_samples(volume, centres, level)
    faces = models.marching_tetrahedra(samples, LATTICES[lattice](shape), level)
    edges = sorted({edge for face in faces for edge in face})
    number = {edge: vi for vi, edge in enumerate(edges)}
    vertices = [models.position(samples, level, edge) / 2 for edge in edges]
    triangles = [[number[edge] for edge in face] for face in faces]
    return Mesh(np.reshape(vertices, (-1, 3)), np.reshape(triangles, (-1, 3)).astype(np.int64))


def inside_area(volume: NDArray, level: float, side: int, lattice: str) -> float:
    """The area above the level of a side of a volume (low, high side of axes 0, 1, 2)."""
    axis, high = divmod(side, 2)
    z = volume.shape[axis] - 1 if high else 0
    plane = np.take(volume, z, axis)
    total = 0.0
    for i, j in product(range(plane.shape[0] - 1), range(plane.shape[1] - 1)):
        square = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)]
        if lattice == "five" and (z + i + j) % 2:
            square = square[1:] + square[:1]
        a, b, c, d = (float(plane[corner]) for corner in square)
        total += 0.5 * (_inside_part([a, b, c], level) + _inside_part([a, d, c], level))
    return total


def _inside_part(values: list[float], level: float) -> float:
    """The part of a triangle that is above the level."""
    inside = [value for value in values if value > level]
    if len(inside) in (0, 3):
        return float(len(inside) == 3)
    apart = inside[0] if len(inside) == 1 else next(v for v in values if v <= level)
    others = list(values)
    others.remove(apart)
    cut_off = 1.0
    for value in others:
        # measured from the lower end, as the clearance is kept from both
        t = (level / 2 - apart / 2) / (value / 2 - apart / 2)
        cut_off *= min(max(t, models.CLEARANCE), 1 - models.CLEARANCE)
    return cut_off if len(inside) == 1 else 1 - cut_off
