"""Functions as volumes: they are sampled when planes are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import OptionError, VolumeError

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
