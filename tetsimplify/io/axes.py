"""Which axis of an array is which, and how to take one volume of many.

Axes are known by letters: ``x``, ``y``, ``z``, ``c`` for channels and ``t`` for times.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from numpy.typing import NDArray

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io.lazy import LazyArray

DROPPED = "-"  # an axis of length 1 without a meaning
CHOICES = {"c": "channel", "t": "time"}

Value = TypeVar("Value")


class Choice(NamedTuple):
    """What the caller wants of a file that holds more than one volume."""

    key: str | None = None
    channel: int | None = None
    time: int | None = None
    axes: str | None = None


class Picked(NamedTuple):
    """One volume of an array: a letter for each of its axes, and what is taken along it."""

    axes: str
    keys: tuple[int | slice, ...]

    @property
    def order(self) -> tuple[int, ...]:
        """Where x, y and z are among the three axes that are left."""
        left = [letter for letter in self.axes if letter in "xyz"]
        return tuple(left.index(letter) for letter in "xyz")

    def xyz(self, values: Sequence[Value]) -> list[Value]:
        """Of values for each axis of the array those for x, y and z."""
        return [values[self.axes.index(letter)] for letter in "xyz"]

    def take(self, array: NDArray[Any]) -> NDArray[Any]:
        """A view of an array that is in memory or mapped to it, with axes x, y, z."""
        return array[self.keys].transpose(self.order)

    def take_lazily(self, array: Any, path: Path, chunks: Sequence[int] | None) -> LazyArray:
        """The same of an array in a file, which is read when it is sliced."""
        slowest = next(k for k, item in enumerate(self.keys) if isinstance(item, slice))
        shape = [n for n, item in zip(array.shape, self.keys, strict=True) if item == slice(None)]

        def read(begin: int, end: int) -> Any:
            return array[(*self.keys[:slowest], slice(begin, end), *self.keys[slowest + 1 :])]

        depth = 1 if chunks is None else chunks[slowest]
        return LazyArray(read, shape, array.dtype, path, depth).transpose(self.order)


def pick(shape: Sequence[int], axes: str | None, choice: Choice) -> Picked:
    """Find x, y and z among the axes of an array, and an index of each other axis.

    Parameters
    ----------
    shape : sequence of ints
        Shape of the array.
    axes : str or None
        A letter for each axis, where the file tells; ``-`` for one without a meaning. Without
        it an array of three axes has x, y, z in this order, and axes of length 1 at either end
        do not count.
    choice : Choice
        Its `axes` are taken before those of the file.

    Raises
    ------
    FileError
        When the array is no volume, or holds several and none was chosen.
    OptionError
        When there is no such channel or time, or when `choice.axes` do not fit.
    """
    if choice.axes is not None:
        axes = _as_axes(choice.axes, shape)
    elif axes is None:
        axes = _guess(shape)
    if any(axes.count(letter) != 1 for letter in "xyz"):
        raise FileError(
            f"its array has shape {tuple(shape)} and axes {axes!r}, but a volume has x, y and z"
        )
    for letter, name in CHOICES.items():
        n = shape[axes.index(letter)] if letter in axes else 1
        _check(name, getattr(choice, name), n)
    keys = tuple(_key_of(letter, n, choice) for letter, n in zip(axes, shape, strict=True))
    return Picked(axes, keys)


def _as_axes(text: str, shape: Sequence[int]) -> str:
    axes = text.lower()
    if not set("xyz") <= set(axes) <= set("xyzct") or len(set(axes)) != len(axes):
        raise OptionError(
            f"axes must be x, y, z and possibly c and t in the order of the file, such as "
            f"'zyx' or 'tzcyx', got {text!r}"
        )
    if len(axes) != len(shape):
        raise OptionError(f"axes {text!r} are {len(axes)}, but the array has shape {tuple(shape)}")
    return axes


def _guess(shape: Sequence[int]) -> str:
    begin, end = 0, len(shape)
    while end - begin > 3 and shape[end - 1] == 1:
        end -= 1
    while end - begin > 3 and shape[begin] == 1:
        begin += 1
    if end - begin != 3:
        advice = "; tell what they are, such as axes='tzyx'" if len(shape) > 3 else ""
        raise FileError(f"its array has shape {tuple(shape)}, but a volume has three axes{advice}")
    return DROPPED * begin + "xyz" + DROPPED * (len(shape) - end)


def _check(name: str, chosen: int | None, n: int) -> None:
    if chosen is None:
        if n > 1:
            raise FileError(f"it has {n} {name}s, choose one by {name}, from 0 to {n - 1}")
    elif not 0 <= chosen < n:
        there = f"from 0 to {n - 1}" if n > 1 else "0, as there is only one"
        raise OptionError(f"{name} must be {there}, got {chosen}")


def _key_of(letter: str, n: int, choice: Choice) -> int | slice:
    if letter in "xyz":
        return slice(None)
    if letter in CHOICES:
        return getattr(choice, CHOICES[letter]) or 0
    if n != 1:
        raise FileError(f"it has an axis of length {n} that is none of x, y, z, channel and time")
    return 0
