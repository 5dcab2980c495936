r"""Nested contraction: which side of the 3-cycles around an edge stays.

Cut the coned surface along the edge vu and along all edges from v and u to their common
neighbours c_0 = a, c_1, ..., c_k = b. It falls into the two faces of vu and regions between
neighbouring c's:

                  v                       lens i has the rim v c_i u c_(i+1)
              / / | \ \
             /  / | \  \                  One lens is kept; the others are removed and the
           c_0 c_1|c_2 c_3                 kept one is closed by merging u into v.
             \  \ | /  /
              \ \ | / /                   (here the faces v u c_0 and v u c_3 stand out of
                  u                        the plane and meet in the edge vu)

The edge can be contracted exactly when every lens has a rim of four edges, all but the kept
one are discs without holes, the kept one does not consist of two faces back to back, and a
boundary loop that v and u lie on runs along the kept one and keeps three edges there.

A region that meets another one while it grows, or the rim of another one, has a rim of more
than four edges: some 3-cycle does not separate, contraction would cut a handle, and the edge
is obstructed.
"""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels.corners import DEAD, ahead, behind
from tetsimplify.kernels.geometry import squared_length
from tetsimplify.kernels.jit import cold_part, inlined
from tetsimplify.kernels.outer import disagreement, vote
from tetsimplify.kernels.rings import face_across, forward_arc, ordered_link
from tetsimplify.kernels.state import (
    CONE,
    CONTRACTIBLE,
    CURSOR,
    CUT_U,
    CUT_V,
    DOOMED,
    ENTRY,
    FAN_U,
    FAN_V,
    FIRST,
    FOLLOWER,
    LAST,
    LENS_STAMP,
    LINK_U,
    LINK_V,
    LOCKED,
    N_FACES,
    N_LENSES,
    N_STEPS,
    N_VERTICES,
    OBSTRUCTED,
    REMOVAL2,
    REMOVAL_LIMIT,
    SLOT,
    STAMP,
    STAR,
    STATUS,
    VOTES,
)

# The status of a lens: it grows, is found to be a disc, or has to be kept and for what reason.
GROWING, DISC, NO_DISC, TOO_FAR, HAS_LOCKED = 0, 1, 2, 3, 4
REASON = (CONTRACTIBLE, CONTRACTIBLE, OBSTRUCTED, REMOVAL_LIMIT, LOCKED)


class Choice(NamedTuple):
    """Which lens stays, by what then survives and goes."""

    outcome: int  # CONTRACTIBLE, or the reason why no lens can be kept
    n_v: int  # surviving corners in STAR
    n_u: int  # the same of u, which follow
    n_doomed: int  # removed faces in DOOMED
    n_removed: int  # vertices that vanish with the removed lenses
    first_removed: int  # the first of them, which are linked by FOLLOWER
    loop_size: int  # edges of the boundary loop that v and u share afterwards, 0 if none


# Below, integers that go into other functions are np.int64(...): for a literal, and for an
# int32, these would be compiled a second time.


@inlined
def keep_one_lens(surface, scratch, rules, outer, corner):
    """Find the lens to keep around the edge that begins at `corner`; see :class:`Choice`.

    While lenses are at hand, `mark` tells of a vertex, from LENS_STAMP on, the lens that it is
    inside of, and then the common neighbour that it is; v and u have LENS_STAMP - 1.
    """
    none = Choice(OBSTRUCTED, 0, 0, 0, 0, -1, 0)
    tally = scratch.tally
    loop_v = surface.loop[surface.corner_vertex[corner]]
    loop_u = surface.loop[surface.corner_vertex[ahead(corner)]]
    if loop_v >= 0 and loop_u >= 0 and loop_v != loop_u:
        return none  # two boundary loops would be pinched together
    n_common = _common_neighbours(surface, scratch, corner)
    if n_common == 0:
        return none
    if outer is not None:
        vote(surface, scratch, corner, outer, n_common)
    tally[N_LENSES] = n_common - 1
    tally[LENS_STAMP] = tally[STAMP] + 2
    tally[STAMP] += 2 * n_common + 1
    if not _seed(surface, scratch, rules, corner):
        return none
    outcome, kept, loop_size = _grow(surface, scratch, rules, outer, corner)
    if outcome != CONTRACTIBLE:
        return Choice(outcome, 0, 0, 0, 0, -1, 0)
    return _remove_others(surface, scratch, corner, kept, loop_size)


