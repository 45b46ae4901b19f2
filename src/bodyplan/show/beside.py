"""Figures that a paper prints, and the metric of a run that stands beside each: ``trial.speed_m_s``, or a ratio of
two."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import numpy as np

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.show.dimensions import over, si_unit
from bodyplan.simulate.trial import Trial
from bodyplan.units import unit_in_base

GROUPS = ("plan", "trial")
_METRIC = re.compile(r"(?:(?P<mission>[^\s:/]+):)?(?P<group>\w+)\.(?P<name>\w+)")


@dataclass(frozen=True)
class Metric:
    """A number of a run: ``group`` "plan" (a fact of the planner) or "trial" (a measure of the physics); of the mission
    named, or of the run itself (None)."""

    mission: str | None
    group: str
    name: str

    @property
    def key(self) -> str:
        """Its name among :func:`bodyplan.show.outcome.figures_of`."""
        return f"{self.group}.{self.name}"


@dataclass(frozen=True)
class Beside:
    """A row of the table: ``printed`` in ``unit``, and ``value`` in the same unit (None where ``problem`` says why)."""

    what: str
    printed: float
    unit: str
    ours: str
    source: str
    value: float | None
    problem: str = ""


def metrics_in(ours: str) -> tuple[Metric, ...]:
    """The one or two metrics of an expression "A" or "A / B". InputError for anything else."""
    parts = [part.strip() for part in ours.split("/")]
    found = [_METRIC.fullmatch(part) for part in parts]
    if len(parts) > 2 or not all(found):
        raise InputError(
            f"ours = {ours!r}: write a metric (plan.NAME, trial.NAME, MISSION:trial.NAME), or a ratio A / B of two."
        )
    out = tuple(Metric(**match.groupdict()) for match in found if match)
    for metric in out:
        if metric.group not in GROUPS:
            raise UnknownNameError("group of metrics", metric.group, GROUPS, where=f"ours = {ours!r}")
    return out


def check_row(ours: str, unit: str, mission: str, compared: Collection[str], cycles: int) -> None:
    """InputError or UnknownNameError for a row whose unit or metrics cannot exist in a run of ``mission`` beside
    ``compared`` ones. Facts of the plan are known after planning only: :func:`check_facts`."""
    unit_in_base(unit)
    for metric in metrics_in(ours):
        if metric.mission not in (None, mission, *compared):
            raise UnknownNameError("mission", metric.mission, compared, where=f"ours = {ours!r}: not in compare")
        if metric.group == "trial" and metric.name not in (names := trial_names(cycles)):
            raise UnknownNameError("metric of the trial", metric.name, names, where=f"ours = {ours!r}")
    check_unit(ours, unit)


def check_units(rows: Sequence[Any]) -> None:
    """:func:`check_unit` of every row; the error names the row."""
    for row in rows:
        try:
            check_unit(row.ours, row.unit)
        except InputError as error:
            raise InputError(f"paper, row {row.what!r}: {error}") from error


def check_facts(ours: str, facts: Collection[str], mission: str, optional: Sequence[str] = ()) -> None:
    """UnknownNameError for a fact of the plan that this mission's planner does not give; ``optional``: patterns of
    names that it may leave out."""
    for metric in metrics_in(ours):
        mine = metric.mission in (None, mission) and metric.group == "plan" and metric.name not in facts
        if mine and not any(fnmatchcase(metric.name, pattern) for pattern in optional):
            raise UnknownNameError("fact of the plan", metric.name, facts, where=f"paper: ours = {ours!r}")


def beside(rows: Sequence[Any], figures: Mapping[str | None, Mapping[str, float | None]]) -> tuple[Beside, ...]:
    """The rows (with fields what, printed, unit, ours, source) with our values; ``figures`` by mission, None: this
    one. InputError that names the row where its unit is of another dimension than its value."""
    check_units(rows)
    out = []
    for row in rows:
        values: list[float | None] = []
        problem = ""
        for metric in metrics_in(row.ours):
            known = figures.get(metric.mission)
            values.append(None if known is None else known.get(metric.key))
            if known is None:
                problem = f"{metric.mission} was not run"
            elif metric.key not in known:
                near = difflib.get_close_matches(metric.key, known, n=1)
                problem = f"no {metric.key} there" + (f", but {near[0]}" if near else "")
            elif known[metric.key] is None:
                problem = problem or f"{metric.key} has no value"
        value = None
        if None not in values:
            numbers = [float(v) for v in values if v is not None]
            if len(numbers) == 1:
                value = numbers[0] / scale_of(row.unit)
            elif numbers[1] != 0.0:
                value = numbers[0] / numbers[1] / scale_of(row.unit)
            else:
                problem = "divided by zero"
        out.append(Beside(row.what, row.printed, row.unit, row.ours, row.source, value, problem))
    return tuple(out)


def scale_of(unit: str) -> float:
    """What one ``unit`` is in SI (1 where it is empty). InputError for a text that is no unit."""
    return unit_in_base(unit)[0]


def check_unit(ours: str, unit: str) -> None:
    """InputError for a ``unit`` of another dimension than ``ours``: a ratio has that of the quotient. Without a unit
    the value stands in SI."""
    _, given = unit_in_base(unit)
    if not unit.strip():
        return
    units = [si_unit(metric.group, metric.name) for metric in metrics_in(ours)]
    mine = unit_in_base(units[0])[1]
    for below in units[1:]:
        mine = over(mine, unit_in_base(below)[1])
    if given != mine:
        named = " over ".join(text or "no unit" for text in units)
        wanted = f"a unit of {named}" if mine else "no unit, or % for a share"
        raise InputError(f"unit = {unit!r}: cannot be that of {ours!r}, which is in {named}; write {wanted}.")


@cache
def trial_names(cycles: int) -> tuple[str, ...]:
    """Names of the numbers that a trial of so many cycles has (some of them None in some trials)."""
    none = np.zeros(0)
    trial = Trial(
        joints=("a", "b"),
        kinds=("angle", "length"),
        t=none,
        base=none,
        q=none,
        torque=none,
        com=none,
        start_time=0.0,
        period=1.0,
        cycles=cycles,
        planned_advance=np.zeros((cycles, 3)),
    )
    return tuple(name for name in trial.metrics() if name not in ("status", "reason"))
