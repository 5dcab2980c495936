"""One run in a process of its own, so that whatever happens there is a row of a table."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import tetsimplify
from tetsimplify.comparison.models import on_grid, samples_of
from tetsimplify.comparison.tasks import Settings
from tetsimplify.decimators import Goal, Method
from tetsimplify.edges import edge_lengths
from tetsimplify.mesh import Mesh

PATIENCE = 5.0  # seconds: what takes longer runs once, and is not warmed up by itself
WARM_UP_GRID = 20
WARM_UP_RATIO = 0.2
WARM_UP_MEDIAN_EDGES = 1.2
LAST_WORDS = 200  # characters of the standard error output that are told

START = """
import sys
sys.path.insert(0, sys.argv[1])
import tetsimplify
del sys.path[0]
from tetsimplify.comparison.worker import main
main(sys.argv[2])
"""
"""So that it is this tetsimplify that runs, wherever it was imported from."""

LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")
ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in LIBRARIES}


@dataclass(frozen=True, eq=False)
class Outcome:
    """How a run ended, and the mesh where there is one."""

    status: str
    message: str | None = None
    seconds: dict[str, list[float]] = field(default_factory=dict)
    """Of each run, by clock."""
    peak_memory_bytes: int | None = None
    mesh: Mesh | None = None


def run_apart(method: Method, mesh: Mesh, goal: Goal, settings: Settings) -> Outcome:
    """Run a method in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="tetsimplify-") as name:
        folder = Path(name)
        job = _write_job(folder, method, mesh, goal, settings)
        command = [sys.executable, "-P", "-c", START, _root(), str(folder / "job.json")]
        with open(folder / "errors.txt", "wb") as errors:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                env={**os.environ, **ONE_THREAD},
            )
            try:
                process.wait(settings.time_limit)
            except subprocess.TimeoutExpired:
                return Outcome("timeout", f"stopped after {settings.time_limit:g} s")
            finally:
                process.kill()
                process.wait()
        return _outcome(process.returncode, job, folder / "errors.txt")


def _root() -> str:
    """The folder that the package lies in."""
    return str(Path(tetsimplify.__file__).resolve().parents[1])


def _write_job(
    folder: Path, method: Method, mesh: Mesh, goal: Goal, settings: Settings
) -> dict[str, Any]:
    """The files that a worker reads."""
    small = on_grid("gyroid", WARM_UP_GRID)
    if goal.volume is not None:
        np.savez(folder / "warm-up-volume.npz", data=samples_of("gyroid", WARM_UP_GRID))
        path = str(folder / "warm-up-volume.npz")
        warm_up = Goal(volume={**goal.volume, "path": path, "level": 0.0})
    elif goal.max_edge_length is None:
        warm_up = Goal(target_faces=round(WARM_UP_RATIO * len(small.faces)), options=goal.options)
    else:
        length = WARM_UP_MEDIAN_EDGES * float(np.median(edge_lengths(small)))
        warm_up = Goal(max_edge_length=length, options=goal.options)
    np.savez(folder / "mesh.npz", **mesh._asdict())
    np.savez(folder / "warm-up.npz", **small._asdict())
    job = {
        "method": method.name,
        "module": method.module,
        "mesh": str(folder / "mesh.npz"),
        "goal": asdict(goal),
        "warm_up_mesh": str(folder / "warm-up.npz"),
        "warm_up_goal": asdict(warm_up),
        "repeats": settings.repeats,
        "patience": PATIENCE,
        "result": str(folder / "result.npz"),
        "answer": str(folder / "answer.json"),
    }
    (folder / "job.json").write_text(json.dumps(job))
    return job


def _outcome(code: int, job: dict[str, Any], errors: Path) -> Outcome:
    """What a process that has ended left."""
    answer = Path(job["answer"])
    if not answer.exists():
        return Outcome("crashed", _last_words(code, errors))
    told = json.loads(answer.read_text())
    if told["status"] != "ok":
        return Outcome(told["status"], told["message"])
    with np.load(job["result"]) as arrays:
        mesh = Mesh(arrays["vertices"], arrays["faces"])
    return Outcome("ok", None, told["seconds"], told["peak_memory_bytes"], mesh)


def _last_words(code: int, errors: Path) -> str:
    """How a process ended, and the last line that it wrote."""
    lines = errors.read_text(errors="replace").strip().splitlines()
    ended = f"exit code {code}"
    if code < 0:
        known = {int(each): each.name for each in signal.Signals}
        ended = known.get(-code, f"signal {-code}")
    return f"{ended}: {lines[-1][-LAST_WORDS:]}" if lines else ended
