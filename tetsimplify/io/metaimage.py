"""MetaImage, through SimpleITK."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.itk import dtype_of, require
from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.volume import Volume, affine_of, checked_volume

COMPRESSED = re.compile(rb"^CompressedData\s*=\s*True\s*$", re.MULTILINE | re.IGNORECASE)
HEADER_BYTES = 10_000


def read(path: Path, choice: Choice) -> Volume:
    """Read an .mha or .mhd file; the world is that of ITK: left, posterior, superior."""
    require("reading MetaImage")
    reader = _open(path)
    size, n_components = list(reader.GetSize()), reader.GetNumberOfComponents()
    picked = pick([*size, n_components], "xyzt"[: len(size)] + "c", choice)
    time = picked.keys[3:-1]

    def planes(begin: int, end: int) -> NDArray[Any]:
        some = _open(path)
        some.SetExtractIndex([0, 0, begin, *time])
        some.SetExtractSize([*size[:2], end - begin, *(0 for _ in time)])
        return _samples(some)[..., picked.keys[-1]]

    z_y_x = size[2::-1]
    dtype = dtype_of(reader.GetPixelID(), n_components)
    if _is_compressed(path):
        log_whole(path)
        data: NDArray[Any] | LazyArray = planes(0, size[2]).T
    else:
        data = LazyArray(planes, z_y_x, dtype, path).T
    directions = np.array(reader.GetDirection()).reshape(len(size), len(size))[:3, :3]
    affine = affine_of(reader.GetSpacing()[:3], reader.GetOrigin()[:3], directions)
    return checked_volume(data, affine)


def _open(path: Path) -> Any:
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetImageIO("MetaImageIO")
    reader.SetFileName(str(path))
    reader.ReadImageInformation()
    return reader


def _samples(reader: Any) -> NDArray[Any]:
    """Read what was asked for, with an axis of components."""
    import SimpleITK

    image = reader.Execute()
    return SimpleITK.GetArrayFromImage(image).reshape(
        *image.GetSize()[::-1], image.GetNumberOfComponentsPerPixel()
    )


def _is_compressed(path: Path) -> bool:
    with open(path, "rb") as file:
        return COMPRESSED.search(file.read(HEADER_BYTES)) is not None
