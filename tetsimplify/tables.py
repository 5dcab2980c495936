"""The tables of a lattice, as the kernels want them: made of its tetrahedra and nothing else.

A *site* is the index of a sample. It stands for the sample, for the cube of which the sample is
corner 0, for the centre of that cube, and for all lattice edges that are *anchored* there: those
whose ends are among the points numbered in :mod:`tetsimplify.lattices`, at no later site.

What there is at a site depends on where it is. The *place* of a site has ten bits: for each axis
whether it is the first (1), the last but one, that of the last cube (2), or the last (4), and
the parity of the sum of its indices (512).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import combinations, product
from operator import add
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.lattices import CENTRE, Lattice, Piece, Tetrahedron, lattice_named

Edge = tuple[int, int]  # two points; equal ones stand for the lattice point itself
Triangle = tuple[Edge, ...]
Corners = tuple[int, ...]  # of a tetrahedron or a triangle, as points

FIRST, LAST_CUBE, LAST, PARITY = 1, 2, 4, 512
N_PLACES = 1024
N_POINTS = 12
SITES = (0, 1, 2, 3, 4, 5, 6, 7, 0, 4, 2, 1)
"""The site that each point belongs to, as a corner."""


class Tables(NamedTuple):
    """A lattice as the kernels want it.

    A *slot* is a kind of lattice edge, given by its two ends relative to the site that it is
    anchored at. Slot 0 is the lattice point itself. A *colouring* has a bit for each point of a
    site, 8 or 12, which is set where the point is inside.
    """

    slot_ends: NDArray[np.int32]
    """(n_slots, 2) points."""
    points: NDArray[np.float64]
    """(12, 3) positions of the points, relative to their site."""
    crossing: NDArray[np.uint32]
    """(n_colourings,) a bit for each slot whose ends have different colours; bit 0 for inside."""
    exists: NDArray[np.uint32]
    """(1024,) a bit for each slot that is there, by place."""
    first_part: NDArray[np.int32]
    """(1024 + 1,) what a cube consists of, by place: parts first_part[c] to first_part[c + 1]."""
    parts: NDArray[np.int32]
    """(k,) numbers of parts: tetrahedra of a piece, or caps."""
    rows: NDArray[np.int32]
    """(n_parts, n_colourings, 2) the triangles of a part, from and to."""
    triangles: NDArray[np.int32]
    """(k, 3, 2) offset, as a corner, of the site that anchors a vertex, and its slot."""
    has_centres: bool
    """Whether there are points in the middle of the cubes."""


def lattice_tables(name: str, closed: bool = False) -> Tables:
    """Tables of a lattice by its name, with the caps of closed surfaces or without.

    Raises
    ------
    OptionError
        When there is no such lattice.
    """
    return _tables(lattice_named(name), bool(closed))


@cache
def _tables(lattice: Lattice, closed: bool) -> Tables:
    edges = {edge for piece in lattice.pieces for edge in _edges(piece)}
    ends = [(0, 0), *sorted({_anchored(edge)[1] for edge in edges})]
    slots = {edge: slot for slot, edge in enumerate(ends)}
    n_colourings = 2**N_POINTS if lattice.has_centres else 2**CENTRE

    colourings = np.arange(n_colourings)
    crossing = colourings & 1
    for slot, (a, b) in enumerate(ends[1:], 1):
        crossing |= ((colourings >> a ^ colourings >> b) & 1) << slot

    parts = [_Part(piece.tetrahedra, _separate, piece) for piece in lattice.pieces]
    if closed:
        parts += [_cap(lattice, side, parity) for side, parity in product(range(6), (0, 1))]
    rows, triangles = _triangles(parts, n_colourings, slots)
    first_part, numbers = [0], []
    for place in range(N_PLACES):
        numbers += [number for number, part in enumerate(parts) if _is_in(part.where, place)]
        first_part.append(len(numbers))

    return Tables(
        np.array(ends, np.int32),
        np.array([_position(point) for point in range(N_POINTS)]),
        crossing.astype(np.uint32),
        _existing(lattice, slots, closed),
        np.array(first_part, np.int32),
        np.array(numbers, np.int32),
        rows,
        triangles,
        lattice.has_centres,
    )


# ---------------------------------------------------------------------------- points and edges


def _position(point: int) -> NDArray[np.float64]:
    site = SITES[point]
    position = np.array([site >> 2 & 1, site >> 1 & 1, site & 1], np.float64)
    return position if point < CENTRE else position + 0.5


def _anchored(edge: Edge) -> tuple[int, Edge]:
    """The site of an edge, as a corner, and its ends relative to it, the same both ways."""
    low, high = sorted(edge)
    site = SITES[low] & SITES[high]
    if high >= CENTRE:  # the edge from a corner to the centre of a cube belongs to this cube
        site = SITES[high] if low < CENTRE else site
    low, high = sorted(_moved(point, site) for point in (low, high))
    return site, (low, high)


def _moved(point: int, site: int) -> int:
    """A point relative to another site."""
    if point < CENTRE:
        return point ^ site
    return SITES.index(SITES[point] ^ site, CENTRE)


def _edges(piece: Piece) -> set[Edge]:
    return {edge for tetrahedron in piece.tetrahedra for edge in combinations(tetrahedron, 2)}


# ---------------------------------------------------------------------------- places


def _is_in(where: Piece, place: int) -> bool:
    """Whether the cubes at a place are among those of a piece."""

    def is_at(side: int) -> bool:
        axis, high = divmod(side, 2)
        return bool(place >> 3 * axis & (LAST_CUBE if high else FIRST))

    return (
        not place & (LAST | LAST << 3 | LAST << 6)
        and (where.parity is None or where.parity == bool(place & PARITY))
        and (where.at_side is None or is_at(where.at_side))
        and (where.away_from_side is None or not is_at(where.away_from_side))
    )


def _place(site: tuple[int, ...], shape: tuple[int, ...], parity: int) -> int:
    place = PARITY * ((sum(site) + parity) % 2)
    for axis, (index, n) in enumerate(zip(site, shape, strict=True)):
        bits = FIRST * (index == 0) | LAST_CUBE * (index == n - 2) | LAST * (index == n - 1)
        place |= bits << 3 * axis
    return place


def _existing(lattice: Lattice, slots: dict[Edge, int], closed: bool) -> NDArray[np.uint32]:
    """Which slots there are at each place: those of the tetrahedra in small volumes."""
    exists = np.zeros(N_PLACES, np.uint32)
    for *shape, parity in product((2, 5), (2, 5), (2, 5), (0, 1)):
        for cube in product(*(range(n - 1) for n in shape)):
            place = _place(cube, tuple(shape), parity)
            for piece in lattice.pieces:
                for edge in _edges(piece) if _is_in(piece, place) else ():
                    corner, ends = _anchored(edge)
                    offset = corner >> 2 & 1, corner >> 1 & 1, corner & 1
                    site = tuple(map(add, cube, offset))
                    exists[_place(site, tuple(shape), parity)] |= 1 << slots[ends]
    if closed:
        on_side = (FIRST | LAST) * (1 | 8 | 64)
        exists[np.flatnonzero(np.arange(N_PLACES) & on_side)] |= 1
    return exists


# ---------------------------------------------------------------------------- triangles


class _Part(NamedTuple):
    """Tetrahedra or triangles, what is made of them, and the cubes that have them."""

    simplices: tuple[Corners, ...]
    cut: Callable[[Corners, frozenset[int]], list[Triangle]]
    where: Piece


def _triangles(
    parts: list[_Part], n_colourings: int, slots: dict[Edge, int]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The triangles of all parts, and which of them belong to each part and colouring."""
    rows = np.empty((len(parts), n_colourings, 2), np.int32)
    triangles: list[list[tuple[int, int]]] = []
    colourings = np.arange(n_colourings)
    for part, row in zip(parts, rows, strict=True):
        points = sorted({point for simplex in part.simplices for point in simplex})
        for colours in product((False, True), repeat=len(points)):
            inside = frozenset(p for p, is_inside in zip(points, colours, strict=True) if is_inside)
            begin = len(triangles)
            for simplex in part.simplices:
                for triangle in part.cut(simplex, inside.intersection(simplex)):
                    anchored = [_anchored(edge) for edge in triangle]
                    triangles.append([(site, slots[ends]) for site, ends in anchored])
            has = np.ones(n_colourings, np.bool_)
            for point, is_inside in zip(points, colours, strict=True):
                has &= (colourings >> point & 1) == is_inside
            row[has] = begin, len(triangles)
    return rows, np.array(triangles, np.int32).reshape(-1, 3, 2)


