"""Self-intersections: which faces of a mesh cross one another."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.errors import MeshError

SMALLEST, LARGEST = 1e-75, 1e75  # sizes of coordinates that predicates are exact for
LEAST_ROOM = 2**16  # pairs found in one call of the kernel, or as many as there are faces


@dataclass(frozen=True, eq=False)
class IntersectionReport:
    """What :func:`self_intersections` finds."""

    n_pairs: int
    """Pairs of faces that cross."""
    n_faces: int
    """Faces that cross another."""
    pairs: NDArray[np.int32] = field(repr=False)
    """Shape (n_pairs, 2): faces that cross, the lower index first, sorted."""
    faces: NDArray[np.int32] = field(repr=False)
    """Shape (n_faces,): all faces that cross another, sorted."""

    @property
    def is_embedded(self) -> bool:
        """Whether no two faces cross."""
        return self.n_pairs == 0


def self_intersections(vertices: ArrayLike, faces: ArrayLike) -> IntersectionReport:
    """Find all pairs of faces that cross.

    Two faces cross when they meet elsewhere than in the vertex or the edge that they share. Faces
    that touch cross, and so do faces with the same three vertices. What faces share is told by
    vertex indices, not by positions. All answers are exact: there is no tolerance.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions, finite and at most 1e75 in size. Coordinates below 1e-75 count as 0.
    faces : array_like, shape (m, 3), integers
        Vertex indices. Faces without area are the segments or points that they look like.

    Returns
    -------
    IntersectionReport
        `pairs`, `faces`, their numbers, and `is_embedded`.

    Raises
    ------
    MeshError
        When the arrays are not a mesh at all, or a position is too large.

    References
    ----------
    J. R. Shewchuk. Adaptive precision floating-point arithmetic and fast robust geometric
    predicates. Discrete & Computational Geometry 18, 1997, 305-363, doi:10.1007/PL00009321.

    Examples
    --------
    A triangle that goes through another one:

    >>> from tetsimplify.intersections import self_intersections
    >>> vertices = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -1], [1, 1, 1], [3, 3, 1]]
    >>> self_intersections(vertices, [[0, 1, 2], [3, 4, 5]]).pairs.tolist()
    [[0, 1]]
    """
    mesh = as_mesh(vertices, faces)
    positions = _within_range(mesh.vertices)
    watch = kernels.intersections.watch_over(positions, mesh.faces)
    room = np.empty((max(len(mesh.faces), LEAST_ROOM), 2), np.int32)
    found = [room[:0]]
    slot = 0
    while slot < len(mesh.faces):
        slot, n_pairs = kernels.intersections.crossing_pairs(
            watch, positions, mesh.faces, slot, room
        )
        found.append(room[:n_pairs].copy())
    pairs = np.concatenate(found)
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    crossing = np.unique(pairs)
    return IntersectionReport(len(pairs), len(crossing), pairs, crossing)


def _within_range(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positions that predicates are exact for."""
    sizes = np.abs(vertices)
    if sizes.max(initial=0.0) > LARGEST:
        raise MeshError(f"vertices must be at most {LARGEST:g} in size, got {sizes.max():g}")
    is_tiny = (sizes < SMALLEST) & (sizes > 0.0)
    return np.where(is_tiny, 0.0, vertices) if is_tiny.any() else vertices
