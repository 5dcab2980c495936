"""A voxel volume that knows where in the world it lies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify.arrays import as_triple
from tetsimplify.errors import FileError
from tetsimplify.io.lazy import SLAB_BYTES, LazyArray


class Volume(NamedTuple):
    """Samples on a grid, and the affine transform from grid to world.

    Attributes
    ----------
    data : ndarray or LazyArray, shape (n0, n1, n2), dtype and memory order of the file
        Samples: an array, a memory map of the file, or what reads the file when it is sliced.
    affine : ndarray, shape (4, 4), float64
        ``world = affine @ (index0, index1, index2, 1)``.
    unit : str or None
        Of lengths in the world, such as ``"mm"`` or ``"µm"``, where the file tells it.
    """

    data: NDArray[Any] | LazyArray
    affine: NDArray[np.float64]
    unit: str | None = None

    @property
    def spacing(self) -> tuple[float, float, float] | None:
        """Distance between samples along the axes, where these are those of the world.

        None where the affine transform also rotates, shears, swaps or mirrors axes.
        """
        diagonal = self.affine[:3, :3].diagonal()
        if (diagonal <= 0).any() or (self.affine[:3, :3] != np.diag(diagonal)).any():
            return None
        return _as_tuple(diagonal)

    @property
    def origin(self) -> tuple[float, float, float] | None:
        """Position of sample (0, 0, 0), None where :attr:`spacing` is."""
        return None if self.spacing is None else _as_tuple(self.affine[:3, 3])

    def with_spacing(self, spacing: Sequence[float]) -> Volume:
        """The same samples at other distances along the three axes; directions stay."""
        lengths = np.linalg.norm(self.affine[:3, :3], axis=0)
        affine = self.affine.copy()
        affine[:3, :3] *= as_triple("spacing", spacing, positive=True) / lengths
        return Volume(self.data, affine, self.unit)

    def slowest_first(self) -> Volume:
        """The same samples with their axes in the order of the file, the slowest first.

        Slices along the first axis are then read in one piece. Nothing is copied.
        """
        order = self.slowest_order()
        if order == [0, 1, 2]:
            return self
        return Volume(self.data.transpose(order), self.affine[:, [*order, 3]], self.unit)

    def slowest_order(self) -> list[int]:
        """The axes of :attr:`data` in the order of the file, the slowest first."""
        if isinstance(self.data, LazyArray):
            order = np.argsort(self.data.order)
        else:
            order = np.argsort([-abs(stride) for stride in self.data.strides], kind="stable")
        return [int(axis) for axis in order]

    def value_range(self) -> tuple[Any, Any]:
        """The least and the greatest value, NaN aside, read slab by slab."""
        data = self.slowest_first().data
        plane_bytes = data.dtype.itemsize * data.shape[1] * data.shape[2]
        at_once = max(1, SLAB_BYTES // max(1, plane_bytes))
        ends = []
        for begin in range(0, data.shape[0], at_once):
            slab = np.asarray(data[begin : begin + at_once])
            ends.append((np.fmin.reduce(slab, axis=None), np.fmax.reduce(slab, axis=None)))
        lows, highs = zip(*ends, strict=True)
        return np.fmin.reduce(lows), np.fmax.reduce(highs)


def _as_tuple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    a, b, c = values.tolist()
    return a, b, c


def affine_of(
    spacing: ArrayLike = 1.0, origin: ArrayLike = 0.0, directions: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Build an affine transform.

    Parameters
    ----------
    spacing : array_like, shape (3,)
        Distance between samples along each axis.
    origin : array_like, shape (3,)
        Position of sample (0, 0, 0).
    directions : array_like, shape (3, 3), optional
        The direction of each axis in the world as a column; the axes of the world if not
        given.

    Returns
    -------
    ndarray, shape (4, 4), float64
    """
    affine = np.eye(4)
    columns = np.eye(3) if directions is None else np.asarray(directions, np.float64)
    affine[:3, :3] = columns * np.asarray(spacing, np.float64)
    affine[:3, 3] = origin
    return affine


def checked_volume(
    data: NDArray[Any] | LazyArray, affine: NDArray[np.float64], unit: str | None = None
) -> Volume:
    """Refuse what is no volume of real numbers.

    Raises
    ------
    FileError
        When the array has not three axes or holds no real numbers, or when the transform is
        singular.
    """
    if data.ndim != 3:
        raise FileError(f"its array has shape {data.shape}, but a volume has three axes")
    if data.dtype.kind not in "biuf":
        raise FileError(f"its array holds {data.dtype}, but a volume holds real numbers")
    if not np.isfinite(affine).all() or np.linalg.det(affine[:3, :3]) == 0:
        raise FileError(f"its transform to the world cannot be inverted: {affine.tolist()}")
    return Volume(data, affine, unit)
