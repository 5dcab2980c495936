"""NIfTI, through nibabel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tetsimplify.errors import MissingExtraError
from tetsimplify.io.volume import Volume, checked_volume


def read(path: Path, key: str | None) -> Volume:
    """Read a NIfTI file with its sform or qform; the world is right, anterior, superior.

    Without scaling of the values and without compression it is mapped into memory.
    """
    try:
        import nibabel
    except ImportError as error:
        raise MissingExtraError("reading NIfTI", "nibabel", "volumes") from error
    image: Any = nibabel.load(path)
    return checked_volume(np.asanyarray(image.dataobj), np.array(image.affine, np.float64))
