"""NPY and NPZ: arrays of NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import FileError
from tetsimplify.io.volume import Volume, affine_of, checked_volume


def read_npy(path: Path, key: str | None) -> Volume:
    """Map an array into memory. Its axes are the axes of the world, at distances of 1."""
    return checked_volume(np.load(path, mmap_mode="r", allow_pickle=False), affine_of())


def read_npz(path: Path, key: str | None) -> Volume:
    """Read the array `key`, and ``spacing`` and ``origin`` where they are there.

    Without `key` it is the array ``data``, or the only one there is.
    """
    with np.load(path, allow_pickle=False) as arrays:
        data = arrays[_name_of_data(arrays, key)]
        spacing = _triple(arrays, "spacing", 1.0)
        origin = _triple(arrays, "origin", 0.0)
    return checked_volume(data, affine_of(spacing, origin))


def _name_of_data(arrays: Any, key: str | None) -> str:
    names = list(arrays.keys())
    if key is not None:
        if key in names:
            return key
        raise FileError(f"there is no array {key!r}, only {', '.join(names)}")
    if "data" in names:
        return "data"
    others = [name for name in names if name not in ("spacing", "origin")]
    if len(others) == 1:
        return others[0]
    raise FileError(f"it holds several arrays, choose one by its key: {', '.join(names)}")


def _triple(arrays: Any, name: str, default: float) -> Any:
    if name not in arrays:
        return default
    values = arrays[name]
    if values.shape not in ((), (1,), (3,)):
        raise FileError(f"its array {name!r} must hold three numbers, not {values.shape}")
    return values.astype(np.float64)
