"""Guards: where a contracted edge may go without harm to the surface."""

import numpy as np

from tetsimplify.kernels.jit import part
from tetsimplify.kernels.quadrics import AREA, NORMAL
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    FACTOR,
    FOLDOVER,
    LANES,
    N_GAPS,
    NORMAL_DEVIATION,
    RING_ALL,
    RING_V,
    SHAPE,
    WIDTH,
)

NO_GUARD = -2.0  # a cosine that every pair of normals exceeds

# A face whose height is below this part of its longest edge has no normal to speak of.
FLAT = 1e-10
# Where original normals cancel but for this part, they do not tell what is outside.
UNDECIDED = 0.1
TINY = 1e-300  # a number above 0, by which can be divided
# A triangle whose shape is worse than this, where 1 is equilateral, is a needle.
NEEDLE = 0.1
# Rows of the lanes with what is found about a face; instead of a shape, what forbids it.
NEW_SHAPE, OLD_SHAPE = 10, 11
DEVIATES, TURNS = -1.0, -2.0


@part
def turns_over(surface, scratch, rules, v, u):
    """Whether a face of the ring turns too far when its vertex v or u moves to `scratch.point`."""
    lanes, n_steps = scratch.lanes, scratch.tally[RING_ALL]
    for first in range(0, n_steps, LANES):
        n = min(LANES, n_steps - first)
        _place_ring(surface, scratch, v, u, first, n)
        n_turning = 0
        for j in range(LANES):
            new2, _, old2, old_sum, _, _, _, dot = _before_and_after(lanes, j)
            turns = _turns(rules, dot, old2, new2, old_sum) & (j < n)
            lanes[NEW_SHAPE * WIDTH + j] = 1.0 if turns else 0.0
            n_turning += turns
        if n_turning and scratch.tally[N_GAPS]:
            _pass_over_gaps(scratch, first, n, NEW_SHAPE, 0.0)
            n_turning = 0
            for j in range(n):
                n_turning += lanes[NEW_SHAPE * WIDTH + j] != 0.0
        if n_turning:
            return True
    return False


@part
def harm(surface, quadrics, scratch, rules, v, u):
    """What the new vertex at ``scratch.point`` does to the faces around it.

    - They may turn by so much from what they were, in one contraction.
    - They may turn by so much from the faces given that they stand for, of which the normals
      summed at their vertices tell. So small turns do not add up to a fold.
    - The worst of them may be worse than the worst that was there, but that makes the contraction
      dearer: by the square of how much worse, in ``scratch.point[FACTOR]``. It may not be
      a needle.

    Returns
    -------
    int
        CONTRACTIBLE, or the guard that forbids it.
    """
    point, lanes, n_steps = scratch.point, scratch.lanes, scratch.tally[RING_ALL]
    worst_old = worst_new = 1.0  # squares of the shapes
    for first in range(0, n_steps, LANES):
        n = min(LANES, n_steps - first)
        _place_ring(surface, scratch, v, u, first, n)
        _look_at_faces(quadrics, scratch, rules, v, u, first, n)
        _pass_over_gaps(scratch, first, n, NEW_SHAPE, 1.0)
        _pass_over_gaps(scratch, first, n, OLD_SHAPE, 1.0)
        for j in range(n):
            worst_new = min(worst_new, lanes[NEW_SHAPE * WIDTH + j])
            worst_old = min(worst_old, lanes[OLD_SHAPE * WIDTH + j])
        if worst_new < 0.0:
            return FOLDOVER if worst_new == TURNS else NORMAL_DEVIATION

    point[FACTOR] = 1.0
    allowed = min(worst_old, rules.shape * rules.shape)
    if worst_new < allowed:
        if worst_new < NEEDLE * NEEDLE:
            return SHAPE
        point[FACTOR] = allowed / worst_new
    return CONTRACTIBLE


@part
def _place_ring(surface, scratch, v, u, first, n):
    """Put so many steps of the ring from `first` into the lanes, relative to `scratch.point`.

    The vertices go to the first three rows, one more than steps, and the end of the edge that is a
    vertex of each face to the next three.
    """
    vertices, ring, point, lanes = surface.vertices, scratch.ring[0], scratch.point, scratch.lanes
    px, py, pz = point[0], point[1], point[2]
    for j in range(n + 1):
        a = np.uint32(ring[first + j])
        lanes[j] = vertices[a, 0] - px
        lanes[WIDTH + j] = vertices[a, 1] - py
        lanes[2 * WIDTH + j] = vertices[a, 2] - pz
    vx, vy, vz = vertices[v, 0] - px, vertices[v, 1] - py, vertices[v, 2] - pz
    ux, uy, uz = vertices[u, 0] - px, vertices[u, 1] - py, vertices[u, 2] - pz
    n_v = scratch.tally[RING_V] - first
    for j in range(LANES):
        lanes[3 * WIDTH + j] = vx if j < n_v else ux
        lanes[4 * WIDTH + j] = vy if j < n_v else uy
        lanes[5 * WIDTH + j] = vz if j < n_v else uz


