"""Where tasks of several threads work, each with scratch space of its own."""

from __future__ import annotations

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.start import start_scratch

if TYPE_CHECKING:
    from tetsimplify.kernels.state import Scratch, Surface

Task = Callable[["Surface", "Scratch"], int]
"""Contracts edges; returns how many."""


class Done(NamedTuple):
    """What a task has done."""

    n_contracted: int
    tally: NDArray[np.int64]
    merges: NDArray[np.float64]
    deferred: NDArray[np.int32]


class _Desk(NamedTuple):
    """What a task works with, and the next one after it."""

    scratch: Scratch
    merges: NDArray[np.float64]


class Desks:
    """Scratch space and logs for tasks, which pass them on.

    Parameters
    ----------
    n_vertices : int
        Real and virtual ones.
    keep_log : bool
        Whether merges are to be told.
    """

    def __init__(self, n_vertices: int, *, keep_log: bool) -> None:
        self._n_vertices = n_vertices
        self._keep_log = keep_log
        self._free: SimpleQueue[_Desk] = SimpleQueue()

    def do(self, task: Task, surface: Surface, n_faces: int) -> Done:
        """Do a task at a desk that has room for so many faces."""
        state, desk = kernels.state, self._take(n_faces)
        tally, deferred = desk.scratch.tally, desk.scratch.lists[state.DEFERRED]
        tally[: state.N_DONE] = tally[state.N_DEFERRED] = 0
        n_contracted = task(surface._replace(merges=desk.merges), desk.scratch)
        done = Done(
            n_contracted,
            tally[: state.N_DONE].copy(),
            desk.merges[:n_contracted].copy(),
            deferred[: tally[state.N_DEFERRED]].copy(),
        )
        self._free.put(desk)
        return done

    def _take(self, n_faces: int) -> _Desk:
        """A desk that is free, or a new one."""
        try:
            desk = self._free.get_nowait()
            if len(desk.scratch.face_mark) >= n_faces:
                return desk
        except Empty:
            pass
        scratch = start_scratch(n_faces, self._n_vertices, 0)
        return _Desk(scratch, np.empty((n_faces if self._keep_log else 0, 2)))


def add_up(done: Done, surface: Surface, scratch: Scratch) -> None:
    """Add what a task has done to the log of a surface and to the counters of a run."""
    state, tally = kernels.state, scratch.tally
    n_before = int(tally[state.N_SIMPLE] + tally[state.N_NESTED])
    surface.merges[n_before : n_before + len(done.merges)] = done.merges
    tally[: state.N_DONE] += done.tally
    room = scratch.lists[state.DEFERRED, tally[state.N_DEFERRED] :]
    deferred = done.deferred[: len(room)]  # a later sweep finds the others again
    room[: len(deferred)] = deferred
    tally[state.N_DEFERRED] += len(deferred)
