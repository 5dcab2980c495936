"""An order of vertices and faces in which neighbours in space are neighbours in memory."""

import numpy as np

from tetsimplify.kernels.jit import kernel, part


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
def morton_keys(vertices, low, scale, most):
    """Keys that sort vertices along a Z-order curve, and those in one cell by number.

    Parameters
    ----------
    low : float64 (3,)
        The corner of the first cell.
    scale : float
        Cells in a unit of length.
    most : int
        Number of the last cell along an axis.

    Returns
    -------
    int64 (n,)
        The number of each vertex in the lower half, the curve in the upper one.
    """
    keys = np.empty(len(vertices), np.int64)
    for v in range(len(vertices)):
        keys[v] = (_morton(vertices, v, low, scale, most) << 32) | v
    return keys


@kernel
def morton_cells(vertices, faces, low, scale, most):
    """Number the cells of a Z-order curve that first corners of faces lie in.

    Parameters
    ----------
    low, scale, most
        As of :func:`morton_keys`.

    Returns
    -------
    cell : int32 (m,)
        Of each face.
    n_cells : int
    """
    number = np.zeros((most + 1) ** 3, np.int32)
    cell = np.empty(len(faces), np.int32)
    for f in range(len(faces)):
        cell[f] = _morton(vertices, faces[f, 0], low, scale, most)
        number[cell[f]] = 1
    n_cells = 0
    for code in range(number.size):
        if number[code] > 0:
            number[code] = n_cells
            n_cells += 1
    for f in range(len(faces)):
        cell[f] = number[cell[f]]
    return cell, n_cells


@kernel
def sort_faces(faces, n_vertices):
    """The faces in the order of their first vertices, as a permutation."""
    first = np.zeros(n_vertices + 1, np.int32)
    for f in range(len(faces)):
        first[min(faces[f, 0], faces[f, 1], faces[f, 2]) + 1] += 1
    for v in range(n_vertices):
        first[v + 1] += first[v]
    order = np.empty(len(faces), np.int32)
    for f in range(len(faces)):
        v = min(faces[f, 0], faces[f, 1], faces[f, 2])
        order[first[v]] = f
        first[v] += 1
    return order
