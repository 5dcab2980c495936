"""What it costs to contract an edge: its squared length, or the quadric error."""

import numpy as np

from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import cold_part, kernel_in_place, part
from tetsimplify.kernels.lists import item
from tetsimplify.kernels.placement import fixed_place, least_error
from tetsimplify.kernels.prefetch import prefetch_row
from tetsimplify.kernels.quadrics import (
    errors_apart,
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
    STALE_EVEN,
    STALE_ODD,
    WAITING,
)

# A row of costs: of the edges that begin at the corners of a face, and the least of these. That is
# -inf where the costs are not up to date, and inf of a face that is settled.
COLUMNS, LEAST = 4, 3
COUNTED = 2**10  # faces of a block whose costs tell how many are below a threshold
AHEAD = 24  # so many edges before they are looked at, what they need is fetched
# By the state of a face, two bits each: the corner whose two edges are to be ranked anew, or 3 for
# all edges. A table in memory, or a choice, would cost a look or a branch.
MOVED = sum(k << 2 * state for state, k in enumerate((*(3,) * MOVED_EVEN, *(0, 1, 2), *(0, 1, 2))))


@part
def edge_costs(vertices, corner_vertex, face):
    """Squared lengths of the edges that begin at the three corners of a face."""
    first = np.uint32(3) * np.uint32(face)
    a = np.uint32(corner_vertex[first])
    b = np.uint32(corner_vertex[first + np.uint32(1)])
    c = np.uint32(corner_vertex[first + np.uint32(2)])
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
    return least, np.int64(x != least) * (np.int64(1) + np.int64(y != least))


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
def place_of(f, k):
    """Where the cost of the edge from the k-th corner of a face is, or the LEAST one."""
    return np.uint32(COLUMNS) * np.uint32(f) + np.uint32(k)


@part
def least_cost(cost, f):
    """The least of the costs of a face; less than all costs where they are not up to date."""
    return cost[place_of(f, LEAST)]


@part
def costs_of(cost, f):
    """The costs of the three edges of a face."""
    return cost[place_of(f, 0)], cost[place_of(f, 1)], cost[place_of(f, 2)]


@part
def note_least(cost, f):
    """Bring the least of the costs of a face up to date."""
    cost[place_of(f, LEAST)] = cheapest(costs_of(cost, f))[0]


@part
def rank_faces(surface, quadrics, rules, cost, scratch, n_faces, colour, max_cost):
    """Bring the costs of the faces WAITING up to date, but of those that are RANKED or touched.

    Those that are RANKED then and have an edge that costs less than `max_cost` stay WAITING.

    Every edge is looked at from one face only, where it begins at its lower vertex. Its other
    corner has an infinite cost. Where the optimum decides, LANES edges are computed side by side.

    Parameters
    ----------
    n_faces : int
        How many there are.
    colour : int
        That of the sweep, which tells what it has touched; -1 for none.
    max_cost : float

    Returns
    -------
    int
        How many stay.
    """
    lists, waiting = scratch.lists, scratch.lists[WAITING]
    n_pending = 0
    for i in range(n_faces):
        f = np.uint32(waiting[i])
        state = surface.face_state[f]
        if state == RANKED or is_touched(state, colour):
            continue
        surface.face_state[f] = RANKED
        moved = (MOVED >> 2 * np.int64(state)) & 3
        k = np.uint32(moved if moved < 3 else 0)
        k_ahead = np.uint32(k + 1 if k < 2 else 0)
        k_behind = np.uint32(k - 1 if k > 0 else 2)
        first = np.uint32(3) * f
        a = surface.corner_vertex[first + k]
        b = surface.corner_vertex[first + k_ahead]
        c = surface.corner_vertex[first + k_behind]
        if quadrics is None or not rules.optimum or is_special(surface, a, b, c):
            _rank_alone(surface, quadrics, rules, cost, f, k, a, b)
            _rank_alone(surface, quadrics, rules, cost, f, k_behind, c, a)
            if moved == 3:
                _rank_alone(surface, quadrics, rules, cost, f, k_ahead, b, c)
        else:
            n_pending = _pend(surface, cost, lists, n_pending, f, k, a, b)
            n_pending = _pend(surface, cost, lists, n_pending, f, k_behind, c, a)
            if moved == 3:
                n_pending = _pend(surface, cost, lists, n_pending, f, k_ahead, b, c)
    if quadrics is not None:
        for first in range(0, n_pending, LANES):
            n_edges = min(LANES, n_pending - first)
            _rank_side_by_side(surface, quadrics, rules, cost, lists, first, n_edges, scratch.lanes)
    n_waiting = 0
    for i in range(n_faces):  # without branches, which nobody could predict
        f = np.uint32(waiting[i])
        is_ranked = surface.face_state[f] == RANKED
        least = cheapest(costs_of(cost, f))[0]
        place = place_of(f, LEAST)
        cost[place] = least if is_ranked else cost[place]
        waiting[n_waiting] = f
        n_waiting += is_ranked & (least < max_cost)
    return n_waiting


@part
def is_special(surface, a, b, c):
    """Whether the place of an edge of abc is fixed or forbidden: such edges are looked at alone."""
    loop, locked = surface.loop, surface.locked
    a, b, c = np.uint32(a), np.uint32(b), np.uint32(c)
    return ((loop[a] & loop[b] & loop[c]) >= 0) | ((locked[a] | locked[b] | locked[c]) != 0)


