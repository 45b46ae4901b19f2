"""Quantities with units: ``"30 deg"`` and ``"25 mm"`` become SI numbers and radians."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np

from bodyplan.errors import InputError

#: dimension -> the SI unit that plain numbers are taken to be in
SI_UNITS = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "mass": "kg",
    "speed": "m/s",
    "angular_rate": "rad/s",
    "force": "N",
    "torque": "N*m",
    "curvature": "1/m",
    "frequency": "Hz",
    "none": "",
}


@cache
def registry() -> Any:
    """The pint registry that all quantities are read with; made when first needed."""
    import pint

    return pint.UnitRegistry(cache_folder=None)


def to_si(value: Any, dimension: str, field: str = "value") -> float:
    """``value`` in SI units: a plain number is taken as SI already, a text is parsed with pint.

    Raises InputError when the text is not a quantity or has another dimension than ``dimension``
    (one of :data:`SI_UNITS`).
    """
    unit = SI_UNITS[dimension]
    if isinstance(value, bool):
        raise InputError(f"{field}: expected {_named(dimension)} such as {_example(dimension)}, got {value!r}.")
    if isinstance(value, (int, float, np.integer, np.floating)):
        out = float(value)
    elif isinstance(value, str):
        if not _QUANTITY.fullmatch(value):
            raise InputError(_wrong(value, dimension, field))
        import pint

        try:
            quantity = registry().Quantity(value)
            # frequency: pint reads Hz as 1/s, and keeps "rad" dimensionless
            out = float(quantity.to(unit or "dimensionless").magnitude)
        except (pint.errors.PintError, ValueError, TypeError, AssertionError, AttributeError, SyntaxError) as error:
            raise InputError(_wrong(value, dimension, field)) from error
    else:
        raise InputError(f"{field}: expected {_named(dimension)} such as {_example(dimension)}, got {value!r}.")
    if not np.isfinite(out):
        raise InputError(f"{field}: must be finite, got {value!r}.")
    return out


#: a number and a unit: nothing that pint would have to compute
_WORD = r"[A-Za-z\u00b5\u03bc\u00b0%]{1,20}((\*\*|\^)-?\d)?"
_QUANTITY = re.compile(
    r"\s*[+-]?(\d{1,30}(\.\d{0,30})?|\.\d{1,30})([eE][+-]?\d{1,3})?\s*"
    rf"((1?\s*/\s*)?{_WORD}(\s*[*/ \u00b7]\s*{_WORD}){{0,5}})?\s*"
)


def _wrong(value: str, dimension: str, field: str) -> str:
    wanted = f"a number in {SI_UNITS[dimension] or 'no unit'} or a text such as {_example(dimension)}"
    return f"{field}: {value!r} is not {_named(dimension)}; write {wanted}."


def _named(dimension: str) -> str:
    words = dimension.replace("_", " ")
    return f"an {words}" if words[0] in "aeiou" else f"a {words}"


def _example(dimension: str) -> str:
    return {
        "length": '"25 mm"',
        "angle": '"30 deg"',
        "time": '"0.5 s"',
        "mass": '"50 g"',
        "speed": '"30 mm/s"',
        "angular_rate": '"90 deg/s"',
        "force": '"5 N"',
        "torque": '"0.5 N*m"',
        "curvature": '"12 / m"',
        "frequency": '"0.25 Hz"',
        "none": "0.8",
    }[dimension]
