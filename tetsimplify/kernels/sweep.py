"""Sweeps over the faces in memory order: pick the cheapest edge, test, contract, freeze.

A sweep does the simple contractions and puts off the faces where the link condition blocks an
edge; `unblock` follows and does the nested contractions there. `sweep` is for one threshold of the
length, which costs nothing to compute; `sweep_ranked` is for a threshold that grows from sweep to
sweep, and for costs that are kept: see `rank` in cost.py.
"""

import numpy as np

from tetsimplify.kernels.contraction import contract_nested, contract_simple
from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import cheapest_first, edge_costs
from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.state import (
    BLOCKED,
    CONTRACTIBLE,
    COST,
    DEFERRED,
    ERROR_BOUND,
    N_DEFERRED,
    N_LIVE,
    NESTED,
    OBSTRUCTED,
    RANKED,
    REMOVAL_LIMIT,
    SETTLED,
    SKIP,
    STAMP,
    STAMP_LIMIT,
    TOO_DEAR,
)

RAISE = 4.0  # so many times the threshold is what a refused edge waits for


@part
def _renew_stamps(scratch):
    """Let the stamps start anew before they are too large for the marks."""
    if scratch.tally[STAMP] > scratch.tally[STAMP_LIMIT]:
        scratch.tally[STAMP] = 0
        scratch.mark[:] = 0
        scratch.face_mark[:] = 0


@kernel_in_place
def sweep(surface, quadrics, watch, scratch, rules, first, last, colour, retry):
    """Contract at most one short edge of each of the faces from `first` to `last`.

    Parameters
    ----------
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
    for f in range(first, last):
        state = surface.face_state[f]
        if state == SETTLED or state == colour or (state == BLOCKED and not retry):
            continue
        costs = edge_costs(surface.vertices, surface.corner_vertex, f)
        order = cheapest_first(costs)
        if costs[order[0]] >= rules.max_length2:
            surface.face_state[f] = SETTLED
            continue
        surface.face_state[f] = BLOCKED
        _renew_stamps(scratch)
        is_nested = False
        for k in order:
            if costs[k] >= rules.max_length2:
                break
            if state == BLOCKED and surface.verdict[3 * f + k] == OBSTRUCTED:
                continue  # for as long as its ends stay what they are
            outcome = contract_simple(surface, quadrics, watch, scratch, rules, 3 * f + k, colour)
            if outcome == CONTRACTIBLE:
                n_contracted += 1
                is_nested = False
                break
            surface.verdict[3 * f + k] = outcome
            is_nested |= outcome == NESTED
        if is_nested:
            scratch.lists[DEFERRED, scratch.tally[N_DEFERRED]] = f
            scratch.tally[N_DEFERRED] += 1
    return n_contracted


@kernel_in_place
def sweep_ranked(surface, quadrics, watch, scratch, rules, cost, first, last, colour):
    """Contract at most one edge below ``rules.max_cost`` of each face from `first` to `last`.

    An edge that is refused waits for a higher threshold: for what it costs at the place where it
    can be contracted, or for RAISE times the present one.

    Parameters
    ----------
    cost : float32 (3 m,)
        Of the edge that begins at each corner.
    colour : int
        State that faces get when they are touched.

    Returns
    -------
    int
        Number of contractions.
    """
    n_contracted = 0
    for f in range(first, last):
        if surface.face_state[f] != RANKED:
            continue
        if min(cost[3 * f], cost[3 * f + 1], cost[3 * f + 2]) >= rules.max_cost:
            continue
        if rules.min_faces > 0 and scratch.tally[N_LIVE] - 2 < rules.min_faces:
            break
        _renew_stamps(scratch)
        is_nested = False
        for k in cheapest_first((cost[3 * f], cost[3 * f + 1], cost[3 * f + 2])):
            corner = 3 * f + k
            if cost[corner] >= rules.max_cost:
                break
            outcome = contract_simple(surface, quadrics, watch, scratch, rules, corner, colour)
            if outcome == CONTRACTIBLE:
                n_contracted += 1
                is_nested = False
                break
            _put_off(surface, scratch, rules, cost, corner, outcome)
            is_nested |= outcome == NESTED
        if is_nested:
            scratch.lists[DEFERRED, scratch.tally[N_DEFERRED]] = f
            scratch.tally[N_DEFERRED] += 1
    return n_contracted


@part
def _put_off(surface, scratch, rules, cost, corner, outcome):
    """Note why an edge is refused, and the threshold that it waits for."""
    surface.verdict[corner] = outcome
    if outcome == TOO_DEAR:
        cost[corner] = scratch.point[COST]
    elif outcome == OBSTRUCTED or outcome == ERROR_BOUND:
        cost[corner] = np.inf  # until an end is contracted
    elif outcome != NESTED or rules.blocked == SKIP:  # nested ones are decided in `unblock`
        cost[corner] = RAISE * rules.max_cost


@kernel_in_place
def unblock(surface, quadrics, watch, scratch, rules, cost, outer, colour, commit):
    """Contract at most one blocked edge of each of the faces put off.

    Parameters
    ----------
    outer : None or int
        How to tell which lens to keep: None by region growing, else PATH or DISTANCE.
    colour : int
        As of :func:`sweep`; faces that were touched in the same sweep are left.
    commit : bool
        False to contract nothing, and only find out which of the edges that the removal limit
        holds are obstructed under these rules.

    Returns
    -------
    int
        Number of contractions.
    """
    wanted = NESTED if commit else REMOVAL_LIMIT
    n_contracted = 0
    for i in range(scratch.tally[N_DEFERRED]):
        f = scratch.lists[DEFERRED, i]
        if surface.corner_vertex[3 * f] == DEAD or (commit and surface.face_state[f] == colour):
            continue
        costs = edge_costs(surface.vertices, surface.corner_vertex, f)
        limit = rules.max_length2
        if cost is not None and commit:
            costs = (
                np.float64(cost[3 * f]),
                np.float64(cost[3 * f + 1]),
                np.float64(cost[3 * f + 2]),
            )
            limit = rules.max_cost
        for k in cheapest_first(costs):
            corner = 3 * f + k
            if costs[k] >= limit:
                break
            if surface.verdict[corner] != wanted:
                continue
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
    scratch.tally[N_DEFERRED] = 0
    return n_contracted
