"""From a volume to a simplified mesh: at once, and by way of the whole surface; time and memory.

python docs/benchmarks/streaming.py --samples 512 --volume mask.npz --level 0.5 --length 1.5
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import Row, as_markdown, machine
from extraction import gyroid_volume

import tetsimplify

MIB = 2**20
WAYS = ("extract_and_simplify", "extract_isosurface, simplify")


def memory(name: str) -> float:
    """A line of the status of this process, in MiB: VmRSS or VmHWM, its high-water mark."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(name))


def simplified(way: str, volume: Any, level: float, length: float, threads: int) -> Any:
    """A result with vertices, faces and a report."""
    if way == WAYS[0]:
        return tetsimplify.extract_and_simplify(
            volume, level, max_edge_length=length, threads=threads
        )
    mesh = tetsimplify.extract_isosurface(volume, level, threads=threads)
    return tetsimplify.simplify(*mesh, max_edge_length=length, threads=threads)


def opened(path: str) -> Any:
    """The volume in a file of NumPy, in memory, or in a Zarr store, not read yet."""
    if path.endswith(".zarr"):
        import zarr

        return zarr.open_array(path, mode="r")
    return np.load(path)


def one_run(path: str, level: float, length: float, way: str, threads: int) -> None:
    """Measure in this process, which does nothing else, and print what was found as JSON."""
    volume = opened(path)
    like = (gyroid_volume(24) > 0.0).astype(volume.dtype)
    simplified(way, like, 0.5, 1.5, threads)  # compiles for the type of the volume
    before = memory("VmRSS")
    Path("/proc/self/clear_refs").write_text("5")  # the high-water mark starts anew
    begin = time.perf_counter()
    result = simplified(way, volume, level, length, threads)
    found = {"seconds": time.perf_counter() - begin, "peak": memory("VmHWM") - before}
    report = result.report
    found |= {
        "result": (result.vertices.nbytes + result.faces.nbytes) / MIB,
        "faces": len(result.faces),
        "given": report.topology_before.n_faces,
        "euler": report.topology_after.euler_characteristic,
        "same": report.topology_after.same_topology(report.topology_before),
        "left": len(report.remaining_edges),
    }
    print(json.dumps(found))


def table(paths: dict[str, str], n_bytes: int, level: float, length: float) -> list[Row]:
    """Every way with one and two threads, each in a process of its own."""
    rows = []
    for stored, path in paths.items():
        for way in WAYS if stored == "array" else WAYS[:1]:
            for threads in (1, 2):
                call = [sys.executable, __file__, "--one", path, way, str(threads)]
                call += ["--level", str(level), "--length", str(length)]
                run = subprocess.run(call, capture_output=True, text=True, check=True)
                found = json.loads(run.stdout.splitlines()[-1])
                most = 3 * n_bytes / MIB + found["result"]
                rows.append(
                    {
                        "": f"{way}, {stored}",
                        "threads": f"{threads}",
                        "s": f"{found['seconds']:.1f}",
                        "peak, MiB": f"{found['peak']:.0f}",
                        "3 volumes + result, MiB": f"{most:.0f}",
                        "faces before": f"{found['given']:,}",
                        "faces": f"{found['faces']:,}",
                        "χ": f"{found['euler']:,}".replace("-", "\N{MINUS SIGN}"),
                        "same topology": "yes" if found["same"] else "no",
                        "edges < ε left": f"{found['left']:,}",
                    }
                )
    return rows


def measure(name: str, volume: Any, level: float, length: float) -> None:
    """Store a volume in each way, and print its table."""
    with tempfile.TemporaryDirectory() as folder:
        paths = {"array": f"{folder}/volume.npy"}
        np.save(paths["array"], volume)
        try:
            import zarr
        except ImportError:
            print("zarr is left out: it is not installed")
        else:
            paths["zarr"] = f"{folder}/volume.zarr"
            chunks = tuple(min(64, n) for n in volume.shape)
            store = zarr.create_array(
                paths["zarr"], shape=volume.shape, dtype=volume.dtype, chunks=chunks
            )
            store[:] = volume
        n_bytes, shape = volume.nbytes, " x ".join(map(str, volume.shape))
        title = f"{name}, {shape}, {volume.dtype}, ε = {length:g}, {n_bytes / MIB:.0f} MiB"
        del volume
        print(as_markdown(title, table(paths, n_bytes, level, length)), flush=True)


def main() -> None:
    """Measure, and print tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=512, help="a side, of the gyroid; 0: none")
    parser.add_argument("--volume", type=Path, help="an .npy or .npz file to measure, too")
    parser.add_argument("--key", default="data", help="which array of an .npz file")
    parser.add_argument("--level", type=float, default=0.5, help="for that volume")
    parser.add_argument("--length", type=float, default=1.5, help="ε, in samples")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one is not None:
        path, way, threads = arguments.one
        one_run(path, arguments.level, arguments.length, way, int(threads))
        return
    print(machine())
    if arguments.samples:
        measure("gyroid", gyroid_volume(arguments.samples), 0.0, arguments.length)
    if arguments.volume is not None:
        held = np.load(arguments.volume)
        volume = held[arguments.key] if arguments.volume.suffix == ".npz" else held
        measure(arguments.volume.stem, volume, arguments.level, arguments.length)


if __name__ == "__main__":
    main()
