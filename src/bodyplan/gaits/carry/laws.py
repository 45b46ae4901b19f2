"""Functions of time: constants, quantities with a unit and formulas in t, with exact derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError
from bodyplan.expressions import Expression
from bodyplan.gaits.carry.orientation import Function
from bodyplan.units import to_si


class Law:
    """A function of time: a number, a quantity such as "0.1 m" or "5 deg", or a formula in t (s) such as "0.1*sin(t)".

    Raises InputError naming ``field`` for anything else.
    """

    def __init__(self, given: Any, field: str, dimension: str) -> None:
        self.text: str | None = None
        self.constant = 0.0
        if isinstance(given, Law):
            self.text, self.constant = given.text, given.constant
        elif isinstance(given, Expression):
            self._formula(given.text, field)
        elif isinstance(given, str):
            try:
                self.constant = to_si(given, dimension, field)
            except InputError as no_quantity:
                try:
                    self._formula(given, field)
                except InputError as no_formula:
                    raise InputError(f"{field}: {given!r} is neither a quantity ({no_quantity}) nor a formula in t "
                                     f"({no_formula})") from no_formula  # fmt: skip
        else:
            self.constant = number(given, field)

    def _formula(self, text: str, field: str) -> None:
        self.text = text
        self._expression = Expression(text, ("t",))

    def at(self, t: Array) -> Function:
        """Value, first and second derivative at t (T,) s. InputError where the formula is undefined."""
        if self.text is None:
            return Function(np.full(len(t), self.constant), np.zeros(len(t)), np.zeros(len(t)))
        value, first, second = self._expression.jet(t=t)
        return Function(value, first[..., 0], second[..., 0, 0])

    def third(self, t: Array) -> Array:
        """Third derivative at t (T,) s."""
        if self.text is None:
            return np.zeros(len(t))
        return self._expression.jet_rates(t=(t, np.ones(len(t))))[2][..., 0, 0]

    @property
    def plain(self) -> float | str:
        """The law as JSON."""
        return self.constant if self.text is None else self.text
