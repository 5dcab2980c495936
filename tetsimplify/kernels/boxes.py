"""Boxes around runs of things that are near to each other, for a quick look at all of them.

Of a few thousand things, a list of boxes around every dozen is looked through as fast as a tree is
built for a single question, and a box is enlarged at once where one of its things has moved.
"""

import numpy as np

from tetsimplify.kernels.bvh import WIDTH
from tetsimplify.kernels.jit import part
from tetsimplify.kernels.nearest import distance2_to_box

IN_BOX = 16  # things
PER_FACE = 8  # boxes that are looked at in the time that a face takes, about


def n_groups(n):
    """How many groups of boxes there are for n things: float64 (n_groups, 6, WIDTH)."""
    return -(-n // (IN_BOX * WIDTH))


@part
def clear(boxes):
    """Let nothing be in them."""
    boxes[:, :3] = np.inf
    boxes[:, 3:] = -np.inf


@part
def enlarge(boxes, i, axis, low, high):
    """Let a range of the i-th thing be in its box."""
    group, lane = i // (IN_BOX * WIDTH), i // IN_BOX % WIDTH
    boxes[group, axis, lane] = min(boxes[group, axis, lane], low)
    boxes[group, 3 + axis, lane] = max(boxes[group, 3 + axis, lane], high)


@part
def measure_group(boxes, group, point, distances2):
    """Squared distances from a point to the boxes of a group, infinite where nothing is in one."""
    of_group = boxes[group]
    for lane in range(of_group.shape[1]):  # LLVM unrolls range(WIDTH) and vectorizes this
        distances2[lane] = distance2_to_box(of_group, lane, point[0], point[1], point[2])