@cold_part
def _common_neighbours(surface, scratch, corner):
    """Order the links of v and u and find their common vertices, which cut the lenses.

    Their places go to CUT_V (ascending) and CUT_U (descending); CONE tells which of them is
    virtual, -1 if none is. Returns their number, 0 when the orders around v and u differ:
    then some rim has more than four edges.
    """
    corner_vertex, next_corner, loop = surface.corner_vertex, surface.next_corner, surface.loop
    lists, slot = scratch.lists, scratch.nodes[SLOT]
    link_v, link_u = lists[LINK_V], lists[LINK_U]
    v, u = corner_vertex[corner], corner_vertex[ahead(corner)]
    spare = lists[STAR]  # free until survivors are listed
    cone_v = loop.size + loop[v] if loop[v] >= 0 else -1
    cone_u = loop.size + loop[u] if loop[u] >= 0 else -1
    n_v = ordered_link(
        corner_vertex, next_corner, corner, u, cone_v, spare, slot, link_v, lists[FAN_V]
    )
    n_u = ordered_link(
        corner_vertex, next_corner, ahead(corner), v, cone_u, spare, slot, link_u, lists[FAN_U]
    )
    for i in range(n_v):
        slot[link_v[i]] = i
    n_common = 0
    scratch.tally[CONE] = -1
    before = 0
    for j in range(n_u - 1, 0, -1):
        i = slot[link_u[j]]
        if 0 < i < n_v and link_v[i] == link_u[j]:
            if i < before:
                return 0
            before = i
            if link_u[j] >= loop.size:
                scratch.tally[CONE] = n_common
            lists[CUT_V, n_common] = i
            lists[CUT_U, n_common] = j
            n_common += 1
    return n_common


@cold_part
def _distance2(vertices, vertex, point):
    distance2 = 0.0
    for axis in range(3):
        distance2 += (vertices[vertex, axis] - point[axis]) ** 2
    return distance2


@cold_part
def _claim(surface, scratch, rules, lens, vertex, corner):
    """Put a vertex inside a lens, unless it is on its rim; return whether it belongs there."""
    lists, tally = scratch.lists, scratch.tally
    place = scratch.mark[vertex] - tally[LENS_STAMP]
    if place == lens or place == -1:
        return True
    if place >= 0:  # another lens has it, or it is a common neighbour
        return place == tally[N_LENSES] + lens or place == tally[N_LENSES] + lens + 1
    scratch.mark[vertex] = tally[LENS_STAMP] + lens
    if vertex >= surface.loop.size:  # a hole: the lens is no disc of the real surface
        lists[STATUS, lens] = NO_DISC
        return True
    scratch.nodes[ENTRY, vertex] = corner
    scratch.nodes[FOLLOWER, vertex] = -1
    if lists[FIRST, lens] < 0:
        lists[FIRST, lens] = vertex
    else:
        scratch.nodes[FOLLOWER, lists[LAST, lens]] = vertex
    lists[LAST, lens] = vertex
    lists[N_VERTICES, lens] += 1
    if lists[STATUS, lens] != NO_DISC:
        if _distance2(surface.vertices, vertex, scratch.point) > scratch.point[REMOVAL2]:
            lists[STATUS, lens] = TOO_FAR
        elif surface.locked[vertex] and lists[STATUS, lens] == GROWING:
            lists[STATUS, lens] = HAS_LOCKED
    return True


