"""Measure tetsimplify beside other simplifiers: time, topology of the results, memory.

    python docs/benchmarks/simplify.py gyroid brain dragon.ply --markdown tables.md

A case is ``gyroid``, ``brain`` (the volume in the package), or a mesh file. tetsimplify goes
first: the edge length is found by bisection so that a part of the faces is left (for the brain
it is 1.2 median edges), and all others are asked for the number of faces that this gave.

All tools run in one process on one core, in turn, again and again, so that figures of one table
can be compared; figures of different tables or machines cannot. On a machine with other work to
do ``--clock cpu`` tells the time of the processor instead of that of the wall. Each tool gets its
input in the types that it takes, and converting does not count. tetsimplify is timed with all
that it does: checks, both topologies, the report.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
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
    spread,
    tell,
    time_columns,
    timed,
    wanted_tools,
)
from rich.console import Console

import tetsimplify
from tetsimplify import Mesh, demo
from tetsimplify.edges import edge_lengths
from tetsimplify.io import read_mesh

SHARE_TOLERANCE = 2e-4  # of the faces kept, at the end of the bisection


# --- the cases -------------------------------------------------------------------------------


@dataclass
class Case:
    """A mesh, and how far it is simplified."""

    name: str
    mesh: Mesh
    max_edge_length: float


def length_that_keeps(mesh: Mesh, share: float) -> float:
    """The `max_edge_length` that leaves a share of the faces, by bisection."""
    low, high = 0.0, float(np.median(edge_lengths(mesh)))

    def kept(length: float) -> float:
        result = tetsimplify.simplify(*mesh, max_edge_length=length)
        return len(result.faces) / len(mesh.faces)

    while kept(high) > share:
        low, high = high, 2 * high
    while high - low > 1e-5 * high:
        middle = (low + high) / 2
        found = kept(middle)
        if abs(found - share) < SHARE_TOLERANCE:
            return middle
        low, high = (middle, high) if found > share else (low, middle)
    return high


def load(case: str, arguments: argparse.Namespace) -> Case:
    """The case of a name or a file."""
    if case == "brain":
        mesh = demo.extract_brain()
        length = demo.MEDIAN_EDGES * float(np.median(edge_lengths(mesh)))
        return Case("MNI152 brain, level 80.5, edges below 1.2 median edges", mesh, length)
    share = arguments.keep / 100
    mesh = gyroid(arguments.faces) if case == "gyroid" else read_mesh(case)
    name = "gyroid, two periods a side" if case == "gyroid" else Path(case).stem
    length = length_that_keeps(mesh, share)
    return Case(f"{name}, cut to {arguments.keep:g} %", mesh, length)


# --- measuring -------------------------------------------------------------------------------


@dataclass
class Measured(Outcome):
    """What one tool did in one case."""

    short_edges: int = 0
    remaining: dict[str, int] | None = None


def judge(measured: Measured, case: Case, vertices: Any, faces: Any) -> None:
    """Look at the topology of a result, and at the short edges left."""
    result = as_result(vertices, faces)
    measured.look_at(result, case.mesh)
    measured.short_edges = int((edge_lengths(result) < case.max_edge_length).sum())


def compare(case: Case, tools: list[Tool], repeats: int, console: Console) -> list[Measured]:
    """Run all tools in turn, again and again."""
    ours = Measured(NAME)
    rows = [ours, *(Measured(tool.name) for tool in tools)]
    small = gyroid(10_000)
    for tool in tools:
        tool.run(tool.prepare(small), 2_000)
    for repeat in range(repeats):
        console.print(f"{case.name}: run {repeat + 1} of {repeats}")
        times, result = timed(
            lambda: tetsimplify.simplify(*case.mesh, max_edge_length=case.max_edge_length)
        )
        ours.times.append(times)
        if repeat == 0:
            judge(ours, case, result.vertices, result.faces)
            ours.remaining = result.report.remaining
        for tool, row in zip(tools, rows[1:], strict=True):
            prepared = tool.prepare(case.mesh)
            times, raw = timed(lambda tool=tool, given=prepared: tool.run(given, ours.n_faces))
            row.times.append(times)
            if repeat == 0:
                judge(row, case, *tool.finish(raw))
    return rows


def of_topology(mesh: Mesh, repeats: int) -> list[Times]:
    """Times of `topology`."""
    return [timed(lambda: tetsimplify.topology(*mesh))[0] for _ in range(repeats)]


CHILD_IMPORT = """
import time
begin = time.perf_counter()
import tetsimplify
print(time.perf_counter() - begin)
"""

CHILD_FIRST = """
import time
begin = time.perf_counter()
import json, sys, numpy as np, tetsimplify
vertices, faces = (np.load(path) for path in sys.argv[1:3])
told = json.loads(sys.argv[3])
report = tetsimplify.simplify(vertices, faces, **told).report
seconds = time.perf_counter() - begin
if "max_edge_length" in told:
    assert report.n_nested, "the kernels for nested contractions were not needed"
print(seconds)
"""

CHILD_MEMORY = """
import sys, numpy as np, tetsimplify
vertices, faces = (np.load(path) for path in sys.argv[1:3])
tetsimplify.simplify(vertices[:3] + [[0.0], [1.0], [2.0]], [[0, 1, 2]], max_edge_length=0.0)
def status(key):
    lines = open("/proc/self/status").read().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(key))
