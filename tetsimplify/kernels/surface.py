r"""The topology of a triangle set, in one pass over its vertices.

At a vertex v every face gives an arc n -> p of the link of v:

        p = n'                 Regular: the arcs chain to one cycle (v is inside)
       /  \                            or to one path (v is on the boundary).
      / f' \                  Anything else is irregular and left to defects.py.
     /      \
    p' --- v --- n

Nearly all vertices of nearly all surfaces are inside. `survey_inside` takes these, in threads, each
of which has a range of the vertices and writes to nothing else. What it does not take is left to
`survey_rest`, one after the other: the boundary, what is irregular, vertices of very many faces,
and what ties two ranges together.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import others
from tetsimplify.kernels.jit import kernel, kernel_in_place, part
from tetsimplify.kernels.prefetch import prefetch_row
from tetsimplify.kernels.sets import find, unite

CYCLE, PATH, IRREGULAR = 1, 0, -1
MOST_ARCS = 64  # of a vertex, more are left
SLOTS = 2**12  # for the tails of arcs, by the last bits of their numbers: they fit a cache
SOON = 8  # so many vertices before one of the rest is looked at, what it needs is fetched
RUN = 2**12  # corners that are passed over at once where none has a vertex of the range


class Survey(NamedTuple):
    """What is found out; filled by `survey_inside`, range by range, then by `survey_rest`."""

    first_corner: np.ndarray  # int32 (n,): a corner of each vertex, -1 where it has none
    next_corner: np.ndarray  # int32 (3 m,): the corner table
    component: np.ndarray  # int32 (n,): disjoint sets of vertices, -1 where unreferenced
    euler: np.ndarray  # int32 (n,): Euler characteristic, at the root of each component
    loop: np.ndarray  # int32 (n,): disjoint sets of boundary vertices, -1 inside
    listed: np.ndarray  # int32 (n,): from the first place of each range on, vertices of it: first
    # those that are left, ~v where that is only to join `lower`; in the end the special ones
    lower: np.ndarray  # int32 (n,): a vertex of another range and the same component


@part
def link_arcs(corner_vertex, next_corner, start, tail, head, corners):
    """Collect the arcs of the link of the vertex of corner `start`.

    Degenerate faces are passed over. Returns the numbers of arcs and of corners.
    """
    v = corner_vertex[start]
    n = n_corners = 0
    c = start
    while True:
        tail[n], head[n] = others(corner_vertex, c)
        corners[n] = c
        n_corners += 1
        n += tail[n] != v and head[n] != v and tail[n] != head[n]
        c = next_corner[c]
        if c == start:
            return n, n_corners


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


@part
def _link_range(corner_vertex, first, last, first_corner, next_corner):
    """Link the corners of the vertices from `first` to `last`, each to the one before.

    The earliest corner of a vertex is linked to -1, and `first_corner` is the latest one.
    """
    for v in range(first, last):
        first_corner[v] = -1
    least, above = np.int32(first), np.int32(last)
    for begin in range(0, corner_vertex.size, RUN):
        run = corner_vertex[begin : begin + RUN]
        low = high = run[0]
        for i in range(run.size):  # one after the other, so that both take many at once
            low = min(low, run[i])
        for i in range(run.size):
            high = max(high, run[i])
        if high < least or low >= above:
            continue
        for i in range(run.size):
            v, corner = run[i], np.uint32(begin + i)
            if least <= v < above:
                next_corner[corner] = first_corner[np.uint32(v)]
                first_corner[np.uint32(v)] = corner


@kernel_in_place
def survey_inside(corner_vertex, first, last, found, arcs, slots):
    """Link the corners of a range of vertices, and survey those that are inside the surface.

    Their circular lists are in order.

    Parameters
    ----------
    corner_vertex : int32 (3 m,)
    first, last : int
        The range.
    found : Survey
        Filled for the vertices of the range and their corners.
    arcs : int32 (3, MOST_ARCS)
        Working memory.
    slots : int64 (3, SLOTS)
        Working memory, filled with -1. Where the tail of an arc is looked up: for which vertex and
        tail the entry was made last, the head, and the corner.

    Returns
    -------
    n_edges : int
        Edges whose lower vertex is settled here.
    n_left : int
        Vertices that have something left.
    longest : int
        The largest number of corners of a vertex.
    """
    first_corner, next_corner, left = found.first_corner, found.next_corner, found.listed
    component, euler = found.component, found.euler
    tail, head, corners = arcs[0], arcs[1], arcs[2]
    entry, successor, entered = slots[0], slots[1], slots[2]
    last_slot = SLOTS - 1
    _link_range(corner_vertex, first, last, first_corner, next_corner)
    n_edges = n_left = longest = 0
    for v in range(first, last):
        component[v] = v
        euler[v] = 0
        found.loop[v] = -1
        corner = first_corner[v]
        if corner < 0:
            component[v] = -1
            continue
        latest = corner
        stamp = np.int64(v) << 32
        n_arcs = n_faces_here = n_edges_here = n_runs = 0
        lower = np.int32(0)
        while True:
            a, b = others(corner_vertex, corner)
            i = np.uint32(n_arcs & (MOST_ARCS - 1))
            tail[i], head[i], corners[i] = a, b, corner
            slot = np.uint32(a & last_slot)
            entry[slot], successor[slot], entered[slot] = stamp | a, b, corner
            n_arcs += 1
            # edges and faces count at their lowest vertex
            n_edges_here += a > v
            n_faces_here += (a > v) & (b > v)
            begins = (a < v) & (b > v)
            n_runs += begins
            lower = a if begins else lower
            following = next_corner[np.uint32(corner)]
            if following < 0:
                break
            corner = following
        next_corner[corner] = latest
        first_corner[v] = corner
        longest = max(longest, n_arcs)

        # One cycle, if heads lead from arc to arc, and back just after as many as there are: then
        # these are different ones, and so they are all. A vertex that was put out of its slot by
        # another one only makes this fail.
        begin = np.int64(head[0])
        w = begin
        n_followed = 0
        previous = latest
        while n_followed < n_arcs <= MOST_ARCS:
            slot = np.uint32(w & last_slot)
            if entry[slot] != stamp | w:
                break
            following = entered[slot]
            next_corner[np.uint32(previous)] = following
            previous = following
            w = successor[slot]
            n_followed += 1
            if w == begin:
                break
        is_cycle = n_followed == n_arcs and w == begin and n_arcs > 2
        if not is_cycle and n_arcs <= MOST_ARCS:
            for i in range(n_arcs):  # as they were
                next_corner[corners[i]] = corners[i + 1 if i + 1 < n_arcs else 0]

        # Two neighbours that follow one another in the link have an edge of their own. So of lower
        # ones that do, one is joined here, and the others are joined to that elsewhere.
        if n_runs == 0 and n_edges_here == 0:
            n_runs, lower = 1, tail[0]
        if is_cycle and n_runs > 1:
            for i in range(n_arcs):
                is_cycle &= not (tail[i] < first and head[i] > v)
        if not is_cycle:
            left[first + n_left] = v
            n_left += 1
            continue
        euler[v] = 1 - n_edges_here + n_faces_here
        n_edges += n_edges_here
        if n_runs == 1 and lower < first:
            left[first + n_left] = ~v
            found.lower[v] = lower
            n_left += 1
        elif n_runs == 1:
            join_component(component, euler, v, lower)
        elif n_runs > 1:
            for i in range(n_arcs):
                if tail[i] < v and head[i] > v:
                    join_component(component, euler, v, tail[i])
    return n_edges, n_left, longest


@kernel_in_place
def survey_rest(corner_vertex, found, rest, arcs, slot):
    """Survey the vertices that have something left.

    Parameters
    ----------
    corner_vertex : int32 (3 m,)
    found : Survey
        Completed, but for the edges of irregular vertices.
    rest : int32 (k,)
        These, as in `listed`. Receives those whose link is no cycle and no path.
    arcs : int32 (4, longest + 1)
        Working memory for the largest number of corners of a vertex.
    slot : int32 (n,)
        Working memory: where a vertex stands among the arcs, if it does.

    Returns
    -------
    n_edges : int
        Edges whose lower vertex is settled here.
    n_boundary : int
        Boundary edges among them.
    n_degenerate : int
        Corners of degenerate faces that were met, no less than one for each.
    n_irregular : int
        How many vertices `rest` has received.
    """
    next_corner, loop = found.next_corner, found.loop
    component, euler = found.component, found.euler
    tail, head, corners, successor = arcs[0], arcs[1], arcs[2], arcs[3]
    n_edges = n_boundary = n_degenerate = n_irregular = 0
    for i in range(rest.size):
        soon, later = min(i + SOON, rest.size - 1), min(i + 2 * SOON, rest.size - 1)
        _will_be_surveyed(corner_vertex, found, slot, rest[soon], rest[later])
        v = rest[i]
        if v < 0:
            join_component(component, euler, ~v, found.lower[~v])
            continue
        n_arcs, n_corners = link_arcs(
            corner_vertex, next_corner, found.first_corner[v], tail, head, corners
        )
        n_degenerate += n_corners - n_arcs
        if n_arcs == 0:
            component[v] = -1
            continue
        kind, begin, end = chain_arcs(tail, head, n_arcs, slot, successor)
        n_faces_here = 0
        n_edges_here = 0
        for i in range(n_arcs):
            n_faces_here += tail[i] > v and head[i] > v
            n_edges_here += tail[i] > v
        if kind != IRREGULAR and n_arcs == n_corners:
            _put_in_order(next_corner, corners, n_arcs, successor, begin, end)
        if kind == PATH:
            n_edges_here += head[end] > v
            n_boundary += join_loop(loop, v, tail[begin]) + join_loop(loop, v, head[end])
        elif kind == IRREGULAR:
            rest[n_irregular] = v
            n_irregular += 1
            n_edges_here = 0
        n_edges += n_edges_here

        euler[find(component, v)] += 1 - n_edges_here + n_faces_here
        for i in range(n_arcs):
            if tail[i] < v:
                join_component(component, euler, v, tail[i])
            if kind != CYCLE and head[i] < v:
                join_component(component, euler, v, head[i])
    return n_edges, n_boundary, n_degenerate, n_irregular


@part
def _will_be_surveyed(corner_vertex, found, slot, v, later):
    """Start to fetch what a vertex of the rest will need soon, and what another one will later."""
    if v >= 0:
        corner = found.first_corner[v]
        prefetch_row(found.next_corner, corner)
        prefetch_row(corner_vertex, corner)
        prefetch_row(slot, v)
    if later >= 0:
        prefetch_row(found.first_corner, later)


@part
def _put_in_order(next_corner, corners, n_arcs, successor, begin, end):
    """Link the corners of a vertex in the order in which their arcs follow one another."""
    i = begin
    for _ in range(n_arcs - 1):
        next_corner[corners[i]] = corners[successor[i]]
        i = successor[i]
    next_corner[corners[i]] = corners[begin]


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
def list_special(component, loop, first, last, listed):
    """List vertices that stand for a component, are on the boundary, or are not in use.

    Parameters
    ----------
    component, loop : int32 (n,)
        As of `Survey`.
    first, last : int
        Which vertices.
    listed : int32 (n,), out
        From `first` on.

    Returns
    -------
    int
        How many there are.
    """
    n = 0
    for v in range(first, last):
        listed[first + n] = v
        n += (component[v] == v) | (component[v] < 0) | (loop[v] >= 0)
    return n


@kernel_in_place
def number_loops(loop, special):
    """Replace each boundary vertex's set by the number of its loop; return their number.

    Loops are numbered in the order of their lowest vertices. `special` has all boundary vertices.
    """
    n_loops = 0
    for v in special:
        if loop[v] == v:  # representatives are the lowest, so none before was touched
            loop[v] = -2 - n_loops
            n_loops += 1
        elif loop[v] >= 0:
            w = loop[v]
            while w >= 0 and loop[w] >= 0:
                w = loop[w]
            loop[v] = loop[w]
    for v in special:
        if loop[v] < -1:
            loop[v] = -2 - loop[v]
    return n_loops


@kernel
def component_topology(component, euler, loop, n_loops, special):
    """Euler characteristic and number of boundary loops of each component."""
    number = np.empty(component.size, np.int32)
    n_components = 0
    for v in special:
        if component[v] == v:
            number[v] = n_components
            n_components += 1
    table = np.zeros((n_components, 2), np.int64)
    counted = np.zeros(n_loops, np.bool_)
    for v in special:
        if component[v] < 0:
            continue
        if component[v] == v:
            table[number[v], 0] = euler[v]
        if loop[v] >= 0 and not counted[loop[v]]:
            counted[loop[v]] = True
            table[number[find(component, v)], 1] += 1
    return table