@part
def _before_and_after(lanes, j):
    """The face at the j-th step of the ring as it will be, and as it is.

    Returns
    -------
    new2, new_sum, old2, old_sum : float
        Squares of twice the area, and sums of the squares of the edges.
    new_x, new_y, new_z : float
        The new normal, twice as long as the area.
    dot : float
        Its product with the old one.
    """
    ax, ay, az = lanes[j], lanes[WIDTH + j], lanes[2 * WIDTH + j]
    bx, by, bz = lanes[j + 1], lanes[WIDTH + j + 1], lanes[2 * WIDTH + j + 1]
    ox, oy, oz = lanes[3 * WIDTH + j], lanes[4 * WIDTH + j], lanes[5 * WIDTH + j]
    across2 = (ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2
    new_x, new_y, new_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    new2 = new_x * new_x + new_y * new_y + new_z * new_z
    new_sum = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + across2
    ax, ay, az = ax - ox, ay - oy, az - oz
    bx, by, bz = bx - ox, by - oy, bz - oz
    old_x, old_y, old_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    old2 = old_x * old_x + old_y * old_y + old_z * old_z
    old_sum = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + across2
    dot = old_x * new_x + old_y * new_y + old_z * new_z
    return new2, new_sum, old2, old_sum, new_x, new_y, new_z, dot


@part
def _turns(rules, dot, old2, new2, old_sum):
    """Whether a face that has a normal turns too far. Without roots, and so that it may be tiny."""
    limit = rules.cos_foldover * abs(rules.cos_foldover) * old2 * new2
    turns = (dot * abs(dot) < limit) | ((dot <= 0.0) & (rules.cos_foldover >= 0.0))
    return turns & (old2 > FLAT * FLAT * old_sum * old_sum)


@part
def _pass_over_gaps(scratch, first, n, row, result):
    """Give the steps of the ring that are no faces a result without meaning."""
    for i in range(scratch.tally[N_GAPS]):
        j = scratch.ring[1, i] - first
        if 0 <= j < n:
            scratch.lanes[row * WIDTH + j] = result


@part
def _look_at_faces(quadrics, scratch, rules, v, u, first, n):
    """Find the squares of the shapes of the faces in the lanes, or that a guard forbids the new."""
    origin, ring, lanes = quadrics.origin, scratch.ring[0], scratch.lanes
    for j in range(n + 1):
        of_a = origin[np.uint32(ring[first + j])]
        lanes[6 * WIDTH + j] = of_a[NORMAL]
        lanes[7 * WIDTH + j] = of_a[NORMAL + 1]
        lanes[8 * WIDTH + j] = of_a[NORMAL + 2]
        lanes[9 * WIDTH + j] = of_a[AREA]
    of_v, of_u = origin[v], origin[u]
    sum_x = np.float64(of_v[NORMAL] + of_u[NORMAL])
    sum_y = np.float64(of_v[NORMAL + 1] + of_u[NORMAL + 1])
    sum_z = np.float64(of_v[NORMAL + 2] + of_u[NORMAL + 2])
    sum_area = np.float64(of_v[AREA] + of_u[AREA])
    deviation = rules.cos_deviation * abs(rules.cos_deviation)
    may_fold, may_deviate = rules.cos_foldover <= NO_GUARD, rules.cos_deviation <= NO_GUARD
    for j in range(LANES):
        new2, new_sum, old2, old_sum, x, y, z, dot = _before_and_after(lanes, j)
        turns = _turns(rules, dot, old2, new2, old_sum) & (not may_fold)
        rx = sum_x + lanes[6 * WIDTH + j] + lanes[6 * WIDTH + j + 1]
        ry = sum_y + lanes[7 * WIDTH + j] + lanes[7 * WIDTH + j + 1]
        rz = sum_z + lanes[8 * WIDTH + j] + lanes[8 * WIDTH + j + 1]
        cancelled = UNDECIDED * (sum_area + lanes[9 * WIDTH + j] + lanes[9 * WIDTH + j + 1])
        r2, dot = rx * rx + ry * ry + rz * rz, rx * x + ry * y + rz * z
        deviates = (dot * abs(dot) < deviation * r2 * new2) & (not may_deviate)
        deviates &= r2 > cancelled * cancelled
        # the shape of a triangle is 4 sqrt(3) area / (sum of the squares of its edges)
        new_shape = 12.0 * new2 / max(new_sum * new_sum, TINY)
        new_shape = DEVIATES if deviates else new_shape
        lanes[NEW_SHAPE * WIDTH + j] = TURNS if turns else new_shape
        lanes[OLD_SHAPE * WIDTH + j] = 12.0 * old2 / max(old_sum * old_sum, TINY)
