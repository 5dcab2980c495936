r"""The guard against self-intersections: it tells contractions that would make faces cross.

When v and u become one, only the faces around the new vertex change, its *star*. They are tried
against each other and against all other faces near them:

     . --- . --- .      Most that are near share a vertex with a face of the star. They need not be
      \   / \   /       tried in pairs: where the faces around a vertex, seen along some axis, lie
       \ /   \ /        side by side, none of them cross. So it mostly is at v, a, b, ...
        a --- b
       / \   / \        Of the others, most are seen on the far side of the line ab, va or vb.
      /   \ /   \
     . --- v --- .      What is left, little, is for `faces_cross` to tell.

A pair of faces is the same pair before and after, and only pairs that did not cross before count.
So a mesh without crossings gets none, and one that has some gets no others.
"""

from typing import NamedTuple

from tetsimplify.kernels.bvh import enlarge, overlapping
from tetsimplify.kernels.corners import DEAD, ahead, behind
from tetsimplify.kernels.crossing import faces_cross, turn
from tetsimplify.kernels.intersections import BLOCK, bound
from tetsimplify.kernels.jit import cold_part, inlined, part
from tetsimplify.kernels.state import DOOMED, STAMP, STAR


class Move(NamedTuple):
    """What is to become of an edge vu."""

    v: int
    u: int
    old: tuple  # place of v before
    n: int  # corners of the star, in STAR
    first: int  # of these, which have another shape than before
    last: int
    n_doomed: int  # faces that go, in DOOMED
    axis: int  # along which much is seen of the star
    way: int  # that its faces turn then, 1 or -1


@cold_part
def star_crosses(watch, surface, scratch, v, u, n_v, n_u, n_doomed):
    """Whether contracting the edge vu would make two faces cross that did not cross before.

    Parameters
    ----------
    watch : Watch
        Over the mesh as it is, see :func:`follow`.
    surface : Surface
        A manifold. The place of v is changed meanwhile.
    scratch : Scratch
        The corners that survive are in STAR, the faces that go in DOOMED, the place
        of the new vertex in `point`.
    n_v, n_u, n_doomed : int
        How many there are of each.
    """
    vertices, star = surface.vertices, scratch.lists[STAR]
    n = n_v + n_u
    old = vertices[v, 0], vertices[v, 1], vertices[v, 2]
    new = scratch.point[0], scratch.point[1], scratch.point[2]
    first = n_v if new == old else 0
    last = n_v if new == (vertices[u, 0], vertices[u, 1], vertices[u, 2]) else n
    _put(vertices, v, new)
    axis, way = _best_view(surface, star, v, n)
    move = Move(v, u, old, n, first, last, n_doomed, axis, way)
    _mark_spread(surface, scratch, move)
    crosses = _crosses_itself(surface, scratch, move)
    crosses = crosses or _crosses_others(watch, surface, scratch, move)
    _put(vertices, v, old)
    return crosses


@part
def follow(watch, surface, star, n):
    """Let the boxes grow with the faces of the corners star[:n], after a contraction."""
    for i in range(n):
        face = star[i] // 3
        bound(surface.vertices, _face(surface.corner_vertex, face), watch.box)
        enlarge(watch.tree, face, watch.box)


# ----------------------------------------------------------------- faces that share a vertex


@inlined
def _best_view(surface, star, v, n):
    """An axis along which much is seen of the faces around v, and the way that they turn then."""
    vertices, corner_vertex = surface.vertices, surface.corner_vertex
    px, py, pz = vertices[v, 0], vertices[v, 1], vertices[v, 2]
    x = y = z = 0.0  # the sum of their normals
    for i in range(n):
        a, b = corner_vertex[ahead(star[i])], corner_vertex[behind(star[i])]
        ax, ay, az = vertices[a, 0] - px, vertices[a, 1] - py, vertices[a, 2] - pz
        bx, by, bz = vertices[b, 0] - px, vertices[b, 1] - py, vertices[b, 2] - pz
        x, y, z = x + (ay * bz - az * by), y + (az * bx - ax * bz), z + (ax * by - ay * bx)
    if abs(z) >= max(abs(x), abs(y)):
        return 2, 1 if z > 0.0 else -1
    if abs(y) >= abs(x):
        return 1, 1 if y > 0.0 else -1
    return 0, 1 if x > 0.0 else -1


