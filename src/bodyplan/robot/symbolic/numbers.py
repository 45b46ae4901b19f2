"""Numbers of a robot as SymPy numbers: exact where they mean something exact, so that formulas stay short."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import sympy as sp

#: an angle k pi / n with one of these n is taken as exact
PARTS_OF_PI = (1, 2, 3, 4, 6)


def angle(value: float) -> Any:
    """An angle in rad: a multiple of pi/2, pi/3, pi/4 or pi/6 where it is one to four roundings, else a Float."""
    for n in PARTS_OF_PI:
        k = round(value / math.pi * n)
        if k and abs(k * math.pi / n - value) <= 4.0 * math.ulp(value):
            return sp.Rational(k, n) * sp.pi
    return plain(value)


def plain(value: float) -> Any:
    """A length or any other number: whole numbers and short binary fractions exactly, else a Float of 53 bits."""
    exact = Fraction(value)
    if exact.denominator <= 16 and abs(exact.numerator) < 1000:
        return sp.Rational(exact.numerator, exact.denominator)
    return sp.Float(value)


def machine(value: Any) -> Any:
    """The double that a SymPy number is in code; 0, 1 and -1 stay whole so that products with them vanish."""
    if value in (0, 1, -1):
        return sp.Integer(int(value))
    return plain_float(float(value))


def plain_float(value: float) -> Any:
    """A double, whole numbers 0 and +-1 as such."""
    return sp.Integer(int(value)) if value in (0.0, 1.0, -1.0) else sp.Float(value)
