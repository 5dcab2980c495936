"""Guards: where a contracted edge may go without harm to the surface."""

import numpy as np

from tetsimplify.kernels.corners import others
from tetsimplify.kernels.jit import part
from tetsimplify.kernels.quadrics import AREA, NORMAL
from tetsimplify.kernels.state import (
    CONTRACTIBLE,
    FACTOR,
    FOLDOVER,
    NORMAL_DEVIATION,
    SHAPE,
    STAR,
)

NO_GUARD = -2.0  # a cosine that every pair of normals exceeds

# A face whose height is below this part of its longest edge has no normal to speak of.
FLAT = 1e-10
# Where original normals cancel but for this part, they do not tell what is outside.
UNDECIDED = 0.1
# A triangle whose shape is worse than this, where 1 is equilateral, is a needle.
NEEDLE = 0.1


@part
def turns_over(vertices, corner_vertex, star, n_v, n_u, v, u, point, cos_foldover):
    """Whether a face of `star` turns too far when its vertex v or u moves to `point`."""
    px, py, pz = point[0], point[1], point[2]
    vx, vy, vz = vertices[v, 0] - px, vertices[v, 1] - py, vertices[v, 2] - pz
    ux, uy, uz = vertices[u, 0] - px, vertices[u, 1] - py, vertices[u, 2] - pz
    for i in range(n_v + n_u):
        ox, oy, oz = (vx, vy, vz) if i < n_v else (ux, uy, uz)
        a, b = others(corner_vertex, star[i])
        a, b = np.uint32(a), np.uint32(b)
        ax, ay, az = vertices[a, 0] - px, vertices[a, 1] - py, vertices[a, 2] - pz
        bx, by, bz = vertices[b, 0] - px, vertices[b, 1] - py, vertices[b, 2] - pz
        new_x, new_y, new_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        ax, ay, az = ax - ox, ay - oy, az - oz
        bx, by, bz = bx - ox, by - oy, bz - oz
        old_x, old_y, old_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        dot = old_x * new_x + old_y * new_y + old_z * new_z
        old2 = old_x * old_x + old_y * old_y + old_z * old_z
        new2 = new_x * new_x + new_y * new_y + new_z * new_z
        if dot > 0.0 and dot * dot >= cos_foldover * abs(cos_foldover) * old2 * new2:
            continue  # the usual case, without roots
        if dot <= cos_foldover * np.sqrt(old2 * new2):
            longest2 = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
            if old2 > FLAT * FLAT * longest2 * longest2:
                return True
    return False


@part
def harm(surface, quadrics, scratch, rules, v, u, n_v, n_u):
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
    vertices, corner_vertex, point = surface.vertices, surface.corner_vertex, scratch.point
    origin = quadrics.origin
    px, py, pz = point[0], point[1], point[2]
    sum_x = origin[v, NORMAL] + origin[u, NORMAL]
    sum_y = origin[v, NORMAL + 1] + origin[u, NORMAL + 1]
    sum_z = origin[v, NORMAL + 2] + origin[u, NORMAL + 2]
    sum_area = origin[v, AREA] + origin[u, AREA]
    foldover = rules.cos_foldover * abs(rules.cos_foldover)
    deviation = rules.cos_deviation * abs(rules.cos_deviation)
    worst_old = worst_new = 1.0  # squares of the shapes
    vx, vy, vz = vertices[v, 0] - px, vertices[v, 1] - py, vertices[v, 2] - pz
    ux, uy, uz = vertices[u, 0] - px, vertices[u, 1] - py, vertices[u, 2] - pz
    star = scratch.lists[STAR]
    for i in range(n_v + n_u):
        ox, oy, oz = (vx, vy, vz) if i < n_v else (ux, uy, uz)
        a, b = others(corner_vertex, star[i])
        a, b = np.uint32(a), np.uint32(b)
        ax, ay, az = vertices[a, 0] - px, vertices[a, 1] - py, vertices[a, 2] - pz
        bx, by, bz = vertices[b, 0] - px, vertices[b, 1] - py, vertices[b, 2] - pz
        new_x, new_y, new_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        new2 = new_x * new_x + new_y * new_y + new_z * new_z
        across2 = (ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2
        new_sum = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + across2
        ax, ay, az = ax - ox, ay - oy, az - oz
        bx, by, bz = bx - ox, by - oy, bz - oz
        old_x, old_y, old_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        old2 = old_x * old_x + old_y * old_y + old_z * old_z
        old_sum = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + across2

        dot = old_x * new_x + old_y * new_y + old_z * new_z
        if dot * abs(dot) <= foldover * old2 * new2 and rules.cos_foldover > NO_GUARD:
            if old2 > FLAT * FLAT * old_sum * old_sum:
                return FOLDOVER
        if rules.cos_deviation > NO_GUARD:
            rx = sum_x + origin[a, NORMAL] + origin[b, NORMAL]
            ry = sum_y + origin[a, NORMAL + 1] + origin[b, NORMAL + 1]
            rz = sum_z + origin[a, NORMAL + 2] + origin[b, NORMAL + 2]
            r2 = rx * rx + ry * ry + rz * rz
            cancelled = UNDECIDED * (sum_area + origin[a, AREA] + origin[b, AREA])
            dot = rx * new_x + ry * new_y + rz * new_z
            if dot * abs(dot) < deviation * r2 * new2 and r2 > cancelled * cancelled:
                return NORMAL_DEVIATION
        # the shape of a triangle is 4 sqrt(3) area / (sum of the squares of its edges)
        if 12.0 * new2 < worst_new * new_sum * new_sum:
            worst_new = 12.0 * new2 / (new_sum * new_sum)
        if 12.0 * old2 < worst_old * old_sum * old_sum:
            worst_old = 12.0 * old2 / (old_sum * old_sum)

    point[FACTOR] = 1.0
    allowed = min(worst_old, rules.shape * rules.shape)
    if worst_new < allowed:
        if worst_new < NEEDLE * NEEDLE:
            return SHAPE
        point[FACTOR] = allowed / worst_new
    return CONTRACTIBLE
