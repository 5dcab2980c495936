"""In which order edges are contracted, and when that ends.

Below one length the order hardly matters: sweeps are made until nothing is left to contract. By
cost, and towards a number of faces, the cheapest edges go first: sweeps are made with a threshold
that grows. Each threshold lets through a share of the edges that are left, so a few dozen sweeps do
for a queue.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.engine import Engine
from tetsimplify.options import Progress

FULL_SWEEP = 100  # a sweep that contracts less than one in so many faces lets all be retried
SHARES = (0.2, 0.1, 0.04)  # of the edges are below the next threshold: far from the end, then near
FAR, NEAR = 4.0, 2.0  # times the faces asked for are left
LENIENCE = 2.0  # far from the end: triangles that become worse have time to become better again
SUCCESS, LEAST_SUCCESS = 0.5, 0.2  # part of the edges below a threshold that can be contracted
N_SWEEPS = 6  # with a threshold each, before costs are compared over the whole surface again;
N_DIVIDED = 9  # the same where that takes more time, as the surface is divided anew


class Round(NamedTuple):
    """What is swept for before costs are compared over the whole surface again."""

    thresholds: NDArray[np.float64]
    """Shape (k,): one for each sweep, ascending; infinite where all is to be tried."""
    n_below: float
    """About how many edges are below the last one."""


def run(engine: Engine, progress: Progress | None = None) -> None:
    """Contract until a criterion is reached, or no edge is left that the rules let go."""
    if engine.options.has_one_threshold:
        _run_below_length(engine, progress)
    else:
        _run_by_cost(engine, progress)
    if progress is not None:
        progress("contract", 1.0)


def _run_below_length(engine: Engine, progress: Progress | None) -> None:
    """Contract every edge below one length."""
    if engine.is_divided:
        for _ in range(2):  # in two ways
            engine.sweep_divided(progress)
            engine.compact_when_half()
    retry = False
    while True:
        n_contracted = engine.sweep(retry, progress)
        if n_contracted == 0 and retry:
            return
        retry = n_contracted * FULL_SWEEP <= engine.n_faces
        engine.compact_when_half()


def _run_by_cost(engine: Engine, progress: Progress | None) -> None:
    """Contract the cheapest edges first."""
    n_given, least, n_barren, retry = engine.n_faces, engine.negligible_cost(), 0, False
    success = SUCCESS
    engine.rank()
    while not engine.has_enough:
        thresholds, n_below = next_thresholds(engine, least, n_barren, success)
        least = thresholds[-1]
        done = (n_given - engine.n_faces) / max(1, n_given - engine.min_faces)
        n_contracted = engine.sweep_ranked(
            *(thresholds, progress, done),
            lenience=LENIENCE if is_far_from_end(engine) else 1.0,
            divided=engine.is_divided and not n_barren,
        )
        n_barren = 0 if n_contracted else n_barren + 1
        success = min(max(n_contracted / max(n_below, 1.0), LEAST_SUCCESS), 1.0)
        if least == np.inf:
            if retry and n_barren:
                break
            engine.forget_refusals()
            retry = True
        engine.compact_when_half()
    if not engine.has_enough or engine.options.max_edge_length is not None:
        engine.rank()  # what is left will be told


def is_far_from_end(engine: Engine) -> bool:
    """Whether most of the faces that are left have still to go."""
    return engine.n_faces > FAR * engine.min_faces


def is_near_end(engine: Engine) -> bool:
    """Whether at most half of the faces that are left have still to go."""
    return engine.n_faces <= NEAR * engine.min_faces


def next_thresholds(engine: Engine, least: float, n_barren: int = 0, success: float = 1.0) -> Round:
    """Costs that growing shares of the edges are below, and no more than have to go.

    Parameters
    ----------
    engine : Engine
        With costs that are up to date.
    least : float
        A threshold that is not gone below: that of the sweep before.
    n_barren : int
        The number of times before that nothing could be contracted.
    success : float
        The part of the edges below the last threshold that was contracted in the round before:
        others vanish with those, become dearer, or are refused.

    Returns
    -------
    Round
    """
    costs = engine.sample_of_costs()
    n_faces, min_faces = engine.n_faces, engine.min_faces
    share = SHARES[0 if is_far_from_end(engine) else 2 if is_near_end(engine) else 1]
    n_edges = 1.5 * n_faces
    most = 0.5 * (n_faces - min_faces) / (success * n_edges) if min_faces else 1.0
    n_sweeps = N_DIVIDED if engine.is_divided else N_SWEEPS
    shares = 1.0 - (1.0 - share) ** np.arange(1, n_sweeps + 1)
    shares = np.unique(np.minimum(shares, most))
    shares = np.maximum(shares, 1.0 / max(1, len(costs))) * 2.0**n_barren
    if not len(costs) or shares[0] > 1.0:
        return Round(np.array([np.inf]), n_edges)
    last = len(costs) - 1
    cheap = costs[np.minimum((np.minimum(shares, 1.0) * len(costs)).astype(np.int64), last)]
    thresholds = np.maximum(least, np.nextafter(cheap, np.float32(np.inf)).astype(np.float64))
    return Round(thresholds, min(shares[-1], 1.0) * n_edges)
