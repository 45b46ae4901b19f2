"""Blocks of lanes: what kernels need to run the same scalar code on LANES configurations at a time.

A kernel keeps every quantity as a row of LANES numbers and loops over the lane innermost, with the number of
lanes known when it is compiled: LLVM turns such a loop into vector instructions. That holds only if the loop
calls nothing, so sine and cosine are polynomials here.
"""

# ruff: noqa: E741 - l is the lane, everywhere
from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import njit, types
from numba.core.errors import NumbaTypeError
from numba.extending import intrinsic, overload
from numba.np import arrayobj

from bodyplan.arrays import Array

LANES = 16
#: |x| up to which :func:`sincos` holds; beyond, use math.sin and math.cos
SINCOS_LIMIT = 2.0**26

#: for the small functions inside kernels: no call, no cache file of their own
inlined = njit(nogil=True, forceinline=True, error_model="numpy")


def lane_count(wide: int) -> int:
    """Lanes of a block, known at compile time: LANES where ``wide`` is an integer, 1 where it is a bool."""
    raise NotImplementedError("for use inside kernels")


@overload(lane_count, strict=False, jit_options={"forceinline": True})
def _lane_count(wide: Any) -> Any:
    if isinstance(wide, (types.Boolean, types.BooleanLiteral)):
        return lambda wide: 1
    return lambda wide: LANES


@intrinsic
def _fma(typing: Any, a: Any, b: Any, c: Any) -> Any:

    def build(context: Any, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), build


#: fma(a, b, c) = a b + c with one rounding. A hardware instruction on every CPU of the last ten years; asking
#: for it by name gives the same digits everywhere, which a compiler's licence to contract would not.
fma = cast(Callable[[float, float, float], float], _fma)


# pi/2 in two parts (Cody and Waite), and 1.5 2^52: adding it rounds to an integer in the lowest bits
_HALF_PI_HIGH, _HALF_PI_LOW = 1.57079632679489655800e00, 6.12323399573676603587e-17
_TWO_OVER_PI = 2.0 / math.pi
_ROUND = 6755399441055744.0


@inlined
def sincos(x: float) -> tuple[float, float]:
    """(sin x, cos x) for |x| <= SINCOS_LIMIT without a branch or a call, within 1.5 units in the last place (of
    1e-9 where the value is smaller).

    x = k pi/2 + y with |y| <= pi/4; minimax polynomials of degree 13 and 14 (the coefficients of fdlibm,
    Sun Microsystems 1993); the quadrant k mod 4 swaps and signs them.
    """
    t = fma(x, _TWO_OVER_PI, _ROUND)
    k = t - _ROUND
    y = fma(-k, _HALF_PI_LOW, fma(-k, _HALF_PI_HIGH, x))
    z = y * y
    p = fma(z, fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08), 2.75573137070700676789e-06)
    p = fma(
        z,
        fma(z, fma(z, p, -1.98412698298579493134e-04), 8.33333333332248946124e-03),
        -1.66666666666666324348e-01,
    )
    s = fma(y * z, p, y)
    p = fma(z, fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09), -2.75573143513906633035e-07)
    p = fma(
        z,
        fma(z, fma(z, p, 2.48015872894767294178e-05), -1.38888888888741095749e-03),
        4.16666666666666019037e-02,
    )
    c = fma(z * z, p, fma(z, -0.5, 1.0))
    quadrant = np.float64(t).view(np.int64)
    odd = (quadrant & 1) != 0
    a = c if odd else s
    b = s if odd else c
    # the sign bit: sine is negative in quadrants 2, 3 and cosine in 1, 2
    a_bits = np.float64(a).view(np.int64) ^ ((quadrant & 2) << 62)
    b_bits = np.float64(b).view(np.int64) ^ (((quadrant + 1) & 2) << 62)
    return np.int64(a_bits).view(np.float64), np.int64(b_bits).view(np.float64)


@inlined
def sines(D: Array, row: int, value: int, sine: int, cosine: int, factor: float, wide: int) -> None:
    """Sine and cosine of ``factor`` times the lanes of row ``row`` of D (rows, columns) that start at column
    ``value``, into those that start at columns ``sine`` and ``cosine``."""
    total = 0.0
    for i in range(lane_count(wide)):
        total += abs(D[row, value + i])
    if not total < SINCOS_LIMIT:
        for i in range(lane_count(wide)):
            x = factor * D[row, value + i]
            D[row, sine + i], D[row, cosine + i] = math.sin(x), math.cos(x)
    else:
        for i in range(lane_count(wide)):
            D[row, sine + i], D[row, cosine + i] = sincos(factor * D[row, value + i])


