"""What the scripts here share: the other simplifiers, a surface, clocks and tables."""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import tetsimplify
from tetsimplify import Mesh
from tetsimplify.decimators.method import version_of
from tetsimplify.standard import METHODS, Goal, Method

NAME = "tetsimplify"
GYROID_PERIODS = 2
WIDTH = 170  # of the tables
Seconds = list[float]
Times = dict[str, float]  # of the clocks
Row = dict[str, str]
CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}


# --- the peers -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Tool:
    """One of the methods of `tetsimplify.standard`, under its name in the tables here."""

    name: str
    method: Method

    @property
    def package(self) -> str:
        """The package that it is in."""
        return self.method.packages[0]

    @property
    def is_installed(self) -> bool:
        """Whether its package can be found, without importing it."""
        return self.method.version is not None

    def prepare(self, mesh: Mesh) -> Any:
        """What `run` takes; not timed."""
        return self.method.prepare(mesh, Goal())

    def run(self, prepared: Any, n_faces: int) -> Any:
        """Simplify; timed."""
        return self.method.run(prepared, Goal(target_faces=n_faces))

    def finish(self, raw: Any) -> tuple[Any, Any]:
        """Vertices and faces of the result; not timed."""
        return self.method.finish(raw)


TOOLS = (
    Tool("meshoptimizer", METHODS["meshoptimizer"]),
    Tool("fast-simplification", METHODS["fast-simplification"]),
    Tool("pyfqmr", METHODS["pyfqmr"]),
    Tool("pymeshlab quadric", METHODS["pymeshlab-quadric"]),
    Tool("pymeshlab quadric, preservetopology", METHODS["pymeshlab-topology"]),
    Tool("VTK quadric decimation", METHODS["vtk-quadric"]),
    Tool("VTK DecimatePro, preserve_topology", METHODS["vtk-pro-topology"]),
)


def wanted_tools(arguments: argparse.Namespace, tools: Sequence[Tool]) -> list[Tool]:
    """Those of the command line, or all."""
    parts = arguments.tools
    return [tool for tool in tools if parts is None or any(part in tool.name for part in parts)]


def installed(tools: Sequence[Tool]) -> tuple[list[Tool], list[str]]:
    """Those that can run, and the names of the others."""
    return (
        [tool for tool in tools if tool.is_installed],
        [tool.name for tool in tools if not tool.is_installed],
    )


# --- the surface -----------------------------------------------------------------------------


def gyroid(n_faces: int) -> Mesh:
    """Two periods a side, by marching tetrahedra, with about so many faces."""

    def cut(n: int) -> Mesh:
        # odd phases, so that no sample lies on the surface
        angle = GYROID_PERIODS * 2 * np.pi * np.arange(n) / n
        x, y, z = np.meshgrid(angle + 0.1, angle + 0.2, angle + 0.3, indexing="ij", sparse=True)
        volume = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
        return tetsimplify.extract_isosurface(volume, 0.0)

    small = 48
    return cut(round(small * (n_faces / len(cut(small).faces)) ** 0.5))


# --- measuring -------------------------------------------------------------------------------


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this process on one core, where the system allows it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def timed(work: Callable[[], Any]) -> tuple[Times, Any]:
    """Seconds that something takes by each clock, and its result."""
    begin = {name: clock() for name, clock in CLOCKS.items()}
    result = work()
    return {name: clock() - begin[name] for name, clock in CLOCKS.items()}, result


def seconds_of(times: list[Times], clock: str) -> Seconds:
    """The seconds by one clock."""
    return [entry[clock] for entry in times]


@dataclass
class Outcome:
    """What one tool did in one case."""

    tool: str
    times: list[Times] = field(default_factory=list)
    n_faces: int = 0
    euler_characteristic: int = 0
    edges_of_degree_above_2: int = 0
    duplicate_faces: int = 0
    degenerate_faces: int = 0
    same_topology: bool = False

    def look_at(self, result: Mesh, given: Mesh) -> None:
        """Look at the topology of a result."""
        found = tetsimplify.topology(*result)
        self.n_faces = found.n_faces
        self.euler_characteristic = found.euler_characteristic
        self.edges_of_degree_above_2 = len(found.non_manifold_edges)
        self.duplicate_faces = len(found.duplicate_faces)
        self.degenerate_faces = len(found.degenerate_faces)
        self.same_topology = found.same_topology(tetsimplify.topology(*given))


