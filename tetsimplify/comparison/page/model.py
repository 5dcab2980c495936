"""The document of a comparison, checked, and what the page asks of it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

from tetsimplify.comparison.page import wording
from tetsimplify.errors import OptionError

VERSION = 1
OURS = "tetsimplify"
NAIVE = "standard"  # the contraction that breaks the topology, of our package too
STATUSES = ("ok", "wrong count", "error", "crashed", "timeout", "not applicable")
WITH_MESH = ("ok", "wrong count")

Run = Mapping[str, Any]


class Case(NamedTuple):
    """An input and a criterion."""

    input: str
    criterion: tuple[tuple[str, float], ...]

    @property
    def name(self) -> str:
        """The criterion in a word."""
        return wording.criterion_name(dict(self.criterion))


class Comparison:
    """A results document.

    Parameters
    ----------
    results : mapping
        Of version 1.

    Raises
    ------
    OptionError
        When it is no such document.
    """

    def __init__(self, results: Mapping[str, Any]) -> None:
        _check(results)
        self.created: str = results.get("created") or ""
        self.machine: Mapping[str, Any] = results.get("machine") or {}
        self.inputs: list[Mapping[str, Any]] = list(results["inputs"])
        self.absent: list[Mapping[str, Any]] = list(results.get("absent") or [])
        self.runs: list[Run] = list(results["runs"])

    @cached_property
    def cases(self) -> list[Case]:
        """All of them, in order of the inputs."""
        names = [entry["name"] for entry in self.inputs]
        return sorted(dict.fromkeys(map(case_of, self.runs)), key=lambda c: names.index(c.input))

    @cached_property
    def methods(self) -> list[Run]:
        """The first run of each method."""
        return list({run["method"]: run for run in reversed(self.runs)}.values())[::-1]

    @cached_property
    def failures(self) -> dict[tuple[str, str, str, str], list[str]]:
        """Criteria of the runs that did not end well, by title, input, status and message."""
        found: dict[tuple[str, str, str, str], list[str]] = {}
        for run in self.runs:
            if run["status"] != "ok":
                key = (run["title"], run["input"], run["status"], run.get("message") or "")
                found.setdefault(key, []).append(case_of(run).name)
        return found

    def diagonal(self, run: Run) -> float:
        """Of the box around the input of a run."""
        return next(e["diagonal"] for e in self.inputs if e["name"] == run["input"]) or 1.0

    def runs_of(self, case: Case) -> dict[str, int]:
        """Numbers of the runs of a case by their methods."""
        return {run["method"]: k for k, run in enumerate(self.runs) if case_of(run) == case}

    def reference(self, case: Case) -> Run | None:
        """The run that others are measured by: our first one that keeps the topology."""
        for k in self.runs_of(case).values():
            if is_ours(self.runs[k]) and is_kept(self.runs[k]):
                return self.runs[k]
        return None

    def methods_that_always_keep(self) -> list[Run]:
        """Those that gave a mesh whenever they could be applied, and all with the topology."""
        return [
            method
            for method in self.methods
            if all(
                is_kept(run)
                for run in self.runs
                if run["method"] == method["method"] and run["status"] != "not applicable"
            )
        ]


def case_of(run: Run) -> Case:
    """The input and the criterion of a run."""
    return Case(run["input"], tuple(sorted(run["criterion"].items())))


def is_ours(run: Run) -> bool:
    """Whether the method is one of tetsimplify that keeps its promises."""
    return run.get("package") == OURS and run["method"] != NAIVE


def has_mesh(run: Run) -> bool:
    """Whether there is a result to measure."""
    return run["status"] in WITH_MESH


def is_kept(run: Run) -> bool:
    """Whether there is a result, and it has the topology of the input."""
    return has_mesh(run) and bool(run["topology_kept"])


def _check(results: Mapping[str, Any]) -> None:
    if not isinstance(results, Mapping) or results.get("version") != VERSION:
        version = results.get("version") if isinstance(results, Mapping) else type(results)
        raise OptionError(f"results must be a comparison of version {VERSION}, got {version!r}")
    for part in ("inputs", "runs"):
        if not isinstance(results.get(part), list) or not results[part]:
            raise OptionError(f"results must have a list of {part} that is not empty")
    for k, entry in enumerate(results["inputs"]):
        missing = {"name", "n_faces", "diagonal", "mesh"} - entry.keys()
        if missing:
            raise OptionError(f"input {k} has no {wording.listing(sorted(missing))}")
    names = {entry["name"] for entry in results["inputs"]}
    for k, run in enumerate(results["runs"]):
        missing = {"input", "method", "title", "criterion", "status"} - run.keys()
        if missing:
            raise OptionError(f"run {k} has no {wording.listing(sorted(missing))}")
        if run["input"] not in names:
            raise OptionError(f"run {k} is of the input {run['input']!r}, which is not listed")
        if run["status"] not in STATUSES:
            raise OptionError(f"run {k} has the status {run['status']!r}, not one of {STATUSES}")
