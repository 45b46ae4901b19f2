"""Dimensions of the metrics of a run, read off their names, and of the units that a user sets beside them."""

from __future__ import annotations

from collections.abc import Mapping

from bodyplan.show.text import unit_of

#: powers of the base units: {"meter": 1, "second": -1}; an angle is none of the other dimensions here
Dimension = Mapping[str, float]

#: end of a measure's name -> the SI unit that it is in
_SUFFIXES = {"_m_s": "m/s", "_rad": "rad", "_Nm": "N*m", "_N": "N", "_J": "J", "_m": "m", "_s": "s"}


def si_unit(group: str, name: str) -> str:
    """SI unit of a fact of the plan (``group`` "plan") or a measure of the trial; empty for ratios and counts."""
    if group == "plan":
        return unit_of(name).replace("²", "^2").replace("N m", "N*m")
    return next((unit for end, unit in _SUFFIXES.items() if name.endswith(end)), "")


def over(above: Dimension, below: Dimension) -> Dimension:
    """The dimension of a quotient."""
    powers = {name: above.get(name, 0.0) - below.get(name, 0.0) for name in {*above, *below}}
    return {name: power for name, power in powers.items() if power}
