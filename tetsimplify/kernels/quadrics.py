r"""Quadric errors (Garland and Heckbert 1997): squared distances from planes, summed by area.

The quadric of a vertex stands for the planes of all faces that have been merged into it. At a
place y, relative to the vertex itself, it is

    Q(y) = y' A y + 2 b' y + c,     A = sum of w n n'

with the normal n and the weight w of each plane: its area, in units of about the mean area of the
faces given, so that single precision is enough for meshes of any size. Relative to the vertex: so a
mesh far from the origin loses nothing, and a quadric that is new has b = 0 and c = 0. The trace of
A is the sum of the areas, so Q / trace(A) is a mean squared distance.

On a plane the sum cancels to nothing, which only comes out when A is kept in double precision. b
and c are small there, and single precision is enough for them.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.geometry import squared_length, twice_area
from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.rings import face_across
from tetsimplify.kernels.state import ERROR


class Quadrics(NamedTuple):
    """The quadrics of vertices, and where they come from: each in one line of a cache."""

    matrix: np.ndarray  # float64 (n, 8): the upper half of A by rows; the last two columns are
    linear: np.ndarray  # float32 (n, 16): b and c, in the last four columns; the same memory
    origin: np.ndarray  # float32 (n, 16): columns below, beside the positions in the same memory


LINEAR, CONSTANT = 12, 15  # columns of `linear`
# Columns of `origin`, after the position, which takes six: the largest mean squared distance
# allowed; sums of the original normals, by area, and of the areas.
MAX_ERROR2, NORMAL, AREA = 6, 7, 10

# The optimum is held to the middle of the edge by a spring of this part of the weight: in
# directions in which the planes do not decide, the middle does. So the solution is always well
# conditioned, and triangles on flat and on weakly curved parts come out well shaped.
STABILITY = 1e-3
# So often the optimum is computed anew with the spring at the last one.
REFINEMENTS = 4
# Farther than so many lengths of the edge from its middle no optimum is believed.
MAX_REACH = 2.0


@part
def sum_at(quadrics, vertices, v, u):
    """The quadrics of v and u together, relative to v: A by rows of its upper half, b, c."""
    of_v, of_u = quadrics.matrix[v], quadrics.matrix[u]
    axx, axy, axz, ayy, ayz, azz = of_u[0], of_u[1], of_u[2], of_u[3], of_u[4], of_u[5]
    rest_v, rest_u = quadrics.linear[v], quadrics.linear[u]
    bx, by, bz = (
        np.float64(rest_u[LINEAR]),
        np.float64(rest_u[LINEAR + 1]),
        np.float64(rest_u[LINEAR + 2]),
    )
    dx = vertices[v, 0] - vertices[u, 0]
    dy = vertices[v, 1] - vertices[u, 1]
    dz = vertices[v, 2] - vertices[u, 2]
    gx = axx * dx + axy * dy + axz * dz
    gy = axy * dx + ayy * dy + ayz * dz
    gz = axz * dx + ayz * dy + azz * dz
    return (
        axx + of_v[0],
        axy + of_v[1],
        axz + of_v[2],
        ayy + of_v[3],
        ayz + of_v[4],
        azz + of_v[5],
        bx + gx + rest_v[LINEAR],
        by + gy + rest_v[LINEAR + 1],
        bz + gz + rest_v[LINEAR + 2],
        (gx + 2.0 * bx) * dx + (gy + 2.0 * by) * dy + (gz + 2.0 * bz) * dz
        + rest_v[CONSTANT] + rest_u[CONSTANT],
    )  # fmt: skip


@part
def value(q, x, y, z):
    """The quadric q at a place relative to its vertex."""
    axx, axy, axz, ayy, ayz, azz, bx, by, bz, c = q
    error = (
        x * (axx * x + 2.0 * (axy * y + axz * z + bx))
        + y * (ayy * y + 2.0 * (ayz * z + by))
        + z * (azz * z + 2.0 * bz)
        + c
    )
    return max(error, 0.0)


@part
def weight(quadrics, v):
    """The sum of the weights of the planes of v."""
    return quadrics.matrix[v, 0] + quadrics.matrix[v, 3] + quadrics.matrix[v, 5]


@part
def increase(quadrics, v, u, error):
    """How much more the error is than those of v and u alone."""
    return max(error - errors_apart(quadrics, v, u), 0.0)


@part
def errors_apart(quadrics, v, u):
    """The errors of v and u alone, together."""
    return np.float64(quadrics.linear[v, CONSTANT]) + quadrics.linear[u, CONSTANT]


@part
def error_bound(quadrics, v, u):
    """The largest mean squared distance that both v and u allow."""
    return min(quadrics.origin[v, MAX_ERROR2], quadrics.origin[u, MAX_ERROR2])


@part
def is_beyond_bound(quadrics, v, u, error):
    """Whether an error of v and u together is more than both allow."""
    return error > (weight(quadrics, v) + weight(quadrics, u)) * error_bound(quadrics, v, u)


@part
def optimum(q, x, y, z):
    """Where q is least, held by a spring at the place given where the planes do not decide.

    As if computed again and again, with the spring at what came out: so what the planes do decide
    becomes as good as exact, and what they do not decide hardly moves. With the spring s and
    M = s / (A + s), the sum (1 + M + M^2 + ...) of the steps is one polynomial. NaN where there are
    no planes.
    """
    axx, axy, axz, ayy, ayz, azz, bx, by, bz, _ = q
    spring = STABILITY * (axx + ayy + azz)
    sxx, syy, szz = axx + spring, ayy + spring, azz + spring
    ixx, ixy, ixz = syy * szz - ayz * ayz, axz * ayz - axy * szz, axy * ayz - axz * syy
    iyy, iyz, izz = sxx * szz - axz * axz, axy * axz - sxx * ayz, sxx * syy - axy * axy
    scale = 1.0 / (sxx * ixx + axy * ixy + axz * ixz)
    gx = scale * (axx * x + axy * y + axz * z + bx)
    gy = scale * (axy * x + ayy * y + ayz * z + by)
    gz = scale * (axz * x + ayz * y + azz * z + bz)
    step_x = ixx * gx + ixy * gy + ixz * gz
    step_y = ixy * gx + iyy * gy + iyz * gz
    step_z = ixz * gx + iyz * gy + izz * gz
    dx, dy, dz = step_x, step_y, step_z
    damping = scale * spring
    for _ in range(REFINEMENTS - 1):
        gx, gy, gz = damping * dx, damping * dy, damping * dz
        dx = step_x + (ixx * gx + ixy * gy + ixz * gz)
        dy = step_y + (ixy * gx + iyy * gy + iyz * gz)
        dz = step_z + (ixz * gx + iyz * gy + izz * gz)
    return x - dx, y - dy, z - dz


@part
def reachable_optimum(q, x, y, z):
    """The optimum for an edge from 0 to a place, and whether it is near enough to be believed."""
    px, py, pz = optimum(q, 0.5 * x, 0.5 * y, 0.5 * z)
    dx, dy, dz = px - 0.5 * x, py - 0.5 * y, pz - 0.5 * z
    reach2 = MAX_REACH * MAX_REACH * (x * x + y * y + z * z)
    return px, py, pz, dx * dx + dy * dy + dz * dz <= reach2


@part
def merge_quadrics(surface, quadrics, scratch, v, u):
    """Make of v and u, which are still where they were, what stands for both at the new place."""
    vertices = surface.vertices
    q = sum_at(quadrics, vertices, v, u)
    axx, axy, axz, ayy, ayz, azz, bx, by, bz, _ = q
    x = scratch.point[0] - vertices[v, 0]
    y = scratch.point[1] - vertices[v, 1]
    z = scratch.point[2] - vertices[v, 2]
    for k in range(6):
        quadrics.matrix[v, k] += quadrics.matrix[u, k]
    rest, origin = quadrics.linear[v], quadrics.origin
    rest[LINEAR] = bx + axx * x + axy * y + axz * z
    rest[LINEAR + 1] = by + axy * x + ayy * y + ayz * z
    rest[LINEAR + 2] = bz + axz * x + ayz * y + azz * z
    rest[CONSTANT] = scratch.point[ERROR]
    origin[v, MAX_ERROR2] = error_bound(quadrics, v, u)
    for k in range(NORMAL, AREA + 1):
        origin[v, k] += origin[u, k]


@kernel_in_place
def vertex_errors(quadrics, number, first, last, errors):
    """Root mean squared distances of the vertices that are left from the planes of their quadrics.

    Parameters
    ----------
    number : int32 (n,)
        New numbers of the vertices, -1 where they are not in use.
    first, last : int
        Which vertices.
    errors : float64, out
        In the new order.
    """
    for v in range(first, last):
        if number[v] >= 0:
            weight_v = weight(quadrics, v)
            error2 = quadrics.linear[v, CONSTANT]
            errors[number[v]] = np.sqrt(error2 / weight_v) if weight_v > 0.0 else 0.0


@part
def _add_plane(matrix, v, scale, x, y, z):
    """Add the plane through v with a normal of any length; scale times its square is the weight."""
    matrix[v, 0] += scale * x * x
    matrix[v, 1] += scale * x * y
    matrix[v, 2] += scale * x * z
    matrix[v, 3] += scale * y * y
    matrix[v, 4] += scale * y * z
    matrix[v, 5] += scale * z * z


@part
def _area_vector(vertices, a, b, c):
    """Normal of a face, as long as its area."""
    x, y, z = twice_area(vertices, a, b, c)
    return 0.5 * x, 0.5 * y, 0.5 * z


@kernel_in_place
def mean_area(vertices, corner_vertex, step):
    """Mean area of every so many-th face."""
    area, n = 0.0, 0
    for first in range(0, corner_vertex.size, 3 * step):
        a, b, c = corner_vertex[first], corner_vertex[first + 1], corner_vertex[first + 2]
        x, y, z = _area_vector(vertices, a, b, c)
        area += np.sqrt(x * x + y * y + z * z)
        n += 1
    return area / max(1, n)


@kernel_in_place
def find_planes(vertices, corner_vertex, unit, first, last, planes):
    """Find the planes of the faces from `first` to `last`, each once for its three vertices.

    Parameters
    ----------
    unit : float
        Of the weights: areas are counted in it.
    first, last : int
    planes : float64 (m, 4), out
        Unit normals times the root of the weight, and that root.

    Returns
    -------
    weight : float
        Sum of the weights.
    shortest2 : float
        Squared length of the shortest edge.
    """
    total, shortest2 = 0.0, np.inf
    for f in range(first, last):
        corner = np.uint32(3) * np.uint32(f)
        a = np.uint32(corner_vertex[corner])
        b = np.uint32(corner_vertex[corner + np.uint32(1)])
        c = np.uint32(corner_vertex[corner + np.uint32(2)])
        ab, bc = squared_length(vertices, a, b), squared_length(vertices, b, c)
        shortest2 = min(shortest2, min(min(ab, bc), squared_length(vertices, c, a)))
        x, y, z = _area_vector(vertices, a, b, c)
        area = np.sqrt(x * x + y * y + z * z)
        root = np.sqrt(area / unit)
        scale = root / area if area > 0.0 else 0.0
        plane = planes[np.uint32(f)]
        plane[0], plane[1], plane[2], plane[3] = scale * x, scale * y, scale * z, root
        total += area / unit
    return total, shortest2


@kernel_in_place
def sum_planes(planes, next_corner, first_corner, first, last, quadrics):
    """Sum the planes, the normals and the areas of the faces around the vertices from `first`.

    Parameters
    ----------
    planes : float64 (m, 4)
        As of `find_planes`.
    first_corner : int32 (n,)
        A corner of each vertex, -1 where it has none.
    first, last : int
        Which vertices.
    """
    for v in range(first, last):
        matrix, origin = quadrics.matrix[v], quadrics.origin[v]
        xx = xy = xz = yy = yz = zz = 0.0
        sum_x = sum_y = sum_z = sum_area = 0.0
        c = first_corner[v]
        while c >= 0:
            plane = planes[np.uint32(c) // np.uint32(3)]
            x, y, z, root = plane[0], plane[1], plane[2], plane[3]
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
            sum_x, sum_y, sum_z = sum_x + root * x, sum_y + root * y, sum_z + root * z
            sum_area += root * root
            c = next_corner[np.uint32(c)]
            if c == first_corner[v]:
                break
        matrix[0], matrix[1], matrix[2], matrix[3], matrix[4], matrix[5] = xx, xy, xz, yy, yz, zz
        matrix[6] = matrix[7] = 0.0  # b and c
        origin[NORMAL], origin[NORMAL + 1] = sum_x, sum_y
        origin[NORMAL + 2], origin[AREA] = sum_z, sum_area


@kernel_in_place
def add_creases(
    surface, first_corner, begins, matrix, unit, boundary_weight, feature_weight, cos_feature
):
    """Hold boundary and feature edges by planes through them, upright on their faces.

    Parameters
    ----------
    first_corner : int32 (n,)
        A corner of each vertex, -1 where it has none.
    begins : int32 (k,)
        Vertices where such edges may begin.
    matrix : float64 (n, 8)
        Of the quadrics.
    unit : float
        Of the weights.
    boundary_weight, feature_weight : float
        Weight of a plane, in squared lengths of the edge.
    cos_feature : float
        Edges whose faces have normals with a smaller cosine are features; -1 for none.
    """
    vertices, corner_vertex, loop = surface.vertices, surface.corner_vertex, surface.loop
    for a in begins:
        corner = first_corner[a]
        while corner >= 0:
            b = corner_vertex[ahead(corner)]
            if cos_feature > -1.0 or (loop[a] >= 0 and loop[a] == loop[b]):
                x, y, z = _area_vector(vertices, a, b, corner_vertex[behind(corner)])
                scale = _crease_weight(
                    surface, corner, x, y, z, boundary_weight, feature_weight, cos_feature
                )
                if scale > 0.0:
                    ex = vertices[b, 0] - vertices[a, 0]
                    ey = vertices[b, 1] - vertices[a, 1]
                    ez = vertices[b, 2] - vertices[a, 2]
                    upright = y * ez - z * ey, z * ex - x * ez, x * ey - y * ex
                    _add_plane(matrix, a, scale / unit, *upright)
                    _add_plane(matrix, b, scale / unit, *upright)
            corner = surface.next_corner[corner]
            if corner == first_corner[a]:
                break


@part
def _crease_weight(surface, corner, x, y, z, boundary_weight, feature_weight, cos_feature):
    """Weight of the edge that begins at a corner for an upright vector of its length by x, y, z.

    0 where it is neither on a boundary nor a feature, or its face has no normal.
    """
    corner_vertex = surface.corner_vertex
    square = x * x + y * y + z * z
    if square == 0.0:
        return 0.0
    across = face_across(corner_vertex, surface.next_corner, corner)
    if across < 0:
        return boundary_weight / square
    first = 3 * across
    ox, oy, oz = _area_vector(
        surface.vertices,
        corner_vertex[first],
        corner_vertex[first + 1],
        corner_vertex[first + 2],
    )
    cosine = x * ox + y * oy + z * oz
    is_sharp = cosine < cos_feature * np.sqrt(square * (ox * ox + oy * oy + oz * oz))
    return feature_weight / square if is_sharp else 0.0
