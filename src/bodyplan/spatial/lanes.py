"""Blocks of lanes: what kernels need to run the same scalar code on LANES configurations at a time.

A kernel keeps every quantity as a row of LANES numbers and loops over the lane innermost, with the number of
lanes known when it is compiled: LLVM turns such a loop into vector instructions. That holds only if the loop
calls nothing, so sine and cosine are polynomials here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic, overload, register_jitable

from bodyplan.arrays import Array

LANES = 16
#: |x| up to which :func:`sincos` holds; beyond, use math.sin and math.cos
SINCOS_LIMIT = 1e8

#: for the small functions inside kernels: no call, no cache file of their own
inlined = njit(nogil=True, forceinline=True)


def lane_count(wide: Any) -> int:
    """Lanes of a block, known at compile time: LANES where ``wide`` is an integer, 1 where it is a bool."""
    raise NotImplementedError("for use inside kernels")


@overload(lane_count, strict=False, jit_options={"forceinline": True})
def _lane_count(wide: Any) -> Any:
    if isinstance(wide, (types.Boolean, types.BooleanLiteral)):
        return lambda wide: 1
    return lambda wide: LANES


@intrinsic
def fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c with one rounding. A hardware instruction on every CPU of the last ten years; asking for it by name
    gives the same digits everywhere, which a compiler's licence to contract would not."""

    def build(context: Any, builder: ir.IRBuilder, signature: Any, args: Any) -> Any:
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), build


# pi/2 in two parts (Cody and Waite), and 1.5 2^52: adding it rounds to an integer in the lowest bits
_HALF_PI_HIGH, _HALF_PI_LOW = 1.57079632679489655800e00, 6.12323399573676603587e-17
_TWO_OVER_PI = 2.0 / math.pi
_ROUND = 6755399441055744.0


@inlined
def sincos(x: float) -> tuple[float, float]:
    """(sin x, cos x) for |x| <= SINCOS_LIMIT with an error below 1 ulp of 1, without a branch or a call.

    x = k pi/2 + y with |y| <= pi/4; minimax polynomials of degree 13 and 14 (the coefficients of fdlibm,
    Sun Microsystems 1993); the quadrant k mod 4 swaps and signs them.
    """
    t = fma(x, _TWO_OVER_PI, _ROUND)
    k = t - _ROUND
    y = fma(-k, _HALF_PI_LOW, fma(-k, _HALF_PI_HIGH, x))
    z = y * y
    p = fma(z, fma(z, 1.58969099521155010221e-10, -2.50507602534068634195e-08), 2.75573137070700676789e-06)
    p = fma(z, fma(z, fma(z, p, -1.98412698298579493134e-04), 8.33333333332248946124e-03), -1.66666666666666324348e-01)
    s = fma(y * z, p, y)
    p = fma(z, fma(z, -1.13596475577881948265e-11, 2.08757232129817482790e-09), -2.75573143513906633035e-07)
    p = fma(z, fma(z, fma(z, p, 2.48015872894767294178e-05), -1.38888888888741095749e-03), 4.16666666666666019037e-02)
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
def sines(D: Array, row: int, value: int, sine: int, cosine: int, factor: float, wide: Any) -> None:
    """Sine and cosine of ``factor`` times the lanes of row ``row`` of D (rows, columns) that start at column
    ``value``, into those that start at columns ``sine`` and ``cosine``."""
    huge = False
    for i in range(lane_count(wide)):
        huge |= abs(D[row, value + i]) > SINCOS_LIMIT
    if huge:
        for i in range(lane_count(wide)):
            x = factor * D[row, value + i]
            D[row, sine + i], D[row, cosine + i] = math.sin(x), math.cos(x)
    else:
        for i in range(lane_count(wide)):
            D[row, sine + i], D[row, cosine + i] = sincos(factor * D[row, value + i])


@register_jitable
def matrix(flat: Array, start: int, rows: int, columns: int) -> Array:
    """The table (rows, columns) that begins at ``start`` of a flat array: a view."""
    return flat[start : start + rows * columns].reshape(rows, columns)
