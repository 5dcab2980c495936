"""What the formats that are read through SimpleITK share."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from tetsimplify.errors import MissingExtraError


def require(purpose: str) -> ModuleType:
    """Import SimpleITK, or say how to install it."""
    try:
        import SimpleITK
    except ImportError as error:
        raise MissingExtraError(purpose, "SimpleITK", "volumes") from error
    return SimpleITK


def dtype_of(pixel_id: int, n_components: int = 1) -> np.dtype[Any]:
    """The type of NumPy for a type of pixels, asked of an image of a single one."""
    import SimpleITK

    is_vector = "vector" in SimpleITK.GetPixelIDValueAsString(pixel_id)
    pixel = SimpleITK.Image([1, 1], pixel_id, n_components if is_vector else 0)
    return SimpleITK.GetArrayViewFromImage(pixel).dtype
