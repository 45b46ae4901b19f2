"""A sweep: a mission at every combination of some values of its fields."""

from __future__ import annotations

import itertools
import math
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.files import replacing
from bodyplan.job import plan_mission
from bodyplan.missions import Mission
from bodyplan.search.cluster import Job, pool
from bodyplan.search.fields import check_fields, labelled
from bodyplan.search.folder import PAGE, asked_of, folder_of, opened, settings_of, write_tables
from bodyplan.search.measures import Measure, measures_of
from bodyplan.search.parameters import Axis, axes_of
from bodyplan.search.payload import begun, key_of
from bodyplan.search.point import Row
from bodyplan.search.table import Table, table_of

#: most points of one sweep
MOST_POINTS = 100_000
#: most fields that vary
MOST_AXES = 12
#: how a caller hears of progress: points finished, points in all
Progress = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """Tells nobody."""


@dataclass(frozen=True)
class Point:
    """A combination: what is changed in the mission, and the values as a table shows them."""

    overrides: tuple[str, ...]
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Sweep:
    """A sweep of the mission ``mission`` over ``axes``; ``points`` and ``rows`` in the order of the grid, the last axis
    fastest. Of one that was stopped, those that are finished; ``total`` is how many there are in all."""

    mission: Mission
    axes: tuple[Axis, ...]
    measures: tuple[Measure, ...]
    points: tuple[Point, ...]
    rows: tuple[Row, ...]
    total: int
    folder: Path

    @property
    def complete(self) -> bool:
        """True where every point is finished."""
        return len(self.rows) == self.total

    @property
    def report(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def table(self) -> Table:
        """Columns by name: parameters, status, reason, figures."""
        return table_of([point.values for point in self.points], self.rows)

    def label(self, key: str) -> str:
        """A field with its SI unit."""
        return labelled(tomllib.loads(self.mission.text), key)

    def column(self, name: str) -> Array:
        """A numeric column of the table (points,), NaN where a point has no such figure. UnknownNameError for a name
        that no point has."""
        table = self.table
        if name not in table:
            raise UnknownNameError("column", name, table, where="sweep")
        return np.array([np.nan if value is None else value for value in table[name]], dtype=np.float64)

    def best(self, measure: Measure | None = None, *, lowest: bool = False) -> int | None:
        """Index of the point at which ``measure`` (default: the first one) is highest, or lowest, of those that are
        "ok"; None where there is none. The first of several in the order of the grid."""
        chosen = measure or self.measures[0]
        values = [chosen.of(row.figures) if row.ok else None for row in self.rows]
        found = [(i, value) for i, value in enumerate(values) if value is not None]
        if not found:
            return None
        sign = 1.0 if lowest else -1.0
        return min(found, key=lambda item: sign * item[1])[0]


def sweep(
    mission: Mission | str | Path,
    over: Mapping[str, Any] | Iterable[str],
    out: str | os.PathLike[str] | None = None,
    *,
    metrics: Iterable[str] = (),
    overrides: Sequence[str] = (),
    simulate: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Sweep:
    """Plan, check and simulate a mission at every combination of values of its fields; write table and report.

    ``over``: texts "gait.overlap=0:0.8:9", "ground.width=100 mm,120 mm", or a mapping from fields to such specs or to
    lists of values. ``metrics``: the figures that the report shows ("trial.speed"; the table has all). ``overrides``:
    texts "gait.omega=1.2" for all points. ``workers`` processes here (default: one a core), or the workers of the
    cluster at ``scheduler``. ``out``: the folder (default ``runs/sweep-<name>``); one in which the same sweep was
    stopped goes on, one of another search is refused unless ``force``.

    A point that fails is a row with its status and reason. Rows do not depend on the workers, their number or their
    order. Raises InputError for bad input; KeyboardInterrupt leaves the table of what is finished.
    """
    mission, payload, simulate = begun(mission, overrides, simulate)
    axes = axes_of(over)
    total = _bounded(axes)
    settings = settings_of(simulate)
    points = _points(axes)
    check_fields(
        payload, {axis.key: axis.values for axis in axes}, (point.overrides for point in points), simulate, "--over"
    )
    measures = chosen_measures(mission, metrics, simulate)
    folder = folder_of(out, "sweep", mission.name)
    asked = asked_of(
        "sweep", payload, simulate, over={axis.key: [value.shown for value in axis.values] for axis in axes}
    )
    keys = [key_of(payload, point.overrides, settings) for point in points]
    with opened(folder, asked, force) as store:
        found = {i: row for i, key in enumerate(keys) if (row := store.get(key)) is not None}
        progress(len(found), total)

        def finished() -> Sweep:
            order = sorted(found)
            made = Sweep(
                mission, axes, measures, tuple(points[i] for i in order), tuple(found[i] for i in order), total, folder
            )
            write(made, asked)
            return made

        index = {key: i for i, key in enumerate(keys)}
        missing: list[Job] = [(keys[i], points[i].overrides) for i in range(total) if i not in found]
        try:
            if missing:
                with pool(workers, scheduler) as ready:
                    for key, row in ready.rows(payload, missing, simulate):
                        i = index[key]
                        found[i] = row
                        store.add(key, row, points[i].values)
                        progress(len(found), total)
        except KeyboardInterrupt:
            finished()
            raise
        return finished()


def _bounded(axes: Sequence[Axis]) -> int:
    total = math.prod(len(axis.values) for axis in axes)
    if len(axes) > MOST_AXES:
        raise InputError(f"--over: {len(axes)} fields; at most {MOST_AXES} may vary.")
    if total > MOST_POINTS:
        sizes = " x ".join(str(len(axis.values)) for axis in axes)
        raise InputError(f"--over: {sizes} = {total} points are more than the {MOST_POINTS} allowed; optimise instead.")
    return total


def _points(axes: Sequence[Axis]) -> list[Point]:
    return [
        Point(
            tuple(value.override(axis.key) for axis, value in zip(axes, values, strict=True)),
            {axis.key: value.shown for axis, value in zip(axes, values, strict=True)},
        )
        for values in itertools.product(*(axis.values for axis in axes))
    ]


def chosen_measures(mission: Mission, metrics: Iterable[str], simulate: bool) -> tuple[Measure, ...]:
    """The measures that a user names, or those that tell most of a mission of this kind."""
    texts = [metrics] if isinstance(metrics, str) else list(metrics)
    if texts:
        return measures_of(texts, *known(mission, texts, simulate), simulate, "--metric")
    if simulate:
        return Measure(("trial.speed_m_s",)), Measure(("trial.advance_ratio",))
    facts, _ = known(mission, ["plan."], simulate)
    named = [name for name in ("speed", "advance", "peak_joint_rate") if name in facts] or list(facts)[:1]
    return tuple(Measure((f"plan.{name}",)) for name in named) or (Measure(("check.failed",)),)


def known(mission: Mission, texts: Iterable[str], simulate: bool) -> tuple[Sequence[str], int]:
    """Facts of the plan, where one of ``texts`` names any (the mission is planned then), and the trial's cycles."""
    cycles = mission.simulate.cycles if simulate and mission.simulate is not None else 1
    if not any("plan." in text for text in texts):
        return (), cycles
    return tuple(plan_mission(mission).facts), cycles


def write(made: Sweep, asked: Mapping[str, Any]) -> None:
    """Table and page, each whole."""
    from bodyplan.search.sweep_page import sweep_page

    write_tables(made.folder, made.table, asked)
    with replacing(made.report) as file:
        file.write(sweep_page(made))
