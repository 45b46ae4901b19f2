"""Scalar functions of a rotation angle x that the exponential map needs, accurate at every angle.

    A = sin(x)/x            exp([phi]) = I + A [phi] + B [phi]^2
    B = (1 - cos x)/x^2     V(phi)     = I + B [phi] + C [phi]^2      (left Jacobian of SO(3))
    C = (x - sin x)/x^3     V(phi)^-1  = I - [phi]/2 + D [phi]^2
    D = (1 - A/(2 B))/x^2

A and B have no cancellation when written with the half angle, B = (sin(x/2)/(x/2))^2 / 2. The closed forms of
C, D and of dB lose digits near 0: below z = x^2 = 1 their Taylor polynomials are used (truncation < 1e-17).
The polynomials take floats and arrays, in Python and inside Numba kernels.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from bodyplan.arrays import Array

#: the Taylor polynomials hold for z = angle^2 below this
SERIES_BELOW = 1.0


@register_jitable  # type: ignore[no-untyped-decorator]
def c_series(z):  # type: ignore[no-untyped-def]
    """C = (x - sin x)/x^3 for z = x^2 < 1: sum of (-z)^k/(2k + 3)!."""
    return (1.0 / 6.0) * (
        1.0
        - z
        * (1.0 / 20.0)
        * (
            1.0
            - z
            * (1.0 / 42.0)
            * (
                1.0
                - z
                * (1.0 / 72.0)
                * (
                    1.0
                    - z
                    * (1.0 / 110.0)
                    * (1.0 - z * (1.0 / 156.0) * (1.0 - z * (1.0 / 210.0) * (1.0 - z * (1.0 / 272.0))))
                )
            )
        )
    )


@register_jitable  # type: ignore[no-untyped-decorator]
def b_slope_series(z):  # type: ignore[no-untyped-def]
    """dB/dx / x = (A - 2 B)/x^2 for z = x^2 < 1: sum of 2 (-1)^(k+1) (k+1) z^k/(2k + 4)!."""
    return (-1.0 / 12.0) * (
        1.0
        - z
        * (1.0 / 15.0)
        * (
            1.0
            - z
            * (3.0 / 112.0)
            * (
                1.0
                - z
                * (2.0 / 135.0)
                * (
                    1.0
                    - z
                    * (5.0 / 528.0)
                    * (1.0 - z * (3.0 / 455.0) * (1.0 - z * (7.0 / 1440.0) * (1.0 - z * (4.0 / 1071.0))))
                )
            )
        )
    )


def _d_series(z: Array) -> Array:
    """D for z < 1: sum of |B_2n|/(2n)! z^(n-1) with the Bernoulli numbers B_2n."""
    terms = (
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
    return np.polynomial.polynomial.polyval(z, np.array(terms))


def sinc(x: Array) -> Array:
    """sin(x)/x, 1 at 0; any shape."""
    safe = np.where(x == 0.0, 1.0, x)
    return np.where(x == 0.0, 1.0, np.sin(safe) / safe)


def coefficients(x: Array) -> tuple[Array, Array, Array]:
    """(A, B, C) at angles ``x`` (...,) rad."""
    a, b = sinc(x), 0.5 * sinc(0.5 * x) ** 2
    z = x * x
    small = z < SERIES_BELOW
    c = np.where(small, c_series(np.where(small, z, 0.0)), (1.0 - a) / np.where(small, 1.0, z))
    return a, b, c


def slopes(x: Array) -> tuple[Array, Array]:
    """(dA/dx / x, dB/dx / x) at angles ``x`` (...,) rad: C - B and (A - 2 B)/x^2."""
    a, b, c = coefficients(x)
    z = x * x
    small = z < SERIES_BELOW
    closed = (a - 2.0 * b) / np.where(small, 1.0, z)
    return c - b, np.where(small, b_slope_series(np.where(small, z, 0.0)), closed)


def inverse_coefficient(x: Array) -> Array:
    """D at angles ``x`` (...,) rad, |x| < 2 pi."""
    a, b, _ = coefficients(x)
    z = x * x
    small = z < SERIES_BELOW
    # A/(2B) = (x/2) cot(x/2), and near x = pi this form stays regular
    closed = (1.0 - 0.5 * a / b) / np.where(small, 1.0, z)
    return np.where(small, _d_series(np.where(small, z, 0.0)), closed)
