"""DICOM series, through SimpleITK."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError
from tetsimplify.io.axes import Choice, pick
from tetsimplify.io.files import log_whole
from tetsimplify.io.itk import dtype_of, require
from tetsimplify.io.lazy import LazyArray
from tetsimplify.io.volume import Volume, affine_of, checked_volume

SERIES, DESCRIPTION = "0020|000e", "0008|103e"
ORDER_IN_TIME = ("0020|0100", "0020|0012", "0008|0032", "0020|0013")
MAGIC, MAGIC_AT = b"DICM", 128
TOLERANCE = 0.05  # of the distance between slices: positions are rounded in many files


class Slice(NamedTuple):
    """What the header of one file tells."""

    path: Path
    size: tuple[int, ...]
    spacing: tuple[float, ...]
    origin: NDArray[np.float64]
    directions: NDArray[np.float64]
    pixel_id: int
    n_components: int
    time: tuple[float, ...]


def is_dicom(path: Path) -> bool:
    """Whether a file begins as DICOM files do."""
    with open(path, "rb") as file:
        file.seek(MAGIC_AT)
        return file.read(len(MAGIC)) == MAGIC


def read(path: Path, choice: Choice) -> Volume:
    """Read the series in a folder, or that of one of its files; slices are read as needed.

    The world is that of DICOM: left, posterior, superior, in mm. Slices are put in order by
    their positions, and the step from slice to slice is that between positions, which need not
    be perpendicular to the slices: a tilted gantry gives a sheared grid.
    """
    require("reading DICOM")
    slices = [_slice(file) for file in _files(path, choice.key)]
    if len(slices) == 1 and slices[0].size[2:] not in ((), (1,)):
        return _frames(slices[0], choice)
    return _series(slices, path, choice)


def _files(path: Path, key: str | None) -> list[Path]:
    """The files of one series: the one of the key, of the file, or the only one."""
    import SimpleITK

    reader = SimpleITK.ImageSeriesReader()
    folder = path if path.is_dir() else path.parent
    if path.is_file():
        series: str | None = _header(path).get(SERIES)
        if key is not None and key != series:
            raise FileError(f"it belongs to the series {series}, not {key}")
    else:
        found = reader.GetGDCMSeriesIDs(str(folder))
        if not found:
            raise FileError("there is no file of a known format in this folder")
        series = key if key is not None else found[0]
        if series not in found or (key is None and len(found) > 1):
            raise FileError(f"choose one of its series by its key: {_listed(folder, found)}")
    files = [Path(name) for name in reader.GetGDCMSeriesFileNames(str(folder), series or "")]
    return files if path.is_dir() or path in files else [path]


def _listed(folder: Path, found: tuple[str, ...]) -> str:
    import SimpleITK

    texts = []
    for series in found:
        files = SimpleITK.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), series)
        description = _header(Path(files[0])).get(DESCRIPTION, "")
        texts.append(f"{series} ({len(files)} files{description and ', ' + description})")
    return ", ".join(texts)


def _open(path: Path) -> Any:
    import SimpleITK

    reader = SimpleITK.ImageFileReader()
    reader.SetImageIO("GDCMImageIO")
    reader.SetFileName(str(path))
    reader.ReadImageInformation()
    return reader


def _header(path: Path) -> dict[str, str]:
    reader = _open(path)
    return {key: reader.GetMetaData(key).strip("\0 ") for key in reader.GetMetaDataKeys()}


def _slice(path: Path) -> Slice:
    reader = _open(path)
    n = reader.GetDimension()
    return Slice(
        path,
        reader.GetSize(),
        reader.GetSpacing(),
        np.array(reader.GetOrigin()[:3]),
        np.array(reader.GetDirection()).reshape(n, n)[:3, :3],
        reader.GetPixelID(),
        reader.GetNumberOfComponents(),
        tuple(_number(reader, key) for key in ORDER_IN_TIME),
    )


def _number(reader: Any, key: str) -> float:
    try:
        return float(reader.GetMetaData(key)) if reader.HasMetaDataKey(key) else 0.0
    except ValueError:
        return 0.0


def _series(slices: list[Slice], path: Path, choice: Choice) -> Volume:
    first = slices[0]
    for other in slices:
        if other.size != first.size or other.n_components != first.n_components:
            raise FileError(f"{other.path.name} has size {other.size}, others {first.size}")
        if not np.allclose(other.directions, first.directions, atol=1e-3):
            raise FileError(f"{other.path.name} has another orientation than {first.path.name}")
    phases = _in_phases(slices)
    columns, rows = first.size[:2]
    shape = (len(phases), len(phases[0]), rows, columns, first.n_components)
    picked = pick(shape, "tzyxc", choice)
    chosen = phases[choice.time or 0]
    step = _step(chosen)

    def planes(begin: int, end: int) -> NDArray[Any]:
        return np.stack([_pixels(one, picked.keys[4]) for one in chosen[begin:end]])

    dtype = np.result_type(*(dtype_of(one.pixel_id, one.n_components) for one in chosen))
    data = LazyArray(planes, shape[1:4], dtype, path).transpose((2, 1, 0))
    affine = affine_of((*first.spacing[:2], 1.0), chosen[0].origin, first.directions)
    affine[:3, 2] = step
    return checked_volume(data, affine, "mm")


def _in_phases(slices: list[Slice]) -> list[list[Slice]]:
    """Order slices along their normal; those at one position belong to different times."""
    heights = [float(one.origin @ slices[0].directions[:, 2]) for one in slices]
    at_once = 1e-3 * (max(heights) - min(heights)) / len(slices)
    stacks: list[list[Slice]] = []
    last = -np.inf
    for height, one in sorted(zip(heights, slices, strict=True), key=lambda pair: pair[0]):
        if height - last > at_once:
            stacks.append([])
            last = height
        stacks[-1].append(one)
    n_times = {len(stack) for stack in stacks}
    if len(n_times) > 1:
        raise FileError(f"some positions have {min(n_times)} slices, some {max(n_times)}")
    for stack in stacks:
        stack.sort(key=lambda one: one.time)
    return [[stack[k] for stack in stacks] for k in range(n_times.pop())]


def _step(slices: list[Slice]) -> NDArray[np.float64]:
    """The vector from each slice to the next.

    Raises
    ------
    FileError
        When slices do not follow each other at equal distances, such as where one is missing.
    """
    first = slices[0]
    if len(slices) == 1:
        return first.directions[:, 2] * (first.spacing[2] if len(first.spacing) > 2 else 1.0)
    origins = np.array([one.origin for one in slices])
    step = (origins[-1] - origins[0]) / (len(slices) - 1)
    off = np.linalg.norm(origins - origins[0] - np.outer(np.arange(len(slices)), step), axis=1)
    if off.max() > TOLERANCE * np.linalg.norm(step):
        steps = np.linalg.norm(np.diff(origins, axis=0), axis=1)
        k = int(np.abs(steps - np.median(steps)).argmax())
        raise FileError(
            f"its slices are not at equal distances: {slices[k].path.name} and "
            f"{slices[k + 1].path.name} are {steps[k]:.6g} mm apart, most {np.median(steps):.6g} mm"
        )
    return step


def _pixels(one: Slice, component: Any) -> NDArray[Any]:
    import SimpleITK

    image = _open(one.path).Execute()
    rows, columns = one.size[1], one.size[0]
    return SimpleITK.GetArrayFromImage(image).reshape(rows, columns, -1)[..., component]


def _frames(one: Slice, choice: Choice) -> Volume:
    """A single file with a frame for each plane."""
    import SimpleITK

    picked = pick((*one.size[::-1], one.n_components), "zyxc", choice)
    log_whole(one.path)
    array = SimpleITK.GetArrayFromImage(_open(one.path).Execute())
    affine = affine_of(one.spacing[:3], one.origin, one.directions)
    return checked_volume(
        picked.take(array.reshape(*one.size[::-1], one.n_components)), affine, "mm"
    )
