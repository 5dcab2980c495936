"""TIFF stacks, through tifffile."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from numpy.typing import NDArray

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.volume import Volume, affine_of, checked_volume

PAGE_AXES = "ZQI"  # what tifffile calls the axis from page to page


def read(path: Path, key: str | None) -> Volume:
    """Read a stack: axis 0 is x (columns), axis 1 is y (rows), axis 2 is z (pages).

    Spacing comes from the metadata of ImageJ or OME, which tell it along all three axes;
    plain TIFF knows no distance between pages, so there it is 1.
    """
    try:
        import tifffile
    except ImportError as error:
        raise MissingExtraError("reading TIFF", "tifffile", "volumes") from error
    with tifffile.TiffFile(path) as file:
        if len(file.series) > 1:
            shapes = ", ".join(str(series.shape) for series in file.series)
            raise FileError(f"it holds {len(file.series)} images instead of one: {shapes}")
        series = file.series[0]
        axes = series.axes
        spacing = _spacing(file)
        is_contiguous = series.dataoffset is not None
        data = None if is_contiguous else series.asarray(squeeze=False)
    if data is None:
        data = tifffile.memmap(path, mode="r")
    data, axes = _pages_rows_columns(data, axes)
    return checked_volume(data.T, affine_of(spacing), axes[::-1])


def _pages_rows_columns(data: NDArray[Any], axes: str) -> tuple[NDArray[Any], str]:
    """Drop axes of length 1, and refuse channels, times and colours."""
    if data.ndim != len(axes):
        data = data.reshape([n for n in data.shape if n > 1])
    kept = [axis for axis, n in enumerate(data.shape) if n > 1 or axes[axis] in "YX"]
    names = "".join(axes[axis] for axis in kept)
    data = data.reshape([data.shape[axis] for axis in kept])
    if data.ndim == 3 and not (names[0] in PAGE_AXES + "TC" and names[1:] == "YX"):
        raise FileError(f"its axes are {names}, but a stack has pages, rows and columns")
    return data, names


def _spacing(file: Any) -> tuple[float, float, float]:
    if file.is_ome:
        return _ome_spacing(file.ome_metadata)
    if file.is_imagej:
        page = file.pages[0]
        x, y = (_length_of_sample(page, f"{axis}Resolution") for axis in "XY")
        return x, y, abs(float(file.imagej_metadata.get("spacing", 1.0)))
    return 1.0, 1.0, 1.0


def _length_of_sample(page: Any, tag_name: str) -> float:
    tag = page.tags.get(tag_name)
    if tag is None:
        return 1.0
    samples, length = tag.value
    return length / samples if samples and length else 1.0


def _ome_spacing(xml: str) -> tuple[float, float, float]:
    for element in ElementTree.fromstring(xml).iter():
        if element.tag.endswith("}Pixels"):
            x, y, z = (float(element.get(f"PhysicalSize{axis}", 1.0)) for axis in "XYZ")
            return x, y, z
    return 1.0, 1.0, 1.0
