r"""How good triangles are, and the edges and vertices between them.

             r                 Let a be the longest side and D = |b x c|, twice the area. Then
           /   \  b
       c /       \                2 r / R = 4 D / (b c) * D / (a (a + b + c))
       /     a     \              aspect  = a (a + b + c) / (2 sqrt(3) D)
      p ----------- q

All of it comes from differences of corners, so it holds far from the origin, and D from the two
shorter sides: in a needle, the product of both long sides would lose what it is thin by.
"""

import math
from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.geometry import cross, dot
from tetsimplify.kernels.jit import kernel, part

DEGREES = 180.0 / math.pi
SMALLEST_EXPONENT = -1000  # of units, so that their inverses are finite


class FaceMeasures(NamedTuple):
    """What :func:`measure_faces` finds; see :class:`tetsimplify.quality.QualityReport`."""

    radius_ratio: np.ndarray  # float64 (m,)
    min_angle: np.ndarray  # float64 (m,): degrees
    max_angle: np.ndarray  # float64 (m,): degrees
    aspect_ratio: np.ndarray  # float64 (m,)
    edge_ratio: np.ndarray  # float64 (m,)
    area: np.ndarray  # float64 (m,)
    normal: np.ndarray  # float64 (m, 3): of length one, or zero where there is no area


class EdgeMeasures(NamedTuple):
    """What :func:`measure_edges` finds."""

    interior: np.ndarray  # int32 (k, 2): edges of two faces
    others: np.ndarray  # int32 (l, 2): all other edges
    interior_length: np.ndarray  # float64 (k,)
    other_length: np.ndarray  # float64 (l,)
    dihedral_angle: np.ndarray  # float64 (k,): degrees
    valence: np.ndarray  # int32 (n,)
    is_on_boundary: np.ndarray  # bool (n,): the vertex has an edge of one face


