"""Memory that is kept for later, aligned, hardly touched, or handed back.

Memory that is new to a process has to be cleared by the system first, page by page, and on a
virtual machine to be had from its host before that. A run would wait for this again and again: it
needs a few large arrays for a short time. So what they took is kept for the next ones. The system
is told that nothing is in it any more, and takes it when it runs short. Until then a run takes a
tenth to a quarter more, so nothing is kept where little memory is the aim: see `nothing_kept`.
"""

from __future__ import annotations

import ctypes
import math
import mmap
import sys
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np
from numpy.typing import DTypeLike, NDArray

LINE = 64  # bytes of a line of a cache
LARGE = 2**20  # bytes: smaller arrays are left to NumPy
MOST_KEPT = 2**30  # bytes
STEPS = 4  # sizes that are kept apart, from one power of two to the next
FITS = 2  # times the size that is asked for: larger blocks are left for larger arrays
CAN_KEEP = hasattr(mmap, "MADV_FREE")

_kept: dict[int, deque[mmap.mmap]] = {}  # by size; what is done with it at once needs no lock
_frugal: list[int] = []  # an entry for each block that is under way where nothing is kept


def empty(shape: int | tuple[int, ...], dtype: DTypeLike = np.float64) -> NDArray:
    """An array that is not filled, as of NumPy. Its memory is kept when nothing refers to it."""
    shape = shape if isinstance(shape, tuple) else (shape,)
    size = math.prod(shape) * np.dtype(dtype).itemsize
    if size < LARGE or not CAN_KEEP or _frugal:
        return np.empty(shape, dtype)
    block = _take(size)
    array: NDArray = np.ndarray(shape, dtype, block)
    weakref.finalize(array, _keep, block).atexit = False
    return array


def full(shape: int | tuple[int, ...], value: float, dtype: DTypeLike) -> NDArray:
    """The same, filled."""
    array = empty(shape, dtype)
    array.fill(value)
    return array


@contextmanager
def nothing_kept() -> Iterator[None]:
    """Keep no memory of large arrays in a ``with`` block, whichever thread has them."""
    _kept.clear()
    _frugal.append(0)
    try:
        yield
    finally:
        _frugal.pop()


def _take(size: int) -> mmap.mmap:
    """A block of memory that is kept, the smallest one that is large enough, or a new one."""
    step = 2 ** (size.bit_length() - 1) // STEPS
    needed = -(-size // step) * step
    for kept in sorted(_kept):
        if needed <= kept <= FITS * size:
            with suppress(IndexError):  # there is none, or another thread was faster
                return _kept[kept].pop()
    return _mapped(needed, "MADV_HUGEPAGE")


def _mapped(size: int, advice: str) -> mmap.mmap:
    """New memory of this process alone, all zero, in pages as advised."""
    if not hasattr(mmap, "MAP_PRIVATE"):
        return mmap.mmap(-1, size)
    block = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    with suppress(AttributeError, OSError):  # of a system that knows no such advice
        block.madvise(getattr(mmap, advice))
    return block


def _keep(block: mmap.mmap) -> None:
    """Keep a block that nothing refers to, for later."""
    if _frugal:
        return
    if sum(size * len(blocks) for size, blocks in list(_kept.items())) + len(block) <= MOST_KEPT:
        with suppress(OSError):  # where the system cannot take it back, it is not kept
            block.madvise(mmap.MADV_FREE)
            _kept.setdefault(len(block), deque()).append(block)


def cache_lines(n: int) -> NDArray[np.float64]:
    """So many lines of a cache, not filled, shape (n, 8)."""
    width = LINE // 8
    memory = empty((n + 1) * width)
    first = -(memory.ctypes.data // 8) % width
    return memory[first : first + n * width].reshape(n, width)


def sparse_zeros(*shape: int) -> NDArray[np.int32]:
    """Zeros (int32) that take memory only where they are touched, and that in small pages.

    NumPy asks for large pages for large arrays. Of those in which only a few places are touched,
    far apart, these would take all the memory, and the time to clear it.
    """
    size = 4 * math.prod(shape)
    if size < LARGE:
        return np.zeros(shape, np.int32)
    return np.frombuffer(_mapped(size, "MADV_NOHUGEPAGE"), np.int32).reshape(shape)


def hand_back_memory() -> None:
    """Let the system have the memory that is kept for the next call, here and by its allocator.

    tetsimplify keeps up to 1 GiB of what it worked with, so that the next call need not wait for
    new memory. On Linux and macOS the system takes that anyway when it runs short; elsewhere none
    is kept. The allocator of Linux (glibc) keeps most of what threads have let go of.

    Examples
    --------
    >>> import tetsimplify
    >>> tetsimplify.hand_back_memory()
    """
    _kept.clear()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
