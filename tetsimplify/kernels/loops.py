"""Boundary loops: how many edges each has, and which block of faces has all that touches it."""

from tetsimplify.kernels.blocks import SHARED
from tetsimplify.kernels.jit import kernel_in_place

UNSEEN = -2  # no vertex of the loop yet
MET = -2  # in place of the vertex itself


@kernel_in_place
def follow_merges(merged_into, on_loops):
    """Replace boundary vertices by what they were merged into, each once; return how many.

    What was removed is left out. A vertex that has been met is marked in `merged_into` meanwhile.
    """
    n = 0
    for i in range(on_loops.size):
        v = on_loops[i]
        while v >= 0 and merged_into[v] != v:
            v = merged_into[v]  # MET for one that was met
        if v >= 0:
            on_loops[n] = v
            merged_into[v] = MET
            n += 1
    for i in range(n):
        merged_into[on_loops[i]] = on_loops[i]
    return n


@kernel_in_place
def count_loop_edges(on_loops, loop, size):
    """Count the edges, which are as many as the vertices, of every boundary loop."""
    size[:] = 0
    for v in on_loops:
        size[loop[v]] += 1


@kernel_in_place
def find_loop_homes(on_loops, loop, vertex_block, home):
    """Tell the block that has all faces at a boundary loop, SHARED where there is none such."""
    home[:] = UNSEEN
    for v in on_loops:
        known, block = home[loop[v]], vertex_block[v]
        home[loop[v]] = block if known == UNSEEN or known == block else SHARED