@cache
def _separate(tetrahedron: Tetrahedron, insiders: frozenset[int]) -> list[Triangle]:
    r"""Triangles between the inside and the outside corners, seen anticlockwise from outside.

    ::

        one corner apart          two and two

              i                    i ---- i      the quadrilateral i0o0 i0o1 i1o1 i1o0
             /|\                   |\    /|      is cut along one diagonal, which no
            o | o                  |  \/  |      other tetrahedron sees
             \|/                   o ---- o
              o
    """
    inside = [corner for corner in tetrahedron if corner in insiders]
    outside = [corner for corner in tetrahedron if corner not in insiders]
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


def _cap(lattice: Lattice, side: int, parity: int) -> _Part:
    """What closes a side: the faces of the tetrahedra that lie in it."""
    axis, high = divmod(side, 2)
    place = (LAST_CUBE if high else FIRST) << 3 * axis | PARITY * parity
    faces = {
        tuple(sorted(face))
        for piece in lattice.pieces
        if _is_in(piece, place)
        for tetrahedron in piece.tetrahedra
        for face in combinations(tetrahedron, 3)
    }
    in_side = sorted(face for face in faces if all(_position(p)[axis] == high for p in face))
    return _Part(tuple(in_side), _inside_part, Piece((), parity=parity, at_side=side))


@cache
def _inside_part(triangle: Corners, insiders: frozenset[int]) -> list[Triangle]:
    """The part of a triangle in a side of the cube that is inside, seen from without."""
    polygon: list[Edge] = []
    for corner, following in zip(triangle, (*triangle[1:], triangle[0]), strict=True):
        if corner in insiders:
            polygon.append((corner, corner))
        if (corner in insiders) != (following in insiders):
            polygon.append((corner, following))
    outwards = np.mean([_position(c) for c in triangle], axis=0) - 0.5
    flat_axis = np.ptp([_position(c) for c in triangle], axis=0) == 0
    return _fan(polygon, np.where(flat_axis, outwards, 0.0))


def _fan(polygon: list[Edge], outwards: NDArray[np.float64]) -> list[Triangle]:
    """Cut a polygon into triangles around its first corner, anticlockwise against `outwards`."""
    points = [(_position(a) + _position(b)) / 2 for a, b in polygon]
    triangles: list[Triangle] = []
    for k in range(1, len(polygon) - 1):
        normal = np.cross(points[k] - points[0], points[k + 1] - points[0])
        corners = (polygon[0], polygon[k], polygon[k + 1])
        triangles.append(corners if normal @ outwards > 0 else corners[::-1])
    return triangles
