r"""Do two faces cross? Exactly, and whatever their shapes.

Two faces *cross* when they meet elsewhere than in the vertex or the edge that they share. Faces
are closed sets, so touching is meeting. What they share are vertex indices: other vertices in the
same place touch. A face without area is the segment or the point that it looks like.

What there is to tell depends on what is shared, since beside that the faces go on for ever:

     nothing: triangles             a vertex: cones             an edge: half-planes

        .                               b      d                       a
        | \    .                         \    /                      /   \
        |   \ / \                         \  /                      v --- w
        |   / \   \                        \/                        \   /
        .--/---.    \                      / \                         b
          .----------.                    /   v -- a
                                         c

Signs of `predicates.py` answer all of it. Where they all are 0, everything is in one plane, and is
looked at along an axis that the plane is not parallel to.
"""

from tetsimplify.kernels.jit import cold_part, inlined
from tetsimplify.kernels.predicates import orient2d, orient3d


@cold_part
def faces_cross(vertices, a, b):
    """Whether two faces, each given by its three vertices, cross."""
    n_shared = 0
    i0 = j0 = i1 = j1 = 0  # of the shared vertices, their places in a and b
    for i in range(3):
        for j in range(3):
            if a[i] != b[j]:
                continue
            if n_shared == 0:
                n_shared, i0, j0 = 1, i, j
            elif n_shared == 1 and a[i] != a[i0]:
                n_shared, i1, j1 = 2, i, j
            elif n_shared == 2 and a[i] != a[i0] and a[i] != a[i1]:
                return True  # the same face twice
    if n_shared == 0:
        return triangles_meet(vertices, a, b)
    if n_shared == 1:
        i1, i2, j1, j2 = (i0 + 1) % 3, (i0 + 2) % 3, (j0 + 1) % 3, (j0 + 2) % 3
        return cones_meet(vertices, a[i0], a[i1], a[i2], b[j1], b[j2])
    return half_planes_meet(vertices, a[i0], a[i1], a[3 - i0 - i1], b[3 - j0 - j1])


# ------------------------------------------------------------------------- nothing is shared


@inlined
def triangles_meet(vertices, a, b):
    """Whether two triangles have a point in common."""
    s = _sides(vertices, b, a)
    if s[0] == s[1] == s[2] != 0:
        return False
    t = _sides(vertices, a, b)
    if t[0] == t[1] == t[2] != 0:
        return False
    if s[0] == s[1] == s[2] and t[0] == t[1] == t[2]:
        return _flat_triangles_meet(vertices, a, b)
    return _pierces(vertices, a, s, b) or _pierces(vertices, b, t, a)


@inlined
def _sides(vertices, a, b):
    """On which sides of the plane of a the three vertices of b lie."""
    return (
        side(vertices, a[0], a[1], a[2], b[0]),
        side(vertices, a[0], a[1], a[2], b[1]),
        side(vertices, a[0], a[1], a[2], b[2]),
    )


@inlined
def _pierces(vertices, a, s, b):
    """Whether an edge of a that is not in the plane of b meets b.

    Of two triangles that meet and are not in one plane, one has such an edge.
    """
    for i in range(3):
        j = (i + 1) % 3
        if s[i] == s[j]:
            continue
        low = high = 0
        for k in range(3):  # on which sides of its line the edges of b go by
            way = side(vertices, a[i], a[j], b[k], b[(k + 1) % 3])
            low, high = min(low, way), max(high, way)
        if low * high == 0:
            return True
    return False


@inlined
def _flat_triangles_meet(vertices, a, b):
    """The same of triangles in one plane, or of two that both have no area."""
    axis = max(_view(vertices, a[0], a[1], a[2]), _view(vertices, b[0], b[1], b[2]))
    if axis < 0:
        p, q = _ends(vertices, a)
        r, s = _ends(vertices, b)
        if side(vertices, p, q, r, s) != 0:
            return False
        axis = max(_view(vertices, p, q, r), _view(vertices, p, q, s), _view(vertices, p, r, s))
        if axis < 0:  # all is in one line
            return _order(vertices, p, s) <= 0 and _order(vertices, r, q) <= 0
    return not (_separates(vertices, a, b, axis) or _separates(vertices, b, a, axis))


@cold_part
def _separates(vertices, a, b, axis):
    """Whether the line along an edge of a has all of b, and nothing of a, on one side."""
    for i in range(3):
        p, q = a[i], a[(i + 1) % 3]
        way = turn(vertices, p, q, b[0], axis)
        if way != 0 and way != turn(vertices, p, q, a[(i + 2) % 3], axis):
            if way == turn(vertices, p, q, b[1], axis) == turn(vertices, p, q, b[2], axis):
                return True
    return False


# -------------------------------------------------------------------------- a vertex is shared