def as_result(vertices: Any, faces: Any) -> Mesh:
    """The arrays that a tool gives, in our types and nothing else changed."""
    return Mesh(np.asarray(vertices, np.float64), np.asarray(faces).astype(np.int32))


def machine() -> dict[str, Any]:
    """What this ran on."""
    cpu = platform.processor()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.split(": ")[1] for line in lines if line.startswith("model name")), cpu)
    packages = [NAME, "numpy", "numba", "vtk", *(tool.package for tool in TOOLS)]
    return {
        "cpu": cpu,
        "cores": os.cpu_count(),
        "system": platform.platform(terse=True),
        "python": platform.python_version(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "versions": {package: version_of(package) for package in dict.fromkeys(packages)},
    }


# --- telling ---------------------------------------------------------------------------------


def spread(seconds: Seconds) -> str:
    """Median and extremes."""
    return f"{statistics.median(seconds):.3g} ({min(seconds):.3g} to {max(seconds):.3g})"


def signed(n: int) -> str:
    """A number with a real minus."""
    return f"{n:,}".replace("-", "\N{MINUS SIGN}")


def time_columns(name: str, seconds: Seconds, reference: Seconds, n_faces: int) -> Row:
    """The first columns of a comparison; `reference` are the seconds that the ratio is to."""
    ratio = statistics.median(seconds) / statistics.median(reference) if seconds else 0.0
    return {
        "tool": name,
        "seconds, median (min to max)": spread(seconds) if seconds else "",
        "ratio": f"{ratio:.2f}" if seconds else "",
        "faces": f"{n_faces:,}",
    }


def as_rich(title: str, rows: list[Row]) -> Table:
    """A table for the terminal."""
    table = Table(title=title, title_justify="left")
    for k, name in enumerate(rows[0]):
        table.add_column(name, justify="left" if k == 0 else "right")
    for row in rows:
        table.add_row(*row.values())
    return table


def as_markdown(title: str, rows: list[Row]) -> str:
    """A table for a page."""
    names = list(rows[0])
    lines = [names, ["---", *["---:"] * (len(names) - 1)], *(list(row.values()) for row in rows)]
    return f"### {title}\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def add_options(parser: argparse.ArgumentParser, repeats: int = 5) -> None:
    """What all comparisons can be told."""
    parser.add_argument("--repeats", type=int, default=repeats, help="runs of every tool")
    parser.add_argument("--clock", choices=CLOCKS, default="wall", help="whose time to tell")
    parser.add_argument("--tools", nargs="*", help="only these tools, by parts of their names")
    parser.add_argument("--json", type=Path, help="file for all figures")
    parser.add_argument("--markdown", type=Path, help="file to write the tables to")


def tell(
    tables: list[tuple[str, list[Row]]], figures: dict[str, Any], markdown: Path | None
) -> None:
    """Show tables in the terminal, with what they were measured on, and write them to a file."""
    out = Console()
    out.width = max(out.width, WIDTH)
    for title, rows in tables:
        out.print(as_rich(title, rows))
    if figures["absent"]:
        out.print(f"not installed: {', '.join(figures['absent'])}")
    out.print(figures["machine"])
    if markdown:
        text = "\n".join(as_markdown(title, rows) for title, rows in tables)
        markdown.write_text(text, encoding="utf-8")


def write_between(page: Path, name: str, text: str) -> None:
    """Put a text between the marks of a name in a page."""
    begin, end = f"<!-- {name}: begin -->\n", f"<!-- {name}: end -->\n"
    before, rest = page.read_text(encoding="utf-8").split(begin)
    after = rest.split(end)[1]
    page.write_text(f"{before}{begin}\n{text.strip()}\n\n{end}{after}", encoding="utf-8")
