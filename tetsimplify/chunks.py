"""Volumes that are stored in chunks, read chunk by chunk."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_BYTES = 2**26  # of the chunks that lie beside each other; larger ones are read in parts


class WholeChunks:
    """A volume whose slices are cut out of whole chunks, each of which is read once.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2)
        With slices along its first axis.
    planes_of_chunk : int
        How many planes are stored together.
    """

    def __init__(self, volume: Any, planes_of_chunk: int) -> None:
        self.shape: tuple[int, int, int] = tuple(volume.shape)
        self.dtype = np.dtype(volume.dtype)
        self._volume, self._planes_of_chunk = volume, planes_of_chunk
        self._held: NDArray[Any] = np.empty((0, *self.shape[1:]), self.dtype)
        self._begin = 0

    def __getitem__(self, planes: slice) -> NDArray[Any]:
        begin, end = planes.start, planes.stop
        parts = []
        while begin < end:
            if not self._begin <= begin < self._begin + len(self._held):
                self._begin = begin - begin % self._planes_of_chunk
                last = min(self._begin + self._planes_of_chunk, self.shape[0])
                self._held = np.asarray(self._volume[self._begin : last])
            part = self._held[begin - self._begin : end - self._begin]
            parts.append(part)
            begin += len(part)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


def by_chunks(volume: Any) -> Any:
    """A volume that is read by whole chunks where it tells them and they are not too large."""
    chunks = getattr(volume, "chunks", None) or (1,)
    n_planes = chunks[0] if isinstance(chunks[0], int) else 1
    _, n1, n2 = volume.shape
    if n_planes == 1 or n_planes * n1 * n2 * np.dtype(volume.dtype).itemsize > MOST_BYTES:
        return volume
    return WholeChunks(volume, n_planes)
