"""A formula's rules run on arrays and on intervals of arrays, node by node: what the kernels are held against."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.expressions import Expression
from bodyplan.expressions.jets import ArrayMath, Jet, pairs, run, seeds
from bodyplan.expressions.parse import Node

_INF = float("inf")


def jet_by_arrays(expression: Expression, points: list[Array]) -> tuple[Array, Array, Array, str]:
    """Value (m,), nan where the formula is undefined, gradient (m, n) and Hessian (m, n, n), and the first node that is
    not finite."""
    math, n = ArrayMath(), len(points)
    with np.errstate(all="ignore"):
        last = run(expression._tape, seeds(points, n), math)[-1]
    value, gradient, hessian = dense(last, points[0].shape, n, lambda number: number)
    if math.undefined is not None:
        value[np.broadcast_to(math.undefined, value.shape)] = np.nan
    return value, gradient, hessian, math.culprit


def bounds_by_arrays(expression: Expression, low: list[Array], high: list[Array]) -> tuple[Array, Array, Array]:
    """Bounds in front, as :meth:`bodyplan.expressions.Expression.enclosure`."""
    math, n, shape = IntervalMath(), len(low), low[0].shape
    with np.errstate(all="ignore"):
        variables = [Interval(a, b) for a, b in zip(low, high, strict=True)]
        last = run(expression._tape, seeds(variables, n), math)[-1]
        parts = []
        for end, outwards in (("lo", -1.0), ("hi", 1.0)):
            value, gradient, hessian = dense(last, shape, n, lambda number, end=end: getattr(interval(number), end))
            for part in (value, gradient, hessian):
                wider = part + outwards * (1e-12 * np.abs(part) + 1e-300)
                part[...] = np.where(np.isfinite(part), wider, outwards * np.inf)
            value[np.broadcast_to(math.empty, shape)] = -outwards * np.inf
            parts.append((value, gradient, hessian))
    value, gradient, hessian = (np.stack(pair) for pair in zip(*parts, strict=True))
    return value, gradient, hessian


def dense(jet: Jet, shape: tuple[int, ...], n: int, part: Callable[[Any], Any]) -> tuple[Array, Array, Array]:
    """The arrays of a jet; ``part`` maps a number of its kind to an array."""
    value, gradient, hessian = np.empty(shape), np.zeros((*shape, n)), np.zeros((*shape, n, n))
    value[...] = part(jet.value)
    for i, g in enumerate(jet.gradient):
        if g is not None:
            gradient[..., i] = part(g)
    for (i, j), h in zip(pairs(n), jet.hessian, strict=True):
        if h is not None:
            hessian[..., i, j] = hessian[..., j, i] = part(h)
    return value, gradient, hessian


class Interval:
    """Closed intervals [lo, hi], arrays of one shape; infinite ends where nothing is known."""

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None  # a NumPy number on the left leaves the operation to this class

    def __init__(self, lo: Any, hi: Any) -> None:
        # inf - inf and 0 * inf: nothing is known
        self.lo: Array = np.where(np.isnan(lo), -_INF, lo)
        self.hi: Array = np.where(np.isnan(hi), _INF, hi)

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Any) -> Interval:
        o = interval(other)
        return Interval(self.lo + o.lo, self.hi + o.hi)

    def __sub__(self, other: Any) -> Interval:
        o = interval(other)
        return Interval(self.lo - o.hi, self.hi - o.lo)

    def __rsub__(self, other: Any) -> Interval:
        return interval(other) - self

    def __mul__(self, other: Any) -> Interval:
        o = interval(other)
        corners = [self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi]
        return _hull(corners)

    def __truediv__(self, other: Any) -> Interval:
        o = interval(other)
        nonzero = (o.lo > 0.0) | (o.hi < 0.0)
        return self * Interval(np.where(nonzero, 1.0 / o.hi, -_INF), np.where(nonzero, 1.0 / o.lo, _INF))

    def __rtruediv__(self, other: Any) -> Interval:
        return interval(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


def interval(value: Any) -> Interval:
    """``value`` itself, or a number as an interval of no width."""
    return value if isinstance(value, Interval) else Interval(value, value)


def _hull(values: list[Any]) -> Interval:
    stack = np.stack(np.broadcast_arrays(*values))
    return Interval(stack.min(axis=0), stack.max(axis=0))  # a nan among the values spreads, as it must


def _rising(f: Callable[[Any], Any]) -> Callable[[IntervalMath, Interval], Interval]:
    return lambda self, v: Interval(f(v.lo), f(v.hi))


class IntervalMath:
    """Intervals as numbers. ``empty`` tells on which boxes the formula is defined nowhere."""

    def __init__(self) -> None:
        self.empty: BoolArray = np.zeros((), dtype=np.bool_)

    exp, sinh, tanh, arctan = _rising(np.exp), _rising(np.sinh), _rising(np.tanh), _rising(np.arctan)

    def sin(self, v: Interval) -> Interval:
        a, b = np.sin(v.lo), np.sin(v.hi)
        top, bottom = _between(v, np.pi / 2), _between(v, -np.pi / 2)
        return Interval(np.where(bottom, -1.0, np.minimum(a, b)), np.where(top, 1.0, np.maximum(a, b)))

    def cos(self, v: Interval) -> Interval:
        return self.sin(v + np.pi / 2)

    def tan(self, v: Interval) -> Interval:
        pole = _between(v, np.pi / 2, np.pi)
        return Interval(np.where(pole, -_INF, np.tan(v.lo)), np.where(pole, _INF, np.tan(v.hi)))

    def cosh(self, v: Interval) -> Interval:
        size = self.abs(v)
        return Interval(np.cosh(size.lo), np.cosh(size.hi))

    def arcsin(self, v: Interval) -> Interval:
        v = self._inside(v, -1.0, 1.0)
        return Interval(np.arcsin(v.lo), np.arcsin(v.hi))

    def arccos(self, v: Interval) -> Interval:
        v = self._inside(v, -1.0, 1.0)
        return Interval(np.arccos(v.hi), np.arccos(v.lo))

    def arctan2(self, y: Any, x: Any) -> Interval:
        y, x = interval(y), interval(x)
        corners = _hull([np.arctan2(b, a) for b in (y.lo, y.hi) for a in (x.lo, x.hi)])
        cut = _meets_cut(y, x)
        return Interval(np.where(cut, -np.pi, corners.lo), np.where(cut, np.pi, corners.hi))

    def log(self, v: Interval) -> Interval:
        v = self._inside(v, 0.0, _INF)
        self.empty = self.empty | (v.hi <= 0.0)
        return Interval(np.log(v.lo), np.log(v.hi))

    def sqrt(self, v: Interval) -> Interval:
        v = self._inside(v, 0.0, _INF)
        return Interval(np.sqrt(v.lo), np.sqrt(v.hi))

    def abs(self, v: Interval) -> Interval:
        low, high = np.minimum(np.abs(v.lo), np.abs(v.hi)), np.maximum(np.abs(v.lo), np.abs(v.hi))
        return Interval(np.where((v.lo <= 0.0) & (v.hi >= 0.0), 0.0, low), high)

    def square(self, v: Interval) -> Interval:
        size = self.abs(interval(v))
        return Interval(size.lo * size.lo, size.hi * size.hi)

    def power(self, v: Interval, p: float) -> Any:
        """v ** p for a constant p."""
        if p == 0.0:
            return 1.0
        if p < 0.0:
            return 1.0 / self.power(v, -p)
        if p == 1.0:
            return v
        if not float(p).is_integer():
            v = self._inside(v, 0.0, _INF)
        elif p % 2.0 == 0.0:
            v = self.abs(v)
        return Interval(np.power(v.lo, p), np.power(v.hi, p))

    def step(self, v: Interval) -> Interval:
        return Interval(np.where(v.lo >= 0.0, 1.0, -1.0), np.where(v.hi < 0.0, -1.0, 1.0))

    def bend(self, v: Interval) -> Interval:
        kink = (v.lo <= 0.0) & (v.hi >= 0.0)
        return Interval(np.where(kink, -_INF, 0.0), np.where(kink, _INF, 0.0))

    def order(self, a: Any, b: Any) -> Any:
        a, b = interval(a), interval(b)
        return a.lo > b.hi, a.hi < b.lo

    def pick(self, order: Any, a: Any, b: Any, smooth: bool) -> Interval:
        a, b = interval(a), interval(b)
        first, second = order
        low, high = (np.minimum(a.lo, b.lo), np.maximum(a.hi, b.hi)) if smooth else (-_INF, _INF)
        return Interval(
            np.where(first, a.lo, np.where(second, b.lo, low)),
            np.where(first, a.hi, np.where(second, b.hi, high)),
        )

    def cut(self, y: Any, x: Any, h: Any) -> Interval:
        y, x, h = interval(y), interval(x), interval(h)
        cut = _meets_cut(y, x)
        return Interval(np.where(cut, -_INF, h.lo), np.where(cut, _INF, h.hi))

    def watch(self, node: Node, value: Any) -> Any:
        return value

    def _inside(self, v: Interval, low: float, high: float) -> Interval:
        """The part of ``v`` on which a function is defined."""
        self.empty = self.empty | (v.hi < low) | (v.lo > high)
        return Interval(np.clip(v.lo, low, high), np.clip(v.hi, low, high))


def _between(v: Interval, point: float, period: float = 2.0 * np.pi) -> BoolArray:
    """Whether point + k period lies in v for a whole k (also where v is infinite)."""
    turns = np.floor((v.hi - point) / period) - np.ceil((v.lo - point) / period)
    return np.asarray(~(turns < 0.0))


def _meets_cut(y: Interval, x: Interval) -> BoolArray:
    """Whether atan2 jumps (or is undefined) in the box: it contains a point with y = 0 and x <= 0."""
    return np.asarray((y.lo <= 0.0) & (y.hi >= 0.0) & (x.lo <= 0.0))
