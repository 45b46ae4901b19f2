"""Dimensions of the metrics of a run, read off their names, and of the units that a user sets beside them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

from bodyplan.errors import InputError
from bodyplan.show.text import unit_of
from bodyplan.units import registry

#: powers of the base units: {"meter": 1, "second": -1}; an angle is none of the other dimensions here
Dimension = Mapping[str, float]

#: end of a measure's name -> the SI unit that it is in
_SUFFIXES = {"_m_s": "m/s", "_rad": "rad", "_Nm": "N*m", "_N": "N", "_J": "J", "_m": "m", "_s": "s"}
_WORD = r"[A-Za-z\u00b5\u03bc\u00b0%]{1,20}((\*\*|\^)-?\d)?"
_UNIT = re.compile(rf"\s*(1\s*/\s*)?{_WORD}(\s*[*/ \u00b7]\s*{_WORD}){{0,5}}\s*")
_EXAMPLES = "write for example mm/s, deg, N*m, or % for a share"


def si_unit(group: str, name: str) -> str:
    """SI unit of a fact of the plan (``group`` "plan") or a measure of the trial; empty for ratios and counts."""
    if group == "plan":
        return unit_of(name).replace("²", "^2").replace("N m", "N*m")
    return next((unit for end, unit in _SUFFIXES.items() if name.endswith(end)), "")


@cache
def read_unit(unit: str) -> tuple[float, Dimension]:
    """What one ``unit`` is in SI, and its dimension; (1, {}) where it is empty. InputError for a text that is no
    unit."""
    if not unit.strip():
        return 1.0, {}
    if not _UNIT.fullmatch(unit):
        raise InputError(f"unit = {unit!r}: not a unit; {_EXAMPLES}.")
    import pint

    try:
        quantity: Any = registry().Quantity(1.0, unit.replace("·", "*")).to_base_units()
    except (pint.errors.PintError, ValueError, TypeError, AssertionError, AttributeError, SyntaxError) as error:
        raise InputError(f"unit = {unit!r}: not a unit; {_EXAMPLES}.") from error
    return float(quantity.magnitude), {str(name): float(power) for name, power in quantity.unit_items()}


def over(above: Dimension, below: Dimension) -> Dimension:
    """The dimension of a quotient."""
    powers = {name: above.get(name, 0.0) - below.get(name, 0.0) for name in {*above, *below}}
    return {name: power for name, power in powers.items() if power}
