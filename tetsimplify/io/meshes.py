"""Meshes in and out of files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify.arrays import as_data, as_mesh
from tetsimplify.errors import FileError, OptionError
from tetsimplify.io import glb, obj, off, ply, stl, vtk
from tetsimplify.io.files import check_folder_of, reading, replacing, suffix_among
from tetsimplify.mesh import NORMALS, Mesh


class MeshFormat(NamedTuple):
    """A file format of meshes.

    Attributes
    ----------
    name : str
        What people call it.
    read, write : callable
        ``read(path) -> Mesh`` and ``write(path, mesh)``, or ``write(path, mesh, data)`` where
        the vertices have data.
    precision : dtype
        Of the positions in the files that `write` makes.
    require : callable or None
        Raises MissingExtraError when a package is not installed.
    data : tuple of str or None
        The names of the data of vertices that it holds, None for any.
    """

    name: str
    read: Callable[[Path], Mesh]
    write: Callable[..., None]
    precision: type[np.floating]
    require: Callable[[], object] | None = None
    data: tuple[str, ...] | None = None


MESH_FORMATS = {
    ".ply": MeshFormat("PLY", ply.read, ply.write, np.float64),
    ".stl": MeshFormat("STL", stl.read, stl.write, np.float32, data=()),
    ".obj": MeshFormat("OBJ", obj.read, obj.write, np.float64, data=(NORMALS,)),
    ".off": MeshFormat("OFF", off.read, off.write, np.float64, data=(NORMALS,)),
    ".vtk": MeshFormat("legacy VTK", vtk.read, vtk.write, np.float64, vtk.require),
    ".vtp": MeshFormat("VTK PolyData", vtk.read, vtk.write, np.float64, vtk.require),
    ".vtu": MeshFormat("VTK UnstructuredGrid", vtk.read, vtk.write, np.float64, vtk.require),
    ".glb": MeshFormat("glTF", glb.read, glb.write, np.float32, glb.require, (NORMALS,)),
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


def write_mesh(
    path: str | os.PathLike[str],
    mesh: Mesh,
    vertex_data: Mapping[str, NDArray[Any]] | None = None,
) -> None:
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
    vertex_data : dict of str to ndarray, shape (n, ...), optional
        Data of the vertices, of which those named ``"normals"``, shape (n, 3), are written as
        normals. PLY and the formats of VTK hold any; OBJ, OFF and GLB hold normals; STL none.

    Raises
    ------
    FileError
        When the suffix is unknown, the folder is missing or not writable, or the format does not
        hold the data.
    MeshError
        When the arrays are no mesh.
    OptionError
        When data have another number of rows than there are vertices.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    write_meshes([(path, mesh, {} if vertex_data is None else vertex_data)])


def write_meshes(
    meshes: Sequence[tuple[str | os.PathLike[str], Mesh, Mapping[str, NDArray[Any]]]],
) -> None:
    """Write several meshes, all of them or none.

    Parameters
    ----------
    meshes : sequence of (path, mesh, vertex_data)
        As :func:`write_mesh` takes them. No file takes its place before the last is complete.

    Raises
    ------
    FileError, MeshError, OptionError, MissingExtraError
        See :func:`write_mesh`.
    """
    checked = []
    for path, mesh, vertex_data in meshes:
        arrays = as_data("vertex_data", vertex_data, len(mesh[0]))
        mesh_format = check_target(path, arrays)
        if NORMALS in arrays and arrays[NORMALS].shape[1:] != (3,):
            raise OptionError(f"normals must have shape (n, 3), got {arrays[NORMALS].shape}")
        checked.append((path, mesh_format, as_mesh(*mesh, finite=False), arrays))
    with ExitStack() as stack:
        for path, mesh_format, mesh, arrays in checked:
            temporary = stack.enter_context(replacing(path))
            mesh_format.write(temporary, mesh, *([arrays] if arrays else []))


def check_target(path: str | os.PathLike[str], vertex_data: Iterable[str] = ()) -> MeshFormat:
    """Make sure that a mesh can be written to `path`, before any work is done.

    Parameters
    ----------
    path : path-like
    vertex_data : iterable of str
        Names of the data of vertices that are to be written too.

    Returns
    -------
    MeshFormat
        The format that the suffix tells.

    Raises
    ------
    FileError
        When the suffix is unknown, the folder is missing or not writable, or the format does not
        hold the data.
    MissingExtraError
        When the format needs a package that is not installed.
    """
    mesh_format = _format_of(path)
    held = mesh_format.data
    if held is not None and (others := [name for name in vertex_data if name not in held]):
        able = [
            suffix
            for suffix, entry in MESH_FORMATS.items()
            if entry.data is None or set(others) <= set(entry.data)
        ]
        raise FileError(
            f"cannot write {path}: {mesh_format.name} does not hold {', '.join(others)} of "
            f"vertices; these do: {' '.join(able)}"
        )
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
