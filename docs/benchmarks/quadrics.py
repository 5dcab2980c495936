"""Measure the quadric mode beside other simplifiers: error, quality, topology, time.

    python docs/benchmarks/quadrics.py gyroid igea.ply --keep 15 2 --json figures.json

A case is ``gyroid``, ``brain`` (the volume in the package), or a mesh file. A mesh that is no
oriented manifold is repaired first, for all tools. Every tool gets the same mesh and is asked for
the same number of faces, in one process on one core, in turn, again and again; what the clocks
tell, and what counts as the time of a tool, is as in ``simplify.py``.

The distances, the shape of the faces and the topology are measured once for each tool, with
``surface_distance``, ``quality`` and ``topology``. A face is flipped when its normal is opposite
to that of the face given that is nearest to its centre.

The figures are added to those in the JSON file, so that cases can be run one at a time; the
tables are those of all cases in it.
"""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from common import (
    NAME,
    TOOLS,
    Outcome,
    Row,
    Seconds,
    Times,
    Tool,
    add_options,
    as_result,
    gyroid,
    installed,
    machine,
    one_core,
    seconds_of,
    signed,
    tell,
    time_columns,
    timed,
    wanted_tools,
)
from rich.console import Console

import tetsimplify
from tetsimplify import Mesh, demo
from tetsimplify.comparison.measuring import n_flipped, normals
from tetsimplify.io import read_mesh
from tetsimplify.targets import Target

CASES = (
    "gyroid",
    "dragon_vrip_full.ply",
    "igea.ply",
    "skull_yj.ply",
    "cranium_invesalius.ply",
    "windbuildings.ply",
)
PEERS = tuple(tool for tool in TOOLS if "DecimatePro" not in tool.name)
TOLERANCE = 1e-5  # of the bounds of the largest distance, in diagonals
UNIT = 1e-5  # of distances in the tables, in diagonals
SLIVER = 0.1  # 2 r/R
NEEDLE = 1e-3  # 2 r/R


# --- the cases -------------------------------------------------------------------------------


@dataclass
class Case:
    """A mesh that all can take."""

    name: str
    mesh: Mesh
    repaired: dict[str, int] | None
    """What was mended, None of an oriented manifold."""

    @property
    def diagonal(self) -> float:
        """Of the box around the mesh."""
        return float(np.linalg.norm(np.ptp(self.mesh.vertices, axis=0)))


def load(name: str, arguments: argparse.Namespace) -> Case:
    """The case of a name or a file."""
    if name == "gyroid":
        return Case("gyroid, two periods a side", gyroid(arguments.faces), None)
    if name == "brain":
        return Case("MNI152 brain, level 80.5", demo.extract_brain(), None)
    path = arguments.folder / name
    mesh = read_mesh(path)
    if tetsimplify.topology(*mesh).is_manifold:
        return Case(path.stem, mesh, None)
    repaired = tetsimplify.repair(*mesh)
    return Case(path.stem, Mesh(repaired.vertices, repaired.faces), asdict(repaired.report))


# --- measuring -------------------------------------------------------------------------------


@dataclass
class Measured(Outcome):
    """What one tool did in one case. Distances are in diagonals of the box around the input."""

    mean_to_input: float = 0.0
    mean_from_input: float = 0.0
    mean: float = 0.0
    rms: float = 0.0
    max_lower: float = 0.0
    max_upper: float = 0.0
    radius_ratio: float = 0.0
    slivers: int = 0
    needles: int = 0
    flipped_faces: int = 0
    error: str | None = None
    """Why there are no figures."""


def run(
    case: Case, tools: list[Tool], n_faces: int, repeats: int, patience: float
) -> Iterable[tuple[str, Times, Any]]:
    """Run all tools in turn, again and again; give names, times and first results.

    A tool that takes longer than `patience` seconds runs once.
    """
    small = gyroid(10_000)
    tetsimplify.simplify(*small, target_faces=2_000)
    for tool in tools:
        tool.run(tool.prepare(small), 2_000)
    for repeat in range(repeats):
        times, result = timed(lambda: tetsimplify.simplify(*case.mesh, target_faces=n_faces))
        yield NAME, times, None if repeat else (result.vertices, result.faces)
        for tool in list(tools):
            prepared = tool.prepare(case.mesh)
            times, raw = timed(lambda tool=tool, given=prepared: tool.run(given, n_faces))
            yield tool.name, times, None if repeat else tool.finish(raw)
            if times["cpu"] > patience:
                tools.remove(tool)


