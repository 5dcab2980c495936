"""Memory that is to be aligned, hardly touched, or handed back."""

from __future__ import annotations

import ctypes
import math
import mmap
import sys

import numpy as np
from numpy.typing import NDArray

LINE = 64  # bytes of a line of a cache
LARGE = 2**20  # bytes: arrays for which it pays to ask for small pages


def cache_lines(n: int) -> NDArray[np.float64]:
    """So many lines of a cache, all zero, shape (n, 8)."""
    width = LINE // 8
    memory = np.zeros((n + 1) * width)
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
    return np.frombuffer(mmap.mmap(-1, size), np.int32).reshape(shape)


def hand_back_memory() -> None:
    """Let the system have what its allocator keeps of the memory of all the pieces.

    That of Linux (glibc) keeps most of what threads have let go of, in case they want it again.
    """
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
        if trim is not None:
            trim(0)
