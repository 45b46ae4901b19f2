"""The figures of a search by the names that a user gives them: ``trial.speed``, ``trial.speed_m_s / plan.speed``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.show.beside import trial_names
from bodyplan.show.dimensions import over, si_unit
from bodyplan.units import unit_in_base

GROUPS = ("plan", "check", "trial")
CHECKS = ("passed", "failed")
#: figures by the stages of the motion: their names are known after the run
STAGES = ("slip_m.", "slip_largest_m.")
#: ends that a user may leave out
_UNITS = ("_m_s", "_rad", "_Nm", "_N", "_J", "_m", "_s")


@dataclass(frozen=True)
class Measure:
    """A figure, or the ratio of two: ``names`` as rows have them; ``text`` as a table heads it."""

    names: tuple[str, ...]

    @property
    def text(self) -> str:
        """ "trial.speed_m_s", "trial.speed_m_s / plan.speed"."""
        return " / ".join(self.names)

    def of(self, figures: Mapping[str, float | None]) -> float | None:
        """Its value among the figures of a row; None where there is none."""
        values = [figures.get(name) for name in self.names]
        first = values[0]
        if first is None or len(values) == 1:
            return first
        second = values[1]
        return None if not second else first / second

    @property
    def unit(self) -> str:
        """SI unit; empty for ratios and where the name does not tell."""
        return si_unit(*self.names[0].split(".", 1)) if len(self.names) == 1 else ""

    @property
    def dimension(self) -> Mapping[str, float]:
        """Powers of its base units."""
        units = [unit_in_base(si_unit(*name.split(".", 1)))[1] for name in self.names]
        return units[0] if len(units) == 1 else over(units[0], units[1])


@dataclass(frozen=True)
class Bound:
    """A demand on a measure: at most ``limit`` (SI), or at least it."""

    measure: Measure
    limit: float
    at_least: bool

    @property
    def of_plan(self) -> bool:
        """True where plan and checks decide it, without physics."""
        return not any(name.startswith("trial.") for name in self.measure.names)

    @property
    def text(self) -> str:
        """ "trial.peak_torque_Nm <= 1.2"."""
        return f"{self.measure.text} {'>=' if self.at_least else '<='} {self.limit:.12g}"

    def excess(self, figures: Mapping[str, float | None]) -> float | None:
        """By how much it is missed as a share of the limit (of 1 where that is 0); 0 or less: it is kept. None where
        the measure has no value."""
        value = self.measure.of(figures)
        if value is None:
            return None
        return (self.limit - value if self.at_least else value - self.limit) / (abs(self.limit) or 1.0)


def measure_of(text: str, facts: Collection[str], cycles: int, simulate: bool, option: str) -> Measure:
    """The measure that a user names: ``facts`` are those of the mission's plan, ``cycles`` those of its trial.

    The unit at the end of a name may be left out where that leaves one name. Raises UnknownNameError with the names
    that there are.
    """
    parts = [part.strip() for part in text.split("/")] if " / " in text or text.count("/") == 1 else [text.strip()]
    if len(parts) > 2 or not all(parts):
        raise InputError(f"{option} {text}: write a figure such as trial.speed, or a ratio of two: A / B.")
    return Measure(tuple(_name(part, facts, cycles, simulate, f"{option} {text}") for part in parts))


def _name(text: str, facts: Collection[str], cycles: int, simulate: bool, where: str) -> str:
    group, dot, name = text.partition(".")
    if not dot or group not in GROUPS:
        raise UnknownNameError("group of figures", group, GROUPS, where=f"{where}: figures are plan.NAME, trial.NAME")
    if group == "trial":
        if not simulate:
            raise InputError(f"{where}: the mission is not simulated here, so that there are figures of the plan only.")
        if name.startswith(STAGES):
            return text
    known = {"plan": facts, "check": CHECKS, "trial": trial_names(cycles)}[group]
    if name in known:
        return text
    meant = [name + unit for unit in _UNITS if name + unit in known]
    if len(meant) == 1:
        return f"{group}.{meant[0]}"
    if meant:
        raise InputError(f"{where}: say which: {' or '.join(f'{group}.{one}' for one in meant)}.")
    raise UnknownNameError(f"figure of the {group}", name, known, where=where)


_BOUND = re.compile(r"(.+?)(<=|>=)(.+)")


def bound_of(text: str, facts: Collection[str], cycles: int, simulate: bool) -> Bound:
    """The demand in a text "trial.peak_torque<=1.2", "trial.speed >= 20 mm/s". InputError where it is none."""
    match = _BOUND.fullmatch(text.strip())
    if match is None:
        raise InputError(f"--subject-to {text}: expected FIGURE<=NUMBER or FIGURE>=NUMBER: trial.peak_torque<=1.2.")
    measure = measure_of(match[1].strip(), facts, cycles, simulate, "--subject-to")
    found = re.fullmatch(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(\S.*?)?\s*", match[3])
    if found is None:
        raise InputError(f"--subject-to {text}: {match[3].strip()!r} is not a number, with or without a unit.")
    scale, dimension = unit_in_base(found[2] or "")
    if found[2] and dimension != measure.dimension:
        raise InputError(f"--subject-to {text}: {measure.text} is in {measure.unit or 'no unit'}, not in {found[2]}.")
    return Bound(measure, float(found[1]) * scale, match[2] == ">=")


def measures_of(
    texts: Iterable[str], facts: Collection[str], cycles: int, simulate: bool, option: str
) -> tuple[Measure, ...]:
    """The measures of several texts, each once."""
    found = (measure_of(text, facts, cycles, simulate, option) for text in texts)
    return tuple(dict.fromkeys(found))
