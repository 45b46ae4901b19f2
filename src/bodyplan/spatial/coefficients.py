"""Scalar functions of a rotation angle x that the exponential map needs, accurate at every angle.

    A = sin(x)/x            exp([phi]) = I + A [phi] + B [phi]^2
    B = (1 - cos x)/x^2     V(phi)     = I + B [phi] + C [phi]^2      (left Jacobian of SO(3))
    C = (x - sin x)/x^3     V(phi)^-1  = I - [phi]/2 + D [phi]^2
    D = (1 - A/(2 B))/x^2

A and B have no cancellation when written with the half angle, B = (sin(x/2)/(x/2))^2 / 2. The closed forms of
C and D lose digits near 0: below z = x^2 = 1 their Taylor polynomials take over, to 1e-17.
What takes a ``Number`` works on floats and arrays in Python and on floats inside Numba kernels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numba.extending import register_jitable

from bodyplan.arrays import Array

Number = TypeVar("Number", float, Array)

#: the Taylor polynomials hold for z = x^2 below this
SERIES_BELOW = 1.0

_jitable = register_jitable(forceinline=True, error_model="numpy")


@_jitable
def c_series(z: Number) -> Number:
    """C for z = x^2 < 1: the sum of (-z)^k/(2k + 3)!, k = 0, 1, ..."""
    p = 1.0 - z * (1.0 / 210.0) * (1.0 - z * (1.0 / 272.0))
    p = 1.0 - z * (1.0 / 72.0) * (1.0 - z * (1.0 / 110.0) * (1.0 - z * (1.0 / 156.0) * p))
    return (1.0 / 6.0) * (1.0 - z * (1.0 / 20.0) * (1.0 - z * (1.0 / 42.0) * p))


@_jitable
def c_coefficient(z: float, a: float) -> float:
    """C at x = sqrt(z), given A."""
    return c_series(z) if z < SERIES_BELOW else (1.0 - a) / z


def sinc(x: Array) -> Array:
    """sin(x)/x, 1 at 0; any shape."""
    safe = np.where(x == 0.0, 1.0, x)
    return np.where(x == 0.0, 1.0, np.sin(safe) / safe)


def coefficients(x: Array) -> tuple[Array, Array, Array]:
    """(A, B, C) at angles ``x`` (...,) rad."""
    a, b = sinc(x), 0.5 * sinc(0.5 * x) ** 2
    return a, b, _select(x * x, c_series, 1.0 - a)


def inverse_coefficient(x: Array) -> Array:
    """D at angles ``x`` (...,) rad, |x| < 2 pi."""
    a, b, _ = coefficients(x)
    return _select(x * x, _d_series, 1.0 - 0.5 * a / b)


def _select(z: Array, series: Callable[[Array], Array], numerator: Array) -> Array:
    """``series(z)`` below z = 1, ``numerator / z`` above."""
    small = z < SERIES_BELOW
    return np.where(small, series(np.where(small, z, 0.0)), numerator / np.where(small, 1.0, z))


def _d_series(z: Array) -> Array:
    """D for z < 1: the sum of |B_2n|/(2n)! z^(n-1) with the Bernoulli numbers B_2n."""
    return np.asarray(np.polynomial.polynomial.polyval(z, np.array(_D_TERMS)))


_D_TERMS = (
    1 / 12,
    1 / 720,
    1 / 30240,
    1 / 1209600,
    1 / 47900160,
    691 / 1307674368000,
    1 / 74724249600,
    3617 / 10670622842880000,
    43867 / 5109094217170944000,
    174611 / 802857662698291200000,
)
