"""What it costs to contract an edge: its squared length, or the quadric error."""

import numpy as np

from tetsimplify.kernels.corners import ahead
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import cold_part, kernel, kernel_in_place, part
from tetsimplify.kernels.placement import fixed_place, least_error
from tetsimplify.kernels.quadrics import error_bound, increase, sum_at, weight
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    ERROR_BOUND,
    LOCKED,
    MOVED,
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
def cheapest_first(costs):
    """The three edges in the order of their costs."""
    x, y, z = costs
    if x <= y:
        if y <= z:
            return 0, 1, 2
        return (0, 2, 1) if x <= z else (2, 0, 1)
    if x <= z:
        return 1, 0, 2
    return (1, 2, 0) if y <= z else (2, 1, 0)


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
    terms = quadrics
    x, y, z = (
        vertices[b, 0] - vertices[a, 0],
        vertices[b, 1] - vertices[a, 1],
        vertices[b, 2] - vertices[a, 2],
    )
    fixed = fixed_place(surface, a, b)
    error = least_error(sum_at(terms, vertices, a, b), x, y, z, fixed, rules)[4]
    if error > (weight(terms, a) + weight(terms, b)) * error_bound(quadrics, a, b):
        return np.inf, ERROR_BOUND
    return length2 if rules.by_length else increase(terms, a, b, error), CONTRACTIBLE


@cold_part
def rank_faces(surface, quadrics, rules, cost, listed, first, last):
    """Bring the costs of the faces listed from `first` to `last` up to date.

    Every edge is looked at from one face only, where it begins at its lower vertex. Its other
    corner has an infinite cost.
    """
    for i in range(first, last):
        f = listed[i]
        state = surface.face_state[f]
        if state == RANKED or state == SETTLED:
            continue
        surface.face_state[f] = RANKED
        opposite = (state - MOVED + 1) % 3 if state >= MOVED else -1  # which has not changed
        for k in range(3):
            if k == opposite:
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
def rank(surface, quadrics, rules, cost, listed, first, last):
    """:func:`rank_faces`, for Python."""
    rank_faces(surface, quadrics, rules, cost, listed, first, last)


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
