"""Two machine instructions on integers that Numba has no names for."""

import numba
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _lowest_bit(number):
    """Index of the lowest bit that is set in an integer that is not zero."""
    return (int(number) & -int(number)).bit_length() - 1


def _n_bits(number):
    """How many bits are set in an integer that is not negative."""
    return int(number).bit_count()


@intrinsic
def _lowest_bit_instruction(_context, number):
    def generate(_context, builder, _signature, arguments):
        return builder.cttz(arguments[0], cgutils.true_bit)

    return types.int64(types.int64), generate


@intrinsic
def _n_bits_instruction(_context, number):
    def generate(_context, builder, _signature, arguments):
        return builder.ctpop(arguments[0])

    return types.int64(types.int64), generate


if numba.config.DISABLE_JIT:
    lowest_bit, n_bits = _lowest_bit, _n_bits
else:
    lowest_bit, n_bits = _lowest_bit_instruction, _n_bits_instruction
