"""Sweeps over the faces in memory order: pick the cheapest edge, test, contract, freeze.

A sweep does the simple contractions and puts off the faces where the link condition blocks an
edge; `unblock` follows and does the nested contractions there. `sweep` is for one threshold of the
length, which costs nothing to compute; `sweep_ranked` is for a threshold that grows from sweep to
sweep, and for costs that are kept: see `rank` in cost.py.
"""

import numpy as np

from tetsimplify.kernels.contraction import contract_nested, contract_simple
from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import (
    cheapest,
    costs_of,
    edge_costs,
    least_cost,
    note_least,
    place_of,
    rank_faces,
    without,
)
from tetsimplify.kernels.jit import inlined, kernel_in_place, part
from tetsimplify.kernels.lists import item
from tetsimplify.kernels.prefetch import prefetch_row
from tetsimplify.kernels.state import (
    AT_ONCE,
    BLOCK,
    BLOCKED,
    CONTRACTIBLE,
    COST,
    DEFERRED,
    ERROR_BOUND,
    MAX_COST,
    MAX_PRICE,
    MOVED_EVEN,
    MOVED_ODD,
    N_DEFERRED,
    N_SPARE,
    NESTED,
    OBSTRUCTED,
    OUTSIDE,
    RANKED,
    REMOVAL_LIMIT,
    SETTLED,
    SKIP,
    STALE_EVEN,
    STALE_ODD,
    STAMP,
    STAMP_LIMIT,
    TOO_DEAR,
    WAITING,
)

FULL_SWEEP = 100  # a sweep that contracts less than one in so many faces is the last of its block
SOON = 6  # so many faces before one is looked at, its surroundings are fetched
RAISE = 4.0  # so many times the threshold is what a refused edge waits for


@part
def _renew_stamps(scratch):
    """Let the stamps start anew before they are too large for the marks."""
    if scratch.tally[STAMP] > scratch.tally[STAMP_LIMIT]:
        scratch.tally[STAMP] = 0
        scratch.mark[:] = 0
        scratch.face_mark[:] = 0


@part
def _enter(scratch, blocks, block):
    """Make a row of `blocks` the block at hand; return where its faces are listed."""
    scratch.tally[N_SPARE] = blocks[block, 2]
    scratch.tally[BLOCK] = blocks[block, 3]
    return blocks[block, 0], blocks[block, 1]


@part
def _defer(scratch, f):
    """Put a face off to `unblock`. Where there is no room a later sweep finds it again."""
    n = scratch.tally[N_DEFERRED]
    if n < scratch.lists.shape[1]:
        scratch.lists[DEFERRED, n] = f
        scratch.tally[N_DEFERRED] = n + 1


@part
def _will_be_walked_from(surface, f):
    """Start to fetch where the stars of the vertices of a face go on."""
    for corner in range(3 * np.int64(f), 3 * np.int64(f) + 3):
        following = np.uint32(surface.next_corner[corner])
        prefetch_row(surface.next_corner, following)
        prefetch_row(surface.corner_vertex, following)


@kernel_in_place
def sweep(surface, quadrics, watch, scratch, rules, listed, blocks, n_sweeps, colour, retry):
    """Sweep over blocks: contract at most one short edge of each face in each sweep.

    Parameters
    ----------
    listed : int32
        Faces, in the order in which they are looked at; see lists.py.
    blocks : int64 (k, 4)
        See :mod:`tetsimplify.blocks`.
    n_sweeps : int
        At most so many over each block, until one contracts next to nothing.
    colour : int
        State that faces get when they are touched; STALE_EVEN and STALE_ODD in turn.
    retry : bool
        Try faces again all of whose short edges were refused before. What is obstructed stays
        so until one of its ends is contracted with another vertex: a 3-cycle that does not
        separate, or has a handle or a hole on both sides, keeps that whatever happens elsewhere.

    Returns
    -------
    int
        Number of contractions.
    """
    n_contracted = 0
    for b in range(len(blocks)):
        first, last = _enter(scratch, blocks, b)
        for i in range(n_sweeps):
            shade = colour if i % 2 == 0 else STALE_EVEN + STALE_ODD - colour
            n = _sweep_block(
                surface, quadrics, watch, scratch, rules, listed, first, last, shade, retry
            )
            n_contracted += n
            if n * FULL_SWEEP <= last - first:
                break
    return n_contracted


