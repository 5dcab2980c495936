"""Measure tetsimplify beside other simplifiers, and how the time grows with the surface.

    python docs/benchmarks/peers.py 10k 100k 1M 10M --repeats 5 --json peers.json --page --plot

A case is a number of faces, of a gyroid by marching tetrahedra, or a mesh file. Every tool has a
process of its own, which stays warm, and these run in turn, one at a time, again and again: so all
meet the same state of the machine, and none has to live with what another one left behind.
tetsimplify is there by length, by quadric error, and by that without the fit of the vertices in the
end, with one thread and with two.

By length goes first: its edge length leaves `--keep` per cent of the faces, and all others are
asked for the number that this gave. Each tool gets its input in the types that it takes; converting
does not count. Surfaces are saved once, and the processes map the files into memory.

Before each run free memory is written to once. On a virtual machine a program would else have to
wait for what the one before it gave back, and most of all the first one that takes much.

A tool whose run took longer than `--patience` seconds is not run again, nor on larger surfaces.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import statistics
import tempfile
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from common import (
    TOOLS,
    Row,
    Times,
    add_options,
    as_markdown,
    gyroid,
    installed,
    machine,
    seconds_of,
    spread,
    tell,
    time_columns,
    timed,
    wanted_tools,
    write_between,
)
from rich.console import Console
from simplify import cold_starts, length_that_keeps

import tetsimplify
from tetsimplify import Mesh
from tetsimplify.io import read_mesh

PAGE = Path(__file__).parents[1] / "benchmarks.md"
PICTURE = PAGE.parent / "images" / "growth.png"
THREADS = (1, 2)
OURS = tuple(
    (f"tetsimplify by {way}, {n} thread{'s' if n > 1 else ''}", way, n)
    for way in ("length", "error", "error without the last fit")
    for n in THREADS
)
FIRST = OURS[0][0]  # says how many faces are left
PEERS = tuple(tool for tool in TOOLS if "DecimatePro" not in tool.name)
WARM_UP = 100_000  # faces, more than it takes to divide a surface for threads
TO_TUNE = 50_000  # faces of the gyroid that the edge length is found on
HANGS = 20  # times the patience: a process is given up
BYTES_A_FACE = 400  # what a tool takes, about
UNITS = {"k": 10**3, "M": 10**6}


# --- in the processes ------------------------------------------------------------------------


def load(folder: str) -> Mesh:
    """The arrays of a case, in memory of this process."""
    paths = (f"{folder}/{name}.npy" for name in Mesh._fields)
    return Mesh(*(np.array(np.load(path, mmap_mode="r")) for path in paths))


def our_run(way: str, threads: int, folder: str, goal: dict[str, Any]) -> tuple[Times, int]:
    """Simplify by tetsimplify; times and number of faces."""
    mesh = load(folder)
    key = "max_edge_length" if way == "length" else "target_faces"
    told = {key: goal[key], "threads": threads, "fit": "auto" if way == "error" else False}
    times, result = timed(lambda: tetsimplify.simplify(*mesh, **told))
    return times, len(result.faces)


def their_run(name: str, folder: str, goal: dict[str, Any]) -> tuple[Times, int]:
    """Simplify by another program."""
    tool = next(tool for tool in TOOLS if tool.name == name)
    prepared = tool.prepare(load(folder))
    times, raw = timed(lambda: tool.run(prepared, goal["target_faces"]))
    return times, len(tool.finish(raw)[1])


def serve(pipe: Connection, run: Callable[..., tuple[Times, int]]) -> None:
    """Run what is asked for, until nothing is."""
    while (asked := pipe.recv()) is not None:
        try:
            pipe.send(run(*asked))
        except Exception as error:  # told, and the others go on
            pipe.send(f"{type(error).__name__}: {error}")


class Worker:
    """A process for one tool.

    Parameters
    ----------
    name : str
    run : callable
        ``run(folder, goal)``, which the process can import.
    """

    def __init__(self, name: str, run: Callable[..., tuple[Times, int]]) -> None:
        self.name = name
        self.is_out = ""
        """Why it is not run any more."""
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, run), daemon=True)
        self._process.start()
        theirs.close()

    def run(self, folder: Path, goal: dict[str, Any], patience: float) -> tuple[Times, int] | None:
        """Times and number of faces, None when it failed or took too long."""
        self._pipe.send((str(folder), goal))
        try:
            answer = self._pipe.recv() if self._pipe.poll(HANGS * patience) else "gave no answer"
        except EOFError:
            answer = "died"
        if isinstance(answer, str):
            self.is_out = answer
            self._process.kill()
            return None
        if answer[0]["wall"] > patience:
            self.is_out = f"took {answer[0]['wall']:.0f} s"
        return answer

    def end(self) -> None:
        """End the process."""
        if self._process.is_alive():
            self._pipe.send(None)
            self._process.join(10)
            self._process.kill()


# --- the cases -------------------------------------------------------------------------------


def number_of_faces(case: str) -> int | None:
    """Of a gyroid, such as ``100k``; None of a file."""
    unit = UNITS.get(case[-1], 1)
    digits = case.rstrip("kM")
    return int(float(digits) * unit) if digits.replace(".", "", 1).isdigit() else None


def save(mesh: Mesh, folder: Path) -> Path:
    """Save the arrays of a mesh in a new folder, for `load`."""
    folder.mkdir()
    for name, array in zip(Mesh._fields, mesh, strict=True):
        np.save(folder / f"{name}.npy", array)
    return folder


class Cases:
    """Makes surfaces and saves them.

    Parameters
    ----------
    folder : Path
    keep : float
        Part of the faces that is to be left.
    """

    def __init__(self, folder: Path, keep: float) -> None:
        self._folder = folder
        self._keep = keep
        self._length_on_gyroids: float | None = None

    def make(self, case: str) -> tuple[Path, int, float]:
        """The folder of a case, its number of faces, and the edge length."""
        n_faces = number_of_faces(case)
        mesh = read_mesh(Path(case)) if n_faces is None else gyroid(n_faces)
        folder = save(mesh, self._folder / Path(case).name)
        if n_faces is None:
            length = length_that_keeps(mesh, self._keep)
        else:
            if self._length_on_gyroids is None:  # in samples, so it is the same for all sizes
                self._length_on_gyroids = length_that_keeps(gyroid(TO_TUNE), self._keep)
            length = self._length_on_gyroids
        return folder, len(mesh.faces), length


def touch_free_memory(n_bytes: int) -> None:
    """Write to so much memory that is free, and let it go."""
    np.empty(n_bytes, np.uint8).fill(1)


def measure(
    folder: Path, length: float, workers: list[Worker], arguments: argparse.Namespace
) -> dict[str, Any]:
    """All tools in turn, again and again; by length first, which says how many faces are left."""
    console = Console(stderr=True)
    goal: dict[str, Any] = {"max_edge_length": length}
    tools: dict[str, Any] = {}
    n_faces = len(np.load(folder / "faces.npy", mmap_mode="r"))
    for repeat in range(arguments.repeats):
        for worker in workers:
            if worker.is_out:
                continue
            touch_free_memory(BYTES_A_FACE * n_faces)
            answer = worker.run(folder, goal, arguments.patience)
            if answer is None:
                console.print(f"{folder.name}: {worker.name}: {worker.is_out}")
                continue
            times, n_left = answer
            goal.setdefault("target_faces", n_left)
            entry = tools.setdefault(worker.name, {"times": [], "n_faces": n_left})
            entry["times"].append(times)
            console.print(f"{folder.name}, {repeat + 1}: {worker.name}, {times['wall']:.3g} s")
    return {"max_edge_length": length, "tools": tools}


# --- telling ---------------------------------------------------------------------------------


def case_rows(case: dict[str, Any], clock: str) -> list[Row]:
    """The table of one case; ratios are to tetsimplify by length with one thread."""
    reference = seconds_of(case["tools"][FIRST]["times"], clock)
    return [
        time_columns(name, seconds_of(tool["times"], clock), reference, tool["n_faces"])
        for name, tool in case["tools"].items()
    ]


def microseconds(case: dict[str, Any], name: str, clock: str) -> float | None:
    """Median time for a face of the input."""
    if name not in case["tools"]:
        return None
    return (
        1e6 * statistics.median(seconds_of(case["tools"][name]["times"], clock)) / case["n_faces"]
    )


def growth(figures: dict[str, Any]) -> dict[str, dict[int, float]]:
    """For each tool, microseconds a face by the number of faces of a gyroid."""
    gyroids = [case for case in figures["cases"].values() if case["is_gyroid"]]
    gyroids.sort(key=lambda case: case["n_faces"])
    names = dict.fromkeys(name for case in gyroids for name in case["tools"])
    return {
        name: {
            case["n_faces"]: found
            for case in gyroids
            if (found := microseconds(case, name, figures["clock"])) is not None
        }
        for name in names
    }


def growth_rows(figures: dict[str, Any]) -> list[Row]:
    """Microseconds a face by size."""
    grown = growth(figures)
    sizes = sorted({size for found in grown.values() for size in found})
    return [
        {"µs a face": name}
        | {f"{size:,}": f"{found[size]:.3g}" if size in found else "" for size in sizes}
        for name, found in grown.items()
    ]


def cold_rows(figures: dict[str, Any]) -> list[Row]:
    """Fresh processes, by length and by quadric error."""
    return [
        {
            "in a fresh process": f"{name}, by {way}" if "call" in name else name,
            "seconds, median (min to max)": spread(seconds),
        }
        for way, found in figures["cold"].items()
        for name, seconds in found.items()
        if way == "length" or "call" in name
    ]


def tables_of(figures: dict[str, Any]) -> list[tuple[str, list[Row]]]:
    """All tables, with their titles."""
    tables = [
        (f"{name}: {case['n_faces']:,} faces", case_rows(case, figures["clock"]))
        for name, case in figures["cases"].items()
    ]
    if rows := growth_rows(figures):
        tables.append(("Time for a face", rows))
    if figures["cold"]:
        tables.append(("Fresh processes", cold_rows(figures)))
    return tables


def plot(figures: dict[str, Any], path: Path) -> None:
    """Draw the time for a face over the number of faces."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8.0, 4.5), layout="constrained")
    for name, points in growth(figures).items():
        is_ours = name.startswith("tetsimplify")
        axes.plot(*zip(*points.items(), strict=True), "o-" if is_ours else "s--", label=name, ms=4)
    axes.set(xscale="log", yscale="log", xlabel="faces", ylabel="µs a face")
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize=8, bbox_to_anchor=(1.02, 1.0), loc="upper left")
    figure.savefig(path, dpi=120)


