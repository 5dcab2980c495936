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

from tetsimplify.kernels.corners import DEAD, ahead, face_of, others
from tetsimplify.kernels.jit import part
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    DOOMED,
    NESTED,
    OBSTRUCTED,
    STAMP,
    STAR,
)


@part
def gather_stars(surface, scratch, corner):
    """Collect the stars of the ends v, u of the edge that begins at `corner`.

    The corners that survive a simple contraction go to STAR, those of v first, the faces that it
    removes to DOOMED.

    Returns
    -------
    n_v, n_u, n_doomed : int
        How many there are of each.
    n_common : int
        Number of real common neighbours of v and u.
    """
    corner_vertex, next_corner, mark = surface.corner_vertex, surface.next_corner, scratch.mark
    star, doomed = scratch.lists[STAR], scratch.lists[DOOMED]
    v = corner_vertex[corner]
    u = corner_vertex[ahead(corner)]
    stamp = scratch.tally[STAMP] + 2
    scratch.tally[STAMP] = stamp

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
