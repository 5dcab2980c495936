"""NPY and NPZ: arrays of NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import FileError
from tetsimplify.io.axes import Choice, Picked, pick
from tetsimplify.io.units import as_unit
from tetsimplify.io.volume import Volume, affine_of, checked_volume

ABOUT_DATA = ("spacing", "origin", "unit")


def read_npy(path: Path, choice: Choice) -> Volume:
    """Map an array into memory. Its axes are the axes of the world, at distances of 1."""
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    return checked_volume(pick(array.shape, None, choice).take(array), affine_of())


def read_npz(path: Path, choice: Choice) -> Volume:
    """Read an array, and ``spacing``, ``origin`` and ``unit`` where they are there.

    Without a key it is the array ``data``, or the only one there is.
    """
    with np.load(path, allow_pickle=False) as arrays:
        array = arrays[_name_of_data(arrays, choice.key)]
        picked = pick(array.shape, None, choice)
        spacing = _triple(arrays, "spacing", 1.0, picked)
        origin = _triple(arrays, "origin", 0.0, picked)
        unit = str(arrays["unit"]) if "unit" in arrays else None
    return checked_volume(picked.take(array), affine_of(spacing, origin), as_unit(unit))


def _name_of_data(arrays: Any, key: str | None) -> str:
    names = list(arrays.keys())
    if key is not None:
        if key in names:
            return key
        raise FileError(f"there is no array {key!r}, only {', '.join(names)}")
    if "data" in names:
        return "data"
    others = [name for name in names if name not in ABOUT_DATA]
    if len(others) == 1:
        return others[0]
    raise FileError(f"it holds several arrays, choose one by its key: {', '.join(names)}")


def _triple(arrays: Any, name: str, default: float, picked: Picked) -> Any:
    """Three numbers in the order of the axes in the file, put into that of x, y, z."""
    if name not in arrays:
        return default
    values = arrays[name]
    if values.shape not in ((), (1,), (3,)):
        raise FileError(f"its array {name!r} must hold three numbers, not {values.shape}")
    return np.broadcast_to(values, 3).astype(np.float64)[list(picked.order)]
