"""Dual numbers: a value and its rate along a way through the variables, carried through every operation.

As the numbers of :mod:`bodyplan.expressions.jets` they give exact rates of a formula's value, gradient and Hessian, and
so its third derivatives along that way.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bodyplan.arrays import Array
from bodyplan.expressions.jets import DERIVATIVES, NUMPY_NAMES
from bodyplan.expressions.parse import Node

_OPERATIONS = {NUMPY_NAMES.get(op, op): op for op in DERIVATIVES}


class Dual:
    """``value`` and ``rate``, arrays (or floats) that broadcast."""

    __slots__ = ("rate", "value")
    __array_ufunc__ = None  # a NumPy number on the left leaves the operation to this class

    def __init__(self, value: Any, rate: Any) -> None:
        self.value, self.rate = value, rate

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.rate)

    def __add__(self, other: Any) -> Dual:
        o = _dual(other)
        return Dual(self.value + o.value, self.rate + o.rate)

    def __sub__(self, other: Any) -> Dual:
        o = _dual(other)
        return Dual(self.value - o.value, self.rate - o.rate)

    def __rsub__(self, other: Any) -> Dual:
        return _dual(other) - self

    def __mul__(self, other: Any) -> Dual:
        o = _dual(other)
        return Dual(self.value * o.value, self.value * o.rate + self.rate * o.value)

    def __truediv__(self, other: Any) -> Dual:
        o = _dual(other)
        ratio = self.value / o.value
        return Dual(ratio, (self.rate - ratio * o.rate) / o.value)

    def __rtruediv__(self, other: Any) -> Dual:
        return _dual(other) / self

    __radd__ = __add__
    __rmul__ = __mul__


def _dual(number: Any) -> Dual:
    return number if isinstance(number, Dual) else Dual(number, 0.0)


def rate_of(number: Any) -> Array | float:
    """The rate of a number of any kind; 0 of a plain one."""
    return number.rate if isinstance(number, Dual) else 0.0


class DualMath:
    """Dual numbers as the numbers of a jet. ``values`` is the math of their values and rates."""

    def __init__(self, values: Any) -> None:
        self.values = values

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        def function(v: Any) -> Any:
            d = _dual(v)
            f = getattr(self.values, name)(d.value)
            first, _ = DERIVATIVES[_OPERATIONS[name]](self.values, d.value, f)
            return Dual(f, first * d.rate)

        return function

    def square(self, v: Any) -> Any:
        return v * v

    def power(self, v: Any, p: float) -> Any:
        if p in (0.0, 1.0):
            return 1.0 if p == 0.0 else v
        d = _dual(v)
        return Dual(self.values.power(d.value, p), p * self.values.power(d.value, p - 1.0) * d.rate)

    def arctan2(self, y: Any, x: Any) -> Any:
        a, b = _dual(y), _dual(x)
        r2 = a.value * a.value + b.value * b.value
        return Dual(self.values.arctan2(a.value, b.value), (b.value * a.rate - a.value * b.rate) / r2)

    def step(self, v: Any) -> Any:
        return self.values.step(_dual(v).value)

    def bend(self, v: Any) -> Any:
        return None

    def order(self, a: Any, b: Any) -> Any:
        return self.values.order(_dual(a).value, _dual(b).value)

    def pick(self, order: Any, a: Any, b: Any, smooth: bool) -> Any:
        p, q = _dual(a), _dual(b)
        pick = self.values.pick
        return Dual(pick(order, p.value, q.value, smooth), pick(order, p.rate, q.rate, smooth))

    def cut(self, y: Any, x: Any, h: Any) -> Any:
        return h

    def watch(self, node: Node, value: Any) -> Any:
        self.values.watch(node, _dual(value).value)
        return value
