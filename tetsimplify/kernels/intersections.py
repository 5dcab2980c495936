"""Which faces of a mesh cross."""

from typing import NamedTuple

import numpy as np

from tetsimplify.kernels import bvh
from tetsimplify.kernels.bvh import overlapping
from tetsimplify.kernels.crossing import faces_cross
from tetsimplify.kernels.jit import kernel_in_place, part

BLOCK = 64  # boxes that are compared at once


class Watch(NamedTuple):
    """Boxes around the faces of a mesh, and memory to search them."""

    tree: bvh.Tree
    box: np.ndarray  # float64 (6,): low x, y, z and high x, y, z of what is looked for
    stack: np.ndarray  # int32 (STACK_SIZE,): groups of boxes to look into
    found: np.ndarray  # int32 (m,): faces whose boxes meet `box`
    block: np.ndarray  # float64 (6, BLOCK): boxes of some of these
    near: np.ndarray  # int32 (BLOCK,): which of these meet another box


def watch_over(vertices, faces):
    """Begin to watch a mesh, all of whose faces are live; not compiled."""
    return Watch(
        tree=bvh.build(vertices, faces),
        box=np.empty(6),
        stack=np.empty(bvh.STACK_SIZE, np.int32),
        found=np.empty(len(faces), np.int32),
        block=np.empty((6, BLOCK)),
        near=np.empty(BLOCK, np.int32),
    )


@kernel_in_place
def crossing_pairs(watch, vertices, faces, first, pairs):
    """Find pairs of faces that cross, slot after slot of the tree from slot `first` on.

    Parameters
    ----------
    pairs : int32 (k, 2), out
        Receives each pair once, the lower face first. There has to be room for as many pairs as
        there are faces.

    Returns
    -------
    next_slot : int
        The slot to go on from with new room; the number of faces at the end.
    n_pairs : int
    """
    n_pairs = 0
    for slot in range(first, len(faces)):
        f = watch.tree.face[slot]
        a = faces[f, 0], faces[f, 1], faces[f, 2]
        bound(vertices, a, watch.box)
        n_found = overlapping(watch.tree, watch.box, watch.stack, watch.found)
        if n_pairs + n_found > len(pairs):
            return slot, n_pairs
        for i in range(n_found):
            g = watch.found[i]
            if g > f and faces_cross(vertices, a, (faces[g, 0], faces[g, 1], faces[g, 2])):
                pairs[n_pairs, 0], pairs[n_pairs, 1] = f, g
                n_pairs += 1
    return len(faces), n_pairs


@part
def bound(vertices, a, box):
    """Leave the box around three vertices in `box`."""
    for axis in range(3):
        x, y, z = vertices[a[0], axis], vertices[a[1], axis], vertices[a[2], axis]
        box[axis] = min(x, y, z)
        box[3 + axis] = max(x, y, z)
