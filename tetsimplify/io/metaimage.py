"""MetaImage, through SimpleITK."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.volume import Volume, affine_of, checked_volume


def read(path: Path, key: str | None) -> Volume:
    """Read an .mha or .mhd file; the world is that of ITK: left, posterior, superior."""
    try:
        import SimpleITK
    except ImportError as error:
        raise MissingExtraError("reading MetaImage", "SimpleITK", "volumes") from error
    image = SimpleITK.ReadImage(str(path), imageIO="MetaImageIO")
    if image.GetNumberOfComponentsPerPixel() != 1:
        n_components = image.GetNumberOfComponentsPerPixel()
        raise FileError(f"it has {n_components} components for each sample")
    # ITK counts the fastest index first, NumPy last.
    data = SimpleITK.GetArrayFromImage(image).T
    n = image.GetDimension()
    if n < 3:
        return checked_volume(data, affine_of())
    directions = np.array(image.GetDirection()).reshape(n, n)[:3, :3]
    affine = affine_of(image.GetSpacing()[:3], image.GetOrigin()[:3], directions)
    return checked_volume(data, affine)
