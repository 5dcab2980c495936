r"""Edges turned over, where the surface then is nearer to samples of another one.

           b                   b
         / | \               /   \            Edge ab with the faces apb and abr becomes edge pr
       /   |   \           /  g    \          with the faces apr (in place of apb) and pbr.
      r  g | f  p   ->    r --------- p
       \   |   /           \  f    /
         \ | /               \   /
           a                   a

Seen along u, which is at right angles to both diagonals, ab and pr cross, and pr is higher there by
t. Away from there the two surfaces come together like a tent: where the barycentric coordinates are
l_a and l_b, and the diagonals cross at the part s of the way from a to b, the new surface is above
the old one by t phi, with phi = min(l_a / (1 - s), l_b / s). So a sample at the height r comes to
be at r - t phi, and all that is needed of the samples of a face is the sum of r^2, and for each
side those of r phi and phi^2 (of s (1 - s) phi, which needs no division).

Beside that the shape of the triangles counts, by their 2 r/R (twice the radius of the incircle over
that of the circumcircle): where the four vertices are in a plane it decides alone.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import ahead, behind, face_of, others
from tetsimplify.kernels.geometry import cross, dot, edge_vector, squared_length
from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.samples import measure_face

# Columns of the sums of a face. The first three groups are for the sides that begin at its corners.
SPLIT, RISE, TENT2 = 0, 3, 6  # s, -1 where the side may not be turned over; of r phi; of phi^2
SHIFT = 9  # by how much the face has risen at its corners
R2, COUNT = 12, 13  # of r^2, how many samples
N_SUMS = 16  # a line of a cache

# Columns of an edge, at the corner of one end that is before it.
LIFT, SHAPE, COS_F, COS_G, COS2, CAP = 0, 1, 2, 3, 4, 5
N_OF_EDGE = 6

CAP_GAIN = 8.0  # more than all else can gain or lose
NO_EDGE = np.float32(-1e30)  # in place of a gain
THIN = 1e-5  # height over length of faces whose normal cannot be told


class Flipper(NamedTuple):
    """What says which edges are turned over."""

    cosine: float  # of the largest angle by which a face may turn
    shape: float  # weight of the shape, beside the relative change of the error
    least: float  # gain
    worst: float  # 2 r/R below which no triangle may become worse than the worse one was
    few: float  # samples: with fewer, only edges of flat faces are turned over
    rise: float  # how many times the squared error may be what it was
    doubt: float  # so many samples count by half
    exact2: float  # squared height of what is as good as exact


# --- what an edge would become --------------------------------------------------------------------


@part
def _shape(double, a, b, c):
    """2 r/R of a triangle, by its doubled area and its sides."""
    return 4.0 * double * double / (a * b * c * (a + b + c))


@part
def _is_thin(double, a, b, c):
    """Whether the normal of a triangle cannot be told."""
    longest = max(a, b, c)
    return not double > THIN * longest * longest


@part
def _turns(new, length, old, old_length, cosine):
    """Whether a new face turns too far from an old one."""
    return not dot(new, old) > cosine * length * old_length


@part
def _look_at(places, a, p, b, r, flipper, of_edge):
    """Tell what turning over ab would do; return s, or -1 where it must not be done."""
    ab, ap, ar = edge_vector(places, a, b), edge_vector(places, a, p), edge_vector(places, a, r)
    pr, pb = edge_vector(places, p, r), edge_vector(places, p, b)
    u = cross(ab, pr)
    double = np.sqrt(dot(u, u))
    if not double > 0.0:
        return -1.0
    f, g, new_f, new_g = cross(ap, ab), cross(ab, ar), cross(ap, ar), cross(pb, pr)
    f_up, g_up = dot(f, u) / double, dot(g, u) / double
    new_f_up, new_g_up = dot(new_f, u) / double, dot(new_g, u) / double
    if not (new_f_up > 0.0 and new_g_up > 0.0):
        return -1.0
    len_f, len_g = np.sqrt(dot(f, f)), np.sqrt(dot(g, g))
    len_new_f, len_new_g = np.sqrt(dot(new_f, new_f)), np.sqrt(dot(new_g, new_g))
    l_ab, l_ap, l_ar = np.sqrt(dot(ab, ab)), np.sqrt(dot(ap, ap)), np.sqrt(dot(ar, ar))
    l_pr, l_pb = np.sqrt(dot(pr, pr)), np.sqrt(dot(pb, pb))
    l_br = np.sqrt(squared_length(places, b, r))
    flat_f, flat_g = _is_thin(len_f, l_ab, l_ap, l_pb), _is_thin(len_g, l_ab, l_ar, l_br)
    if (
        (flat_f and flat_g)
        or _is_thin(len_new_f, l_ap, l_ar, l_pr)
        or _is_thin(len_new_g, l_pb, l_br, l_pr)
    ):
        return -1.0
    if not flat_f and (
        not f_up > 0.0
        or _turns(new_f, len_new_f, f, len_f, flipper.cosine)
        or _turns(new_g, len_new_g, f, len_f, flipper.cosine)
    ):
        return -1.0
    if not flat_g and (
        not g_up > 0.0
        or _turns(new_f, len_new_f, g, len_g, flipper.cosine)
        or _turns(new_g, len_new_g, g, len_g, flipper.cosine)
    ):
        return -1.0
    old_1 = _shape(len_f, l_ap, l_pb, l_ab) if not flat_f else 0.0
    old_2 = _shape(len_g, l_ab, l_br, l_ar) if not flat_g else 0.0
    new_1, new_2 = _shape(len_new_f, l_ap, l_pr, l_ar), _shape(len_new_g, l_pb, l_br, l_pr)
    if min(new_1, new_2) < min(flipper.worst, min(old_1, old_2)):
        return -1.0
    cos_f, cos_g = new_f_up / len_new_f, new_g_up / len_new_g
    of_edge[LIFT] = dot(ap, u) / double
    of_edge[SHAPE] = new_1 + new_2 - old_1 - old_2
    of_edge[COS_F] = f_up / len_f if not flat_f else 1.0
    of_edge[COS_G] = g_up / len_g if not flat_g else 1.0
    of_edge[COS2] = 0.5 * (cos_f * cos_f + cos_g * cos_g)
    of_edge[CAP] = flat_f or flat_g
    return new_f_up / (new_f_up + new_g_up)


@kernel_in_place
def look_at_edges(places, corner_vertex, links, held, stale, flipper, first, last, sums, edges):
    """Tell what turning over the edges of the vertices from `first` to `last` would do.

    Each edge is looked at from its lower end, or from the one that is marked as `stale`.

    Parameters
    ----------
    places : float64 (n, 3)
    corner_vertex : int32 (3 m,)
    links : tuple
        `first_corner`, int32 (n,), and `next_corner`, int32 (3 m,), the corner table, in order.
    held : uint8 (n,)
        Edges between two of these stay, and no new ones come to be.
    stale : uint8 (n,)
        Only edges with a vertex that is marked here are looked at.
    flipper : Flipper
    first, last : int
    sums : float32 (m, N_SUMS)
        Receives the splits.
    edges : float32 (3 m, N_OF_EDGE), out
    """
    first_corner, next_corner = links
    for a in range(first, last):
        corner = first_corner[a]
        while corner >= 0 and stale[a]:
            following = next_corner[corner]
            p, b = others(corner_vertex, corner)
            ahead_there, r = others(corner_vertex, following)
            edges[corner, LIFT] = NO_EDGE
            if ahead_there == b and p != r and (a < b or not stale[b]):
                s = -1.0
                if not ((held[a] and held[b]) or (held[p] and held[r])):
                    s = _look_at(places, a, p, b, r, flipper, edges[corner])
                f, g = face_of(corner), face_of(following)
                sums[f, SPLIT + behind(corner) - 3 * f] = 1.0 - s if s > 0.0 else -1.0
                sums[g, SPLIT + following - 3 * g] = s
                if s < 0.0:
                    edges[corner, LIFT] = NO_EDGE
            elif ahead_there != b:
                f, g = face_of(corner), face_of(following)
                sums[f, SPLIT + behind(corner) - 3 * f] = -1.0
                sums[g, SPLIT + following - 3 * g] = -1.0
            corner = following
            if corner == first_corner[a]:
                break


# --- samples --------------------------------------------------------------------------------------


@kernel_in_place
def sum_tents(samples, ends, faces, normals, steps, group, first, last, sums):
    """Add up the samples of a group of faces, from `first` to `last`, for all of their sides.

    Parameters
    ----------
    samples : samples.Samples
    ends : int64 (n_parts, n_groups + 1)
        Where the samples of each group begin in each part.
    faces : int32 (m, 3)
    normals : float64 (m, 4)
        Of the faces when the samples were taken.
    steps : float64 (n, 3)
        How the vertices have moved since then.
    group : int
    first, last : int
    sums : float32 (m, N_SUMS)
    """
    for f in range(first, last):
        of_face = sums[f]
        for column in range(RISE, N_SUMS):
            of_face[column] = 0.0
        for k in range(3):
            v = faces[f, k]
            of_face[SHIFT + k] = (
                normals[f, 0] * steps[v, 0]
                + normals[f, 1] * steps[v, 1]
                + normals[f, 2] * steps[v, 2]
            )
    for k in range(len(ends)):
        for i in range(ends[k, group], ends[k, group + 1]):
            _add_sample(samples.foot[i], sums[samples.face[i]])


@part
def _add_sample(foot, of_face):
    """Add a sample to the sums of its face."""
    a, b = foot[0], foot[1]
    c = np.float32(1.0) - a - b
    r = foot[2] - a * of_face[SHIFT] - b * of_face[SHIFT + 1] - c * of_face[SHIFT + 2]
    of_face[R2] += r * r
    of_face[COUNT] += np.float32(1.0)
    _add_to_side(a, b, r, of_face, 0)
    _add_to_side(b, c, r, of_face, 1)
    _add_to_side(c, a, r, of_face, 2)


@part
def _add_to_side(here, there, r, of_face, k):
    """Add a sample to the sums of the k-th side, whether that may be turned over or not."""
    s = of_face[SPLIT + k]
    tent = min(here * s, there * (np.float32(1.0) - s))
    of_face[RISE + k] += r * tent
    of_face[TENT2 + k] += tent * tent


# --- gains ----------------------------------------------------------------------------------------


@kernel_in_place
def find_gains(corners, edges, next_corner, sums, flipper, first, last, gains):
    """What turning over the edges at some corners, from the `first` to the `last` of them, gains.

    Parameters
    ----------
    corners : int64 (k,)
    edges : float32 (3 m, N_OF_EDGE)
    next_corner : int32 (3 m,)
    sums : float32 (m, N_SUMS)
    flipper : Flipper
    first, last : int
    gains : float32 (k,), out
        0 where nothing is gained.
    """
    for i in range(first, last):
        corner = corners[i]
        gains[i] = 0.0
        t = np.float64(edges[corner, LIFT])
        if t == NO_EDGE:
            continue
        gain = flipper.shape * np.float64(edges[corner, SHAPE])
        if edges[corner, CAP] != 0.0:
            gains[i] = CAP_GAIN + gain
            continue
        following = next_corner[corner]
        f, g = face_of(corner), face_of(following)
        n = np.float64(sums[f, COUNT] + sums[g, COUNT])
        if t * t > flipper.exact2 and n < flipper.few:
            continue
        if n > 0.0:
            k_f, k_g = behind(corner) - 3 * f, following - 3 * g
            old = np.float64(sums[f, R2] + sums[g, R2])
            s = np.float64(sums[g, SPLIT + k_g])
            t /= s * (1.0 - s)
            per_f, per_g = 1.0 / edges[corner, COS_F], 1.0 / edges[corner, COS_G]
            new = per_f * per_f * sums[f, R2] + per_g * per_g * sums[g, R2]
            new -= 2.0 * t * (per_f * sums[f, RISE + k_f] + per_g * sums[g, RISE + k_g])
            new += t * t * (sums[f, TENT2 + k_f] + sums[g, TENT2 + k_g])
            new = max(new * edges[corner, COS2], 0.0)
            floor = n * flipper.exact2
            if new > flipper.rise * old + floor:
                continue
            gain += (old - new) / (old + new + floor) * n / (n + flipper.doubt)
        if gain > flipper.least:
            gains[i] = gain


# --- caps -----------------------------------------------------------------------------------------


@kernel_in_place
def mark_thin(places, faces, first, last, thin):
    """Mark the vertices of the faces from `first` to `last` whose normal cannot be told.

    Parameters
    ----------
    places : float64 (n, 3)
    faces : int32 (m, 3)
    first, last : int
    thin : uint8 (n,)
        Marked with 1.
    """
    for f in range(first, last):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ab, ac, bc = edge_vector(places, a, b), edge_vector(places, a, c), edge_vector(places, b, c)
        double = cross(ab, ac)
        longest2 = max(dot(ab, ab), dot(ac, ac), dot(bc, bc))
        if not dot(double, double) > THIN * THIN * longest2 * longest2:
            thin[a] = thin[b] = thin[c] = 1


# --- turning over ---------------------------------------------------------------------------------


@part
def _walk(corner_vertex, next_corner, start, other):
    """Go around the vertex of a corner.

    Returns
    -------
    previous : int
        The corner before.
    meets : bool
        Whether there is an edge to the other vertex.
    n_more : int
        How many more faces there are than an inner vertex needs.
    """
    corner, previous, meets = start, start, False
    n_more = -3
    while True:
        p, q = others(corner_vertex, corner)
        meets |= p == other or q == other
        following = next_corner[corner]
        n_more += 1
        if others(corner_vertex, following)[0] != q:
            n_more += 1  # on the boundary one face less will do
        if following == start:
            previous = corner
            break
        corner = following
    return previous, meets, n_more


@kernel_in_place
def turn_over(order, places, corner_vertex, links, touched, stale, normals):
    """Turn edges over, one after the other, where the topology allows it; return how many.

    Faces of which a side has been turned over are left alone, since what was found out about
    them is no longer true.

    Parameters
    ----------
    order : int64 (k,)
        The corners of the edges, as of `look_at_edges`.
    places : float64 (n, 3)
    corner_vertex : int32 (3 m,)
    links : tuple
        `first_corner`, int32 (n,), and `next_corner`, int32 (3 m,), the corner table, in order.
    touched : uint8 (m,)
        Zeros.
    stale : uint8 (n,)
        Zeros; the vertices of faces that have changed are marked.
    normals : float64 (m, 4)
        Normals and areas, which are brought up to date.
    """
    first_corner, next_corner = links
    n = 0
    for i in order:
        j = next_corner[i]
        f, g = face_of(i), face_of(j)
        if touched[f] or touched[g]:
            continue
        at_p, f_at_b, g_at_b, at_r = ahead(i), behind(i), ahead(j), behind(j)
        a, b = corner_vertex[i], corner_vertex[g_at_b]
        p, r = corner_vertex[at_p], corner_vertex[at_r]
        before_p, meets, _ = _walk(corner_vertex, next_corner, at_p, r)
        if meets or _walk(corner_vertex, next_corner, i, r)[2] < 1:
            continue
        if _walk(corner_vertex, next_corner, g_at_b, r)[2] < 1:
            continue
        before_r, _, _ = _walk(corner_vertex, next_corner, at_r, p)
        next_corner[i] = next_corner[j]
        next_corner[g_at_b] = next_corner[f_at_b]
        if first_corner[a] == j:
            first_corner[a] = i
        if first_corner[b] == f_at_b:
            first_corner[b] = g_at_b
        next_corner[before_p], next_corner[j] = j, at_p
        next_corner[before_r], next_corner[f_at_b] = f_at_b, at_r
        corner_vertex[f_at_b], corner_vertex[j] = r, p
        touched[f] = touched[g] = 1
        stale[a] = stale[b] = stale[p] = stale[r] = 1
        measure_face(places, a, p, r, normals[f])
        measure_face(places, p, b, r, normals[g])
        n += 1
    return n
