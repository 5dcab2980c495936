"""Tetrahedral lattices as data: how a cube of eight samples is cut into tetrahedra.

Corners of a cube are numbered by their offsets along the three axes of the volume,
``corner = 4 d0 + 2 d1 + d2``:

            2 ------- 3
           /|        /|         axis 0: 0 -> 4
          6 ------- 7 |         axis 1: 0 -> 2
          | 0 ------|-1         axis 2: 0 -> 1
          |/        |/
          4 ------- 5

All else follows from the tetrahedra: which edges the lattice has, and which triangles
separate the inside from the outside for each of the 256 ways to colour the corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError

Tetrahedron = tuple[int, int, int, int]
Edge = tuple[int, int]  # two corners of a cube; equal ones stand for the lattice point itself


@dataclass(frozen=True)
class Lattice:
    """A way to cut every cube into tetrahedra so that neighbouring cubes match."""

    name: str
    description: str
    tetrahedra: tuple[Tetrahedron, ...]


def _paths_along_the_axes() -> tuple[Tetrahedron, ...]:
    """The six shortest paths from corner 0 to corner 7 along the edges of the cube."""
    return tuple((0, a, a + b, 7) for a, b, _ in permutations((1, 2, 4)))


LATTICES = {
    lattice.name: lattice
    for lattice in (
        Lattice(
            "kuhn",
            "six tetrahedra a cube around its main diagonal (Kuhn 1960, Freudenthal 1942)",
            _paths_along_the_axes(),
        ),
    )
}


class Tables(NamedTuple):
    """A lattice as the kernels want it.

    A *slot* is a kind of lattice edge: its two ends relative to its anchor, the lowest
    corner of the smallest box around it. Slot 0 is the lattice point itself. A triangle
    corner is given as the corner of the cube that anchors it, and the slot.
    """

    slot_ends: NDArray[np.int32]
    """(n_slots, 2) corner numbers relative to the anchor."""
    first: NDArray[np.int32]
    """(256 + 1,) triangles of cube colouring c are first[c] to first[c + 1]."""
    triangles: NDArray[np.int32]
    """(k, 3, 2) anchor corner and slot."""
    cap_first: NDArray[np.int32]
    """(6, 256 + 1) the same for the caps of the sides: low, high side of axes 0, 1, 2."""
    cap_triangles: NDArray[np.int32]
    """(k, 3, 2) anchor corner and slot."""


def lattice_tables(name: str) -> Tables:
    """Tables of a lattice by its name.

    Raises
    ------
    OptionError
        When there is no such lattice.
    """
    if not isinstance(name, str) or name not in LATTICES:
        raise OptionError(f"lattice must be one of {', '.join(LATTICES)}, got {name!r}")
    return _tables(name)


@cache
def _tables(name: str) -> Tables:
    tetrahedra = LATTICES[name].tetrahedra
    edges = {edge for tetrahedron in tetrahedra for edge in combinations(sorted(tetrahedron), 2)}
    ends = [(0, 0), *sorted({_anchored(edge)[1] for edge in edges})]
    slots = {edge: slot for slot, edge in enumerate(ends)}

    def triangle_list(triangles: list[tuple[Edge, ...]]) -> list[list[list[int]]]:
        anchored = [[_anchored(edge) for edge in triangle] for triangle in triangles]
        return [[[anchor, slots[edge]] for anchor, edge in triangle] for triangle in anchored]

    surface: list[list[list[int]]] = []
    first = [0]
    for colouring in range(256):
        for tetrahedron in tetrahedra:
            surface += triangle_list(_separate(tetrahedron, colouring))
        first.append(len(surface))

    caps: list[list[list[int]]] = []
    cap_first = []
    for side in range(6):
        cap_first.append([len(caps)])
        for colouring in range(256):
            for triangle in _side_triangles(tetrahedra, side):
                caps += triangle_list(_inside_part(triangle, colouring))
            cap_first[-1].append(len(caps))

    return Tables(
        np.array(ends, np.int32),
        np.array(first, np.int32),
        np.array(surface, np.int32).reshape(-1, 3, 2),
        np.array(cap_first, np.int32),
        np.array(caps, np.int32).reshape(-1, 3, 2),
    )


def _anchored(edge: Edge) -> tuple[int, Edge]:
    """The anchor of an edge, and the edge relative to it, the same for both directions."""
    low, high = sorted(edge)
    anchor = low & high
    return anchor, (low ^ anchor, high ^ anchor)


def _position(corner: int) -> NDArray[np.float64]:
    return np.array([corner >> 2 & 1, corner >> 1 & 1, corner & 1], np.float64)


def _is_inside(corner: int, colouring: int) -> bool:
    return bool(colouring >> corner & 1)


def _separate(tetrahedron: Tetrahedron, colouring: int) -> list[tuple[Edge, ...]]:
    r"""Triangles between the inside and the outside corners, seen anticlockwise from outside.

    one corner apart          two and two

          i                    i ---- i      the quadrilateral i0o0 i0o1 i1o1 i1o0
         /|\                   |\    /|      is cut along one diagonal, which no
        o | o                  |  \/  |      other tetrahedron sees
         \|/                   o ---- o
          o
    """
    inside = [corner for corner in tetrahedron if _is_inside(corner, colouring)]
    outside = [corner for corner in tetrahedron if not _is_inside(corner, colouring)]
    if not inside or not outside:
        return []
    if len(inside) == 2:
        (i0, i1), (o0, o1) = inside, outside
        polygon = [(i0, o0), (i0, o1), (i1, o1), (i1, o0)]
    else:
        polygon = [(i, o) for i in inside for o in outside]
    outwards = np.mean([_position(o) for o in outside], axis=0)
    outwards -= np.mean([_position(i) for i in inside], axis=0)
    return _fan(polygon, outwards)


def _side_triangles(tetrahedra: tuple[Tetrahedron, ...], side: int) -> list[tuple[int, ...]]:
    """Faces of the tetrahedra that lie in a side of the cube."""
    axis, high = divmod(side, 2)
    faces = {face for t in tetrahedra for face in combinations(sorted(t), 3)}
    return sorted(face for face in faces if all(_position(c)[axis] == high for c in face))


def _inside_part(triangle: tuple[int, ...], colouring: int) -> list[tuple[Edge, ...]]:
    """The part of a triangle in a side of the cube that is inside, seen from without."""
    polygon: list[Edge] = []
    for corner, following in zip(triangle, (*triangle[1:], triangle[0]), strict=True):
        if _is_inside(corner, colouring):
            polygon.append((corner, corner))
        if _is_inside(corner, colouring) != _is_inside(following, colouring):
            polygon.append((corner, following))
    outwards = np.mean([_position(c) for c in triangle], axis=0) - 0.5
    flat_axis = np.ptp([_position(c) for c in triangle], axis=0) == 0
    return _fan(polygon, np.where(flat_axis, outwards, 0.0))


def _fan(polygon: list[Edge], outwards: NDArray[np.float64]) -> list[tuple[Edge, ...]]:
    """Cut a polygon into triangles around its first corner, anticlockwise against `outwards`."""
    points = [(_position(a) + _position(b)) / 2 for a, b in polygon]
    triangles: list[tuple[Edge, ...]] = []
    for k in range(1, len(polygon) - 1):
        normal = np.cross(points[k] - points[0], points[k + 1] - points[0])
        corners = (polygon[0], polygon[k], polygon[k + 1])
        triangles.append(corners if normal @ outwards > 0 else corners[::-1])
    return triangles
