"""Calls side by side: in threads, under Dask, in processes; and one cache for all."""

import importlib
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import meshes
import tetsimplify
from tetsimplify.kernels.jit import CacheFile

SCRIPT = Path(__file__).with_name("working_apart.py")
PATIENCE = 900  # seconds until a run counts as hanging; it takes a few, or more on a busy machine
TOPOLOGY = importlib.import_module("tetsimplify.topology")  # the name is that of its verb

COLD = """
import sys, numpy as np, tetsimplify
from tetsimplify import kernels
faces = np.load(sys.argv[1])
print(tetsimplify.topology(np.zeros((faces.max() + 1, 3)), faces).defects())
stats = kernels.surface.survey_inside.stats, kernels.defects.inspect.stats
print(sum(sum(found.cache_hits.values()) for found in stats))
"""


@pytest.mark.parametrize("way", ["threads", "dask", "fork", "spawn"])
def test_work_side_by_side_makes_no_difference(way):
    """The surface is large enough for threads everywhere; nothing hangs, all bytes are the same."""
    if way == "dask":
        pytest.importorskip("dask")
    elif way != "threads" and way not in multiprocessing.get_all_start_methods():
        pytest.skip(f"processes do not begin by {way} here")
    run = subprocess.run(
        [sys.executable, SCRIPT, way], capture_output=True, text=True, timeout=PATIENCE
    )
    assert run.returncode == 0, run.stderr
    digests = run.stdout.split()
    assert len(digests) == 6
    assert len(set(digests)) == 1


def test_processes_that_compile_at_once_share_one_cache(tmp_path):
    """Several fill an empty cache at the same time; one that comes later finds all in it."""
    vertices, faces = meshes.bow_tie()
    np.save(tmp_path / "faces.npy", faces)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", COLD, str(tmp_path / "faces.npy")]
    defects = tetsimplify.topology(vertices, faces).defects()

    def start():
        return subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    for n_at_once in (3, 1):
        for run in [start() for _ in range(n_at_once)]:
            out, err = run.communicate(timeout=PATIENCE)
            assert run.returncode == 0 and not err, err
            told, n_hits = out.splitlines()
            assert told == defects
    assert int(n_hits) == 2


def test_one_thread_starts_no_others(monkeypatch):
    """Nor does what is called on the way, such as the proof of a distance."""

    def refuse(*_, **__):
        raise AssertionError("a thread was started")

    mesh = meshes.icosphere(3)
    monkeypatch.setattr("tetsimplify.workers.ThreadPoolExecutor", refuse)
    monkeypatch.setattr("tetsimplify.distance.AT_ONCE", 50)
    tetsimplify.surface_distance(mesh, mesh, threads=1)
    tetsimplify.simplify(*mesh, max_error=0.1, threads=1)
    monkeypatch.setattr(TOPOLOGY, "LEAST_FACES", 50)
    tetsimplify.topology(*mesh, threads=1)
    for call in (
        lambda: tetsimplify.surface_distance(mesh, mesh, threads=2),
        lambda: tetsimplify.topology(*mesh, threads=2),
    ):
        with pytest.raises(AssertionError, match="a thread was started"):
            call()


def test_code_for_other_types_never_takes_the_place_of_what_is_asked_for(tmp_path):
    """Two processes save at the same time, each before it sees what the other has saved."""
    one, other, later = (CacheFile(str(tmp_path), "kernel", "stamp") for _ in range(3))
    save_data = one._save_data

    def meanwhile(name, data):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(other, "_load_index", dict)
            other.save("other types", "other code")
        save_data(name, data)

    one._save_data = meanwhile
    one.save("types", "code")
    assert later.load("other types") == "other code"
    assert later.load("types") in (None, "code")  # None: compiled anew
    later.save("types", "code")
    assert (later.load("types"), later.load("other types")) == ("code", "other code")
