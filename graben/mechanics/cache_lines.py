"""Two helps against waiting for memory: rows that fill cache lines, and lines asked for before they are needed."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np import arrayobj

_LINE = 64


def aligned(rows: int, columns: int) -> np.ndarray:
    """Zeros (rows, columns) that begin at a cache line."""
    raw = np.zeros(rows * columns * 8 + _LINE, dtype=np.uint8)
    skip = -raw.ctypes.data % _LINE
    return raw[skip : skip + rows * columns * 8].view(np.float64).reshape(rows, columns)


@intrinsic
def ask_for(typing_context, array, row):
    """Ask the cache for the line where row `row` of an array (rows, ...) begins; no other effect."""

    def generate(context, builder, signature, arguments):
        kind = signature.args[0]
        parts = arrayobj.make_array(kind)(context, builder, arguments[0])
        index = context.cast(builder, arguments[1], signature.args[1], types.intp)
        zero = context.get_constant(types.intp, 0)
        place = cgutils.get_item_pointer(context, builder, kind, parts, [index] + [zero] * (kind.ndim - 1))
        place = builder.bitcast(place, cgutils.voidptr_t)
        i32 = ir.IntType(32)
        call = ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t, i32, i32, i32])
        name = "llvm.prefetch.p0" if "p0i8" not in str(cgutils.voidptr_t) else "llvm.prefetch.p0i8"
        prefetch = cgutils.get_or_insert_function(builder.module, call, name)
        builder.call(prefetch, [place, i32(0), i32(3), i32(1)])
        return context.get_dummy_value()

    return types.void(array, row), generate
