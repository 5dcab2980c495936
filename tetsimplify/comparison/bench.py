"""Doing all tasks of a comparison, one after the other."""

from __future__ import annotations

import os
import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tetsimplify.compare import Comparison
from tetsimplify.comparison.apart import Outcome, run_apart
from tetsimplify.comparison.inputs import Input
from tetsimplify.comparison.machine import machine
from tetsimplify.comparison.measuring import Reference
from tetsimplify.comparison.store import Store, plain
from tetsimplify.comparison.tasks import Settings, Task
from tetsimplify.decimators import Goal, Method
from tetsimplify.errors import MissingExtraError, TetsimplifyError
from tetsimplify.options import Progress
from tetsimplify.standard import chosen, run

VERSION = 1
KEPT = ("ok", "wrong count", "timeout")  # what else happened may not happen again
COUNT_TOLERANCE = 0.01  # of the number of faces asked for
FROM_VOLUME = "its time is that of extraction and all; others get the plain surface"
FEW = 2  # faces that may always be left over


def carry_out(
    tasks: list[Task],
    given: list[Input],
    wanted: list[Method],
    settings: Settings,
    output: str | os.PathLike[str] | None,
    *,
    extra: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Do all tasks that are not done yet, and write the report.

    Parameters
    ----------
    extra : mapping, optional
        Goes into the results as it is.
    """
    notes: list[str] = []
    here = machine(wanted)
    with _folder(output) as folder:
        store = Store(folder)
        bench = _Bench(store, settings, here)
        runs = []
        for done, task in enumerate(tasks):
            if progress is not None:
                progress(str(task), done / len(tasks))
            runs.append(bench.finished(task))
        results = {
            "version": VERSION,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "machine": here,
            "settings": vars(settings),
            "inputs": [_told(one, store) for one in given],
            "absent": [_absent(method) for method in wanted if method.version is None],
            "runs": runs,
            **(extra or {}),
        }
        store.write_results(results)
        page = None
        if output is not None:
            if progress is not None:
                progress("the page", 1.0)
            page = _write_page(results, folder, notes)
    return Comparison(results, None if output is None else folder, page, notes)


class _Bench:
    """Does tasks, one after the other."""

    def __init__(self, store: Store, settings: Settings, here: Mapping[str, Any]) -> None:
        self._store = store
        self._settings = settings
        self._here = here
        self._reference: Reference | None = None
        self._by_length: dict[tuple[Input, float], int] = {}

    def finished(self, task: Task) -> dict[str, Any]:
        """A run as it was kept, or a new one."""
        key = task.key(self._settings, self._here)
        found = self._store.finished(key)
        if found is None:
            found = self._do(task, key)
            if found["status"] in KEPT:
                self._store.keep(found)
        if "clocks" in found:
            found = {**found, "seconds": found["clocks"][self._settings.clock]}
        return found

    def _do(self, task: Task, key: str) -> dict[str, Any]:
        """Run a method and measure its result."""
        goal, message = self._goal(task)
        outcome = run_apart(task.method, task.given.mesh, goal, self._settings)
        told = _header(task, goal, key, outcome, message)
        if outcome.mesh is None:
            return told
        if not len(outcome.mesh.faces):
            return told | {"status": "error", "message": "no face is left"}
        try:
            figures = self._compared_to(task.given).measure(
                outcome.mesh, task.short_length(goal), self._settings.tolerance
            )
        except TetsimplifyError as error:
            return told | {"status": "error", "message": f"cannot be measured: {error}"}
        told |= figures
        if task.method.meets_count and not _meets(len(outcome.mesh.faces), goal.target_faces):
            told["status"] = "wrong count"
        name = f"{task.given.name}.{task.method.name}.{key[:8]}"
        told["mesh"] = self._store.write_mesh(name, outcome.mesh)
        return told

    def _goal(self, task: Task) -> tuple[Goal, str | None]:
        """What a method is asked for, and what is to be said of it."""
        if not task.criterion.by_length or task.goes_by_length:
            goal = task.goal(None)
            return goal, None if goal.volume is None else FROM_VOLUME
        length = task.criterion.value
        if (task.given, length) not in self._by_length:
            ours = run(chosen(["tetsimplify-length"])[0], task.given.mesh, Goal(None, length))
            self._by_length[task.given, length] = len(ours.faces)
        n_faces = self._by_length[task.given, length]
        return task.goal(n_faces), f"asked for the {n_faces:,} faces of tetsimplify-length"

    def _compared_to(self, given: Input) -> Reference:
        if self._reference is None or self._reference.given is not given:
            self._reference = Reference(given)
        return self._reference


def _header(
    task: Task, goal: Goal, key: str, outcome: Outcome, message: str | None
) -> dict[str, Any]:
    """What there is to tell of a run without its mesh."""
    told = {
        "key": key,
        "input": task.given.name,
        "method": task.method.name,
        "title": task.method.title,
        "package": task.method.packages[0],
        "version": task.method.version,
        "licence": task.method.licence,
        "precision": task.method.precision,
        "criterion": {task.criterion.name: task.criterion.value},
        "target_faces": goal.target_faces,
        "options": plain(dict(task.options)),
        "status": outcome.status,
        "message": outcome.message or message,
    }
    if outcome.seconds:
        told["clocks"] = {clock: _spread(each) for clock, each in outcome.seconds.items()}
        told["peak_memory_bytes"] = outcome.peak_memory_bytes
    return told


def _spread(seconds: Sequence[float]) -> dict[str, Any]:
    return {
        "median": statistics.median(seconds),
        "min": min(seconds),
        "max": max(seconds),
        "all": list(seconds),
    }


def _meets(n_faces: int, target_faces: int | None) -> bool:
    """Whether so many faces are what was asked for."""
    if target_faces is None:
        return True
    return abs(n_faces - target_faces) <= FEW + COUNT_TOLERANCE * target_faces


def _told(given: Input, store: Store) -> dict[str, Any]:
    """What there is to tell of an input."""
    found = given.topology
    return {
        "name": given.name,
        "kind": given.kind,
        "n_vertices": found.n_vertices,
        "n_faces": found.n_faces,
        "diagonal": given.diagonal,
        "repairs": given.repairs,
        "topology": {
            "euler_characteristic": found.euler_characteristic,
            "genus": found.genus,
            "n_components": found.n_components,
            "n_boundary_loops": found.n_boundary_loops,
            "n_boundary_edges": found.n_boundary_edges,
            "edge_degrees": {str(k): n for k, n in sorted(found.edge_degrees.items())},
        },
        "mesh": store.write_mesh(given.name, given.mesh),
    }


def _absent(method: Method) -> dict[str, str]:
    return {
        "method": method.name,
        "title": method.title,
        "package": method.packages[0],
        "install": method.install,
    }


def _write_page(results: dict[str, Any], folder: Path, notes: list[str]) -> Path | None:
    try:
        from tetsimplify.comparison.page import write_page

        return write_page(plain(results), folder)
    except MissingExtraError as error:
        notes.append(f"no page: {error}")
        return None


@contextmanager
def _folder(output: str | os.PathLike[str] | None) -> Iterator[Path]:
    """The folder of the report, or one that vanishes."""
    if output is not None:
        yield Path(output)
        return
    with tempfile.TemporaryDirectory(prefix="tetsimplify-") as folder:
        yield Path(folder)
