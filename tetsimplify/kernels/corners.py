r"""The corner table: faces, and for each vertex the circular list of its corners.

Corner ``3 f + k`` is the k-th corner of face f. All corners of one vertex form a circular
singly linked list, anticlockwise; where the vertex is on a boundary there is a gap somewhere in it:

                 v                 corner_vertex[c]  the vertex v of corner c
              / c | d \            next_corner[c]    another corner d of v
            /  f  |  g  \          ahead(c), behind(c)  the other two corners of the face
          p ----- n ----- .

A dead face has ``corner_vertex = DEAD`` in all three corners. Lists are relinked without
dead corners whenever a vertex is contracted; other walks pass over them.
"""

import numpy as np

from tetsimplify.kernels.jit import kernel, part

DEAD = -1  # in corner_vertex: the face of this corner is gone


@part
def ahead(corner):
    """The corner that follows in the same face, counter-clockwise."""
    return corner - 2 if np.uint32(corner) % np.uint32(3) == 2 else corner + 1


@part
def behind(corner):
    """The corner that precedes in the same face."""
    return corner + 2 if np.uint32(corner) % np.uint32(3) == 0 else corner - 1


@part
def others(corner_vertex, corner):
    """The vertices of the corners ahead and behind.

    Unsigned numbers are divided by a product and a shift, and nobody asks whether they count from
    the end of an array: half the time of asking for one after the other.
    """
    c = np.uint32(corner)
    k = c % np.uint32(3)
    following = c - np.uint32(2) if k == 2 else c + np.uint32(1)
    preceding = c + np.uint32(2) if k == 0 else c - np.uint32(1)
    return corner_vertex[following], corner_vertex[preceding]


@part
def vertex_behind(corner_vertex, corner):
    """The vertex of the corner behind, as of `others`."""
    c = np.uint32(corner)
    return corner_vertex[c + np.uint32(2) if c % np.uint32(3) == 0 else c - np.uint32(1)]


@part
def face_of(corner):
    """The face of a corner."""
    return np.int64(np.uint32(corner) // np.uint32(3))


@kernel
def link_corners(corner_vertex, n_vertices):
    """Link the live corners of each vertex into a circular list, in no particular order.

    `surface.survey_inside` and `surface.survey_rest` put them in order, too.

    Returns
    -------
    first_corner : int32 (n_vertices,)
        A corner of each vertex, -1 where it has none.
    next_corner : int32 (n_corners,)
    longest : int
        The largest number of corners of a vertex.
    """
    first_corner = np.full(n_vertices, -1, np.int32)
    n_corners = np.zeros(n_vertices, np.int32)
    longest = 0
    next_corner = np.empty(corner_vertex.size, np.int32)
    for corner in range(corner_vertex.size):
        vertex = corner_vertex[corner]
        if vertex == DEAD:
            continue
        first = first_corner[vertex]
        if first < 0:
            first_corner[vertex] = corner
            next_corner[corner] = corner
        else:
            next_corner[corner] = next_corner[first]
            next_corner[first] = corner
        n_corners[vertex] += 1
        longest = max(longest, n_corners[vertex])
    return first_corner, next_corner, longest
