"""Decimators that do what no decimator should, to be run in processes of their own."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tetsimplify.decimators import METHODS as KNOWN
from tetsimplify.decimators import Method

WARM_UP_FACES = 12_000  # the mesh for warming up has more
PAUSE = 0.3
CALLS = "MISBEHAVING_CALLS"  # names the file that calls are written to
BLOCK = 64 * 2**20  # bytes


def is_warm_up(mesh):
    """Whether this is not yet the mesh that counts."""
    return len(mesh.faces) > WARM_UP_FACES


def crash(mesh, goal):
    """End as a fault in compiled code does."""
    print("the last words", flush=True)
    os.abort()


def leave(mesh, goal):
    """End without a word."""
    os._exit(7)


def hang(mesh, goal):
    """Never come back."""
    time.sleep(3600)


def raise_an_error(mesh, goal):
    """Fail as Python does."""
    raise ValueError("no\nsuch   mesh")


def do_nothing(mesh, goal):
    """Leave all faces."""
    return mesh


def remove_all(mesh, goal):
    """Leave no face."""
    return mesh.vertices, mesh.faces[:0]


def lose_positions(mesh, goal):
    """Leave a position that is no number."""
    vertices = mesh.vertices.copy()
    vertices[mesh.faces[0, 0]] = np.nan
    return vertices, mesh.faces


def name_what_is_not_there(mesh, goal):
    """Leave an index too many."""
    return mesh.vertices, np.where(mesh.faces == 0, len(mesh.vertices), mesh.faces)


def be_chatty(mesh, goal):
    """Write to the streams that belong to the caller."""
    os.write(1, b"x" * 100_000)
    os.write(2, b"x" * 100_000)
    return mesh.vertices, mesh.faces[: goal.target_faces]


def take_memory(mesh, goal):
    """Need much for a moment."""
    np.full(BLOCK if not is_warm_up(mesh) else 1, 1, np.uint8)
    return mesh.vertices, mesh.faces[: goal.target_faces]


def prepare_slowly(mesh, goal):
    """Take long, and much memory, before the clock runs."""
    np.full(BLOCK, 1, np.uint8)
    time.sleep(PAUSE)
    return mesh


def finish_slowly(result):
    """Take long after the clock has stopped."""
    time.sleep(PAUSE)
    return result


def count(mesh, goal):
    """Write a line for each call."""
    path = os.environ.get(CALLS)
    if path:
        with Path(path).open("a") as file:
            file.write("warm-up\n" if is_warm_up(mesh) else "run\n")
    return mesh.vertices, mesh.faces[: goal.target_faces]


def method(name, run, **more):
    return Method(name, name, ("numpy",), "none", run, module="misbehaving", **more)


METHODS = {
    each.name: each
    for each in (
        method("crash", crash),
        method("leave", leave),
        method("hang", hang),
        method("raise", raise_an_error),
        method("nothing", do_nothing),
        method("all", remove_all),
        method("nan", lose_positions),
        method("index", name_what_is_not_there),
        method("chatty", be_chatty),
        method("memory", take_memory),
        method("slow", be_chatty, prepare=prepare_slowly, finish=finish_slowly),
        method("count", count),
        replace(KNOWN["pyfqmr"], name="absent", packages=("no-such-package",)),
    )
}
