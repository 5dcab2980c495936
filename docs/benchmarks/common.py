"""What the scripts here share: the other simplifiers, a surface, clocks and tables."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

import tetsimplify
from tetsimplify import Mesh

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
    """A simplifier: its package, and how it is prepared and run.

    ``prepare(mesh)`` is not timed and gives what ``run(prepared, n_faces)`` takes, which is
    timed; ``finish`` makes vertices and faces of its result.
    """

    name: str
    package: str
    prepare: Callable[[Mesh], Any]
    run: Callable[[Any, int], Any]
    finish: Callable[[Any], tuple[Any, Any]] = lambda result: result

    @property
    def is_installed(self) -> bool:
        """Whether its package can be found, without importing it."""
        return version_of(self.package) is not None


def version_of(package: str) -> str | None:
    """Version of an installed package, None of others."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def prepare_meshoptimizer(mesh: Mesh) -> Any:
    """Single precision and unsigned indices are all that it takes."""
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32).reshape(-1)


def run_meshoptimizer(prepared: Any, n_faces: int) -> Any:
    """Without a limit on the error, so that the number of faces decides."""
    import meshoptimizer

    vertices, indices = prepared
    out = np.empty_like(indices)
    n = meshoptimizer.simplify(
        out, indices, vertices, target_index_count=3 * n_faces, target_error=1e9
    )
    return vertices, out[:n].reshape(-1, 3)


def run_fast_simplification(mesh: Mesh, n_faces: int) -> Any:
    """As it comes."""
    import fast_simplification

    return fast_simplification.simplify(mesh.vertices, mesh.faces, target_count=n_faces, agg=7.0)


def prepare_pyfqmr(mesh: Mesh) -> Any:
    """Its object holds the mesh."""
    import pyfqmr

    simplifier = pyfqmr.Simplify()
    simplifier.setMesh(mesh.vertices, mesh.faces)
    return simplifier


def run_pyfqmr(simplifier: Any, n_faces: int) -> Any:
    """As it comes."""
    simplifier.simplify_mesh(
        target_count=n_faces, aggressiveness=7, preserve_border=False, verbose=False
    )
    return simplifier


def prepare_pymeshlab(mesh: Mesh) -> Any:
    """Its set holds the mesh."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    return meshes


def run_pymeshlab(preserve_topology: bool) -> Callable[[Any, int], Any]:
    """With every parameter given, since defaults are kept from the last dialog."""

    def run(meshes: Any, n_faces: int) -> Any:
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=n_faces,
            targetperc=0.0,
            qualitythr=0.3,
            preserveboundary=False,
            boundaryweight=1.0,
            preservenormal=False,
            preservetopology=preserve_topology,
            optimalplacement=True,
            planarquadric=False,
            planarweight=0.001,
            qualityweight=False,
            autoclean=False,
            selected=False,
        )
        return meshes

    return run


def finish_pymeshlab(meshes: Any) -> tuple[Any, Any]:
    """Vertices and faces that are not deleted."""
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()


def prepare_vtk(mesh: Mesh) -> Any:
    """Points stay double."""
    import pyvista

    return pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)


def run_vtk(method: str, **options: Any) -> Callable[[Any, int], Any]:
    """One of the decimation filters of PyVista, which are those of VTK."""

    def run(polydata: Any, n_faces: int) -> Any:
        return getattr(polydata, method)(1.0 - n_faces / polydata.n_cells, **options)

    return run


TOOLS = (
    Tool("meshoptimizer", "meshoptimizer", prepare_meshoptimizer, run_meshoptimizer),
    Tool("fast-simplification", "fast-simplification", lambda mesh: mesh, run_fast_simplification),
    Tool("pyfqmr", "pyfqmr", prepare_pyfqmr, run_pyfqmr, lambda tool: tool.getMesh()[:2]),
    Tool(
        "pymeshlab quadric",
        "pymeshlab",
        prepare_pymeshlab,
        run_pymeshlab(False),
        finish_pymeshlab,
    ),
    Tool(
        "pymeshlab quadric, preservetopology",
        "pymeshlab",
        prepare_pymeshlab,
        run_pymeshlab(True),
        finish_pymeshlab,
    ),
    Tool(
        "VTK quadric decimation",
        "pyvista",
        prepare_vtk,
        run_vtk("decimate"),
        lambda polydata: (polydata.points, polydata.regular_faces),
    ),
    Tool(
        "VTK DecimatePro, preserve_topology",
        "pyvista",
        prepare_vtk,
        run_vtk("decimate_pro", preserve_topology=True),
        lambda polydata: (polydata.points, polydata.regular_faces),
    ),
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
