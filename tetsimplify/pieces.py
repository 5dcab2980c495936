r"""Pieces of a surface that is simplified before all of it is there.

A piece is the surface of some planes of a volume. It is open where its neighbours join on: there
the faces around a vertex are not all known. Such *open* vertices are locked, and so are their
neighbours. What is free then has neighbours that are known entirely, and so has all that it is
merged with: whether an edge can be contracted is decided exactly as in the whole surface::

    o-----o-----o-----o     open: faces above are missing           locked
     \   / \   / \   / \
      +---+---+---+---+     around them: all faces are known        locked
       \ / \ / \ / \ /
        *---*---*---*       as well, and all those of neighbours    free

Open vertices stay open until the next piece is joined on, and all faces around them stay what they
were, since all their vertices are locked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.arrays import MAX_CORNERS
from tetsimplify.engine import Engine
from tetsimplify.errors import VolumeError
from tetsimplify.march import Raw, Rows
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options
from tetsimplify.schedule import run

Indices = NDArray[np.int32]

REACH = 2.0  # edges of a length are contracted where that many lengths away all is known
MARGIN = 1.0  # lengths more, so that what is finished has been looked at from all sides
N_RINGS = 4  # around what is open are kept to be contracted with the next piece
FAR = np.int8(100)
FIXED = 2  # vertices that stay and are merged with none
NO_VERTICES, NO_FACES = np.empty((0, 3)), np.empty((0, 3), np.int32)
COUNTERS = ("N_SIMPLE", "N_NESTED", "N_LENS_VERTICES", "N_LENS_FACES")


class Piece(NamedTuple):
    """A part of the surface at work."""

    vertices: NDArray[np.float64]
    faces: Indices
    below: Indices
    """Shape (k,): the vertices on the first plane, in the order of their lattice edges; -1 where
    no face uses one."""
    above: Indices
    """Shape (l,): the same for the plane behind the last one."""
    number: Indices
    """Shape (n,): number of each vertex in the result, -1 for those that are not there yet. Faces
    at the others are, in part or all."""
    span: tuple[float, float]
    """Where along the first axis the planes are behind which faces are missing, infinite where
    there are none."""
    done: NDArray[np.int64]
    """Shape (4,): how much the `COUNTERS` have counted."""


class Finished:
    """Collects the parts of the surface that nothing is to be joined on to any more."""

    def __init__(self) -> None:
        self._vertices, self._faces = Rows(np.float64, 3), Rows(np.int32, 3)
        self.done = np.zeros(len(COUNTERS), np.int64)

    def add(self, vertices: NDArray[np.float64], faces: Indices) -> None:
        """Append vertices, and faces that use these and those before."""
        for rows, new in ((self._vertices, vertices), (self._faces, faces)):
            begin = rows.n_rows
            if (begin + len(new)) * (3 if new is faces else 1) > MAX_CORNERS:
                raise VolumeError(f"the surface has more than {MAX_CORNERS:,} corners")
            rows.extend(begin + len(new))
            rows.rows[begin:] = new

    @property
    def n_vertices(self) -> int:
        """How many vertices there are."""
        return self._vertices.n_rows

    def mesh(self) -> Mesh:
        """Hand over all of it."""
        return Mesh(self._vertices.finish(), self._faces.finish())


def piece_of(raw: Raw, span: tuple[float, float]) -> Piece:
    """The surface of a block of planes."""
    n = len(raw.vertices)
    return Piece(
        raw.vertices,
        raw.faces,
        np.arange(raw.n_below, dtype=np.int32),
        np.arange(n - raw.n_above, n, dtype=np.int32),
        np.full(n, -1, np.int32),
        span,
        np.zeros(len(COUNTERS), np.int64),
    )


def empty_piece() -> Piece:
    """A piece of nothing."""
    return piece_of(Raw(NO_VERTICES, NO_FACES, 0, 0), (-np.inf, np.inf))


def contracted(box: list[Piece], options: Options, lengths: Sequence[float]) -> Piece:
    """Contract the edges of a piece, up to each of some lengths in turn.

    The longer the edges, the farther they have to be from what is missing: so the surface becomes
    finer and finer towards it, and what is missing is joined to a surface as fine as itself. At a
    border between fine and coarse the coarse vertices would take up the fine ones one by one, and
    move on, and the seam would come out coarser than the rest.

    The piece is taken out of its box, so that its memory can be let go of on the way.
    """
    for length in lengths:
        box.append(_contracted_to(length, box, replace(options, max_edge_length=length)))
    return box.pop()


def _contracted_to(length: float, box: list[Piece], options: Options) -> Piece:
    """Contract the edges of a piece up to one length, for whose ends all neighbours are known."""
    piece = box.pop()
    n = len(piece.vertices)
    ring = np.full(n, FAR)
    for opening in (piece.below, piece.above):
        ring[opening[opening >= 0]] = 0
    ring[piece.number >= 0] = 0
    is_open = np.flatnonzero(ring == 0).astype(np.int32)
    corner_vertex = piece.faces.flatten()
    kernels.frontier.spread_rings(corner_vertex, ring, 1)
    locked = (ring <= 1) | (_clearance(piece) < REACH * length)
    if locked[corner_vertex].all():
        return piece

    origin = _split_fans(corner_vertex, is_open, n)
    vertices = np.concatenate([piece.vertices, piece.vertices[origin]])
    held = np.full(len(vertices), FIXED, np.uint8)
    held[:n] *= locked
    piece = piece._replace(vertices=NO_VERTICES, faces=NO_FACES)  # which the engine copies
    engine = Engine(Mesh(vertices, corner_vertex.reshape(-1, 3)), options, held, threads=1)
    del vertices, corner_vertex
    engine.is_part = True
    run(engine)
    result = engine.result
    new = np.append(result.vertex_map, np.int32(-1))  # to be found by the index -1, too
    same = np.arange(len(result.vertices), dtype=np.int32)
    same[new[n : n + len(origin)]] = new[origin]
    number = np.full(len(result.vertices), -1, np.int32)
    kept = is_open[piece.number[is_open] >= 0]
    number[new[kept]] = piece.number[kept]
    return Piece(
        result.vertices,
        same[result.faces],
        new[piece.below],
        new[piece.above],
        number,
        piece.span,
        piece.done + np.array([engine.tally(name) for name in COUNTERS]),
    )


def _clearance(piece: Piece) -> NDArray[np.float64]:
    """How far each vertex is from the planes behind which something is missing, at least."""
    low, high = piece.span
    along = piece.vertices[:, 0]
    return np.minimum(along - low, high - along)


def _split_fans(corner_vertex: Indices, vertices: Indices, n_vertices: int) -> Indices:
    """Make a manifold of a piece, which may hang together in an open vertex only.

    Returns the vertices that the new ones, which follow the others, are copies of.
    """
    first_corner, next_corner, longest = kernels.corners.link_corners(corner_vertex, n_vertices)
    is_looked_at = np.zeros(n_vertices, np.bool_)
    is_looked_at[vertices] = True
    origin = np.empty(np.count_nonzero(is_looked_at[corner_vertex]), np.int32)
    fan, corners = np.empty((2, longest), np.int32)
    n_copies = kernels.frontier.split_fans(
        vertices, first_corner, next_corner, corner_vertex, fan, corners, origin, n_vertices
    )
    return origin[:n_copies]


def joined(last: Piece, piece: Piece) -> Piece:
    """Make one of two neighbours; what is open between them is known by its lattice edges."""
    new = np.full(len(piece.vertices) + 1, -1, np.int32)  # -1 leads to -1
    is_shared = (last.above >= 0) & (piece.below >= 0)
    new[piece.below[is_shared]] = last.above[is_shared]
    is_own = new[:-1] < 0
    new[:-1][is_own] = len(last.vertices) + np.arange(np.count_nonzero(is_own))
    return Piece(
        np.concatenate([last.vertices, piece.vertices[is_own]]),
        np.concatenate([last.faces, new[piece.faces]]),
        np.empty(0, np.int32),
        new[piece.above],
        np.concatenate([last.number, piece.number[is_own]]),
        (-np.inf, piece.span[1]),
        last.done + piece.done,
    )


def released(piece: Piece, finished: Finished, length: float) -> Piece:
    """Move what is done and far from all that is open to the result, and hand back the rest.

    What is done is at least so far that edges of this length were contracted.
    """
    ring = np.full(len(piece.vertices), FAR)
    ring[piece.above[piece.above >= 0]] = 0
    corner_vertex = piece.faces.reshape(-1)
    kernels.frontier.spread_rings(corner_vertex, ring, N_RINGS)
    is_near = (ring <= N_RINGS) | (_clearance(piece) < (REACH + MARGIN) * length)
    is_kept = is_near[piece.faces].any(axis=1)

    faces = piece.faces[~is_kept]
    is_new = np.zeros(len(piece.vertices), np.bool_)
    is_new[faces] = True
    is_new &= piece.number < 0
    number = piece.number.copy()
    number[is_new] = finished.n_vertices + np.arange(np.count_nonzero(is_new))
    finished.add(piece.vertices[is_new], number[faces])
    finished.done += piece.done

    faces = piece.faces[is_kept]
    is_used = np.zeros(len(piece.vertices), np.bool_)
    is_used[faces] = True
    new = np.full(len(piece.vertices) + 1, -1, np.int32)  # -1 leads to -1
    new[:-1][is_used] = np.arange(np.count_nonzero(is_used))
    return Piece(
        piece.vertices[is_used],
        new[faces],
        np.empty(0, np.int32),
        new[piece.above],
        number[is_used],
        piece.span,
        np.zeros(len(COUNTERS), np.int64),
    )
