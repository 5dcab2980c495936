"""Guards: where a contracted edge may go without folding the surface over."""

import numpy as np

from tetsimplify.kernels.corners import ahead, behind
from tetsimplify.kernels.jit import part

NO_FOLDOVER_GUARD = -2.0  # a cosine that every pair of normals exceeds

# A face whose height is below this part of its longest edge has no normal to speak of.
FLAT = 1e-10


@part
def turns_over(vertices, corner_vertex, star, n, v, point, cos_foldover):
    """Whether a face of `star` turns too far when its vertex v moves to `point`."""
    px, py, pz = point[0], point[1], point[2]
    ox, oy, oz = vertices[v, 0] - px, vertices[v, 1] - py, vertices[v, 2] - pz
    for i in range(n):
        a = corner_vertex[ahead(star[i])]
        b = corner_vertex[behind(star[i])]
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
