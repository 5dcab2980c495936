"""What the scripts here share: the other simplifiers, a surface, clocks and tables."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
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
