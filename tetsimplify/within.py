"""Simplification within a distance that is proven.

The quadric error is a mean distance from planes and tells nothing for certain about the distance
between two surfaces. So the surfaces are compared afterwards, both ways: every face is proven to
have no point farther from the other surface than the limit, or is reported. Where faces are
reported, the vertices that have been merged there get a smaller bound on their quadric error, and
all is done again, until no face is reported.

This ends: vertices that are in the way again and again are not contracted any more, and where
nothing is contracted the surfaces are the same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.crew import Crew
from tetsimplify.distance import SMALLEST_TOLERANCE, exceeds
from tetsimplify.engine import Engine, Result
from tetsimplify.errors import OptionError
from tetsimplify.mesh import Mesh
from tetsimplify.options import Options, Progress
from tetsimplify.schedule import run
from tetsimplify.targets import Target

FIRST_BOUND = 0.6  # of the limit: the quadric error that is allowed in the first round
SLACK = 0.02  # of the limit: so much nearer a face may be and be reported still
ROUNDING = 1e-9  # of the limit, for rounding errors of the distances
STEPS = (0.4, 0.8)  # the bound is reduced to a part in this range of the error that was too much
PATIENCE = 20  # rounds, after which vertices in the way are not contracted any more
LAST_BOUND = -1.0  # less than any error


def run_within(
    given: Mesh,
    options: Options,
    locked: NDArray[np.bool_],
    threads: int | None,
    progress: Progress | None,
) -> tuple[Engine, int]:
    """Contract edges so that both surfaces stay within ``options.max_error`` of each other.

    Returns
    -------
    engine : Engine
        Of the run that came out right.
    n_rounds : int
        The number of runs.
    """
    assert options.max_error is not None
    limit = float(options.max_error)
    most = FIRST_BOUND * limit
    if options.max_quadric_error is not None:
        most = min(most, options.max_quadric_error)
    bound = np.full(len(given.vertices), most)
    before = Target(given, crew=Crew(threads)) if len(given.faces) else None
    if before is not None and limit < SMALLEST_TOLERANCE * before.frame.diagonal / SLACK:
        least = SMALLEST_TOLERANCE / SLACK
        raise OptionError(f"max_error must be at least {least:g} of the diagonal, got {limit:g}")
    n_rounds = 0
    while True:
        engine = Engine(given, options, locked, bound, threads)
        run(engine, progress)
        n_rounds += 1
        if before is None:
            return engine, n_rounds
        reported = _too_far(given, before, engine.result, limit, threads)
        if not len(reported.vertices):
            return engine, n_rounds
        _reduce(bound, engine, reported, limit, is_last=n_rounds >= PATIENCE)


class _Reported(NamedTuple):
    """Vertices given that have to do with faces that are too far away."""

    vertices: NDArray[np.intp]
    distances: NDArray[np.float64]


def _too_far(
    given: Mesh, before: Target, result: Result, limit: float, threads: int | None
) -> _Reported:
    """Compare the surfaces, and tell which vertices given were merged where they differ."""
    made = Mesh(result.vertices, result.faces)
    after = Target(made, before.frame, Crew(threads))
    limit, slack = (1.0 - ROUNDING) * limit, SLACK * limit
    lost = exceeds(given, after, limit, slack=slack, threads=threads)
    new = exceeds(made, before, limit, slack=slack, threads=threads)
    of_given = np.zeros(len(given.vertices))
    np.maximum.at(of_given, given.faces[lost.faces], lost.distances[:, None])
    of_made = np.zeros(len(made.vertices) + 1)  # the last one is for what was removed
    np.maximum.at(of_made, made.faces[new.faces], new.distances[:, None])
    np.maximum.at(of_made, result.vertex_map, of_given)
    of_made[-1] = 0.0
    distances = np.maximum(of_given, of_made[result.vertex_map])
    vertices = np.flatnonzero(distances > 0.0)
    return _Reported(vertices, distances[vertices])


def _reduce(
    bound: NDArray[np.float64], engine: Engine, reported: _Reported, limit: float, *, is_last: bool
) -> None:
    """Reduce the bounds of the vertices reported, below the errors that they came to."""
    if is_last:
        bound[reported.vertices] = LAST_BOUND
        return
    vertex_map = engine.result.vertex_map[reported.vertices]
    errors = np.append(engine.vertex_errors(), np.inf)[vertex_map]
    part = np.clip(limit / np.maximum(reported.distances, limit), *STEPS)
    bound[reported.vertices] = part * np.minimum(bound[reported.vertices], errors)
