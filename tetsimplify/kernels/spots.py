"""Spots where a surface is far from the one that it was made of.

Samples of the surface given do not see a face that spans a hollow: they are near to the faces
beside it. So points of the surface made are looked at, too. Each belongs to one vertex: it is the
vertex itself, or on an edge to a later one, or in the middle of a face of which it is the first.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels import boxes
from tetsimplify.kernels.boxes import IN_BOX, PER_FACE, WIDTH
from tetsimplify.kernels.corners import face_of, others
from tetsimplify.kernels.jit import cold_part, kernel_in_place, part
from tetsimplify.kernels.patches import (
    THIRD,
    Search,
    Surface,
    distance2_to,
    near_face,
    nearest_face,
    nearest_of_all,
)

FACE, EDGE, RIM = 0, 1, 2  # where a point of a corner is, see `put_point`
N_KINDS = 3
EIGHTHS = 8  # of an edge, between points on it
VERTEX, MIDDLE = 0, EIGHTHS // 2  # points of an edge, in these


class Made(NamedTuple):
    """The surface made, and what may be done with it."""

    surface: Surface  # its vertices are moved
    first_corner: np.ndarray  # int32 (n,), the corner table, in order
    next_corner: np.ndarray  # int32 (3 m,)
    held: np.ndarray  # uint8 (n,): vertices that stay
    normals: np.ndarray  # float64 (m, 4): normals that faces may not turn from, and areas
    cosine: float  # of the largest angle by which they may turn
    boxes: np.ndarray  # float64 (n_groups, 6, WIDTH): around the faces, see boxes.py


class Desk(NamedTuple):
    """Working memory."""

    point: np.ndarray  # float64 (3,)
    weights: np.ndarray  # float64 (3,): barycentric coordinates of a spot
    way: np.ndarray  # float64 (3,): from there to the other surface
    before: np.ndarray  # float64 (3, 3): the corners of its face
    best: np.ndarray  # float64 (3, 3): where they should be
    search: Search

    @classmethod
    def new(cls, left=0):
        """Allocate it."""
        return cls(
            *(np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, 3))),
            Search.new(left),
        )


# --- distances ------------------------------------------------------------------------------------


@cold_part
def put_point(made, v, corner, kind, eighth, point):
    """Put down a point of a corner of a vertex; return the other vertices around it, -1 if none is.

    It is in the middle of the face, or so many eighths of the way along the edge behind, or along
    the edge ahead of the next corner where that is another edge: on the rim of the surface.
    """
    vertices, corner_vertex = made.surface.vertices, made.surface.faces.reshape(-1)
    p, q = others(corner_vertex, corner)
    if kind == FACE:
        for axis in range(3):
            point[axis] = THIRD * (vertices[v, axis] + vertices[p, axis] + vertices[q, axis])
        return p, q
    if kind == RIM:
        after, _ = others(corner_vertex, made.next_corner[corner])
        if after == q:
            return np.int32(-1), np.int32(-1)
        q = after
    there = eighth / EIGHTHS
    for axis in range(3):
        point[axis] = (1.0 - there) * vertices[v, axis] + there * vertices[q, axis]
    return q, q


@part
def _ahead_and_rim(made, corner):
    """The vertices of the corner ahead and, only where no other face follows, of the one behind.

    So around a vertex each of its neighbours comes once.
    """
    corner_vertex = made.surface.faces.reshape(-1)
    p, q = others(corner_vertex, corner)
    after, _ = others(corner_vertex, made.next_corner[corner])
    return p, q if q != after else np.int32(-1)


@kernel_in_place
def find_boxes(made):
    """Find the boxes around the faces made."""
    boxes.clear(made.boxes)
    for f in range(len(made.surface.faces)):
        _enlarge_box(made, f)


@cold_part
def enlarge_boxes_around(made, v):
    """Let the faces around a vertex be in their boxes."""
    corner = made.first_corner[v]
    while True:
        _enlarge_box(made, face_of(corner))
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            break


@part
def _enlarge_box(made, f):
    """Let a face be in its box."""
    for k in range(3):
        for axis in range(3):
            x = made.surface.vertices[made.surface.faces[f, k], axis]
            boxes.enlarge(made.boxes, f, axis, x, x)


@kernel_in_place
def measure_about(made, patches, first, last, desk, far2):
    """Squared distances from the surface given of points of the vertices from `first` to `last`.

    Of few points, and too large where the face with the nearest middle is not the nearest.

    Parameters
    ----------
    made : Made
    patches : Patches
    first, last : int
    desk : Desk
    far2 : float64 (n,), out
        The largest one for each vertex.
    """
    for v in range(first, last):
        far2[v] = 0.0
        corner = made.first_corner[v]
        if corner >= 0:
            put_point(made, v, corner, EDGE, VERTEX, desk.point)
            far2[v] = _distance2_about(patches, v, v, v, desk)
        while corner >= 0:
            for kind in range(N_KINDS):
                p, q = put_point(made, v, corner, kind, MIDDLE, desk.point)
                if p > v and q > v:
                    far2[v] = max(far2[v], _distance2_about(patches, v, p, q, desk))
            corner = made.next_corner[corner]
            if corner == made.first_corner[v]:
                break


@cold_part
def _distance2_about(patches, v, p, q, desk):
    """About the squared distance of the point from the surface given, 0 if it cannot be told."""
    face, distance2 = near_face(patches, v, p, q, desk.point, desk.search)
    return distance2 if face >= 0 else 0.0


@cold_part
def to_given(patches, v, p, q, limit2, desk):
    """The face given that is nearest to the point among some vertices, and its squared distance.

    Any within the limit will do.
    """
    point, search = desk.point, desk.search
    best, best2 = near_face(patches, v, p, q, point, search)
    for w in (np.int64(v), np.int64(p), np.int64(q)):
        if best2 > limit2:
            best, best2 = nearest_face(patches, w, point, search, best, best2)
    if best2 > limit2:
        best, best2 = nearest_of_all(patches, point, limit2, search, best, best2)
    return best, best2


@cold_part
def _to_made(made, v, limit2, desk):
    """The face made that is nearest to a point of a patch, and its squared distance.

    Any within the limit will do. It is looked for around the vertex of the patch, around those of
    the face that is nearest there, and so on.
    """
    best, best2 = _nearest_around(made, v, limit2, desk, np.int64(-1), np.inf)
    centre, before2 = np.int64(v), np.inf
    while best >= 0 and limit2 < best2 < before2:
        before2, f = best2, best
        for k in range(3):
            w = np.int64(made.surface.faces[f, k])
            if w != centre:
                best, best2 = _nearest_around(made, w, limit2, desk, best, best2)
    return best, best2


@cold_part
def to_all_made(made, limit2, desk, best, best2):
    """The face made of all that is nearest to a point, if it is nearer than what is known."""
    m, point, search = len(made.surface.faces), desk.point, desk.search
    search.left[0] -= m // (IN_BOX * PER_FACE)
    for group in range(len(made.boxes)):
        boxes.measure_group(made.boxes, group, point, search.to_boxes2)
        for lane in range(WIDTH):
            if best2 > limit2 and search.to_boxes2[lane] < best2:
                search.left[0] -= IN_BOX
                begin = IN_BOX * (WIDTH * group + lane)
                for f in range(begin, min(begin + IN_BOX, m)):
                    distance2 = distance2_to(made.surface, f, point)
                    if distance2 < best2:
                        best, best2 = np.int64(f), distance2
    return best, best2


@cold_part
def _nearest_around(made, v, limit2, desk, best, best2):
    """The face around a vertex that is nearest to a point, if nearer than what is known."""
    point = desk.point
    corner = made.first_corner[v]
    while corner >= 0 and best2 > limit2:
        desk.search.left[0] -= 1
        f = face_of(corner)
        distance2 = distance2_to(made.surface, f, point)
        if distance2 < best2:
            best, best2 = f, distance2
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            break
    return best, best2


# --- what is farthest -----------------------------------------------------------------------------
# A point of the surface made has a number: the corner, the kind and the eighth of `put_point`.
# One of the surface given has that of its corner.


@cold_part
def farthest_of_made(made, patches, v, is_alone, step, most2, limit2, desk):
    """Find the point at a vertex that is farthest from the surface given.

    Alone, as one of all vertices, it has the points that belong to it; else all that move with it.
    With a step of `MIDDLE` only the middles of edges are looked at, with 1 all points. Any beyond
    the limit will do. When as many faces have been looked at as may be, nothing is found and all is
    thought of as infinitely far.

    Returns
    -------
    number : int
        -1 where none is farther than what is known.
    most2 : float
        Its squared distance, or what is known.
    """
    farthest = np.int64(-1)
    corner = made.first_corner[v]
    begin = VERTEX  # only at the first corner
    while corner >= 0:
        for kind in (EDGE, RIM, FACE):
            for eighth in range(begin, EIGHTHS if kind != FACE else begin + 1, step):
                p, q = put_point(made, v, corner, kind, eighth, desk.point)
                if p < 0 or (is_alone and not (p > v and q > v) and eighth != VERTEX):
                    continue
                face, distance2 = to_given(patches, v, p, q, most2, desk)
                if face >= 0 and distance2 > most2:
                    farthest = EIGHTHS * (N_KINDS * np.int64(corner) + kind) + eighth
                    most2 = distance2
                    if most2 >= limit2:
                        return farthest, most2
            begin = step
        if desk.search.left[0] < 0:
            return np.int64(-1), np.inf
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            break
    return farthest, most2


@cold_part
def _farthest_of_patch(made, patches, v, n_corners, is_sure, most2, limit2, desk):
    """Find the corner of the faces of a patch, the first ones of each, that is farthest.

    To be sure all faces made are looked at; else there may be one that is nearer. The rest is as of
    `farthest_of_made`.
    """
    farthest, guess = np.int64(-1), np.int64(-1)  # what is near to one is often near to the next
    vertices, faces = patches.given
    for i in range(patches.first[v], patches.first[v + 1]):
        if desk.search.left[0] < 0:
            return np.int64(-1), np.inf
        f = patches.face[i]
        for k in range(n_corners):
            for axis in range(3):
                desk.point[axis] = vertices[faces[f, k], axis]
            if guess >= 0 and distance2_to(made.surface, guess, desk.point) <= most2:
                continue
            face, distance2 = _to_made(made, v, most2, desk)
            guess = face
            if is_sure and distance2 > most2:
                face, distance2 = to_all_made(made, most2, desk, face, distance2)
            if face >= 0 and distance2 > most2:
                farthest, most2 = 3 * np.int64(f) + k, distance2
                if most2 >= limit2:
                    return farthest, most2
    return farthest, most2


@cold_part
def farthest_of_patches(made, patches, v, is_sure, most2, limit2, desk):
    """The same in the patch of a vertex, all corners, and in those around it, the first ones."""
    farthest, most2 = _farthest_of_patch(made, patches, v, 3, is_sure, most2, limit2, desk)
    corner = made.first_corner[v]
    while corner >= 0 and most2 < limit2:
        for u in _ahead_and_rim(made, corner):
            if u >= 0:
                found, most2 = _farthest_of_patch(made, patches, u, 1, is_sure, most2, limit2, desk)
                farthest = found if found >= 0 else farthest
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            break
    return farthest, most2


@cold_part
def find_spot(made, patches, v, of_patches, least2, desk):
    """Find the worst spot at a vertex.

    Returns
    -------
    of_made, of_given : int
        The number of the point on either surface, -1 on the other one, or on both.
    most2 : float
        Its squared distance, not less than what is of interest.
    """
    of_made, most2 = farthest_of_made(made, patches, v, True, MIDDLE, least2, np.inf, desk)
    if of_made >= 0:
        of_made, most2 = farthest_of_made(made, patches, v, True, 1, least2, np.inf, desk)
    of_given = np.int64(-1)
    if of_patches:
        of_given, most2 = farthest_of_patches(*(made, patches, v, True, most2, np.inf, desk))
    if desk.search.left[0] < 0:
        return np.int64(-1), np.int64(-1), least2
    return of_made if of_given < 0 else np.int64(-1), of_given, most2
