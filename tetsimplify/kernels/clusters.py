"""Clusters of the vertices of an isosurface around lattice points (Treece, Prager, Gee 1999)."""

import numpy as np

from tetsimplify.kernels.jit import kernel_in_place
from tetsimplify.kernels.marching import WORD
from tetsimplify.kernels.sets import find, unite


@kernel_in_place
def nearest_points(edges, ratios, tables, shape, keys):
    """Give each vertex the number of the nearer end of its lattice edge, and of its sides.

    Two vertices have the same key when they are near the same lattice point and lie in the same
    sides of the volume, if in any. The lowest six bits are these sides.

    Parameters
    ----------
    edges, ratios : int64 (n,), float64 (n,)
        See :class:`tetsimplify.kernels.marching.Output`.
    shape : int64 (3,)
        Of the volume.
    keys : int64 (n,), out
    """
    n1, n2 = shape[1], shape[2]
    for i in range(edges.size):
        site, slot = edges[i] // WORD, edges[i] % WORD
        near = tables.slot_ends[slot, 0 if ratios[i] <= 0.5 else 1]
        key = 0
        sides = 0
        for axis in range(3):
            index = site // (n1 * n2) if axis == 0 else site // n2 % n1 if axis == 1 else site % n2
            key = key * 2 * shape[axis] + 2 * index + np.int64(2.0 * tables.points[near, axis])
            a = index + tables.points[tables.slot_ends[slot, 0], axis]
            b = index + tables.points[tables.slot_ends[slot, 1], axis]
            sides |= np.int64(a == 0.0 and b == 0.0) << 2 * axis
            sides |= np.int64(a == shape[axis] - 1 and b == shape[axis] - 1) << 2 * axis + 1
        keys[i] = key * 64 + sides


@kernel_in_place
def join_neighbours(faces, keys, cluster):
    """Join vertices along edges whose ends have the same key.

    Parameters
    ----------
    cluster : int32 (n,), out
        The first vertex that each is joined with.
    """
    for v in range(cluster.size):
        cluster[v] = v
    for f in range(len(faces)):
        for k in range(3):
            v, u = faces[f, k], faces[f, (k + 1) % 3]
            if keys[v] == keys[u]:
                unite(cluster, v, u)
    for v in range(cluster.size):
        cluster[v] = find(cluster, v)


@kernel_in_place
def tally(faces, boundary, cluster, characteristic, n_ends):
    """Count what decides whether clusters can be contracted.

    Parameters
    ----------
    boundary : int32 (b, 2)
        Edges of one face.
    characteristic : int32 (n,), out
        For the first vertex of each cluster, the Euler characteristic of what lies within it.
    n_ends : int32 (n,), out
        For the first vertex of each cluster, its vertices less its boundary edges.
    """
    characteristic[:] = 0
    n_ends[:] = 0
    for v in range(cluster.size):
        characteristic[cluster[v]] += 2
        n_ends[cluster[v]] += 1
    for f in range(len(faces)):
        a, b, c = cluster[faces[f, 0]], cluster[faces[f, 1]], cluster[faces[f, 2]]
        characteristic[a] -= a == b  # half of an edge
        characteristic[b] -= b == c
        characteristic[c] -= c == a
        if a == b and b == c:
            characteristic[a] += 2
    for i in range(len(boundary)):
        a, b = cluster[boundary[i, 0]], cluster[boundary[i, 1]]
        if a == b:
            characteristic[a] -= 1
            n_ends[a] -= 1
    for v in range(cluster.size):
        characteristic[v] //= 2
