"""GLB: binary glTF, through trimesh. Positions are in single precision."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify.errors import FileError, MissingExtraError
from tetsimplify.io.polygons import log
from tetsimplify.mesh import NORMALS, Mesh


def require() -> ModuleType:
    """Import trimesh, or say how to install it."""
    try:
        import trimesh
    except ImportError as error:
        raise MissingExtraError("GLB", "trimesh", "trimesh") from error
    return trimesh


def read(path: Path) -> Mesh:
    """Read all meshes of a GLB file as one, each where the scene places it."""
    geometries = require().load_scene(path, file_type="glb", process=False).dump()
    parts = [part for part in geometries if hasattr(part, "faces")]
    if not parts:
        raise FileError("it holds no triangles")
    if len(parts) < len(geometries):
        n_other = len(geometries) - len(parts)
        log.warning("%d objects left out: they are no triangle meshes", n_other)
    first_vertices = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = [part.faces + first for part, first in zip(parts, first_vertices, strict=True)]
    vertices = np.concatenate([part.vertices for part in parts])
    return Mesh(vertices.astype(np.float64), np.concatenate(faces).astype(np.int32))


def write(path: Path, mesh: Mesh, data: Mapping[str, NDArray[Any]] | None = None) -> None:
    """Write a GLB file. Positions and normals are rounded to single precision."""
    if not len(mesh.faces):
        raise FileError("glTF allows no mesh without faces")
    normals = data[NORMALS] if data else None
    surface = require().Trimesh(
        mesh.vertices, mesh.faces, vertex_normals=normals, process=False, validate=False
    )
    path.write_bytes(surface.export(file_type="glb", include_normals=bool(data)))
