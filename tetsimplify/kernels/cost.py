"""What it costs to contract an edge: its squared length, or the quadric error."""

import numpy as np

from tetsimplify.kernels.corners import ahead
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import kernel, kernel_in_place, part
from tetsimplify.kernels.placement import fixed_place, least_error
from tetsimplify.kernels.quadrics import error_bound, increase, sum_at, weight
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    ERROR_BOUND,
    LOCKED,
    MOVED_EVEN,
    RANKED,
    SETTLED,
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
    if error > (weight(quadrics, a) + weight(quadrics, b)) * error_bound(quadrics, a, b):
        return np.inf, ERROR_BOUND
    return length2 if rules.by_length else increase(quadrics, a, b, error), CONTRACTIBLE


@part
def rank_face(surface, quadrics, rules, cost, f):
    """Bring the costs of the edges of a face up to date.

    Every edge is looked at from one face only, where it begins at its lower vertex. Its other
    corner has an infinite cost.
    """
    state = surface.face_state[f]
    unchanged = (
        (state - MOVED_EVEN + 1) % 3 if state >= MOVED_EVEN else -1
    )  # opposite of what moved
    surface.face_state[f] = RANKED
    for k in range(3):
        if k == unchanged:
            continue
        corner = 3 * f + k
        a = surface.corner_vertex[corner]
        b = surface.corner_vertex[ahead(corner)]
        price, verdict = np.inf, CONTRACTIBLE
        if is_ranked(surface.loop, a, b):
            price, verdict = _ranked_cost(surface, quadrics, rules, a, b)
        cost[corner] = price
        surface.verdict[corner] = verdict


@kernel_in_place
def rank(surface, quadrics, rules, cost, first, last, step):
    """Bring the costs of every so many-th face up to date."""
    for f in range(first, last, step):
        if surface.face_state[f] != SETTLED and surface.face_state[f] != RANKED:
            rank_face(surface, quadrics, rules, cost, f)


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
