"""Threads that share work."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from threading import Thread
from typing import TypeVar

from tetsimplify.errors import OptionError
from tetsimplify.options import Progress

Result = TypeVar("Result")
Other = TypeVar("Other")


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
        if threads is None:
            can_tell = hasattr(os, "sched_getaffinity")
            threads = len(os.sched_getaffinity(0)) if can_tell else os.cpu_count() or 1
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
            raise OptionError(f"threads must be a positive integer, got {threads!r}")
        self.n_threads = threads
        self._progress = progress
        self._name = name
        self._n_tasks = n_tasks
        self._n_done = 0

    def share(self, task: Callable[[slice], Result], n_items: int, at_once: int) -> list[Result]:
        """Do a task for so many items at once; return what comes of each part, in their order.

        The thread that asks for it does its share, so that no processor waits for a new thread.
        """
        parts = [slice(k, min(k + at_once, n_items)) for k in range(0, n_items, at_once)]
        results: dict[int, Result] = {}
        failures: list[BaseException] = []
        next_part = count()

        def work(tell: Callable[[float], None] | None = None) -> None:
            try:
                while not failures and (i := next(next_part)) < len(parts):
                    results[i] = task(parts[i])
                    if tell is not None and len(results) < len(parts):
                        tell(self._n_done + len(results) / len(parts))
            except BaseException as failure:  # what was raised by `progress` above all
                failures.append(failure)

        helpers = [Thread(target=work) for _ in range(min(self.n_threads, len(parts)) - 1)]
        for helper in helpers:
            helper.start()
        work(self._tell)
        for helper in helpers:
            helper.join()
        if failures:
            raise failures[0]
        if parts:
            self._tell(self._n_done + 1)
        self._n_done += 1
        return [results[i] for i in range(len(parts))]

    def do_both(
        self, one: Callable[[], Result], other: Callable[[], Other]
    ) -> tuple[Result, Other]:
        """Do two different things, at the same time where there are threads for it."""
        if self.n_threads < 2:
            return one(), other()
        with ThreadPoolExecutor(1) as pool:
            waiting = pool.submit(other)
            done = one()
            return done, waiting.result()

    def _tell(self, n_done: float) -> None:
        if self._progress is not None:
            self._progress(self._name, n_done / self._n_tasks)
