"""Volumes out of files, and surfaces out of volumes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import dicom, hdf5, metaimage, nifti, nrrd, numpy_files, ome_zarr, tiff, vti
from tetsimplify.io.axes import Choice
from tetsimplify.io.files import reading, suffix_among
from tetsimplify.io.volume import Volume
from tetsimplify.mesh import Mesh


class VolumeFormat(NamedTuple):
    """A file format of volumes; `has_keys` tells whether a file may hold several arrays."""

    name: str
    read: Callable[[Path, Choice], Volume]
    has_keys: bool = False


NIFTI = VolumeFormat("NIfTI", nifti.read)
NRRD = VolumeFormat("NRRD", nrrd.read)
METAIMAGE = VolumeFormat("MetaImage", metaimage.read)
TIFF = VolumeFormat("TIFF stack", tiff.read, has_keys=True)
TIFF_FOLDER = VolumeFormat("folder of TIFF files", tiff.read_folder)
DICOM = VolumeFormat("DICOM series", dicom.read, has_keys=True)
HDF5 = VolumeFormat("HDF5", hdf5.read, has_keys=True)
ZARR = VolumeFormat("Zarr", ome_zarr.read, has_keys=True)

VOLUME_FORMATS = {
    ".nii": NIFTI,
    ".nii.gz": NIFTI,
    ".mgh": VolumeFormat("MGH of FreeSurfer", nifti.read),
    ".mgz": VolumeFormat("MGH of FreeSurfer", nifti.read),
    ".dcm": DICOM,
    ".nrrd": NRRD,
    ".nhdr": NRRD,
    ".mha": METAIMAGE,
    ".mhd": METAIMAGE,
    ".tif": TIFF,
    ".tiff": TIFF,
    ".npy": VolumeFormat("NumPy array", numpy_files.read_npy),
    ".npz": VolumeFormat("NumPy archive", numpy_files.read_npz, has_keys=True),
    ".h5": HDF5,
    ".hdf5": HDF5,
    ".zarr": ZARR,
    ".vti": VolumeFormat("VTK ImageData", vti.read, has_keys=True),
    ".vtk": VolumeFormat("VTK structured points", vti.read_legacy, has_keys=True),
}
ZARR_METADATA = ("zarr.json", ".zgroup", ".zarray")


def read_volume(
    path: str | os.PathLike[str],
    *,
    key: str | None = None,
    channel: int | None = None,
    time: int | None = None,
    axes: str | None = None,
) -> Volume:
    """Open a voxel volume.

    Samples keep the data type of the file and stay in the file until they are sliced, where
    its format allows that; where it does not, that is logged. The transform to the world is
    that of the file, in the convention of its format: NIfTI has right, anterior, superior;
    DICOM and MetaImage left, posterior, superior; NRRD what its header says. Axes come as x, y,
    z. Where a file does not name its axes they are taken as x, y, z in their order.

    Parameters
    ----------
    path : path-like
        A file, or a folder of DICOM or TIFF files or a Zarr store. What may follow after a
        colon is the key: ``"a.h5:/raw"``, ``"a.zarr:1"``. Suffixes are the keys of
        ``VOLUME_FORMATS``; DICOM files need none. NumPy's need no extra, VTK's the extra
        ``pyvista``, all else ``volumes``.
    key : str, optional
        What to take from a file that holds several: the name or path of an array (NPZ, VTK,
        HDF5, Zarr), the level of an OME-Zarr image, the number of an image (TIFF), the UID of
        a DICOM series.
    channel, time : int, optional
        Which one to take of several channels (components, colours) or times, from 0.
    axes : str, optional
        What the axes are, in the order of the file: ``"zyx"``, ``"tzcyx"``. For files that do
        not tell, such as .npy.

    Returns
    -------
    Volume
        Samples, transform and unit of length.

    Raises
    ------
    FileError
        When the file is missing, cannot be read, is of no known format, or holds no volume or
        several of which none was chosen. Slicing raises it too, as that reads the file.
    OptionError
        When `key` is given for a format without keys, or when there is no such channel or time,
        or when `axes` do not fit.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    path, key_in_path = _split_key(path)
    if None not in (key, key_in_path):
        raise OptionError(f"there are two keys, {key_in_path!r} in the path and {key!r}")
    key = key_in_path if key is None else key
    if not path.exists():
        raise FileError(f"there is no file {path}")
    volume_format = _format_of(path)
    if volume_format is None:
        known = " ".join(VOLUME_FORMATS)
        raise FileError(f"{path} has no suffix of a volume format; these are known: {known}")
    if key is not None and not volume_format.has_keys:
        raise OptionError(f"a {volume_format.name} holds one array, so there is no key {key!r}")
    with reading(path, folders=volume_format in (DICOM, TIFF_FOLDER, ZARR)):
        return volume_format.read(path, Choice(key, channel, time, axes))


