"""An order of vertices and faces in which neighbours in space are neighbours in memory."""

import numpy as np

from tetsimplify.kernels.jit import kernel, kernel_in_place, part

N_CELLS = 2**10  # along an axis, for the order of the vertices


@part
def _spread(x):
    """Put two zeros between the bits of a number of ten bits."""
    x = (x | (x << 16)) & 0x030000FF
    x = (x | (x << 8)) & 0x0300F00F
    x = (x | (x << 4)) & 0x030C30C3
    return (x | (x << 2)) & 0x09249249


@part
def _morton(vertices, v, low, scale, most):
    """Place of a vertex on a Z-order curve (Morton 1966) through cells of a size 1 / scale."""
    code = 0
    for axis in range(3):
        cell = min(np.int64((vertices[v, axis] - low[axis]) * scale), most)
        code |= _spread(cell) << axis
    return code


@kernel
def bounds(vertices):
    """The least and the largest coordinates, as rows."""
    box = np.empty((2, 3))
    for axis in range(3):
        box[0, axis], box[1, axis] = np.inf, -np.inf
    for v in range(len(vertices)):
        for axis in range(3):
            box[0, axis] = min(box[0, axis], vertices[v, axis])
            box[1, axis] = max(box[1, axis], vertices[v, axis])
    return box


@kernel
def sort_vertices(vertices, low, scale):
    """Sort vertices along a Z-order curve through N_CELLS cells a side, and in a cell by number.

    Parameters
    ----------
    low : float64 (3,)
        The corner of the first cell.
    scale : float
        Cells in a unit of length.

    Returns
    -------
    int32 (n,)
        The vertices in their order.
    """
    n = len(vertices)
    codes = np.empty(n, np.int32)
    for v in range(n):
        codes[v] = _morton(vertices, v, low, scale, N_CELLS - 1)
    order, sorted_order = np.arange(n, dtype=np.int32), np.empty(n, np.int32)
    for shift in (0, 15):  # by the lower halves of the codes, then by the upper ones
        first = np.zeros(2**15 + 1, np.int32)
        for v in range(n):
            first[((codes[v] >> shift) & 0x7FFF) + 1] += 1
        for half in range(2**15):
            first[half + 1] += first[half]
        for i in range(n):
            half = (codes[order[i]] >> shift) & 0x7FFF
            sorted_order[first[half]] = order[i]
            first[half] += 1
        order, sorted_order = sorted_order, order
    return order


@kernel_in_place
def find_cells(vertices, faces, low, scale, most, first, last, cell, is_used):
    """Find the cells of a Z-order curve that the first corners of faces lie in.

    Parameters
    ----------
    low, scale
        As of :func:`sort_vertices`.
    most : int
        Number of the last cell along an axis.
    first, last : int
        Which faces.
    cell : int32 (m,), out
        Of each face, numbered along the curve.
    is_used : int32 (n,), out
        1 for these cells.
    """
    for f in range(first, last):
        code = _morton(vertices, faces[f, 0], low, scale, most)
        cell[f] = code
        is_used[code] = 1


@kernel_in_place
def number_cells(is_used):
    """Number the cells in use instead of marking them; return how many there are."""
    n = 0
    for code in range(is_used.size):
        if is_used[code] > 0:
            is_used[code] = n
            n += 1
    return n


@kernel_in_place
def renumber(number, first, last, cell):
    """Give the cells of faces their numbers."""
    for f in range(first, last):
        cell[f] = number[cell[f]]


@kernel
def sort_faces(faces, place):
    """Sort faces by the first of their vertices.

    Parameters
    ----------
    faces : int32 (m, 3)
    place : int32 (n,)
        Where each vertex comes in the order of the vertices.

    Returns
    -------
    order : int32 (m,)
        The faces in their order.
    arranged : int32 (m, 3)
        The same with the places of their vertices.
    """
    first = np.zeros(place.size + 1, np.int32)
    for f in range(len(faces)):
        first[min(place[faces[f, 0]], place[faces[f, 1]], place[faces[f, 2]]) + 1] += 1
    for v in range(place.size):
        first[v + 1] += first[v]
    order, arranged = np.empty(len(faces), np.int32), np.empty((len(faces), 3), np.int32)
    for f in range(len(faces)):
        a, b, c = place[faces[f, 0]], place[faces[f, 1]], place[faces[f, 2]]
        at = first[min(a, b, c)]
        first[min(a, b, c)] += 1
        order[at] = f
        arranged[at, 0], arranged[at, 1], arranged[at, 2] = a, b, c
    return order, arranged
