"""Blocks of faces, made of cells: pieces of the surface that were numbered along a curve."""

import numpy as np

from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.jit import kernel_in_place, part

SHARED = -1  # no block has all faces of the vertex


@part
def _cell_of(cells, f):
    """The cell of a face; the run that it is in, where there is no list of cells."""
    cell, bits = cells
    return np.uint32(cell[np.uint32(f)]) if cell.size else np.uint32(f >> bits)


@part
def _is_live(corner_vertex, f):
    """Whether a face is live."""
    return corner_vertex[np.uint32(3) * np.uint32(f)] != DEAD


@kernel_in_place
def count_live(corner_vertex, cells, first, last, n_faces):
    """Count the live ones of the faces from `first` to `last` in each cell."""
    for f in range(first, last):
        if _is_live(corner_vertex, f):
            n_faces[_cell_of(cells, f)] += 1


@kernel_in_place
def put_in_blocks(n_faces, least, block_of, first_cell):
    """Put neighbouring cells together to blocks of at least so many faces, but for the last.

    Parameters
    ----------
    n_faces : int32 (n_parts, n_cells)
        Live faces of each cell that each part of the faces has.
    least : int, int
        Faces in the first block and in each of the others.
    block_of : int32 (n_cells,), out
    first_cell : int32 (n_cells + 1,), out
        Of each block, and after the last one the number of cells.

    Returns
    -------
    int
        Number of blocks.
    """
    n_blocks, filled = 0, 0
    first_cell[0] = 0
    for c in range(block_of.size):
        block_of[c] = n_blocks
        for p in range(len(n_faces)):
            filled += n_faces[p, c]
        if filled >= least[min(n_blocks, 1)] or c + 1 == block_of.size:
            n_blocks, filled = n_blocks + 1, 0
            first_cell[n_blocks] = c + 1
    return n_blocks


@kernel_in_place
def place_in_list(n_faces, first_cell, place, begin):
    """Tell where each part lists its faces of each block, and where the blocks begin.

    Parameters
    ----------
    n_faces : int32 (n_parts, n_cells)
    first_cell : int32 (n_blocks + 1,)
        As of :func:`put_in_blocks`.
    place : int32 (n_parts, n_cells), out
        In the column of the number of the block.
    begin : int64 (n_blocks + 1,), out
    """
    n = 0
    for block in range(begin.size - 1):
        begin[block] = n
        for p in range(len(n_faces)):
            place[p, block] = n
            for c in range(first_cell[block], first_cell[block + 1]):
                n += n_faces[p, c]
    begin[begin.size - 1] = n


@kernel_in_place
def list_faces(corner_vertex, cells, block_of, first, last, place, listed):
    """List live faces block by block."""
    for f in range(first, last):
        if _is_live(corner_vertex, f):
            block = np.uint32(block_of[_cell_of(cells, f)])
            listed[np.uint32(place[block])] = f
            place[block] += 1


@kernel_in_place
def note_blocks(corner_vertex, cells, block_of, first, last, vertex_block):
    """Note a block of each vertex: any of those that it is in."""
    for f in range(first, last):
        if _is_live(corner_vertex, f):
            block, corner = block_of[_cell_of(cells, f)], np.uint32(3) * np.uint32(f)
            for _ in range(3):
                vertex_block[np.uint32(corner_vertex[corner])] = block
                corner += np.uint32(1)


@kernel_in_place
def find_shared(corner_vertex, cells, block_of, first, last, vertex_block):
    """Find the vertices that have faces in another block than the one noted."""
    for f in range(first, last):
        if _is_live(corner_vertex, f):
            block, corner = block_of[_cell_of(cells, f)], np.uint32(3) * np.uint32(f)
            for _ in range(3):
                v = np.uint32(corner_vertex[corner])
                if vertex_block[v] != block:
                    vertex_block[v] = SHARED
                corner += np.uint32(1)
