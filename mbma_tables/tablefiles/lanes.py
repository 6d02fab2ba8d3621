"""Eight doubles at a time: numba intrinsics for sums over neighbouring coefficients.

numba leaves LLVM's vectoriser of straight-line code off, so that a sum over eight neighbours runs one by one. These
two intrinsics say it outright; eight lanes are four coefficients of two functions each.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core.imputils import impl_ret_untracked
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

LANES = 8
_TUPLE = types.UniTuple(types.float64, LANES)
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


def _to_vector(builder: Any, lanes: Any) -> Any:
    vector = ir.Constant(_VECTOR, ir.Undefined)
    for n in range(LANES):
        vector = builder.insert_element(vector, builder.extract_value(lanes, n), _INDEX(n))
    return vector


def _to_tuple(context: Any, builder: Any, vector: Any) -> Any:
    lanes = ir.Constant(context.get_value_type(_TUPLE), ir.Undefined)
    for n in range(LANES):
        lanes = builder.insert_value(lanes, builder.extract_element(vector, _INDEX(n)), n)
    return impl_ret_untracked(context, builder, _TUPLE, lanes)


def _load_lanes(typing_context: Any, array: Any, offset: Any) -> Any:
    """Eight neighbours of a flat, contiguous array of doubles, from `offset` on."""
    del typing_context

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(signature.args[0])(context, builder, arguments[0]).data
        start = builder.gep(data, [arguments[1]], inbounds=True)
        vector = builder.load(builder.bitcast(start, _VECTOR.as_pointer()))
        # doubles, not vectors, are what numpy aligns
        vector.align = 8
        return _to_tuple(context, builder, vector)

    return _TUPLE(array, offset), generate


def _add_lanes(typing_context: Any, total: Any, weight: Any, lanes: Any) -> Any:
    """``total + weight * lanes``, lane by lane."""
    del typing_context

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        del signature
        spread = ir.Constant(_VECTOR, ir.Undefined)
        for n in range(LANES):
            spread = builder.insert_element(spread, arguments[1], _INDEX(n))
        product = builder.fmul(spread, _to_vector(builder, arguments[2]), flags=("contract",))
        vector = builder.fadd(_to_vector(builder, arguments[0]), product, flags=("contract",))
        return _to_tuple(context, builder, vector)

    return _TUPLE(total, weight, lanes), generate


# compiled code calls these with fewer arguments than they are defined with
load_lanes: Any = intrinsic(_load_lanes)
add_lanes: Any = intrinsic(_add_lanes)
