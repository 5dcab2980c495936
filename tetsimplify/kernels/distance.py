"""Distances from all of a surface to another: at its vertices, on average, at most.

The faces are visited in blocks, each in an order in which neighbours follow one another, so that
a search can begin where the one before it ended. Blocks do not depend on each other.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.cover import cover_height
from tetsimplify.kernels.jit import kernel, kernel_in_place
from tetsimplify.kernels.nearest import nearest_face
from tetsimplify.kernels.pieces import bound_piece, middle, put_face, worst_corner
from tetsimplify.kernels.quadrature import area_of_face, centre_of_face, simpson


class Source(NamedTuple):
    """A surface that distances are measured from, and those that are known."""

    vertices: np.ndarray  # float64 (n, 3)
    faces: np.ndarray  # int32 (m, 3)
    vertex_distance: np.ndarray  # float64 (n,)
    vertex_nearest: np.ndarray  # int32 (n,): nearest face of the other surface
    centre_distance: np.ndarray  # float64 (m,): of the centres of the faces
    centre_nearest: np.ndarray  # int32 (m,)


@kernel
def vertices_along(faces, order, n_vertices):
    """List the vertices as the faces, in some order, use them first.

    Returns
    -------
    vertices : int32 (n_vertices,)
        Those that no face uses come last.
    n_used : int
    """
    is_listed = np.zeros(n_vertices, np.bool_)
    vertices = np.empty(n_vertices, np.int32)
    n_listed = 0
    for fi in order:
        for v in faces[fi]:
            if not is_listed[v]:
                is_listed[v] = True
                vertices[n_listed] = v
                n_listed += 1
    n_used = n_listed
    for v in range(n_vertices):
        if not is_listed[v]:
            vertices[n_listed] = v
            n_listed += 1
    return vertices, n_used


@kernel_in_place
def measure_vertices(target, source, chosen, stack):
    """Measure the distances of the vertices chosen."""
    near = target.tree.face[0]
    for i in range(len(chosen)):
        v = chosen[i]
        x, y, z = source.vertices[v, 0], source.vertices[v, 1], source.vertices[v, 2]
        distance2, near = nearest_face(target, x, y, z, near, stack)
        source.vertex_distance[v] = np.sqrt(distance2)
        source.vertex_nearest[v] = near


@kernel_in_place
def measure_centres(target, source, chosen, stack, sums):
    """Measure the distances of the centres of the faces chosen, and integrate over these faces.

    The distances of the vertices have to be known.

    Parameters
    ----------
    target : Target
    source : Source
    chosen : int32 (k,)
    stack : Stack
    sums : float64 (3,)
        Receives the area, the integral of the distance and that of its square.
    """
    sums[:] = 0.0
    for i in range(len(chosen)):
        fi = chosen[i]
        a, b, c = source.faces[fi, 0], source.faces[fi, 1], source.faces[fi, 2]
        x, y, z = centre_of_face(source.vertices, a, b, c)
        distance2, near = nearest_face(target, x, y, z, source.vertex_nearest[a], stack)
        distance = np.sqrt(distance2)
        source.centre_distance[fi] = distance
        source.centre_nearest[fi] = near
        da, db, dc = source.vertex_distance[a], source.vertex_distance[b], source.vertex_distance[c]
        area = area_of_face(source.vertices, a, b, c)
        sums[0] += area
        sums[1] += area * simpson(da + db + dc, distance)
        sums[2] += area * simpson(da * da + db * db + dc * dc, distance2)


@kernel_in_place
def bound_faces(target, source, chosen, lower, tolerance, column, pieces, stack, bounds):
    """Bound the largest distance of the faces chosen, up to a tolerance.

    Parameters
    ----------
    target : Target
    source : Source
        With the distances of vertices and centres known.
    chosen : int32 (k,)
    lower : float
        The largest distance known, of these faces or others.
    tolerance : float
    column, pieces, stack : working memory
    bounds : float64 (6,)
        Receives the lower and the upper bound, the face that raised the lower one (-1 where none
        did), and the point on it.
    """
    upper = 0.0
    bounds[2] = -1.0
    for i in range(len(chosen)):
        fi = chosen[i]
        put_face(source.vertices, source.faces, fi, source.centre_nearest[fi], pieces)
        radius = middle(pieces, 0)[3]
        bound = source.centre_distance[fi] + radius
        if bound > lower + tolerance:
            bound = np.sqrt(worst_corner(target, source.centre_nearest[fi], pieces, 0)[1])
        if bound > lower + tolerance:
            bound, _ = cover_height(target, column, pieces.corners[0], lower + tolerance, stack)
        if bound > lower + tolerance:
            higher, bound, _ = bound_piece(target, pieces, stack, lower, tolerance, False)
            if higher > lower:
                lower = higher
                bounds[2] = fi
                for axis in range(3):
                    bounds[3 + axis] = pieces.farthest[axis]
        upper = max(upper, bound)
    bounds[0], bounds[1] = lower, upper


@kernel_in_place
def exceeding_faces(
    target, vertices, faces, first, last, hints, limit, slack, column, pieces, stack, found, points
):
    """Find the faces that are not within a limit of a surface everywhere.

    Parameters
    ----------
    target : Target
    vertices : float64 (n, 3)
    faces : int32 (m, 3)
    first, last : int
        The faces to look at.
    hints : int32 (m,) or (0,)
        For each face one of the surface that may be near, -1 for none.
    limit : float
    slack : float
        A face may be found that is within the limit, but only if a point of it is farther than
        ``limit - slack``.
    column, pieces, stack : working memory
    found : int32 (last - first,)
        Receives these faces.
    points : float64 (last - first, 4)
        Receives for each the farthest point that was met, and its distance.

    Returns
    -------
    int
        Number of faces found.
    """
    n_found = 0
    near = target.tree.face[0]
    for fi in range(first, last):
        if len(hints) > 0 and hints[fi] >= 0:
            near = hints[fi]
        put_face(vertices, faces, fi, near, pieces)
        if worst_corner(target, near, pieces, 0)[1] <= limit * limit:
            continue
        x, y, z, radius = middle(pieces, 0)
        if radius < limit:  # one search may do
            distance2, near = nearest_face(target, x, y, z, near, stack)
            if np.sqrt(distance2) + radius <= limit:
                continue
            pieces.near[0] = near
        height, above = cover_height(target, column, pieces.corners[0], limit, stack)
        if above >= 0:
            near = pieces.near[0] = above
        if height <= limit:
            continue
        distance, _, near = bound_piece(target, pieces, stack, limit - slack, slack, True)
        if distance > limit - slack:
            for k in range(3):
                v = faces[fi, k]
                distance2, near = nearest_face(
                    target, vertices[v, 0], vertices[v, 1], vertices[v, 2], near, stack
                )
                if np.sqrt(distance2) > distance:
                    distance = np.sqrt(distance2)
                    for axis in range(3):
                        pieces.farthest[axis] = vertices[v, axis]
            found[n_found] = fi
            for axis in range(3):
                points[n_found, axis] = pieces.farthest[axis]
            points[n_found, 3] = distance
            n_found += 1
    return n_found
