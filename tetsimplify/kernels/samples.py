r"""Samples of a surface, and for each the nearest face of another one that was made of it.

What the surface was merged into tells where to look: in the star of one vertex. Its faces are
looked at several at once, in lanes: loops of LANES steps without branches, which the compiler turns
into wide instructions. All lengths are those of a frame in which the surface has a size of about
one.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import ahead, behind, face_of, others
from tetsimplify.kernels.geometry import edge_vector, twice_area
from tetsimplify.kernels.jit import kernel_in_place, part
from tetsimplify.kernels.prefetch import prefetch_row

LANES = 8  # faces that are looked at together
# Rows of a block: gradients of the barycentric coordinates of the two other corners, the normal,
# the squared height of the face over its longer side here, and which corner it is.
ONE, OTHER, NORMAL, HEIGHT2, CORNER = 0, 3, 6, 9, 10
N_ROWS = 11
LINES = 2  # rows in a line of a cache

AHEAD = 16  # samples whose corners are fetched before
BATCH = 64  # samples whose memory is fetched together
FLAT_CORNER = 1e-10  # squared sine of an angle below which a face has no normal that can be told
BESIDE = 1e-12  # of the area of a face: squared distance from it that is rounding
FAR = np.int32(0x7149F2CA)  # the bits of 1e30: of floats that are not negative they are in order


class Stars(NamedTuple):
    """The faces around each vertex, in blocks of LANES of them."""

    first: np.ndarray  # int32 (n + 1,): the first block of each vertex
    lanes: np.ndarray  # float32 (k, N_ROWS, LANES)
    corners: np.ndarray  # int32, the same memory
    rows: np.ndarray  # float32 (k * N_ROWS, LANES), the same memory


class Desk(NamedTuple):
    """Where the samples of a part are, before they are sorted."""

    place: np.ndarray  # float64 (BATCH, 6): where it is, and the normal of the surface there
    found: np.ndarray  # int32 (BATCH, 2): the vertex, and the nearest corner of its star
    weights: np.ndarray  # float64 (BATCH, 2): barycentric coordinates of the two other corners
    distance2: np.ndarray  # float32 (LANES,)
    bits: np.ndarray  # int32, the same memory
    turned: np.ndarray  # float32 (3,)
    samples: "Samples"


class Samples(NamedTuple):
    """Samples of the surface given."""

    face: np.ndarray  # int32 (k,): the nearest face
    foot: np.ndarray  # float32 (k, 3): barycentric coordinates of its corners 0 and 1; the height


# --- faces and stars ------------------------------------------------------------------------------


@part
def measure_face(vertices, a, b, c, normal):
    """Fill a row with the unit normal and the area of a face."""
    x, y, z = twice_area(vertices, a, b, c)
    length = np.sqrt(x * x + y * y + z * z)
    q = 1.0 / length if length > 0.0 else 0.0
    normal[0], normal[1], normal[2], normal[3] = x * q, y * q, z * q, 0.5 * length


@kernel_in_place
def find_normals(places, faces, first, last, normals):
    """Unit normals and areas of the faces from `first` to `last`, in rows; float64 (m, 4)."""
    for f in range(first, last):
        measure_face(places, faces[f, 0], faces[f, 1], faces[f, 2], normals[f])


@kernel_in_place
def count_blocks(first_corner, next_corner, first, last, counts):
    """How many blocks each of the vertices from `first` to `last` has; return the sum."""
    total = 0
    for v in range(first, last):
        n = 0
        corner = first_corner[v]
        while corner >= 0:
            n += 1
            corner = next_corner[corner]
            if corner == first_corner[v]:
                break
        counts[v] = (n + LANES - 1) // LANES
        total += counts[v]
    return total


@kernel_in_place
def number_blocks(first, last, number, firsts):
    """Turn counts of the vertices from `first` to `last` into first blocks, from a number on."""
    for v in range(first, last):
        n = firsts[v]
        firsts[v] = number
        number += n


@kernel_in_place
def fill_stars(places, corner_vertex, links, normals, first, last, stars):
    """Fill the blocks of the vertices from `first` to `last`.

    Parameters
    ----------
    places : float64 (n, 3)
    corner_vertex : int32 (3 m,)
    links : tuple
        `first_corner`, int32 (n,), and `next_corner`, int32 (3 m,), the corner table.
    normals : float64 (m, 4)
    first, last : int
    stars : Stars
    """
    first_corner, next_corner = links
    for v in range(first, last):
        begin, end = stars.first[v], stars.first[v + 1]
        i = LANES * begin
        corner = first_corner[v]
        while corner >= 0:
            i += _fill_lane(places, corner_vertex, corner, normals, stars, i)
            corner = next_corner[corner]
            if corner == first_corner[v]:
                break
        # What is left of the blocks is the last face again, which is never nearer than itself.
        last_lane = i - 1
        for j in range(i, LANES * end):
            to, lane = j // LANES, j % LANES
            if last_lane >= LANES * begin:
                for row in range(N_ROWS):
                    stars.corners[to, row, lane] = stars.corners[
                        last_lane // LANES, row, last_lane % LANES
                    ]
            else:  # no face at all
                for row in range(CORNER):
                    stars.lanes[to, row, lane] = 0.0
                stars.corners[to, CORNER, lane] = -1


@part
def _fill_lane(places, corner_vertex, corner, normals, stars, i):
    """Fill the i-th lane with the face of a corner; 0 if that face is degenerate, else 1."""
    v = corner_vertex[corner]
    p, q = others(corner_vertex, corner)
    f = face_of(corner)
    ux, uy, uz = edge_vector(places, v, p)
    wx, wy, wz = edge_vector(places, v, q)
    uu, ww = ux * ux + uy * uy + uz * uz, wx * wx + wy * wy + wz * wz
    twice = 2.0 * normals[f, 3]
    if not twice * twice > FLAT_CORNER * uu * ww:
        return 0
    nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
    s = 1.0 / twice
    lanes, lane = stars.lanes[i // LANES], i % LANES
    lanes[ONE, lane] = s * (wy * nz - wz * ny)
    lanes[ONE + 1, lane] = s * (wz * nx - wx * nz)
    lanes[ONE + 2, lane] = s * (wx * ny - wy * nx)
    lanes[OTHER, lane] = s * (ny * uz - nz * uy)
    lanes[OTHER + 1, lane] = s * (nz * ux - nx * uz)
    lanes[OTHER + 2, lane] = s * (nx * uy - ny * ux)
    lanes[NORMAL, lane], lanes[NORMAL + 1, lane], lanes[NORMAL + 2, lane] = nx, ny, nz
    lanes[HEIGHT2, lane] = twice * twice / max(uu, ww)
    stars.corners[i // LANES, CORNER, lane] = corner
    return 1


# --- samples --------------------------------------------------------------------------------------


@kernel_in_place
def take_samples(given, frame, places, corner_vertex, normals, stars, which, desk):
    """Take samples and find their nearest faces; return how many were of use.

    The i-th sample is the middle of an edge of the face ``offset + i * stride``; edge 0, 1, 2 in
    turn. What an end of that was merged into tells in which star to look. Where the sample is past
    the far edge of the nearest face there, it is looked for once more from the nearer end of that.

    In batches, so that what the next step needs is on its way from memory.

    Parameters
    ----------
    given : tuple
        Vertices, faces and the map of the vertices: float64 (n0, 3), int32 (m0, 3), int32 (n0,).
    frame : tuple
        Origin, float64 (3,), and scale.
    places : float64 (n, 3)
    corner_vertex : int32 (3 m,)
    normals : float64 (m, 4)
    stars : Stars
    which : tuple
        The first sample, the one after the last, the stride and the offset.
    desk : Desk
    """
    i, last, stride, offset = which
    n_used = 0
    while i < last:
        end = min(i + BATCH, last)
        n = _begin_batch(given, frame, places, stars, i, end, stride, offset, desk)
        for j in range(n):
            block = stars.first[desk.found[j, 0]]
            for row in range(0, N_ROWS, LINES):
                prefetch_row(stars.rows, N_ROWS * np.int64(block) + row)
        for j in range(n):
            _find_nearest(places, corner_vertex, stars, desk, j)
            if desk.found[j, 1] >= 0:
                prefetch_row(normals, face_of(desk.found[j, 1]))
        for j in range(n):
            if desk.found[j, 1] >= 0:
                n_used += _keep_sample(places, corner_vertex, normals, desk, j, n_used)
        i = end
    return n_used


@part
def _begin_batch(given, frame, places, stars, first, last, stride, offset, desk):
    """Where samples are, the normal there, and the vertex to look around; return how many."""
    vertices, faces, vertex_map = given
    origin, scale = frame
    n = 0
    for i in range(first, last):
        f, k = offset + i * stride, i % 3
        later = min(f + AHEAD * stride, len(faces) - 1)
        for corner in range(3):
            prefetch_row(vertices, faces[later, corner])
        prefetch_row(vertex_map, faces[later, k])
        a, b, c = faces[f, k], faces[f, k + 1 if k < 2 else 0], faces[f, k - 1 if k > 0 else 2]
        v = vertex_map[a]
        if v < 0:
            v = vertex_map[b]
        if v < 0:
            continue
        for axis in range(3):
            middle = 0.5 * vertices[a, axis] + 0.5 * vertices[b, axis]
            desk.place[n, axis] = (middle - origin[axis]) * scale
        desk.place[n, 3], desk.place[n, 4], desk.place[n, 5] = twice_area(vertices, a, b, c)
        desk.found[n, 0] = v
        prefetch_row(stars.first, v)
        prefetch_row(places, v)
        n += 1
    return n


@part
def _find_nearest(places, corner_vertex, stars, desk, j):
    """Find the nearest face of the j-th sample of a batch, and where it is there."""
    v = desk.found[j, 0]
    corner = np.int32(-1)
    for attempt in range(2):
        x, y, z = (
            desk.place[j, 0] - places[v, 0],
            desk.place[j, 1] - places[v, 1],
            desk.place[j, 2] - places[v, 2],
        )
        i = _nearest_lane(stars, v, np.float32(x), np.float32(y), np.float32(z), desk)
        corner = np.int32(-1)
        if i < 0:
            break
        lanes, lane = stars.lanes[i // LANES], i % LANES
        corner = stars.corners[i // LANES, CORNER, lane]
        one = lanes[ONE, lane] * x + lanes[ONE + 1, lane] * y + lanes[ONE + 2, lane] * z
        other = lanes[OTHER, lane] * x + lanes[OTHER + 1, lane] * y + lanes[OTHER + 2, lane] * z
        desk.weights[j, 0], desk.weights[j, 1] = one, other
        if corner < 0 or one + other <= 1.0 or attempt == 1:
            break
        p, q = others(corner_vertex, corner)
        v = p if one > other else q
    desk.found[j, 0], desk.found[j, 1] = v, corner


@part
def _nearest_lane(stars, v, x, y, z, desk):
    """Which lane of all has the nearest face of the star of v to a place relative to v, about.

    Only the plane of the face and its two sides at v count. The number of the lane stands in the
    last bits of the distance, so that the least of these numbers tells both.
    """
    distance2, bits = desk.distance2, desk.bits
    least, nearest = FAR, np.int64(-1)
    for block in range(stars.first[v], stars.first[v + 1]):
        lanes = stars.lanes[block]
        for i in range(LANES):
            one = lanes[ONE, i] * x + lanes[ONE + 1, i] * y + lanes[ONE + 2, i] * z
            other = lanes[OTHER, i] * x + lanes[OTHER + 1, i] * y + lanes[OTHER + 2, i] * z
            height = lanes[NORMAL, i] * x + lanes[NORMAL + 1, i] * y + lanes[NORMAL + 2, i] * z
            beside = min(min(one, other), np.float32(0.0))
            distance2[i] = height * height + beside * beside * lanes[HEIGHT2, i]
        here = least
        for i in range(LANES):
            here = min(here, np.int32((bits[i] & np.int32(-LANES)) | np.int32(i)))
        if here < least:
            nearest = LANES * np.int64(block) + (here & np.int32(LANES - 1))
        least = here
    return nearest


@part
def _keep_sample(places, corner_vertex, normals, desk, j, n):
    """Make the j-th sample of a batch the n-th one of all; 0 if it is of no use, else 1.

    Those are of none where the surfaces face opposite ways, and those that are seen from aside:
    past a rim.
    """
    v, corner = desk.found[j, 0], desk.found[j, 1]
    f = face_of(corner)
    nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
    if desk.place[j, 3] * nx + desk.place[j, 4] * ny + desk.place[j, 5] * nz < 0.0:
        return 0
    height = (
        (desk.place[j, 0] - places[v, 0]) * nx
        + (desk.place[j, 1] - places[v, 1]) * ny
        + (desk.place[j, 2] - places[v, 2]) * nz
    )
    one, other = desk.weights[j, 0], desk.weights[j, 1]
    here = 1.0 - one - other
    if here < 0.0 or one < 0.0 or other < 0.0:  # beside the face: its nearest point, about
        a, b, c = max(here, 0.0), max(one, 0.0), max(other, 0.0)
        q = 1.0 / (a + b + c)
        a, b, c = a * q, b * q, c * q
        p1, p2 = others(corner_vertex, corner)
        aside2 = 0.0
        for axis in range(3):
            aside = (one - b) * (places[p1, axis] - places[v, axis]) + (other - c) * (
                places[p2, axis] - places[v, axis]
            )
            aside2 += aside * aside
        if aside2 > height * height + BESIDE * normals[f, 3]:
            return 0
        here, one, other = a, b, c
    turned = desk.turned
    turned[corner - 3 * f] = here
    turned[ahead(corner) - 3 * f] = one
    turned[behind(corner) - 3 * f] = other
    desk.samples.face[n] = f
    desk.samples.foot[n, 0], desk.samples.foot[n, 1] = turned[0], turned[1]
    desk.samples.foot[n, 2] = height
    return 1


@kernel_in_place
def sort_samples(unsorted, n, bits, begin, ends, to):
    """Sort samples by groups of 2**bits faces, and keep their order in these.

    Parameters
    ----------
    unsorted : Samples
    n : int
        How many there are.
    bits : int
    begin : int
        Where they go.
    ends : int64 (n_groups + 1,), out
        Where the samples of each group begin, and all end.
    to : Samples
    """
    ends[:] = 0
    for i in range(n):
        ends[(unsorted.face[i] >> bits) + 1] += 1
    ends[0] = begin
    for group in range(1, ends.size):
        ends[group] += ends[group - 1]
    for i in range(n):
        group = unsorted.face[i] >> bits
        k = ends[group]
        to.face[k] = unsorted.face[i]
        for column in range(3):
            to.foot[k, column] = unsorted.foot[i, column]
        ends[group] += 1
    for group in range(ends.size - 1, 0, -1):
        ends[group] = ends[group - 1]
    ends[0] = begin
