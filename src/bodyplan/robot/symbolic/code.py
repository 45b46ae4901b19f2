"""Expressions as text that C and NumPy both read."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import sympy as sp

from bodyplan.robot.source_text import filled
from bodyplan.robot.symbolic.program import ARC_C
from bodyplan.spatial.coefficients import SERIES_BELOW, c_series


def text(value: Any, function: Callable[[str], str], tight: bool = False) -> str:
    """An expression of a program; ``function`` names a function in the language. ``tight``: in parentheses where the
    expression is a sum or starts with a minus."""
    out = _text(sp.sympify(value), function)
    return f"({out})" if tight and (out.startswith("-") or sp.sympify(value).is_Add) else out


def _text(value: Any, function: Callable[[str], str]) -> str:
    if value.is_Symbol:
        return str(value.name)
    if value.is_number:
        return repr(float(value))
    if value.is_Add:
        terms = [_text(term, function) for term in value.args]
        return "".join([terms[0], *(f" - {t[1:]}" if t.startswith("-") else f" + {t}" for t in terms[1:])])
    if value.is_Mul:
        number, factors = value.as_coeff_mul()
        sign = "-" if number < 0 else ""
        parts = [text(factor, function, tight=True) for factor in factors]
        return sign + "*".join([repr(abs(float(number)))] * (abs(number) != 1) + parts)
    if value.is_Pow and value.exp == 2:
        return "*".join([text(value.base, function, tight=True)] * 2)
    if value.is_Pow and value.exp == sp.S.Half:
        return f"{function('sqrt')}({_text(value.base, function)})"
    name, arguments = value.func.__name__, ", ".join(_text(argument, function) for argument in value.args)
    return f"{function(name)}({arguments})"


def uses_arcs(values: Iterable[Any]) -> bool:
    """Whether a program needs the functions of an arc's angle."""
    return any(value.has(ARC_C) for value in values)


def arc_function(function: Callable[[str], str], template: str, near: str, far: str) -> str:
    """A template with BELOW, SERIES in z = ``near`` and CLOSED in z = ``far`` filled in for the C of an arc, from the
    library's own series."""
    series = _text(c_series(sp.Symbol(near)), function)
    return filled(template, {"BELOW": repr(SERIES_BELOW), "SERIES": series, "CLOSED": f"(1.0 - a) / {far}"})
