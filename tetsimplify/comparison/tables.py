"""A comparison as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from tetsimplify.comparison.tasks import MAX_EDGE_LENGTH, REGULARISED

UNIT = 1e-5  # of distances, in diagonals

COST_AND_SHAPE = ("seconds", "MiB", "faces", "mean", "max", "2r/R", "edges < ε")
TOPOLOGY = ("kept", "χ", "degree", "double", "no area", "flipped", "crossing")
LEGEND = (
    "MiB: at the peak, above what there was before.",
    f"mean, max: of the distance both ways, in {UNIT:g} of the diagonal.",
    "2r/R: mean over the faces, 1 is an equilateral triangle.",
    "edges < ε: shorter than the length asked for; where a number of faces is asked",
    "for, than half the edge of equilateral triangles with the area of the input.",
    "degree: edges with other than 2 faces, or 1 where the input has a boundary.",
    "double, no area, flipped: faces; crossing: pairs of them.",
)


def tables_of(results: dict[str, Any]) -> Iterator[RenderableType]:
    """Two tables for each input and criterion, what was broken, and what is absent."""
    inputs = {one["name"]: one for one in results["inputs"]}
    for title, runs in _groups(results["runs"], inputs):
        diagonal = inputs[runs[0]["input"]]["diagonal"]
        shape, topology = _empty(title, COST_AND_SHAPE), _empty("", TOPOLOGY)
        for run in runs:
            has_figures = "n_faces" in run
            cells = _shape_cells(run, diagonal) if has_figures else [run["status"]]
            shape.add_row(run["method"], *cells, style=_style(run))
            if has_figures:
                topology.add_row(run["method"], *_topology_cells(run), style=_style(run))
        yield shape
        yield topology
        yield from _remarks(runs)
    yield Text("\n".join(LEGEND), style="dim")
    for one in results["absent"]:
        yield Text(f"absent: {one['title']}; {one['install']}", style="yellow")


def _groups(
    runs: Iterable[dict[str, Any]], inputs: dict[str, Any]
) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Runs of the same input and criterion, with a title."""
    found: dict[str, list[dict[str, Any]]] = {}
    for run in runs:
        one = inputs[run["input"]]
        what = criterion_in_words(run["criterion"])
        chi = signed(one["topology"]["euler_characteristic"])
        title = f"{one['name']}: {one['n_faces']:,} faces, χ = {chi}; {what}"
        found.setdefault(title, []).append(run)
    yield from found.items()


def criterion_in_words(criterion: dict[str, float]) -> str:
    """What was asked for."""
    if MAX_EDGE_LENGTH in criterion:
        return f"edges below {criterion[MAX_EDGE_LENGTH]:.4g} contracted"
    if REGULARISED in criterion:
        return f"cut to the {criterion[REGULARISED]:,.0f} faces of the regularised surface"
    return f"cut to {100 * criterion['keep_ratio']:g} %"


def _empty(title: str, columns: Iterable[str]) -> Table:
    made = Table(
        title=title or None,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        title_style="bold",
        pad_edge=False,
        show_edge=False,
        collapse_padding=True,
    )
    made.add_column("method", no_wrap=True)
    for name in columns:
        made.add_column(name, justify="right")
    return made


def _shape_cells(run: dict[str, Any], diagonal: float) -> list[str]:
    memory, distance = run["peak_memory_bytes"], run["distance"]
    return [
        f"{run['seconds']['median']:.3g}",
        "" if memory is None else f"{memory / 2**20:,.1f}",
        f"{run['n_faces']:,}" + ("" if run["status"] == "ok" else " !"),
        *(three_digits(distance[name] / diagonal / UNIT) for name in ("mean", "upper")),
        f"{run['quality']['mean_ratio']:.3f}",
        f"{run['n_short_edges']:,}",
    ]


def _topology_cells(run: dict[str, Any]) -> list[str]:
    names = ("violating_edges", "duplicate_faces", "degenerate_faces", "flipped_faces")
    return [
        "yes" if run["topology_kept"] else "no",
        signed(run["euler_characteristic"]),
        *(f"{run[f'n_{name}']:,}" for name in (*names, "self_intersections")),
    ]


def _style(run: dict[str, Any]) -> str | None:
    if "n_faces" not in run:
        return "yellow"
    return None if run["topology_kept"] else "red"


def _remarks(runs: list[dict[str, Any]]) -> Iterator[Text]:
    """What each method broke, and how those ended that have no figures or another count."""
    for run in runs:
        if run["status"] == "wrong count":
            asked = f"{run['target_faces']:,} faces asked for, {run['n_faces']:,} left"
            yield Text(f"! {run['method']}: {asked}", style="yellow")
        elif run["status"] != "ok":
            yield Text(f"{run['method']}: {run['status']}, {run['message']}", style="yellow")
        if run.get("why_not"):
            yield Text(f"{run['method']}: {', '.join(run['why_not'])}", style="red")


def signed(number: int) -> str:
    """A number with a minus sign as long as a digit."""
    return f"{number:,}".replace("-", "\N{MINUS SIGN}")


def three_digits(value: float) -> str:
    """Three digits, or all before the point."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