def look_at(measured: Measured, case: Case, target: Target, result: Mesh) -> None:
    """Measure the topology of a mesh and its faces."""
    measured.look_at(result, case.mesh)
    shape = tetsimplify.quality(*result)
    measured.degenerate_faces = len(shape.zero_area_faces)
    measured.radius_ratio = float(shape.radius_ratio.mean())
    measured.slivers = int((shape.radius_ratio < SLIVER).sum())
    measured.needles = int((shape.radius_ratio < NEEDLE).sum())
    measured.flipped_faces = n_flipped(result, target, normals(case.mesh))


def judge(measured: Measured, case: Case, target: Target, vertices: Any, faces: Any) -> None:
    """Measure a result."""
    result = as_result(vertices, faces)
    look_at(measured, case, target, result)
    unit = case.diagonal
    distance = tetsimplify.surface_distance(result, case.mesh, tolerance=TOLERANCE * unit)
    measured.mean_to_input = distance.a_to_b.mean / unit
    measured.mean_from_input = distance.b_to_a.mean / unit
    measured.mean = (measured.mean_to_input + measured.mean_from_input) / 2
    measured.rms = distance.rms / unit
    measured.max_lower, measured.max_upper = distance.lower / unit, distance.upper / unit


def given(case: Case) -> Measured:
    """The figures of the input itself."""
    measured = Measured("the input")
    look_at(measured, case, Target(case.mesh), case.mesh)
    return measured


def compare(
    case: Case, tools: list[Tool], n_faces: int, arguments: argparse.Namespace, console: Console
) -> list[Measured]:
    """All tools in one case."""
    repeats, patience = arguments.repeats, arguments.patience
    rows = {name: Measured(name) for name in (NAME, *(tool.name for tool in tools))}
    results = {}
    with one_core():
        for name, times, result in run(case, list(tools), n_faces, repeats, patience):
            rows[name].times.append(times)
            if result is not None:
                results[name] = [np.array(array) for array in result]
            console.print(f"{case.name}, {n_faces:,} faces: {name}, {times['cpu']:.3g} s")
    target = Target(case.mesh)
    for name, result in results.items():
        try:
            judge(rows[name], case, target, *result)
        except tetsimplify.MeshError as error:
            rows[name].error = str(error)
    return list(rows.values())


# --- telling ---------------------------------------------------------------------------------


