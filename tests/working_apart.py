"""The same work in several threads or processes at once; a script that tests start.

``python working_apart.py WAY`` prints a digest of the results of each, one a line.
"""

import hashlib
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np

import tetsimplify

N_WORKERS = 3
SIDE = 40  # of the volume: its surface has enough faces for every function to take threads


def volume() -> np.ndarray:
    """A gyroid; written out here, since a spawned process has to find all that it needs."""
    x, y, z = np.ogrid[:SIDE, :SIDE, :SIDE]
    x, y, z = (4.0 * np.pi / SIDE * axis + phase for axis, phase in ((x, 0.1), (y, 0.2), (z, 0.3)))
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def work(threads: int | None = 2) -> str:
    """Surface, topology, both ways to simplify, distance; a digest of all their bytes."""
    digest = hashlib.sha256()

    def keep(*arrays: np.ndarray) -> None:
        for array in arrays:
            digest.update(f"{array.dtype} {array.shape}".encode() + array.tobytes())

    mesh = tetsimplify.extract_isosurface(volume(), 0.0, threads=threads)
    assert len(mesh.faces) > 2**16
    keep(*mesh)
    report = tetsimplify.topology(*mesh, threads=threads)
    keep(report.components, np.array([report.n_edges, report.n_boundary_loops]))
    short = tetsimplify.simplify(*mesh, max_edge_length=0.8, threads=threads)
    few = tetsimplify.simplify(*mesh, keep_ratio=0.2, threads=threads)
    for result in (short, few):
        keep(*result[:4], result.report.remaining_edges)
    distance = tetsimplify.surface_distance(mesh, few[:2], threads=threads)
    keep(distance.a_to_b.vertex_distances, distance.b_to_a.vertex_distances)
    keep(np.array([distance.lower, distance.upper, distance.mean, distance.rms]))
    return digest.hexdigest()


def in_threads() -> list[str]:
    """In Python threads, each with threads of its own."""
    with ThreadPoolExecutor(N_WORKERS) as pool:
        return list(pool.map(work, [2] * N_WORKERS))


def in_dask() -> list[str]:
    """In the threads of a Dask scheduler."""
    import dask

    tasks = [dask.delayed(work, pure=False)() for _ in range(N_WORKERS)]
    return list(dask.compute(*tasks, scheduler="threads", num_workers=N_WORKERS))


def in_processes(way: str) -> list[str]:
    """In processes that begin when this one has already had threads."""
    context = multiprocessing.get_context(way)
    with ProcessPoolExecutor(N_WORKERS, mp_context=context) as pool:
        return list(pool.map(work, [2] * N_WORKERS))


def main(way: str) -> None:
    """Do the work here first, then in a way, then here once more."""
    ways = {"threads": in_threads, "dask": in_dask}
    print(work(threads=1))
    print(work())
    for line in ways[way]() if way in ways else in_processes(way):
        print(line)
    print(work(threads=None))


if __name__ == "__main__":
    main(sys.argv[1])
