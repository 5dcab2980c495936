"""Rings of vertices in order: around a vertex, and along a boundary loop.

The link of a vertex is chained from the arcs that its faces give: an arc leads from the
vertex ahead of the corner to the one behind it.
"""

from tetsimplify.kernels.corners import DEAD, ahead, behind
from tetsimplify.kernels.jit import cold_part, kernel_in_place


@cold_part
def _arcs(corner_vertex, next_corner, corner, corners, slot):
    """Collect the live corners of a vertex, and note in `slot` which arc begins where."""
    n = 0
    c = corner
    while True:
        if corner_vertex[c] != DEAD:
            corners[n] = c
            slot[corner_vertex[ahead(c)]] = n
            n += 1
        c = next_corner[c]
        if c == corner:
            return n


@cold_part
def _arc_at(corner_vertex, corners, n, slot, vertex):
    """The arc that begins at `vertex`, -1 if none does."""
    i = slot[vertex]
    return i if 0 <= i < n and corner_vertex[ahead(corners[i])] == vertex else -1


@cold_part
def _first_arc(corner_vertex, corners, n, slot):
    """The arc that begins the open link of a boundary vertex: all others follow one."""
    first = n * (n - 1) // 2
    for i in range(n):
        j = _arc_at(corner_vertex, corners, n, slot, corner_vertex[behind(corners[i])])
        if j >= 0:
            first -= j
    return first


@cold_part
def ordered_link(corner_vertex, next_corner, corner, begin, virtual, corners, slot, link, fan):
    """The link of the vertex of `corner`, anticlockwise from its vertex `begin`.

    Parameters
    ----------
    virtual : int
        The virtual neighbour of a boundary vertex, -1 for others.
    corners, slot : scratch
    link : int32, out
        The vertices, the virtual one among them.
    fan : int32, out
        The corner between link[i] and link[i + 1], -1 beside the virtual vertex.

    Returns
    -------
    int
        Number of vertices.
    """
    n = _arcs(corner_vertex, next_corner, corner, corners, slot)
    w = begin
    length = 0
    while length == 0 or w != begin:
        link[length] = w
        fan[length] = -1
        if w == virtual:
            w = corner_vertex[ahead(corners[_first_arc(corner_vertex, corners, n, slot)])]
        else:
            i = _arc_at(corner_vertex, corners, n, slot, w)
            if i >= 0:
                fan[length] = corners[i]
                w = corner_vertex[behind(corners[i])]
            else:
                w = virtual
        length += 1
    return length


@cold_part
def forward_arc(corner_vertex, next_corner, corner, target, corners, slot):
    """Number of boundary edges from the vertex of `corner` forward to `target`.

    Forward is the direction in which the faces run along the boundary.
    """
    length = 0
    while corner_vertex[corner] != target or length == 0:
        n = _arcs(corner_vertex, next_corner, corner, corners, slot)
        corner = ahead(corners[_first_arc(corner_vertex, corners, n, slot)])
        length += 1
    return length


@cold_part
def face_across(corner_vertex, next_corner, corner):
    """The other face of the edge from `corner` to the next corner, -1 on a boundary."""
    target = corner_vertex[ahead(corner)]
    c = next_corner[corner]
    while c != corner:
        if corner_vertex[c] != DEAD and corner_vertex[behind(c)] == target:
            return c // 3
        c = next_corner[c]
    return -1


@kernel_in_place
def boundary_neighbours(corner_vertex, next_corner, loop, before, after):
    """Find the vertices before and after each boundary vertex on its loop.

    Parameters
    ----------
    loop : int32 (n,)
        Boundary loop of each vertex, -1 inside.
    before, after : int32 (n,), out
        Left as they are for vertices inside.
    """
    for corner in range(corner_vertex.size):
        a, b = corner_vertex[corner], corner_vertex[ahead(corner)]
        if loop[a] >= 0 and loop[a] == loop[b]:
            if face_across(corner_vertex, next_corner, corner) < 0:
                after[a] = b
                before[b] = a
