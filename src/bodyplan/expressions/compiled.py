"""A formula as a straight line of scalar operations, for the kernels of :mod:`bodyplan.expressions.tape_kernel`.

The rules of differentiation (:mod:`bodyplan.expressions.jets`) are run once, on numbers that only write down what is
done to them. What comes out is a **program**: every instruction makes one number (or one interval) from earlier ones,
equal instructions are one, and those that nobody needs are left out. One interpreter runs all programs, so a new
formula costs no compilation; for the few points of a step of planning it takes a small share of the time of arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.expressions.duals import Dual, DualMath, rate_of
from bodyplan.expressions.jets import Jet, pairs, run, seeds
from bodyplan.expressions.parse import Node

#: instructions on numbers and on intervals
ADD, SUB, MUL, DIV, NEG, POWER, ORDER, PICK, STEP, ARCTAN2 = range(10)
SIN, COS, TAN, ARCSIN, ARCCOS, ARCTAN, SINH, COSH, TANH, EXP, LOG, SQRT, ABS = range(10, 23)
#: instructions on intervals only
SQUARE, BEND, PICK_ROUGH, CUT, INSIDE = range(23, 28)
_FUNCTIONS = {
    "sin": SIN, "cos": COS, "tan": TAN, "arcsin": ARCSIN, "arccos": ARCCOS, "arctan": ARCTAN, "sinh": SINH,
    "cosh": COSH, "tanh": TANH, "exp": EXP, "log": LOG, "sqrt": SQRT, "abs": ABS,
}  # fmt: skip


class Tape(NamedTuple):
    """A program as kernels take it. A register is a number, or (lowest, highest) of an interval.

    ``code`` (n, 5): instruction, registers of up to three arguments, and 1 + the number of the node of the formula
    whose value this is, or 0. Instruction k fills register r - n + k. ``outputs`` (k,): the registers of value,
    gradient and Hessian, row by row. ``registers`` (r,) or (r, 2): those of the variables first, then constants, which
    are in place; a kernel works on a copy.
    """

    code: IntArray
    outputs: IntArray
    registers: Array


@dataclass(frozen=True)
class Program:
    """A tape and the texts of the nodes that its code refers to."""

    tape: Tape
    sources: tuple[str, ...]


@lru_cache(maxsize=256)
def value_program(nodes: tuple[Node, ...], n: int) -> Program:
    """The value of a formula of n variables."""
    math = NumberRecorder(n)
    return math.program([math.run(nodes, seeds(math.variables, 0)).value])


@lru_cache(maxsize=256)
def jet_program(nodes: tuple[Node, ...], n: int) -> Program:
    """Value, gradient and Hessian of a formula of n variables."""
    math = NumberRecorder(n)
    return math.program(_outputs(math.run(nodes, seeds(math.variables, n)), n))


@lru_cache(maxsize=256)
def rates_program(nodes: tuple[Node, ...], n: int) -> Program:
    """Rates of value, gradient and Hessian; the variables are value and rate of each of the formula's."""
    math = NumberRecorder(2 * n)
    pair = [Dual(value, rate) for value, rate in zip(math.variables[::2], math.variables[1::2], strict=True)]
    last = math.run(nodes, seeds(pair, n), DualMath(math))
    return math.program([rate_of(number) for number in _outputs(last, n)])


@lru_cache(maxsize=256)
def bounds_program(nodes: tuple[Node, ...], n: int, derivatives: bool) -> Program:
    """Bounds of the value, and of gradient and Hessian where ``derivatives`` are wanted, on intervals."""
    math = IntervalRecorder(n)
    last = math.run(nodes, seeds(math.variables, n if derivatives else 0))
    return math.program(_outputs(last, n) if derivatives else [last.value])


def _outputs(jet: Jet, n: int) -> list[Any]:
    """Value, gradient (n) and Hessian (n n, row by row); None is a zero."""
    where = {pair: k for k, pair in enumerate(pairs(n))}
    hessian = [jet.hessian[where[min(i, j), max(i, j)]] for i in range(n) for j in range(n)]
    return [0.0 if number is None else number for number in (jet.value, *jet.gradient, *hessian)]


