"""Contraction of one edge, as in section 5 of Pepko and Borisenko (2023).

Both ways tell what became of the edge. With `commit` False nothing is changed. The faces around
the new vertex get the state `colour`.
"""

import numpy as np

from tetsimplify.kernels.corners import DEAD, ahead
from tetsimplify.kernels.cost import LEAST, place_of
from tetsimplify.kernels.jit import inlined, part
from tetsimplify.kernels.lens import keep_one_lens
from tetsimplify.kernels.link import gather_stars, link_condition, list_ring
from tetsimplify.kernels.placement import find_place
from tetsimplify.kernels.prefetch import prefetch_row
from tetsimplify.kernels.quadrics import (
    MAX_ERROR2,
    increase,
    is_beyond_bound,
    merge_quadrics,
    weight,
)
from tetsimplify.kernels.state import (
    BLOCK,
    CONTRACTIBLE,
    COST,
    DOOMED,
    ENOUGH,
    ERROR,
    ERROR_BOUND,
    FACTOR,
    FOLLOWER,
    INTERSECTION,
    LOCKED,
    MAX_PRICE,
    MOVED_EVEN,
    MOVED_ODD,
    N_LENS_FACES,
    N_LENS_VERTICES,
    N_LENSES,
    N_LIVE,
    N_NESTED,
    N_SIMPLE,
    N_SPARE,
    OUTSIDE,
    PLACE,
    RANKED,
    SETTLED,
    STALE_EVEN,
    STALE_ODD,
    STAR,
    TOO_DEAR,
    VIOLATE,
)
from tetsimplify.kernels.watch import follow, star_crosses


@inlined
def contract_simple(surface, quadrics, watch, scratch, rules, cost, corner, colour):
    """Contract the edge that begins at `corner` if the link condition allows it.

    NESTED when it does not; with ``blocked="violate"`` it does not matter. OUTSIDE when a face at
    one of its ends is in another block.
    """
    v = surface.corner_vertex[corner]
    u = surface.corner_vertex[ahead(corner)]
    block = scratch.tally[BLOCK]
    if surface.vertex_block[v] != block or surface.vertex_block[u] != block:
        return OUTSIDE
    if surface.locked[v] + surface.locked[u] > 1:
        return LOCKED
    if quadrics is not None:
        prefetch_row(quadrics.matrix, v)
        prefetch_row(quadrics.matrix, u)
    n_v, n_u, n_doomed, n_common = gather_stars(surface, scratch, rules, corner)
    if rules.blocked != VIOLATE:
        allowed = link_condition(surface, block, v, u, n_v, n_u, n_doomed, n_common)
        if allowed != CONTRACTIBLE:
            return allowed
    if n_doomed > scratch.tally[N_SPARE]:
        return ENOUGH
    placed = find_place(surface, quadrics, scratch, rules, v, u)
    if placed == CONTRACTIBLE and quadrics is not None:
        placed = _judge(quadrics, scratch, rules, v, u)
    if placed == CONTRACTIBLE and watch is not None:
        if star_crosses(watch, surface, scratch, v, u, n_v, n_u, n_doomed):
            placed = INTERSECTION
    if placed != CONTRACTIBLE:
        return placed
    loop = max(surface.loop[v], surface.loop[u])
    if n_doomed == 1 and loop >= 0 and surface.loop_home[loop] == block:
        surface.loop_size[loop] -= 1
    _merge(surface, quadrics, scratch, cost, v, u, n_v, n_u, n_doomed, colour)
    if watch is not None:
        follow(watch, surface, scratch.lists[STAR], n_v + n_u)
    scratch.tally[N_SIMPLE] += 1
    return CONTRACTIBLE


