"""One thread and two, in turn: extraction, topology, distance. Simplification is in peers.py.

python docs/benchmarks/threads.py --samples 256 --faces 2000000 --repeats 5
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from common import Row, as_markdown, gyroid

import tetsimplify

KEPT = 0.15  # of the faces
THREADS = (1, 2)


def in_turn(works: dict[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """Median seconds by the wall clock; one call of each first, which does not count."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for i in range(repeats + 1):
        for name, work in works.items():
            begin = time.perf_counter()
            work()
            if i:
                seconds[name].append(time.perf_counter() - begin)
    return {name: statistics.median(some) for name, some in seconds.items()}


def extractions(n: int, repeats: int) -> list[Row]:
    """Marching tetrahedra over a gyroid of n samples a side."""
    angle = 4.0 * np.pi * np.arange(n) / n
    x, y, z = np.meshgrid(angle + 0.1, angle + 0.2, angle + 0.3, indexing="ij", sparse=True)
    volume = (np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)).astype("f4")
    works: dict[str, Callable[[], Any]] = {
        f"{n}": lambda n=n: tetsimplify.extract_isosurface(volume, 0.0, threads=n) for n in THREADS
    }
    seconds = in_turn(works, repeats)
    n_faces = len(tetsimplify.extract_isosurface(volume, 0.0).faces)
    one, two = (seconds[f"{n}"] for n in THREADS)
    return [
        {
            "volume": f"{n}³",
            "faces": f"{n_faces:,}",
            "1 thread, s": f"{one:.2f}",
            "2, s": f"{two:.2f}",
            "1 / 2": f"{one / two:.2f}",
            "million faces / s, 2 threads": f"{n_faces / two / 1e6:.1f}",
        }
    ]


def measures(n_faces: int, repeats: int) -> list[Row]:
    """The topology of a gyroid, and its distance to what is left of it."""
    mesh = gyroid(n_faces)
    result = tetsimplify.simplify(*mesh, keep_ratio=KEPT)
    works: dict[str, Callable[[], Any]] = {}
    for n in THREADS:
        works[f"topology, {n}"] = lambda n=n: tetsimplify.topology(*mesh, threads=n)
        works[f"surface_distance, {n}"] = lambda n=n: tetsimplify.surface_distance(
            mesh, result[:2], threads=n
        )
    seconds = in_turn(works, repeats)
    rows = []
    for verb in ("topology", "surface_distance"):
        one, two = (seconds[f"{verb}, {n}"] for n in THREADS)
        row = {"": verb, "1 thread, s": f"{one:.3g}", "2, s": f"{two:.3g}"}
        rows.append(row | {"1 / 2": f"{one / two:.2f}"})
    return rows


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faces", type=int, default=2_000_000)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    title = f"gyroid of about {arguments.faces:,} faces, and the same cut to {KEPT:.0%}"
    print(as_markdown(title, measures(arguments.faces, arguments.repeats)))
    print(as_markdown("gyroid, extracted", extractions(arguments.samples, arguments.repeats)))


if __name__ == "__main__":
    main()
