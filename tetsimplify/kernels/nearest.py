r"""The face of a surface that is nearest to a point.

The foot f of the perpendicular on the plane of a triangle may lie inside it, and is what is
nearest then. Otherwise it lies beyond one edge or two, and one of these has the nearest point,
which may be an end of it::

            c                      c
           / \                    / \
          / f \                  /   \
         a-----b                a--x--b
                                   f

Coordinates are of size one, see `RESOLUTION`.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.bvh import STACK_SIZE, WIDTH, Tree
from tetsimplify.kernels.geometry import edge_vector
from tetsimplify.kernels.jit import cold_part, part

RESOLUTION = 1e-13  # smaller distances are made of rounding errors: they count as none

# Where the squared sine of the angle between two edges is smaller, the normal has few good digits.
SLIVER = 1e-5


class Target(NamedTuple):
    """A surface that distances are measured to."""

    vertices: np.ndarray  # float64 (n, 3)
    faces: np.ndarray  # int32 (m, 3), m > 0
    tree: Tree
    is_open: np.ndarray  # bool (m,): faces with an edge of odd degree, where a surface ends


class Stack(NamedTuple):
    """Working memory of a search."""

    nodes: np.ndarray  # int32 (bvh.STACK_SIZE,): nodes still to look into
    distances2: np.ndarray  # float64 (bvh.STACK_SIZE,): squared distances to their boxes
    lanes: np.ndarray  # float64 (bvh.WIDTH,): squared distances to the boxes of a group

    @classmethod
    def new(cls):
        """Allocate it."""
        return cls(np.empty(STACK_SIZE, np.int32), np.empty(STACK_SIZE), np.empty(WIDTH))


@cold_part
def nearest_face(target, x, y, z, hint, stack):
    """Find the face that is nearest to a point, one of them where there are several.

    The search begins around the hint, in the first node above it whose box has the point inside,
    and then climbs to the root by way of what else is below each node. With a good hint little of
    that is near enough to be looked into.

    Parameters
    ----------
    target : Target
    x, y, z : float
        The point.
    hint : int
        Any face, better one that is near.
    stack : Stack

    Returns
    -------
    distance2 : float
        Squared distance to the surface.
    face : int
    """
    boxes = target.tree.boxes
    n_groups = len(boxes)
    best, best2 = hint, distance2_to_face(target, hint, x, y, z)
    top = (n_groups + target.tree.slot[hint] - 1) // WIDTH
    while top > 0 and distance2_to_box(boxes[(top - 1) // WIDTH], (top - 1) % WIDTH, x, y, z) > 0.0:
        top = (top - 1) // WIDTH
    done = -1
    while True:
        node, n_waiting = top, 0
        while node >= 0:
            group = boxes[node]
            for lane in range(group.shape[1]):  # LLVM unrolls range(WIDTH) and vectorizes this
                stack.lanes[lane] = distance2_to_box(group, lane, x, y, z)
            low, low_at = np.inf, n_waiting
            for lane in range(WIDTH):
                if stack.lanes[lane] < best2 and WIDTH * node + 1 + lane != done:
                    if stack.lanes[lane] < low:
                        low, low_at = stack.lanes[lane], n_waiting
                    stack.nodes[n_waiting] = WIDTH * node + 1 + lane
                    stack.distances2[n_waiting] = stack.lanes[lane]
                    n_waiting += 1
            if low < np.inf:  # the nearest goes on top
                last = n_waiting - 1
                stack.distances2[low_at], stack.distances2[last] = stack.distances2[last], low
                stack.nodes[low_at], stack.nodes[last] = stack.nodes[last], stack.nodes[low_at]
            node = -1
            while n_waiting > 0 and node < 0:
                n_waiting -= 1
                if stack.distances2[n_waiting] >= best2:
                    continue
                if stack.nodes[n_waiting] < n_groups:
                    node = stack.nodes[n_waiting]
                    continue
                fi = target.tree.face[stack.nodes[n_waiting] - n_groups]
                distance2 = distance2_to_face(target, fi, x, y, z)
                if distance2 < best2:
                    best, best2 = fi, distance2
        if top == 0:
            return best2, best
        done, top = top, (top - 1) // WIDTH


@part
def distance2_to_box(group, lane, x, y, z):
    """Squared distance from a point to a box of a group, infinite where there is no node."""
    low_x, high_x = group[0, lane] - x, x - group[3, lane]
    low_y, high_y = group[1, lane] - y, y - group[4, lane]
    low_z, high_z = group[2, lane] - z, z - group[5, lane]
    dx = low_x if low_x > high_x else high_x
    dy = low_y if low_y > high_y else high_y
    dz = low_z if low_z > high_z else high_z
    dx = dx if dx > 0.0 else 0.0
    dy = dy if dy > 0.0 else 0.0
    dz = dz if dz > 0.0 else 0.0
    return dx * dx + dy * dy + dz * dz


@part
def distance2_to_face(target, fi, x, y, z):
    """Squared distance from a point to a face, which may be degenerate."""
    vertices = target.vertices
    a, b, c = target.faces[fi, 0], target.faces[fi, 1], target.faces[fi, 2]
    ux, uy, uz, u2 = edge(vertices, a, b)
    vx, vy, vz, v2 = edge(vertices, b, c)
    wx, wy, wz, w2 = edge(vertices, c, a)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n2 = nx * nx + ny * ny + nz * nz
    if n2 <= SLIVER * u2 * v2:
        return distance2_to_sliver(vertices, a, b, c, x, y, z)
    ax, ay, az = x - vertices[a, 0], y - vertices[a, 1], z - vertices[a, 2]
    bx, by, bz = x - vertices[b, 0], y - vertices[b, 1], z - vertices[b, 2]
    cx, cy, cz = x - vertices[c, 0], y - vertices[c, 1], z - vertices[c, 2]
    # Positive where the foot is on the inner side of each edge.
    in_u = nx * (uy * az - uz * ay) + ny * (uz * ax - ux * az) + nz * (ux * ay - uy * ax)
    in_v = nx * (vy * bz - vz * by) + ny * (vz * bx - vx * bz) + nz * (vx * by - vy * bx)
    in_w = nx * (wy * cz - wz * cy) + ny * (wz * cx - wx * cz) + nz * (wx * cy - wy * cx)
    if in_u > 0.0 and in_v > 0.0 and in_w > 0.0:
        height = nx * ax + ny * ay + nz * az
        best2 = height * height / n2
    else:
        best2 = np.inf
        if in_u <= 0.0:
            best2 = min(best2, distance2_to_segment(ax, ay, az, ux, uy, uz, u2))
        if in_v <= 0.0:
            best2 = min(best2, distance2_to_segment(bx, by, bz, vx, vy, vz, v2))
        if in_w <= 0.0:
            best2 = min(best2, distance2_to_segment(cx, cy, cz, wx, wy, wz, w2))
    return best2 if best2 > RESOLUTION * RESOLUTION else 0.0


@part
def distance2_to_segment(x, y, z, ux, uy, uz, u2):
    """Squared distance from a point to the segment from the origin to (ux, uy, uz)."""
    along = x * ux + y * uy + z * uz
    if along >= u2:
        x, y, z = x - ux, y - uy, z - uz
    elif along > 0.0:
        x, y, z = x - along / u2 * ux, y - along / u2 * uy, z - along / u2 * uz
    return x * x + y * y + z * z


@cold_part
def distance2_to_sliver(vertices, a, b, c, x, y, z):
    """Squared distance from a point to a triangle that is nearly or wholly degenerate.

    The triangle is taken in coordinates along and across its longest edge. Rounding turns them
    about this edge, no farther than if the opposite corner were moved by a rounding error.
    """
    ux, uy, uz, u2 = edge(vertices, a, b)
    for _ in range(2):
        if max(edge(vertices, b, c)[3], edge(vertices, c, a)[3]) > u2:
            a, b, c = b, c, a
            ux, uy, uz, u2 = edge(vertices, a, b)
    vx, vy, vz, v2 = edge(vertices, a, c)
    wx, wy, wz, w2 = edge(vertices, c, b)
    ax, ay, az = x - vertices[a, 0], y - vertices[a, 1], z - vertices[a, 2]
    cx, cy, cz = x - vertices[c, 0], y - vertices[c, 1], z - vertices[c, 2]
    best2 = min(
        distance2_to_segment(ax, ay, az, ux, uy, uz, u2),
        distance2_to_segment(ax, ay, az, vx, vy, vz, v2),
        distance2_to_segment(cx, cy, cz, wx, wy, wz, w2),
    )
    if u2 == 0.0:
        return best2
    length = np.sqrt(u2)
    ux, uy, uz = ux / length, uy / length, uz / length
    along_c = vx * ux + vy * uy + vz * uz
    vx, vy, vz = vx - along_c * ux, vy - along_c * uy, vz - along_c * uz
    rest = vx * ux + vy * uy + vz * uz  # what rounding left in it
    vx, vy, vz = vx - rest * ux, vy - rest * uy, vz - rest * uz
    height = np.sqrt(vx * vx + vy * vy + vz * vz)
    if height == 0.0:
        return best2
    vx, vy, vz = vx / height, vy / height, vz / height
    along = ax * ux + ay * uy + az * uz
    across = ax * vx + ay * vy + az * vz
    if (
        across > 0.0
        and along * height > across * along_c
        and (length - along) * height > across * (length - along_c)
    ):
        x, y, z = (
            ax - along * ux - across * vx,
            ay - along * uy - across * vy,
            az - along * uz - across * vz,
        )
        best2 = min(best2, x * x + y * y + z * z)
    return best2 if best2 > RESOLUTION * RESOLUTION else 0.0


@part
def edge(vertices, a, b):
    """The vector from a to b, and its squared length."""
    x, y, z = edge_vector(vertices, a, b)
    return x, y, z, x * x + y * y + z * z
