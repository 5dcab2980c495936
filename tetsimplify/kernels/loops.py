"""Boundary loops: how many edges each has, and which block of faces has all of them."""

from tetsimplify.kernels.corners import DEAD, ahead
from tetsimplify.kernels.jit import kernel_in_place
from tetsimplify.kernels.rings import face_across

UNSEEN = -2


@kernel_in_place
def count_loop_edges(loop, merged_into, size):
    """Count the edges, which are as many as the vertices, of every boundary loop."""
    size[:] = 0
    for v in range(loop.size):
        if loop[v] >= 0 and merged_into[v] == v:
            size[loop[v]] += 1


@kernel_in_place
def find_loop_homes(surface):
    """Tell the block that all edges of a boundary loop are in, -1 where there is none such."""
    corner_vertex, loop, home = surface.corner_vertex, surface.loop, surface.loop_home
    home[:] = UNSEEN
    for corner in range(corner_vertex.size):
        a, b = corner_vertex[corner], corner_vertex[ahead(corner)]
        if a == DEAD or loop[a] < 0 or loop[a] != loop[b]:
            continue
        if face_across(corner_vertex, surface.next_corner, corner) < 0:
            block = surface.face_block[corner // 3]
            home[loop[a]] = block if home[loop[a]] == UNSEEN or home[loop[a]] == block else -1
