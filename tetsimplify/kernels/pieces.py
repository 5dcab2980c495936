r"""How far a face may be from a surface, by cutting it into convex pieces.

The distance to one triangle is a convex function, so on a convex piece it is largest at a corner.
That bounds the distance of the piece to the whole surface, and closely so where one triangle is
near all of the piece. Where none is, the piece is cut along an edge of the triangle that is
nearest to its middle; what is on the inner side mostly has its bound then::

        +--------------+          +--------+-----+
        |   t    /     |          |   t   /|     |      t is nearest to the middle,
        |       /      |    ->    |      / |     |      the corner at the lower right
        |      /       |          |     / /      |      is far from it
        +-----/--------+          +----/ +-------+

References
----------
M. Tang, M. Lee and Y. J. Kim. Interactive Hausdorff distance computation for general polygonal
models. ACM Trans. Graphics 28(3), 2009, 74, doi:10.1145/1531326.1531380.
L. Sacht and A. Jacobson. Cascading upper bounds for triangle soup Pompeiu-Hausdorff distance.
Computer Graphics Forum 43(5), 2024, doi:10.1111/cgf.15129.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.jit import cold_part, part
from tetsimplify.kernels.nearest import distance2_to_face, edge, nearest_face

MAX_CORNERS = 8  # of a piece
MAX_PIECES = 256  # that wait at a time
EDGE_CUTS = 96  # where more pieces wait all are halved, and the room lasts for very many halvings

# A cut along an edge leaves corners at least so far on both sides of it, in radii of the piece.
MIN_CUT = 1e-3
# Corners nearer to a cut than that are on it.
ON_CUT = 1e-9


class Pieces(NamedTuple):
    """A stack of convex polygons."""

    corners: np.ndarray  # float64 (MAX_PIECES, MAX_CORNERS, 3)
    n_corners: np.ndarray  # int32 (MAX_PIECES,)
    near: np.ndarray  # int32 (MAX_PIECES,): a face of the surface, better one that is near
    is_far: np.ndarray  # bool (MAX_PIECES,): a corner can be expected to be too far from that face
    polygon: np.ndarray  # float64 (MAX_CORNERS, 3): the piece that is being cut
    sides: np.ndarray  # float64 (MAX_CORNERS,): its corners on the one side, 0 or the other
    farthest: np.ndarray  # float64 (3,): the farthest point found

    @classmethod
    def new(cls):
        """Allocate it."""
        return cls(
            corners=np.empty((MAX_PIECES, MAX_CORNERS, 3)),
            n_corners=np.empty(MAX_PIECES, np.int32),
            near=np.empty(MAX_PIECES, np.int32),
            is_far=np.empty(MAX_PIECES, np.bool_),
            polygon=np.empty((MAX_CORNERS, 3)),
            sides=np.empty(MAX_CORNERS),
            farthest=np.empty(3),
        )


@cold_part
def bound_piece(target, pieces, stack, lower, tolerance, stop):
    """Bound the distance from a piece to a surface, up to a tolerance.

    Parameters
    ----------
    target : Target
    pieces : Pieces
        With the piece, and a face near it, at the bottom of the stack.
    stack : Stack
    lower : float
        A distance that is reached anyway.
    tolerance : float
        What the bounds may differ by, above 0.
    stop : bool
        Stop at the first point farther than `lower`.

    Returns
    -------
    lower : float
        The lower bound, raised where a point is farther; ``pieces.farthest`` is that point then.
    upper : float
        No point of the piece is farther, and it is at most ``lower + tolerance``. Says nothing
        after a stop.
    near : int
        A face of the surface near the piece.
    """
    limit2 = (lower + tolerance) ** 2
    upper2 = 0.0
    n_waiting = 1
    near, corner, bound2, radius = pieces.near[0], 0, np.inf, 0.0
    while n_waiting > 0:
        top = n_waiting - 1
        near = pieces.near[top]
        if not pieces.is_far[top]:
            corner, bound2 = worst_corner(target, near, pieces, top)
        if pieces.is_far[top] or bound2 > limit2:
            x, y, z, radius = middle(pieces, top)
            distance2, near = nearest_face(target, x, y, z, near, stack)
            distance = np.sqrt(distance2)
            if distance > lower:
                lower, limit2 = distance, (distance + tolerance) ** 2
                pieces.farthest[0], pieces.farthest[1], pieces.farthest[2] = x, y, z
                if stop:
                    return lower, np.inf, near
            corner, bound2 = worst_corner(target, near, pieces, top)
            bound2 = min(bound2, (distance + radius) ** 2)
        if bound2 > limit2 and n_waiting < MAX_PIECES:
            split(target, near, corner, pieces, top, radius, n_waiting < EDGE_CUTS)
            pieces.near[top] = pieces.near[top + 1] = near
            pieces.is_far[top], pieces.is_far[top + 1] = False, True
            n_waiting += 1
        else:
            upper2 = max(upper2, bound2)
            n_waiting -= 1
    return lower, np.sqrt(upper2), near


@part
def put_face(vertices, faces, fi, near, pieces):
    """Make a face the only piece."""
    pieces.n_corners[0], pieces.near[0], pieces.is_far[0] = 3, near, False
    for k in range(3):
        copy_point(pieces.corners[0, k], vertices[faces[fi, k]])


@cold_part
def worst_corner(target, face, pieces, at):
    """The corner of a piece that is farthest from a face, and the squared distance."""
    worst, worst2 = 0, -1.0
    for k in range(pieces.n_corners[at]):
        corner = pieces.corners[at, k]
        distance2 = distance2_to_face(target, face, corner[0], corner[1], corner[2])
        if distance2 > worst2:
            worst, worst2 = k, distance2
    return worst, worst2


@part
def middle(pieces, at):
    """The mean of the corners of a piece, and the distance from it to the farthest."""
    n = pieces.n_corners[at]
    x = y = z = 0.0
    for k in range(n):
        x += pieces.corners[at, k, 0]
        y += pieces.corners[at, k, 1]
        z += pieces.corners[at, k, 2]
    x, y, z = x / n, y / n, z / n
    radius2 = 0.0
    for k in range(n):
        dx = pieces.corners[at, k, 0] - x
        dy = pieces.corners[at, k, 1] - y
        dz = pieces.corners[at, k, 2] - z
        radius2 = max(radius2, dx * dx + dy * dy + dz * dz)
    return x, y, z, np.sqrt(radius2)


@cold_part
def split(target, near, worst, pieces, at, radius, along_edges):
    """Cut a piece in two, which take its place and the next one."""
    n = pieces.n_corners[at]
    for k in range(n):
        copy_point(pieces.polygon[k], pieces.corners[at, k])
    if n == MAX_CORNERS:
        for k in range(n):  # along a diagonal, which adds no corners
            pieces.sides[k] = k % (n // 2) * (1 if k < n // 2 else -1)
    elif not (along_edges and cut_along_edge(target, near, worst, pieces, n, radius)):
        cut_in_half(pieces, n)

    n_inner = n_outer = 0
    inner, outer = pieces.corners[at], pieces.corners[at + 1]
    for k in range(n):
        side, next_side = pieces.sides[k], pieces.sides[(k + 1) % n]
        if side >= 0.0:
            copy_point(inner[n_inner], pieces.polygon[k])
            n_inner += 1
        if side <= 0.0:
            copy_point(outer[n_outer], pieces.polygon[k])
            n_outer += 1
        if side * next_side < 0.0:
            t = side / (side - next_side)
            for axis in range(3):
                p, q = pieces.polygon[k, axis], pieces.polygon[(k + 1) % n, axis]
                inner[n_inner, axis] = outer[n_outer, axis] = p + t * (q - p)
            n_inner += 1
            n_outer += 1
    pieces.n_corners[at], pieces.n_corners[at + 1] = n_inner, n_outer


@part
def copy_point(target, source):
    """Copy three coordinates; a slice would allocate."""
    target[0], target[1], target[2] = source[0], source[1], source[2]


@part
def cut_along_edge(target, face, worst, pieces, n, radius):
    """Cut upright on a face along the edge that the worst corner is farthest beyond.

    Returns
    -------
    bool
        Whether there is such an edge, and much of the piece on both sides of it.
    """
    a, b, c = target.faces[face, 0], target.faces[face, 1], target.faces[face, 2]
    ux, uy, uz, _ = edge(target.vertices, a, b)
    vx, vy, vz, _ = edge(target.vertices, a, c)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    lowest = 0.0
    for k in range(3):
        a, b = target.faces[face, k], target.faces[face, (k + 1) % 3]
        ux, uy, uz, _ = edge(target.vertices, a, b)
        mx, my, mz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux  # points inwards
        length = np.sqrt(mx * mx + my * my + mz * mz)
        if length == 0.0:
            continue
        mx, my, mz = mx / length, my / length, mz / length
        ox, oy, oz = target.vertices[a, 0], target.vertices[a, 1], target.vertices[a, 2]
        p = pieces.polygon[worst]
        side = mx * (p[0] - ox) + my * (p[1] - oy) + mz * (p[2] - oz)
        if side < lowest:
            lowest = side
            for i in range(n):
                p = pieces.polygon[i]
                side = mx * (p[0] - ox) + my * (p[1] - oy) + mz * (p[2] - oz)
                pieces.sides[i] = side if abs(side) > ON_CUT * radius else 0.0
    if lowest >= -MIN_CUT * radius:
        return False
    highest = 0.0
    for i in range(n):
        highest = max(highest, pieces.sides[i])
    return highest > MIN_CUT * radius


@part
def cut_in_half(pieces, n):
    """Cut across the longest line between two corners, at its middle."""
    longest2 = -1.0
    first = last = 0
    for i in range(n):
        for j in range(i):
            _, _, _, length2 = edge(pieces.polygon, i, j)
            if length2 > longest2:
                longest2, first, last = length2, i, j
    ux, uy, uz, _ = edge(pieces.polygon, first, last)
    for i in range(n):
        px, py, pz, _ = edge(pieces.polygon, first, i)
        side = (px - 0.5 * ux) * ux + (py - 0.5 * uy) * uy + (pz - 0.5 * uz) * uz
        pieces.sides[i] = side if abs(side) > ON_CUT * longest2 else 0.0