def on_the_page(figures: dict[str, Any]) -> str:
    """The tables as they stand in the page, and what they were measured on."""
    found = figures["machine"]
    packages = (f"{name} {number}" for name, number in found["versions"].items() if number)
    told = [as_markdown(title, rows) for title, rows in tables_of(figures)]
    told.append(
        f"{found['cpu']}, {found['cores']} cores, {found['system']}, Python {found['python']}; "
        f"load {found['load'] or 0.0:.1f} when this began; {figures['repeats']} rounds, "
        f"{figures['clock']} clock; {', '.join(packages)}."
    )
    if figures["out"]:
        out = ", ".join(f"{name} ({why})" for name, why in figures["out"].items())
        told.append(f"Not run again: {out}.")
    return "\n\n".join(text.strip() for text in told)


def parse() -> argparse.Namespace:
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    sizes = ["10k", "100k", "1M", "10M"]
    parser.add_argument("cases", nargs="*", default=sizes, metavar="CASE")
    parser.add_argument("--keep", type=float, default=15.0, help="per cent of the faces to keep")
    parser.add_argument("--patience", type=float, default=60.0, help="seconds; see above")
    parser.add_argument("--no-cold", action="store_true", help="leave the fresh processes out")
    parser.add_argument("--tables", action="store_true", help="tables of --json, no new figures")
    parser.add_argument("--page", action="store_true", help="put the tables into the page")
    parser.add_argument("--plot", action="store_true", help="draw the picture of the page")
    add_options(parser)
    return parser.parse_args()