@inlined
def _sweep_block(surface, quadrics, watch, scratch, rules, listed, first, last, colour, retry):
    """Sweep once over the faces listed from `first` to `last`."""
    n_contracted = 0
    for begin in range(first, last, AT_ONCE):
        end = min(begin + AT_ONCE, last)
        n_contracted += _sweep_run(
            surface, quadrics, watch, scratch, rules, listed, begin, end, colour, retry
        )
    return n_contracted


@inlined
def _sweep_run(surface, quadrics, watch, scratch, rules, listed, first, last, colour, retry):
    """Sweep once over at most AT_ONCE faces."""
    waiting, n_waiting = scratch.lists[WAITING], 0
    for i in range(first, last):  # without branches, which nobody could predict
        f = np.uint32(item(listed, i))
        state = surface.face_state[f]
        waiting[n_waiting] = f
        n_waiting += (state != SETTLED) & (state != colour) & ((state != BLOCKED) | retry)
    n_contracted = 0
    for i in range(n_waiting):
        f = np.uint32(waiting[i])
        _will_be_walked_from(surface, waiting[min(i + SOON, n_waiting - 1)])
        state = surface.face_state[f]
        if state == SETTLED or state == colour:
            continue
        costs = edge_costs(surface.vertices, surface.corner_vertex, f)
        least, k = cheapest(costs)
        if least >= rules.max_length2:
            surface.face_state[f] = SETTLED
            continue
        surface.face_state[f] = BLOCKED
        _renew_stamps(scratch)
        is_nested = False
        is_outside = False
        while least < rules.max_length2:
            corner = np.uint32(3) * f + np.uint32(k)
            if state != BLOCKED or surface.verdict[corner] != OBSTRUCTED:
                outcome = contract_simple(
                    surface, quadrics, watch, scratch, rules, None, corner, colour
                )
                if outcome == CONTRACTIBLE:
                    n_contracted += 1
                    is_nested = is_outside = False
                    break
                surface.verdict[corner] = outcome
                is_nested |= outcome == NESTED
                is_outside |= outcome == OUTSIDE
            # else it stays so for as long as its ends stay what they are
            costs = without(costs, k)
            least, k = cheapest(costs)
        if is_outside:
            surface.face_state[f] = colour  # as if touched: other blocks will look at it
        elif is_nested:
            _defer(scratch, f)
    return n_contracted


@kernel_in_place
def sweep_ranked(
    surface, quadrics, watch, scratch, rules, cost, thresholds, lenience, listed, blocks, colour
):
    """Sweep over blocks with a threshold that grows: at most one edge of each face in each sweep.

    The costs of a face are brought up to date when a sweep comes to it, unless it is frozen. An
    edge that is refused waits for a higher threshold: for what it costs at the place where it can
    be contracted, or for RAISE times the present one.

    Parameters
    ----------
    cost : float32 (4 m,)
        Rows of costs, see cost.py.
    thresholds : float64 (n_sweeps,)
    lenience : float
        So many times the threshold an edge may cost together with the factor for the shapes.
    listed : int32
        Faces, in the order in which they are looked at; see lists.py.
    blocks : int64 (k, 4)
        See :mod:`tetsimplify.blocks`.
    colour : int
        State that faces get when they are touched in the first sweep; MOVED_EVEN and MOVED_ODD in
        turn.

    Returns
    -------
    int
        Number of contractions.
    """
    n_contracted = 0
    for b in range(len(blocks)):
        first, last = _enter(scratch, blocks, b)
        for i in range(thresholds.size):
            shade = colour if i % 2 == 0 else MOVED_EVEN + MOVED_ODD - colour
            scratch.point[MAX_COST] = thresholds[i]
            scratch.point[MAX_PRICE] = lenience * thresholds[i]
            is_last = i + 1 == thresholds.size
            n_contracted += _sweep_block_ranked(
                surface, quadrics, watch, scratch, rules, cost, listed, first, last, shade, is_last
            )
    return n_contracted


@inlined
def _sweep_block_ranked(
    surface, quadrics, watch, scratch, rules, cost, listed, first, last, colour, is_last
):
    """Sweep once over the faces listed; in the last sweep put off what is nested."""
    n_contracted = 0
    for begin in range(first, last, AT_ONCE):
        if scratch.tally[N_SPARE] < 2:
            break
        end = min(begin + AT_ONCE, last)
        n_contracted += _sweep_run_ranked(
            surface, quadrics, watch, scratch, rules, cost, listed, begin, end, colour, is_last
        )
    return n_contracted


