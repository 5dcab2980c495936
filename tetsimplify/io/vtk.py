"""VTK, VTU and VTP: the formats of ParaView, through PyVista."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.polygons import log, mesh_of_polygons
from tetsimplify.mesh import NORMALS, Mesh

POLYGONS = {5: "triangle", 7: "polygon", 9: "quad"}  # the cell types of VTK with plain corners


def require() -> ModuleType:
    """Import PyVista, or say how to install it."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtraError("VTK", "pyvista", "pyvista") from error
    return pyvista


def read_dataset(path: Path) -> Any:
    """Read a file of VTK; what VTK would only print is raised."""
    pyvista = require()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they only repeat the errors
        with pyvista.VtkErrorCatcher(raise_errors=True, send_to_logging=False):
            return pyvista.read(path)


def read(path: Path) -> Mesh:
    """Read the polygons of polygonal data or of an unstructured grid."""
    dataset = read_dataset(path)
    kind = type(dataset).__name__
    if kind == "PolyData":
        n_corners, corners = _polygons_of_surface(dataset)
    elif kind == "UnstructuredGrid":
        n_corners, corners = _polygons_of_grid(dataset)
    else:
        raise FileError(f"it holds a {kind}, not a surface")
    if dataset.n_cells and not len(n_corners):
        raise FileError(f"none of its {dataset.n_cells:,} cells is a polygon")
    return mesh_of_polygons(np.asarray(dataset.points), n_corners, corners)


def write(path: Path, mesh: Mesh, data: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write polygonal data (VTK, VTP) or an unstructured grid (VTU), in binary.

    Data of vertices become point arrays; the normals are those of VTK, by the name Normals.
    """
    pyvista = require()
    if not len(mesh.faces):
        raise FileError("a mesh without faces is not for the formats of VTK")  # which may crash
    surface = pyvista.PolyData()
    surface.points = mesh.vertices
    surface.faces = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces]).reshape(-1)
    for name, values in (data or {}).items():
        if name == NORMALS:
            surface.point_data.active_normals = values
        else:
            surface.point_data[name] = values
    dataset = surface.cast_to_unstructured_grid() if path.suffix.lower() == ".vtu" else surface
    with pyvista.VtkErrorCatcher(raise_errors=True, send_to_logging=False):
        dataset.save(path)


def _polygons_of_surface(surface: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    if surface.n_strips:
        log.info("%s triangle strips cut into triangles", f"{surface.n_strips:,}")
        surface = surface.triangulate()
    n_corners, corners = _split(surface.GetPolys())
    n_other = surface.n_cells - len(n_corners)
    if n_other:
        log.warning("%s vertex and line cells left out: only faces are read", f"{n_other:,}")
    return n_corners, corners


def _polygons_of_grid(grid: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    is_polygon = np.isin(grid.celltypes, list(POLYGONS))
    n_corners, corners = _split(grid.GetCells())
    if not is_polygon.all():
        types = ", ".join(str(kind) for kind in np.unique(grid.celltypes[~is_polygon]))
        n_other = int((~is_polygon).sum())
        log.warning("%s cells of VTK types %s left out: no polygons", f"{n_other:,}", types)
        corners = corners[np.repeat(is_polygon, n_corners)]
        n_corners = n_corners[is_polygon]
    return n_corners, corners


def _split(cells: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Take the number of corners of each cell and the corners of all from a vtkCellArray."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    offsets = vtk_to_numpy(cells.GetOffsetsArray())
    return np.diff(offsets), vtk_to_numpy(cells.GetConnectivityArray())
