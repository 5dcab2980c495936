"""Sweeps over the faces in memory order: pick the cheapest edge, test, contract, freeze.

A sweep does the simple contractions and puts off the faces where the link condition blocks an
edge; `unblock` follows and does the nested contractions there. `sweep` is for one threshold of the
length, which costs nothing to compute; `sweep_ranked` is for a threshold that grows from sweep to
sweep, and for costs that are kept: see `rank` in cost.py.
"""

import numpy as np

from tetsimplify.kernels.contraction import contract_nested, contract_simple
from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import cheapest, edge_costs, rank_faces, without
from tetsimplify.kernels.jit import inlined, kernel_in_place, part
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


@kernel_in_place
def sweep(surface, quadrics, watch, scratch, rules, listed, blocks, n_sweeps, colour, retry):
    """Sweep over blocks: contract at most one short edge of each face in each sweep.

    Parameters
    ----------
    listed : int32
        Faces, in the order in which they are looked at.
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
    waiting, n_waiting = scratch.lists[WAITING], 0
    for i in range(first, last):  # without branches, which nobody could predict
        f = listed[i]
        state = surface.face_state[f]
        waiting[n_waiting] = f
        n_waiting += (state != SETTLED) & (state != colour) & ((state != BLOCKED) | retry)
    n_contracted = 0
    for i in range(n_waiting):
        f = waiting[i]
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
            corner = 3 * f + k
            if state != BLOCKED or surface.verdict[corner] != OBSTRUCTED:
                outcome = contract_simple(surface, quadrics, watch, scratch, rules, corner, colour)
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
    cost : float32 (3 m,)
        Of the edge that begins at each corner.
    thresholds : float64 (n_sweeps,)
    lenience : float
        So many times the threshold an edge may cost together with the factor for the shapes.
    listed : int32
        Faces, in the order in which they are looked at.
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
        f = listed[i]
        state = surface.face_state[f]
        is_cheap = min(cost[3 * f], cost[3 * f + 1], cost[3 * f + 2]) < max_cost
        is_stale = (state != RANKED) & (state != SETTLED) & (not _is_touched(state, colour))
        waiting[n_waiting] = f
        n_waiting += is_stale | ((state == RANKED) & is_cheap)
    rank_faces(surface, quadrics, rules, cost, scratch, n_waiting)
    n_contracted = 0
    for i in range(n_waiting):
        f = waiting[i]
        if surface.face_state[f] != RANKED:
            continue
        costs = cost[3 * f], cost[3 * f + 1], cost[3 * f + 2]
        least, k = cheapest(costs)
        if least >= max_cost:
            continue
        if scratch.tally[N_SPARE] < 2:
            break
        _renew_stamps(scratch)
        is_nested = False
        while least < max_cost:
            corner = 3 * f + k
            outcome = contract_simple(surface, quadrics, watch, scratch, rules, corner, colour)
            if outcome == CONTRACTIBLE:
                n_contracted += 1
                is_nested = False
                break
            _put_off(surface, scratch, rules, cost, corner, outcome)
            is_nested |= outcome == NESTED
            costs = without(costs, k)
            least, k = cheapest(costs)
        if is_nested and is_last:
            _defer(scratch, f)
    return n_contracted


@part
def _is_touched(state, colour):
    """Whether a face has been touched in the sweep of a colour, where costs are kept."""
    stale = STALE_EVEN if colour == MOVED_EVEN else STALE_ODD
    return (state == stale) | ((state >= colour) & (state < colour + 3))


@part
def _put_off(surface, scratch, rules, cost, corner, outcome):
    """Note why an edge is refused, and the threshold that it waits for."""
    if outcome == OUTSIDE:
        return
    surface.verdict[corner] = outcome
    if outcome == TOO_DEAR:
        cost[corner] = scratch.point[COST]
    elif outcome == OBSTRUCTED or outcome == ERROR_BOUND:
        cost[corner] = np.inf  # until an end is contracted
    elif outcome != NESTED or rules.blocked == SKIP:  # nested ones are decided in `unblock`
        cost[corner] = RAISE * scratch.point[MAX_COST]


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
            costs = (
                np.float64(cost[3 * f]),
                np.float64(cost[3 * f + 1]),
                np.float64(cost[3 * f + 2]),
            )
            limit = scratch.point[MAX_COST]
        least, k = cheapest(costs)
        while least < limit:
            corner = 3 * f + k
            if surface.verdict[corner] == wanted:
                _renew_stamps(scratch)
                outcome = contract_nested(
                    surface, quadrics, watch, scratch, rules, outer, corner, colour, commit
                )
                if commit and outcome == CONTRACTIBLE:
                    n_contracted += 1
                    break
                if commit or outcome == OBSTRUCTED:
                    surface.verdict[corner] = outcome
                if cost is not None and commit:
                    _put_off(surface, scratch, rules, cost, corner, outcome)
            costs = without(costs, k)
            least, k = cheapest(costs)
    scratch.tally[N_DEFERRED] = 0
    return n_contracted