@inlined
def _sweep_run_ranked(
    surface, quadrics, watch, scratch, rules, cost, listed, first, last, colour, is_last
):
    """Sweep once over at most AT_ONCE faces."""
    max_cost = scratch.point[MAX_COST]
    waiting, n_waiting = scratch.lists[WAITING], 0
    for i in range(first, last):  # without branches, which nobody could predict
        f = item(listed, i)
        waiting[n_waiting] = f
        n_waiting += least_cost(cost, f) < max_cost
    n_waiting = rank_faces(surface, quadrics, rules, cost, scratch, n_waiting, colour, max_cost)
    n_contracted = 0
    for i in range(n_waiting):
        f = np.uint32(waiting[i])
        if surface.face_state[f] != RANKED:
            continue
        costs = costs_of(cost, f)
        least, k = cheapest(costs)
        if scratch.tally[N_SPARE] < 2:
            break
        _renew_stamps(scratch)
        is_nested = False
        while least < max_cost:
            corner = np.uint32(3) * f + np.uint32(k)
            outcome = contract_simple(
                surface, quadrics, watch, scratch, rules, cost, corner, colour
            )
            if outcome == CONTRACTIBLE:
                n_contracted += 1
                is_nested = False
                break
            _put_off(surface, scratch, rules, cost, f, k, outcome)
            is_nested |= outcome == NESTED
            costs = without(costs, k)
            least, k = cheapest(costs)
        if is_nested and is_last:
            _defer(scratch, f)
    return n_contracted


@part
def _put_off(surface, scratch, rules, cost, f, k, outcome):
    """Note why an edge is refused, and the threshold that it waits for."""
    if outcome == OUTSIDE:
        return
    surface.verdict[3 * f + k] = outcome
    place = place_of(f, k)
    if outcome == TOO_DEAR:
        cost[place] = scratch.point[COST]
    elif outcome == OBSTRUCTED or outcome == ERROR_BOUND:
        cost[place] = np.inf  # until an end is contracted
    elif outcome != NESTED or rules.blocked == SKIP:  # nested ones are decided in `unblock`
        cost[place] = RAISE * scratch.point[MAX_COST]
    note_least(cost, f)


@kernel_in_place
def unblock(surface, quadrics, watch, scratch, rules, cost, outer, whole, colour, commit):
    """Contract at most one blocked edge of each of the faces put off.

    Parameters
    ----------
    outer : None or int
        How to tell which lens to keep: None by region growing, else PATH or DISTANCE.
    whole : int64 (1, 6)
        The whole surface as a block.
    colour : int
        State that faces get when they are touched. Faces touched since they were put off are left.
    commit : bool
        False to contract nothing, and only find out which of the edges that the removal limit
        holds are obstructed under these rules.

    Returns
    -------
    int
        Number of contractions.
    """
    _enter(scratch, whole, 0)
    wanted = NESTED if commit else REMOVAL_LIMIT
    waiting = BLOCKED if cost is None else RANKED
    n_contracted = 0
    for i in range(scratch.tally[N_DEFERRED]):
        f = scratch.lists[DEFERRED, i]
        if surface.corner_vertex[3 * f] == DEAD or (commit and surface.face_state[f] != waiting):
            continue
        costs = edge_costs(surface.vertices, surface.corner_vertex, f)
        limit = rules.max_length2
        if cost is not None and commit:
            x, y, z = costs_of(cost, f)
            costs = np.float64(x), np.float64(y), np.float64(z)
            limit = scratch.point[MAX_COST]
        least, k = cheapest(costs)
        while least < limit:
            corner = 3 * f + k
            if surface.verdict[corner] == wanted:
                _renew_stamps(scratch)
                outcome = contract_nested(
                    surface, quadrics, watch, scratch, rules, cost, outer, corner, colour, commit
                )
                if commit and outcome == CONTRACTIBLE:
                    n_contracted += 1
                    break
                if commit or outcome == OBSTRUCTED:
                    surface.verdict[corner] = outcome
                if cost is not None and commit:
                    _put_off(surface, scratch, rules, cost, f, k, outcome)
            costs = without(costs, k)
            least, k = cheapest(costs)
    scratch.tally[N_DEFERRED] = 0
    return n_contracted
