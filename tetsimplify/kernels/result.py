"""What is left in the end: live faces, and what became of every vertex."""

import numpy as np

from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import COLUMNS
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import kernel_in_place
from tetsimplify.kernels.lists import item


@kernel_in_place
def count_live_faces(corner_vertex, first, last):
    """Count the live ones of the faces from `first` to `last`."""
    n = 0
    for f in range(first, last):
        n += corner_vertex[np.uint32(3) * np.uint32(f)] != DEAD
    return n


@kernel_in_place
def list_live_faces(corner_vertex, first, last, begin, end, place, source):
    """List the live ones of the faces from `first` to `last`, without branches on which they are.

    Parameters
    ----------
    begin, end : int
        Their places in the list.
    place : int32 (m,), out
        Where each live face is in the list, -1 for a dead one.
    source : int32 (n,), out
        The list.
    """
    n = np.uint32(begin)
    for face in range(first, last):
        f = np.uint32(face)
        is_live = corner_vertex[np.uint32(3) * f] != DEAD
        place[f] = np.int32(n) if is_live else np.int32(-1)
        if n < end:  # the last ones of the range may be dead
            source[n] = face
        n += np.uint32(is_live)


@kernel_in_place
def copy_live_faces(surface, cost, origin, source, first, last, to, to_cost, to_origin):
    """Copy the live faces from the `first` to the `last`, but for the links of their corners.

    Parameters
    ----------
    surface : Surface
    cost : float32 (4 m,) or None
        Where costs are kept.
    origin : int32 (m,)
        Number of each face in the mesh given; see lists.py.
    source : int32 (n,)
        The live faces.
    to : Surface
        What they are copied to.
    to_cost, to_origin
        The same.
    """
    for i in range(first, last):
        n = np.uint32(i)
        f = np.uint32(source[n])
        corner, to_corner = np.uint32(3) * f, np.uint32(3) * n
        for k in range(3):
            j = np.uint32(k)
            to.corner_vertex[to_corner + j] = surface.corner_vertex[corner + j]
            to.verdict[to_corner + j] = surface.verdict[corner + j]
        if cost is not None:
            place, to_place = np.uint32(COLUMNS) * f, np.uint32(COLUMNS) * n
            for k in range(COLUMNS):
                to_cost[to_place + np.uint32(k)] = cost[place + np.uint32(k)]
        to.face_state[n] = surface.face_state[f]
        to_origin[n] = item(origin, f)


@kernel_in_place
def copy_links(next_corner, source, place, first, last, to):
    """Link the corners of the live faces from the `first` to the `last`, in the same order.

    Parameters
    ----------
    next_corner : int32 (3 m,)
    source, place
        As of `list_live_faces`.
    to : int32 (3 n,), out
    """
    three = np.uint32(3)
    for i in range(first, last):
        corner, to_corner = three * np.uint32(source[np.uint32(i)]), three * np.uint32(i)
        for k in range(3):
            c = np.uint32(next_corner[corner + np.uint32(k)])
            while place[c // three] < 0:
                c = np.uint32(next_corner[c])
            across = c // three
            to[to_corner + np.uint32(k)] = three * np.uint32(place[across]) + c - three * across


@kernel_in_place
def mark_vertices(corner_vertex, is_used):
    """Mark the vertices that corners have with 1."""
    for corner in range(corner_vertex.size):
        is_used[np.uint32(corner_vertex[corner])] = 1


@kernel_in_place
def number_vertices(visit, is_used, n, number):
    """Number the vertices in use in the order in which they are visited, from `n` on.

    Parameters
    ----------
    visit : int32 (k,)
    is_used : uint8 (n,)
    number : int32 (n,), out
        -1 where a vertex is not in use.
    """
    for v in visit:
        number[v] = n if is_used[v] else -1
        n += is_used[v]


@kernel_in_place
def note_places(origin, first, last, place):
    """Note where each of the faces from `first` to `last` is, by the number that it was given."""
    for i in range(first, last):
        place[origin[i]] = i


@kernel_in_place
def copy_in_order(corner_vertex, place, first, n, faces, face_map):
    """Copy faces, in order, from the n-th one on.

    Parameters
    ----------
    place : int32 (k,)
        Where each face is, -1 where it is gone.
    first : int
        The number that the first of them was given.
    n : int
    faces : int32 (m, 3), out
    face_map : int32 (m,), out
        The numbers that they were given.
    """
    for i in range(place.size):
        if place[i] >= 0:
            for k in range(3):
                faces[n, k] = corner_vertex[3 * place[i] + k]
            face_map[n] = first + i
            n += 1


@kernel_in_place
def follow_merges(merged_into, number, visit, of_target):
    """Tell vertices the number of what they were merged into; -1 where that is gone.

    Parameters
    ----------
    merged_into : int32 (n,)
        Vertex that each one was merged into, itself where it was not, -1 where removed.
    number : int32 (n,)
        Of the vertices in use, -1 of the others.
    visit : int32 (k,)
        Which vertices.
    of_target : int32 (k,), out
    """
    for i in range(visit.size):
        w = visit[i]
        into = merged_into[np.uint32(w)]
        while into >= 0 and into != w:
            w = into
            into = merged_into[np.uint32(w)]
        of_target[i] = number[np.uint32(w)]


@kernel_in_place
def copy_vertices(vertices, number, first, last, out):
    """Copy those of the vertices from `first` to `last` that are in use to their new places."""
    for v in range(first, last):
        if number[v] >= 0:
            for axis in range(3):
                out[number[v], axis] = vertices[v, axis]


@kernel_in_place
def renumber_corners(number, corner_vertex):
    """Give corners the new numbers of their vertices."""
    for corner in range(corner_vertex.size):
        corner_vertex[corner] = number[np.uint32(corner_vertex[corner])]


@kernel_in_place
def edge_extremes(vertices, corner_vertex):
    """Lengths of the shortest and of the longest edge; infinite and 0 when there is none."""
    shortest2, longest2 = np.inf, 0.0
    for f in range(corner_vertex.size // 3):
        first = np.uint32(3) * np.uint32(f)
        a = np.uint32(corner_vertex[first])
        b = np.uint32(corner_vertex[first + np.uint32(1)])
        c = np.uint32(corner_vertex[first + np.uint32(2)])
        for p, q in ((a, b), (b, c), (c, a)):
            length2 = squared_length(vertices, p, q)
            shortest2, longest2 = min(shortest2, length2), max(longest2, length2)
    return np.sqrt(shortest2), np.sqrt(longest2)
