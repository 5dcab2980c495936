"""Blocks of faces, made of cells: pieces of the surface that were numbered along a curve."""

import numpy as np

from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.jit import kernel, kernel_in_place, part

SHARED = -1  # no block has all faces of the vertex
UNSEEN = -2  # no face of the vertex yet


@part
def joined(known, block):
    """The block of what is known to be in one and is in another one, too."""
    return block if known == UNSEEN or known == block else SHARED


@kernel
def fill_blocks(corner_vertex, cell, n_cells, least, vertex_block, listed):
    """Put neighbouring cells together to blocks of at least so many live faces, but for the last.

    Parameters
    ----------
    cell : int32 (m,)
        Cell of each face.
    least : int, int
        Faces in the first block and in each of the others.
    vertex_block : int32 (n,), out
        The block that has all faces of each vertex, SHARED where there are several.
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
        if filled >= least[min(n_blocks, 1)] or c + 1 == n_cells:
            begin[n_blocks + 1] = begin[n_blocks] + filled
            n_blocks += 1
            filled = 0
    place = begin[:n_blocks].copy()
    vertex_block[:] = UNSEEN
    for f in range(cell.size):
        if corner_vertex[3 * f] != DEAD:
            block = block_of[cell[f]]
            listed[place[block]] = f
            place[block] += 1
            for k in range(3):
                v = corner_vertex[3 * f + k]
                vertex_block[v] = joined(vertex_block[v], block)
    return begin[: n_blocks + 1]


@kernel_in_place
def copy_cells(corner_vertex, cell, to):
    """Copy the cells of the live faces, in order."""
    n = 0
    for f in range(cell.size):
        if corner_vertex[3 * f] != DEAD:
            to[n] = cell[f]
            n += 1
