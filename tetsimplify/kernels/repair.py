"""Repair: orient faces consistently, and give every fan of faces its own vertex.

Faces are glued along half-edges: half-edge h = 3 f + k runs from corner h to the next corner of
its face; ``twin[h]`` is the half-edge glued to it, -1 where there is none.
"""

import numpy as np

from tetsimplify.kernels.corners import ahead
from tetsimplify.kernels.jit import kernel
from tetsimplify.kernels.sets import unite


@kernel
def orient(corner_vertex, twin):
    """Find the faces to flip so that glued faces agree; unglue where that cannot be.

    The majority of each component keeps its orientation.

    Returns
    -------
    flip : uint8 (m,)
    n_unglued : int
        Number of edges whose faces cannot agree; their twins are cleared.
    """
    n_faces = corner_vertex.size // 3
    flip = np.empty(n_faces, np.uint8)
    unseen = 2
    for f in range(n_faces):
        flip[f] = unseen
    queue = np.empty(n_faces, np.int32)
    n_unglued = 0
    for seed in range(n_faces):
        if flip[seed] != unseen:
            continue
        flip[seed] = 0
        queue[0] = seed
        size = 1
        at = 0
        n_flipped = 0
        while at < size:
            f = queue[at]
            at += 1
            n_flipped += flip[f]
            for h in range(3 * f, 3 * f + 3):
                t = twin[h]
                if t < 0:
                    continue
                g = t // 3
                same_direction = corner_vertex[h] == corner_vertex[t]
                wanted = flip[f] ^ same_direction
                if flip[g] == unseen:
                    flip[g] = wanted
                    queue[size] = g
                    size += 1
                elif flip[g] != wanted:
                    twin[h] = -1
                    twin[t] = -1
                    n_unglued += 1
        if 2 * n_flipped > size:
            for i in range(size):
                flip[queue[i]] ^= 1
    return flip, n_unglued


@kernel
def corner_classes(corner_vertex, twin):
    """Unite the corners of a vertex that glued faces share.

    Returns
    -------
    int32 (3 m,)
        The lowest corner of the class of each corner.
    """
    parent = np.empty(corner_vertex.size, np.int32)
    for c in range(corner_vertex.size):
        parent[c] = c
    for h in range(twin.size):
        t = twin[h]
        if t < h:
            continue
        a, b = h, ahead(h)
        c, d = t, ahead(t)
        if corner_vertex[a] != corner_vertex[c]:
            c, d = d, c
        unite(parent, a, c)
        unite(parent, b, d)
    for c in range(parent.size):  # parents are lower, so they are done before
        parent[c] = parent[parent[c]]
    return parent
