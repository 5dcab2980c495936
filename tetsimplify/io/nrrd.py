"""NRRD, through pynrrd."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.volume import Volume, affine_of, checked_volume


def read(path: Path, key: str | None) -> Volume:
    """Read an NRRD file; the world is the one that its field ``space`` names."""
    try:
        import nrrd
    except ImportError as error:
        raise MissingExtraError("reading NRRD", "pynrrd", "volumes") from error
    data, header = nrrd.read(str(path))
    data, is_spatial = _drop_single_components(data, header)
    return checked_volume(data, _affine(header, is_spatial))


def _drop_single_components(
    data: NDArray[Any], header: dict[str, Any]
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Tell the axes in space from those of components, and drop these if of length 1."""
    is_spatial = np.ones(data.ndim, np.bool_)
    if "space directions" in header:
        rows = header["space directions"]
        is_spatial = np.array([row is not None and np.isfinite(row).all() for row in rows])
    if any(data.shape[axis] > 1 for axis in np.flatnonzero(~is_spatial)):
        raise FileError(f"its array has shape {data.shape} with several components for each sample")
    return data.squeeze(tuple(np.flatnonzero(~is_spatial).tolist())), is_spatial


def _affine(header: dict[str, Any], is_spatial: NDArray[np.bool_]) -> NDArray[np.float64]:
    if is_spatial.sum() != 3:
        return affine_of()  # no volume, which the caller will say
    origin = np.nan_to_num(header.get("space origin", np.zeros(3)))
    if "space directions" in header:
        rows = [header["space directions"][axis] for axis in np.flatnonzero(is_spatial)]
        return affine_of(1.0, origin, np.array(rows, np.float64).T)
    spacing = np.asarray(header.get("spacings", np.ones(3)), np.float64)
    return affine_of(np.where(np.isfinite(spacing), spacing, 1.0), origin)