@inlined
def cones_meet(vertices, v, a, b, c, d):
    """Whether the cones from v through ab and through cd meet elsewhere than in v."""
    # abc is the sign of the determinant of a - v, b - v, c - v, and so on
    abc, abd = side(vertices, a, b, c, v), side(vertices, a, b, d, v)
    if abc * abd > 0:
        return False
    cda, cdb = side(vertices, c, d, a, v), side(vertices, c, d, b, v)
    if cda * cdb > 0:
        return False
    if abc == abd == 0 or cda == cdb == 0:  # in one plane, or a line through the plane
        return abc == abd == cda == cdb == 0 and _flat_cones_meet(vertices, v, a, b, c, d)
    # The planes meet in a line in the direction abd c - abc d = cda b - cdb a. One half of it is
    # in the cone cd, the one or the other as abd or abc is the larger, one half in the cone ab.
    return (abd > abc) == (cda > cdb)


@inlined
def _flat_cones_meet(vertices, v, a, b, c, d):
    """The same of cones in one plane: a ray that bounds one of them is in the other."""
    axis = max(_view(vertices, v, a, b), _view(vertices, v, c, d))
    if axis < 0:
        for p in (a, b):
            for q in (c, d):
                if _agree(vertices, v, p, q):
                    return True
        return False
    return (
        _holds(vertices, v, a, b, c, axis)
        or _holds(vertices, v, a, b, d, axis)
        or _holds(vertices, v, c, d, a, axis)
        or _holds(vertices, v, c, d, b, axis)
    )


@inlined
def _holds(vertices, v, a, b, x, axis):
    """Whether the cone from v through ab, seen along an axis, holds x, which is not v."""
    way = turn(vertices, v, a, b, axis)
    if way == 0 or _order(vertices, x, v) == 0:
        return False
    return way * turn(vertices, v, a, x, axis) >= 0 and way * turn(vertices, v, x, b, axis) >= 0


@inlined
def _agree(vertices, v, a, b):
    """Whether a and b are in the same direction from v."""
    order = _order(vertices, v, a)
    return order != 0 and order == _order(vertices, v, b) and _view(vertices, v, a, b) < 0


# --------------------------------------------------------------------------- an edge is shared


@inlined
def half_planes_meet(vertices, v, w, a, b):
    """Whether faces vwa and vwb meet elsewhere than in vw: they are folded onto each other."""
    return side(vertices, v, w, a, b) == 0 and _flat_half_planes_meet(vertices, v, w, a, b)


@inlined
def _flat_half_planes_meet(vertices, v, w, a, b):
    """The same when all is in one plane."""
    axis = max(_view(vertices, v, w, a), _view(vertices, v, w, b))
    if axis >= 0:
        return turn(vertices, v, w, a, axis) * turn(vertices, v, w, b, axis) > 0
    # all is in one line, or v and w are in the same place: do both go beyond the same end?
    if _order(vertices, v, w) > 0:
        v, w = w, v
    return _view(vertices, v, a, b) < 0 and (
        (_order(vertices, a, v) < 0 and _order(vertices, b, v) < 0)
        or (_order(vertices, w, a) < 0 and _order(vertices, w, b) < 0)
    )


# ------------------------------------------------------------------------------------- signs


@cold_part
def side(vertices, a, b, c, d):
    """On which side of the plane through a, b, c the vertex d lies; see `orient3d`."""
    return orient3d(
        (vertices[a, 0], vertices[a, 1], vertices[a, 2]),
        (vertices[b, 0], vertices[b, 1], vertices[b, 2]),
        (vertices[c, 0], vertices[c, 1], vertices[c, 2]),
        (vertices[d, 0], vertices[d, 1], vertices[d, 2]),
    )


@cold_part
def turn(vertices, a, b, c, axis):
    """Which way a, b, c turn when seen along an axis; see `orient2d`."""
    x, y = (axis + 1) % 3, (axis + 2) % 3
    return orient2d(
        (vertices[a, x], vertices[a, y]),
        (vertices[b, x], vertices[b, y]),
        (vertices[c, x], vertices[c, y]),
    )


@cold_part
def _view(vertices, a, b, c):
    """An axis along which three vertices are not seen in line, -1 if they are in line."""
    for axis in range(3):
        if turn(vertices, a, b, c, axis) != 0:
            return axis
    return -1


@cold_part
def _order(vertices, a, b):
    """-1, 0 or 1 as a comes before b, is in the same place, or comes after it.

    Coordinates are compared in turn, so along any line points are in order.
    """
    for axis in range(3):
        if vertices[a, axis] != vertices[b, axis]:
            return -1 if vertices[a, axis] < vertices[b, axis] else 1
    return 0


@inlined
def _ends(vertices, a):
    """The ends of the segment that three vertices in line make."""
    low = high = a[0]
    for k in range(1, 3):
        if _order(vertices, a[k], low) < 0:
            low = a[k]
        if _order(vertices, a[k], high) > 0:
            high = a[k]
    return low, high
