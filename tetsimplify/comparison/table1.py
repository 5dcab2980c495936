"""Table 1 of Pepko and Borisenko (2023): the improved and the standard contraction.

The paper gives the numbers of vertices and faces before and after, and the seconds; neither
lattice nor size, grid or ε. What was chosen here is said in :data:`INFERRED`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from rich import box
from rich.table import Table
from rich.text import Text

from tetsimplify.compare import Comparison
from tetsimplify.comparison.bench import carry_out
from tetsimplify.comparison.inputs import Input
from tetsimplify.comparison.models import on_grid, spacing_of
from tetsimplify.comparison.tables import signed
from tetsimplify.comparison.tasks import MAX_EDGE_LENGTH, Criterion, Settings, Task
from tetsimplify.decimators import METHODS
from tetsimplify.options import Progress
from tetsimplify.topology import topology


class Setup(NamedTuple):
    """How a model is made and simplified here."""

    model: str
    n_samples: int
    """A side."""
    spacings: float
    """ε, in distances between samples."""

    @property
    def length(self) -> float:
        """ε, in the units of the model."""
        return self.spacings * spacing_of(self.model, self.n_samples)


class Figures(NamedTuple):
    """A row of the table in the paper."""

    n_vertices: int
    n_faces: int
    n_vertices_after: int
    n_faces_after: int
    seconds: float


SETUPS = (Setup("torus", 53, 0.49), Setup("hyperboloid", 93, 0.50))

ALGORITHMS = {
    "improved": replace(METHODS["tetsimplify-length"], title="improved algorithm"),
    "standard": replace(METHODS["standard"], title="standard algorithm"),
}
OPTIONS = {"foldover": None, "removal_limit": math.inf, "boundary": "lock"}

PAPER = {
    ("torus", "improved"): Figures(16_772, 33_544, 4_985, 9_970, 0.22),
    ("torus", "standard"): Figures(16_772, 33_544, 4_990, 9_980, 0.23),
    ("hyperboloid", "improved"): Figures(56_288, 111_140, 18_106, 34_776, 0.80),
    ("hyperboloid", "standard"): Figures(56_288, 111_140, 18_118, 34_800, 0.82),
}

INFERRED = (
    "Lattice: Kuhn's six tetrahedra a cube. The paper names none for its table; the example in it "
    "is of Chan, Purisima and Skala.",
    "Torus: radii 1 and 0.4 in a cube of half width 1.7, 53 samples a side, so that the number of "
    "faces comes near.",
    "Hyperboloid: z^2 = 1 + x^2 + y^2 in a cube of half width 2, 93 samples a side, likewise. As "
    "two discs, the numbers of the paper imply 1,432 boundary edges before and after: the boundary "
    "was left alone, and is locked here. Here it has 1,084.",
    "ε: 0.49 and 0.50 distances between samples, so that the numbers after come near.",
    "No guard against folds and no limit on what is removed: the paper has none.",
)


def table1(
    *,
    output: str | os.PathLike[str] | None = None,
    repeats: int = 5,
    clock: str = "wall",
    progress: Progress | None = None,
) -> Comparison:
    """Do Table 1 of the paper again.

    Parameters
    ----------
    output, repeats, clock, progress
        As those of :func:`tetsimplify.compare.compare`.

    Returns
    -------
    Comparison
        Its results have the figures of the paper under ``"table1"``.
    """
    given = {setup.model: _input(setup) for setup in SETUPS}
    tasks = [
        Task(given[setup.model], method, Criterion(MAX_EDGE_LENGTH, setup.length), OPTIONS)
        for setup in SETUPS
        for method in ALGORITHMS.values()
    ]
    paper = [
        {"input": model, "method": ALGORITHMS[algorithm].name, **figures._asdict()}
        for (model, algorithm), figures in PAPER.items()
    ]
    return carry_out(
        tasks,
        list(given.values()),
        list(ALGORITHMS.values()),
        Settings(repeats=repeats, clock=clock),
        output,
        extra={"table1": {"paper": paper, "inferred": list(INFERRED)}},
        progress=progress,
    )


def _input(setup: Setup) -> Input:
    mesh = on_grid(setup.model, setup.n_samples)
    return Input(setup.model, "model", mesh, topology(*mesh))


def rows_of(results: dict[str, Any]) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Runs, and the figures of the paper for each."""
    for figures in results["table1"]["paper"]:
        for run in results["runs"]:
            if (run["input"], run["method"]) == (figures["input"], figures["method"]):
                yield run, figures


def table_of(results: dict[str, Any]) -> Iterator[Table | Text]:
    """The table for the terminal, ours above the paper's, and what was inferred."""
    made = Table(
        title="Table 1 of Pepko and Borisenko (2023)",
        box=box.SIMPLE_HEAD,
        title_justify="left",
        title_style="bold",
        pad_edge=False,
        show_edge=False,
        collapse_padding=True,
    )
    for name in ("model", "algorithm"):
        made.add_column(name, no_wrap=True)
    for name in ("vertices", "faces", "after", "", "s", "degree ≠ 2", "χ"):
        made.add_column(name, justify="right")
    inputs = {one["name"]: one for one in results["inputs"]}
    for run, figures in rows_of(results):
        algorithm = run["title"].removesuffix(" algorithm")
        made.add_row(run["input"], algorithm, *_cells(run, inputs[run["input"]]))
        counts = [f"{figures[name]:,}" for name in Figures._fields[:-1]]
        made.add_row("", "  the paper", *counts, f"{figures['seconds']:.2f}", style="dim")
    yield made
    yield Text("Inferred:", style="dim")
    for line in results["table1"]["inferred"]:
        yield Text(line, style="dim")


def _cells(run: dict[str, Any], given: dict[str, Any]) -> list[str]:
    before = [f"{given['n_vertices']:,}", f"{given['n_faces']:,}"]
    if "n_faces" not in run:
        return [*before, run["status"]]
    return [
        *before,
        f"{run['n_vertices']:,}",
        f"{run['n_faces']:,}",
        f"{run['seconds']['median']:.3f}",
        f"{run['n_violating_edges']:,}",
        signed(run["euler_characteristic"]),
    ]
