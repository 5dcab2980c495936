r"""Spots where a surface is far from the one that it was made of, and how they are lowered.

Samples of the surface given do not see a face that spans a hollow: they are near to the faces
beside it. So points of the surface made are looked at, too. Each belongs to one vertex: it is the
vertex itself, or on an edge to a later one, or in the middle of a face of which it is the first.

             made
     a _________.________ b        When the corners j of a face with a spot at the barycentric
       \        | d      /         coordinates l_j move by l_j d / (sum of l_j^2), the spot moves by
        \_      v      _/          d, all the way to the other surface. Part of the way may be
          \___  ______/            better for what is around it.
             given
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels import boxes
from tetsimplify.kernels.boxes import IN_BOX, PER_FACE, WIDTH
from tetsimplify.kernels.corners import face_of, others
from tetsimplify.kernels.geometry import cross, dot, edge_vector, twice_area
from tetsimplify.kernels.jit import cold_part, inlined, kernel_in_place, part
from tetsimplify.kernels.patches import (
    THIRD,
    Search,
    Surface,
    distance2_to,
    near_face,
    nearest_face,
    nearest_of_all,
)

FACE, EDGE, RIM = 0, 1, 2  # where a point of a corner is, see `_put_point`
N_KINDS = 3
EIGHTHS = 8  # of an edge, between points on it
VERTEX, MIDDLE = 0, EIGHTHS // 2  # points of an edge, in these

LEAST_LEVER = 0.1  # how much a spot moves with the corners of its face, at least
SHARES = (0.5, 1.0, 0.25)  # of the way, in the order that they are tried in
GAIN = 0.97  # of the distance may be left around a spot, at most
ENOUGH = 0.75  # of the distance: less than this is not looked for
LEAST_AREA = 0.25  # of what the area of a face was
GIVE_UP = 0.9  # of the distance of a spot that cannot be lowered: others count from there on


class Made(NamedTuple):
    """The surface made, and what may be done with it."""

    surface: Surface  # its vertices are moved
    first_corner: np.ndarray  # int32 (n,), the corner table, in order
    next_corner: np.ndarray  # int32 (3 m,)
    held: np.ndarray  # uint8 (n,): vertices that stay
    normals: np.ndarray  # float64 (m, 4): normals that faces may not turn from, and areas
    cosine: float  # of the largest angle by which they may turn
    boxes: np.ndarray  # float64 (n_groups, 6, WIDTH): around the faces, see boxes.py


class Candidates(NamedTuple):
    """Vertices with the worst spots, probably, the farthest ones first."""

    vertex: np.ndarray  # int64 (k,)
    about2: np.ndarray  # float64 (k,): what no squared distance exceeds, as far as is known
    of_patches: np.ndarray  # bool (k,): whether points given around them are measured, too
    exact2: np.ndarray  # float64 (k,), out: the largest squared distances


class Limits(NamedTuple):
    """What is worth it."""

    known2: float  # a squared distance that there is
    least: float  # part of the largest distance: less is of no interest
    exact2: float  # squared distance that is as good as none
    n_tries: int  # how often it is tried


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
def _put_point(made, v, corner, kind, eighth, point):
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
def _enlarge_boxes_around(made, v):
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
            _put_point(made, v, corner, EDGE, VERTEX, desk.point)
            far2[v] = _distance2_about(patches, v, v, v, desk)
        while corner >= 0:
            for kind in range(N_KINDS):
                p, q = _put_point(made, v, corner, kind, MIDDLE, desk.point)
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
def _to_given(patches, v, p, q, limit2, desk):
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
def _to_all_made(made, limit2, desk, best, best2):
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
# A point of the surface made has a number: the corner, the kind and the eighth of `_put_point`.
# One of the surface given has that of its corner.


@cold_part
def _farthest_of_made(made, patches, v, is_alone, step, most2, limit2, desk):
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
                p, q = _put_point(made, v, corner, kind, eighth, desk.point)
                if p < 0 or (is_alone and not (p > v and q > v) and eighth != VERTEX):
                    continue
                face, distance2 = _to_given(patches, v, p, q, most2, desk)
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
    `_farthest_of_made`.
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
                face, distance2 = _to_all_made(made, most2, desk, face, distance2)
            if face >= 0 and distance2 > most2:
                farthest, most2 = 3 * np.int64(f) + k, distance2
                if most2 >= limit2:
                    return farthest, most2
    return farthest, most2


@cold_part
def _farthest_of_patches(made, patches, v, n_corners, is_sure, most2, limit2, desk):
    """The same in the patches of a vertex, with all corners, and of those around it."""
    farthest, most2 = _farthest_of_patch(made, patches, v, 3, is_sure, most2, limit2, desk)
    corner = made.first_corner[v]
    while corner >= 0 and most2 < limit2:
        for u in _ahead_and_rim(made, corner):
            if u >= 0:
                found, most2 = _farthest_of_patch(
                    made, patches, u, n_corners, is_sure, most2, limit2, desk
                )
                farthest = found if found >= 0 else farthest
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            break
    return farthest, most2


@cold_part
def _find_spot(made, patches, v, of_patches, least2, desk):
    """Find the worst spot at a vertex.

    Returns
    -------
    of_made, of_given : int
        The number of the point on either surface, -1 on the other one, or on both.
    most2 : float
        Its squared distance, not less than what is of interest.
    """
    of_made, most2 = _farthest_of_made(made, patches, v, True, MIDDLE, least2, np.inf, desk)
    if of_made >= 0:
        of_made, most2 = _farthest_of_made(made, patches, v, True, 1, least2, np.inf, desk)
    of_given = np.int64(-1)
    if of_patches:
        of_given, most2 = _farthest_of_patches(*(made, patches, v, 1, True, most2, np.inf, desk))
    if desk.search.left[0] < 0:
        return np.int64(-1), np.int64(-1), least2
    return of_made if of_given < 0 else np.int64(-1), of_given, most2


# --- lowering -------------------------------------------------------------------------------------


@kernel_in_place
def lower_spots(made, patches, candidates, limits, desk):
    """Lower the worst spots at vertices, again and again; return how many times one was.

    Parameters
    ----------
    made : Made
    patches : Patches
    candidates : Candidates
    limits : Limits
    desk : Desk
    """
    order, exact2 = candidates.vertex, candidates.exact2
    _measure_exactly(made, patches, candidates, limits, desk)
    n_lowered, n_tries = 0, 0
    i = _largest(exact2)
    least2 = max(limits.least * limits.least * exact2[i], limits.exact2)
    while exact2[i] > least2 and n_tries < limits.n_tries:
        of_patches = candidates.of_patches[i]
        of_made, of_given, exact2[i] = _find_spot(made, patches, order[i], of_patches, least2, desk)
        if of_made >= 0 or of_given >= 0:
            n_tries += 1
            if of_made >= 0:
                f = _aim_at_given(made, patches, order[i], of_made, desk)
            else:
                f = _aim_at_point(made, patches, of_given, desk)
            if _lower(made, patches, f, exact2[i], desk):
                n_lowered += 1
                continue
            least2 = max(least2, GIVE_UP * GIVE_UP * exact2[i])
        exact2[i] = 0.0
        i = _largest(exact2)
    return n_lowered


@inlined
def _largest(numbers):
    """Where the largest number is, the first one of several."""
    largest = 0
    for i in range(numbers.size):
        if numbers[i] > numbers[largest]:
            largest = i
    return largest


@inlined
def _measure_exactly(made, patches, candidates, limits, desk):
    """The largest squared distances of points of vertices and, of some, of patches.

    0 of those that are of no interest, since others are so much farther.
    """
    most2 = limits.known2
    for i in range(len(candidates.vertex)):
        candidates.exact2[i] = 0.0
        least2 = limits.least * limits.least * most2
        if candidates.about2[i] > least2:
            of_made, of_given, distance2 = _find_spot(
                *(made, patches, candidates.vertex[i], candidates.of_patches[i], least2, desk)
            )
            if of_made >= 0 or of_given >= 0:
                candidates.exact2[i] = distance2
                most2 = max(most2, distance2)


@inlined
def _aim_at_given(made, patches, v, number, desk):
    """Tell where on a face made a point is, and the way from there; return the face."""
    eighth, kind = number % EIGHTHS, number // EIGHTHS % N_KINDS
    corner = number // EIGHTHS // N_KINDS
    p, q = _put_point(made, v, corner, kind, eighth, desk.point)
    face, _ = _to_given(patches, v, p, q, 0.0, desk)
    _find_nearest_point(patches.given, face, desk.point, desk.way)
    f = face_of(corner if kind != RIM else made.next_corner[corner])
    for k in range(3):
        desk.way[k] -= desk.point[k]
        if kind == FACE:
            desk.weights[k] = THIRD
        else:
            w = made.surface.faces[f, k]
            there = eighth / EIGHTHS
            desk.weights[k] = 1.0 - there if w == v else there if w == q else 0.0
    return f


@inlined
def _aim_at_point(made, patches, number, desk):
    """Tell where on a face made is nearest to a point given, and the way; return the face."""
    for axis in range(3):
        a = patches.given.faces[number // 3, number % 3]
        desk.point[axis] = patches.given.vertices[a, axis]
    f, _ = _to_all_made(made, 0.0, desk, np.int64(-1), np.inf)
    _find_nearest_point(made.surface, f, desk.point, desk.way)
    vertices = made.surface.vertices
    a, b, c = made.surface.faces[f, 0], made.surface.faces[f, 1], made.surface.faces[f, 2]
    u, w = edge_vector(vertices, a, b), edge_vector(vertices, a, c)
    d = (
        desk.way[0] - vertices[a, 0],
        desk.way[1] - vertices[a, 1],
        desk.way[2] - vertices[a, 2],
    )
    n = cross(u, w)
    nn = dot(n, n)
    for k in range(3):
        desk.way[k] = desk.point[k] - desk.way[k]
        desk.weights[k] = 0.0
    if nn > 0.0:
        desk.weights[1], desk.weights[2] = dot(cross(d, w), n) / nn, dot(cross(u, d), n) / nn
        desk.weights[0] = 1.0 - desk.weights[1] - desk.weights[2]
    return f


@cold_part
def _find_nearest_point(surface, f, point, nearest):
    """Find the point of a face that is nearest to another point."""
    vertices = surface.vertices
    best2 = np.inf
    a, b, c = surface.faces[f, 0], surface.faces[f, 1], surface.faces[f, 2]
    for _ in range(3):
        u = edge_vector(vertices, a, b)
        w = point[0] - vertices[a, 0], point[1] - vertices[a, 1], point[2] - vertices[a, 2]
        uu = dot(u, u)
        s = min(max(dot(u, w) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
        d = w[0] - s * u[0], w[1] - s * u[1], w[2] - s * u[2]
        if dot(d, d) < best2:
            best2 = dot(d, d)
            for axis in range(3):
                nearest[axis] = vertices[a, axis] + s * u[axis]
        a, b, c = b, c, a
    u, w = edge_vector(vertices, a, b), edge_vector(vertices, a, c)
    d = point[0] - vertices[a, 0], point[1] - vertices[a, 1], point[2] - vertices[a, 2]
    n = cross(u, w)
    nn = dot(n, n)
    s, t = dot(cross(d, w), n), dot(cross(u, d), n)
    if s > 0.0 and t > 0.0 and s + t < nn:
        for axis in range(3):
            nearest[axis] = vertices[a, axis] + (s * u[axis] + t * w[axis]) / nn


@inlined
def _lower(made, patches, f, distance2, desk):
    """Move the corners of a face, or one of them, to where it is best; return whether any is."""
    for k in range(3):
        for axis in range(3):
            desk.before[k, axis] = made.surface.vertices[made.surface.faces[f, k], axis]
    known2, least2, is_lower = ENOUGH * ENOUGH * distance2, GAIN * GAIN * distance2, False
    for only in range(-1, 3):
        lever = 0.0
        for k in range(3):
            if _moves(made, f, k, only, desk.weights):
                lever += desk.weights[k] * desk.weights[k]
        if not lever > LEAST_LEVER:
            continue
        for share in SHARES:
            _move(made, f, only, share / lever, desk)
            worst2 = _worst_around(made, patches, f, only, known2, least2, desk)
            if worst2 < least2:
                is_lower, least2 = True, worst2
                for k in range(3):
                    for axis in range(3):
                        desk.best[k, axis] = made.surface.vertices[made.surface.faces[f, k], axis]
            if worst2 <= known2:
                break
        for k in range(3):
            for axis in range(3):
                made.surface.vertices[made.surface.faces[f, k], axis] = desk.before[k, axis]
        if is_lower:
            break
    for k in range(3 if is_lower else 0):
        for axis in range(3):
            made.surface.vertices[made.surface.faces[f, k], axis] = desk.best[k, axis]
    for k in range(3 if is_lower else 0):
        _enlarge_boxes_around(made, made.surface.faces[f, k])
    return is_lower


@inlined
def _moves(made, f, k, only, weights):
    """Whether a corner of a face moves, of all, or of one only."""
    return not made.held[made.surface.faces[f, k]] and weights[k] > 0.0 and (only < 0 or only == k)


@inlined
def _move(made, f, only, by, desk):
    """Move corners of a face from where they were."""
    for k in range(3):
        if _moves(made, f, k, only, desk.weights):
            for axis in range(3):
                step = by * desk.weights[k] * desk.way[axis]
                made.surface.vertices[made.surface.faces[f, k], axis] = desk.before[k, axis] + step


@inlined
def _worst_around(made, patches, f, only, most2, limit2, desk):
    """The largest squared distance of what moves with corners of a face, or what is known.

    Any beyond the limit will do, and infinity where faces are harmed.
    """
    for k in range(3):
        if _moves(made, f, k, only, desk.weights) and _is_harmed(made, made.surface.faces[f, k]):
            return np.inf
    for k in range(3):
        if _moves(made, f, k, only, desk.weights) and most2 < limit2:
            v = made.surface.faces[f, k]
            _, most2 = _farthest_of_made(made, patches, v, False, 1, most2, limit2, desk)
    for k in range(3):
        if _moves(made, f, k, only, desk.weights) and most2 < limit2:
            v = made.surface.faces[f, k]
            _, most2 = _farthest_of_patches(*(made, patches, v, 1, False, most2, limit2, desk))
    return most2


@inlined
def _is_harmed(made, v):
    """Whether a face around a vertex has turned too far or become too small."""
    vertices, faces = made.surface
    corner = made.first_corner[v]
    while True:
        f = face_of(corner)
        normal = made.normals[f]
        n = twice_area(vertices, faces[f, 0], faces[f, 1], faces[f, 2])
        length = np.sqrt(dot(n, n))
        along = n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2]
        if not (along > made.cosine * length and 0.5 * length >= LEAST_AREA * normal[3]):
            return True
        corner = made.next_corner[corner]
        if corner == made.first_corner[v]:
            return False
