"""The order in which an engine works on a mesh."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels, memory
from tetsimplify.crew import Crew, part_size
from tetsimplify.mesh import Mesh

IN_ORDER = np.empty(0, np.int32)  # a list of numbers that are all there in order
GROUP_BITS, LEAST_GROUP = 17, 3  # faces are sorted by groups of their first vertices: 2**17 groups
# at most, of 2**3 vertices or more


class Arrangement(NamedTuple):
    """A mesh whose vertices and faces are in an order of their own."""

    vertices: NDArray[np.float64]
    """Shape (n, 3), or (n, 8): a line of a cache for each, which begins with the position."""
    faces: NDArray[np.int32]
    """Shape (m, 3)."""
    vertex_origin: NDArray[np.int32]
    """Shape (n,): number of each vertex in the mesh given."""
    vertex_place: NDArray[np.int32]
    """Shape (n,): the inverse."""
    face_origin: NDArray[np.int32]
    """Shape (m,): number of each face in the mesh given; IN_ORDER where it is the same."""
    box: NDArray[np.float64] | None = None
    """Shape (2, 3): the least and the largest coordinates, where they are known."""

    @property
    def is_as_given(self) -> bool:
        """Whether the order is that of the mesh given."""
        return self.vertex_origin is self.vertex_place


def as_given(mesh: Mesh, crew: Crew, *, in_lines: bool = False) -> Arrangement:
    """The order of the mesh itself; its arrays are copied, its vertices to lines of a cache."""
    n, m = len(mesh.vertices), len(mesh.faces)
    vertices, faces = _room(n, in_lines), memory.empty((m, 3), np.int32)
    numbers = memory.empty(n, np.int32)

    def copy_vertices(part: slice) -> None:
        vertices[part, :3] = mesh.vertices[part]
        numbers[part] = np.arange(part.start, part.stop)

    def copy_faces(part: slice) -> None:
        faces[part] = mesh.faces[part]

    crew.share(copy_vertices, n, part_size(n))
    crew.share(copy_faces, m, part_size(m))
    return Arrangement(vertices, faces, numbers, numbers, IN_ORDER)


def by_locality(mesh: Mesh, crew: Crew, *, in_lines: bool = False) -> Arrangement:
    """Vertices along a Z-order curve (Morton 1966), faces by their first vertices.

    So a run of faces is a compact piece of the surface, which fits a cache and has few edges in
    common with other runs.
    """
    n, m = len(mesh.vertices), len(mesh.faces)
    box = kernels.order.bounds(mesh.vertices)
    coded = _sorted_along_curve(mesh.vertices, box, crew)
    vertex_origin, vertex_place = memory.empty(n, np.int32), memory.empty(n, np.int32)
    face_origin = memory.empty(m, np.int32)
    vertices, faces = _room(n, in_lines), memory.empty((m, 3), np.int32)
    shift = max(LEAST_GROUP, n.bit_length() - GROUP_BITS)

    def number(part: slice) -> None:
        kernels.order.number_in_order(
            *(coded, mesh.vertices, part.start, part.stop),
            *(vertex_origin, vertex_place, vertices),
        )

    def count(part: slice, n_faces: NDArray[np.int32]) -> None:
        kernels.order.count_groups(mesh.faces, vertex_place, shift, part.start, part.stop, n_faces)

    def sort(part: slice, begin: NDArray[np.int32]) -> None:
        kernels.order.sort_by_group(
            *(mesh.faces, vertex_place, shift, part.start, part.stop),
            *(begin, face_origin, faces),
        )

    crew.share(number, n, part_size(n))
    _sort(count, sort, m, ((n - 1) >> shift) + 1, crew)
    return Arrangement(vertices, faces, vertex_origin, vertex_place, face_origin, box)


def _sorted_along_curve(
    vertices: NDArray[np.float64], box: NDArray[np.float64], crew: Crew
) -> NDArray[np.int64]:
    """Vertices along a Z-order curve, and in a cell by number; coded as of `find_codes`."""
    low, high = box
    extent = float((high - low).max())
    scale = kernels.order.N_CELLS / extent if extent > 0.0 else 0.0
    given, sorted_once = memory.empty((2, len(vertices)), np.int64)

    def find(part: slice) -> None:
        kernels.order.find_codes(vertices, low, scale, part.start, part.stop, given)

    crew.share(find, len(vertices), part_size(len(vertices)))
    _sort_by_digit(given, 0, sorted_once, crew)
    _sort_by_digit(sorted_once, kernels.order.DIGIT, given, crew)
    return given


def _sort_by_digit(coded: NDArray[np.int64], shift: int, to: NDArray[np.int64], crew: Crew) -> None:
    """Sort codes by a few of their bits."""

    def count(part: slice, n: NDArray[np.int32]) -> None:
        kernels.order.count_digits(coded, shift, part.start, part.stop, n)

    def sort(part: slice, begin: NDArray[np.int32]) -> None:
        kernels.order.sort_by_digit(coded, shift, part.start, part.stop, begin, to)

    _sort(count, sort, len(coded), 2**kernels.order.DIGIT, crew)


def _sort(
    count: Callable[[slice, NDArray[np.int32]], None],
    sort: Callable[[slice, NDArray[np.int32]], None],
    n_items: int,
    n_keys: int,
    crew: Crew,
) -> None:
    """Sort by counting, each thread a part: what has the same key stays in its order.

    Parameters
    ----------
    count : callable
        Counts how often each key occurs in a part.
    sort : callable
        Puts the items of a part where those of each key begin.
    n_items, n_keys : int
    crew : Crew
    """
    at_once = max(1, -(-n_items // crew.n_threads))
    n = np.zeros((crew.n_threads, n_keys), np.int32)
    crew.share(lambda part: count(part, n[part.start // at_once]), n_items, at_once)
    ends = np.cumsum(n.T, dtype=np.int32).reshape(n_keys, -1)  # by the key, then by the part
    begin = np.ascontiguousarray((ends - n.T).T)
    crew.share(lambda part: sort(part, begin[part.start // at_once]), n_items, at_once)


def _room(n_vertices: int, in_lines: bool) -> NDArray[np.float64]:
    """Room for positions."""
    return memory.cache_lines(n_vertices) if in_lines else memory.empty((n_vertices, 3))
