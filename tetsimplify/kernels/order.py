"""An order of vertices and faces in which neighbours in space are neighbours in memory."""

import numpy as np

from tetsimplify.kernels.jit import kernel, kernel_in_place, part

N_CELLS = 2**10  # along an axis, for the order of the vertices
DIGIT = 15  # bits: vertices are sorted by two digits


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
        cell = np.int64((vertices[v, axis] - low[axis]) * scale)
        cell = min(max(cell, 0), most)  # of what overflows, too
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


@kernel_in_place
def find_codes(vertices, low, scale, first, last, coded):
    """Find the places of vertices on a Z-order curve through N_CELLS cells a side.

    Parameters
    ----------
    low : float64 (3,)
        The corner of the first cell.
    scale : float
        Cells in a unit of length.
    first, last : int
        Which vertices.
    coded : int64 (n,), out
        The place, in the upper half, and the number of the vertex.
    """
    for v in range(first, last):
        coded[v] = np.int64(_morton(vertices, v, low, scale, N_CELLS - 1)) << 32 | v


@part
def _digit(coded, shift):
    """DIGIT bits of a place on the curve."""
    return (coded >> (32 + shift)) & (2**DIGIT - 1)


@kernel_in_place
def count_digits(coded, shift, first, last, n):
    """Count how often each digit occurs."""
    for i in range(first, last):
        n[np.uint32(_digit(coded[i], shift))] += 1


@kernel_in_place
def sort_by_digit(coded, shift, first, last, begin, to):
    """Sort by a digit, and what has the same one in the order in which it is."""
    for i in range(first, last):
        digit = np.uint32(_digit(coded[i], shift))
        to[np.uint32(begin[digit])] = coded[i]
        begin[digit] += 1


@kernel_in_place
def number_in_order(coded, vertices, first, last, origin, place, to):
    """Tell vertices their numbers in the order of the codes, and copy them there."""
    for i in range(first, last):
        v = np.int32(coded[i] & 0x7FFFFFFF)
        origin[i] = v
        place[np.uint32(v)] = i
        for axis in range(3):
            to[i, axis] = vertices[np.uint32(v), axis]


@kernel_in_place
def find_cells(vertices, low, scale, most, first, last, cell):
    """Find the cells of a Z-order curve that vertices lie in.

    Parameters
    ----------
    low, scale
        As of :func:`find_codes`.
    most : int
        Number of the last cell along an axis.
    first, last : int
        Which vertices.
    cell : int32 (n,), out
        Numbers along the curve.
    """
    for v in range(first, last):
        cell[v] = _morton(vertices, v, low, scale, most)


@kernel_in_place
def take_cells(faces, of_vertices, first, last, cell, is_used):
    """Give faces the cells of their first corners.

    Parameters
    ----------
    of_vertices : int32 (n,)
    first, last : int
        Which faces.
    cell : int32 (m,), out
    is_used : int32, out
        1 for these cells.
    """
    for f in range(first, last):
        cell[f] = of_vertices[np.uint32(faces[f, 0])]
        is_used[np.uint32(cell[f])] = 1


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
        cell[f] = number[np.uint32(cell[f])]


@part
def _places(faces, place, f):
    """The places of the vertices of a face."""
    f = np.uint32(f)
    return (
        place[np.uint32(faces[f, 0])],
        place[np.uint32(faces[f, 1])],
        place[np.uint32(faces[f, 2])],
    )


@kernel_in_place
def count_groups(faces, place, shift, first, last, n):
    """Count the faces whose first corners are among each 2**shift vertices in order."""
    for f in range(first, last):
        a, b, c = _places(faces, place, f)
        n[np.uint32(min(a, b, c) >> shift)] += 1


@kernel_in_place
def sort_by_group(faces, place, shift, first, last, begin, origin, to):
    """Sort faces so that those come together whose first corners do.

    Parameters
    ----------
    faces : int32 (m, 3)
    place : int32 (n,)
        Where each vertex comes in the order of the vertices.
    shift : int
        As of :func:`count_groups`.
    first, last : int
        Which faces.
    begin : int32
        Where they go, by the group.
    origin : int32 (m,), out
        The faces in their order.
    to : int32 (m, 3), out
        The same with the places of their vertices.
    """
    for f in range(first, last):
        a, b, c = _places(faces, place, f)
        group = np.uint32(min(a, b, c) >> shift)
        at = np.uint32(begin[group])
        begin[group] += 1
        origin[at] = f
        to[at, 0], to[at, 1], to[at, 2] = a, b, c
