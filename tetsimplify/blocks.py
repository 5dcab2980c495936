"""Blocks: compact pieces of the surface, which threads work on side by side.

An edge belongs to a block when all faces at its ends do. So no two blocks touch the same face or
move the same vertex, and they need no locks. What lies between blocks is done next time, when the
surface is divided in another way. Blocks depend on the mesh alone, never on the number of threads.

A block is a row of an array of shape (k, 4): where the faces to look at begin and end in a list,
how many faces may go, and the number of the block.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew, part_size
from tetsimplify.locality import IN_ORDER, Arrangement
from tetsimplify.mesh import Mesh

FACES = 2**13  # in a block, at least: what their contraction needs fits the cache of a core
RUN = 2**16  # faces in a block of faces as they are given, at least: few of them are at its ends,
LONGEST_RUN, N_RUNS = 2**17, 16  # and fewer of longer ones, where there are enough to share
CELL_BITS = 10  # blocks are made of cells of about 2**10 faces
AT_ONCE = 4  # blocks of FACES in a task for a thread, at most
MOST_SHARED = 0.2  # of the vertices of runs may be between them
UNLIMITED = 2**62  # faces that may go
MOST_BITS = 7  # of the cells along an axis
SHIFT = 1.0 / 3.0  # of the extent, by which the cells of the second way are shifted: all planes
# between them, on all levels of the curve, stay away from those of the first by a third of a cell

Blocks = NDArray[np.int64]
SPARE = 2  # the column
FEW_DEAD = 0.9  # of the faces are live: then no list is made of these


class Cells(NamedTuple):
    """The cells of the faces, in two ways. Those of the first are runs of 2**CELL_BITS faces."""

    shifted: NDArray[np.int32]
    """Shape (m,): those of the second way; IN_ORDER where they are such runs, too."""
    n_curve: int
    """How many cells there are along a curve, where they are no runs."""
    least: int
    """Faces in a block, at least."""
    first: tuple[int, int]
    """The same for the first block of each way."""
    at_once: int
    """Blocks in a task for a thread, at most."""


class Division(NamedTuple):
    """A surface divided into blocks."""

    blocks: Blocks
    listed: NDArray[np.int32]
    """The live faces block by block; IN_ORDER where these are runs of faces as they are, with a few
    dead ones among them."""


def two_ways(arranged: Arrangement, crew: Crew) -> Cells:
    """Cells of a mesh in the order of a Z-order curve.

    In the first way they follow that order, in the second one they are those of a shifted curve.
    """
    vertices, faces = arranged.vertices, arranged.faces
    n, m = len(vertices), len(faces)
    assert arranged.box is not None
    low, high = arranged.box
    extent = float((high - low).max())
    bits = min(2 + math.ceil(0.5 * math.log2(max(1.0, m / 2**CELL_BITS))), MOST_BITS)
    scale = 2.0 ** (bits - 1) / extent if extent > 0.0 else 0.0  # of a cube twice as large
    curve = low - SHIFT * extent, scale, 2**bits - 1
    of_vertices, shifted = memory.empty(n, np.int32), memory.empty(m, np.int32)
    number = np.zeros(2 ** (3 * bits), np.int32)

    def find(part: slice) -> None:
        kernels.order.find_cells(vertices, *curve, part.start, part.stop, of_vertices)

    def take(part: slice) -> None:
        kernels.order.take_cells(faces, of_vertices, part.start, part.stop, shifted, number)

    def renumber(part: slice) -> None:
        kernels.order.renumber(number, part.start, part.stop, shifted)

    crew.share(find, n, part_size(n))
    crew.share(take, m, part_size(m))
    n_shifted = int(kernels.order.number_cells(number))
    crew.share(renumber, m, part_size(m))
    return Cells(shifted, n_shifted, FACES, (FACES, FACES), AT_ONCE)


def runs(mesh: Mesh, crew: Crew) -> tuple[Cells, Division, NDArray[np.int32]] | None:
    """Cells of a mesh as it is given: its blocks are runs of faces, which are shifted by half.

    With the division in the first way, and the block of each vertex. None where faces that follow
    one another lie apart, so that much would be between the runs.
    """
    m = len(mesh.faces)
    run = max(RUN, min(m // N_RUNS, LONGEST_RUN))
    cells = Cells(IN_ORDER, 0, run, (run, run // 2), 1)
    vertex_block = memory.full(len(mesh.vertices), 0, np.int32)
    division = divide(cells, 0, mesh.faces.reshape(-1), vertex_block, IN_ORDER, crew)
    n_shared = np.count_nonzero(vertex_block == kernels.blocks.SHARED)
    if n_shared > MOST_SHARED * len(vertex_block):
        return None
    return cells, division, vertex_block


def copy_live(cells: Cells, source: NDArray[np.int32], crew: Crew) -> Cells:
    """The cells of the faces that are live.

    Parameters
    ----------
    source : ndarray, shape (n,), int32
        The faces that are live.
    """
    if not len(cells.shifted):
        return cells
    live = memory.empty(len(source), np.int32)

    def copy(part: slice) -> None:
        np.take(cells.shifted, source[part], out=live[part])

    crew.share(copy, len(source), part_size(len(source)))
    return cells._replace(shifted=live)


def divide(
    cells: Cells,
    way: int,
    corner_vertex: NDArray[np.int32],
    vertex_block: NDArray[np.int32],
    room: NDArray[np.int32],
    crew: Crew,
) -> Division:
    """Divide the live faces.

    Parameters
    ----------
    cells : Cells
    way : {0, 1}
    corner_vertex : ndarray, shape (3 m,), int32
    vertex_block : ndarray, shape (n,), int32
        Filled: the block that has all faces of each vertex, or SHARED.
    room : ndarray, shape (m,), int32
        For a list of faces, where one is needed.
    crew : Crew
    """
    cell, m = cells.shifted if way else IN_ORDER, len(corner_vertex) // 3
    of_faces, are_runs = (cell, CELL_BITS), not len(cell)
    n_cells = (m >> CELL_BITS) + 1 if are_runs else cells.n_curve
    at_once = part_size(m)
    n_faces = np.zeros((-(-m // at_once), n_cells), np.int32)
    block_of, first_cell = np.empty(n_cells, np.int32), np.empty(n_cells + 1, np.int32)

    def count(part: slice) -> None:
        row = n_faces[part.start // at_once]
        kernels.blocks.count_live(corner_vertex, of_faces, part.start, part.stop, row)

    def note(part: slice) -> None:
        kernels.blocks.note_blocks(
            corner_vertex, of_faces, block_of, part.start, part.stop, vertex_block
        )

    def find_shared(part: slice) -> None:
        kernels.blocks.find_shared(
            corner_vertex, of_faces, block_of, part.start, part.stop, vertex_block
        )

    def put(part: slice) -> None:
        row = place[part.start // at_once]
        kernels.blocks.list_faces(
            corner_vertex, of_faces, block_of, part.start, part.stop, row, room
        )

    crew.share(count, m, at_once)
    n_blocks = kernels.blocks.put_in_blocks(
        n_faces, (cells.first[way], cells.least), block_of, first_cell
    )
    first_cell = first_cell[: n_blocks + 1]
    crew.share(note, m, at_once)
    crew.share(find_shared, m, at_once)
    in_order = are_runs and n_faces.sum() > FEW_DEAD * m
    if in_order:
        begin = np.minimum(first_cell.astype(np.int64) << CELL_BITS, m)
    else:
        begin, place = np.empty(n_blocks + 1, np.int64), np.empty_like(n_faces)
        kernels.blocks.place_in_list(n_faces, first_cell, place, begin)
        crew.share(put, m, at_once)

    blocks = np.empty((n_blocks, 4), np.int64)
    blocks[:, 0], blocks[:, 1] = begin[:-1], begin[1:]
    blocks[:, SPARE] = UNLIMITED
    blocks[:, 3] = np.arange(n_blocks)
    return Division(blocks, IN_ORDER if in_order else room)


def whole(n_faces: int, n_spare: int = UNLIMITED) -> Blocks:
    """All faces as one block, from which so many may go."""
    return np.array([[0, n_faces, n_spare, 0]])


def parts(n_faces: int, at_once: int) -> Blocks:
    """All faces as one block, which is looked at in parts, one after the other."""
    first = np.arange(0, n_faces, at_once)
    blocks = whole(n_faces).repeat(len(first), axis=0)
    blocks[:, 0], blocks[:, 1] = first, np.minimum(first + at_once, n_faces)
    return blocks


def allot(blocks: Blocks, n_spare: int, n_wanted: NDArray[np.int64]) -> None:
    """Let faces go from blocks in proportion to the edges that are to be contracted there."""
    blocks[:, SPARE] = n_wanted * (n_spare / max(1, int(n_wanted.sum())))