@inlined
def contract_nested(surface, quadrics, watch, scratch, rules, cost, outer, corner, colour, commit):
    """Contract the edge that begins at `corner` and remove the lenses beside the kept one.

    Where the link condition allows the contraction there is but one lens, which is kept.
    """
    v = surface.corner_vertex[corner]
    u = surface.corner_vertex[ahead(corner)]
    if surface.locked[v] + surface.locked[u] > 1:
        return LOCKED
    lens = keep_one_lens(surface, scratch, rules, outer, corner)
    if lens.outcome != CONTRACTIBLE:
        return lens.outcome
    list_ring(surface, scratch, lens.n_v, lens.n_u)
    placed = find_place(surface, quadrics, scratch, rules, v, u)
    if placed == CONTRACTIBLE and lens.n_doomed > scratch.tally[N_SPARE]:
        placed = ENOUGH
    if placed == CONTRACTIBLE and quadrics is not None:
        _add_removed(surface, quadrics, scratch, lens.first_removed)
        placed = _judge(quadrics, scratch, rules, v, u)
    if placed == CONTRACTIBLE and watch is not None:
        if star_crosses(watch, surface, scratch, v, u, lens.n_v, lens.n_u, lens.n_doomed):
            placed = INTERSECTION
    if placed != CONTRACTIBLE or not commit:
        return placed
    if lens.loop_size > 0:
        surface.loop_size[surface.loop[v]] = lens.loop_size
    vertex = lens.first_removed
    while vertex >= 0:
        surface.merged_into[vertex] = -1
        vertex = scratch.nodes[FOLLOWER, vertex]
    _merge(surface, quadrics, scratch, cost, v, u, lens.n_v, lens.n_u, lens.n_doomed, colour)
    if watch is not None:
        follow(watch, surface, scratch.lists[STAR], lens.n_v + lens.n_u)
    if scratch.tally[N_LENSES] > 1:
        scratch.tally[N_NESTED] += 1
        scratch.tally[N_LENS_VERTICES] += lens.n_removed
        scratch.tally[N_LENS_FACES] += lens.n_doomed
    else:
        scratch.tally[N_SIMPLE] += 1
    return CONTRACTIBLE


@part
def _judge(quadrics, scratch, rules, v, u):
    """Whether the place found, which need not be the best one, is within the bounds."""
    error = scratch.point[ERROR]
    if rules.is_bounded and is_beyond_bound(quadrics, v, u, error):
        return ERROR_BOUND
    scratch.point[COST] = increase(quadrics, v, u, error) * scratch.point[FACTOR]
    is_dear = scratch.point[COST] > scratch.point[MAX_PRICE] and not rules.by_length
    return TOO_DEAR if is_dear else CONTRACTIBLE


@part
def _add_removed(surface, quadrics, scratch, vertex):
    """Add to the error at the place what vanishes with removed lenses.

    Every vertex counts with the weight of its planes and its whole distance to the new vertex,
    which is more than the distance of the planes.
    """
    vertices, point = surface.vertices, scratch.point
    while vertex >= 0:
        distance2 = 0.0
        for axis in range(3):
            distance2 += (vertices[vertex, axis] - point[axis]) ** 2
        if distance2 > quadrics.origin[vertex, MAX_ERROR2]:
            point[ERROR] = np.inf
        point[ERROR] += distance2 * weight(quadrics, vertex)
        vertex = scratch.nodes[FOLLOWER, vertex]


@part
def _merge(surface, quadrics, scratch, cost, v, u, n_v, n_u, n_doomed, colour):
    """Bury the doomed faces and make one vertex, v, of v and u: move it, link its corners."""
    corner_vertex, lists = surface.corner_vertex, scratch.lists
    for i in range(n_doomed):
        f = lists[DOOMED, i]
        surface.face_state[f] = SETTLED
        if cost is not None:
            cost[place_of(f, LEAST)] = np.inf
        for corner in range(3 * f, 3 * f + 3):
            corner_vertex[np.uint32(corner)] = DEAD
    scratch.tally[N_LIVE] -= n_doomed
    scratch.tally[N_SPARE] -= n_doomed

    if quadrics is not None:
        merge_quadrics(surface, quadrics, scratch, v, u)
    for axis in range(3):
        surface.vertices[v, axis] = scratch.point[axis]
    surface.merged_into[u] = v
    n_merges = scratch.tally[N_SIMPLE] + scratch.tally[N_NESTED]
    if n_merges < len(surface.merges):  # of a log that is kept
        surface.merges[n_merges, 0] = u
        surface.merges[n_merges, 1] = scratch.point[PLACE]
    surface.locked[v] = max(surface.locked[v], surface.locked[u])
    surface.loop[v] = max(surface.loop[v], surface.loop[u])

    star, n = lists[STAR], n_v + n_u
    for i in range(n_v, n):
        corner_vertex[np.uint32(star[i])] = v
    following = star[0]
    for i in range(n - 1, -1, -1):
        corner = np.uint32(star[i])
        surface.next_corner[corner] = following
        following = star[i]
        f = corner // np.uint32(3)
        surface.face_state[f] = _touched(surface.face_state, corner, f, colour)
        if cost is not None:
            cost[place_of(f, LEAST)] = -np.inf


@part
def _touched(face_state, corner, f, colour):
    """The state of a face the vertex of whose corner has moved."""
    if colour < MOVED_EVEN:
        return colour
    state, k = face_state[f], np.int64(corner - np.uint32(3) * f)
    if state == RANKED or state == MOVED_EVEN + k or state == MOVED_ODD + k:
        return colour + k
    return STALE_EVEN if colour == MOVED_EVEN else STALE_ODD
