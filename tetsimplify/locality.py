"""The order in which an engine works on a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.crew import Crew
from tetsimplify.mesh import Mesh


class Arrangement(NamedTuple):
    """A mesh whose vertices and faces are in an order of their own."""

    mesh: Mesh
    vertex_origin: NDArray[np.int32]
    """Shape (n,): number of each vertex in the mesh given."""
    vertex_place: NDArray[np.int32]
    """Shape (n,): the inverse."""
    face_origin: NDArray[np.int32]
    """Shape (m,): number of each face in the mesh given."""

    @property
    def is_as_given(self) -> bool:
        """Whether the order is that of the mesh given."""
        return self.vertex_origin is self.vertex_place


def as_given(mesh: Mesh) -> Arrangement:
    """The order of the mesh itself; its arrays are copied."""
    vertices = np.arange(len(mesh.vertices), dtype=np.int32)
    faces = np.arange(len(mesh.faces), dtype=np.int32)
    return Arrangement(Mesh(mesh.vertices.copy(), mesh.faces.copy()), vertices, vertices, faces)


def by_locality(mesh: Mesh, crew: Crew) -> Arrangement:
    """Vertices along a Z-order curve (Morton 1966), faces by their first vertices.

    So a run of faces is a compact piece of the surface, which fits a cache and has few edges in
    common with other runs.
    """
    low, high = kernels.order.bounds(mesh.vertices)
    extent = float((high - low).max())
    scale = kernels.order.N_CELLS / extent if extent > 0.0 else 0.0
    vertex_origin = kernels.order.sort_vertices(mesh.vertices, low, scale)
    vertex_place = np.empty_like(vertex_origin)
    vertex_place[vertex_origin] = np.arange(len(vertex_origin), dtype=np.int32)

    def sort_faces() -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        face_origin, faces = kernels.order.sort_faces(mesh.faces, vertex_place)
        return face_origin, faces

    def copy_vertices() -> NDArray[np.float64]:
        return mesh.vertices.take(vertex_origin, axis=0)

    (face_origin, faces), vertices = crew.do_both(sort_faces, copy_vertices)
    return Arrangement(Mesh(vertices, faces), vertex_origin, vertex_place, face_origin)
