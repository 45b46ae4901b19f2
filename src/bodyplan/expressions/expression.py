"""A formula of named variables: values, exact derivatives, and bounds over boxes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.expressions.jets import fold
from bodyplan.expressions.parse import CONSTANTS, FUNCTIONS, Node, parse, shown

if TYPE_CHECKING:
    from bodyplan.expressions.compiled import Program, Tape


class Expression:
    """A formula such as ``sin(0.5*(x+y))/15``.

    ``text`` may use numbers, the names in ``variables``, pi, e, ``+ - * / **``, parentheses and the functions
    sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt abs min max (angles in rad). It is parsed by
    a whitelist and never run as code; its length, depth and constant exponents are bounded.

    Constant exponents are exact (``x**2`` at 0, ``(-2)**3``, ``x**0 == 1``); a power with a variable in its
    exponent needs a positive base. At the kink of abs, min and max, derivatives are those of one side.

    Raises InputError naming the offending part of the text and what is allowed.
    """

    def __init__(self, text: str, variables: Sequence[str] = ("x", "y")) -> None:
        names = (variables,) if isinstance(variables, str) else tuple(variables)
        for name in names:
            if not isinstance(name, str) or not name.isidentifier() or not name.isascii():
                raise InputError(f"Expression.variables: {name!r} is not a name.")
            if name in CONSTANTS or name in FUNCTIONS:
                raise InputError(f"Expression.variables: {name!r} is already a constant or a function.")
        if len(set(names)) != len(names):
            raise InputError(f"Expression.variables: every name once, got {names!r}.")
        self._text, self._variables, self._tape = text, names, parse(text, names, fold)

    @property
    def text(self) -> str:
        """The formula as it was given."""
        return self._text

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the variables, in the order of gradient and Hessian."""
        return self._variables

    @cached_property
    def kinks(self) -> tuple[Expression, ...]:
        """Formulas whose zeros are the only places where this one has no derivative though it is defined:
        the arguments of abs and the differences of the arguments of min and max."""
        found = []
        for i, node in enumerate(self._tape):
            if node.op == "abs":
                found.append(self._part(self._tape[: node.args[0] + 1]))
            elif node.op in ("min", "max"):
                found.append(self._part((*self._tape[:i], Node("sub", node.args, source=node.source))))
        return tuple(found)

    def value(self, **arrays: ArrayLike) -> Array:
        """The formula at arrays of one broadcast shape (...,), one for each variable, by name.

        Raises InputError for a missing variable, and where the result (or a step to it, such as a division
        by zero or the logarithm of a negative number) is not finite, naming the formula and the point.
        """
        points = self._points(arrays)
        (value, _, _), culprit = self._run(points, 0)
        self._check(points, np.isfinite(value), culprit)
        return value

    def jet(self, **arrays: ArrayLike) -> tuple[Array, Array, Array]:
        """Value (...,), gradient (..., n) and Hessian (..., n, n), exact, by forward-mode differentiation.

        Raises InputError as :meth:`value`, and where a derivative is not finite.
        """
        points = self._points(arrays)
        jet, culprit = self._run(points, len(self._variables))
        value, gradient, hessian = jet
        good = np.isfinite(value) & np.isfinite(gradient).all(axis=-1) & np.isfinite(hessian).all(axis=(-2, -1))
        self._check(points, good, culprit)
        return jet

    def jet_or_nan(self, **arrays: ArrayLike) -> tuple[Array, Array, Array]:
        """As :meth:`jet`, with a value that is not a number (and no error) where the formula is undefined."""
        return self._run(self._points(arrays), len(self._variables))[0]

    def jet_rates(self, **ways: tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array, Array]:
        """Rates of value (...,), gradient (..., n) and Hessian (..., n, n) along a way through the variables:
        ``x=(value, rate)``, one pair of arrays (...,) for each; exact, third derivatives of the formula times rates.

        Raises InputError as :meth:`value`, and where a rate is not finite.
        """
        from bodyplan.expressions.compiled import rates_program

        flat = self._pairs(ways)
        program = rates_program(self._tape, len(self._variables))
        rates, culprit = self._numbers(program, flat, len(self._variables))
        good = np.isfinite(rates[0]) & np.isfinite(rates[1]).all(axis=-1) & np.isfinite(rates[2]).all(axis=(-2, -1))
        self._check(flat[::2], good, culprit)
        return rates

    def enclosure(self, **boxes: tuple[ArrayLike, ArrayLike]) -> tuple[Array, Array, Array]:
        """Bounds over boxes: ``x=(low, high)``, one pair of arrays (...,) for each variable.

        Returns (lowest, highest) stacked in front: of the value (2, ...), the gradient (2, ..., n) and the
        Hessian (2, ..., n, n). They hold (widened for rounding) but need not be tight; infinite where nothing
        is known: at a kink for the Hessian, at a pole or the edge of the domain for all. Where the formula
        is defined nowhere in a box, the value has the empty bounds (inf, -inf).
        """
        return self._intervals(self.bounds_tape, boxes, len(self._variables))

    def extremes(self, **boxes: tuple[ArrayLike, ArrayLike]) -> Array:
        """Bounds (2, ...) of the value over boxes: those of :meth:`enclosure`, for less."""
        return self._intervals(self.range_tape, boxes, 0)[0]

    @cached_property
    def jet_tape(self) -> Tape:
        """What kernels need for values and derivatives: :func:`bodyplan.expressions.tape_kernel.tape_jet`."""
        from bodyplan.expressions.compiled import jet_program

        return jet_program(self._tape, len(self._variables)).tape

    @cached_property
    def bounds_tape(self) -> Tape:
        """What kernels need for bounds: :func:`bodyplan.expressions.tape_kernel.tape_bounds`."""
        from bodyplan.expressions.compiled import bounds_program

        return bounds_program(self._tape, len(self._variables), True).tape

    @cached_property
    def range_tape(self) -> Tape:
        """What kernels need for bounds of the value: :func:`bodyplan.expressions.tape_kernel.tape_range`."""
        from bodyplan.expressions.compiled import bounds_program

        return bounds_program(self._tape, len(self._variables), False).tape

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and (self.text, self.variables) == (other.text, other.variables)

    def __hash__(self) -> int:
        return hash((self._text, self._variables))

    def __repr__(self) -> str:
        return f"Expression({self._text!r}, variables={self._variables!r})"

    def _part(self, tape: tuple[Node, ...]) -> Expression:
        part = object.__new__(Expression)
        part._text, part._variables, part._tape = tape[-1].source, self._variables, tape
        return part

    def _points(self, arrays: Mapping[str, ArrayLike], names: Sequence[str] | None = None) -> list[Array]:
        """The given arrays in the order of ``names``, broadcast to one shape."""
        names = self._variables if names is None else names
        for name in arrays:
            if name not in names:
                raise UnknownNameError("variable", name, names, f"Expression {shown(self._text)}")
        missing = [name for name in names if name not in arrays]
        if missing:
            raise InputError(f"Expression {shown(self._text)}: no value for {', '.join(missing)}.")
        given = [finite(arrays[name], f"Expression {shown(self._text)}, {name}") for name in names]
        if len({a.shape for a in given}) == 1:
            return given
        try:
            return list(np.broadcast_arrays(*given))
        except ValueError as error:
            shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(names, given, strict=True))
            raise InputError(f"Expression {shown(self._text)}: shapes do not broadcast: {shapes}.") from error

    def _pairs(self, pairs: Mapping[str, tuple[ArrayLike, ArrayLike]]) -> list[Array]:
        """Two arrays of every variable, one variable after the other, broadcast to one shape."""
        ends = {f"{name}{end}": pair[end] for name, pair in pairs.items() for end in (0, 1)}
        return self._points(ends, [f"{name}{end}" for name in self._variables for end in (0, 1)])

    def _run(self, points: list[Array], n: int) -> tuple[tuple[Array, Array, Array], str]:
        """Value, gradient and Hessian in n variables (0: none), and the first operation that failed."""
        from bodyplan.expressions.compiled import jet_program, value_program

        make = jet_program if n else value_program
        return self._numbers(make(self._tape, len(self._variables)), points, n)

    def _numbers(self, program: Program, points: list[Array], n: int) -> tuple[tuple[Array, Array, Array], str]:
        """Numbers of a program at points (...,): the first (...,), n (..., n) and n n (..., n, n) further ones; and the
        first operation that failed."""
        from bodyplan.expressions.tape_kernel import tape_numbers

        shape = points[0].shape if points else ()
        flat = np.stack([p.ravel() for p in points], axis=-1) if points else np.zeros((1, 0))
        value, gradient, hessian = np.empty(len(flat)), np.empty((len(flat), n)), np.empty((len(flat), n * n))
        node = tape_numbers(program.tape, flat, value, gradient, hessian)
        culprit = program.sources[node] if node < len(program.sources) else ""
        return (value.reshape(shape), gradient.reshape(*shape, n), hessian.reshape(*shape, n, n)), culprit

    def _intervals(
        self, tape: Tape, boxes: Mapping[str, tuple[ArrayLike, ArrayLike]], n: int
    ) -> tuple[Array, Array, Array]:
        """Bounds of a program's numbers over boxes: of the first (2, ...), n (2, ..., n) and n n (2, ..., n, n)
        further ones."""
        from bodyplan.expressions.tape_kernel import tape_intervals

        flat = self._pairs(boxes)
        shape = flat[0].shape if flat else ()
        ends = np.stack([p.ravel() for p in flat], axis=-1) if flat else np.zeros((1, 0))
        m = len(ends)
        value, gradient, hessian = np.empty((2, m)), np.empty((2, m, n)), np.empty((2, m, n * n))
        tape_intervals(tape, ends[:, ::2], ends[:, 1::2], value, gradient, hessian)
        return value.reshape(2, *shape), gradient.reshape(2, *shape, n), hessian.reshape(2, *shape, n, n)

    def _check(self, points: list[Array], good: BoolArray, culprit: str) -> None:
        if good.all():
            return
        index = tuple(np.argwhere(~good)[0])
        at = ", ".join(f"{name} = {float(p[index])!r}" for name, p in zip(self._variables, points, strict=True))
        part = f" (because of {shown(culprit)})" if culprit else ""
        raise InputError(f"Expression {shown(self._text)}: not finite, or without derivatives, at {at}{part}.")
