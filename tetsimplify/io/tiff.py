"""TIFF stacks and OME-TIFF, through tifffile."""

from __future__ import annotations

from math import prod
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.axes import DROPPED, Choice, Picked, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.units import in_one_unit
from tetsimplify.io.volume import Volume, affine_of, checked_volume

SUFFIXES = (".tif", ".tiff")
MAX_COLOURS = 4
LETTERS = {"X": "x", "Y": "y", "Z": "z", "C": "c", "S": "c", "T": "t"}


def require() -> ModuleType:
    """Import tifffile, or say how to install it."""
    try:
        import tifffile
    except ImportError as error:
        raise MissingExtraError("reading TIFF", "tifffile", "volumes") from error
    return tifffile


def read(path: Path, choice: Choice) -> Volume:
    """Read a stack: x from column to column, y from row to row, z from page to page.

    Without compression it is mapped into memory, else it is read page by page. Spacing comes
    from the metadata of ImageJ or OME, which tell it along all three axes; plain TIFF knows no
    distance between pages, so there it is 1.
    """
    file = require().TiffFile(path)
    try:
        _check_chain_of_pages(file)
        number = _number_of_image(file, choice.key)
        series = file.series[number]
        _require_codec(series.keyframe)
        is_named = choice.axes is not None  # then axes of length 1 do not count
        shape = series.get_shape(squeeze=is_named)
        picked = pick(shape, _letters(series.get_axes(squeeze=is_named), shape), choice)
        spacing, unit = _spacing(file, number)
        data, is_open = _samples(file, number, shape, picked, path)
    except BaseException:
        file.close()
        raise
    if not is_open:
        file.close()
    return checked_volume(data, affine_of(spacing), unit)


def read_folder(path: Path, choice: Choice) -> Volume:
    """Read a folder with one file for each plane, in the order of the numbers in their names."""
    tifffile = require()
    names = [name.name for name in path.iterdir() if name.suffix.lower() in SUFFIXES]
    files = [path / name for name in tifffile.natural_sorted(names)]
    with tifffile.TiffFile(files[0]) as file:
        _require_codec(file.pages.first)
    first = tifffile.imread(files[0])
    if first.ndim != 2 and (first.ndim != 3 or first.shape[2] > MAX_COLOURS):
        raise FileError(f"{files[0].name} has shape {first.shape}, but is to be one plane")
    picked = pick((len(files), *first.shape), "zyxc"[: first.ndim + 1], choice)

    def planes(begin: int, end: int) -> NDArray[Any]:
        return np.stack([_plane(file) for file in files[begin:end]])

    def _plane(file: Path) -> NDArray[Any]:
        plane = tifffile.imread(file)
        if plane.shape != first.shape:
            raise FileError(f"{file.name} has shape {plane.shape}, others {first.shape}")
        return plane[picked.keys[1:]]

    data = LazyArray(planes, (len(files), *first.shape[:2]), first.dtype, path)
    return checked_volume(data.transpose(picked.order), affine_of())


def _require_codec(page: Any) -> None:
    """Find out before any work that a page is compressed in a way that needs another package.

    Raises
    ------
    MissingExtraError
        When it does, and that is not installed.
    """
    try:
        require().TIFF.DECOMPRESSORS[page.compression]
    except KeyError as error:
        if "imagecodecs" not in str(error):
            return  # nothing knows it, which reading will tell
        name = getattr(page.compression, "name", page.compression)
        purpose = f"reading TIFF with {name} compression"
        raise MissingExtraError(purpose, "imagecodecs", "volumes") from error


def _check_chain_of_pages(file: Any) -> None:
    """Refuse a file that was cut off, of which tifffile would read what is there."""
    end_of_chain = file.pages.next_page_offset
    if end_of_chain is None:
        return
    file.filehandle.seek(end_of_chain)
    if any(file.filehandle.read(file.tiff.offsetsize)):
        raise FileError("it is truncated: pages are missing")


