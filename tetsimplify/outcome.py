"""What is left of a surface in the end, numbered in the order given."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew, part_size
from tetsimplify.locality import Arrangement
from tetsimplify.mesh import Mesh

if TYPE_CHECKING:
    from tetsimplify.kernels.quadrics import Quadrics
    from tetsimplify.kernels.state import Surface

Indices = NDArray[np.int32]


class Outcome(NamedTuple):
    """The live part of a surface, renumbered."""

    mesh: Mesh
    vertex_map: Indices
    """Shape (n,): the number of what each vertex given was merged into, -1 where that is gone."""
    face_map: Indices
    """Shape (m,): the number that each face was given."""
    number: Indices
    """Shape (n,): the number of each vertex of the surface, -1 where it is gone."""


def collect(surface: Surface, arranged: Arrangement, face_origin: Indices, crew: Crew) -> Outcome:
    """Collect vertices and faces, and what became of all others.

    Parameters
    ----------
    surface : Surface
        Without dead faces. Its faces may be renumbered.
    arranged : Arrangement
        The order of the surface.
    face_origin : ndarray, shape (m,), int32
        Number of each face in the mesh given.
    crew : Crew
    """
    number, n_used = _new_numbers(surface, arranged, crew)
    faces, face_map = _faces_given(surface, arranged, face_origin, crew)
    vertices = np.empty((n_used, 3))
    vertex_map = np.empty(len(number), np.int32)

    def copy(part: slice) -> None:
        kernels.result.copy_vertices(surface.vertices, number, part.start, part.stop, vertices)
        kernels.result.follow_merges(
            surface.merged_into, number, arranged.vertex_place[part], vertex_map[part]
        )

    def renumber(part: slice) -> None:
        kernels.result.renumber_corners(number, faces[part].reshape(-1))

    crew.share(copy, len(number), part_size(len(number)))
    crew.share(renumber, len(faces), part_size(len(faces)))
    return Outcome(Mesh(vertices, faces), vertex_map, face_map, number)


def _new_numbers(surface: Surface, arranged: Arrangement, crew: Crew) -> tuple[Indices, int]:
    """The number of each vertex, -1 where it is gone, and how many are left."""
    visit = arranged.vertex_place
    n = len(visit)
    is_used, number = memory.full(n, 0, np.uint8), memory.empty(n, np.int32)

    def mark(part: slice) -> None:
        corners = surface.corner_vertex[3 * part.start : 3 * part.stop]
        kernels.result.mark_vertices(corners, is_used)

    def count(part: slice) -> int:
        return int(np.count_nonzero(is_used[visit[part]]))

    def give(part: slice) -> None:
        kernels.result.number_vertices(visit[part], is_used, begin[part.start // at_once], number)

    n_faces, at_once = len(surface.face_state), part_size(n)
    crew.share(mark, n_faces, part_size(n_faces))
    begin = np.cumsum([0, *crew.share(count, n, at_once)])
    crew.share(give, n, at_once)
    return number, int(begin[-1])


def _faces_given(
    surface: Surface, arranged: Arrangement, face_origin: Indices, crew: Crew
) -> tuple[Indices, Indices]:
    """The faces in the order in which they were given, and their numbers there."""
    if arranged.is_as_given:
        return surface.corner_vertex.reshape(-1, 3), face_origin
    n, m = len(face_origin), len(arranged.face_origin)
    place = memory.empty(m, np.int32)
    faces, face_map = np.empty((n, 3), np.int32), np.empty(n, np.int32)

    def clear(part: slice) -> None:
        place[part] = -1

    def note(part: slice) -> None:
        kernels.result.note_places(face_origin, part.start, part.stop, place)

    def count(part: slice) -> int:
        return int(np.count_nonzero(place[part] >= 0))

    def copy(part: slice) -> None:
        first = begin[part.start // at_once]
        kernels.result.copy_in_order(
            surface.corner_vertex, place[part], part.start, first, faces, face_map
        )

    at_once = part_size(m)
    crew.share(clear, m, at_once)
    crew.share(note, n, part_size(n))
    begin = np.cumsum([0, *crew.share(count, m, at_once)])
    crew.share(copy, m, at_once)
    return faces, face_map


def vertex_errors(
    quadrics: Quadrics, number: Indices, n_used: int, crew: Crew
) -> NDArray[np.float64]:
    """The quadric errors of the vertices that are left, as distances, in their new order."""
    errors = np.empty(n_used)

    def find(part: slice) -> None:
        kernels.quadrics.vertex_errors(quadrics, number, part.start, part.stop, errors)

    crew.share(find, len(number), part_size(len(number)))
    return errors