class Symbol:
    """A number that is not known yet: a variable (``at`` < n) or the result of instruction ``at`` - n."""

    __slots__ = ("at", "math")
    __array_ufunc__ = None  # a NumPy number on the left leaves the operation to this class

    def __init__(self, math: Recorder, at: int) -> None:
        self.math, self.at = math, at

    def __neg__(self) -> Any:
        return self.math.record(NEG, self)

    def __add__(self, other: Any) -> Any:
        return self._with(ADD, self, other)

    def __sub__(self, other: Any) -> Any:
        return self._with(SUB, self, other)

    def __rsub__(self, other: Any) -> Any:
        return self._with(SUB, other, self)

    def __mul__(self, other: Any) -> Any:
        return self._with(MUL, self, other)

    def __truediv__(self, other: Any) -> Any:
        return self._with(DIV, self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._with(DIV, other, self)

    def _with(self, op: int, a: Any, b: Any) -> Any:
        # a dual number takes the operation over
        return NotImplemented if isinstance(a, Dual) or isinstance(b, Dual) else self.math.record(op, a, b)

    __radd__ = __add__
    __rmul__ = __mul__


class Recorder:
    """Symbols as the numbers of a jet (:class:`bodyplan.expressions.jets.Math`); writes down every operation."""

    #: instructions that say more than their result, and are kept though nobody needs that
    telling: tuple[int, ...] = ()
    #: numbers in a register
    width: tuple[int, ...] = ()

    def __init__(self, n: int) -> None:
        self.variables = [Symbol(self, i) for i in range(n)]
        self.code: list[tuple[int, ...]] = []
        self.known: dict[tuple[int, ...], int] = {}
        self.constants: dict[str, int] = {}
        self.nodes: list[int] = []
        self.sources: list[str] = []

    def run(self, nodes: tuple[Node, ...], variables: list[Jet], math: Any = None) -> Jet:
        """The jet of a formula, written down; ``math``: of numbers that consist of symbols."""
        with np.errstate(all="ignore"):  # constants that are divided by 0
            return run(nodes, variables, math or self)[-1]

    def record(self, op: int, *args: Any) -> Any:
        """The result of ``op`` on symbols and plain numbers."""
        at = [self._at(arg) for arg in args]
        one = self._at(1.0)
        if op == MUL and one in at:  # exact, also for infinite numbers
            return args[1 - at.index(one)]
        if op == DIV and at[1] == one:
            return args[0]
        if op in (ADD, MUL):
            at.sort()
        key = (op, *at)
        if key not in self.known:
            self.known[key] = len(self.code)
            self.code.append((op, *at, *[at[0]] * (3 - len(at))))
            self.nodes.append(0)
        return Symbol(self, len(self.variables) + self.known[key])

    def _at(self, number: Any) -> int:
        """Where a number is: >= 0 for symbols, -1 - k for the k-th constant."""
        if isinstance(number, Symbol):
            return number.at
        return self.constants.setdefault(float(number).hex(), -1 - len(self.constants))

    def __getattr__(self, name: str) -> Any:
        """The functions of one argument, by their names in NumPy."""
        if name not in _FUNCTIONS:
            raise AttributeError(name)
        return lambda v: self.record(_FUNCTIONS[name], v) if isinstance(v, Symbol) else getattr(np, name)(v)

    def arctan2(self, y: Any, x: Any) -> Any:
        return self.record(ARCTAN2, y, x)

    def step(self, v: Any) -> Any:
        return self.record(STEP, v)

    def order(self, a: Any, b: Any) -> Any:
        return self.record(ORDER, a, b)

    def program(self, outputs: Sequence[Any]) -> Program:
        """What was written down, as far as ``outputs`` need it."""
        n, results = len(self.variables), [self._at(number) for number in outputs]
        needed = [self.nodes[k] > 0 or line[0] in self.telling for k, line in enumerate(self.code)]
        for at in results:
            if at >= n:
                needed[at - n] = True
        for k in range(len(self.code) - 1, -1, -1):
            if needed[k]:
                for at in self.code[k][1:]:
                    if at >= n:
                        needed[at - n] = True
        kept = [k for k, need in enumerate(needed) if need]
        place = {n + k: n + len(self.constants) + i for i, k in enumerate(kept)}
        place |= {i: i for i in range(n)} | {-1 - j: n + j for j in range(len(self.constants))}
        code = np.zeros((len(kept), 5), dtype=np.int64)
        for row, k in zip(code, kept, strict=True):
            op, *args = self.code[k]
            row[:] = op, *(place[at] for at in args), self.nodes[k]
        registers = np.zeros((n + len(self.constants) + len(kept), *self.width))
        for j, text in enumerate(self.constants):
            registers[n + j] = float.fromhex(text)
        return Program(Tape(code, np.array([place[at] for at in results]), registers), tuple(self.sources))


class NumberRecorder(Recorder):
    """The operations of :class:`bodyplan.expressions.jets.ArrayMath`."""

    def square(self, v: Any) -> Any:
        return v * v

    def power(self, v: Any, p: float) -> Any:
        return 1.0 if p == 0.0 else v if p == 1.0 else v * v if p == 2.0 else self.record(POWER, v, p)

    def bend(self, v: Any) -> Any:
        return None

    def pick(self, order: Any, a: Any, b: Any, smooth: bool) -> Any:
        return self.record(PICK, order, a, b)

    def cut(self, y: Any, x: Any, h: Any) -> Any:
        return h

    def watch(self, node: Node, value: Any) -> Any:
        self.sources.append(node.source)
        if isinstance(value, Symbol) and value.at >= len(self.variables):
            k = value.at - len(self.variables)
            self.nodes[k] = self.nodes[k] or len(self.sources)
        return value


class IntervalRecorder(Recorder):
    """The operations on intervals: bounds of a formula and of its derivatives over boxes. They hold up to rounding (a
    kernel widens what comes out a little); they are not the tightest ones."""

    telling = (INSIDE, LOG)
    width = (2,)

    def cos(self, v: Any) -> Any:
        return self.sin(v + np.pi / 2)

    def cosh(self, v: Any) -> Any:
        return self.record(COSH, self.abs(v))

    def arcsin(self, v: Any) -> Any:
        return self.record(ARCSIN, self._inside(v, -1.0, 1.0))

    def arccos(self, v: Any) -> Any:
        return self.record(ARCCOS, self._inside(v, -1.0, 1.0))

    def log(self, v: Any) -> Any:
        return self.record(LOG, self._inside(v, 0.0, np.inf))

    def sqrt(self, v: Any) -> Any:
        return self.record(SQRT, self._inside(v, 0.0, np.inf))

    def square(self, v: Any) -> Any:
        return self.record(SQUARE, v) if isinstance(v, Symbol) else v * v

    def power(self, v: Any, p: float) -> Any:
        if p == 0.0:
            return 1.0
        if p < 0.0:
            return 1.0 / self.power(v, -p)
        if p == 1.0:
            return v
        if not float(p).is_integer():
            v = self._inside(v, 0.0, np.inf)
        elif p % 2.0 == 0.0:
            v = self.abs(v)
        return self.record(POWER, v, p)

    def bend(self, v: Any) -> Any:
        return self.record(BEND, v)

    def pick(self, order: Any, a: Any, b: Any, smooth: bool) -> Any:
        return self.record(PICK if smooth else PICK_ROUGH, order, a, b)

    def cut(self, y: Any, x: Any, h: Any) -> Any:
        return self.record(CUT, y, x, h)

    def watch(self, node: Node, value: Any) -> Any:
        return value

    def _inside(self, v: Any, low: float, high: float) -> Any:
        return self.record(INSIDE, v, low, high)
