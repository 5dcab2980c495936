"""Blocks of faces, made of cells: pieces of the surface that were numbered along a curve."""

import numpy as np

from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.jit import kernel, kernel_in_place

GONE = -1  # no block: the face is dead


@kernel
def fill_blocks(corner_vertex, cell, n_cells, least, face_block, listed):
    """Put neighbouring cells together to blocks of at least so many live faces, but for the last.

    Parameters
    ----------
    cell : int32 (m,)
        Cell of each face.
    least : int
    face_block : int32 (m,), out
        Block of each face, GONE where it is dead.
    listed : int32 (m,), out
        The live faces, block by block.

    Returns
    -------
    int64 (n_blocks + 1,)
        Where the faces of each block begin in `listed`.
    """
    n_faces = np.zeros(n_cells, np.int32)
    for f in range(cell.size):
        if corner_vertex[3 * f] != DEAD:
            n_faces[cell[f]] += 1
    block_of = np.empty(n_cells, np.int32)
    begin = np.zeros(n_cells + 1, np.int64)
    n_blocks, filled = 0, 0
    for c in range(n_cells):
        block_of[c] = n_blocks
        filled += n_faces[c]
        if filled >= least or c + 1 == n_cells:
            begin[n_blocks + 1] = begin[n_blocks] + filled
            n_blocks += 1
            filled = 0
    place = begin[:n_blocks].copy()
    for f in range(cell.size):
        face_block[f] = GONE
        if corner_vertex[3 * f] != DEAD:
            block = block_of[cell[f]]
            face_block[f] = block
            listed[place[block]] = f
            place[block] += 1
    return begin[: n_blocks + 1]


@kernel_in_place
def copy_cells(corner_vertex, cell, to):
    """Copy the cells of the live faces, in order."""
    n = 0
    for f in range(cell.size):
        if corner_vertex[3 * f] != DEAD:
            to[n] = cell[f]
            n += 1
