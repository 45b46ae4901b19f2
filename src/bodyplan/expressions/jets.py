"""Second-order forward-mode differentiation: value, gradient and Hessian carried through every operation.

The rules are written once, for any kind of number: arrays give exact derivatives, intervals bounds of the derivatives
over a box, dual numbers (:mod:`bodyplan.expressions.duals`) their rates along a way. Symbols
(:mod:`bodyplan.expressions.compiled`) write the rules down as programs for a kernel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bodyplan.arrays import BoolArray
from bodyplan.expressions.parse import Node

#: a number of some kind: a float, an array or an Interval
Number = Any


@dataclass(frozen=True, slots=True)
class Jet:
    """Value, gradient (n entries) and Hessian (upper triangle, row by row); None stands for an exact zero.

    With no entries in ``gradient`` and ``hessian`` it is a plain value, and costs no more.
    """

    value: Number
    gradient: tuple[Number | None, ...] = ()
    hessian: tuple[Number | None, ...] = ()


class Math(Protocol):
    """What a kind of number must offer besides + - * / and the functions of the whitelist by name."""

    def square(self, v: Number) -> Number: ...

    def power(self, v: Number, p: float) -> Number: ...

    def arctan2(self, y: Number, x: Number) -> Number: ...

    def step(self, v: Number) -> Number:
        """Derivative of abs: 1 where v >= 0, else -1."""

    def bend(self, v: Number) -> Number:
        """Second derivative of abs."""

    def order(self, a: Number, b: Number) -> Any:
        """Whether a >= b, in the form that :meth:`pick` takes."""

    def pick(self, order: Any, a: Number, b: Number, smooth: bool) -> Number:
        """a where ``order`` says a >= b, else b; ``smooth`` is False for second derivatives."""

    def cut(self, y: Number, x: Number, h: Number) -> Number:
        """``h``, a second derivative of atan2(y, x), wherever the branch cut is not in the way."""

    def watch(self, node: Node, value: Number) -> Number:
        """Called with every result; returns it, perhaps marked."""


class ArrayMath:
    """Arrays (or floats) as numbers. Remembers where an operation had no finite result.

    At the kink of abs, min and max the derivatives are those of one side: abs counts as rising at 0,
    min and max take their first argument at a tie.
    """

    def __init__(self) -> None:
        self.undefined: BoolArray | None = None
        self.culprit = ""

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    def square(self, v: Number) -> Number:
        return v * v

    def power(self, v: Number, p: float) -> Number:
        return 1.0 if p == 0.0 else v if p == 1.0 else v * v if p == 2.0 else np.power(v, p)

    def step(self, v: Number) -> Number:
        return np.where(np.asarray(v) >= 0.0, 1.0, -1.0)

    def bend(self, v: Number) -> Number:
        return None

    def order(self, a: Number, b: Number) -> Any:
        return np.asarray(a) >= np.asarray(b)

    def pick(self, order: Any, a: Number, b: Number, smooth: bool) -> Number:
        return np.where(order, a, b)

    def cut(self, y: Number, x: Number, h: Number) -> Number:
        return h

    def watch(self, node: Node, value: Number) -> Number:
        bad = ~np.isfinite(value)
        if np.any(bad):
            self.culprit = self.culprit or node.source
            self.undefined = bad if self.undefined is None else self.undefined | bad
        return value


#: (math, v, f(v)) -> f'(v), f''(v)
DERIVATIVES: dict[str, Callable[[Any, Number, Number], tuple[Number, Number]]] = {
    "sin": lambda m, v, f: (m.cos(v), -f),
    "cos": lambda m, v, f: (-m.sin(v), -f),
    "tan": lambda m, v, f: (1.0 + m.square(f), 2.0 * f * (1.0 + m.square(f))),
    "asin": lambda m, v, f: (1.0 / m.sqrt(1.0 - m.square(v)), v / m.power(1.0 - m.square(v), 1.5)),
    "acos": lambda m, v, f: (-1.0 / m.sqrt(1.0 - m.square(v)), -v / m.power(1.0 - m.square(v), 1.5)),
    "atan": lambda m, v, f: (1.0 / (1.0 + m.square(v)), -2.0 * v / m.square(1.0 + m.square(v))),
    "sinh": lambda m, v, f: (m.cosh(v), f),
    "cosh": lambda m, v, f: (m.sinh(v), f),
    "tanh": lambda m, v, f: (1.0 - m.square(f), -2.0 * f * (1.0 - m.square(f))),
    "exp": lambda m, v, f: (f, f),
    "log": lambda m, v, f: (1.0 / v, -1.0 / m.square(v)),
    "sqrt": lambda m, v, f: (0.5 / f, -0.25 / (f * v)),
    "abs": lambda m, v, f: (m.step(v), m.bend(v)),
}
#: functions whose names in NumPy are others
NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}


def run(tape: Sequence[Node], variables: Sequence[Jet], math: Math) -> list[Jet]:
    """The jet of every node of the tape. ``variables`` are the jets of the variables, all of one length."""
    n = len(variables[0].gradient) if variables else 0
    jets: list[Jet] = []
    for node in tape:
        args = [jets[i] for i in node.args]
        if node.op == "number":
            # a number of NumPy's: its divisions by 0 are infinite, not errors
            jet = Jet(np.float64(node.number), (None,) * n, (None,) * (n * (n + 1) // 2))
        elif node.op == "variable":
            jet = variables[int(node.number)]
        else:
            jet = _apply(node, args, math)
            jet = Jet(math.watch(node, jet.value), jet.gradient, jet.hessian)
        jets.append(jet)
    return jets


def seeds(variables: Sequence[Number], n: int) -> list[Jet]:
    """The jets of the variables themselves: unit gradients in n variables (0: values only)."""
    curved = (None,) * (n * (n + 1) // 2)
    one = np.float64(1.0)
    return [Jet(v, tuple(one if i == j else None for j in range(n)), curved) for i, v in enumerate(variables)]


def _apply(node: Node, args: list[Jet], math: Any) -> Jet:
    a = args[0]
    match node.op:
        case "add":
            return _combine(a.value + args[1].value, a, args[1], _add)
        case "sub":
            return _combine(a.value - args[1].value, a, args[1], lambda p, q: _add(p, _neg(q)))
        case "neg":
            return Jet(-a.value, tuple(map(_neg, a.gradient)), tuple(map(_neg, a.hessian)))
        case "mul":
            return _product(a, args[1], math)
        case "div":
            return _quotient(a, args[1])
        case "power":
            f, p = math.power(a.value, node.number), node.number
            if not a.gradient:
                return Jet(f)
            return _chain(a, f, p * math.power(a.value, p - 1.0), p * (p - 1.0) * math.power(a.value, p - 2.0), math)
        case "min":
            return _select(math.order(args[1].value, a.value), a, args[1], math)
        case "max":
            return _select(math.order(a.value, args[1].value), a, args[1], math)
        case "atan2":
            return _angle(a, args[1], math)
    f = getattr(math, NUMPY_NAMES.get(node.op, node.op))(a.value)
    return _chain(a, f, *DERIVATIVES[node.op](math, a.value, f), math) if a.gradient else Jet(f)


def _chain(u: Jet, f: Number, f1: Number, f2: Number | None, math: Any) -> Jet:
    """f(u): gradient f' u_i, Hessian f' u_ij + f'' u_i u_j."""
    g = u.gradient
    second = [
        _add(_mul(f1, h), _mul(f2, _outer(g, g, i, j, math)))
        for (i, j), h in zip(pairs(len(g)), u.hessian, strict=True)
    ]
    return Jet(f, tuple(_mul(f1, gi) for gi in g), tuple(second))


def _product(a: Jet, b: Jet, math: Any) -> Jet:
    """(a b)_ij = a b_ij + b a_ij + a_i b_j + a_j b_i."""
    if a is b:
        return _chain(a, math.square(a.value), 2.0 * a.value, 2.0, math) if a.gradient else Jet(math.square(a.value))
    u, v, g, h = a.value, b.value, a.gradient, b.gradient
    first = tuple(_add(_mul(u, hi), _mul(v, gi)) for gi, hi in zip(g, h, strict=True))
    second = tuple(
        _add(_add(_mul(u, hb), _mul(v, ha)), _add(_mul(g[i], h[j]), _mul(g[j], h[i])))
        for (i, j), ha, hb in zip(pairs(len(g)), a.hessian, b.hessian, strict=True)
    )
    return Jet(u * v, first, second)


def _quotient(a: Jet, b: Jet) -> Jet:
    """q = a / b from a = q b: q_i = (a_i - q b_i) / b, q_ij = (a_ij - q b_ij - q_i b_j - q_j b_i) / b."""
    q, v, h = a.value / b.value, b.value, b.gradient
    g = tuple(_div(_add(ai, _neg(_mul(q, bi))), v) for ai, bi in zip(a.gradient, h, strict=True))
    second = tuple(
        _div(_add(_add(ha, _neg(_mul(q, hb))), _neg(_add(_mul(g[i], h[j]), _mul(g[j], h[i])))), v)
        for (i, j), ha, hb in zip(pairs(len(g)), a.hessian, b.hessian, strict=True)
    )
    return Jet(q, g, second)


def _angle(a: Jet, b: Jet, math: Any) -> Jet:
    """atan2(a, b) with r^2 = a^2 + b^2: f_a = b/r^2, f_b = -a/r^2,
    f_aa = -f_bb = -2ab/r^4, f_ab = (a^2 - b^2)/r^4."""
    f = math.arctan2(a.value, b.value)
    if not a.gradient:
        return Jet(f)
    y, x, g, h = a.value, b.value, a.gradient, b.gradient
    r2 = math.square(y) + math.square(x)
    fy, fx = x / r2, -y / r2
    fyy, fyx = 2.0 * fx * fy, (math.square(y) - math.square(x)) / math.square(r2)
    first = tuple(_add(_mul(fy, gi), _mul(fx, hi)) for gi, hi in zip(g, h, strict=True))
    second = []
    for (i, j), ha, hb in zip(pairs(len(g)), a.hessian, b.hessian, strict=True):
        pure = _add(_mul(g[i], g[j]), _neg(_mul(h[i], h[j])))
        mixed = _add(_mul(g[i], h[j]), _mul(g[j], h[i]))
        total = _add(_add(_mul(fy, ha), _mul(fx, hb)), _add(_mul(fyy, pure), _mul(fyx, mixed)))
        second.append(math.cut(y, x, 0.0 if total is None else total))
    return Jet(f, first, tuple(second))


def _select(order: Any, a: Jet, b: Jet, math: Any) -> Jet:
    """a where ``order`` holds, else b."""

    def both(p: Number | None, q: Number | None, smooth: bool) -> Number | None:
        if p is None and q is None and smooth:
            return None
        return math.pick(order, 0.0 if p is None else p, 0.0 if q is None else q, smooth)

    return Jet(
        math.pick(order, a.value, b.value, True),
        tuple(both(p, q, True) for p, q in zip(a.gradient, b.gradient, strict=True)),
        tuple(both(p, q, False) for p, q in zip(a.hessian, b.hessian, strict=True)),
    )


def _combine(value: Number, a: Jet, b: Jet, rule: Callable[[Any, Any], Any]) -> Jet:
    return Jet(value, tuple(map(rule, a.gradient, b.gradient)), tuple(map(rule, a.hessian, b.hessian)))


def pairs(n: int) -> list[tuple[int, int]]:
    """Index pairs of the upper triangle of an n by n matrix, row by row."""
    return [(i, j) for i in range(n) for j in range(i, n)]


def _outer(g: Sequence[Any], h: Sequence[Any], i: int, j: int, math: Any) -> Number | None:
    if g[i] is None or h[j] is None:
        return None
    return math.square(g[i]) if i == j else g[i] * h[j]


def _add(p: Number | None, q: Number | None) -> Number | None:
    return q if p is None else p if q is None else p + q


def _neg(p: Number | None) -> Number | None:
    return None if p is None else -p


def _mul(p: Number | None, q: Number | None) -> Number | None:
    return None if p is None or q is None else p * q


def _div(p: Number | None, q: Number) -> Number | None:
    return None if p is None else p / q


def fold(node: Node, numbers: list[float]) -> float:
    """One operation on plain numbers, for the parser; not a number where it is undefined."""
    with np.errstate(all="ignore"):
        return float(_apply(node, [Jet(np.float64(x)) for x in numbers], ArrayMath()).value)