@part
def scaled(a, factor):
    """A vector times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@part
def half_side(vertices, p, q):
    """Half the way from p to q; the whole of it may be more than a float can hold."""
    return (
        0.5 * vertices[q, 0] - 0.5 * vertices[p, 0],
        0.5 * vertices[q, 1] - 0.5 * vertices[p, 1],
        0.5 * vertices[q, 2] - 0.5 * vertices[p, 2],
    )


@part
def largest(a):
    """The largest component of a vector, without its sign."""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))


@part
def unit_near(length):
    """The power of two just below a length: in such units nothing overflows or is rounded."""
    return math.ldexp(1.0, max(math.frexp(length)[1] - 1, SMALLEST_EXPONENT))


@part
def distance(vertices, p, q):
    """The distance of two vertices."""
    side = half_side(vertices, p, q)
    unit = unit_near(largest(side))
    side = scaled(side, 1.0 / unit)
    return 2.0 * math.sqrt(dot(side, side)) * unit


@kernel
def measure_faces(vertices, faces):
    """Measure all faces; see :class:`FaceMeasures`."""
    n_faces = faces.shape[0]
    radius_ratio = np.empty(n_faces)
    min_angle = np.empty(n_faces)
    max_angle = np.empty(n_faces)
    aspect_ratio = np.empty(n_faces)
    edge_ratio = np.empty(n_faces)
    area = np.empty(n_faces)
    normal = np.empty((n_faces, 3))
    for face in range(n_faces):
        p, q, r = faces[face, 0], faces[face, 1], faces[face, 2]
        a, b, c = half_side(vertices, p, q), half_side(vertices, q, r), half_side(vertices, r, p)
        unit = unit_near(max(largest(a), largest(b), largest(c)))
        a, b, c = scaled(a, 1.0 / unit), scaled(b, 1.0 / unit), scaled(c, 1.0 / unit)
        aa, bb, cc = dot(a, a), dot(b, b), dot(c, c)
        while aa < max(bb, cc):  # turn until a is the longest
            a, b, c = b, c, a
            aa, bb, cc = bb, cc, aa
        length_a, length_b, length_c = math.sqrt(aa), math.sqrt(bb), math.sqrt(cc)
        shortest = min(length_b, length_c)
        edge_ratio[face] = length_a / shortest if shortest > 0.0 else np.inf

        n = cross(b, c)
        twice_area = math.sqrt(dot(n, n))
        if not twice_area > 0.0:
            radius_ratio[face] = min_angle[face] = area[face] = 0.0
            max_angle[face] = 180.0
            aspect_ratio[face] = np.inf
            normal[face, 0] = normal[face, 1] = normal[face, 2] = 0.0
            continue
        area[face] = 2.0 * twice_area * unit * unit
        n = scaled(n, 1.0 / twice_area)
        normal[face, 0], normal[face, 1], normal[face, 2] = n[0], n[1], n[2]
        around = length_a * (length_a + length_b + length_c)
        # rounding must not take the criteria beyond those of the equilateral triangle
        ratio = 4.0 * (twice_area / (length_b * length_c)) * (twice_area / around)
        radius_ratio[face] = min(ratio, 1.0)
        aspect_ratio[face] = max(around / (2.0 * math.sqrt(3.0) * twice_area), 1.0)
        beside = dot(a, b) if cc < bb else dot(a, c)
        min_angle[face] = min(math.atan2(twice_area, -beside) * DEGREES, 60.0)
        max_angle[face] = max(math.atan2(twice_area, -dot(b, c)) * DEGREES, 60.0)
    return FaceMeasures(radius_ratio, min_angle, max_angle, aspect_ratio, edge_ratio, area, normal)


@kernel
def measure_edges(vertices, corner_vertex, first_corner, next_corner, longest_link, normal):
    """Measure the edges of all faces that name no vertex twice; see :class:`EdgeMeasures`."""
    n_vertices = first_corner.size
    n_corners = corner_vertex.size
    ends = np.empty((n_corners, 2), np.int32)  # interior edges from the front, others from the back
    length = np.empty(n_corners)
    dihedral_angle = np.empty(n_corners)
    valence = np.zeros(n_vertices, np.int32)
    is_on_boundary = np.zeros(n_vertices, np.bool_)
    # the edges at their lower end v: a sparse set of the upper ends, the number of faces of each,
    # and two of these, ~face where it runs downwards
    slot = np.zeros(n_vertices, np.int32)
    upper = np.empty(2 * longest_link, np.int32)
    degree = np.empty(2 * longest_link, np.int32)
    sides = np.empty((2 * longest_link, 2), np.int32)
    n_interior = 0
    n_others = 0

    for v in range(n_vertices):
        n_upper = 0
        start = first_corner[v]
        corner = start
        while corner >= 0:
            face = corner // 3
            tail, head = corner_vertex[ahead(corner)], corner_vertex[behind(corner)]
            is_proper = tail != v and head != v and tail != head
            for w, side in ((tail, face), (head, ~face)):
                if w < v or not is_proper:
                    continue
                i = slot[w]
                if i >= n_upper or upper[i] != w:
                    i = n_upper
                    slot[w], upper[i], degree[i] = i, w, 0
                    n_upper += 1
                if degree[i] < 2:
                    sides[i, degree[i]] = side
                degree[i] += 1
            corner = next_corner[corner]
            if corner == start:
                break

        valence[v] += n_upper
        for i in range(n_upper):
            w = upper[i]
            valence[w] += 1
            if degree[i] == 2:
                k = n_interior
                dihedral_angle[k] = angle_between(normal, sides[i, 0], sides[i, 1])
                n_interior += 1
            else:
                n_others += 1
                k = n_corners - n_others
                if degree[i] == 1:
                    is_on_boundary[v] = is_on_boundary[w] = True
            ends[k, 0], ends[k, 1] = v, w
            length[k] = distance(vertices, v, w)

    first_other = n_corners - n_others
    return EdgeMeasures(
        ends[:n_interior].copy(),
        ends[first_other:][::-1].copy(),
        length[:n_interior].copy(),
        length[first_other:][::-1].copy(),
        dihedral_angle[:n_interior].copy(),
        valence,
        is_on_boundary,
    )


@part
def angle_between(normal, side, other):
    """The angle in degrees between the normals of two faces, each turned as its side says."""
    f = side if side >= 0 else ~side
    g = other if other >= 0 else ~other
    a = normal[f, 0], normal[f, 1], normal[f, 2]
    b = normal[g, 0], normal[g, 1], normal[g, 2]
    cosine = dot(a, b)
    if (side >= 0) == (other >= 0):  # the faces run along the edge in the same direction
        cosine = -cosine
    n = cross(a, b)
    sine2 = dot(n, n)
    if sine2 == 0.0 and abs(cosine) < 0.5:
        return 0.0  # a face without area has no normal
    return math.atan2(math.sqrt(sine2), cosine) * DEGREES
