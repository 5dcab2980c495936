r"""Patches: the faces of a surface given, by the vertex made that they were merged into.

A point of the surface that was made is near to the patches of the vertices around it, so what is
nearest to it is looked for there. First the middles of the faces are compared, several at once, in
loops without branches, which the compiler turns into wide instructions. The face whose middle is
nearest is the nearest one, or nearly so, almost always. Others can be nearer only as far as the
faces of the patch reach from their middles. The nearest of all need not be around there, above all
in planes: boxes around the patches of several vertices tell where else to look.

All lengths are those of a frame in which the surface has a size of about one.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels import boxes
from tetsimplify.kernels.boxes import IN_BOX, PER_FACE, WIDTH
from tetsimplify.kernels.jit import cold_part, kernel_in_place, part
from tetsimplify.kernels.nearest import distance2_to_face
from tetsimplify.kernels.samples import FAR

LANES = 32  # middles that are compared together
CHUNK = 64  # of which the numbers stand in the last bits
ROUNDED = 1.0 + 1e-4  # by which lengths in float32 may be wrong, and more
THIRD = 1.0 / 3.0


class Surface(NamedTuple):
    """A surface that distances are measured to."""

    vertices: np.ndarray  # float64 (n, 3)
    faces: np.ndarray  # int32 (m, 3)


class Patches(NamedTuple):
    """The faces given, by vertex."""

    given: Surface
    first: np.ndarray  # int32 (n + 2,): where the faces of each vertex begin, and all end
    face: np.ndarray  # int32 (k,)
    middle: np.ndarray  # float32 (3, k + LANES): of each of these, infinite after the last
    reach2: np.ndarray  # float64 (n,): how far they reach from their middles, squared
    boxes: np.ndarray  # float64 (n_groups, 6, WIDTH): around those of each vertex, see boxes.py


class Search(NamedTuple):
    """Working memory, and how much may still be done."""

    distance2: np.ndarray  # float32 (CHUNK,)
    bits: np.ndarray  # int32, the same memory
    to_boxes2: np.ndarray  # float64 (WIDTH,)
    left: np.ndarray  # int64 (1,): how many more faces may be looked at, about

    @classmethod
    def new(cls, left=0):
        """Allocate it."""
        distance2 = np.empty(CHUNK, np.float32)
        return cls(distance2, distance2.view(np.int32), np.empty(WIDTH), np.array([left]))


# --- listing --------------------------------------------------------------------------------------


@kernel_in_place
def count_faces(faces, vertex_map, first):
    """Count the faces of each vertex, for `list_faces`; return how many there are.

    Parameters
    ----------
    faces : int32 (m, 3)
    vertex_map : int32 (n given,)
        The vertex that each one given was merged into, -1 where it was removed.
    first : int32 (n + 2,)
        Zeros. Receives the begin of each vertex in the place after its own.
    """
    for i in range(len(faces)):
        v = _owner(vertex_map, faces, i)
        if v >= 0:
            first[v + 2] += 1
    for v in range(2, first.size):
        first[v] += first[v - 1]
    return first[first.size - 1]


@kernel_in_place
def list_faces(vertex_map, patches):
    """List the faces of each vertex, and put the begins where they belong.

    Parameters
    ----------
    vertex_map : int32 (n given,)
    patches : Patches
        The begins as of `count_faces`, zeros in `reach2`; the rest is filled.
    """
    vertices, faces = patches.given
    first, middle = patches.first, patches.middle
    for i in range(len(faces)):
        v = _owner(vertex_map, faces, i)
        if v < 0:
            continue
        j = first[v + 1]
        first[v + 1] += 1
        patches.face[j] = i
        a, b, c = faces[i, 0], faces[i, 1], faces[i, 2]
        for axis in range(3):
            middle[axis, j] = THIRD * (vertices[a, axis] + vertices[b, axis] + vertices[c, axis])
        for k in range(3):
            reach2 = 0.0
            for axis in range(3):
                reach = vertices[faces[i, k], axis] - middle[axis, j]
                reach2 += reach * reach
            patches.reach2[v] = max(patches.reach2[v], reach2)
    for axis in range(3):
        for i in range(LANES):
            middle[axis, patches.face.size + i] = np.inf


@kernel_in_place
def find_boxes(patches):
    """Find the boxes around the patches.

    Parameters
    ----------
    patches : Patches
        The boxes are filled.
    """
    boxes.clear(patches.boxes)
    for v in range(patches.reach2.size):
        reach = ROUNDED * np.sqrt(patches.reach2[v])
        for axis in range(3):
            low, high = np.float32(np.inf), np.float32(-np.inf)
            for i in range(patches.first[v], patches.first[v + 1]):
                low = min(low, patches.middle[axis, i])
                high = max(high, patches.middle[axis, i])
            boxes.enlarge(patches.boxes, v, axis, low - reach, high + reach)


@part
def _owner(vertex_map, faces, i):
    """The vertex that a face went to, -1 where nothing is left of it."""
    for k in range(3):
        v = vertex_map[faces[i, k]]
        if v >= 0:
            return v
    return np.int32(-1)


# --- looking for what is near ---------------------------------------------------------------------


@cold_part
def _scan(patches, v, x, y, z, search, least, nearest):
    """Find the middle in a patch that is nearest to a point, about, if nearer than what is known.

    What fills the last lanes is of the next vertices, or infinitely far.

    Returns
    -------
    least : int32
        The bits of the squared distance; the last ones tell which of a chunk it is.
    nearest : int
        The place in the list of faces.
    """
    x, y, z = np.float32(x), np.float32(y), np.float32(z)
    distance2, bits, _, _ = search
    begin, end = np.uint64(patches.first[v]), np.uint64(patches.first[v + 1])
    while begin < end:
        whole = (end - begin + np.uint64(LANES - 1)) // np.uint64(LANES) * np.uint64(LANES)
        n = min(np.uint64(CHUNK), whole)
        to = begin
        for i in range(n):
            dx = patches.middle[0, to] - x
            dy = patches.middle[1, to] - y
            dz = patches.middle[2, to] - z
            distance2[np.uint64(i)] = dx * dx + dy * dy + dz * dz
            to += np.uint64(1)
        here = FAR
        for i in range(n):
            here = min(here, (bits[np.uint64(i)] & np.int32(-CHUNK)) | np.int32(i))
        if here < least:
            least, nearest = here, np.int64(begin) + np.int64(here & np.int32(CHUNK - 1))
        begin += np.uint64(CHUNK)
    return least, nearest


@cold_part
def distance2_to(surface, f, point):
    """Squared distance from a point to a face."""
    return distance2_to_face(surface, f, point[0], point[1], point[2])


@cold_part
def near_face(patches, v, p, q, point, search):
    """A face near to a point, in the patches of three vertices, and its squared distance.

    It is that with the nearest middle, about; -1 where there is none. Equal vertices count once.
    """
    x, y, z = point[0], point[1], point[2]
    least, i = _scan(patches, v, x, y, z, search, FAR, np.int64(-1))
    if p != v:
        least, i = _scan(patches, p, x, y, z, search, least, i)
    if q != p:
        least, i = _scan(patches, q, x, y, z, search, least, i)
    if i < 0:
        return np.int32(-1), np.inf
    return patches.face[i], distance2_to(patches.given, patches.face[i], point)


@cold_part
def nearest_face(patches, v, point, search, best, best2):
    """The face of a patch that is nearest to a point, and its squared distance.

    The best that is known stays where it is nearer.
    """
    x, y, z = point[0], point[1], point[2]
    search.left[0] -= 1 + (patches.first[v + 1] - patches.first[v]) // LANES
    _, i = _scan(patches, v, x, y, z, search, FAR, np.int64(-1))
    reach = ROUNDED * np.sqrt(patches.reach2[v])
    limit = np.sqrt(best2) + reach
    if i < 0 or _middle_distance2(patches, i, x, y, z) > ROUNDED * limit * limit:
        return best, best2
    for i in range(patches.first[v], patches.first[v + 1]):
        if _middle_distance2(patches, i, x, y, z) < ROUNDED * limit * limit:
            f = patches.face[i]
            search.left[0] -= 1
            distance2 = distance2_to(patches.given, f, point)
            if distance2 < best2:
                best, best2 = f, distance2
                limit = np.sqrt(best2) + reach
    return best, best2


@part
def _middle_distance2(patches, i, x, y, z):
    """Squared distance of a point from the middle of the i-th face listed."""
    dx = patches.middle[0, i] - x
    dy = patches.middle[1, i] - y
    dz = patches.middle[2, i] - z
    return dx * dx + dy * dy + dz * dz


@cold_part
def nearest_of_all(patches, point, limit2, search, best, best2):
    """The face given that is nearest to a point, and its squared distance.

    Any within the limit will do.
    """
    n = patches.reach2.size
    search.left[0] -= n // (IN_BOX * PER_FACE)
    for group in range(len(patches.boxes)):
        boxes.measure_group(patches.boxes, group, point, search.to_boxes2)
        for lane in range(WIDTH):
            if best2 > limit2 and search.to_boxes2[lane] < best2:
                begin = IN_BOX * (WIDTH * group + lane)
                for v in range(begin, min(begin + IN_BOX, n)):
                    best, best2 = nearest_face(patches, v, point, search, best, best2)
    return best, best2
