r"""Spots where two surfaces are far apart, and how they are lowered.

Towards the other surface, if all that moves with them comes to be nearer than the spot was:

             made
     a _________.________ b        When the corners j of a face with a spot at the barycentric
       \        | d      /         coordinates l_j move by l_j d / (sum of l_j^2), the spot moves by
        \_      v      _/          d, all the way to the other surface. Part of the way may be
          \___  ______/            better for what is around it.
             given
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import face_of
from tetsimplify.kernels.geometry import cross, dot, edge_vector, twice_area
from tetsimplify.kernels.jit import cold_part, inlined, kernel_in_place
from tetsimplify.kernels.patches import THIRD
from tetsimplify.kernels.spots import (
    EIGHTHS,
    FACE,
    N_KINDS,
    RIM,
    enlarge_boxes_around,
    farthest_of_made,
    farthest_of_patches,
    find_spot,
    put_point,
    to_all_made,
    to_given,
)

LEAST_LEVER = 0.1  # how much a spot moves with the corners of its face, at least
SHARES = (0.5, 1.0, 0.25)  # of the way, in the order that they are tried in
GAIN = 0.97  # of the distance may be left around a spot, at most
ENOUGH = 0.75  # of the distance: less than this is not looked for
LEAST_AREA = 0.25  # of what the area of a face was
GIVE_UP = 0.9  # of the distance of a spot that cannot be lowered: others count from there on


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
        of_made, of_given, exact2[i] = find_spot(made, patches, order[i], of_patches, least2, desk)
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
            of_made, of_given, distance2 = find_spot(
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
    p, q = put_point(made, v, corner, kind, eighth, desk.point)
    face, _ = to_given(patches, v, p, q, 0.0, desk)
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
    f, _ = to_all_made(made, 0.0, desk, np.int64(-1), np.inf)
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
        enlarge_boxes_around(made, made.surface.faces[f, k])
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
            _, most2 = farthest_of_made(made, patches, v, False, 1, most2, limit2, desk)
    for k in range(3):
        if _moves(made, f, k, only, desk.weights) and most2 < limit2:
            v = made.surface.faces[f, k]
            _, most2 = farthest_of_patches(*(made, patches, v, False, most2, limit2, desk))
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
