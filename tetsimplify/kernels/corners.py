r"""The corner table: faces, and for each vertex the circular list of its corners.

Corner ``3 f + k`` is the k-th corner of face f. All corners of one vertex form a circular
singly linked list, in no particular order:

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
    return corner - 2 if corner % 3 == 2 else corner + 1


@part
def behind(corner):
    """The corner that precedes in the same face."""
    return corner + 2 if corner % 3 == 0 else corner - 1


@part
def others(corner_vertex, corner):
    """The vertices of the corners ahead and behind, in half the time of asking for each."""
    k = np.uint32(corner) % np.uint32(3)  # a product and a shift; signed numbers take more
    first = corner - k
    a = corner_vertex[first + (k == 0) + 2 * (k == 1)]
    return a, corner_vertex[first + 2 * (k == 0) + (k == 2)]


@kernel
def link_corners(corner_vertex, n_vertices):
    """Link the live corners of each vertex into a circular list.

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
