"""VTI: image data of VTK, through PyVista."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import FileError
from tetsimplify.io.volume import Volume, affine_of, checked_volume
from tetsimplify.io.vtk import read_dataset


def read(path: Path, key: str | None) -> Volume:
    """Read the array `key`, or the only one, at the points or else at the cells."""
    image = read_dataset(path)
    if type(image).__name__ != "ImageData":
        raise FileError(f"it holds a {type(image).__name__}, not an image")
    name, at_cells = _find_array(image, key)
    values = np.asarray((image.cell_data if at_cells else image.point_data)[name])
    if values.ndim != 1:
        raise FileError(f"its array {name!r} has {values.shape[1]} components for each sample")
    shape = [n - at_cells for n in image.dimensions]
    affine = affine_of(image.spacing, 0.0, image.direction_matrix)
    first = np.array(image.extent[::2]) + 0.5 * at_cells
    affine[:3, 3] = image.GetOrigin() + affine[:3, :3] @ first
    return checked_volume(values.reshape(shape, order="F"), affine)


def _find_array(image: Any, key: str | None) -> tuple[str, bool]:
    points, cells = list(image.point_data.keys()), list(image.cell_data.keys())
    for names, at_cells in ((points, False), (cells, True)):
        if key is not None and key in names:
            return key, at_cells
        if key is None and len(points + cells) == 1 and names:
            return names[0], at_cells
    known = ", ".join(points + cells)
    if key is not None:
        raise FileError(f"there is no array {key!r}, only {known}")
    if not known:
        raise FileError("it holds no array")
    raise FileError(f"it holds several arrays, choose one by its key: {known}")
