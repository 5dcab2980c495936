"""The process that one method runs in: load, warm up, run again and again, write what came.

It is told what to do by a JSON file, and answers with another one and with the arrays of the
result. Where it ends without an answer, it has crashed.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.decimators import Goal, Method
from tetsimplify.memory import hand_back_memory
from tetsimplify.mesh import Mesh
from tetsimplify.standard import as_result

STATUS = Path("/proc/self/status")


def main(job_path: str) -> None:
    """Do a job, and answer."""
    job = json.loads(Path(job_path).read_text())
    _keep_to_one_core()
    try:
        answer = _do(job)
    except Exception as error:
        message = " ".join(f"{type(error).__name__}: {error}".split())
        answer = {"status": "error", "message": message}
    Path(job["answer"]).write_text(json.dumps(answer))


def _do(job: dict[str, Any]) -> dict[str, Any]:
    method = import_module(job["module"]).METHODS[job["method"]]
    warm_up = Goal(**job["warm_up_goal"])
    method.run(method.prepare(_read(job["warm_up_mesh"]), warm_up), warm_up)
    mesh, goal = _read(job["mesh"]), Goal(**job["goal"])
    first, peak, raw = _measured(method, mesh, goal)
    np.savez(job["result"], **as_result(*method.finish(raw))._asdict())
    del raw
    times = [first]
    if first["wall"] < job["patience"]:
        times = [_measured(method, mesh, goal)[0] for _ in range(job["repeats"])]
    return {
        "status": "ok",
        "peak_memory_bytes": peak,
        "seconds": {clock: [each[clock] for each in times] for clock in first},
    }


def _measured(method: Method, mesh: Mesh, goal: Goal) -> tuple[dict[str, float], int | None, Any]:
    """Prepare and run once: the time by each clock, the memory at the peak, the result."""
    prepared = method.prepare(mesh, goal)
    base = _start_watching_memory()
    before, processor_before = time.perf_counter(), time.process_time()
    raw = method.run(prepared, goal)
    times = {
        "wall": time.perf_counter() - before,
        "cpu": time.process_time() - processor_before,
    }
    return times, None if base is None else max(0, _memory("VmHWM:") - base), raw


def _read(path: str) -> Mesh:
    with np.load(path) as arrays:
        return Mesh(arrays["vertices"], arrays["faces"])


def _start_watching_memory() -> int | None:
    """Forget the peak so far; the memory in use now, None where the system does not tell."""
    gc.collect()
    if not STATUS.exists():
        return None
    hand_back_memory()  # what is free in the heap would hide as much of what is taken next
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return None
    return _memory("VmRSS:")


def _memory(key: str) -> int:
    """One of the sizes that Linux tells of a process, in bytes."""
    lines = STATUS.read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(key))


def _keep_to_one_core() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


if __name__ == "__main__":
    main(sys.argv[1])
