"""Reports as tables for people and as dictionaries for programs."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.table import Table

if TYPE_CHECKING:
    from tetsimplify.distance import SurfaceDistance
    from tetsimplify.quality import QualityReport
    from tetsimplify.report import SimplificationReport
    from tetsimplify.topology import TopologyReport

DEFECTS = {
    "non_manifold_edges": "edges of more than two faces",
    "non_manifold_vertices": "vertices with several fans of faces",
    "inconsistent_edges": "edges with clashing orientation",
    "duplicate_faces": "duplicate faces",
    "degenerate_faces": "degenerate faces",
    "unreferenced_vertices": "unreferenced vertices",
}
COUNTS = {
    "n_vertices": "vertices",
    "n_faces": "faces",
    "n_edges": "edges",
    "euler_characteristic": "Euler characteristic",
    "n_components": "components",
    "genus": "genus",
    "n_boundary_loops": "boundary loops",
    "n_boundary_edges": "boundary edges",
}
FIRST = 10  # defects that are listed one by one


def table(title: str, *headers: str) -> Table:
    """An empty table; all columns but the first are numbers."""
    made = Table(
        title=title,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        title_style="bold",
        pad_edge=False,
        show_edge=False,
        min_width=len(title),
    )
    for number, header in enumerate(headers):
        made.add_column(header, justify="right" if number else "left", no_wrap=number == 0)
    return made


def counted(value: Any) -> str:
    """A number as people read it."""
    if value is None:
        return "-"
    return f"{value:,}" if isinstance(value, int) else f"{value:.6g}"


def topology_as_dict(report: TopologyReport) -> dict[str, Any]:
    """All counts, and every defect with how many there are and the first of them."""
    return {
        **{name: getattr(report, name) for name in COUNTS},
        "edge_degrees": {
            degree: report.edge_degrees[degree] for degree in sorted(report.edge_degrees)
        },
        "is_manifold": report.is_manifold,
        "is_closed": report.is_closed,
        "is_oriented": report.is_oriented,
        "defects": {
            name: {"count": len(getattr(report, name)), "first": getattr(report, name)[:FIRST]}
            for name in DEFECTS
        },
    }


def topology_table(title: str, **reports: TopologyReport) -> Table:
    """Topologies side by side, one column for each."""
    made = table(title, "", *(name.replace("_", " ") for name in reports))
    columns = list(reports.values())
    for name, words in COUNTS.items():
        made.add_row(words, *(counted(getattr(report, name)) for report in columns))
    for degree in sorted({degree for report in columns for degree in report.edge_degrees}):
        counts = (counted(report.edge_degrees.get(degree, 0)) for report in columns)
        made.add_row(f"edges of degree {degree}", *counts)
    for name, words in DEFECTS.items():
        if any(len(getattr(report, name)) for report in columns):
            counts = (counted(len(getattr(report, name))) for report in columns)
            made.add_row(words, *counts, style="yellow")
    return made


def surfaces_table(reports: dict[str, TopologyReport]) -> Table:
    """Topologies of several surfaces, one row for each."""
    made = table("Surfaces", "", "faces", "χ", "components", "boundary loops", "manifold")
    for name, report in reports.items():
        counts = (
            report.n_faces,
            report.euler_characteristic,
            report.n_components,
            report.n_boundary_loops,
        )
        made.add_row(name, *map(counted, counts), "yes" if report.is_manifold else "no")
    return made


def defect_table(report: TopologyReport) -> Table | None:
    """The first defects of each kind, None where there are none."""
    made = table("Defects", "kind", "count")
    made.add_column("first")
    for name, words in DEFECTS.items():
        items: NDArray[np.int32] = getattr(report, name)
        if len(items):
            first = ", ".join(
                "-".join(map(str, np.atleast_1d(item).tolist())) for item in items[:FIRST]
            )
            made.add_row(
                words, counted(len(items)), first + (", ..." if len(items) > FIRST else "")
            )
    return made if made.row_count else None


def lengths_as_dict(lengths: NDArray[np.float64]) -> dict[str, float | None]:
    """Shortest, median and longest."""
    if not len(lengths):
        return {"min": None, "median": None, "max": None}
    return {"min": lengths.min(), "median": np.median(lengths), "max": lengths.max()}


def lengths_table(lengths: NDArray[np.float64]) -> Table:
    """Shortest, median and longest."""
    values = lengths_as_dict(lengths)
    made = table("Edge lengths", "", *values)
    made.add_row("length", *map(counted, values.values()))
    return made


def quality_table(report: QualityReport) -> Table:
    """The criteria that tell most, and what would be ideal."""
    made = table("Quality", "", "value", "ideal")
    made.add_row("mean radius ratio", counted(report.summary("radius_ratio").mean), "1")
    made.add_row("smallest angle in degrees", counted(report.summary("min_angle").min), "60")
    made.add_row("topological criterion", counted(report.topological_criterion), "0")
    return made


def distance_as_dict(distance: SurfaceDistance) -> dict[str, Any]:
    """Bounds and means of both directions together, and of each."""
    names = ("lower", "upper", "mean", "rms")
    parts = {"": distance, "a_to_b": distance.a_to_b, "b_to_a": distance.b_to_a}
    found = {part: {name: getattr(each, name) for name in names} for part, each in parts.items()}
    return {**found.pop(""), **found, "tolerance": distance.tolerance}


def distance_table(distance: SurfaceDistance, diagonal: float) -> Table:
    """Largest and mean distances, also as parts of a diagonal."""
    made = table("Distance", "", "from A to B", "from B to A", "both", "% of diagonal")
    rows = {
        "largest, at least": "lower",
        "largest, at most": "upper",
        "mean": "mean",
        "root mean square": "rms",
    }
    for words, name in rows.items():
        both = getattr(distance, name)
        one_way = (getattr(each, name) for each in (distance.a_to_b, distance.b_to_a))
        part = f"{100 * both / diagonal:.4g}" if diagonal else "-"
        made.add_row(words, *map(counted, one_way), counted(both), part)
    return made


def simplification_as_dict(report: SimplificationReport) -> dict[str, Any]:
    """What a simplification did."""
    return {
        "options": asdict(report.options),
        "stop": report.stop,
        "topology_before": topology_as_dict(report.topology_before),
        "topology_after": topology_as_dict(report.topology_after),
        "same_topology": report.topology_after.same_topology(report.topology_before),
        "shortest_edge_before": report.shortest_edge_before,
        "shortest_edge_after": report.shortest_edge_after,
        "n_simple": report.n_simple,
        "n_nested": report.n_nested,
        "n_lens_vertices": report.n_lens_vertices,
        "n_lens_faces": report.n_lens_faces,
        "n_sweeps": report.n_sweeps,
        "n_rounds": report.n_rounds,
        "remaining": report.remaining,
        "repairs": None if report.repairs is None else asdict(report.repairs),
    }


def stopped_by(report: SimplificationReport) -> str:
    """The criterion that was reached, as words."""
    if report.stop == "exhausted":
        return "topology and guards"
    return report.stop.replace("_", " ")


def headline(report: SimplificationReport) -> str:
    """What came of a simplification, in one line."""
    before, after = report.topology_before, report.topology_after
    kept = "kept" if after.same_topology(before) else "[bold red]changed[/]"
    return f"{before.n_faces:,} -> {after.n_faces:,} faces, topology {kept}"


def simplification_tables(report: SimplificationReport, seconds: dict[str, float]) -> list[Table]:
    """What a simplification did: topology before and after, contractions, what is left, time."""
    topologies = topology_table(
        "Topology", before=report.topology_before, after=report.topology_after
    )
    topologies.add_row(
        "shortest edge",
        f"{report.shortest_edge_before:.6g}",
        f"{report.shortest_edge_after:.6g}",
    )
    work = table("Contractions", "", "count")
    work.add_row("simple", counted(report.n_simple))
    work.add_row("nested", counted(report.n_nested))
    work.add_row("faces removed in lenses", counted(report.n_lens_faces))
    work.add_row("sweeps", counted(report.n_sweeps))
    if report.n_rounds > 1:
        work.add_row("rounds", counted(report.n_rounds))
    work.add_row("stopped by", stopped_by(report))
    tables = [topologies, work]
    if report.options.max_edge_length is not None:
        tables.append(_remaining_table(report, report.options.max_edge_length))
    tables.append(seconds_table(seconds))
    if report.repairs is not None:
        repairs = table("Repairs", "", "count")
        for name, count in asdict(report.repairs).items():
            repairs.add_row(name.replace("_", " "), counted(count))
        tables.insert(0, repairs)
    return tables


def _remaining_table(report: SimplificationReport, length: float) -> Table:
    """The short edges that are left, by reason."""
    made = table(f"Edges shorter than {length:.6g} left", "reason", "count")
    for reason, count in sorted(report.remaining.items(), key=lambda item: -item[1]):
        made.add_row(reason.replace("_", " "), counted(count))
    if not report.remaining:
        made.add_row("none", "0")
    return made


def seconds_table(seconds: dict[str, float]) -> Table:
    """Time of each stage."""
    made = table("Time", "stage", "seconds")
    for stage, duration in seconds.items():
        made.add_row(stage, f"{duration:.3f}")
    return made
