"""NRRD, through pynrrd."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import MissingExtraError
from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.units import as_unit
from tetsimplify.io.volume import Volume, affine_of, checked_volume

SPATIAL_KINDS = ("domain", "space")


def read(path: Path, choice: Choice) -> Volume:
    """Read an NRRD file; the world is the one that its field ``space`` names.

    With the encoding ``raw`` the samples are mapped into memory.
    """
    try:
        import nrrd
    except ImportError as error:
        raise MissingExtraError("reading NRRD", "pynrrd", "volumes") from error
    with open(path, "rb") as file:
        header: dict[str, Any] = nrrd.read_header(file)
        end_of_header = file.tell()
    picked = pick([int(n) for n in header["sizes"]], _axes(header), choice)
    if header["encoding"] == "raw":
        array = _map(path, header, end_of_header)
    else:
        log_whole(path)
        array = nrrd.read(str(path))[0]
    spatial = [axis for axis, letter in enumerate(picked.axes) if letter in "xyz"]
    affine = _affine(header, spatial)[:, [*picked.order, 3]]
    return checked_volume(picked.take(array), affine, _unit(header, spatial))


def _axes(header: dict[str, Any]) -> str | None:
    """Tell the axes in space from those of components and times, by direction or else kind."""
    kinds = header.get("kinds", ["domain"] * len(header["sizes"]))
    if "space directions" in header:
        rows = header["space directions"]
        is_spatial = [row is not None and np.isfinite(row).all() for row in rows]
    else:
        is_spatial = [kind in SPATIAL_KINDS for kind in kinds]
    if sum(is_spatial) != 3:
        return None
    letters = iter("xyz")
    return "".join(
        next(letters) if spatial else "t" if kind == "time" else "c"
        for spatial, kind in zip(is_spatial, kinds, strict=True)
    )


def _map(path: Path, header: dict[str, Any], end_of_header: int) -> NDArray[Any]:
    named = header.get("data file", header.get("datafile"))
    file = path if named is None else path.parent / named
    dtype, sizes = _dtype(header), tuple(int(n) for n in header["sizes"])
    n_lines, n_bytes = (
        int(header.get(f"{what} skip", header.get(f"{what}skip", 0))) for what in ("line", "byte")
    )
    if n_bytes == -1:
        offset = file.stat().st_size - dtype.itemsize * int(np.prod(sizes))
    else:
        with open(file, "rb") as samples:
            samples.seek(end_of_header if named is None else 0)
            for _ in range(n_lines):
                samples.readline()
            offset = samples.tell() + n_bytes
    return np.memmap(file, dtype, "r", offset, sizes, "F")


def _dtype(header: dict[str, Any]) -> np.dtype[Any]:
    """The type of the samples, asked of pynrrd with a single sample."""
    import nrrd

    one: Any = {key: header[key] for key in ("type", "endian") if key in header}
    one |= {"dimension": 1, "sizes": np.ones(1, np.int64), "encoding": "raw"}
    return nrrd.read_data(one, io.BytesIO(bytes(16))).dtype


def _affine(header: dict[str, Any], spatial: list[int]) -> NDArray[np.float64]:
    origin = np.nan_to_num(header.get("space origin", np.zeros(3)))
    if "space directions" in header:
        rows = [header["space directions"][axis] for axis in spatial]
        return affine_of(1.0, origin, np.array(rows, np.float64).T)
    if "spacings" not in header:
        return affine_of(1.0, origin)
    spacing = np.asarray(header["spacings"], np.float64)[spatial]
    return affine_of(np.where(np.isfinite(spacing), spacing, 1.0), origin)


def _unit(header: dict[str, Any], spatial: list[int]) -> str | None:
    """The unit of the world, or that of all axes in space."""
    if "space units" in header:
        units = list(header["space units"])
    else:
        units = [header["units"][axis] for axis in spatial] if "units" in header else [None]
    return as_unit(units[0]) if len(set(units)) == 1 else None
