"""Threads that share many small passes over the same data."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from itertools import pairwise
from types import TracebackType
from typing import TypeVar

from tetsimplify.errors import OptionError

Item = TypeVar("Item")
Result = TypeVar("Result")

PARTS_A_THREAD = 2  # so that threads that are done early take what is left
LARGEST_PART = 32


class Workers:
    """Threads that share passes. They stay until this is gone, or the end of a ``with`` block.

    Parameters
    ----------
    threads : int or None
        How many; None for all cores that the process may use. With one, everything is done in
        the thread of the caller.

    Attributes
    ----------
    n_threads : int

    Raises
    ------
    OptionError
        When `threads` is no positive integer.
    """

    def __init__(self, threads: int | None) -> None:
        if threads is None:
            can_tell = hasattr(os, "sched_getaffinity")
            threads = len(os.sched_getaffinity(0)) if can_tell else os.cpu_count() or 1
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
            raise OptionError(f"threads must be a positive integer, got {threads!r}")
        self.n_threads = threads
        self._pool: ThreadPoolExecutor | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)

    def map(self, task: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """What comes of each item, in their order."""
        return list(self.each(task, items))

    def each(self, task: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Result]:
        """What comes of each item as soon as it and those before it are done.

        The thread of the caller does its share.
        """
        if self.n_threads == 1 or len(items) < 2:
            yield from map(task, items)
            return
        results: dict[int, Result] = {}
        numbers = iter(range(len(items)))

        def take_some() -> None:
            for i in numbers:
                results[i] = task(items[i])

        n_helpers = min(self.n_threads, len(items)) - 1
        helpers = [self._started().submit(take_some) for _ in range(n_helpers)]
        try:
            for k in range(len(items)):
                while k not in results and (i := next(numbers, -1)) >= 0:
                    results[i] = task(items[i])
                if k not in results:
                    for helper in helpers:
                        if not helper.cancel():  # which is busy elsewhere
                            helper.result()
                yield results[k]
        finally:
            for _ in numbers:  # nothing is left to be taken
                pass
            wait([helper for helper in helpers if not helper.cancel()])

    def submit(self, task: Callable[[], Result]) -> Future[Result]:
        """Begin with a task, after those that were submitted before; with one thread, do it."""
        if self.n_threads == 1:
            done: Future[Result] = Future()
            done.set_result(task())
            return done
        return self._started().submit(task)

    def _started(self) -> ThreadPoolExecutor:
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.n_threads)
        return self._pool

    def parts(self, begin: int, end: int, least: int = 1) -> list[tuple[int, int]]:
        """Cut a range into parts of about the same length, of at least so many items."""
        n_items = end - begin
        n_parts = PARTS_A_THREAD * self.n_threads if self.n_threads > 1 else 1
        n_parts = min(max(n_parts, -(-n_items // LARGEST_PART)), max(1, n_items // least))
        bounds = [begin + n_items * k // n_parts for k in range(n_parts + 1)]
        return list(pairwise(bounds))