def is_volume_file(path: str | os.PathLike[str]) -> bool:
    """Whether a path leads to a volume, by its suffix or by what is there."""
    return _format_of(_split_key(path)[0]) is not None


def _split_key(path: str | os.PathLike[str]) -> tuple[Path, str | None]:
    """Take ``file.h5:/raw`` apart, unless there is a file of just this name."""
    text = os.fspath(path)
    if not os.path.exists(text):
        for suffix, volume_format in VOLUME_FORMATS.items():
            end = text.lower().find(f"{suffix}:") + len(suffix)
            if volume_format.has_keys and len(suffix) <= end < len(text) - 1:
                return Path(text[:end]), text[end + 1 :]
    return Path(text), None


def _format_of(path: Path) -> VolumeFormat | None:
    suffix = suffix_among(path, VOLUME_FORMATS)
    if path.is_dir():
        return _format_of_folder(path)
    if suffix == ".vtk" and not (path.is_file() and vti.is_image(path)):
        return None  # it holds a surface
    if suffix is None and path.is_file() and dicom.is_dicom(path):
        return DICOM
    return None if suffix is None else VOLUME_FORMATS[suffix]


def _format_of_folder(path: Path) -> VolumeFormat:
    names = [name.name for name in path.iterdir()]
    if any(name in ZARR_METADATA for name in names) or path.suffix.lower() == ".zarr":
        return ZARR
    if any(suffix_among(name, tiff.SUFFIXES) for name in names):
        return TIFF_FOLDER
    return DICOM


def isosurface_of(
    volume: Volume,
    level: float,
    *,
    lattice: str = "kuhn",
    closed: bool = False,
    normals: str = "lower",
    progress: Callable[[str, float], object] | None = None,
) -> Mesh:
    """Extract an isosurface and place it in the world.

    Parameters
    ----------
    volume : Volume
        Samples and their transform to the world. The cubes are taken along the axis that
        is slowest in the file, so that a file is read once from start to end.
    level, lattice, closed, normals, progress
        See :func:`tetsimplify.extract_isosurface`.

    Returns
    -------
    Mesh
        In world coordinates. Normals point to the side asked for, whether the transform
        mirrors or not.

    Raises
    ------
    VolumeError, OptionError
        See :func:`tetsimplify.extract_isosurface`.
    """
    from tetsimplify.isosurface import extract_isosurface

    data, affine, _ = volume.slowest_first()
    mesh = extract_isosurface(
        data, level, lattice=lattice, closed=closed, normals=normals, progress=progress
    )
    vertices = to_world(mesh.vertices, affine)
    mirrors = np.linalg.det(affine[:3, :3]) < 0
    return Mesh(vertices, np.ascontiguousarray(mesh.faces[:, ::-1]) if mirrors else mesh.faces)


def to_world(points: NDArray[np.float64], affine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of a grid, shape (n, 3), in the world; the same bytes on every machine."""
    # Spelled out, since a matrix product adds up in another order on another machine.
    world = np.empty_like(points)
    for axis in range(3):
        world[:, axis] = affine[axis, 3]
        for index in range(3):
            if affine[axis, index]:
                world[:, axis] += affine[axis, index] * points[:, index]
    return world
