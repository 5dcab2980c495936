"""The table of all measurements."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any, NamedTuple

from tetsimplify.comparison.page import wording
from tetsimplify.comparison.page.model import Case, Comparison, Run, has_mesh, is_kept
from tetsimplify.comparison.page.tables import swatch
from tetsimplify.comparison.page.wording import NONE, counted, short, whole

ERROR_UNIT = 1e-5  # of the diagonal
Cell = tuple[str, float | None]


class Column(NamedTuple):
    """A column of the figures: what it shows, and what its rows are sorted by."""

    title: str
    meaning: str
    cell: Callable[[Comparison, Case, Run], Cell]
    classes: str = "number"


def table(comparison: Comparison) -> str:
    """All measurements: a group of rows for each input and criterion."""
    heads = "".join(
        f'<th scope="col" class="{column.classes}" title="{escape(column.meaning)}">'
        f'<button type="button">{column.title}</button></th>'
        for column in COLUMNS
    )
    groups = []
    for number, case in enumerate(comparison.cases):
        rows = "".join(_row(comparison, case, k) for k in comparison.runs_of(case).values())
        groups.append(
            f'<tbody data-case="{number}"><tr class="group"><th scope="rowgroup" '
            f'colspan="{len(COLUMNS)}">{_group_title(comparison, case)}</th></tr>{rows}</tbody>'
        )
    return (
        '<table class="figures"><caption class="unseen">All measurements. The buttons in the head '
        f"sort the rows of each group.</caption><thead><tr>{heads}</tr></thead>"
        f"{''.join(groups)}</table>"
    )


def _group_title(comparison: Comparison, case: Case) -> str:
    entry = next(entry for entry in comparison.inputs if entry["name"] == case.input)
    euler = (entry.get("topology") or {}).get("euler_characteristic")
    told = f"{counted(entry['n_faces'], 'face')}, χ {whole(euler)}"
    return f"{escape(case.input)} at {escape(case.name)} <small>before: {told}</small>"


def _row(comparison: Comparison, case: Case, number: int) -> str:
    run = comparison.runs[number]
    if not has_mesh(run):
        why = escape(f"{run['status']}. {run.get('message') or ''}".strip())
        return (
            f'<tr class="failed" data-run="{number}"><th scope="row">{swatch(run)}</th>'
            f'<td colspan="{len(COLUMNS) - 1}">{why}</td></tr>'
        )
    cells = []
    for column in COLUMNS[1:]:
        text, value = column.cell(comparison, case, run)
        sort = "" if value is None else f' data-sort="{escape(str(value))}"'
        cells.append(f'<td class="{column.classes}"{sort}>{text}</td>')
    return f'<tr data-run="{number}"><th scope="row">{swatch(run)}</th>{"".join(cells)}</tr>'


def _topology(comparison: Comparison, case: Case, run: Run) -> Cell:
    if is_kept(run):
        return '<span class="kept">kept</span>', 0
    why = "; ".join(run["why_not"]) or "changed"
    return f'<span class="broken">broken</span> <small>{escape(why)}</small>', 1


def _seconds(comparison: Comparison, case: Case, run: Run) -> Cell:
    told = run["seconds"]
    spread = f"{short(told['min'], 2)} to {short(told['max'], 2)}"
    return f"{short(told['median'])} <small>{spread}</small>", told["median"]


def _ratio(comparison: Comparison, case: Case, run: Run) -> Cell:
    ours = comparison.reference(case)
    if ours is None or not ours["seconds"]["median"]:
        return NONE, None
    ratio = run["seconds"]["median"] / ours["seconds"]["median"]
    return ("1" if run is ours else f"{short(ratio, 2)}"), ratio


def _faces(comparison: Comparison, case: Case, run: Run) -> Cell:
    target = f" <small>not {whole(run['target_faces'])}</small>"
    note = target if run["status"] == "wrong count" and run.get("target_faces") else ""
    return whole(run["n_faces"]) + note, run["n_faces"]


def _degrees(comparison: Comparison, case: Case, run: Run) -> Cell:
    return wording.degrees(run["edge_degrees"]), run["n_violating_edges"]


def _error(name: str) -> Callable[[Comparison, Case, Run], Cell]:
    def cell(comparison: Comparison, case: Case, run: Run) -> Cell:
        error = (run.get("distance") or {}).get(name)
        if error is None:
            return NONE, None
        part = error / comparison.diagonal(run)
        return short(part / ERROR_UNIT), part

    return cell


def _measure(
    *path: str, as_text: Callable[[Any], str] = whole
) -> Callable[[Comparison, Case, Run], Cell]:
    def cell(comparison: Comparison, case: Case, run: Run) -> Cell:
        value: Any = run
        for name in path:
            value = (value or {}).get(name)
        return as_text(value), value

    return cell


def _method(comparison: Comparison, case: Case, run: Run) -> Cell:
    return escape(run["title"]), None


COLUMNS = (
    Column("Method", "Sorts by the order of the runs", _method, "text"),
    Column("Topology", "Homeomorphic to the input, every edge of two faces", _topology, "text"),
    Column("Seconds", "Median, and from the least to the most", _seconds),
    Column(
        f"{wording.TIMES} ours",
        "Seconds, divided by those of our first method that keeps the topology",
        _ratio,
    ),
    Column("Faces", "Of the result", _faces),
    Column("Edge degrees", "How many edges have how many faces other than 2", _degrees),
    Column("χ", "Euler characteristic", _measure("euler_characteristic")),
    Column("Mean error", "Mean distance both ways, in 1e-5 of the diagonal", _error("mean")),
    Column(
        "Max. error",
        "Upper bound of the Hausdorff distance, in 1e-5 of the diagonal",
        _error("upper"),
    ),
    Column(
        "Quality",
        "Mean of 2r/R; 1 for equilateral triangles",
        _measure("quality", "mean_ratio", as_text=short),
    ),
    Column("Shortest edge", "In units of the input", _measure("shortest_edge", as_text=short)),
    Column("Edges < ε", "Edges shorter than the short length", _measure("n_short_edges")),
    Column("Self-intersections", "Pairs of faces that cross", _measure("n_self_intersections")),
    Column(
        "Memory",
        "Peak of the process",
        _measure("peak_memory_bytes", as_text=wording.memory),
        "number more",
    ),
    Column("Components", "Pieces", _measure("n_components"), "number more"),
    Column("Loops", "Boundary loops", _measure("n_boundary_loops"), "number more"),
    Column(
        "Bad vertices",
        "Vertices of more than one fan",
        _measure("n_nonmanifold_vertices"),
        "number more",
    ),
    Column(
        "Duplicates", "Faces that are there twice", _measure("n_duplicate_faces"), "number more"
    ),
    Column(
        "Degenerate",
        "Faces with a vertex twice or without area",
        _measure("n_degenerate_faces"),
        "number more",
    ),
    Column(
        "Flipped",
        "Faces that look the other way than the input there",
        _measure("n_flipped_faces"),
        "number more",
    ),
    Column(
        "Least angle",
        "In degrees",
        _measure("quality", "min_angle_degrees", as_text=short),
        "number more",
    ),
    Column(
        "Valence",
        "Mean distance of the valence from 6",
        _measure("quality", "mean_valence_deviation", as_text=short),
        "number more",
    ),
    Column(
        "Volume",
        "Relative change",
        _measure("volume_change", as_text=wording.percent),
        "number more",
    ),
    Column(
        "Area", "Relative change", _measure("area_change", as_text=wording.percent), "number more"
    ),
)
