"""Levels to cut a volume at."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError, VolumeError

N_BINS = 256
BYTES_AT_ONCE = 2**24


def as_levels(level: Any, volume: Any) -> list[float]:
    """One level or several, as numbers.

    Raises
    ------
    OptionError
        When one is neither a finite number nor "otsu".
    """
    several = level if isinstance(level, list | tuple) else [level]
    return [
        otsu_level(volume) if isinstance(one, str) and one == "otsu" else _as_level(one)
        for one in several
    ]


def _as_level(level: Any) -> float:
    if np.shape(level) or np.asarray(level).dtype.kind not in "biuf" or not np.isfinite(level):
        raise OptionError(f"level must be a finite number, 'otsu' or a list, got {level!r}")
    return float(level)


def otsu_level(volume: Any) -> float:
    """The level that parts the samples into two classes of least variance.

    Parameters
    ----------
    volume : array_like, shape (n0, n1, n2)
        Anything with slices along its first axis; read a few planes at a time.

    Returns
    -------
    float
        Half-way between two integers for types of up to 16 bits; otherwise the border of two of
        256 bins between the least and the greatest sample.

    Raises
    ------
    VolumeError
        When all samples are equal, or not all are finite.

    References
    ----------
    N. Otsu. A threshold selection method from gray-level histograms. IEEE Transactions on
    Systems, Man, and Cybernetics 9(1), 1979, 62-66, doi:10.1109/TSMC.1979.4310076.
    """
    extremes = [(float(block.min()), float(block.max())) for block in _blocks(volume)]
    low, high = min(pair[0] for pair in extremes), max(pair[1] for pair in extremes)
    if not np.isfinite((low, high)).all():
        raise VolumeError("volume must be finite, so that its samples can be parted")
    if low == high:
        raise VolumeError(f"there is nothing to part, all samples are {low:g}")
    dtype = np.dtype(volume.dtype)
    if dtype.kind in "biu" and dtype.itemsize <= 2:
        borders = np.arange(low - 0.5, high + 1)
    else:
        borders = np.linspace(low, high, N_BINS + 1)
    counts = np.zeros(len(borders) - 1, np.int64)
    for block in _blocks(volume):
        counts += np.histogram(block.astype(np.float64), borders)[0]
    return _best_border(counts, borders)


def _blocks(volume: Any) -> Any:
    n_planes, n1, n2 = volume.shape
    at_once = max(1, BYTES_AT_ONCE // (8 * n1 * n2))
    for begin in range(0, n_planes, at_once):
        yield np.asarray(volume[begin : begin + at_once])


def _best_border(counts: NDArray[np.int64], borders: NDArray[np.float64]) -> float:
    """The inner border with the greatest variance between what is below and what is above."""
    middles = 0.5 * borders[:-1] + 0.5 * borders[1:]
    below = np.cumsum(counts)[:-1]
    above = counts.sum() - below
    moments = np.cumsum(counts * middles)
    total = moments[-1]
    gap = moments[:-1] / np.maximum(below, 1) - (total - moments[:-1]) / np.maximum(above, 1)
    return float(borders[1:-1][np.argmax(below.astype(float) * above * gap**2)])
