"""Interfaces between the labels of a volume, on slabs of planes (Kuhn lattice).

A vertex stands in the middle of a lattice edge between two labels, of a lattice triangle between
three, or of a tetrahedron between four. So it is known by its simplex, and a simplex by its site
and its slot: the chain of corners from the site on. Sites, slabs and numbers are those of
:mod:`tetsimplify.kernels.marching`.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.bits import lowest_bit, n_bits
from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.marching import WORD


class InterfaceTables(NamedTuple):
    """What there is to look up."""

    chains: np.ndarray
    """(25, 4) int32 corners of each slot, the last one repeated."""
    tetrahedra: np.ndarray
    """(6, 4) int32 corners of a cube."""
    rows: np.ndarray
    """(6, 64, 2) int32 triangles of a tetrahedron, from and to, by which pairs of its corners
    have equal labels."""
    triangles: np.ndarray
    """(k, 3, 2) int32 site, as a corner, and slot of each vertex."""
    sides: np.ndarray
    """(k, 2) int32 the corners of the tetrahedron behind and before each triangle."""


class InterfaceOutput(NamedTuple):
    """Where a slab writes to."""

    vertices: np.ndarray
    """(n, 3) float64."""
    faces: np.ndarray
    """(m, 3) int32."""
    face_labels: np.ndarray
    """(m, 2) int64: behind and before each face."""


@part
def _gather(labels, z, y, x, corners):
    """The labels of the corners of a cube; return which axes end at the site, as a corner."""
    n0, n1, n2 = labels.shape
    missing = np.int64(z + 1 >= n0) << 2 | np.int64(y + 1 >= n1) << 1 | np.int64(x + 1 >= n2)
    some = False
    first = labels[z, y, x]
    for c in range(8):
        if c & missing == 0:
            corners[c] = labels[z + (c >> 2), y + (c >> 1 & 1), x + (c & 1)]
            some |= corners[c] != first
        else:
            corners[c] = first
    return missing if some else 8


@part
def _slots(corners, missing, tables):
    """The simplices of a site that carry a vertex."""
    slots = 0
    for slot in range(len(tables.chains)):
        chain = tables.chains[slot]
        a, b, c = corners[0], corners[chain[1]], corners[chain[2]]
        d = corners[chain[3]]
        if chain[3] & missing or a == b:
            continue
        if chain[2] != chain[1] and (c == a or c == b):
            continue
        if chain[3] != chain[2] and (d == a or d == b or d == c):
            continue
        slots |= 1 << slot
    return slots


@part
def _pattern(corners, tetrahedron):
    """A bit for each pair of corners of equal labels."""
    a, b = corners[tetrahedron[0]], corners[tetrahedron[1]]
    c, d = corners[tetrahedron[2]], corners[tetrahedron[3]]
    pattern = np.int64(a == b) | np.int64(a == c) << 1 | np.int64(a == d) << 2
    return pattern | np.int64(b == c) << 3 | np.int64(b == d) << 4 | np.int64(c == d) << 5


@kernel_in_place
def count_slab(labels, first, z0, z1, tables, corners):
    """Count the vertices and the triangles of planes z0 to z1.

    Parameters
    ----------
    labels : float64 (p, n1, n2)
        From plane `first` on, to the next one after z1 where there is one.
    corners : float64 (8,)
        Scratch space.

    Returns
    -------
    n_vertices, n_triangles : int
    """
    n_vertices = 0
    n_triangles = 0
    for z in range(z0 - first, z1 - first):
        for y in range(labels.shape[1]):
            for x in range(labels.shape[2]):
                missing = _gather(labels, z, y, x, corners)
                if missing == 8:
                    continue
                n_vertices += n_bits(_slots(corners, missing, tables))
                if missing == 0:
                    for t in range(6):
                        row = tables.rows[t, _pattern(corners, tables.tetrahedra[t])]
                        n_triangles += row[1] - row[0]
    return n_vertices, n_triangles


@kernel_in_place
def fill_slab(labels, first, z0, z1, tables, start, frame, numbers, corners, out):
    """Place the vertices and write the triangles of planes z0 to z1.

    Parameters
    ----------
    labels : float64 (p, n1, n2)
        From plane `first` on, to the next two after z1 where there are.
    start : int
        The number of the first vertex.
    frame : float64 (2, 3)
        Spacing and origin.
    numbers : int64 (2, n1 * n2)
        Scratch space, for planes with even and odd numbers.
    corners : float64 (8,)
        Scratch space.
    out : InterfaceOutput
        As long as was counted.
    """
    n0, n1, n2 = labels.shape
    n_vertices = 0
    n_triangles = 0
    for z in range(z0 - first, min(z1 - first, n0 - 1) + 1):
        for y in range(n1):
            for x in range(n2):
                missing = _gather(labels, z, y, x, corners)
                slots = _slots(corners, missing, tables) if missing < 8 else 0
                if slots == 0:
                    continue
                numbers[z & 1, y * n2 + x] = (start + n_vertices) << WORD | slots
                if z + first < z1:
                    _place(tables, slots, z + first, y, x, frame, out.vertices, n_vertices)
                n_vertices += n_bits(slots)
        for y in range(n1 - 1 if z > z0 - first else 0):
            for x in range(n2 - 1):
                missing = _gather(labels, z - 1, y, x, corners)
                for t in range(6 if missing < 8 else 0):
                    begin, end = tables.rows[t, _pattern(corners, tables.tetrahedra[t])]
                    for k in range(begin, end):
                        behind, before = corners[tables.sides[k, 0]], corners[tables.sides[k, 1]]
                        turns = behind < before
                        for j in range(3):
                            corner, slot = tables.triangles[k, 2 - j if turns else j]
                            site = (y + (corner >> 1 & 1)) * n2 + x + (corner & 1)
                            number = numbers[(z - 1 + (corner >> 2)) & 1, site]
                            rank = n_bits(number & (1 << slot) - 1)
                            out.faces[n_triangles, j] = (number >> WORD) + rank
                        out.face_labels[n_triangles, 0] = np.int64(max(behind, before))
                        out.face_labels[n_triangles, 1] = np.int64(min(behind, before))
                        n_triangles += 1


@part
def _place(tables, slots, z, y, x, frame, vertices, n):
    """Put vertices in the middle of their simplices."""
    while slots:
        chain = tables.chains[lowest_bit(slots)]
        slots &= slots - 1
        n_corners = 2 + np.int64(chain[2] != chain[1]) + np.int64(chain[3] != chain[2])
        for axis in range(3):
            index = z if axis == 0 else y if axis == 1 else x
            total = 0
            for k in range(n_corners):
                total += chain[k] >> (2 - axis) & 1
            position = index + total / n_corners
            vertices[n, axis] = frame[1, axis] + frame[0, axis] * position
        n += 1
