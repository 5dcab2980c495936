"""Threads that share work."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from tetsimplify.options import Progress
from tetsimplify.workers import Workers

Result = TypeVar("Result")

LEAST_PART, LARGEST_PART = 2**15, 2**17  # items
N_PARTS = 8  # or more: so that threads end at about the same time


def part_size(n_items: int) -> int:
    """So many items in a part, where what is done with them does not depend on the parts."""
    return min(max(LEAST_PART, -(-n_items // N_PARTS)), LARGEST_PART)


class Crew:
    """Threads that share work, part by part, and tell how far they have come.

    The parts are the same for any number of threads, and so are the results.

    Parameters
    ----------
    threads : int or None
        How many; None for all that the process may use.
    progress : callable, optional
        Called as ``progress(name, done)`` with `done` from 0 to 1. Raise from it to cancel.
    name : str
        What the work is called there.
    n_tasks : int
        How many tasks there will be.

    Attributes
    ----------
    n_threads : int

    Raises
    ------
    OptionError
        When `threads` is no positive integer.
    """

    def __init__(
        self,
        threads: int | None,
        progress: Progress | None = None,
        name: str = "",
        n_tasks: int = 1,
    ) -> None:
        self._workers = Workers(threads)
        self.n_threads = self._workers.n_threads
        self._progress = progress
        self._name = name
        self._n_tasks = n_tasks
        self._n_done = 0

    def share(self, task: Callable[[slice], Result], n_items: int, at_once: int) -> list[Result]:
        """Do a task for so many items at once; return what comes of each part, in their order.

        The thread that asks for it does its share, so that no processor waits for a new thread.
        """
        parts = [slice(k, min(k + at_once, n_items)) for k in range(0, n_items, at_once)]
        results: list[Result] = []
        for result in self._workers.each(task, parts):
            results.append(result)
            self._tell(self._n_done + len(results) / len(parts))
        self._n_done += 1
        return results

    def _tell(self, n_done: float) -> None:
        if self._progress is not None:
            self._progress(self._name, n_done / self._n_tasks)
