"""The order in which an engine works on a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.mesh import Mesh

BITS = 10  # of the number of cells of the curve along an axis


class Arrangement(NamedTuple):
    """A mesh whose vertices and faces are in an order of their own."""

    mesh: Mesh
    vertex_origin: NDArray[np.int32]
    """Shape (n,): number of each vertex in the mesh given."""
    vertex_place: NDArray[np.int32]
    """Shape (n,): the inverse."""
    face_origin: NDArray[np.int32]
    """Shape (m,): number of each face in the mesh given."""


def as_given(mesh: Mesh) -> Arrangement:
    """The order of the mesh itself; its arrays are copied."""
    vertices = np.arange(len(mesh.vertices), dtype=np.int32)
    faces = np.arange(len(mesh.faces), dtype=np.int32)
    return Arrangement(Mesh(mesh.vertices.copy(), mesh.faces.copy()), vertices, vertices, faces)


def by_locality(mesh: Mesh) -> Arrangement:
    """Vertices along a Z-order curve (Morton 1966), faces by their first vertices.

    So a run of faces is a compact piece of the surface, which fits a cache and has few edges in
    common with other runs.
    """
    n = len(mesh.vertices)
    low = mesh.vertices.min(axis=0)
    extent = float((mesh.vertices.max(axis=0) - low).max())
    scale = 2.0**BITS / extent if extent > 0.0 else 0.0
    keys = kernels.order.morton_keys(mesh.vertices, low, scale, 2**BITS - 1)
    keys.sort()
    vertex_origin = (keys & 0xFFFFFFFF).astype(np.int32)
    vertex_place = np.empty(n, np.int32)
    vertex_place[vertex_origin] = np.arange(n, dtype=np.int32)
    faces = vertex_place[mesh.faces]
    face_origin = kernels.order.sort_faces(faces, n)
    arranged = Mesh(mesh.vertices[vertex_origin], faces[face_origin])
    return Arrangement(arranged, vertex_origin, vertex_place, face_origin)
