"""Image data of VTK, through PyVista: VTI, and structured points in the older format VTK."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.volume import Volume, affine_of, checked_volume
from tetsimplify.io.vtk import read_dataset, require

HEADER_BYTES = 1000


def is_image(path: Path) -> bool:
    """Whether a file in the older format holds structured points."""
    with open(path, "rb") as file:
        return b"DATASET STRUCTURED_POINTS" in file.read(HEADER_BYTES).upper()


def read(path: Path, choice: Choice) -> Volume:
    """Read the array of the key, or the only one, at the points or else the cells, by slabs."""
    reader = require().get_reader(path).reader
    x_y, first, last = _extent(reader)
    begin_of_image = _planes(reader, x_y, first, min(first + 1, last))
    name, at_cells = _find_array(begin_of_image, choice.key)
    sample = _samples(begin_of_image, name, at_cells)
    shape = (last - first + 1 - at_cells, *sample.shape[1:])
    picked = pick(shape, "zyxc", choice)
    for arrays in (reader.GetPointDataArraySelection(), reader.GetCellDataArraySelection()):
        arrays.DisableAllArrays()
        arrays.EnableArray(name)

    def planes(begin: int, end: int) -> NDArray[Any]:
        image = _planes(reader, x_y, first + begin, first + end - 1 + at_cells)
        return _samples(image, name, at_cells)[..., picked.keys[3]].copy()

    data = LazyArray(planes, shape[:3], sample.dtype, path).transpose(picked.order)
    return checked_volume(data, _affine(begin_of_image, at_cells))


def read_legacy(path: Path, choice: Choice) -> Volume:
    """Read the same of structured points in the older format, which VTK reads whole."""
    image = read_dataset(path)
    if type(image).__name__ != "ImageData":
        raise FileError(f"it holds a {type(image).__name__}, not an image")
    name, at_cells = _find_array(image, choice.key)
    samples = _samples(image, name, at_cells)
    picked = pick(samples.shape, "zyxc", choice)
    log_whole(path)
    return checked_volume(picked.take(samples), _affine(image, at_cells))


def _extent(reader: Any) -> tuple[list[int], int, int]:
    """The extent in x and y, and the first and the last plane."""
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    with require().VtkErrorCatcher(raise_errors=True, send_to_logging=False):
        reader.UpdateInformation()
    whole = vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()
    *x_y, first, last = reader.GetOutputInformation(0).Get(whole)
    return x_y, first, last


def _planes(reader: Any, x_y: list[int], first: int, last: int) -> Any:
    with require().VtkErrorCatcher(raise_errors=True, send_to_logging=False):
        reader.UpdateExtent([*x_y, first, last])
    return require().wrap(reader.GetOutput())


def _samples(image: Any, name: str, at_cells: bool) -> NDArray[Any]:
    """An array as planes, rows, columns and components."""
    values = np.asarray((image.cell_data if at_cells else image.point_data)[name])
    return values.reshape(*(n - at_cells for n in image.dimensions[::-1]), -1)


def _affine(image: Any, at_cells: bool) -> NDArray[np.float64]:
    """The transform of the first planes, which may not begin at index 0."""
    affine = affine_of(image.spacing, 0.0, image.direction_matrix)
    first = np.array(image.extent[::2]) + 0.5 * at_cells
    affine[:3, 3] = image.GetOrigin() + affine[:3, :3] @ first
    return affine


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
