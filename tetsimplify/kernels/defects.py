"""What is wrong at the irregular vertices of a triangle set."""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.jit import kernel, part
from tetsimplify.kernels.sets import find, unite
from tetsimplify.kernels.surface import join_loop, link_arcs


class Defects(NamedTuple):
    """What :func:`inspect` finds; only the first so many rows of the arrays are filled."""

    n_edges: int  # all edges whose lower vertex is irregular
    n_boundary_edges: int  # those of degree 1
    n_non_manifold_edges: int
    n_inconsistent_edges: int
    n_non_manifold_vertices: int
    n_duplicate_faces: int
    non_manifold_edges: np.ndarray  # (size, 3): two vertices, degree
    inconsistent_edges: np.ndarray  # (size, 2)
    non_manifold_vertices: np.ndarray  # (size,)
    duplicate_faces: np.ndarray  # (size,)


def none():
    """Of a surface without irregular vertices; not compiled."""
    edges, vertices = np.empty((0, 3), np.int32), np.empty(0, np.int32)
    return Defects(0, 0, 0, 0, 0, 0, edges, edges[:, :2], vertices, vertices)


class LinkGraph(NamedTuple):
    """The link of one vertex as a graph: sparse set of neighbours, and fans of faces."""

    slot: np.ndarray  # (n_vertices,): where a vertex stands in `vertex`
    vertex: np.ndarray  # neighbours
    leaving: np.ndarray  # arcs that leave each
    entering: np.ndarray  # arcs that enter each
    recent: np.ndarray  # the last arc met at each
    fan: np.ndarray  # (arcs,): disjoint sets of arcs that share a neighbour
    chained: np.ndarray  # (arcs,): next arc with the same lower neighbour


@part
def _build(link, tail, head, n_arcs):
    """Fill the graph from the arcs; return the number of neighbours."""
    k = 0
    for i in range(n_arcs):
        link.fan[i] = i
        for end in range(2):
            w = tail[i] if end == 0 else head[i]
            j = link.slot[w]
            if not (0 <= j < k and link.vertex[j] == w):
                j = k
                k += 1
                link.slot[w] = j
                link.vertex[j] = w
                link.leaving[j] = 0
                link.entering[j] = 0
                link.recent[j] = i
            unite(link.fan, i, link.recent[j])
            link.recent[j] = i
        link.leaving[link.slot[tail[i]]] += 1
        link.entering[link.slot[head[i]]] += 1
    return k


@part
def _twins(link, v, tail, head, corners, n_arcs, k, faces, n_faces):
    """List the faces that repeat an earlier face whose lowest vertex is v."""
    for j in range(k):
        link.recent[j] = -1
    for i in range(n_arcs):
        low, high = min(tail[i], head[i]), max(tail[i], head[i])
        if low < v:
            continue
        j = link.slot[low]
        other = link.recent[j]
        while other >= 0 and max(tail[other], head[other]) != high:
            other = link.chained[other]
        if other < 0:
            link.chained[i] = link.recent[j]
            link.recent[j] = i
            continue
        faces[n_faces] = max(corners[i], corners[other]) // 3
        n_faces += 1
        corners[other] = min(corners[i], corners[other])
    return n_faces


@kernel
def inspect(corner_vertex, found, irregular, longest_link):
    """Look closely at the vertices that the survey found irregular; see :class:`Defects`.

    The Euler characteristics and the boundary loops of `found` are completed in place.
    """
    first_corner, next_corner = found.first_corner, found.next_corner
    size = longest_link + 1
    tail, head = np.empty(size, np.int32), np.empty(size, np.int32)
    corners = np.empty(size, np.int32)
    n_total = 0
    for v in irregular:
        n_total += link_arcs(corner_vertex, next_corner, first_corner[v], tail, head, corners)[0]
    link = LinkGraph(
        np.zeros(first_corner.size, np.int32),
        np.empty(2 * size, np.int32),
        np.empty(2 * size, np.int32),
        np.empty(2 * size, np.int32),
        np.empty(2 * size, np.int32),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
    )
    edges = np.empty((2 * n_total, 3), np.int32)
    clashes = np.empty((2 * n_total, 2), np.int32)
    vertices = np.empty(irregular.size, np.int32)
    twins = np.empty(n_total, np.int32)
    n_edges = n_boundary = n_bad = n_clashes = n_vertices = n_twins = 0

    for v in irregular:
        n_arcs, _ = link_arcs(corner_vertex, next_corner, first_corner[v], tail, head, corners)
        k = _build(link, tail, head, n_arcs)
        n_edges_here = 0
        for j in range(k):
            w = link.vertex[j]
            degree = link.leaving[j] + link.entering[j]
            if w < v:
                continue
            n_edges_here += 1
            if degree == 1:
                n_boundary += join_loop(found.loop, v, w)
            elif degree > 2:
                edges[n_bad, 0], edges[n_bad, 1], edges[n_bad, 2] = v, w, degree
                n_bad += 1
            elif link.leaving[j] != 1:
                clashes[n_clashes, 0], clashes[n_clashes, 1] = v, w
                n_clashes += 1
        n_edges += n_edges_here
        found.euler[find(found.component, v)] -= n_edges_here

        n_fans = 0
        for i in range(n_arcs):
            n_fans += link.fan[i] == i
        if n_fans > 1:
            vertices[n_vertices] = v
            n_vertices += 1
        n_twins = _twins(link, v, tail, head, corners, n_arcs, k, twins, n_twins)

    return Defects(
        n_edges,
        n_boundary,
        n_bad,
        n_clashes,
        n_vertices,
        n_twins,
        edges,
        clashes,
        vertices,
        twins,
    )
