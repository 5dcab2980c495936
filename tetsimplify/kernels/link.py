r"""The link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999), boundaries coned.

An edge vu with the faces vua and vub may be contracted as it is when its ends have no common
neighbours but a and b, and the links of v and u share no edge (which only happens in a
tetrahedron, or with the cone in a single triangle):

              a                  A boundary loop counts as joined to one virtual vertex.
            / | \                So a boundary edge has it as second apex, and two boundary
           v--+--u               vertices on one loop have it as a common neighbour.
            \ | /
              b
"""

import numpy as np

from tetsimplify.kernels.corners import DEAD, ahead, face_of, others, vertex_behind
from tetsimplify.kernels.jit import cold_part, part
from tetsimplify.kernels.prefetch import prefetch_row
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    DOOMED,
    N_GAPS,
    NESTED,
    OBSTRUCTED,
    RING_ALL,
    RING_V,
    STAMP,
    STAR,
    VIOLATE,
)


@part
def gather_stars(surface, scratch, rules, corner):
    """Collect the stars of the ends v, u of the edge that begins at `corner`.

    The corners that survive a simple contraction go to STAR, those of v first, the faces that it
    removes to DOOMED, and the vertices around both ends to the ring.

    Returns
    -------
    n_v, n_u, n_doomed : int
        How many there are of each.
    n_common : int
        Number of real common neighbours of v and u.
    """
    v = surface.corner_vertex[corner]
    u = surface.corner_vertex[ahead(corner)]
    stamp = scratch.tally[STAMP] + 2
    scratch.tally[STAMP] = stamp
    if surface.loop[v] < 0 and surface.loop[u] < 0 and rules.blocked != VIOLATE:
        return _go_around(surface, scratch, corner, v, u, stamp)
    n_v, n_u, n_doomed, n_common = _gather_in_any_order(surface, scratch, corner, v, u, stamp)
    list_ring(surface, scratch, n_v, n_u)
    return n_v, n_u, n_doomed, n_common


@part
def _go_around(surface, scratch, corner, v, u, stamp):
    r"""Collect the stars of two vertices inside the surface: around v, then around u.

       x -- .            The corners of v begin after the face vux and end before vyu,
     / | \   \           those of u begin after vyu and end before vux. So the vertices
    .  v--u   .          behind them lead from x to y and back to x.
     \ | /   /
       y -- .
    """
    corner_vertex, next_corner, mark = surface.corner_vertex, surface.next_corner, scratch.mark
    star, doomed, ring = scratch.lists[STAR], scratch.lists[DOOMED], scratch.ring[0]
    x = vertex_behind(corner_vertex, corner)
    doomed[0] = face_of(corner)
    ring[0] = x
    n, one = np.uint32(0), np.uint32(1)
    c = next_corner[np.uint32(corner)]
    while True:
        p = vertex_behind(corner_vertex, c)
        star[n] = c
        ring[n + one] = p
        if p == u:
            break
        n += np.uint32(p != DEAD)
        p = np.uint32(p if p != DEAD else v)
        mark[p] = stamp
        prefetch_row(surface.vertices, p)  # the guards read it
        c = next_corner[np.uint32(c)]
    doomed[1] = face_of(c)
    n_v = n
    y = ring[n]

    n_common = 2
    c = next_corner[np.uint32(ahead(corner))]
    while True:
        p = vertex_behind(corner_vertex, c)
        star[n] = c
        ring[n + one] = p
        p = p if p != DEAD else y
        n += np.uint32(p != y)
        n_common += (p != y) & (mark[np.uint32(p)] == stamp)
        prefetch_row(surface.vertices, np.uint32(p))
        if p == x:
            break
        c = next_corner[np.uint32(c)]
    scratch.tally[RING_V], scratch.tally[RING_ALL], scratch.tally[N_GAPS] = n_v, n, 0
    return np.int64(n_v), np.int64(n) - np.int64(n_v), 2, n_common


@cold_part
def _gather_in_any_order(surface, scratch, corner, v, u, stamp):
    """The same for vertices on the boundary, or whose corners are in no order."""
    corner_vertex, next_corner, mark = surface.corner_vertex, surface.next_corner, scratch.mark
    star, doomed = scratch.lists[STAR], scratch.lists[DOOMED]
    n_v = 0
    n_doomed = 0
    c = corner
    while True:
        n, p = others(corner_vertex, c)
        if n != DEAD:
            mark[np.uint32(n)] = stamp
            mark[np.uint32(p)] = stamp
            is_doomed = (n == u) | (p == u)
            doomed[n_doomed] = face_of(c)
            n_doomed += is_doomed
            star[n_v] = c
            n_v += 1 - is_doomed
        c = next_corner[np.uint32(c)]
        if c == corner:
            break

    n_u = 0
    n_common = 0
    start = ahead(corner)
    c = start
    while True:
        n, p = others(corner_vertex, c)
        if n != DEAD:
            is_common = mark[np.uint32(n)] == stamp
            mark[np.uint32(n)] -= is_common
            n_common += is_common
            is_common = mark[np.uint32(p)] == stamp
            mark[np.uint32(p)] -= is_common
            n_common += is_common
            star[n_v + n_u] = c
            n_u += (n != v) & (p != v)
        c = next_corner[np.uint32(c)]
        if c == start:
            break
    return n_v, n_u, n_doomed, n_common


@cold_part
def list_ring(surface, scratch, n_v, n_u):
    """List the vertices around the faces of STAR, and between which of them there is no face.

    The i-th step of the ring is from its i-th vertex to the next one: along a face, or a gap. Faces
    that follow one another share a vertex, as they do but for gaps where corners are in order.
    """
    star, ring, gaps = scratch.lists[STAR], scratch.ring[0], scratch.ring[1]
    n_steps = n_gaps = n_steps_v = 0
    for i in range(n_v + n_u):
        if i == n_v:
            n_steps_v = n_steps
        n, p = others(surface.corner_vertex, star[i])
        if i > 0 and ring[n_steps] != n:
            gaps[n_gaps] = n_steps
            n_gaps += 1
            n_steps += 1
        ring[n_steps] = n
        ring[n_steps + 1] = p
        n_steps += 1
    scratch.tally[RING_V] = n_steps_v if n_u > 0 else n_steps
    scratch.tally[RING_ALL], scratch.tally[N_GAPS] = n_steps, n_gaps


@part
def link_condition(surface, block, v, u, n_v, n_u, n_doomed, n_common):
    """Whether a simple contraction is allowed: CONTRACTIBLE, NESTED or OBSTRUCTED.

    A boundary loop has to keep three edges. One that runs through several blocks does: each of
    the vertices between them stays, and so do the last two edges of a run between two of these.
    """
    loop_v, loop_u = surface.loop[v], surface.loop[u]
    if n_doomed == 1:  # a boundary edge
        is_long = surface.loop_home[loop_v] != block or surface.loop_size[loop_v] > 3
        return CONTRACTIBLE if n_common == 1 and is_long else NESTED
    if loop_v >= 0 and loop_u >= 0:  # two loops would be pinched together
        return NESTED if loop_v == loop_u else OBSTRUCTED
    is_tetrahedron = n_v == 1 and n_u == 1 and loop_v < 0 and loop_u < 0
    return CONTRACTIBLE if n_common == 2 and not is_tetrahedron else NESTED
