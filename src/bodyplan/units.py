"""Quantities with units: ``"30 deg"`` and ``"25 mm"`` become SI numbers and radians."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
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
def _registry() -> Any:
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
        # frequency: pint reads Hz as 1/s, and keeps "rad" dimensionless
        wrong = _wrong(value, dimension, field)
        out = _read(lambda made: float(made(value).to(unit or "dimensionless").magnitude), wrong)
    else:
        raise InputError(f"{field}: expected {_named(dimension)} such as {_example(dimension)}, got {value!r}.")
    if not np.isfinite(out):
        raise InputError(f"{field}: must be finite, got {value!r}.")
    return out


@cache
def unit_in_base(unit: str) -> tuple[float, Mapping[str, float]]:
    """What one ``unit`` ("mm/s") is in pint's base units, and their powers: {"meter": 1, "second": -1}; (1, {}) where
    it is empty. InputError for a text that is no unit."""
    if not unit.strip():
        return 1.0, {}
    wrong = f"unit = {unit!r}: not a unit; write for example mm/s, deg, N*m, or % for a share."
    if not _UNIT.fullmatch(unit):
        raise InputError(wrong)
    quantity = _read(lambda made: made(1.0, unit.replace("\u00b7", "*")).to_base_units(), wrong)
    return float(quantity.magnitude), {str(name): float(power) for name, power in quantity.unit_items()}


def _read(work: Callable[[Any], Any], wrong: str) -> Any:
    """What ``work`` makes of pint's maker of quantities; InputError saying ``wrong`` where pint cannot."""
    import pint

    try:
        return work(_registry().Quantity)
    except (pint.errors.PintError, ValueError, TypeError, AssertionError, AttributeError, SyntaxError) as error:
        raise InputError(wrong) from error


#: a number and a unit: nothing that pint would have to compute
_WORD = r"[A-Za-z\u00b5\u03bc\u00b0%]{1,20}((\*\*|\^)-?\d)?"
_WORDS = rf"{_WORD}(\s*[*/ \u00b7]\s*{_WORD}){{0,5}}"
_UNIT = re.compile(rf"\s*(1\s*/\s*)?{_WORDS}\s*")
_QUANTITY = re.compile(
    r"\s*[+-]?(\d{1,30}(\.\d{0,30})?|\.\d{1,30})([eE][+-]?\d{1,3})?\s*" + rf"((1?\s*/\s*)?{_WORDS})?\s*"
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
