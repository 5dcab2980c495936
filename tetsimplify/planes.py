"""Volumes read a few planes at a time, each plane once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import VolumeError
from tetsimplify.workers import Workers

SPARE_PLANES = 4  # room for those around the second block, of which the first has less


def as_sliceable(volume: Any) -> Any:
    """Anything with ``shape``, ``dtype`` and slices as it is, other things as arrays."""
    names = "shape", "dtype", "__getitem__"
    return volume if all(hasattr(volume, name) for name in names) else np.asarray(volume)


class Planes:
    """The planes of a volume that are at work, as float64 or float32.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2)
        Anything with ``shape``, ``dtype`` and slices along the first axis: it is asked for
        ``volume[begin:end]`` and nothing else, in order and without overlap. Samples of an array
        in memory that are of the right type are used where they are.
    name : str
        What the volume is called in messages.
    is_compact : bool
        Hold float32 where no sample needs rounding for that, which goes by the type of the volume:
        half the memory, and half of what is fetched from it.
    """

    def __init__(self, volume: Any, name: str = "volume", is_compact: bool = False) -> None:
        self.name = name
        self.shape: tuple[int, int, int] = tuple(volume.shape)
        self._volume = volume
        fits = is_compact and np.can_cast(np.dtype(volume.dtype), np.float32)
        self.dtype = np.dtype(np.float32 if fits else np.float64)
        self.is_in_place = (
            isinstance(volume, np.ndarray)
            and volume.dtype == self.dtype
            and volume.dtype.isnative
            and volume.flags.c_contiguous
            and volume.flags.aligned
        )
        chunks = getattr(volume, "chunks", None) or (1,)
        self.planes_of_chunk = chunks[0] if isinstance(chunks[0], int) else 1
        """How many planes are stored together, as arrays of HDF5 and Zarr tell."""
        self._buffer = np.empty((0, *self.shape[1:]), self.dtype)
        self._begin = self._end = 0

    def take(self, begin: int, end: int, workers: Workers) -> NDArray[Any]:
        """Planes from `begin` to `end`, neither before those of the last time.

        What was returned the last time is overwritten.
        """
        if self.is_in_place:
            return self._volume[begin:end]
        kept = self._buffer[begin - self._begin : self._end - self._begin]
        if len(self._buffer) < end - begin:
            larger = np.empty((end - begin + SPARE_PLANES, *self.shape[1:]), self.dtype)
            larger[: len(kept)] = kept
            self._buffer = larger
        else:
            self._buffer[: len(kept)] = kept
        fresh = self._buffer[len(kept) : end - begin]
        if len(fresh):
            self._read(max(self._end, begin), fresh, workers)
        self._begin, self._end = begin, end
        return self._buffer[: end - begin]

    def _read(self, begin: int, target: NDArray[Any], workers: Workers) -> None:
        source = np.asarray(self._volume[begin : begin + len(target)])
        if source.shape != target.shape:
            raise VolumeError(
                f"{self.name}[{begin}:{begin + len(target)}] must have shape {target.shape}, got "
                f"{source.shape}"
            )

        def cast(part: tuple[int, int]) -> None:
            begin, end = part
            with np.errstate(over="ignore"):  # of types wider than float64
                target[begin:end] = source[begin:end]

        workers.map(cast, workers.parts(0, len(target)))

    def refuse(self, planes: NDArray[Any], begin: int) -> None:
        """Raise for the first sample that is not finite.

        Raises
        ------
        VolumeError
            With its value and its index.
        """
        index = np.argwhere(~np.isfinite(planes))[0]
        value = planes[tuple(index)]
        index[0] += begin
        raise VolumeError(f"{self.name} must be finite, got {value} at index {index.tolist()}")