@inlined
def _mark_spread(surface, scratch, move):
    """Mark the vertices of the star around which the faces will lie side by side."""
    corner_vertex, star, mark = surface.corner_vertex, scratch.lists[STAR], scratch.mark
    stamp = scratch.tally[STAMP] + 2  # stamp - 1: the faces do not
    scratch.tally[STAMP] = stamp
    n_rounds = 0
    for i in range(move.n):
        ends = ahead(star[i]), behind(star[i])
        a, b = corner_vertex[ends[0]], corner_vertex[ends[1]]
        n_rounds += _rounds(surface.vertices, move.v, a, b, move.axis, move.way)
        for corner in ends:
            if mark[corner_vertex[corner]] < stamp - 1:
                is_spread = _is_spread(surface, move, corner)
                mark[corner_vertex[corner]] = stamp if is_spread else stamp - 1
    is_inside = surface.loop[move.v] < 0 and surface.loop[move.u] < 0
    mark[move.v] = stamp if n_rounds <= int(is_inside) else stamp - 1


@inlined
def _is_spread(surface, move, corner):
    """Whether the faces around the vertex of a corner will lie side by side.

    Those of removed lenses count as well, so the answer may be no too often.
    """
    corner_vertex = surface.corner_vertex
    w = corner_vertex[corner]
    n_rounds = 0
    c = corner
    while True:
        a, b = corner_vertex[ahead(c)], corner_vertex[behind(c)]
        a, b = move.v if a == move.u else a, move.v if b == move.u else b
        if a != b:  # else it is dead, or a face of the edge
            n_rounds += _rounds(surface.vertices, w, a, b, move.axis, move.way)
        c = surface.next_corner[c]
        if c == corner:
            return n_rounds <= int(surface.loop[w] < 0)


@inlined
def _rounds(vertices, w, a, b, axis, way):
    """1 if the face wab, seen along an axis, crosses a certain ray from w, 0 if not.

    2 if it does not turn the way it should. Faces that all do lie side by side if they cross the
    ray once, or where they leave a gap not at all.
    """
    if turn(vertices, w, a, b, axis) != way:
        return 2
    y = (axis + 2) % 3
    if way < 0:
        a, b = b, a
    return int(vertices[a, y] < vertices[w, y] <= vertices[b, y])


