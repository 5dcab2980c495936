"""Meshes in and out of files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tetsimplify.arrays import as_mesh
from tetsimplify.errors import FileError
from tetsimplify.io import glb, obj, off, ply, stl, vtk
from tetsimplify.io.files import check_folder_of, reading, replacing, suffix_among
from tetsimplify.mesh import Mesh


class MeshFormat(NamedTuple):
    """A file format of meshes.

    Attributes
    ----------
    name : str
        What people call it.
    read, write : callable
        ``read(path) -> Mesh`` and ``write(path, mesh)``.
    precision : dtype
        Of the positions in the files that `write` makes.
    require : callable or None
        Raises MissingExtraError when a package is not installed.
    """

    name: str
    read: Callable[[Path], Mesh]
    write: Callable[[Path, Mesh], None]
    precision: type[np.floating]
    require: Callable[[], object] | None = None


MESH_FORMATS = {
    ".ply": MeshFormat("PLY", ply.read, ply.write, np.float64),
    ".stl": MeshFormat("STL", stl.read, stl.write, np.float32),
    ".obj": MeshFormat("OBJ", obj.read, obj.write, np.float64),
    ".off": MeshFormat("OFF", off.read, off.write, np.float64),
    ".vtk": MeshFormat("legacy VTK", vtk.read, vtk.write, np.float64, vtk.require),
    ".vtp": MeshFormat("VTK PolyData", vtk.read, vtk.write, np.float64, vtk.require),
    ".vtu": MeshFormat("VTK UnstructuredGrid", vtk.read, vtk.write, np.float64, vtk.require),
    ".glb": MeshFormat("glTF", glb.read, glb.write, np.float32, glb.require),
}


def read_mesh(path: str | os.PathLike[str]) -> Mesh:
    """Read a triangle mesh from a file.

    Vertices and faces come in the order of the file. Nothing is merged or dropped, unless
    the format leaves no choice: STL holds no connectivity, so corners with exactly equal
    coordinates become one vertex. Polygons are fanned into triangles. Whatever is not taken
    over exactly is told to the logger ``tetsimplify.io``: at level INFO where nothing is
    lost, at level WARNING where something is left out.

    Parameters
    ----------
    path : path-like
        A .ply, .stl, .obj or .off file; with the extra ``pyvista`` also .vtk, .vtp and
        .vtu; with the extra ``trimesh`` also .glb.

    Returns
    -------
    Mesh
        Vertices, shape (n, 3), float64, and faces, shape (m, 3), int32.

    Raises
    ------
    FileError
        When the file is missing, cannot be read or has an unknown suffix.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    path = Path(path)
    mesh_format = _format_of(path)
    with reading(path):
        return as_mesh(*mesh_format.read(path), finite=False)


def write_mesh(path: str | os.PathLike[str], mesh: Mesh) -> None:
    """Write a triangle mesh to a file, whole or not at all.

    A file that exists already is replaced once the new one is complete; if anything goes
    wrong before that, it stays as it is.

    Parameters
    ----------
    path : path-like
        The suffix tells the format, see :func:`read_mesh`. Positions keep their double
        precision in all formats but STL and GLB.
    mesh : Mesh
        Vertices, shape (n, 3), and faces, shape (m, 3).

    Raises
    ------
    FileError
        When the suffix is unknown, or the folder is missing or not writable.
    MeshError
        When the arrays are no mesh.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    mesh_format = check_target(path)
    checked = as_mesh(*mesh, finite=False)
    with replacing(path) as temporary:
        mesh_format.write(temporary, checked)


def check_target(path: str | os.PathLike[str]) -> MeshFormat:
    """Make sure that a mesh can be written to `path`, before any work is done.

    Returns
    -------
    MeshFormat
        The format that the suffix tells.

    Raises
    ------
    FileError
        When the suffix is unknown, or the folder is missing or not writable.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    mesh_format = _format_of(path)
    if mesh_format.require:
        mesh_format.require()
    check_folder_of(path)
    return mesh_format


def is_mesh_file(path: str | os.PathLike[str]) -> bool:
    """Whether the suffix is one of the mesh formats."""
    return suffix_among(path, MESH_FORMATS) is not None


def _format_of(path: str | os.PathLike[str]) -> MeshFormat:
    suffix = suffix_among(path, MESH_FORMATS)
    if suffix is None:
        known = " ".join(MESH_FORMATS)
        raise FileError(f"{path} has no suffix of a mesh format; these are known: {known}")
    return MESH_FORMATS[suffix]
