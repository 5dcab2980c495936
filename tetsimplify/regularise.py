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
all do: that is what 2 tells. Clusters that fail are left as they were, and the rest looked at anew.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tetsimplify import kernels
from tetsimplify.march import March
from tetsimplify.tables import Tables
from tetsimplify.vertex_data import NORMALS

Indices = NDArray[np.int32]

ON_BOUNDARY = 2**32  # counts as so many faces, more than there are


def regular(
    faces: Indices, rows: dict[str, NDArray[np.float64]], march: March
) -> tuple[Indices, dict[str, NDArray[np.float64]]]:
    """Make a surface regular.

    Parameters
    ----------
    faces : ndarray, shape (m, 3), int32
    rows : dict of str to ndarray, shape (n, ...)
        Positions and data of the vertices.
    march : March
        That made the surface, and kept the lattice edges of its vertices.

    Returns
    -------
    faces, rows
        What is left, in the same order.
    """
    edges, ratios = march.edges.rows, march.ratios.rows
    cluster = clusters_of(faces, edges, ratios, march.tables, march.shape)
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
        is_bad = _is_bad(cluster[faces], cluster[boundary], piece)
        if not is_bad.any():
            return cluster


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
    n = int(is_first.sum())
    counts = np.bincount(number, minlength=n)
    means = {}
    for name, values in rows.items():
        mean = values[is_first]
        # from the first one on, so that what is equal stays so to the last bit
        for column, target in zip(_columns(values - values[cluster]), _columns(mean), strict=True):
            target += np.bincount(number, column, n) / counts
        means[name] = mean
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
