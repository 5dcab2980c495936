"""NIfTI, and what else nibabel reads: Analyze and FreeSurfer's MGH."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import MissingExtraError
from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.units import as_unit
from tetsimplify.io.volume import Volume, checked_volume

AXES = "xyztc--"  # a vector at every sample is along the fifth axis


def read(path: Path, choice: Choice) -> Volume:
    """Read a volume with its sform or qform; the world is right, anterior, superior.

    Without compression it is mapped into memory, and values that the header scales are scaled
    when they are read.
    """
    try:
        import nibabel
    except ImportError as error:
        raise MissingExtraError("reading NIfTI", "nibabel", "volumes") from error
    image: Any = nibabel.load(path)
    shape = tuple(int(n) for n in image.shape)
    picked = pick(shape, AXES[: len(shape)], choice)
    raw = picked.take(image.dataobj.get_unscaled())
    if not _is_mapped(raw):
        log_whole(path)
        raw = raw if raw.size == np.prod(shape) else raw.copy(order="K")
    slope, inter = image.dataobj.slope, image.dataobj.inter
    data = raw if (slope, inter) == (1, 0) else _scaled(raw, slope, inter, path)
    unit = getattr(image.header, "get_xyzt_units", lambda: (None,))()[0]
    return checked_volume(data, np.array(image.affine, np.float64), as_unit(unit))


def _is_mapped(array: NDArray[Any]) -> bool:
    return isinstance(array, np.memmap)


def _scaled(raw: NDArray[Any], slope: float, inter: float, path: Path) -> LazyArray:
    from nibabel.volumeutils import apply_read_scaling

    z_y_x = raw.T
    dtype = apply_read_scaling(z_y_x[:1, :1, :1], slope, inter).dtype
    return LazyArray(
        lambda begin, end: apply_read_scaling(z_y_x[begin:end], slope, inter),
        z_y_x.shape,
        dtype,
        path,
    ).T
