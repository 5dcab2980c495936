"""Lists of numbers, of which an empty one stands for all numbers in order."""

import numpy as np

from tetsimplify.kernels.jit import part


@part
def item(listed, i):
    """The i-th number of a list."""
    return np.int64(listed[i]) if listed.size else np.int64(i)
