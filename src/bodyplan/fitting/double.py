"""From the bend of an arc to the angles of the double joint that stands for it (paper *acm*, eqs. (27)-(34)).

The middle link of the double joint points as the middle of the arc: ``u = (cos(x/2), sin(x/2) yaw/x, -sin(x/2)
pitch/x)`` with x = hypot(pitch, yaw). With sinc this is regular at 0; atan2 holds for bends beyond pi.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.spatial.coefficients import sinc


class Jet(NamedTuple):
    """Values (..., N) with their first and second derivatives with respect to one parameter, or None."""

    value: Any
    first: Any = None
    second: Any = None

    def at(self, columns: Any) -> Jet:
        """Some columns, copied."""
        return Jet(*(None if x is None else x[..., columns] for x in self))

    def put(self, columns: Any, other: Jet) -> None:
        """Overwrite some columns."""
        for mine, new in zip(self, other, strict=True):
            if mine is not None:
                mine[..., columns] = new


def double_angles(pitch: Jet, yaw: Jet, yaw_outer: BoolArray) -> tuple[Jet, Jet]:
    """(pitch, yaw) of double joints from those of the arcs, eqs. (33), (34); ``yaw_outer`` (N,): the order of axes is
    yaw, pitch, pitch, yaw as in the paper; else pitch, yaw, yaw, pitch, with the axes' parts exchanged."""
    outer = _where(yaw_outer, yaw, pitch)
    inner = _where(yaw_outer, pitch, yaw)
    inner, outer = _inner_outer(inner, outer)
    return _where(yaw_outer, inner, outer), _where(yaw_outer, outer, inner)


def _where(condition: BoolArray, a: Jet, b: Jet) -> Jet:
    return Jet(*(None if x is None else np.where(condition, x, y) for x, y in zip(a, b, strict=True)))


def _inner_outer(a: Jet, b: Jet) -> tuple[Jet, Jet]:
    """``2 asin(S a)`` and ``2 atan2(S b, C)`` with S = sin(x/2)/x, C = cos(x/2), x = hypot(a, b)."""
    z = 0.25 * (a.value**2 + b.value**2)
    x = np.sqrt(z)
    sine, cosine = 0.5 * sinc(x), np.cos(x)
    X, Y = sine * a.value, sine * b.value
    inner, outer = 2.0 * np.arctan2(X, np.hypot(Y, cosine)), 2.0 * np.arctan2(Y, cosine)
    if a.first is None or b.first is None:
        return Jet(inner), Jet(outer)
    slope, bend = _sinc_slopes(z, sine, cosine)
    z1 = 0.5 * (a.value * a.first + b.value * b.first)
    sine1, cosine1 = slope * z1, -sine * z1
    X1 = sine1 * a.value + sine * a.first
    Y1 = sine1 * b.value + sine * b.first
    # 1 - X^2 without cancellation
    rest = Y * Y + cosine * cosine
    root = np.sqrt(rest)
    turn = cosine * Y1 - Y * cosine1
    inner1, outer1 = 2.0 * X1 / root, 2.0 * turn / rest
    if a.second is None or b.second is None:
        return Jet(inner, inner1), Jet(outer, outer1)
    z2 = 0.5 * (a.first**2 + b.first**2 + a.value * a.second + b.value * b.second)
    sine2 = bend * z1 * z1 + slope * z2
    cosine2 = -slope * z1 * z1 - sine * z2
    X2 = sine2 * a.value + 2.0 * sine1 * a.first + sine * a.second
    Y2 = sine2 * b.value + 2.0 * sine1 * b.first + sine * b.second
    rest1 = 2.0 * (Y * Y1 + cosine * cosine1)
    inner2 = 2.0 * (X2 + X * X1 * X1 / rest) / root
    outer2 = 2.0 * (cosine * Y2 - Y * cosine2 - turn * rest1 / rest) / rest
    return Jet(inner, inner1, inner2), Jet(outer, outer1, outer2)


def _sinc_slopes(z: Array, sine: Array, cosine: Array) -> tuple[Array, Array]:
    """First and second derivative of ``S = sin(x)/(2 x)`` with respect to z = x^2."""
    small = z < 1.0
    safe = np.where(small, 1.0, z)
    first = 0.5 * (0.5 * cosine - sine) / safe
    second = -0.5 * (0.5 * sine + 3.0 * first) / safe
    near = np.where(small, z, 0.0)
    poly = np.polynomial.polynomial.polyval
    return np.where(small, poly(near, _FIRST), first), np.where(small, poly(near, _SECOND), second)


def _terms() -> tuple[Array, Array]:
    """S = sum of (-z)^k / (2 (2 k + 1)!), differentiated once and twice."""
    series = 0.5 * np.cumprod([1.0, *(-1.0 / ((2 * k) * (2 * k + 1)) for k in range(1, 14))])
    poly = np.polynomial.polynomial.polyder
    return poly(series), poly(series, 2)


_FIRST, _SECOND = _terms()
