"""Hints to the processor."""

import numba
import numpy as np

from tetsimplify.kernels.prefetch import prefetch_row


@numba.njit
def ask_for(array, row):
    prefetch_row(array, row)
    return array[0]


def test_any_row_may_be_asked_for():
    """Also where there is none: nothing is read."""
    rows = np.arange(6.0).reshape(2, 3)
    for row in (0, 1, 2, -1, 2**40):
        assert np.array_equal(ask_for(rows, row), [0.0, 1.0, 2.0])
        assert ask_for(rows[:, 1].copy(), row) == 1.0


def test_it_becomes_an_instruction():
    ask_for(np.zeros((2, 3)), 1)
    (code,) = (ask_for.inspect_llvm(signature) for signature in ask_for.signatures[:1])
    assert "llvm.prefetch" in code
