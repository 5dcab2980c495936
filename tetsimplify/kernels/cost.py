"""What it costs to contract an edge: its squared length, or the quadric error."""

import numpy as np

from tetsimplify.kernels.corners import ahead
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import kernel, kernel_in_place, part
from tetsimplify.kernels.placement import fixed_place, least_error
from tetsimplify.kernels.quadrics import (
    CONSTANT,
    increase,
    is_beyond_bound,
    reachable_optimum,
    sum_at,
    value,
)
from tetsimplify.kernels.state import (
    AT_ONCE,
    CONTRACTIBLE,
    ERROR_BOUND,
    LANES,
    LOCKED,
    MOVED_EVEN,
    PENDING,
    RANKED,
    SETTLED,
    WAITING,
)


@part
def edge_costs(vertices, corner_vertex, face):
    """Squared lengths of the edges that begin at the three corners of a face."""
    a = corner_vertex[3 * face]
    b = corner_vertex[3 * face + 1]
    c = corner_vertex[3 * face + 2]
    return (
        squared_length(vertices, a, b),
        squared_length(vertices, b, c),
        squared_length(vertices, c, a),
    )


@part
def cheapest(costs):
    """The least of the costs of three edges, and which one it is."""
    x, y, z = costs
    least = min(min(x, y), z)
    return least, 0 if x == least else 1 if y == least else 2


@part
def without(costs, k):
    """Costs of three edges of which the k-th one is out of the question."""
    x, y, z = costs
    return np.inf if k == 0 else x, np.inf if k == 1 else y, np.inf if k == 2 else z


@part
def _ranked_cost(surface, quadrics, rules, a, b):
    """Cost of the edge ab, infinite where something forbids its contraction, and what."""
    vertices = surface.vertices
    length2 = squared_length(vertices, a, b)
    if length2 >= rules.max_length2:
        return np.inf, CONTRACTIBLE
    if surface.locked[a] + surface.locked[b] > 1:
        return np.inf, LOCKED
    if quadrics is None:
        return length2, CONTRACTIBLE
    x, y, z = (
        vertices[b, 0] - vertices[a, 0],
        vertices[b, 1] - vertices[a, 1],
        vertices[b, 2] - vertices[a, 2],
    )
    fixed = fixed_place(surface, a, b)
    error = least_error(sum_at(quadrics, vertices, a, b), x, y, z, fixed, rules)[4]
    if rules.is_bounded and is_beyond_bound(quadrics, a, b, error):
        return np.inf, ERROR_BOUND
    return length2 if rules.by_length else increase(quadrics, a, b, error), CONTRACTIBLE


@part
def rank_faces(surface, quadrics, rules, cost, scratch, n_faces):
    """Bring the costs of the edges of the faces WAITING up to date, but of those that are RANKED.

    Every edge is looked at from one face only, where it begins at its lower vertex. Its other
    corner has an infinite cost. Where the optimum decides, LANES edges are computed side by side.
    """
    waiting, pending = scratch.lists[WAITING], scratch.lists[PENDING]
    side_by_side = quadrics is not None and rules.optimum
    corner_vertex, n_pending = surface.corner_vertex, 0
    for i in range(n_faces):
        f = waiting[i]
        state = surface.face_state[f]
        if state == RANKED:
            continue
        surface.face_state[f] = RANKED
        unchanged = (state - MOVED_EVEN + 1) % 3 if state >= MOVED_EVEN else -1
        for k in range(3):
            if k == unchanged:
                continue
            corner = 3 * f + k
            a, b = corner_vertex[corner], corner_vertex[ahead(corner)]
            cost[corner] = np.inf
            surface.verdict[corner] = CONTRACTIBLE
            if not side_by_side or is_special(surface, a, b):
                if is_ranked(surface.loop, a, b):
                    cost[corner], surface.verdict[corner] = _ranked_cost(
                        surface, quadrics, rules, a, b
                    )
                continue
            pending[n_pending] = corner
            n_pending += a < b
    if side_by_side:
        for i in range(0, n_pending, LANES):
            corners = pending[i : min(i + LANES, n_pending)]
            _rank_side_by_side(surface, quadrics, rules, cost, corners, scratch.lanes)


