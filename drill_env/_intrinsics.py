"""What kernels do that Python has no words for: memory at an address, one rounding, bits."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import from_dtype, types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj


@intrinsic
def _address_of(context: Any, array: Any) -> Any:

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        data = arrayobj.make_array(kind.args[0])(context, builder, values[0]).data
        return builder.ptrtoint(data, cgutils.intp_t)

    return types.int64(array), generate


address_of: Any = _address_of
"""For kernels: `address_of(array)`, where the first element of an array lies."""


def placed(kind: Any) -> Any:
    """For kernels: `at(address, i)`, the record or number of a type that is i places on.

    Args:
        kind: of NumPy; a record is the memory itself, a number is read.
    """
    made, size = from_dtype(np.dtype(kind)), np.dtype(kind).itemsize

    @intrinsic
    def at(context: Any, address: Any, i: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
            place = builder.add(
                values[0], builder.mul(values[1], ir.Constant(cgutils.intp_t, size))
            )
            if isinstance(made, types.Record):
                return builder.inttoptr(place, context.get_value_type(made))
            return builder.load(builder.inttoptr(place, context.get_data_type(made).as_pointer()))

        return made(types.int64, types.int64), generate

    return at


number_at, whole_at = placed("f8"), placed("i8")


@intrinsic
def _fma(context: Any, a: Any, b: Any, c: Any) -> Any:
    if any(isinstance(kind, types.Complex) for kind in (a, b, c)):
        # A complex step asks for the slope, which each part rounded by itself has.
        def compose(context: Any, builder: Any, kind: Any, values: Any) -> Any:
            return context.compile_internal(builder, lambda a, b, c: a * b + c, kind, values)

        return types.complex128(a, b, c), compose

    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        return builder.fma(*values)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def _bits_of(context: Any, number: Any) -> Any:
    def generate(context: Any, builder: Any, kind: Any, values: Any) -> Any:
        return builder.bitcast(values[0], cgutils.intp_t)

    return types.int64(types.float64), generate


fma: Any = _fma
"""For kernels: `fma(a, b, c)`, a b + c rounded once, whatever it is compiled with.

Of complex numbers it is rounded as their product and sum are.
"""

bits_of: Any = _bits_of
"""For kernels: the bits of a number as an integer."""


def _storing(kind: Any) -> Any:
    @intrinsic
    def store(context: Any, address: Any, i: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
            place = builder.inttoptr(values[0], context.get_data_type(kind).as_pointer())
            builder.store(values[2], builder.gep(place, [values[1]]))
            return context.get_dummy_value()

        return types.none(types.int64, types.int64, kind), generate

    return store


store_number, store_whole = _storing(types.float64), _storing(types.int64)