def _borrowed(array: Any, dimensions: int) -> tuple[Any, Any]:
    """Type of a view into the contiguous ``array``, and the code that makes it from a start and a shape."""
    if not isinstance(array, types.Array) or array.layout != "C":
        raise NumbaTypeError("needs a C-contiguous array")
    result = types.Array(array.dtype, dimensions, "C", readonly=not array.mutable)

    def build(context: Any, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:
        source = context.make_array(array)(context, builder, value=args[0])
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(array.dtype)))
        out = context.make_array(result)(context, builder)
        shape = list(args[2:])
        strides = [builder.mul(shape[-1], size), size][-dimensions:]
        data = builder.gep(source.data, [args[1]])
        fill: Any = arrayobj.populate_array
        fill(out, data, shape, strides, size, meminfo=None, parent=None)
        return out._getvalue()

    return result, build


@intrinsic
def _table(typing: Any, flat: Any, start: Any, rows: Any, columns: Any) -> Any:
    result, build = _borrowed(flat, 2)
    return result(flat, types.intp, types.intp, types.intp), build


@intrinsic
def _strip(typing: Any, flat: Any, start: Any, size: Any) -> Any:
    result, build = _borrowed(flat, 1)
    return result(flat, types.intp, types.intp), build


#: table(flat, start, rows, columns): the table that begins at entry ``start`` of a contiguous array of any
#: shape. Not counted as a reference, because counting costs more than a row of lanes: ``flat`` must stay in
#: use, by a later statement, for as long as the table is.
table = cast(Callable[[Array, int, int, int], Array], _table)
#: strip(flat, start, size): the same for a part of it in one row.
strip = cast(Callable[[Array, int, int], Array], _strip)


@intrinsic
def _transpose4(typing: Any, source: Any, i: Any, step: Any, target: Any, j: Any, stride: Any) -> Any:
    def build(context: Any, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:
        start = [context.make_array(t)(context, builder, value=args[k]).data for k, t in ((0, source), (3, target))]
        vector, index = ir.VectorType(ir.DoubleType(), 4), ir.IntType(64)

        def at(k: int, n: int) -> Any:
            offset = builder.add(args[3 * k + 1], builder.mul(args[3 * k + 2], index(n)))
            return builder.bitcast(builder.gep(start[k], [offset]), vector.as_pointer())

        def mixed(a: Any, b: Any, lanes: list[int]) -> Any:
            return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), 4), lanes))

        rows = [builder.load(at(0, n), align=8) for n in range(4)]
        even, odd, low, high = [0, 4, 2, 6], [1, 5, 3, 7], [0, 1, 4, 5], [2, 3, 6, 7]
        pairs = [mixed(rows[k], rows[k + 1], lanes) for k in (0, 2) for lanes in (even, odd)]
        for n, (a, lanes) in enumerate(((0, low), (1, low), (0, high), (1, high))):
            builder.store(mixed(pairs[a], pairs[a + 2], lanes), at(1, n), align=8)
        return context.get_dummy_value()

    return types.void(source, types.intp, types.intp, target, types.intp, types.intp), build


# transpose4(source, i, step, target, j, stride): target[j + b stride + a] = source[i + a step + b], a, b < 4,
# through vector registers
transpose4 = cast(Callable[[Array, int, int, Array, int, int], None], _transpose4)


@inlined
def unload(rows: Array, first: int, count: int, lanes: int, out: Array, start: int, stride: int, wide: int) -> None:
    """Give each lane its own numbers: out[start + lane stride + k] = rows[first + k L + lane], k < ``count``.

    Both arrays are flat. A full block goes through registers four by four.
    """
    L = lane_count(wide)
    fours = count - count % 4 if lanes == L and L > 1 else 0
    for k in range(0, fours, 4):
        for l in range(0, L, 4):
            transpose4(rows, first + k * L + l, L, out, start + l * stride + k, stride)
    for l in range(lanes):
        for k in range(fours, count):
            out[start + l * stride + k] = rows[first + k * L + l]


@inlined
def load(flat: Array, start: int, stride: int, count: int, lanes: int, rows: Array, wide: int) -> None:
    """The inverse of :func:`unload`: rows[k, lane] = flat[start + lane stride + k]; the last of ``lanes`` is
    repeated to fill the block."""
    L = lane_count(wide)
    fours = count - count % 4 if lanes == L and L > 1 else 0
    for l in range(0, L, 4):
        for k in range(0, fours, 4):
            transpose4(flat, start + l * stride + k, stride, rows, k * L + l, L)
    for l in range(L):
        for k in range(fours, count):
            rows[k, l] = flat[start + min(l, lanes - 1) * stride + k]
