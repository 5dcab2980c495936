"""Measure what the adapters cost: `simplify` of a mesh object beside that of its arrays.

    python docs/benchmarks/adapters.py --clock cpu --markdown adapters.md

Every adapter gets a gyroid as an object of its package, and simplifies it with all that belongs
to that: taking the object apart, looking for seams, making the new object. Beside it
`tetsimplify.simplify` gets the arrays of the same object, in the types that they have there. The
overhead is the difference, in per cent of the time of the core.

All run in one process on one core, in turn, again and again. An adapter whose package is not
installed is left out.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from common import (
    CLOCKS,
    Row,
    Seconds,
    as_markdown,
    as_rich,
    gyroid,
    machine,
    one_core,
    timed,
    version_of,
)
from rich.console import Console
from simplify import length_that_keeps

import tetsimplify
from tetsimplify import Mesh


@dataclass(frozen=True)
class Host:
    """A kind of mesh objects.

    ``make(plugin, mesh)`` makes the object, anew for each run and not timed; ``run(plugin, made,
    max_edge_length)`` is.
    """

    name: str
    package: str
    make: Callable[[Any, Mesh], Any]
    run: Callable[[Any, Any, float], Any] = lambda plugin, made, length: plugin.simplify(
        made, max_edge_length=length
    )
    mesh_of: Callable[[Any], Any] = lambda made: made

    @property
    def plugin(self) -> Any:
        """The module of the adapter."""
        return import_module(f"tetsimplify.plugins.{self.package}")

    def arrays(self, made: Any) -> tuple[Any, Any]:
        """Vertices and faces of an object, as the adapter gives them to the core."""
        take_apart = getattr(self.plugin, f"from_{self.package}")
        vertices, faces, *_ = take_apart(self.mesh_of(made))
        return vertices, faces


def legacy(plugin: Any, mesh: Mesh) -> Any:
    """A legacy mesh of Open3D."""
    return plugin.to_open3d(*mesh)


def tensors(precision: str) -> Callable[[Any, Mesh], Any]:
    """Tensor meshes of Open3D."""

    def make(plugin: Any, mesh: Mesh) -> Any:
        vertices = mesh.vertices.astype(precision)
        return plugin.to_open3d(vertices, mesh.faces, like=plugin.TensorMesh())

    return make


def mesh_set(plugin: Any, mesh: Mesh) -> Any:
    """A ``MeshSet`` with one mesh."""
    meshes = plugin.pymeshlab.MeshSet()
    meshes.add_mesh(plugin.to_pymeshlab(*mesh))
    return meshes


def run_filter(plugin: Any, meshes: Any, length: float) -> Any:
    """The filter of PyMeshLab that works in place."""
    value = plugin.pymeshlab.PureValue(length)
    return plugin.simplify_current_mesh(meshes, maxedgelength=value)


HOSTS = (
    Host("Open3D, legacy", "open3d", legacy),
    Host("Open3D, tensors, float64", "open3d", tensors("f8")),
    Host("Open3D, tensors, float32", "open3d", tensors("f4")),
    Host("PyVista", "pyvista", lambda plugin, mesh: plugin.to_pyvista(*mesh)),
    Host("trimesh", "trimesh", lambda plugin, mesh: plugin.to_trimesh(*mesh)),
    Host("pymeshlab, Mesh", "pymeshlab", lambda plugin, mesh: plugin.to_pymeshlab(*mesh)),
    Host(
        "pymeshlab, filter in place",
        "pymeshlab",
        mesh_set,
        run_filter,
        lambda meshes: meshes.current_mesh(),
    ),
)


def measure(host: Host, mesh: Mesh, length: float, repeats: int, clock: str) -> Row:
    """The row of one host: the core and the adapter in turn, and each first in every other turn."""
    seconds: dict[str, Seconds] = {"core": [], "adapter": []}
    for repeat in range(-1, repeats):
        made = host.make(host.plugin, mesh)
        arrays = host.arrays(made)
        work = {
            "core": partial(tetsimplify.simplify, *arrays, max_edge_length=length),
            "adapter": partial(host.run, host.plugin, made, length),
        }
        for name in sorted(work, reverse=bool(repeat % 2)):
            times, _ = timed(work[name])
            if repeat >= 0:  # the first time things are loaded
                seconds[name].append(times[clock])
    core, adapter = seconds["core"], seconds["adapter"]
    more = statistics.median(b - a for a, b in zip(core, adapter, strict=True))
    return {
        "adapter": host.name,
        "version": str(version_of(host.package)),
        "core, s": f"{statistics.median(core):.3f}",
        "adapter, s": f"{statistics.median(adapter):.3f}",
        "more, s": f"{more:.3f}",
        "overhead": f"{100 * more / statistics.median(core):.1f} %",
    }


def parse() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--faces", type=int, default=1_000_000, help="faces of the gyroid")
    parser.add_argument("--keep", type=float, default=15.0, help="per cent of the faces to keep")
    parser.add_argument("--repeats", type=int, default=7, help="runs of every adapter")
    parser.add_argument("--clock", choices=CLOCKS, default="wall", help="whose time to tell")
    parser.add_argument("--hosts", nargs="*", help="only these, by parts of their names")
    parser.add_argument("--markdown", type=Path, help="file to write the table to")
    return parser.parse_args()


def main() -> None:
    """Measure and tell."""
    arguments = parse()
    wanted = [
        host
        for host in HOSTS
        if arguments.hosts is None or any(part in host.name for part in arguments.hosts)
    ]
    hosts = [host for host in wanted if version_of(host.package)]
    with one_core():
        mesh = gyroid(arguments.faces)
        length = length_that_keeps(mesh, arguments.keep / 100)
        rows = [measure(host, mesh, length, arguments.repeats, arguments.clock) for host in hosts]
    title = f"gyroid of {len(mesh.faces):,} faces, cut to {arguments.keep:g} %"
    out = Console()
    out.print(as_rich(title, rows))
    out.print(machine())
    if arguments.markdown:
        arguments.markdown.write_text(as_markdown(title, rows), encoding="utf-8")


if __name__ == "__main__":
    main()