def new_figures(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure all there is."""
    tools, absent = installed(wanted_tools(arguments, PEERS))
    figures: dict[str, Any] = {
        "machine": machine(),
        "clock": arguments.clock,
        "repeats": arguments.repeats,
        "absent": absent,
        "cases": {},
        "cold": {},
    }
    if not arguments.no_cold:
        figures["cold"] = {
            "length": cold_starts(arguments.repeats, max_edge_length=0.8),
            "error": cold_starts(arguments.repeats, keep_ratio=0.15),
        }
    workers = [Worker(name, partial(our_run, way, n)) for name, way, n in OURS]
    workers += [Worker(tool.name, partial(their_run, tool.name)) for tool in tools]
    try:
        with tempfile.TemporaryDirectory() as place:
            cases = Cases(Path(place), arguments.keep / 100)
            warm_up = save(gyroid(WARM_UP), Path(place) / "warm-up")
            for worker in workers:
                goal = {"max_edge_length": 0.8, "target_faces": WARM_UP // 5}
                worker.run(warm_up, goal, arguments.patience)
            for case in arguments.cases:
                folder, n_faces, length = cases.make(case)
                is_gyroid = number_of_faces(case) is not None
                figures["cases"][f"gyroid {case}" if is_gyroid else Path(case).stem] = {
                    "n_faces": n_faces,
                    "is_gyroid": is_gyroid,
                    **measure(folder, length, workers, arguments),
                }
                if arguments.json:
                    arguments.json.write_text(json.dumps(figures, indent=1) + "\n")
    finally:
        for worker in workers:
            worker.end()
    figures["out"] = {worker.name: worker.is_out for worker in workers if worker.is_out}
    return figures


def main() -> None:
    """Measure and tell."""
    arguments = parse()
    if arguments.tables:
        figures = json.loads(arguments.json.read_text())
    else:
        figures = new_figures(arguments)
        if arguments.json:
            arguments.json.write_text(json.dumps(figures, indent=1) + "\n")
    tell(tables_of(figures), figures, arguments.markdown)
    if arguments.plot:
        plot(figures, PICTURE)
    if arguments.page:
        write_between(PAGE, "peers", on_the_page(figures))


if __name__ == "__main__":
    main()