@cold_part
def _claim_hole(surface, scratch, rules, lens, vertex):
    """Claim the virtual neighbour of a vertex, if it has one."""
    if surface.loop[vertex] < 0:
        return True
    virtual = np.int32(surface.loop.size + surface.loop[vertex])
    return _claim(surface, scratch, rules, lens, virtual, np.int64(-1))


@cold_part
def _claim_face(face_mark, lists, stamp, lens, corner):
    """Count a real face into a lens, once."""
    if corner >= 0 and face_mark[corner // 3] != stamp:
        face_mark[corner // 3] = stamp
        lists[N_FACES, lens] += 1


@inlined
def _seed(surface, scratch, rules, corner):
    """Begin every lens with its sectors of the stars of v and u; False when two lenses meet."""
    corner_vertex, lists = surface.corner_vertex, scratch.lists
    v, u = corner_vertex[corner], corner_vertex[ahead(corner)]
    for axis in range(3):
        scratch.point[axis] = 0.5 * (surface.vertices[v, axis] + surface.vertices[u, axis])
    length2 = squared_length(surface.vertices, v, u)
    scratch.point[REMOVAL2] = max(rules.removal_limit2, rules.removal_edges2 * length2)
    n_lenses, lens_stamp = scratch.tally[N_LENSES], scratch.tally[LENS_STAMP]
    scratch.mark[v] = lens_stamp - 1
    scratch.mark[u] = lens_stamp - 1
    for k in range(n_lenses + 1):
        scratch.mark[lists[LINK_V, lists[CUT_V, k]]] = lens_stamp + n_lenses + k

    for lens in range(n_lenses):
        lists[FIRST, lens] = lists[LAST, lens] = lists[CURSOR, lens] = -1
        lists[N_VERTICES, lens] = lists[N_FACES, lens] = 0
        lists[STATUS, lens] = GROWING
        for side in range(2):
            link, fan = lists[LINK_V + side], lists[FAN_V + side]
            begin = lists[CUT_V, lens] if side == 0 else lists[CUT_U, lens + 1]
            end = lists[CUT_V, lens + 1] if side == 0 else lists[CUT_U, lens]
            for i in range(begin, end):
                _claim_face(scratch.face_mark, lists, lens_stamp + lens, lens, fan[i])
                if i == begin:
                    continue
                # a corner of the vertex in this face or in the one before
                entry = ahead(fan[i]) if fan[i] >= 0 else behind(fan[i - 1])
                if not _claim(surface, scratch, rules, lens, link[i], entry):
                    return False
            # the edge opposite may be on a boundary although no inner vertex is
            if end == begin + 1 and fan[begin] >= 0 and surface.loop[link[begin]] >= 0:
                rim = ahead(fan[begin])
                if face_across(corner_vertex, surface.next_corner, rim) < 0:
                    if not _claim_hole(surface, scratch, rules, lens, link[begin]):
                        return False
    return True


@cold_part
def _advance(surface, scratch, rules, lens):
    """Visit the star of the next vertex of a lens; False when the lens meets another one."""
    corner_vertex, next_corner = surface.corner_vertex, surface.next_corner
    lists, nodes = scratch.lists, scratch.nodes
    cursor = lists[CURSOR, lens]
    vertex = lists[FIRST, lens] if cursor < 0 else nodes[FOLLOWER, cursor]
    lists[CURSOR, lens] = vertex
    scratch.tally[N_STEPS] += 1
    if not _claim_hole(surface, scratch, rules, lens, vertex):
        return False
    stamp = scratch.tally[LENS_STAMP] + lens
    start = nodes[ENTRY, vertex]
    c = start
    while True:
        if corner_vertex[c] != DEAD:
            _claim_face(scratch.face_mark, lists, stamp, lens, c)
            for other in (ahead(c), behind(c)):
                if not _claim(surface, scratch, rules, lens, corner_vertex[other], other):
                    return False
        c = next_corner[c]
        if c == start:
            return True


@cold_part
def _arc_length(surface, scratch, corner, lens):
    """Boundary edges between v and u along a lens that has their virtual neighbour on its rim.

    0 for the other lenses.
    """
    cone = scratch.tally[CONE]
    if cone != lens and cone != lens + 1:
        return 0
    # where the hole comes before the lens its arc leaves v, else u
    begin, end = (corner, ahead(corner)) if cone == lens else (ahead(corner), corner)
    return forward_arc(
        surface.corner_vertex,
        surface.next_corner,
        begin,
        surface.corner_vertex[end],
        scratch.lists[STAR],
        scratch.nodes[SLOT],
    )


@cold_part
def _keepable(surface, scratch, rules, corner, lens):
    """Whether a lens can be kept, all others being discs that may go.

    Returns
    -------
    outcome : int
        CONTRACTIBLE, or the reason why not.
    loop_size : int
        Edges of the boundary loop that v and u share afterwards, 0 if they share none.
    """
    lists = scratch.lists
    width_v = lists[CUT_V, lens + 1] - lists[CUT_V, lens]
    width_u = lists[CUT_U, lens] - lists[CUT_U, lens + 1]
    if width_v == 1 and width_u == 1:
        return OBSTRUCTED, 0  # two faces, which would become equal
    loop_size = 0
    if scratch.tally[CONE] >= 0:
        loop_size = _arc_length(surface, scratch, corner, lens)
        if loop_size < 3:
            return OBSTRUCTED, 0
    # common neighbours between two removed lenses vanish with them
    for k in range(scratch.tally[N_LENSES] + 1):
        c = lists[LINK_V, lists[CUT_V, k]]
        if k == lens or k == lens + 1:
            continue
        if _distance2(surface.vertices, c, scratch.point) > scratch.point[REMOVAL2]:
            return REMOVAL_LIMIT, 0
        if surface.locked[c]:
            return LOCKED, 0
    return CONTRACTIBLE, loop_size


@cold_part
def _grow(surface, scratch, rules, outer, corner):
    """Grow the lenses in step, one vertex each in turn, until it is clear which one to keep.

    Returns
    -------
    outcome : int
        CONTRACTIBLE, or the reason why none can be kept.
    kept : int
        The lens to keep.
    loop_size : int
        As of :func:`_keepable`.
    """
    lists, tally = scratch.lists, scratch.tally
    refused = np.int64(-1)
    while True:
        n_growing = 0
        growing = np.int64(-1)
        forced = np.int64(-1)
        for lens in range(tally[N_LENSES]):
            if lists[STATUS, lens] == GROWING:
                if lists[LAST, lens] == lists[CURSOR, lens]:
                    n_faces = lists[N_FACES, lens] + _arc_length(surface, scratch, corner, lens)
                    is_disc = n_faces == 2 * lists[N_VERTICES, lens] + 2
                    lists[STATUS, lens] = DISC if is_disc else NO_DISC
                elif not _advance(surface, scratch, rules, lens):
                    return OBSTRUCTED, -1, 0
            if lists[STATUS, lens] == GROWING:
                n_growing += 1
                growing = lens
            elif lists[STATUS, lens] != DISC:
                if forced >= 0:
                    return _reason(lists[STATUS, forced], lists[STATUS, lens]), -1, 0
                forced = lens

        if n_growing == 0:
            break
        is_largest = n_growing == 1 and forced < 0 and outer is None
        if is_largest and growing != refused:
            outcome, loop_size = _keepable(surface, scratch, rules, corner, growing)
            if outcome == CONTRACTIBLE:
                return outcome, growing, loop_size
            refused = growing
        if tally[N_STEPS] > rules.max_steps:
            return REMOVAL_LIMIT, -1, 0

    if forced >= 0:
        outcome, loop_size = _keepable(surface, scratch, rules, corner, forced)
        if outcome == OBSTRUCTED:
            outcome = REASON[lists[STATUS, forced]]
        return outcome, forced, loop_size
    return _best(surface, scratch, rules, outer, corner)


@cold_part
def _reason(status, other):
    """Why no lens can be kept when two lenses must be."""
    if status == NO_DISC and other == NO_DISC:
        return OBSTRUCTED
    return REMOVAL_LIMIT if status == TOO_FAR or other == TOO_FAR else LOCKED


@cold_part
def _best(surface, scratch, rules, outer, corner):
    """Choose the lens to keep when all of them are discs; results as of :func:`_grow`."""
    lists, n_lenses = scratch.lists, scratch.tally[N_LENSES]
    best = np.int64(-1)
    best_size = 0
    best_rank = 0
    reason = OBSTRUCTED
    for lens in range(n_lenses):
        rank = lists[N_VERTICES, lens]
        if outer is not None:
            rank = -disagreement(lists[VOTES], n_lenses + 1, lens)
        if best >= 0 and rank <= best_rank:
            continue
        outcome, loop_size = _keepable(surface, scratch, rules, corner, lens)
        if outcome == CONTRACTIBLE:
            best, best_rank, best_size = lens, rank, loop_size
        elif outcome != OBSTRUCTED:
            reason = outcome
    return CONTRACTIBLE if best >= 0 else reason, best, best_size


@inlined
def _remove_others(surface, scratch, corner, kept, loop_size):
    """List what survives and what goes when all lenses but one are removed."""
    corner_vertex, next_corner = surface.corner_vertex, surface.next_corner
    lists, nodes, face_mark = scratch.lists, scratch.nodes, scratch.face_mark
    doomed, n_lenses = lists[DOOMED], scratch.tally[N_LENSES]
    n_v = _copy_fan(lists[FAN_V], lists[CUT_V, kept], lists[CUT_V, kept + 1], lists[STAR], 0)
    n_u = _copy_fan(lists[FAN_U], lists[CUT_U, kept + 1], lists[CUT_U, kept], lists[STAR], n_v)

    # faces that go are marked with their lens, those of the edge with one lens more
    first = scratch.tally[LENS_STAMP]
    stays, of_edge = first + kept, first + n_lenses
    face_mark[corner // 3] = of_edge
    across = face_across(corner_vertex, next_corner, corner)
    if across >= 0:
        face_mark[across] = of_edge
    n_doomed = np.int64(0)
    for c in (corner, ahead(corner)):
        n_doomed = _doom(
            corner_vertex, next_corner, c, face_mark, first, of_edge, stays, doomed, n_doomed
        )
    n_removed = 0
    first_removed = -1
    for lens in range(n_lenses):
        vertex = lists[FIRST, lens] if lens != kept else -1
        while vertex >= 0:
            c = np.int64(nodes[ENTRY, vertex])
            n_doomed = _doom(
                corner_vertex, next_corner, c, face_mark, first, of_edge, stays, doomed, n_doomed
            )
            n_removed += 1
            following = nodes[FOLLOWER, vertex]
            nodes[FOLLOWER, vertex] = first_removed
            first_removed = vertex
            vertex = following
    for k in range(n_lenses + 1):  # common neighbours between two removed lenses
        c = lists[LINK_V, lists[CUT_V, k]]
        if c < surface.loop.size and k != kept and k != kept + 1:
            n_removed += 1
            nodes[FOLLOWER, c] = first_removed
            first_removed = c
    return Choice(CONTRACTIBLE, n_v, n_u, n_doomed, n_removed, first_removed, loop_size)


@cold_part
def _copy_fan(fan, begin, end, star, first):
    """Copy the real corners of a sector; return their number."""
    n = 0
    for i in range(begin, end):
        if fan[i] >= 0:
            star[first + n] = fan[i]
            n += 1
    return n


@cold_part
def _doom(corner_vertex, next_corner, corner, face_mark, first, last, kept, doomed, n):
    """List the faces of a vertex whose marks are from `first` to `last`, but not `kept`, once."""
    c = corner
    while True:
        f = c // 3
        mark = face_mark[f]
        if corner_vertex[c] != DEAD and mark >= first and mark <= last and mark != kept:
            face_mark[f] = first - 1
            doomed[n] = f
            n += 1
        c = next_corner[c]
        if c == corner:
            return n
