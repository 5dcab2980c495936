"""Functions and finer grids as volumes: they are sampled when planes are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError, VolumeError
from tetsimplify.planes import Planes

Function = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], Any]


class SampledFunction:
    """The values of a function on a grid, by slices along the first axis.

    Parameters
    ----------
    function : callable
        Called with three arrays of coordinates that broadcast to a few planes of the grid.
    shape : three ints
        Points of the grid.
    spacing, origin : ndarray, shape (3,)
        Of the grid.
    """

    dtype = np.dtype(np.float64)

    def __init__(
        self,
        function: Function,
        shape: tuple[int, int, int],
        spacing: NDArray[np.float64],
        origin: NDArray[np.float64],
    ) -> None:
        self.shape = shape
        self._function, self.spacing, self.origin = function, spacing, origin

    def __getitem__(self, planes: slice) -> NDArray[np.float64]:
        indices = [np.arange(n) for n in self.shape]
        indices[0] = indices[0][planes]
        axes = zip(indices, self.origin, self.spacing, strict=True)
        x, y, z = np.ix_(*(origin + spacing * index for index, origin, spacing in axes))
        wanted = (len(indices[0]), *self.shape[1:])
        values = np.asarray(self._function(x, y, z))
        try:
            return np.broadcast_to(values, wanted)
        except ValueError:
            raise VolumeError(
                f"the function must return an array that broadcasts to the shape of its "
                f"arguments, {wanted}, got {values.shape}"
            ) from None

    def centres(self) -> SampledFunction:
        """The same function in the middle of the cubes."""
        n0, n1, n2 = (n - 1 for n in self.shape)
        origin = self.origin + 0.5 * self.spacing
        return SampledFunction(self._function, (n0, n1, n2), self.spacing, origin)


class Refined:
    """A volume with so many cubes along each edge of a cube, by trilinear interpolation.

    Each plane of the volume is read once where planes are asked for in their order.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2)
        Anything with ``shape``, ``dtype`` and slices along its first axis.
    factor : int
        How many.
    name : str
        What the volume is called in messages.
    """

    dtype = np.dtype(np.float64)

    def __init__(self, volume: Any, factor: int, name: str = "volume") -> None:
        self._volume, self._factor, self._name = volume, factor, name
        self.shape = tuple((n - 1) * factor + 1 for n in volume.shape)
        self._kept = 0, np.empty((0, *volume.shape[1:]))

    def __getitem__(self, planes: slice) -> NDArray[np.float64]:
        begin, end, _ = planes.indices(self.shape[0])
        if end <= begin:
            return np.empty((0, *self.shape[1:]))
        first, last = begin // self._factor, -(-(end - 1) // self._factor)
        block = self._take(first, last + 1)
        index = np.arange(begin, end)
        low = np.minimum(index // self._factor, self._volume.shape[0] - 1) - first
        high = np.minimum(low + 1, len(block) - 1)
        part = (index % self._factor / self._factor)[:, None, None]
        for axis in (1, 2):
            block = _denser(block, axis, self._factor)
        return _between(block[low], block[high], part)

    def _take(self, first: int, end: int) -> NDArray[np.float64]:
        """Planes of the volume, of which the last of the time before are not read again."""
        begin, kept = self._kept
        kept = kept[first - begin :] if begin <= first <= begin + len(kept) else kept[:0]
        kept = kept[: end - first]
        fresh = first + len(kept)
        block = np.empty((end - first, *self._volume.shape[1:]))
        block[: len(kept)] = kept
        if fresh < end:
            with np.errstate(over="ignore"):  # of types wider than float64
                block[len(kept) :] = np.asarray(self._volume[fresh:end])
            if not np.isfinite(block[len(kept) :]).all():
                Planes(self._volume, self._name).refuse(block[len(kept) :], fresh)
        n = min(2, len(block))
        self._kept = end - n, block[len(block) - n :].copy()
        return block


def _denser(values: NDArray[np.float64], axis: int, factor: int) -> NDArray[np.float64]:
    """Interpolate along an axis, so that there are so many steps for one."""
    n = values.shape[axis]
    shape = list(values.shape)
    shape[axis] = (n - 1) * factor + 1
    finer = np.empty(shape)
    low, high = (np.take(values, range(k, n - 1 + k), axis) for k in (0, 1))
    for step in range(factor):
        at: list[slice] = [slice(None)] * values.ndim
        at[axis] = slice(step, shape[axis] - 1, factor)
        finer[tuple(at)] = _between(low, high, step / factor)
    at[axis] = slice(shape[axis] - 1, None)
    finer[tuple(at)] = np.take(values, [n - 1], axis)
    return finer


def _between(low: NDArray[np.float64], high: NDArray[np.float64], part: Any) -> Any:
    """Interpolate linearly; never beyond either end, whatever the rounding."""
    values = (1.0 - part) * low + part * high
    return np.clip(values, np.minimum(low, high), np.maximum(low, high))


def as_factor(refine: Any) -> int:
    """How many cubes there are to be along the edge of one.

    Raises
    ------
    OptionError
        When it is no positive integer.
    """
    if not _is_integer(refine) or refine < 1:
        raise OptionError(f"refine must be a positive integer, got {refine!r}")
    return int(refine)


def sampled(function: Function, bounds: Any, shape: Any) -> SampledFunction:
    """A function on a grid between bounds.

    Raises
    ------
    OptionError
        When bounds are not three pairs of numbers that increase, or the shape is not one or
        three integers of at least 2.
    """
    if bounds is None or shape is None:
        raise OptionError("a function needs bounds and shape, to be sampled")
    try:
        pairs = np.asarray(bounds, np.float64)
    except (TypeError, ValueError):
        pairs = np.empty(0)
    if pairs.shape != (3, 2) or not np.isfinite(pairs).all() or not (np.diff(pairs) > 0).all():
        raise OptionError(
            f"bounds must be three pairs of numbers, each the lower one first, got {bounds!r}"
        )
    counts = list(shape) if isinstance(shape, Sequence | np.ndarray) else [shape] * 3
    if len(counts) != 3 or not all(_is_integer(n) and n >= 2 for n in counts):
        raise OptionError(f"shape must be one or three integers of at least 2, got {shape!r}")
    n0, n1, n2 = (int(n) for n in counts)
    spacing = np.diff(pairs)[:, 0] / (np.array([n0, n1, n2]) - 1)
    return SampledFunction(function, (n0, n1, n2), spacing, pairs[:, 0])


def _is_integer(number: Any) -> bool:
    return isinstance(number, int | np.integer) and not isinstance(number, bool)
