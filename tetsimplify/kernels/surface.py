r"""The topology of a triangle set, in one pass over its vertices.

At a vertex v every face gives an arc n -> p of the link of v:

        p = n'                 Regular: the arcs chain to one cycle (v is inside)
       /  \                            or to one path (v is on the boundary).
      / f' \                  Anything else is irregular and left to defects.py.
     /      \
    p' --- v --- n
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.jit import kernel, kernel_in_place, part
from tetsimplify.kernels.sets import find, unite

CYCLE, PATH, IRREGULAR = 1, 0, -1


class Survey(NamedTuple):
    """What :func:`survey` finds; the irregular vertices are not counted yet."""

    n_edges: int
    n_boundary_edges: int
    component: np.ndarray  # int32 (n,): disjoint sets of vertices, -1 where unreferenced
    euler: np.ndarray  # int32 (n,): Euler characteristic, at the root of each component
    loop: np.ndarray  # int32 (n,): disjoint sets of boundary vertices, -1 inside
    is_irregular: np.ndarray  # bool (n,): the link of the vertex is no cycle and no path


@part
def link_arcs(corner_vertex, next_corner, start, tail, head, corners):
    """Collect the arcs of the link of the vertex of corner `start`; return their number.

    Degenerate faces are passed over.
    """
    v = corner_vertex[start]
    n = 0
    c = start
    while True:
        tail[n] = corner_vertex[ahead(c)]
        head[n] = corner_vertex[behind(c)]
        corners[n] = c
        n += tail[n] != v and head[n] != v and tail[n] != head[n]
        c = next_corner[c]
        if c == start:
            return n


@part
def chain_arcs(tail, head, n_arcs, slot, successor):
    """Chain the arcs of a link.

    Returns
    -------
    kind : int
        CYCLE, PATH or IRREGULAR.
    first : int
        The arc that begins the path.
    last : int
        The arc that ends it.
    """
    for i in range(n_arcs):
        j = slot[tail[i]]
        if 0 <= j < i and tail[j] == tail[i]:
            return IRREGULAR, 0, 0  # two arcs leave one vertex
        slot[tail[i]] = i
    last = -1
    first = n_arcs * (n_arcs - 1) // 2  # minus all successors: the arc that none leads to
    for i in range(n_arcs):
        j = slot[head[i]]
        if 0 <= j < n_arcs and tail[j] == head[i]:
            successor[i] = j
            first -= j
        elif last < 0:
            successor[i] = -1
            last = i
        else:
            return IRREGULAR, 0, 0  # two paths, or two arcs into one vertex
    if last < 0:
        first = 0
    elif not 0 <= first < n_arcs:
        return IRREGULAR, 0, 0
    i = first
    for _ in range(n_arcs - 1):
        i = successor[i]
        if i < 0 or i == first:
            return IRREGULAR, 0, 0
    if i == last:
        return PATH, first, last
    if last < 0 and successor[i] == first and n_arcs > 2:  # two are faces back to back
        return CYCLE, first, first
    return IRREGULAR, 0, 0  # two arcs lead into one vertex


@kernel
def survey(corner_vertex, first_corner, next_corner, longest_link):
    """Pass over the vertices once; see :class:`Survey`."""
    n_vertices = first_corner.size
    component = np.empty(n_vertices, np.int32)
    euler = np.zeros(n_vertices, np.int32)
    loop = np.empty(n_vertices, np.int32)
    is_irregular = np.zeros(n_vertices, np.bool_)
    slot = np.empty(n_vertices, np.int32)  # sparse set: where a vertex stands in `tail`
    for v in range(n_vertices):
        component[v] = v
        loop[v] = -1
        slot[v] = -1
    tail = np.empty(longest_link + 1, np.int32)
    head = np.empty(longest_link + 1, np.int32)
    corners = np.empty(longest_link + 1, np.int32)
    successor = np.empty(longest_link + 1, np.int32)
    n_edges = 0
    n_boundary = 0

    for v in range(n_vertices):
        n_arcs = 0
        if first_corner[v] >= 0:
            n_arcs = link_arcs(corner_vertex, next_corner, first_corner[v], tail, head, corners)
        if n_arcs == 0:
            component[v] = -1
            continue
        kind, first, last = chain_arcs(tail, head, n_arcs, slot, successor)

        # edges and faces count at their lowest vertex
        n_faces_here = 0
        n_edges_here = 0
        for i in range(n_arcs):
            n_faces_here += tail[i] > v and head[i] > v
            n_edges_here += tail[i] > v
        if kind == PATH:
            n_edges_here += head[last] > v
            n_boundary += join_loop(loop, v, tail[first]) + join_loop(loop, v, head[last])
        elif kind == IRREGULAR:
            is_irregular[v] = True
            n_edges_here = 0
        n_edges += n_edges_here

        euler[v] = 1 - n_edges_here + n_faces_here
        for i in range(n_arcs):
            if tail[i] < v:
                join_component(component, euler, v, tail[i])
            if kind != CYCLE and head[i] < v:
                join_component(component, euler, v, head[i])

    return Survey(n_edges, n_boundary, component, euler, loop, is_irregular)


@part
def join_component(component, euler, v, w):
    """Unite the components of two vertices and add up their Euler characteristics."""
    v, w = find(component, v), find(component, w)
    if v != w:
        low, high = min(v, w), max(v, w)
        component[high] = low
        euler[low] += euler[high]


@part
def join_loop(loop, v, w):
    """Put the boundary edge vw, if v is its lower vertex, into the sets of boundary vertices.

    Return the number of edges put in, 0 or 1.
    """
    if w < v:
        return 0
    if loop[v] < 0:
        loop[v] = v
    if loop[w] < 0:
        loop[w] = w
    unite(loop, v, w)
    return 1


@kernel_in_place
def number_loops(loop):
    """Replace each boundary vertex's set by the number of its loop; return their number.

    Loops are numbered in the order of their lowest vertices.
    """
    n_loops = 0
    for v in range(loop.size):
        if loop[v] == v:  # representatives are the lowest, so none before was touched
            loop[v] = -2 - n_loops
            n_loops += 1
        elif loop[v] >= 0:
            w = loop[v]
            while w >= 0 and loop[w] >= 0:
                w = loop[w]
            loop[v] = loop[w]
    for v in range(loop.size):
        if loop[v] < -1:
            loop[v] = -2 - loop[v]
    return n_loops


@kernel
def component_topology(component, euler, loop, n_loops):
    """Euler characteristic and number of boundary loops of each component."""
    number = np.empty(component.size, np.int32)
    n_components = 0
    for v in range(component.size):
        if component[v] == v:
            number[v] = n_components
            n_components += 1
    table = np.zeros((n_components, 2), np.int64)
    counted = np.zeros(n_loops, np.bool_)
    for v in range(component.size):
        if component[v] < 0:
            continue
        if component[v] == v:
            table[number[v], 0] = euler[v]
        if loop[v] >= 0 and not counted[loop[v]]:
            counted[loop[v]] = True
            table[number[find(component, v)], 1] += 1
    return table
