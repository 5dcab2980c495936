"""The frontier of a surface that is not complete yet: rings around it, and fans at it."""

from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.jit import kernel_in_place


@kernel_in_place
def spread_rings(corner_vertex, ring, n_rings):
    """Number the rings of vertices around those of ring 0.

    Parameters
    ----------
    corner_vertex : int32 (3 m,)
    ring : int8 (n,), in and out
        0 at some vertices, and larger than `n_rings` at all others; then the number of edges to the
        nearest of them where that is not more than `n_rings`.
    """
    for k in range(n_rings):
        for f in range(corner_vertex.size // 3):
            a, b, c = corner_vertex[3 * f], corner_vertex[3 * f + 1], corner_vertex[3 * f + 2]
            if ring[a] == k or ring[b] == k or ring[c] == k:
                ring[a] = min(ring[a], k + 1)
                ring[b] = min(ring[b], k + 1)
                ring[c] = min(ring[c], k + 1)


@kernel_in_place
def split_fans(vertices, first_corner, next_corner, corner_vertex, fan, corners, origin, n_used):
    """Give every fan of faces but the first one at some vertices a vertex of its own.

    Parameters
    ----------
    vertices : int32 (k,)
        The vertices to look at.
    first_corner, next_corner : int32
        See :mod:`tetsimplify.kernels.corners`.
    corner_vertex : int32 (3 m,), in and out
    fan, corners : int32 (longest,)
        Scratch space for the corners of a vertex.
    origin : int32, out
        The vertex that each new one is a copy of; room for a copy for every corner.
    n_used : int
        The number of the first copy.

    Returns
    -------
    int
        Number of copies.
    """
    n_copies = 0
    for v in vertices:
        n = 0
        corner = first_corner[v]
        while corner >= 0 and (n == 0 or corner != first_corner[v]):
            corners[n] = corner
            fan[n] = n
            n += 1
            corner = next_corner[corner]
        for i in range(n):  # faces that share an edge at v, one after the other around it
            after = corner_vertex[behind(corners[i])]
            for j in range(n):
                if corner_vertex[ahead(corners[j])] == after and fan[i] != fan[j]:
                    low, high = min(fan[i], fan[j]), max(fan[i], fan[j])
                    for k in range(n):
                        if fan[k] == high:
                            fan[k] = low
        for i in range(1, n):
            if fan[i] == i:
                origin[n_copies] = v
                for k in range(i, n):
                    if fan[k] == i:
                        corner_vertex[corners[k]] = n_used + n_copies
                n_copies += 1
    return n_copies