before = status("VmRSS:")
tetsimplify.simplify(vertices, faces, max_edge_length=float(sys.argv[3]))
print((status("VmHWM:") - before) / len(faces))
"""


def child(code: str, *arguments: str, cache: str | None = None) -> float:
    """The number that a fresh Python process prints."""
    environment = os.environ | ({} if cache is None else {"NUMBA_CACHE_DIR": cache})
    command = [sys.executable, "-c", code, *arguments]
    run = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return float(run.stdout)


@contextmanager
def saved(mesh: Mesh) -> Iterator[list[str]]:
    """Files with the arrays of a mesh, for children."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [str(Path(folder, f"{name}.npy")) for name in Mesh._fields]
        for path, array in zip(paths, mesh, strict=True):
            np.save(path, array)
        yield paths


def cold_starts(repeats: int, **criterion: float) -> dict[str, Seconds]:
    """Seconds in fresh processes: import, and the first call with an empty and a full cache."""
    told = json.dumps(criterion or {"max_edge_length": 0.8})
    child(CHILD_IMPORT)  # so that all files are in memory
    measured: dict[str, Seconds] = {"import": [child(CHILD_IMPORT) for _ in range(repeats)]}
    empty: Seconds = []
    with saved(gyroid(40_000)) as paths:
        for _ in range(max(1, repeats // 2)):
            with tempfile.TemporaryDirectory() as cache:
                empty.append(child(CHILD_FIRST, *paths, told, cache=cache))
                full = [child(CHILD_FIRST, *paths, told, cache=cache) for _ in range(repeats)]
    return (
        measured
        | {"import and first call, full cache": full}
        | {"import and first call, empty cache": empty}
    )


def peak_memory(case: Case) -> float | None:
    """Bytes a face that `simplify` takes at its peak, beyond its input; only on Linux.

    The high-water mark of the process itself is read, since ``ru_maxrss`` of a child begins
    with that of its parent.
    """
    if not Path("/proc/self/status").exists():
        return None
    with saved(case.mesh) as paths:
        return child(CHILD_MEMORY, *paths, repr(case.max_edge_length))


# --- telling ---------------------------------------------------------------------------------


def comparison_rows(measured: list[Measured], clock: str) -> list[Row]:
    """The table of one case."""
    seconds = {row.tool: seconds_of(row.times, clock) for row in measured}
    return [
        {
            **time_columns(row.tool, seconds[row.tool], seconds[NAME], row.n_faces),
            "χ": signed(row.euler_characteristic),
            "edges of degree > 2": f"{row.edges_of_degree_above_2:,}",
            "duplicate faces": f"{row.duplicate_faces:,}",
            "degenerate faces": f"{row.degenerate_faces:,}",
            "same topology": "yes" if row.same_topology else "no",
            "edges < ε left": f"{row.short_edges:,}",
        }
        for row in measured
    ]


def parse() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", default=["gyroid", "brain"], metavar="CASE")
    parser.add_argument("--faces", type=int, default=2_000_000, help="faces of the gyroid")
    parser.add_argument("--keep", type=float, default=15.0, help="per cent of the faces to keep")
    parser.add_argument("--no-cold", action="store_true", help="leave the fresh processes out")
    add_options(parser)
    return parser.parse_args()


def main() -> None:
    """Measure and tell."""
    arguments = parse()
    console = Console(stderr=True)
    tools, absent = installed(wanted_tools(arguments, TOOLS))
    figures: dict[str, Any] = {
        "machine": machine(),
        "clock": arguments.clock,
        "absent": absent,
        "cases": {},
    }
    tables: list[tuple[str, list[Row]]] = []
    own: list[Row] = []
    for name in arguments.cases:
        with one_core():
            case = load(name, arguments)
            measured = compare(case, tools, arguments.repeats, console)
            topology_times = of_topology(case.mesh, arguments.repeats)
        before = tetsimplify.topology(*case.mesh)
        memory = peak_memory(case)
        figures["cases"][case.name] = {
            "n_faces": before.n_faces,
            "euler_characteristic": before.euler_characteristic,
            "n_components": before.n_components,
            "n_boundary_loops": before.n_boundary_loops,
            "max_edge_length": case.max_edge_length,
            "tools": [asdict(row) for row in measured],
            "topology": topology_times,
            "peak_bytes_a_face": memory,
        }
        chi = signed(before.euler_characteristic)
        title = f"{case.name}: {before.n_faces:,} faces, χ = {chi}"
        tables.append((title, comparison_rows(measured, arguments.clock)))
        own.append(
            {
                "case": case.name,
                "faces": f"{before.n_faces:,}",
                "`simplify`, s": spread(seconds_of(measured[0].times, arguments.clock)),
                "`topology`, s": spread(seconds_of(topology_times, arguments.clock)),
                "peak memory, bytes a face": "" if memory is None else f"{memory:.0f}",
                "edges left": ", ".join(f"{k} {n:,}" for k, n in measured[0].remaining.items()),
            }
        )
    if own:
        tables.append(("tetsimplify alone", own))
    if not arguments.no_cold:
        with one_core():
            figures["cold"] = cold_starts(arguments.repeats)
        tables.append(
            (
                "Fresh processes",
                [{"": name, "seconds": spread(s)} for name, s in figures["cold"].items()],
            )
        )

    tell(tables, figures, arguments.markdown)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
