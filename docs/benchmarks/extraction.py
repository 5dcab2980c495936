"""Extraction of isosurfaces beside scikit-image and PyMCubes, in turn, on the same volumes.

python docs/benchmarks/extraction.py --samples 256 --repeats 5 --volume mask.npz --level 0.5
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from common import Row, as_markdown, machine

import tetsimplify

THREADS = (1, 2)
PEERS = {"scikit-image": "skimage.measure", "PyMCubes": "mcubes"}
LATTICES = ("kuhn", "five", "bcc")


def gyroid_volume(n: int) -> Any:
    """Samples of two periods a side, float32."""
    angle = 4.0 * np.pi * np.arange(n) / n
    x, y, z = np.meshgrid(angle + 0.1, angle + 0.2, angle + 0.3, indexing="ij", sparse=True)
    return (np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)).astype("f4")


def works_on(volume: Any, level: float) -> dict[str, Callable[[], Any]]:
    """What is to be timed, by its name; each returns vertices and faces."""
    works: dict[str, Callable[[], Any]] = {}
    for lattice in LATTICES:
        for n in THREADS if lattice == "kuhn" else THREADS[-1:]:
            works[f"tetsimplify, {lattice}, {n} thread{'s' * (n > 1)}"] = lambda n=n, of=lattice: (
                tetsimplify.extract_isosurface(volume, level, lattice=of, threads=n)
            )
    for name, module in PEERS.items():
        try:
            peer = importlib.import_module(module)
        except ImportError:
            print(f"{name} is left out: it is not installed")
            continue
        works[f"{name}, marching cubes"] = (
            (lambda peer=peer: peer.marching_cubes(volume, level)[:2])
            if name == "scikit-image"
            else (lambda peer=peer: peer.marching_cubes(volume, level))
        )
    return works


def table(volume: Any, level: float, repeats: int) -> list[Row]:
    """Medians of so many runs of each, in turn; the first round is not counted."""
    works = works_on(volume, level)
    seconds: dict[str, list[float]] = {name: [] for name in works}
    n_faces: dict[str, int] = {}
    for i in range(repeats + 1):
        for name, work in works.items():
            begin = time.perf_counter()
            mesh = work()
            if i:
                seconds[name].append(time.perf_counter() - begin)
            n_faces[name] = len(mesh[1])
            del mesh
    rows = []
    one = statistics.median(seconds["tetsimplify, kuhn, 1 thread"])
    for name, some in seconds.items():
        median = statistics.median(some)
        is_ours = name.startswith("tetsimplify, kuhn")
        rows.append(
            {
                "": name,
                "triangles": f"{n_faces[name]:,}",
                "s": f"{median:.3f} ({min(some):.3f} to {max(some):.3f})",
                "million voxels / s": f"{volume.size / median / 1e6:.0f}",
                "million triangles / s": f"{n_faces[name] / median / 1e6:.1f}",
                "speed-up": f"{one / median:.2f}" if is_ours else "",
            }
        )
    return rows


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=256, help="a side, of the gyroid")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--volume", type=Path, help="an .npy or .npz file to measure, too")
    parser.add_argument("--key", default="data", help="which array of an .npz file")
    parser.add_argument("--level", type=float, default=0.5, help="for that volume")
    arguments = parser.parse_args()
    print(machine())
    volume = gyroid_volume(arguments.samples)
    title = f"gyroid, {arguments.samples}³, float32"
    print(as_markdown(title, table(volume, 0.0, arguments.repeats)))
    if arguments.volume is not None:
        held = np.load(arguments.volume)
        volume = held[arguments.key] if arguments.volume.suffix == ".npz" else held
        title = f"{arguments.volume.stem}, {' x '.join(map(str, volume.shape))}, {volume.dtype}"
        print(as_markdown(title, table(volume, arguments.level, arguments.repeats)))


if __name__ == "__main__":
    main()
