"""Measure what of the time of the PyMeshLab adapter is PyMeshLab's own.

    python docs/benchmarks/pymeshlab_parts.py --markdown parts.md

A gyroid is simplified as a mesh to a new mesh, and by the filter in place. Calls of PyMeshLab are
timed one by one: what it takes to read a mesh, to make one, and for each filter that the one in
place is made of. These times are a floor for any adapter that goes through the same calls.
Milliseconds of the processor, medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pymeshlab
from common import Row, as_markdown, as_rich, gyroid, machine, one_core
from rich.console import Console
from simplify import length_that_keeps
from tetsimplify.plugins import pymeshlab as plugin
from tetsimplify.plugins import pymeshlab_in_place as in_place

import tetsimplify

READS = ("vertex_matrix", "face_matrix", "vertex_color_array", "vertex_scalar_array", "edge_matrix")
POSITIONS = "Mesh(...) of new positions for all vertices"
ADDED = "add_mesh(...) of these"
MADE = "Mesh(...) of the vertices and faces of the result"


class Stopwatch:
    """Milliseconds of the processor of named pieces of work, in each repeat."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = defaultdict(list)

    def time(self, name: str, work: Callable[[], Any]) -> Any:
        """Do some work and note how long it takes."""
        begin = time.process_time()
        result = work()
        self.times[name].append(1e3 * (time.process_time() - begin))
        return result

    def rows(self, repeats: int) -> list[Row]:
        """Name, how often in each repeat, and milliseconds of all of them together."""
        rows = []
        for name, times in self.times.items():
            n = len(times) // repeats
            sums = [sum(times[first : first + n]) for first in range(0, len(times), n)]
            rows.append({"what": name, "times": str(n), "ms": f"{statistics.median(sums):.1f}"})
        return rows


def to_a_new_mesh(given: pymeshlab.Mesh, length: float, repeats: int) -> list[Row]:
    """A mesh in, a new mesh out: the core, what reads, what makes the new one."""
    watch = Stopwatch()
    vertices, faces, *_ = plugin.from_pymeshlab(given)
    for _ in range(repeats):
        result = watch.time(
            "simplify of the arrays",
            lambda: tetsimplify.simplify(vertices, faces, max_edge_length=length),
        )
        watch.time("simplify of the Mesh", lambda: plugin.simplify(given, max_edge_length=length))
        for name in READS:
            watch.time(f"mesh.{name}()", getattr(given, name))
        watch.time(MADE, lambda: pymeshlab.Mesh(result.vertices, result.faces))  # noqa: B023
    return watch.rows(repeats)


def filter_in_place(given: pymeshlab.Mesh, length: float, repeats: int) -> list[Row]:
    """The filter, and the filters of PyMeshLab that it is made of."""
    watch, native = Stopwatch(), in_place.apply_filter
    value = pymeshlab.PureValue(length)
    positions = np.asfortranarray(given.vertex_matrix())

    def timed(meshes: pymeshlab.MeshSet, name: str, **parameters: Any) -> Any:
        return watch.time(name, lambda: native(meshes, name, **parameters))

    in_place.apply_filter = timed
    try:
        for _ in range(repeats):
            meshes = pymeshlab.MeshSet()
            target = watch.time(POSITIONS, lambda: pymeshlab.Mesh(positions))
            watch.time(ADDED, partial(meshes.add_mesh, target))
            meshes = pymeshlab.MeshSet()
            meshes.add_mesh(given)
            watch.time(
                "the filter as a whole",
                lambda: plugin.simplify_current_mesh(meshes, maxedgelength=value),  # noqa: B023
            )
    finally:
        in_place.apply_filter = native
    return watch.rows(repeats)


def main() -> None:
    """Measure and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--faces", type=int, default=1_000_000, help="faces of the gyroid")
    parser.add_argument("--keep", type=float, default=15.0, help="per cent of the faces to keep")
    parser.add_argument("--repeats", type=int, default=7, help="runs of everything")
    parser.add_argument("--markdown", type=Path, help="file to write the tables to")
    arguments = parser.parse_args()
    with one_core():
        mesh = gyroid(arguments.faces)
        length = length_that_keeps(mesh, arguments.keep / 100)
        given = plugin.to_pymeshlab(*mesh)
        tables = {
            "Mesh to Mesh": to_a_new_mesh(given, length, arguments.repeats),
            "Filter in place": filter_in_place(given, length, arguments.repeats),
        }
    out = Console()
    for title, rows in tables.items():
        out.print(as_rich(f"{title}: gyroid of {len(mesh.faces):,} faces", rows))
    out.print(machine())
    if arguments.markdown:
        text = "\n".join(as_markdown(title, rows) for title, rows in tables.items())
        arguments.markdown.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
