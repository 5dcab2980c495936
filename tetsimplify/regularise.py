"""Regularised marching tetrahedra: vertices near the same lattice point become one.

After Treece, Prager and Gee (1999). Every vertex lies on a lattice edge, and is nearer to one end.
Those nearest to the same lattice point, where they are connected, form a *cluster*, which is
contracted to its mean. That is done only where the topology stays: theirs is a test of the lattice
edges around the point; here the surface itself is looked at, which is exact for any lattice.

A set of clusters can be contracted all at once when

1. what lies within each cluster is contractible: connected, with Euler characteristic 1, and on a
   boundary it is one path along it;
2. every edge of what comes out has two faces, or one face and is on the boundary once.

Contracting 1 alone leaves a surface of the same topology, with faces of two and of one edge; faces
of two edges between the same two clusters lie side by side, and closing them is harmless if they
all do: that is what 2 tells.

Where a face would turn too far its clusters fail too: a mean of vertices on several sides of a thin
place can lie beyond a neighbour, and the surface would fold over. Clusters that fail are left as
they were, and the rest is looked at anew.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.errors import OptionError
from tetsimplify.march import March
from tetsimplify.mesh import NORMALS
from tetsimplify.tables import Tables

Indices = NDArray[np.int32]

ON_BOUNDARY = 2**32  # counts as so many faces, more than there are
DEFAULT_FOLDOVER = 90.0
NO_GUARD = -2.0  # less than any cosine


def as_foldover(degrees: Any) -> float:
    """The cosine of the largest turn of a face, :data:`NO_GUARD` for None.

    Raises
    ------
    OptionError
        When it is neither an angle above 0 and up to 180 degrees nor None.
    """
    if degrees is None:
        return NO_GUARD
    is_number = isinstance(degrees, int | float) and not isinstance(degrees, bool)
    if not is_number or not 0.0 < degrees <= 180.0:
        raise OptionError(f"foldover must be above 0 and up to 180, or None, got {degrees!r}")
    return math.cos(math.radians(degrees))


def regular(
    faces: Indices,
    rows: dict[str, NDArray[np.float64]],
    march: March,
    cos_foldover: float = NO_GUARD,
) -> tuple[Indices, dict[str, NDArray[np.float64]]]:
    """Make a surface regular.

    Parameters
    ----------
    faces : ndarray, shape (m, 3), int32
    rows : dict of str to ndarray, shape (n, ...)
        Positions and data of the vertices.
    march : March
        That made the surface, and kept the lattice edges of its vertices.
    cos_foldover : float
        Cosine of the largest turn of a face.

    Returns
    -------
    faces, rows
        What is left, in the same order.
    """
    edges, ratios = march.edges.rows, march.ratios.rows
    guard = Guard(faces, rows[""], cos_foldover)
    cluster = clusters_of(faces, edges, ratios, march.tables, march.shape, guard)
    faces, rows = contracted(faces, cluster, rows)
    if NORMALS in rows:
        lengths = np.linalg.norm(rows[NORMALS], axis=1, keepdims=True)
        rows[NORMALS] = np.divide(rows[NORMALS], lengths, where=lengths > 0, out=rows[NORMALS])
    return faces, rows


def clusters_of(
    faces: Indices,
    edges: NDArray[np.int64],
    ratios: NDArray[np.float64],
    tables: Tables,
    shape: tuple[int, int, int],
    guard: Guard,
) -> Indices:
    """Which vertices of an isosurface are to become one.

    Parameters
    ----------
    faces : ndarray, shape (m, 3), int32
    edges, ratios : ndarray, shape (n,)
        The lattice edge of every vertex, and where it is on it.
    tables : Tables
    shape : three ints
        Of the volume.
    guard : Guard
        Against folds.

    Returns
    -------
    ndarray, shape (n,), int32
        The first vertex of the cluster of each.
    """
    keys = np.empty(len(edges), np.int64)
    kernels.clusters.nearest_points(edges, ratios, tables, np.array(shape), keys)
    on_side = keys % 64 != 0
    boundary = _boundary_edges(faces, on_side)
    cluster = np.empty(len(edges), np.int32)
    kernels.clusters.join_neighbours(faces, keys, cluster)

    characteristic, n_ends = np.empty_like(cluster), np.empty_like(cluster)
    kernels.clusters.tally(faces, boundary, cluster, characteristic, n_ends)
    is_on_boundary = np.zeros(len(edges), np.bool_)
    is_on_boundary[boundary] = True
    is_bad = (characteristic != 1) | (is_on_boundary & (n_ends != 1))
    piece = _pieces(faces, len(edges))
    while True:
        cluster = np.where(is_bad[cluster], np.arange(len(cluster), dtype=np.int32), cluster)
        is_bad = _is_bad(cluster[faces], cluster[boundary], piece) | guard.is_bad(cluster)
        if not is_bad.any():
            return cluster


class Guard:
    """Tells the clusters around which faces would turn too far.

    Parameters
    ----------
    faces : ndarray, shape (m, 3), int32
    vertices : ndarray, shape (n, 3), float64
    cos_foldover : float
        Cosine of the largest turn of a face.
    """

    def __init__(self, faces: Indices, vertices: NDArray[np.float64], cos_foldover: float) -> None:
        self._faces, self._vertices, self._cosine = faces, vertices, cos_foldover

    def is_bad(self, cluster: Indices) -> NDArray[np.bool_]:
        """Which clusters must not be contracted; shape (n,)."""
        is_bad = np.zeros(len(cluster), np.bool_)
        if self._cosine == NO_GUARD or not len(self._faces):
            return is_bad
        is_large = np.bincount(cluster, minlength=len(cluster)) > 1
        mapped = cluster[self._faces]
        a, b, c = mapped.T
        moves = is_large[mapped].any(axis=1) & (a != b) & (b != c) & (c != a)
        left = self._faces[moves]
        means = _means(self._vertices, cluster)
        before, after = _normals(self._vertices, left), _normals(means, mapped[moves])
        # in the order of magnitude of lengths, since that of areas may underflow when squared
        lengths = np.sqrt((before**2).sum(axis=1)) * np.sqrt((after**2).sum(axis=1))
        turned = (before * after).sum(axis=1) < self._cosine * lengths
        # of what has no area any more there is no telling where it looks
        turned |= lengths == 0.0
        wrong = mapped[moves][turned].ravel()
        is_bad[wrong[is_large[wrong]]] = True
        return is_bad


def _normals(points: NDArray[np.float64], faces: Indices) -> NDArray[np.float64]:
    """Normals of faces, as long as twice their areas."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _means(values: NDArray[np.float64], cluster: Indices) -> NDArray[np.float64]:
    """The mean of each cluster, in the row of its first vertex."""
    n = len(cluster)
    counts = np.maximum(np.bincount(cluster, minlength=n), 1)
    means = values.copy()
    # from the first one on, so that what is equal stays so to the last bit
    for column, target in zip(_columns(values - values[cluster]), _columns(means), strict=True):
        target += np.bincount(cluster, column, n) / counts
    return means


