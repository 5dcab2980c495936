"""The paper's other heuristics for the outer triangle: on which side a common neighbour is.

Every common neighbour c of v and u is given to the side of a or of b, the apexes of the two
faces of vu, whichever is nearer: by Euclidean distance, or by the number of edges on the
shortest path that avoids v and u. The lens to keep is the one that most of them agree with.
"""

from tetsimplify.kernels.corners import DEAD, ahead, behind
from tetsimplify.kernels.cost import squared_length
from tetsimplify.kernels.jit import cold_part
from tetsimplify.kernels.state import (
    CUT_V,
    ENTRY,
    FAN_V,
    FOLLOWER,
    LENGTHS_A,
    LENGTHS_B,
    LINK_V,
    PATH,
    SLOT,
    STAMP,
    VOTES,
)

UNREACHED = 2**31 - 1


@cold_part
def vote(surface, scratch, corner, outer, n_common):
    """Vote for each common neighbour: +1 if it is nearer to a, -1 if to b, 0 if to neither."""
    link, cut, votes = scratch.lists[LINK_V], scratch.lists[CUT_V], scratch.lists[VOTES]
    last = n_common - 1
    if outer == PATH:
        to_a, to_b = scratch.lists[LENGTHS_A], scratch.lists[LENGTHS_B]
        _path_lengths(surface, scratch, corner, 0, to_a, n_common)
        _path_lengths(surface, scratch, corner, last, to_b, n_common)
        for k in range(n_common):
            votes[k] = (to_a[k] < to_b[k]) - (to_b[k] < to_a[k])
        return
    n_real = surface.loop.size
    a, b = link[cut[0]], link[cut[last]]
    for k in range(n_common):  # a virtual vertex is far from all
        c = link[cut[k]]
        votes[k] = 0
        if c < n_real and a < n_real and b < n_real:
            to_a2 = squared_length(surface.vertices, a, c)
            to_b2 = squared_length(surface.vertices, b, c)
            votes[k] = (to_a2 < to_b2) - (to_b2 < to_a2)
        elif c < n_real:
            votes[k] = int(a < n_real) - int(b < n_real)


@cold_part
def disagreement(votes, n_common, lens):
    """How many common neighbours would be on the wrong side if this lens were kept."""
    n = 0
    for k in range(n_common):
        n += votes[k] == (-1 if k <= lens else 1)
    return n


@cold_part
def _path_lengths(surface, scratch, corner, target, lengths, n_common):
    """Edges on the shortest paths from c_target to the common neighbours that avoid v and u."""
    corner_vertex, next_corner, mark = surface.corner_vertex, surface.next_corner, scratch.mark
    length, follower, entry = scratch.nodes[SLOT], scratch.nodes[FOLLOWER], scratch.nodes[ENTRY]
    link, cut, fan = scratch.lists[LINK_V], scratch.lists[CUT_V], scratch.lists[FAN_V]
    for k in range(n_common):
        lengths[k] = UNREACHED
    place = cut[target]
    begin = link[place]
    if begin >= surface.loop.size:
        return
    stamp = scratch.tally[STAMP] + 1
    scratch.tally[STAMP] = stamp
    for end in (corner, ahead(corner)):
        mark[corner_vertex[end]] = stamp
        length[corner_vertex[end]] = UNREACHED
    mark[begin] = stamp
    length[begin] = 0
    follower[begin] = -1
    entry[begin] = ahead(fan[place]) if fan[place] >= 0 else behind(fan[place - 1])
    vertex = last = begin
    while vertex >= 0:
        start = entry[vertex]
        c = start
        while True:
            if corner_vertex[c] != DEAD:
                for other in (ahead(c), behind(c)):
                    w = corner_vertex[other]
                    if mark[w] != stamp:
                        mark[w] = stamp
                        length[w] = length[vertex] + 1
                        entry[w] = other
                        follower[w] = -1
                        follower[last] = w
                        last = w
            c = next_corner[c]
            if c == start:
                break
        vertex = follower[vertex]
    for k in range(n_common):
        c = link[cut[k]]
        if mark[c] == stamp:
            lengths[k] = length[c]
