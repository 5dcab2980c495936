r"""Whether a surface passes over or under all of a face, near it.

Erect a column on the face, upright and to both sides, up to some height::

         +-------------+ end          A surface that has no boundary in the column and does not
         |    ____     |              pass through its ends leaves it through its sides only. So
     ----|---/    \----|---- surface  it crosses all lines along the column an odd number of
         |=============| face         times, or all an even number of times. If it is odd, then
         |             |              on every line there is a point of the surface.
         +-------------+ end

Boundary here are the edges of odd degree: only parity counts, so neither orientation nor edges
with many faces matter. This takes one look at the triangles near the face, however many of them
lie over it, where all other bounds would have to cut the face along their edges.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.bvh import overlapping
from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.jit import cold_part, kernel, part
from tetsimplify.kernels.nearest import RESOLUTION, SLIVER, edge

MAX_FOUND = 128  # faces near a face; where there are more this is no longer quick

# Coordinates: how far inside the three edges of the face, and the height over it.
HEIGHT = 3

INSIDE, OUTSIDE, ON_EDGE = 1, 0, -1  # ON_EDGE: or too near to one to tell


class Column(NamedTuple):
    """Working memory: the column on a face, and a triangle that may be in it."""

    frame: np.ndarray  # float64 (4, 4): coefficients of x, y, z and 1 for each coordinate
    centre: np.ndarray  # float64 (3,): coordinates of the centre of the face
    box: np.ndarray  # float64 (6,): around the column
    found: np.ndarray  # int32 (MAX_FOUND,): triangles with boxes that meet it
    triangle: np.ndarray  # float64 (3, 4): coordinates of its corners
    clipped: np.ndarray  # float64 (2, 6, 4): corners of what is left of it, before and after a cut

    @classmethod
    def new(cls):
        """Allocate it."""
        return cls(
            frame=np.empty((4, 4)),
            centre=np.empty(3),
            box=np.empty(6),
            found=np.empty(MAX_FOUND, np.int32),
            triangle=np.empty((3, 4)),
            clipped=np.empty((2, 6, 4)),
        )


@kernel
def open_faces(corner_vertex, first_corner, next_corner):
    """Find the faces with an edge of odd degree; see `corners.link_corners` for the arguments."""
    is_open = np.zeros(len(corner_vertex) // 3, np.bool_)
    is_odd = np.zeros(len(first_corner), np.bool_)  # the edge from the vertex at hand to this one
    for first in first_corner:
        if first < 0:
            continue
        for step in range(3):  # count, tell, forget
            corner = first
            while True:
                a, b = corner_vertex[ahead(corner)], corner_vertex[behind(corner)]
                if step == 0:
                    is_odd[a] = not is_odd[a]
                    is_odd[b] = not is_odd[b]
                elif step == 1:
                    is_open[corner // 3] |= is_odd[a] or is_odd[b]
                else:
                    is_odd[a] = is_odd[b] = False
                corner = next_corner[corner]
                if corner == first:
                    break
    return is_open


@cold_part
def cover_height(target, column, corners, limit, stack):
    """Bound the distance from a face to a surface that passes over or under all of it.

    Parameters
    ----------
    target : Target
    column : Column
    corners : float64 (3 or more, 3)
        The face.
    limit : float
        Height of the column to either side.
    stack : Stack

    Returns
    -------
    height : float
        No point of the face is farther from the surface; infinite where that is not proven.
    near : int
        A triangle over or under the centre of the face, -1 where none was met.
    """
    near = np.int32(-1)
    if not erect(column, corners, limit):
        return np.inf, near
    n_found = overlapping(target.tree, column.box, stack.nodes, column.found)
    if n_found > MAX_FOUND:
        return np.inf, near
    height = 0.0
    is_crossed = False
    for i in range(n_found):
        face = column.found[i]
        for k in range(3):
            point = target.vertices[target.faces[face, k]]
            for j in range(4):
                column.triangle[k, j] = coordinate(column.frame[j], point)
        low, high = heights_inside(column, limit)
        if low > limit or high < -limit:
            continue
        if low < -limit or high > limit or target.is_open[face]:
            return np.inf, near
        height = max(height, high, -low)
        side = side_of_centre(column)
        if side == ON_EDGE:
            return np.inf, near
        if side == INSIDE:
            is_crossed = not is_crossed
            near = face
    return height if is_crossed else np.inf, near


@part
def erect(column, corners, limit):
    """Set up the column on a face; returns False for a sliver, which has no good normal."""
    ux, uy, uz, u2 = edge(corners, 0, 1)
    vx, vy, vz, v2 = edge(corners, 1, 2)
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n2 = nx * nx + ny * ny + nz * nz
    if n2 <= SLIVER * u2 * v2:
        return False
    for k in range(3):
        ux, uy, uz, u2 = edge(corners, k, (k + 1) % 3)
        inward = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
        set_coordinate(column.frame[k], inward, np.sqrt(n2 * u2), corners[k])
        # a third of the height of the face over this edge
        column.centre[k] = coordinate(column.frame[k], corners[(k + 2) % 3]) / 3.0
    set_coordinate(column.frame[HEIGHT], (nx, ny, nz), np.sqrt(n2), corners[0])
    for axis in range(3):
        reach = abs(column.frame[HEIGHT, axis]) * limit + RESOLUTION
        a, b, c = corners[0, axis], corners[1, axis], corners[2, axis]
        column.box[axis], column.box[3 + axis] = min(a, b, c) - reach, max(a, b, c) + reach
    return True


@part
def set_coordinate(row, direction, length, origin):
    """Let a coordinate be 0 at the origin and grow along a direction of some length."""
    row[3] = 0.0
    for axis in range(3):
        row[axis] = direction[axis] / length
        row[3] -= row[axis] * origin[axis]


@part
def coordinate(row, point):
    """A coordinate of a point."""
    return row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3]


@part
def heights_inside(column, limit):
    """Lowest and highest point of the part of the triangle between the sides of the column.

    Those of the whole triangle where that settles it; in reverse where nothing is inside.
    """
    triangle = column.triangle
    for k in range(3):
        if max(triangle[0, k], triangle[1, k], triangle[2, k]) < -RESOLUTION:
            return np.inf, -np.inf
    low = min(triangle[0, HEIGHT], triangle[1, HEIGHT], triangle[2, HEIGHT])
    high = max(triangle[0, HEIGHT], triangle[1, HEIGHT], triangle[2, HEIGHT])
    if low > limit or high < -limit or (low >= -limit and high <= limit):
        return low, high
    return heights_of_clipped(column)


@cold_part
def heights_of_clipped(column):
    """Cut the triangle along the sides of the column; lowest and highest point of what is left."""
    n = 3
    before, after = column.clipped[0], column.clipped[1]
    for i in range(3):
        for j in range(4):
            before[i, j] = column.triangle[i, j]
    for k in range(3):
        n_after = 0
        for i in range(n):
            p, q = before[i], before[(i + 1) % n]
            p_inside, q_inside = p[k] + RESOLUTION, q[k] + RESOLUTION
            if p_inside >= 0.0:
                for j in range(4):
                    after[n_after, j] = p[j]
                n_after += 1
            if p_inside * q_inside < 0.0:
                t = p_inside / (p_inside - q_inside)
                for j in range(4):
                    after[n_after, j] = p[j] + t * (q[j] - p[j])
                n_after += 1
        before, after = after, before
        n = n_after
    low, high = np.inf, -np.inf
    for i in range(n):
        low, high = min(low, before[i, HEIGHT]), max(high, before[i, HEIGHT])
    return low, high


@part
def side_of_centre(column):
    """Whether the line along the column through the centre passes INSIDE the triangle."""
    cx, cy = column.centre[0], column.centre[1]
    ax, ay = column.triangle[0, 0] - cx, column.triangle[0, 1] - cy
    bx, by = column.triangle[1, 0] - cx, column.triangle[1, 1] - cy
    cx, cy = column.triangle[2, 0] - cx, column.triangle[2, 1] - cy
    ab, bc, ca = ax * by - ay * bx, bx * cy - by * cx, cx * ay - cy * ax
    size = abs(ax) + abs(ay) + abs(bx) + abs(by) + abs(cx) + abs(cy)
    if min(abs(ab), abs(bc), abs(ca)) <= RESOLUTION * size:
        return ON_EDGE
    return INSIDE if (ab > 0.0) == (bc > 0.0) and (bc > 0.0) == (ca > 0.0) else OUTSIDE