def contracted(
    faces: Indices, cluster: Indices, rows: dict[str, NDArray[np.float64]]
) -> tuple[Indices, dict[str, NDArray[np.float64]]]:
    """Contract clusters of vertices to their means.

    Parameters
    ----------
    faces : ndarray, shape (m, 3), int32
    cluster : ndarray, shape (n,), int32
        The first vertex of the cluster of each vertex.
    rows : dict of str to ndarray, shape (n, ...)
        Positions and data of the vertices.

    Returns
    -------
    faces, rows
        What is left, in the same order.
    """
    is_first = cluster == np.arange(len(cluster))
    number = (np.cumsum(is_first) - 1).astype(np.int32)[cluster]
    means = {name: _means(values, cluster)[is_first] for name, values in rows.items()}
    mapped = number[faces]
    a, b, c = mapped.T
    return np.ascontiguousarray(mapped[(a != b) & (b != c) & (c != a)]), means


def _columns(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A view of an array of numbers or of rows, column by column."""
    return values.T if values.ndim > 1 else values[None]


def _boundary_edges(faces: Indices, on_side: NDArray[np.bool_]) -> Indices:
    """The edges of one face, which lie in the sides of the volume."""
    candidates = faces[on_side[faces].sum(axis=1) >= 2]
    directed = np.concatenate([candidates[:, [k, (k + 1) % 3]] for k in range(3)])
    directed = directed[on_side[directed].all(axis=1)]
    codes = _codes(directed)
    _, first, counts = np.unique(codes, return_index=True, return_counts=True)
    return np.ascontiguousarray(directed[first[counts == 1]])


def _codes(pairs: Indices) -> NDArray[np.int64]:
    """One number for each pair of vertices, the same both ways."""
    low, high = pairs.min(axis=1).astype(np.int64), pairs.max(axis=1).astype(np.int64)
    return low << 32 | high


def _pieces(faces: Indices, n_vertices: int) -> Indices:
    """The first vertex of the connected component of each vertex."""
    piece = np.empty(n_vertices, np.int32)
    kernels.clusters.join_neighbours(faces, np.zeros(n_vertices, np.int64), piece)
    return piece


def _is_bad(faces: Indices, boundary: Indices, piece: Indices) -> NDArray[np.bool_]:
    """Which clusters must not be contracted, given the faces with clusters as corners."""
    is_bad = np.zeros(len(piece), np.bool_)
    a, b, c = faces.T
    left = faces[(a != b) & (b != c) & (c != a)]
    ends = boundary[boundary[:, 0] != boundary[:, 1]]
    pairs = np.concatenate([left[:, [0, 1]], left[:, [1, 2]], left[:, [2, 0]], ends])
    weights = np.ones(len(pairs), np.int64)
    weights[3 * len(left) :] = ON_BOUNDARY
    codes = _codes(pairs)
    order = np.argsort(codes, kind="stable")
    begins = np.flatnonzero(np.diff(codes[order], prepend=-1))
    totals = np.add.reduceat(weights[order], begins) if len(order) else weights
    wrong = (totals != 2) & (totals != 1 + ON_BOUNDARY)
    is_bad[pairs[order[begins[wrong]]].ravel()] = True

    # what has become a single face twice, or nothing at all, must stay as it was
    n_left = np.bincount(piece[left[:, 0]], minlength=len(piece))
    is_open = np.zeros(len(piece), np.bool_)
    is_open[piece[boundary]] = True
    is_lost = n_left < np.where(is_open, 1, 4)
    return is_bad | is_lost[piece]
