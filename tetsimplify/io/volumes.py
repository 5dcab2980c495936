"""Volumes out of files, and surfaces out of volumes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import metaimage, nifti, nrrd, numpy_files, tiff, vti
from tetsimplify.io.files import reading, suffix_among
from tetsimplify.io.volume import Volume
from tetsimplify.mesh import Mesh


class VolumeFormat(NamedTuple):
    """A file format of volumes; `has_keys` tells whether a file may hold several arrays."""

    name: str
    read: Callable[[Path, str | None], Volume]
    has_keys: bool = False


VOLUME_FORMATS = {
    ".nii": VolumeFormat("NIfTI", nifti.read),
    ".nii.gz": VolumeFormat("NIfTI", nifti.read),
    ".nrrd": VolumeFormat("NRRD", nrrd.read),
    ".nhdr": VolumeFormat("NRRD", nrrd.read),
    ".mha": VolumeFormat("MetaImage", metaimage.read),
    ".mhd": VolumeFormat("MetaImage", metaimage.read),
    ".tif": VolumeFormat("TIFF stack", tiff.read),
    ".tiff": VolumeFormat("TIFF stack", tiff.read),
    ".npy": VolumeFormat("NumPy array", numpy_files.read_npy),
    ".npz": VolumeFormat("NumPy archive", numpy_files.read_npz, has_keys=True),
    ".vti": VolumeFormat("VTK ImageData", vti.read, has_keys=True),
}


def read_volume(path: str | os.PathLike[str], *, key: str | None = None) -> Volume:
    """Read a voxel volume from a file.

    Samples keep the data type of the file. The transform to the world is that of the file,
    in the convention of its format: NIfTI has right, anterior, superior; MetaImage left,
    posterior, superior; NRRD what its header says. Axes are x, y, z, except in .npy and
    .npz, whose axes may mean anything and are taken in their order.

    Parameters
    ----------
    path : path-like
        An .npy or .npz file; with the extra ``volumes`` also .nii, .nii.gz, .nrrd, .nhdr,
        .mha, .mhd, .tif and .tiff; with the extra ``pyvista`` also .vti.
    key : str, optional
        The array to take from a file that holds several (.npz, .vti).

    Returns
    -------
    Volume
        Samples and transform. Samples are a memory map where the format allows it: .npy,
        and uncompressed .nii and .tif.

    Raises
    ------
    FileError
        When the file is missing, cannot be read, has an unknown suffix, or holds no volume
        or several.
    OptionError
        When `key` is given for a format without keys.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    path = Path(path)
    suffix = suffix_among(path, VOLUME_FORMATS)
    if suffix is None:
        known = " ".join(VOLUME_FORMATS)
        raise FileError(f"{path} has no suffix of a volume format; these are known: {known}")
    volume_format = VOLUME_FORMATS[suffix]
    if key is not None and not volume_format.has_keys:
        raise OptionError(f"a {suffix} file holds one array, so there is no key {key!r}")
    with reading(path):
        return volume_format.read(path, key)


def is_volume_file(path: str | os.PathLike[str]) -> bool:
    """Whether the suffix is one of the volume formats."""
    return suffix_among(path, VOLUME_FORMATS) is not None


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
        is slowest in memory, so that a memory map is read once from start to end.
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

    data, affine = volume
    if data.flags.f_contiguous and not data.flags.c_contiguous:
        data, affine = data.T, affine[:, [2, 1, 0, 3]]
    mesh = extract_isosurface(
        data, level, lattice=lattice, closed=closed, normals=normals, progress=progress
    )
    vertices = _to_world(mesh.vertices, affine)
    mirrors = np.linalg.det(affine[:3, :3]) < 0
    return Mesh(vertices, np.ascontiguousarray(mesh.faces[:, ::-1]) if mirrors else mesh.faces)


def _to_world(points: NDArray[np.float64], affine: NDArray[np.float64]) -> NDArray[np.float64]:
    # Spelled out, since a matrix product adds up in another order on another machine.
    world = np.empty_like(points)
    for axis in range(3):
        world[:, axis] = affine[axis, 3]
        for index in range(3):
            if affine[axis, index]:
                world[:, axis] += affine[axis, index] * points[:, index]
    return world
