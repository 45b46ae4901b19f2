"""``bp.optimise``: the values of some fields of a mission that make a figure of it best, within bounds on others."""

from __future__ import annotations

import hashlib
import json
import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.missions import Mission
from bodyplan.missions.files import alone
from bodyplan.search.cluster import pool
from bodyplan.search.fields import check_fields, labelled, value_of, whole_fields
from bodyplan.search.folder import BEST, PAGE, asked_of, folder_of, opened, settings_of, write_tables
from bodyplan.search.measures import Bound, Measure, bound_of, measures_of
from bodyplan.search.parameters import Range, axes_of, ranges_of
from bodyplan.search.payload import begun, key_of
from bodyplan.search.point import Row
from bodyplan.search.studies import Objective, Study, Trial, feasible, quiet, sampler_named
from bodyplan.search.sweeps import Progress, known, silent
from bodyplan.search.table import Table, table_of
from bodyplan.units import unit_in_base

MOST_TRIALS = 100_000
MOST_BATCH = 4096
MOST_FIELDS = 50


@dataclass(frozen=True)
class Search:
    """An optimisation of ``mission`` over ``ranges``; ``trials`` by number, of one that was stopped those that are
    finished, of ``total``. ``front``: numbers of the trials that keep all bounds and that no other one beats in every
    objective. The first trial is the mission as it is, where its values are within the ranges."""

    mission: Mission
    ranges: tuple[Range, ...]
    objectives: tuple[Objective, ...]
    bounds: tuple[Bound, ...]
    trials: tuple[Trial, ...]
    front: tuple[int, ...]
    total: int
    folder: Path
    sampler: str

    @property
    def best(self) -> int | None:
        """Place of the best trial by the first objective of those that keep all bounds; None where none does."""
        first = self.objectives[0]
        found = [
            (value, i)
            for i, trial in enumerate(self.trials)
            if feasible(trial.row, self.bounds) and (value := first.measure.of(trial.row.figures)) is not None
        ]
        if not found:
            return None
        return min(found, key=lambda item: (-item[0] if first.maximise else item[0], item[1]))[1]

    def overrides(self, i: int) -> tuple[str, ...]:
        """What the trial at place ``i`` changes in the mission."""
        return tuple(value.override(one.key) for one, value in zip(self.ranges, self.trials[i].values, strict=True))

    @property
    def measures(self) -> tuple[Measure, ...]:
        """The figures that objectives and bounds are about, each once."""
        return tuple(dict.fromkeys([*(one.measure for one in self.objectives), *(one.measure for one in self.bounds)]))

    @property
    def complete(self) -> bool:
        """True where every trial is finished."""
        return len(self.trials) >= self.total

    @property
    def report(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def table(self) -> Table:
        """Columns by name: number, parameters, whether all bounds are kept, status, reason, figures."""
        parameters = [
            {"trial": t.number, **{one.key: value.shown for one, value in zip(self.ranges, t.values, strict=True)}}
            for t in self.trials
        ]
        kept = ["yes" if feasible(t.row, self.bounds) else "no" for t in self.trials]
        return table_of(parameters, [t.row for t in self.trials], {"feasible": kept})

    def label(self, key: str) -> str:
        """A field with its SI unit."""
        return labelled(tomllib.loads(self.mission.text), key)


def optimise(
    mission: Mission | str | Path,
    vary: Mapping[str, Any] | Iterable[str],
    *,
    maximise: str | Iterable[str] = (),
    minimise: str | Iterable[str] = (),
    subject_to: str | Iterable[str] = (),
    trials: int = 96,
    out: str | os.PathLike[str] | None = None,
    storage: str | None = None,
    sampler: str | None = None,
    seed: int = 0,
    batch: int = 8,
    overrides: Sequence[str] = (),
    simulate: bool = True,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    progress: Progress = silent,
) -> Search:
    """Search for the values of a mission's fields that make a figure best; write a study, a table, a report and, as
    best.toml, the best mission.

    ``vary``: texts "gait.overlap=0:0.8", "gait.omega=0.5:4:log", "gait.blend=linear,smooth", or a mapping from fields
    to such specs or to (low, high). ``maximise``, ``minimise``: figures ("trial.speed"); two of them give a front.
    ``subject_to``: bounds "trial.peak_torque<=1.2"; a point whose checks fail is out in any case, and is not executed,
    nor is one whose plan misses a bound. ``trials`` in all, in whole batches of ``batch``. ``sampler``: "tpe"
    (default), "cmaes", "nsga2" (default for two objectives), "random".
    ``storage``: any database URL that Optuna takes (default: study.db in the folder). What is found depends on
    ``seed`` and ``batch``, not on the workers. The rest as :func:`bodyplan.sweep`; the same call goes on where it was
    stopped, and one with more ``trials`` adds to them.
    """
    mission, payload, simulate = begun(mission, overrides, simulate)
    _numbers(trials, seed, batch)
    data = tomllib.loads(payload.text)
    vary = dict(vary) if isinstance(vary, Mapping) else [vary] if isinstance(vary, str) else list(vary)
    names = [str(item).partition("=")[0].strip() for item in vary]
    ranges = ranges_of(vary, whole_fields(data, names))
    if len(ranges) > MOST_FIELDS:
        raise InputError(f"--vary: {len(ranges)} fields; at most {MOST_FIELDS} may vary.")
    ends = {one.key: one.ends() for one in ranges}
    middle = [tuple(values[0].override(key) for key, values in ends.items())]
    check_fields(payload, ends, middle, simulate, "--vary")
    objectives, bounds = demands_of(mission, maximise, minimise, subject_to, simulate)
    # what is out already by its plan is not worth the physics
    first = tuple(bound for bound in bounds if bound.of_plan) if simulate else None
    settings = settings_of(simulate, first)
    chosen = sampler_named(sampler, objectives, ranges)
    total = -(-trials // batch) * batch
    folder = folder_of(out, "optimise", mission.name)
    asked = asked_of(
        "optimise",
        payload,
        simulate,
        vary={one.key: _said(one) for one in ranges},
        objectives=[one.text for one in objectives],
        subject_to=[one.text for one in bounds],
        sampler=chosen,
        seed=seed,
        batch=batch,
    )
    name = f"bodyplan-{mission.name}-{hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()[:12]}"
    with opened(folder, asked, force) as store, quiet(), ExitStack() as stack:
        url = storage or f"sqlite:///{(folder / 'study.db').absolute().as_posix()}"
        study = Study(
            url,
            name,
            ranges,
            objectives,
            bounds,
            sampler=chosen,
            seed=seed,
            batch=batch,
            start=starting(mission, ranges),
        )
        found: dict[int, Row] = {}

        def point(trial: Any) -> tuple[str, tuple[str, ...], dict[str, Any]]:
            """Key, changes and parameters of a trial."""
            values = study.values(trial)
            changed = tuple(value.override(one.key) for one, value in zip(ranges, values, strict=True))
            shown = {one.key: value.shown for one, value in zip(ranges, values, strict=True)}
            return key_of(payload, changed, settings), changed, shown

        def collect() -> None:
            """Rows of trials that are known already."""
            for trial in study.trials():
                if trial.number not in found:
                    row = store.get(point(trial)[0]) or study.remembered(trial)
                    if row is not None:
                        found[trial.number] = row

        def tell_progress() -> None:
            progress(min(len(found), total), total)

        def finished() -> Search:
            collect()
            trials = tuple(
                Trial(t.number, study.values(t), found[t.number]) for t in study.trials() if t.number in found
            )
            made = Search(mission, ranges, objectives, bounds, trials, study.front(), total, folder, chosen)
            write(made, asked)
            return made

        ready = None
        try:
            collect()
            tell_progress()
            while study.told() < total:
                under_way = {trial.number: (trial, *point(trial)) for trial in study.open_batch()}
                collect()
                missing = {key: (changed, shown) for n, (_, key, changed, shown) in under_way.items() if n not in found}
                if missing:
                    ready = ready or stack.enter_context(pool(workers, scheduler))
                    jobs = [(key, changed) for key, (changed, _) in missing.items()]
                    for key, row in ready.rows(payload, jobs, simulate, first):
                        store.add(key, row, missing[key][1])
                        found.update({n: row for n, (_, mine, _, _) in under_way.items() if mine == key})
                        tell_progress()
                for number, (trial, *_) in under_way.items():
                    study.tell(trial, found[number])
        except KeyboardInterrupt:
            finished()
            raise
        return finished()


def demands_of(
    mission: Mission,
    maximise: str | Iterable[str],
    minimise: str | Iterable[str],
    subject_to: str | Iterable[str],
    simulate: bool,
) -> tuple[tuple[Objective, ...], tuple[Bound, ...]]:
    """Objectives and bounds as a user names them."""
    highest, lowest, demands = (
        [texts] if isinstance(texts, str) else list(texts) for texts in (maximise, minimise, subject_to)
    )
    facts, cycles = known(mission, [*highest, *lowest, *demands], simulate)
    objectives = tuple(
        Objective(measure, option == "--maximise")
        for option, texts in (("--maximise", highest), ("--minimise", lowest))
        for measure in measures_of(texts, facts, cycles, simulate, option)
    )
    if not 1 <= len(objectives) <= 3:
        raise InputError(
            f"{len(objectives)} figures to optimise: give one, two or three with --maximise or --minimise; bounds go "
            "with --subject-to."
        )
    if len({one.measure for one in objectives}) < len(objectives):
        raise InputError(f"{objectives[0].measure.text}: cannot be made both largest and smallest.")
    return objectives, tuple(bound_of(text, facts, cycles, simulate) for text in demands)


def _numbers(trials: int, seed: int, batch: int) -> None:
    for name, value, low, high in (("trials", trials, 1, MOST_TRIALS), ("batch", batch, 1, MOST_BATCH),
                                   ("seed", seed, 0, 2**63 - 1)):  # fmt: skip
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"{name}: must be a whole number from {low} to {high}, got {value!r}.")


def _said(one: Range) -> Any:
    if one.choices:
        return [value.shown for value in one.choices]
    return [one.low, one.high, one.unit, "log" if one.log else "even", "whole" if one.whole else "real"]


def starting(mission: Mission, ranges: Sequence[Range]) -> dict[str, Any]:
    """The values that the mission itself has, its own or by default, where they are within the ranges; in their
    units."""
    data = tomllib.loads(mission.text)
    out: dict[str, Any] = {}
    for one in ranges:
        shown = _shown(value_of(data, one.key))
        if one.choices:
            if any(str(value.shown) == str(shown) for value in one.choices):
                out[one.key] = str(shown)
        elif isinstance(shown, (int, float)):
            number = shown / unit_in_base(one.unit)[0]
            if one.low <= number <= one.high:
                out[one.key] = int(number) if one.whole else float(number)
    return out


def _shown(found: Any) -> Any:
    """A value of a mission as a number in SI or a word; None for what is neither."""
    if found is None or isinstance(found, (dict, list)):
        return None
    return axes_of({"section.field": [found]})[0].values[0].shown


def write(made: Search, asked: Mapping[str, Any]) -> None:
    """Table, page and the best mission, each whole."""
    from bodyplan.search.study_page import study_page

    write_tables(made.folder, made.table, asked)
    best = made.best
    if best is not None:
        with replacing(made.folder / BEST) as file:
            file.write(alone(made.mission.text, made.mission.name, made.overrides(best)).text)
    with replacing(made.report) as file:
        file.write(study_page(made))
