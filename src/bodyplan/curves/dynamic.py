"""The dynamic curve of paper *concertina*, eq. (1), in a form that is regular up to gamma = 1.

``F(x; gamma, omega) = exp(-gamma X) (cos(delta X) + gamma X sinc(delta X))`` with ``X = omega x`` and
``delta = sqrt(1 - gamma^2)``. It is the free response of a damped oscillator from F = 1, F' = 0:
``F'' + 2 gamma omega F' + omega^2 F = 0``, so it equals the printed ``exp(-alpha x)/beta sin(delta x + theta)``
wherever that one is defined.
"""

from __future__ import annotations

from math import acos, cos, exp, factorial, pi, sin, sqrt

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError

#: gamma above which F(pi/omega) is positive: a module then ends on the side it started on
GAMMA_STAR = 0.676454475554999


#: coefficients of s(w) = sum (-w)^k/(2k+1)! and of its first two derivatives
_SERIES = tuple((-1.0) ** k / factorial(2 * k + 1) for k in range(14))
_FIRST = tuple(k * c for k, c in enumerate(_SERIES))[1:]
_SECOND = tuple(k * c for k, c in enumerate(_FIRST))[1:]


@njit(cache=True)
def _circular(w: float) -> tuple[float, float, float, float]:
    """c = cos(sqrt(w)), s = sin(sqrt(w))/sqrt(w) and the first two derivatives of s with respect to w >= 0."""
    root = sqrt(w)
    c = cos(root)
    if w < 1.0:
        # (c - s)/(2w) loses digits as w -> 0; the series does not
        s = s1 = s2 = 0.0
        for k in range(11, -1, -1):
            s = s * w + _SERIES[k]
            s1 = s1 * w + _FIRST[k]
            s2 = s2 * w + _SECOND[k]
        return c, s, s1, s2
    s = sin(root) / root
    s1 = (c - s) / (2.0 * w)
    s2 = (-0.5 * s - 3.0 * s1) / (2.0 * w)
    return c, s, s1, s2


@njit(cache=True)
def dynamic_jet(x: float, g: float, omega: float) -> tuple[float, float, float, float, float, float]:
    """F, F_x, F_xx, F_g, F_xg, F_gg of the dynamic curve at one x (kernel)."""
    X = omega * x
    X2 = X * X
    w = (1.0 - g * g) * X2
    wg = -2.0 * g * X2
    c, s, s1, s2 = _circular(w)
    e = exp(-g * X)
    inner = c + g * X * s
    F = e * inner
    Fx = -omega * X * s * e
    Fxx = -2.0 * g * omega * Fx - omega * omega * F
    # dc/dw = -s/2
    inner_g = -0.5 * s * wg + X * s + g * X * s1 * wg
    inner_gg = -0.5 * s1 * wg * wg + s * X2 + 2.0 * X * s1 * wg + g * X * (s2 * wg * wg - 2.0 * X2 * s1)
    Fg = e * (inner_g - X * inner)
    Fgg = e * (inner_gg - 2.0 * X * inner_g + X2 * inner)
    Fxg = -omega * X * e * (s1 * wg - X * s)
    return F, Fx, Fxx, Fg, Fxg, Fgg


@njit(cache=True)
def dynamic_value(x: float, g: float, omega: float) -> tuple[float, float, float]:
    """F, F_x, F_xx alone (kernel): what a search along the curve needs."""
    X = omega * x
    root = sqrt(1.0 - g * g) * X
    s = sin(root) / root if root > 1e-4 or root < -1e-4 else 1.0 - root * root / 6.0
    e = exp(-g * X)
    F = e * (cos(root) + g * X * s)
    Fx = -omega * X * s * e
    return F, Fx, -2.0 * g * omega * Fx - omega * omega * F


@njit(cache=True)
def crossing_of(g: float, omega: float, count: int) -> float:
    """x of the ``count``-th zero of F: (count pi - acos g)/(omega sqrt(1 - g^2)), eq. (6); inf at g = 1 (kernel)."""
    if g >= 1.0:
        return np.inf
    return (count * pi - acos(g)) / (omega * sqrt(1.0 - g * g))


@njit(cache=True)
def _evaluate(x: Array, g: Array, omega: float, value: Array, slope: Array) -> None:
    for i in range(x.size):
        value[i], slope[i], _ = dynamic_value(x[i], g[i], omega)


def _both(x: ArrayLike, gamma: ArrayLike, omega: float) -> tuple[Array, Array]:
    number(omega, "omega", above=0.0)
    xs, gs = np.broadcast_arrays(finite(x, "x"), finite(gamma, "gamma"))
    bad = (gs < 0.0) | (gs > 1.0)
    if bad.any():
        raise InputError(f"gamma: must lie in [0, 1], got {gs[bad].flat[0]}.")
    value, slope = np.empty(xs.size), np.empty(xs.size)
    _evaluate(np.ascontiguousarray(xs).ravel(), np.ascontiguousarray(gs).ravel(), float(omega), value, slope)
    return value.reshape(xs.shape), slope.reshape(xs.shape)


def dynamic_curve(x: ArrayLike, gamma: ArrayLike, omega: float = 1.0) -> Array:
    """F(x; gamma, omega) of paper *concertina*, eq. (1): 1 at x = 0, flatter as gamma grows from 0 to 1.

    ``x`` and ``gamma`` broadcast; gamma in [0, 1] (regular at 1), omega > 0. Same units as the curve (none).
    Raises InputError otherwise.
    """
    return _both(x, gamma, omega)[0]


def dynamic_slope(x: ArrayLike, gamma: ArrayLike, omega: float = 1.0) -> Array:
    """dF/dx = -omega^2 x sinc(delta x) exp(-gamma omega x), arguments as :func:`dynamic_curve`."""
    return _both(x, gamma, omega)[1]