@part
def _pend(surface, cost, lists, n, f, k, a, b):
    """Let the edge ab from the k-th corner of a face wait, if it is ranked from there."""
    place = place_of(f, k)
    cost[place] = np.inf
    surface.verdict[np.uint32(3) * f + k] = CONTRACTIBLE
    lists[PENDING, n], lists[PENDING + 1, n], lists[PENDING + 2, n] = place, a, b
    return n + (a < b)


@cold_part
def _rank_alone(surface, quadrics, rules, cost, f, k, a, b):
    """Find the cost of the edge ab from the k-th corner of a face."""
    price, verdict = np.inf, CONTRACTIBLE
    if is_ranked(surface.loop, a, b):
        price, verdict = _ranked_cost(surface, quadrics, rules, a, b)
    cost[place_of(f, k)] = price
    surface.verdict[np.uint32(3) * f + k] = verdict


@part
def _rank_side_by_side(surface, quadrics, rules, cost, lists, first, n_edges, lanes):
    """Find the costs of at most LANES edges PENDING, at the places of least error."""
    vertices = surface.vertices
    for j in range(n_edges):
        for end in (PENDING + 1, PENDING + 2):
            later = np.uint32(lists[end, first + j + AHEAD])
            prefetch_row(quadrics.matrix, later)
            prefetch_row(vertices, later)
        a, b = np.uint32(lists[PENDING + 1, first + j]), np.uint32(lists[PENDING + 2, first + j])
        (
            lanes[j], lanes[LANES + j], lanes[2 * LANES + j], lanes[3 * LANES + j],
            lanes[4 * LANES + j], lanes[5 * LANES + j], lanes[6 * LANES + j],
            lanes[7 * LANES + j], lanes[8 * LANES + j], lanes[9 * LANES + j],
        ) = sum_at(quadrics, vertices, a, b)  # fmt: skip
        lanes[10 * LANES + j] = vertices[b, 0] - vertices[a, 0]
        lanes[11 * LANES + j] = vertices[b, 1] - vertices[a, 1]
        lanes[12 * LANES + j] = vertices[b, 2] - vertices[a, 2]
        lanes[13 * LANES + j] = errors_apart(quadrics, a, b)
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
    for j in range(n_edges):
        place = np.uint32(lists[PENDING, first + j])
        cost[place] = lanes[14 * LANES + j]
        is_found = lanes[15 * LANES + j] != 0.0
        if is_found and not rules.is_bounded:
            continue
        a, b = lists[PENDING + 1, first + j], lists[PENDING + 2, first + j]
        if not is_found or is_beyond_bound(quadrics, a, b, lanes[13 * LANES + j]):
            corner = 3 * (place // COLUMNS) + place % COLUMNS
            cost[place], surface.verdict[corner] = _ranked_cost(surface, quadrics, rules, a, b)


@part
def is_touched(state, colour):
    """Whether a face has been touched in the sweep of a colour, where costs are kept."""
    stale = STALE_EVEN if colour == MOVED_EVEN else STALE_ODD
    return (colour >= 0) & ((state == stale) | ((state >= colour) & (state < colour + 3)))


@kernel_in_place
def rank(surface, quadrics, rules, cost, scratch, first, last, step):
    """Bring the costs of every so many-th face up to date."""
    waiting = scratch.lists[WAITING]
    for begin in range(first, last, step * AT_ONCE):
        n = 0
        for f in range(begin, min(begin + step * AT_ONCE, last), step):
            waiting[n] = f
            n += surface.face_state[f] != SETTLED
        rank_faces(surface, quadrics, rules, cost, scratch, n, -1, 0.0)


@kernel_in_place
def collect_costs(cost, face_state, step, costs):
    """Collect the costs of the edges of every so many-th face that may be contracted.

    Parameters
    ----------
    cost : float32 (4 m,)
    face_state : uint8 (m,)
        Faces that are not RANKED are passed over.
    step : int
    costs : float32 (k,), out
        Room for three of each face.

    Returns
    -------
    int
        How many there are.
    """
    n = 0
    for f in range(0, face_state.size, step):
        is_ranked = face_state[f] == RANKED
        x, y, z = costs_of(cost, f)
        for price in (x, y, z):
            costs[n] = price
            n += is_ranked & (price < np.inf)
    return n


@kernel_in_place
def count_cheaper(cost, listed, blocks, threshold, n_cheaper):
    """Tell about how many edges of each block cost less than a threshold."""
    for b in range(len(blocks)):
        first, last = blocks[b, 0], blocks[b, 1]
        step = max(1, (last - first) // COUNTED)
        n = 0
        for i in range(first, last, step):
            f = item(listed, i)
            x, y, z = costs_of(cost, f)
            n_below = np.int64(x < threshold) + np.int64(y < threshold) + np.int64(z < threshold)
            n += n_below if least_cost(cost, f) < np.inf else 0
        n_cheaper[b] = n * step


@part
def is_ranked(loop, a, b):
    """Whether an edge is looked at from the corner where it begins at a and leads to b."""
    return a < b or (loop[a] >= 0 and loop[a] == loop[b])  # on a boundary there is no other corner