@inlined
def _crosses_itself(surface, scratch, move):
    """Whether two faces of the star cross and did not before."""
    corner_vertex, star = surface.corner_vertex, scratch.lists[STAR]
    if scratch.mark[move.v] == scratch.tally[STAMP]:
        return False
    for i in range(1, move.n):
        a = move.v, corner_vertex[ahead(star[i])], corner_vertex[behind(star[i])]
        for j in range(i):
            b = move.v, corner_vertex[ahead(star[j])], corner_vertex[behind(star[j])]
            if faces_cross(surface.vertices, a, b):
                if not _crossed(surface, move, star[i] // 3, star[j] // 3):
                    return True
    return False


# --------------------------------------------------------------------------- all other faces


@inlined
def _crosses_others(watch, surface, scratch, move):
    """Whether a face of the star crosses one that is not of it, and did not before."""
    vertices, corner_vertex, star = surface.vertices, surface.corner_vertex, scratch.lists[STAR]
    mark, spread = scratch.mark, scratch.tally[STAMP]
    turns = mark[move.v] == spread  # and so all faces of the star do, the same way
    n_others = _find_others(watch, surface, star, move)
    for start in range(0, n_others, BLOCK):
        n = min(BLOCK, n_others - start)
        for j in range(n):
            g = watch.found[start + j]
            bound(vertices, _face(corner_vertex, g), watch.block[:, j])
        for i in range(move.first, move.last):
            a = move.v, corner_vertex[ahead(star[i])], corner_vertex[behind(star[i])]
            p = a[1] if mark[a[1]] == spread else DEAD  # faces that share p or q do not cross
            q = a[2] if mark[a[2]] == spread else DEAD
            bound(vertices, a, watch.box)
            for j in range(_near(watch, n)):
                g = watch.found[start + watch.near[j]]
                b = _face(corner_vertex, g)
                if p == b[0] or p == b[1] or p == b[2] or q == b[0] or q == b[1] or q == b[2]:
                    continue
                if turns and _is_beyond(vertices, a, b, move):
                    continue
                if not faces_cross(vertices, a, b) or _is_doomed(scratch, move, g):
                    continue
                if not _crossed(surface, move, star[i] // 3, g):
                    return True
    return False


@part
def _find_others(watch, surface, star, move):
    """Collect the faces near the star that have neither v nor u; return their number."""
    vertices, corner_vertex = surface.vertices, surface.corner_vertex
    v, u, box, found = move.v, move.u, watch.box, watch.found
    for axis in range(3):
        low = high = vertices[v, axis]
        for i in range(move.first, move.last):
            a = vertices[corner_vertex[ahead(star[i])], axis]
            b = vertices[corner_vertex[behind(star[i])], axis]
            low, high = min(low, a, b), max(high, a, b)
        box[axis], box[3 + axis] = low, high
    n_others = 0
    for i in range(overlapping(watch.tree, box, watch.stack, found)):
        a, b, c = _face(corner_vertex, found[i])
        if a != DEAD and a != v and b != v and c != v and a != u and b != u and c != u:
            found[n_others] = found[i]
            n_others += 1
    return n_others


@part
def _near(watch, n):
    """Collect which of the first n boxes of the block meet the box; return their number."""
    box, block, near = watch.box, watch.block, watch.near
    low_x, low_y, low_z, high_x, high_y, high_z = box[0], box[1], box[2], box[3], box[4], box[5]
    n_near = 0
    for j in range(n):  # without branches, so that many are compared at once
        near[n_near] = j
        n_near += (
            (block[0, j] <= high_x)
            & (block[1, j] <= high_y)
            & (block[2, j] <= high_z)
            & (block[3, j] >= low_x)
            & (block[4, j] >= low_y)
            & (block[5, j] >= low_z)
        )
    return n_near


@inlined
def _is_beyond(vertices, a, b, move):
    """Whether a face b is seen wholly on the far side of an edge of a face a that turns."""
    for k in (1, 2, 0):  # the edge opposite to v first
        p, q = a[k], a[(k + 1) % 3]
        if turn(vertices, p, q, b[0], move.axis) == -move.way:
            if turn(vertices, p, q, b[1], move.axis) == -move.way:
                if turn(vertices, p, q, b[2], move.axis) == -move.way:
                    return True
    return False


@inlined
def _is_doomed(scratch, move, face):
    is_doomed = False
    for i in range(move.n_doomed):
        is_doomed |= scratch.lists[DOOMED, i] == face
    return is_doomed


@inlined
def _crossed(surface, move, f, g):
    """Whether two faces crossed while v was in its old place."""
    vertices = surface.vertices
    new = vertices[move.v, 0], vertices[move.v, 1], vertices[move.v, 2]
    _put(vertices, move.v, move.old)
    a, b = _face(surface.corner_vertex, f), _face(surface.corner_vertex, g)
    crossed = faces_cross(vertices, a, b)
    _put(vertices, move.v, new)
    return crossed


@inlined
def _face(corner_vertex, face):
    """The vertices of a face."""
    return corner_vertex[3 * face], corner_vertex[3 * face + 1], corner_vertex[3 * face + 2]


@inlined
def _put(vertices, v, place):
    vertices[v, 0], vertices[v, 1], vertices[v, 2] = place
