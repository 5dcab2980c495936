"""Volumes that stay in their file until they are sliced."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.files import reading

SLAB_BYTES = 2**24  # read at once where the file keeps planes apart
MAX_SLAB_BYTES = 2**28  # more than this is not kept, however deep the chunks of a file are

ReadPlanes = Callable[[int, int], NDArray[Any]]


class LazyArray:
    """A volume that is read from its file, slab by slab, when it is sliced.

    It has what slicing an array of NumPy needs: ``shape``, ``dtype``, integers and slices as
    indices, and ``transpose``; ``numpy.asarray`` reads all of it. The slab read last is kept, so
    that planes taken in their order are read once. Threads may share it.

    Parameters
    ----------
    read : callable
        ``read(begin, end)`` gives planes of the file, shape (end - begin, n1, n2).
    shape : three ints
        Shape with the slowest axis of the file first.
    dtype : dtype
        Of the samples.
    path : Path
        The file, which errors name.
    chunk_depth : int
        How many planes the file keeps together, as chunks do.
    close : callable, optional
        Called when neither the volume nor a transposed view of it is in use any more.
    """

    def __init__(
        self,
        read: ReadPlanes,
        shape: Sequence[int],
        dtype: DTypeLike,
        path: Path,
        chunk_depth: int = 1,
        close: Callable[[], object] | None = None,
    ) -> None:
        self._slabs = _Slabs(read, shape, dtype, path, chunk_depth)
        self._order: tuple[int, ...] = (0, 1, 2)
        if close is not None:
            weakref.finalize(self._slabs, close)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples along the axes."""
        return tuple(self._slabs.shape[rank] for rank in self._order)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the samples."""
        return self._slabs.dtype

    @property
    def ndim(self) -> int:
        """Number of axes, which is three."""
        return 3

    @property
    def order(self) -> tuple[int, ...]:
        """For each axis its rank in the file, 0 for the slowest."""
        return self._order

    def transpose(self, order: Sequence[int]) -> LazyArray:
        """The same volume with its axes in another order; reads nothing."""
        view = object.__new__(LazyArray)
        view._slabs = self._slabs
        view._order = tuple(self._order[axis] for axis in order)
        return view

    @property
    def T(self) -> LazyArray:  # noqa: N802, the name that arrays have
        """The same volume with its axes reversed; reads nothing."""
        return self.transpose((2, 1, 0))

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        return f"LazyArray({str(self._slabs.path)!r}, shape={self.shape}, dtype={self.dtype})"

    def __getitem__(self, key: Any) -> NDArray[Any]:
        picked = [range(n)[item] for n, item in zip(self.shape, _three_keys(key), strict=True)]
        ranges = [item if isinstance(item, range) else range(item, item + 1) for item in picked]
        block = self._slabs.take(*(ranges[self._order.index(rank)] for rank in range(3)))
        kept = (slice(None) if isinstance(item, range) else 0 for item in picked)
        return block.transpose(self._order)[tuple(kept)]

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("samples that are in a file cannot be an array without a copy")
        return self[:].astype(self.dtype if dtype is None else dtype, copy=False)


def _three_keys(key: Any) -> tuple[Any, ...]:
    """Write an index out: ``[a:b]`` is ``[a:b, :, :]``, and so is ``[a:b, ...]``."""
    keys = key if isinstance(key, tuple) else (key,)
    if not any(item is Ellipsis for item in keys):
        keys = (*keys, Ellipsis)
    at = next(k for k, item in enumerate(keys) if item is Ellipsis)
    n_missing = 4 - len(keys)
    if n_missing < 0:
        raise IndexError(f"a volume has three axes, got {len(keys) - 1} indices")
    return (*keys[:at], *[slice(None)] * n_missing, *keys[at + 1 :])


class _Slabs:
    """Reads a file in slabs of a fixed depth, and keeps the last one."""

    def __init__(
        self,
        read: ReadPlanes,
        shape: Sequence[int],
        dtype: DTypeLike,
        path: Path,
        chunk_depth: int,
    ) -> None:
        self.shape, self.dtype, self.path = tuple(map(int, shape)), np.dtype(dtype), path
        self._read = read
        plane_bytes = max(1, self.dtype.itemsize * self.shape[1] * self.shape[2])
        self._depth = _slab_depth(plane_bytes, max(1, int(chunk_depth)))
        self._last: tuple[int, NDArray[Any]] | None = None
        self._lock = threading.Lock()

    def take(self, planes: range, rows: range, columns: range) -> NDArray[Any]:
        """Read some planes, and of these some rows and columns."""
        taken = np.empty((len(planes), len(rows), len(columns)), self.dtype)
        n_taken = 0
        for number, group in groupby(planes, key=lambda plane: plane // self._depth):
            some = np.array(list(group)) - number * self._depth
            whole = self._slab(number)[:, _slice(rows), _slice(columns)]
            taken[n_taken : n_taken + len(some)] = whole[some]
            n_taken += len(some)
        return taken

    def _slab(self, number: int) -> NDArray[Any]:
        with self._lock:
            if self._last is None or self._last[0] != number:
                self._last = None  # two are never there at once
                self._last = number, self._checked(number * self._depth)
            return self._last[1]

    def _checked(self, begin: int) -> NDArray[Any]:
        end = min(begin + self._depth, self.shape[0])
        with reading(self.path, folders=True):
            slab = np.asarray(self._read(begin, end))
            if slab.shape != (end - begin, *self.shape[1:]):
                raise FileError(f"planes {begin} to {end - 1} have shape {slab.shape}")
        return slab


def _slab_depth(plane_bytes: int, chunk_depth: int) -> int:
    """How many planes to read at once: whole chunks, unless these are too large to keep."""
    chunk_bytes = chunk_depth * plane_bytes
    if chunk_bytes > MAX_SLAB_BYTES:
        return max(1, MAX_SLAB_BYTES // plane_bytes)
    return chunk_depth * max(1, SLAB_BYTES // chunk_bytes)


def _slice(indices: range) -> slice:
    if not indices:  # whose ends may be anything
        return slice(0)
    return slice(indices.start, indices.stop if indices.stop >= 0 else None, indices.step)