def number(value: float) -> str:
    """Three digits, or all before the point."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def median_seconds(tool: dict[str, Any], clock: str) -> float:
    """Median time of a tool."""
    return statistics.median(seconds_of(tool["times"], clock))


def comparison_rows(tools: list[dict[str, Any]], given: dict[str, Any], clock: str) -> list[Row]:
    """The table of one case: all tools, and the input."""
    ours = tools[0]

    def row(tool: dict[str, Any]) -> Row:
        seconds: Seconds = seconds_of(tool["times"], clock)
        return {
            **time_columns(
                tool["tool"], seconds, seconds_of(ours["times"], clock), tool["n_faces"]
            ),
            "mean": number(tool["mean"] / UNIT) if seconds else "",
            "to ours": number(tool["mean"] / ours["mean"]) if seconds else "",
            "max": number(tool["max_upper"] / UNIT) if seconds else "",
            "mean 2r/R": f"{tool['radius_ratio']:.4f}",
            "2r/R < 0.1": f"{100 * tool['slivers'] / max(1, tool['n_faces']):.2f} %",
            "edges of degree > 2": f"{tool['edges_of_degree_above_2']:,}",
            "degenerate faces": f"{tool['degenerate_faces']:,}",
            "flipped faces": f"{tool['flipped_faces']:,}",
            "same topology": "yes" if tool["same_topology"] else "no",
        }

    return [row(tool) for tool in (*tools, given) if tool["error"] is None]


def short_rows(cases: dict[str, Any], clock: str) -> list[Row]:
    """The figures of tetsimplify as parts of those of others."""

    def row(title: str, tools: list[dict[str, Any]]) -> Row:
        ours, others = tools[0], {tool["tool"]: tool for tool in tools[1:]}

        def part(key: str, name: str) -> str:
            tool = others.get(name)
            return number(ours[key] / tool[key]) if tool and tool["error"] is None else ""

        def time_part(name: str) -> str:
            if name not in others:
                return ""
            return f"{median_seconds(ours, clock) / median_seconds(others[name], clock):.3f}"

        return {
            "case": title,
            "mean / pymeshlab": part("mean", "pymeshlab quadric"),
            "mean / fast-simplification": part("mean", "fast-simplification"),
            "mean / meshoptimizer": part("mean", "meshoptimizer"),
            "max / pymeshlab": part("max_upper", "pymeshlab quadric"),
            "2r/R": f"{ours['radius_ratio']:.4f}",
            "best 2r/R of others": f"{max(tool['radius_ratio'] for tool in others.values()):.4f}",
            "time / pymeshlab": time_part("pymeshlab quadric"),
            "time / fast-simplification": time_part("fast-simplification"),
        }

    return [row(title, case["tools"]) for title, case in cases.items() if len(case["tools"]) > 1]


def tables_of(figures: dict[str, Any]) -> list[tuple[str, list[Row]]]:
    """All tables, with their titles."""
    tables = []
    for title, case in figures["cases"].items():
        chi = signed(case["euler_characteristic"])
        mended = "" if case["repaired"] is None else ", repaired first"
        heading = f"{title}: {case['n_faces']:,} faces, χ = {chi}{mended}"
        tables.append((heading, comparison_rows(case["tools"], case["input"], figures["clock"])))
    return [
        *tables,
        ("tetsimplify over the others", short_rows(figures["cases"], figures["clock"])),
    ]


def parse() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", default=CASES, metavar="CASE")
    parser.add_argument("--folder", type=Path, default=Path(), help="where the mesh files are")
    parser.add_argument("--faces", type=int, default=2_000_000, help="faces of the gyroid")
    parser.add_argument(
        "--keep", type=float, nargs="*", default=[15.0, 2.0], help="per cent of the faces to keep"
    )
    parser.add_argument(
        "--patience", type=float, default=np.inf, help="tools slower than so many seconds run once"
    )
    parser.add_argument("--tables", action="store_true", help="tables of that file, no new figures")
    add_options(parser)
    return parser.parse_args()


def main() -> None:
    """Measure and tell."""
    arguments = parse()
    console = Console(stderr=True)
    tools, absent = installed(wanted_tools(arguments, PEERS))
    figures: dict[str, Any] = {"cases": {}}
    if arguments.json and arguments.json.exists():
        figures = json.loads(arguments.json.read_text())
    if not arguments.tables:
        figures["clock"] = arguments.clock
        figures["machine"] = machine()
        figures["absent"] = absent
    for name in () if arguments.tables else arguments.cases:
        case = load(name, arguments)
        before = tetsimplify.topology(*case.mesh)
        for keep in arguments.keep:
            n_faces = round(keep / 100 * before.n_faces)
            measured = compare(case, tools, n_faces, arguments, console)
            figures["cases"][f"{case.name}, cut to {keep:g} %"] = {
                "n_faces": before.n_faces,
                "euler_characteristic": before.euler_characteristic,
                "n_components": before.n_components,
                "n_boundary_loops": before.n_boundary_loops,
                "repaired": case.repaired,
                "diagonal": case.diagonal,
                "input": asdict(given(case)),
                "tools": [asdict(row) for row in measured],
            }
            if arguments.json:
                arguments.json.write_text(json.dumps(figures, indent=1) + "\n")

    tell(tables_of(figures), figures, arguments.markdown)


if __name__ == "__main__":
    main()