@part
def is_special(surface, a, b):
    """Whether the place of the edge ab is fixed, or it is forbidden: which is looked at alone."""
    loop, locked = surface.loop, surface.locked
    return (loop[a] >= 0) | (loop[b] >= 0) | (locked[a] != 0) | (locked[b] != 0)


@part
def _rank_side_by_side(surface, quadrics, rules, cost, corners, lanes):
    """Find the costs of at most LANES edges, at the places of least error."""
    corner_vertex, vertices = surface.corner_vertex, surface.vertices
    for j in range(corners.size):
        a = np.uint32(corner_vertex[corners[j]])
        b = np.uint32(corner_vertex[ahead(corners[j])])
        (
            lanes[j], lanes[LANES + j], lanes[2 * LANES + j], lanes[3 * LANES + j],
            lanes[4 * LANES + j], lanes[5 * LANES + j], lanes[6 * LANES + j],
            lanes[7 * LANES + j], lanes[8 * LANES + j], lanes[9 * LANES + j],
        ) = sum_at(quadrics, vertices, a, b)  # fmt: skip
        lanes[10 * LANES + j] = vertices[b, 0] - vertices[a, 0]
        lanes[11 * LANES + j] = vertices[b, 1] - vertices[a, 1]
        lanes[12 * LANES + j] = vertices[b, 2] - vertices[a, 2]
        lanes[13 * LANES + j] = quadrics.linear[a, CONSTANT] + quadrics.linear[b, CONSTANT]
    for j in range(LANES):
        q = (
            lanes[j], lanes[LANES + j], lanes[2 * LANES + j], lanes[3 * LANES + j],
            lanes[4 * LANES + j], lanes[5 * LANES + j], lanes[6 * LANES + j],
            lanes[7 * LANES + j], lanes[8 * LANES + j], lanes[9 * LANES + j],
        )  # fmt: skip
        ex, ey, ez = lanes[10 * LANES + j], lanes[11 * LANES + j], lanes[12 * LANES + j]
        x, y, z, is_near = reachable_optimum(q, ex, ey, ez)
        length2, error = ex * ex + ey * ey + ez * ez, value(q, x, y, z)
        increase = max(error - lanes[13 * LANES + j], 0.0)
        lanes[13 * LANES + j] = error
        lanes[14 * LANES + j] = length2 if rules.by_length else increase
        lanes[15 * LANES + j] = 1.0 if is_near & (length2 < rules.max_length2) else 0.0
    for j in range(corners.size):
        corner = corners[j]
        cost[corner] = lanes[14 * LANES + j]
        is_found = lanes[15 * LANES + j] != 0.0
        if is_found and not rules.is_bounded:
            continue
        a, b = corner_vertex[corner], corner_vertex[ahead(corner)]
        if not is_found or is_beyond_bound(quadrics, a, b, lanes[13 * LANES + j]):
            cost[corner], surface.verdict[corner] = _ranked_cost(surface, quadrics, rules, a, b)


@kernel_in_place
def rank(surface, quadrics, rules, cost, scratch, first, last, step):
    """Bring the costs of every so many-th face up to date."""
    waiting = scratch.lists[WAITING]
    for begin in range(first, last, step * AT_ONCE):
        n = 0
        for f in range(begin, min(begin + step * AT_ONCE, last), step):
            waiting[n] = f
            n += surface.face_state[f] != SETTLED
        rank_faces(surface, quadrics, rules, cost, scratch, n)


@kernel
def count_cheaper(cost, listed, blocks, threshold):
    """How many edges of each block cost less than a threshold."""
    n_cheaper = np.zeros(len(blocks), np.int64)
    for b in range(len(blocks)):
        for i in range(blocks[b, 0], blocks[b, 1]):
            for corner in range(3 * listed[i], 3 * listed[i] + 3):
                n_cheaper[b] += cost[corner] < threshold
    return n_cheaper


@part
def is_ranked(loop, a, b):
    """Whether an edge is looked at from the corner where it begins at a and leads to b."""
    return a < b or (loop[a] >= 0 and loop[a] == loop[b])  # on a boundary there is no other corner
