"""Make a consistently oriented 2-manifold of any set of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tetsimplify import kernels
from tetsimplify.arrays import as_mesh
from tetsimplify.report import Repaired, RepairReport
from tetsimplify.topology import TopologyReport, topology

Indices = NDArray[np.int32]


def repair(vertices: ArrayLike, faces: ArrayLike) -> Repaired:
    """Make a consistently oriented 2-manifold of any set of triangles.

    Degenerate and duplicate faces and unreferenced vertices are dropped. Edges of more than two
    faces are taken apart, so are edges whose faces cannot be oriented alike (a Moebius strip is
    cut open); then every vertex gets a copy for each of its fans of faces. No vertex moves. Faces
    that agree with the majority of their component are not flipped.

    Parameters
    ----------
    vertices : array_like, shape (n, 3)
        Positions, finite.
    faces : array_like, shape (m, 3), integers
        Vertex indices.

    Returns
    -------
    Repaired
        `vertices`, `faces`, `vertex_map` (old to new), `face_map` (new to old), `report`.

    Raises
    ------
    MeshError
        When the arrays are not a mesh at all.

    References
    ----------
    A. Gueziec, G. Taubin, F. Lazarus and W. Horn. Cutting and stitching: converting sets of
    polygons to manifold surfaces. IEEE Trans. Visualization and Computer Graphics 7(2), 2001,
    136-151, doi:10.1109/2945.928166.

    Examples
    --------
    Two triangles that touch in one vertex come apart:

    >>> import numpy as np
    >>> import tetsimplify
    >>> repaired = tetsimplify.repair(np.eye(5, 3), [[0, 1, 2], [0, 3, 4]])
    >>> repaired.report.vertices_split, len(repaired.vertices)
    (1, 6)
    """
    mesh = as_mesh(vertices, faces)
    kept, n_degenerate, n_duplicate = _distinct_faces(mesh.faces)
    corner_vertex = mesh.faces[kept].reshape(-1)

    loose = np.zeros(len(kept), np.bool_)  # faces that are glued to no other
    n_split = 0
    while True:
        twin, n_crowded = _glue(corner_vertex, loose)
        flip, n_unglued = kernels.repair.orient(corner_vertex, twin)
        classes = kernels.repair.corner_classes(corner_vertex, twin)
        corner_of_vertex, number = _numbered(corner_vertex, classes)
        new_faces = number[classes].reshape(-1, 3)
        new_faces[flip == 1] = new_faces[flip == 1][:, ::-1]
        new_vertices = mesh.vertices[corner_vertex[corner_of_vertex]]
        n_split = max(n_split, n_crowded + n_unglued)
        offenders = _offending_faces(topology(new_vertices, new_faces), new_faces)
        if not offenders.any():
            break
        loose |= offenders

    old_vertex = corner_vertex[corner_of_vertex]
    vertex_map = np.full(len(mesh.vertices), -1, np.int32)
    vertex_map[old_vertex[::-1]] = np.arange(len(old_vertex), dtype=np.int32)[::-1]
    n_copies = np.bincount(old_vertex, minlength=len(mesh.vertices))
    report = RepairReport(
        degenerate_faces_dropped=n_degenerate,
        duplicate_faces_dropped=n_duplicate,
        unreferenced_vertices_dropped=int((n_copies == 0).sum()),
        edges_split=n_split,
        vertices_split=int((n_copies > 1).sum()),
        vertices_added=int(np.maximum(n_copies - 1, 0).sum()),
        faces_flipped=int((flip == 1).sum()),
    )
    return Repaired(new_vertices, new_faces, vertex_map, kept, old_vertex, report)


def _distinct_faces(faces: Indices) -> tuple[Indices, int, int]:
    """Faces with three vertices that are not the three of an earlier face."""
    a, b, c = faces.T
    proper = np.flatnonzero((a != b) & (b != c) & (c != a))
    _, first = np.unique(np.sort(faces[proper], axis=1), axis=0, return_index=True)
    kept = proper[np.sort(first)].astype(np.int32)
    return kept, len(faces) - len(proper), len(proper) - len(kept)


def _glue(corner_vertex: Indices, loose: NDArray[np.bool_]) -> tuple[Indices, int]:
    """Glue the two half-edges of every edge that has exactly two.

    Returns
    -------
    twin : ndarray, shape (3 m,), int32
    n_crowded : int
        Number of edges with more.
    """
    corners = np.arange(len(corner_vertex))
    ends = corner_vertex[np.where(corners % 3 == 2, corners - 2, corners + 1)]
    low, high = np.minimum(corner_vertex, ends), np.maximum(corner_vertex, ends)
    key = low.astype(np.int64) << 32 | high
    key[np.repeat(loose, 3)] = -1 - np.arange(3 * loose.sum())  # alike to no other
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order], prepend=np.iinfo(np.int64).min))
    sizes = np.diff(starts, append=len(order))
    first = starts[sizes == 2]
    twin = np.full(len(corner_vertex), -1, np.int32)
    twin[order[first]] = order[first + 1]
    twin[order[first + 1]] = order[first]
    return twin, int((sizes > 2).sum())


def _numbered(corner_vertex: Indices, classes: Indices) -> tuple[Indices, Indices]:
    """Number the classes of corners by their old vertices, then by their lowest corners.

    Returns
    -------
    corner_of_vertex : ndarray, int32
        The lowest corner of each new vertex.
    number : ndarray, int32
        New vertex of each lowest corner.
    """
    lowest = np.flatnonzero(classes == np.arange(len(classes)))
    corner_of_vertex = lowest[np.argsort(corner_vertex[lowest], kind="stable")].astype(np.int32)
    number = np.empty(len(classes), np.int32)
    number[corner_of_vertex] = np.arange(len(corner_of_vertex))
    return corner_of_vertex, number


def _offending_faces(report: TopologyReport, faces: Indices) -> NDArray[np.bool_]:
    """Faces of the edges and vertices that still are irregular.

    Copies of a vertex that fans around an unglued edge share can bring its faces together again.
    """
    offending = np.zeros(len(faces), np.bool_)
    if report.is_manifold:
        return offending
    offending[report.duplicate_faces] = True
    offending |= np.isin(faces, report.non_manifold_vertices).any(axis=1)
    for edge in np.concatenate([report.non_manifold_edges, report.inconsistent_edges]):
        offending |= np.isin(faces, edge).sum(axis=1) == 2
    return offending
