"""Where the vertex goes that replaces an edge.

Without quadrics the places of the rules are tried in turn, with quadrics the place where the error
is least, and then the others, the cheapest first. The first that passes the guards is taken; it
is left in `scratch.point`.
"""

from tetsimplify.kernels.guards import NO_GUARD, harm, turns_over
from tetsimplify.kernels.jit import part
from tetsimplify.kernels.quadrics import reachable_optimum, sum_at, value
from tetsimplify.kernels.state import CONTRACTIBLE, ERROR, FOLDOVER, PLACE

FREE = -1.0  # no end of the edge has to stay


@part
def fixed_place(surface, v, u):
    """The end of the edge vu that has to stay: 0 for v, 1 for u, FREE for none.

    A locked end stays where it is; so does a boundary vertex when the other end is none.
    """
    locked, loop = surface.locked, surface.loop
    if locked[u] or (loop[u] >= 0 and loop[v] < 0 and not locked[v]):
        return 1.0
    return 0.0 if locked[v] or (loop[v] >= 0 and loop[u] < 0) else FREE


@part
def find_place(surface, quadrics, scratch, rules, v, u):
    """Find a place that passes the guards: CONTRACTIBLE, or the guard that forbids the last."""
    if quadrics is None:
        return _first_place(surface, scratch, rules, v, u)
    return _cheapest_place(surface, quadrics, scratch, rules, v, u)


@part
def _first_place(surface, scratch, rules, v, u):
    """The first of the places of the rules that folds nothing over."""
    fixed = fixed_place(surface, v, u)
    vertices, point = surface.vertices, scratch.point
    for place in rules.places:
        t = place if fixed == FREE else fixed
        point[PLACE] = t
        for axis in range(3):
            a, b = vertices[v, axis], vertices[u, axis]
            point[axis] = a if t == 0.0 else b if t == 1.0 else a + t * (b - a)
        if rules.cos_foldover <= NO_GUARD:
            return CONTRACTIBLE
        if not turns_over(surface, scratch, rules, v, u):
            return CONTRACTIBLE
        if fixed != FREE:
            break
    return FOLDOVER


@part
def least_error(q, x, y, z, fixed, rules):
    """The best place for an edge with the quadric q, by the error alone.

    Parameters
    ----------
    x, y, z : float
        The edge, from v to u.
    fixed : float
        The place that is given, or FREE.

    Returns
    -------
    px, py, pz : float
        The place, relative to v.
    place : float
        Its parameter along the edge.
    error : float
    """
    if fixed != FREE:
        return fixed * x, fixed * y, fixed * z, fixed, value(q, fixed * x, fixed * y, fixed * z)
    if rules.optimum:
        px, py, pz, is_near = reachable_optimum(q, x, y, z)
        if is_near:
            along, length2 = px * x + py * y + pz * z, x * x + y * y + z * z
            place = min(max(along / length2, 0.0), 1.0) if length2 > 0.0 else 0.5
            return px, py, pz, place, value(q, px, py, pz)
    best, least = (
        rules.places[0],
        value(q, rules.places[0] * x, rules.places[0] * y, rules.places[0] * z),
    )
    for t in rules.places[1:]:
        error = value(q, t * x, t * y, t * z)
        if error < least:
            best, least = t, error
    return best * x, best * y, best * z, best, least


@part
def _cheapest_place(surface, quadrics, scratch, rules, v, u):
    """The place of least error, or the cheapest of the places of the rules, that harms nothing."""
    vertices, point = surface.vertices, scratch.point
    q = sum_at(quadrics, vertices, v, u)
    ox, oy, oz = vertices[v, 0], vertices[v, 1], vertices[v, 2]
    x, y, z = vertices[u, 0] - ox, vertices[u, 1] - oy, vertices[u, 2] - oz
    fixed = fixed_place(surface, v, u)
    px, py, pz, point[PLACE], point[ERROR] = least_error(q, x, y, z, fixed, rules)
    tried = -1.0
    while True:
        point[0], point[1], point[2] = ox + px, oy + py, oz + pz
        if px == x and py == y and pz == z:  # ends stay what they are to the last bit
            point[0], point[1], point[2] = vertices[u, 0], vertices[u, 1], vertices[u, 2]
        harmed = harm(surface, quadrics, scratch, rules, v, u)
        if harmed == CONTRACTIBLE or fixed != FREE:
            break
        least = -1.0  # the others in the order of their errors
        for t in rules.places:
            error = value(q, t * x, t * y, t * z)
            if error > tried and (least < 0.0 or error < least):
                least, point[PLACE] = error, t
        if least < 0.0:
            break
        tried = point[ERROR] = least
        px, py, pz = point[PLACE] * x, point[PLACE] * y, point[PLACE] * z
    return harmed
