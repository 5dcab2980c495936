r"""Integrals of the distance over the faces of a surface.

Simpson's rule for a triangle takes the corners with weight 1/12 and the centre with 3/4, and is
exact for polynomials of degree 2. Where it is refined a triangle is cut into four, which share
the centre and the corners with it::

            c
           / \              + centres
          / + \             x middles of the sides
        x-------x
       / \  +  / \
      / + \   / + \
     a------x------b
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.jit import kernel, kernel_in_place, part
from tetsimplify.kernels.nearest import edge, nearest_face

MAX_LEVEL = 8  # how often a face is cut into four
MAX_TRIANGLES = 3 * MAX_LEVEL + 1

DISTANCE = 3  # place in `Triangles.corners`


class Triangles(NamedTuple):
    """A stack of triangles that a face is cut into."""

    corners: np.ndarray  # float64 (MAX_TRIANGLES, 3, 4): x, y, z and DISTANCE
    centre_distance: np.ndarray  # float64 (MAX_TRIANGLES,)
    centre_nearest: np.ndarray  # int32 (MAX_TRIANGLES,): face of the other surface
    level: np.ndarray  # int32 (MAX_TRIANGLES,): number of cuts that made it

    @classmethod
    def new(cls):
        """Allocate it."""
        return cls(
            corners=np.empty((MAX_TRIANGLES, 3, 4)),
            centre_distance=np.empty(MAX_TRIANGLES),
            centre_nearest=np.empty(MAX_TRIANGLES, np.int32),
            level=np.empty(MAX_TRIANGLES, np.int32),
        )


@part
def simpson(at_corners, at_centre):
    """Mean over a triangle of what has this sum at the corners, and this value at the centre."""
    return at_corners / 12.0 + 0.75 * at_centre


@part
def area_of_face(vertices, a, b, c):
    """Area of a triangle of three vertices."""
    ux, uy, uz, _ = edge(vertices, a, b)
    vx, vy, vz, _ = edge(vertices, a, c)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)


@part
def centre_of_face(vertices, a, b, c):
    """Centre of a triangle of three vertices."""
    return (
        (vertices[a, 0] + vertices[b, 0] + vertices[c, 0]) / 3.0,
        (vertices[a, 1] + vertices[b, 1] + vertices[c, 1]) / 3.0,
        (vertices[a, 2] + vertices[b, 2] + vertices[c, 2]) / 3.0,
    )


@kernel
def choose_faces(vertices, faces, order, step):
    """Choose faces at equal steps of area along an order.

    Parameters
    ----------
    vertices, faces : arrays
    order : int32 (m,)
    step : float
        0 to choose all.

    Returns
    -------
    chosen : int32 (k,)
        All faces that are larger than a step are among them.
    weights : float64 (k,)
        The area that each stands for.
    """
    chosen, weights = np.empty(len(order), np.int32), np.empty(len(order))
    n_chosen = 0
    n_steps = 0.5  # so far
    for fi in order:
        area = area_of_face(vertices, faces[fi, 0], faces[fi, 1], faces[fi, 2])
        before = n_steps
        if step > 0.0:
            n_steps += area / step
        if step == 0.0 or np.floor(n_steps) > np.floor(before):
            chosen[n_chosen], weights[n_chosen] = fi, max(area, step)
            n_chosen += 1
    return chosen[:n_chosen].copy(), weights[:n_chosen].copy()


@kernel_in_place
def refine_integrals(target, source, chosen, weights, accuracy, triangles, stack, sums):
    """Find by what the integrals over some faces change when they are refined.

    Parameters
    ----------
    target : Target
    source : Source
        With the distances of vertices and centres known.
    chosen : int32 (k,)
    weights : float64 (k,)
        The area that each face chosen stands for.
    accuracy : float
        A part of a face is cut until that changes its mean by no more than this, divided by the
        root of the area that it stands for. The errors of many parts cancel in that proportion.
    triangles, stack : working memory
    sums : float64 (2,)
        Receives the changes of the integrals of the distance and of its square.
    """
    sums[:] = 0.0
    for i in range(len(chosen)):
        fi = chosen[i]
        triangles.level[0] = 0
        triangles.centre_distance[0] = source.centre_distance[fi]
        triangles.centre_nearest[0] = source.centre_nearest[fi]
        for k in range(3):
            v = source.faces[fi, k]
            for axis in range(3):
                triangles.corners[0, k, axis] = source.vertices[v, axis]
            triangles.corners[0, k, DISTANCE] = source.vertex_distance[v]
        first, second = simpson_of(triangles, 0)
        sums[0] -= weights[i] * first
        sums[1] -= weights[i] * second

        n_waiting = 1
        while n_waiting > 0:
            at = n_waiting - 1
            share = 0.25 ** triangles.level[at]
            coarse, _ = simpson_of(triangles, at)
            is_last = triangles.level[at] + 1 == MAX_LEVEL
            is_fine = is_small(target, triangles, at)
            cut_in_four(target, triangles, at, stack)
            first = second = 0.0
            for k in range(4):
                d, d2 = simpson_of(triangles, at + k)
                first += 0.25 * d
                second += 0.25 * d2
            change = abs(first - coarse) * np.sqrt(weights[i] * share)
            if is_last or (is_fine and change <= accuracy):
                sums[0] += weights[i] * share * first
                sums[1] += weights[i] * share * second
                n_waiting -= 1
            else:
                n_waiting += 3


@part
def simpson_of(triangles, at):
    """Means of the distance and of its square over a triangle."""
    corners, centre = triangles.corners[at], triangles.centre_distance[at]
    a, b, c = corners[0, DISTANCE], corners[1, DISTANCE], corners[2, DISTANCE]
    return simpson(a + b + c, centre), simpson(a * a + b * b + c * c, centre * centre)


@part
def is_small(target, triangles, at):
    """Whether a quarter of a triangle is no longer than the face near it, or than its distance."""
    corners, face = triangles.corners[at], target.faces[triangles.centre_nearest[at]]
    length2 = max(edge(corners, 0, 1)[3], edge(corners, 1, 2)[3], edge(corners, 2, 0)[3])
    near2 = max(
        edge(target.vertices, face[0], face[1])[3],
        edge(target.vertices, face[1], face[2])[3],
        edge(target.vertices, face[2], face[0])[3],
    )
    return 0.25 * length2 <= max(near2, triangles.centre_distance[at] ** 2)


@part
def cut_in_four(target, triangles, at, stack):
    """Replace a triangle by its four parts, the one around its centre last, and measure them."""
    corners, near = triangles.corners, triangles.centre_nearest[at]
    for axis in range(4):
        a, b, c = corners[at, 0, axis], corners[at, 1, axis], corners[at, 2, axis]
        if axis == DISTANCE:
            ab = measure(target, corners[at + 3, 0], near, stack)[0]
            bc = measure(target, corners[at + 3, 1], near, stack)[0]
            ca = measure(target, corners[at + 3, 2], near, stack)[0]
        else:
            ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        for k in range(3):
            corners[at, k, axis] = (a, ab, ca)[k]
            corners[at + 1, k, axis] = (ab, b, bc)[k]
            corners[at + 2, k, axis] = (ca, bc, c)[k]
            corners[at + 3, k, axis] = (ab, bc, ca)[k]
    triangles.centre_distance[at + 3], triangles.centre_nearest[at + 3] = (
        triangles.centre_distance[at],
        near,
    )
    for k in range(3):
        centre = centre_of_face(corners[at + k], 0, 1, 2)
        triangles.centre_distance[at + k], triangles.centre_nearest[at + k] = measure(
            target, centre, near, stack
        )
    triangles.level[at : at + 4] = triangles.level[at] + 1


@part
def measure(target, point, hint, stack):
    """The distance of a point, and the nearest face."""
    distance2, face = nearest_face(target, point[0], point[1], point[2], hint, stack)
    return np.sqrt(distance2), face
