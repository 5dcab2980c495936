"""Where the vertex goes that replaces an edge."""

from tetsimplify.kernels.guards import NO_FOLDOVER_GUARD, turns_over
from tetsimplify.kernels.jit import part
from tetsimplify.kernels.state import PLACE, STAR_U, STAR_V


@part
def find_place(surface, scratch, rules, v, u, n_v, n_u):
    """Try the placements in turn until one passes the guards; return whether one did.

    A locked end stays where it is; so does a boundary vertex when the other end is none.
    The place is left in `scratch.point`.
    """
    fixed = -1.0
    if surface.locked[v] or (surface.loop[v] >= 0 and surface.loop[u] < 0):
        fixed = 0.0
    if surface.locked[u] or (fixed < 0.0 and surface.loop[u] >= 0 and surface.loop[v] < 0):
        fixed = 1.0
    vertices, corner_vertex, point = surface.vertices, surface.corner_vertex, scratch.point
    star_v, star_u = scratch.lists[STAR_V], scratch.lists[STAR_U]
    cos = rules.cos_foldover
    for place in rules.places:
        t = place if fixed < 0.0 else fixed
        point[PLACE] = t
        for axis in range(3):
            a, b = vertices[v, axis], vertices[u, axis]
            point[axis] = a if t == 0.0 else b if t == 1.0 else a + t * (b - a)
        if cos <= NO_FOLDOVER_GUARD:
            return True
        if not turns_over(vertices, corner_vertex, star_v, n_v, v, point, cos):
            if not turns_over(vertices, corner_vertex, star_u, n_u, u, point, cos):
                return True
        if fixed >= 0.0:
            return False
    return False
