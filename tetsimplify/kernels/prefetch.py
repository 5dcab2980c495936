"""Hints to the processor, of what will be read soon."""

import numba
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

ir = cgutils.ir  # of llvmlite, as Numba itself uses it


@intrinsic
def prefetch_row(typing_context, array, row):
    """Start to fetch the beginning of a row of an array, or an element of it.

    Nothing is read: the row may be anywhere.
    """

    def generate(context, builder, signature, arguments):
        array_type, row_type = signature.args
        parts = arrayobj.make_array(array_type)(context, builder, arguments[0])
        stride = cgutils.unpack_tuple(builder, parts.strides)[0]
        offset = builder.mul(context.cast(builder, arguments[1], row_type, types.intp), stride)
        address = builder.add(builder.ptrtoint(parts.data, offset.type), offset)
        pointer, number = builder.inttoptr(address, cgutils.voidptr_t), cgutils.int32_t
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, number, number, number])
        prefetch = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        reading, near, data = number(0), number(3), number(1)
        builder.call(prefetch, [pointer, reading, near, data])
        return context.get_dummy_value()

    return types.void(array, row), generate


if numba.config.DISABLE_JIT:

    def prefetch_row(array, row):
        """Do nothing."""
