"""One simplification of checked arrays: the engine runs, and what it did is told."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.crew import Crew
from tetsimplify.edges import edge_extremes
from tetsimplify.engine import Engine, Result
from tetsimplify.fit import Links, fit_mesh, pays
from tetsimplify.mesh import Mesh
from tetsimplify.options import Progress, cosine_of
from tetsimplify.report import Repaired, Simplification, SimplificationReport
from tetsimplify.schedule import run
from tetsimplify.topology import Examined, examine
from tetsimplify.within import run_within

Data = dict[str, NDArray[Any]]


class Clock:
    """Adds up the seconds of named stages."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time of a block."""
        begin = time.perf_counter()
        yield
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - begin


def contract(
    engine: Engine,
    mesh: Mesh | None,
    *,
    locked: NDArray[np.bool_],
    vertex_data: Data,
    face_data: Data,
    progress: Progress | None,
    clock: Clock,
) -> Simplification:
    """Contract edges of a mesh that an engine is made of; see :func:`tetsimplify.simplify`.

    Without the mesh, which need not be kept, nothing is told of its shortest edge.
    """
    options = engine.options
    shortest_before = np.inf
    if mesh is not None:
        with clock.stage("check"):
            shortest_before = engine.shortest_edge(mesh)

    with clock.stage("contract"):
        n_rounds = 1
        if options.max_error is None:
            if not vertex_data:
                engine.do_without_log()
            run(engine, progress)
        else:
            assert mesh is not None
            engine, n_rounds = run_within(mesh, options, locked, engine.n_threads, progress)

    with clock.stage("report"):
        weights = engine.vertex_weights() if vertex_data else None
        result = engine.result
        engine.let_go()
        examined = examine(result.faces.reshape(-1), len(result.vertices), threads=engine.n_threads)
    if mesh is not None and options.fits:
        with clock.stage("fit"):
            flips = not face_data  # which belong to one face given, not to parts of two
            result = _fitted(engine, mesh, result, examined, locked, flips, progress)

    report = SimplificationReport(
        options=options,
        stop=result.stop,
        n_simple=engine.tally("N_SIMPLE"),
        n_nested=engine.tally("N_NESTED"),
        n_lens_vertices=engine.tally("N_LENS_VERTICES"),
        n_lens_faces=engine.tally("N_LENS_FACES"),
        n_sweeps=engine.n_sweeps,
        n_rounds=n_rounds,
        seconds=clock.seconds,
        topology_before=engine.topology_before,
        topology_after=examined.report,
        shortest_edge_before=float(shortest_before),
        shortest_edge_after=float(result.shortest_edge),
        remaining_edges=result.remaining_edges,
        remaining_reasons=result.remaining_reasons,
    )
    return Simplification(
        result.vertices,
        result.faces,
        result.vertex_map,
        result.face_map,
        report,
        {} if weights is None else weights.carry(vertex_data, result.vertex_map),
        {name: data[result.face_map] for name, data in face_data.items()},
    )


def _fitted(
    engine: Engine,
    mesh: Mesh,
    result: Result,
    examined: Examined,
    locked: NDArray[np.bool_],
    flips: bool,
    progress: Progress | None,
) -> Result:
    """The result brought nearer to the mesh given; vertices that are locked stay.

    Edges that are turned over change nothing of what `examined` tells of the topology.
    """
    options, made = engine.options, Mesh(result.vertices, result.faces)
    if options.fit is not True and not pays(mesh, made):
        return result
    held = np.zeros(len(made.vertices), np.uint8)
    held[examined.on_loops] = 1
    kept = result.vertex_map[locked]
    held[kept[kept >= 0]] = 1
    fitted = fit_mesh(
        *(mesh, made, result.vertex_map, held),
        *(Links(examined.first_corner, examined.next_corner), engine.n_threads),
        cos_turn=cosine_of(options.foldover),
        cos_feature=None if options.feature_angle is None else cosine_of(options.feature_angle),
        flips=flips,
        progress=progress,
    )
    shortest, _ = edge_extremes(fitted, Crew(engine.n_threads))
    return result._replace(vertices=fitted.vertices, faces=fitted.faces, shortest_edge=shortest)


def after_repair(result: Simplification, repaired: Repaired) -> Simplification:
    """The result for the mesh before it was repaired: its maps lead back to that."""
    return result._replace(
        vertex_map=np.append(result.vertex_map, np.int32(-1))[repaired.vertex_map],
        face_map=repaired.face_map[result.face_map],
        report=replace(result.report, repairs=repaired.report),
    )
