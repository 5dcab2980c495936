"""What is left in the end: live faces, and what became of every vertex."""

import numpy as np

from tetsimplify.kernels.corners import DEAD
from tetsimplify.kernels.cost import COLUMNS
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import kernel_in_place


@kernel_in_place
def count_live_faces(corner_vertex, first, last):
    """Count the live ones of the faces from `first` to `last`."""
    n = 0
    for f in range(first, last):
        n += corner_vertex[3 * f] != DEAD
    return n


@kernel_in_place
def copy_live_faces(surface, cost, origin, first, last, begin, place, to, to_cost, to_origin):
    """Copy the live ones of the faces from `first` to `last`, but for the links of their corners.

    Parameters
    ----------
    surface : Surface
    cost : float32 (4 m,) or None
        Where costs are kept.
    origin : int32 (m,)
        Number of each face in the mesh given.
    begin : int
        How many live faces come before.
    place : int32 (m,), out
        Where each live face goes.
    to : Surface
        What they are copied to.
    to_cost, to_origin
        The same.
    """
    n = begin
    for f in range(first, last):
        if surface.corner_vertex[3 * f] == DEAD:
            continue
        place[f] = n
        for k in range(3):
            to.corner_vertex[3 * n + k] = surface.corner_vertex[3 * f + k]
            to.verdict[3 * n + k] = surface.verdict[3 * f + k]
        if cost is not None:
            for k in range(COLUMNS):
                to_cost[COLUMNS * n + k] = cost[COLUMNS * f + k]
        to.face_state[n] = surface.face_state[f]
        to_origin[n] = origin[f]
        n += 1


@kernel_in_place
def copy_links(surface, first, last, place, to):
    """Link the corners of the live ones of the faces from `first` to `last`, in the same order."""
    corner_vertex, next_corner = surface.corner_vertex, surface.next_corner
    for f in range(first, last):
        if corner_vertex[3 * f] == DEAD:
            continue
        n = place[f]
        for k in range(3):
            c = np.uint32(next_corner[3 * f + k])
            while corner_vertex[c] == DEAD:
                c = np.uint32(next_corner[c])
            across = c // np.uint32(3)
            to.next_corner[3 * n + k] = 3 * place[across] + (c - np.uint32(3) * across)


@kernel_in_place
def number_vertices(corner_vertex, visit, number):
    """Number the vertices that faces use; return how many there are.

    Parameters
    ----------
    visit : int32 (n,)
        The vertices in the order in which they get their numbers.
    number : int32 (n,)
        Filled with -1. Receives the number of each vertex in use.
    """
    for corner in range(corner_vertex.size):
        number[corner_vertex[corner]] = 0
    n = 0
    for v in visit:
        if number[v] == 0:
            number[v] = n
            n += 1
    return n


@kernel_in_place
def follow_merges(merged_into, number, first, last, of_target):
    """Tell vertices the number of what they were merged into; -1 where that is gone.

    Parameters
    ----------
    merged_into : int32 (n,)
        Vertex that each one was merged into, itself where it was not, -1 where removed.
    number : int32 (n,)
        Of the vertices in use.
    first, last : int
        Which vertices.
    of_target : int32 (n,), out
    """
    for v in range(first, last):
        w = v
        while merged_into[w] >= 0 and merged_into[w] != w:
            w = merged_into[w]
        of_target[v] = number[w] if merged_into[w] >= 0 else -1


@kernel_in_place
def copy_vertices(vertices, number, merged_into, corner_vertex, out):
    """Copy the vertices that are in use to their new places and renumber the corners."""
    for v in range(number.size):
        if merged_into[v] == v and number[v] >= 0:
            for axis in range(3):
                out[number[v], axis] = vertices[v, axis]
    for corner in range(corner_vertex.size):
        corner_vertex[corner] = number[corner_vertex[corner]]


@kernel_in_place
def edge_extremes(vertices, corner_vertex):
    """Lengths of the shortest and of the longest edge; infinite and 0 when there is none."""
    shortest2, longest2 = np.inf, 0.0
    for f in range(corner_vertex.size // 3):
        a, b, c = corner_vertex[3 * f], corner_vertex[3 * f + 1], corner_vertex[3 * f + 2]
        for p, q in ((a, b), (b, c), (c, a)):
            length2 = squared_length(vertices, p, q)
            shortest2, longest2 = min(shortest2, length2), max(longest2, length2)
    return np.sqrt(shortest2), np.sqrt(longest2)