def _number_of_image(file: Any, key: str | None) -> int:
    n = len(file.series)
    if key is None and n == 1:
        return 0
    if key is not None and key.isdecimal() and int(key) < n:
        return int(key)
    shapes = ", ".join(str(series.shape) for series in file.series)
    raise FileError(f"it holds {n} images, choose one by its key, from 0 to {n - 1}: {shapes}")


def _letters(axes: str, shape: tuple[int, ...]) -> str:
    """Name the axes; pages that are nothing else are planes."""
    letters = [LETTERS.get(axis, DROPPED) for axis in axes]
    if "z" not in letters or shape[letters.index("z")] == 1:
        others = [k for k, n in enumerate(shape) if n > 1 and axes[k] not in "XYS"]
        if len(others) == 1:
            letters = [DROPPED if letter == "z" else letter for letter in letters]
            letters[others[0]] = "z"
    if letters.count("c") == 2:  # channels, and colours in each of them
        channels, colours = axes.index("C"), axes.index("S")
        letters[channels if shape[channels] == 1 else colours] = DROPPED
    return "".join(letters)


def _samples(
    file: Any, number: int, shape: tuple[int, ...], picked: Picked, path: Path
) -> tuple[NDArray[Any] | LazyArray, bool]:
    """Map an image, or read it page by page; tell whether the file has to stay open."""
    series = file.series[number]
    if series.dataoffset is not None:
        array = require().memmap(path, series=number, mode="r").reshape(shape)
        return picked.take(array), False
    n_before = next((k for k in range(len(shape) + 1) if prod(shape[:k]) == len(series.pages)), 0)
    z = picked.axes.index("z")
    if z >= n_before:
        log_whole(path)
        return picked.take(series.asarray().reshape(shape)), False
    plane_axes = [axis for axis in picked.axes[n_before:] if axis in "xy"]
    plane_shape = [shape[picked.axes.index(axis)] for axis in plane_axes]

    def planes(begin: int, end: int) -> NDArray[Any]:
        return np.stack([_plane(z_index) for z_index in range(begin, end)])

    def _plane(z_index: int) -> NDArray[Any]:
        before: Any = [z_index if k == z else picked.keys[k] for k in range(n_before)]
        page = series.pages[int(np.ravel_multi_index(before, shape[:n_before]))]
        if page is None:
            raise FileError(f"the page of plane {z_index} is missing")
        return page.asarray().reshape(shape[n_before:])[picked.keys[n_before:]]

    data = LazyArray(planes, (shape[z], *plane_shape), series.dtype, path, close=file.close)
    order = ["z", *plane_axes]
    return data.transpose([order.index(letter) for letter in "xyz"]), True


def _spacing(file: Any, number: int) -> tuple[list[float], str | None]:
    """Distances along x, y, z and their unit."""
    if file.is_ome:
        return _ome_spacing(file.ome_metadata, number)
    if file.is_imagej:
        page, metadata = file.pages[0], file.imagej_metadata
        x, y = (_length_of_sample(page, f"{axis}Resolution") for axis in "XY")
        units = [metadata.get("unit"), metadata.get("yunit"), metadata.get("zunit")]
        lengths = [x, y, abs(float(metadata.get("spacing", 1.0)))]
        return in_one_unit(lengths, [unit or units[0] for unit in units])
    return [1.0, 1.0, 1.0], None


def _length_of_sample(page: Any, tag_name: str) -> float:
    tag = page.tags.get(tag_name)
    if tag is None:
        return 1.0
    samples, length = tag.value
    return length / samples if samples and length else 1.0


def _ome_spacing(xml: str, number: int) -> tuple[list[float], str | None]:
    pixels = [item for item in ElementTree.fromstring(xml).iter() if item.tag.endswith("}Pixels")]
    if number >= len(pixels):
        return [1.0, 1.0, 1.0], None
    names = [f"PhysicalSize{axis}" for axis in "XYZ"]
    known = [name for name in names if name in pixels[number].attrib]
    if not known:
        return [1.0, 1.0, 1.0], None
    lengths = [float(pixels[number].get(name, 1.0)) for name in names]
    units = [pixels[number].get(f"{name}Unit", "µm") for name in names]
    return in_one_unit(lengths, units)
