"""One point of a search: the mission with some fields changed is planned, checked and simulated; a row comes out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from time import perf_counter
from typing import Any

import numpy as np

from bodyplan.check import Report, check
from bodyplan.errors import BodyplanError
from bodyplan.job import plan_mission, simulate_mission
from bodyplan.missions import Mission
from bodyplan.missions.files import model_section
from bodyplan.motion import Motion
from bodyplan.search.measures import Bound
from bodyplan.search.payload import Payload
from bodyplan.show.outcome import figures_of

#: statuses of points that may turn out otherwise the next time: they are tried again when a search goes on
PASSING = ("lost",)
#: the plan misses a bound already
OUT_OF_BOUNDS = "out_of_bounds"


@dataclass(frozen=True)
class Row:
    """What became of one point. ``status``: "ok", "check_failed", the status of a plan or of a trial that failed,
    "refused" (bad input), "failed" (an error of another kind), "out_of_bounds" (the plan misses a bound of the search)
    or "lost" (its process ended), with the ``reason``.
    ``figures``: its numbers by name, "plan.", "check." or "trial." first; ``seconds`` it took."""

    status: str
    reason: str = ""
    figures: Mapping[str, float | None] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """True where the plan, all checks and the physics are well."""
        return self.status == "ok"


def evaluate(
    payload: Payload, overrides: Sequence[str], simulate: bool = True, bounds: Sequence[Bound] | None = None
) -> Row:
    """The row of the mission with ``overrides``. Nothing is raised: what goes wrong is its status. With ``bounds`` (on
    figures of plan and checks), physics is left out where a check fails or the plan misses one of them."""
    start = perf_counter()
    row = _row(payload, tuple(overrides), simulate, bounds)
    return Row(row.status, row.reason, row.figures, perf_counter() - start)


def _row(payload: Payload, overrides: tuple[str, ...], simulate: bool, bounds: Sequence[Bound] | None) -> Row:
    figures: dict[str, float | None] = {}
    try:
        mission = payload.mission(overrides)
        # a field of the physics leaves the plan as it is
        planned = tuple(item for item in overrides if model_section(item.partition("=")[0]) != "simulate")
        motion, report = _planned(_Planned(payload, planned, None if planned != overrides else mission))
        figures |= {f"plan.{name}": _finite(value) for name, value in motion.facts.items()}
        if not motion.ok:
            first = int(np.flatnonzero(motion.status != "ok")[0])
            why = "".join(f"; {note}" for note in motion.notes[-1:])  # planners put what failed last
            return Row(str(motion.status[first]), f"the plan, at t = {motion.t[first]:.4g} s{why}", figures)
        figures["check.passed"] = float(sum(line.passed is True for line in report))
        figures["check.failed"] = float(len(report.failures))
        missed = [bound for bound in bounds or () if (bound.excess(figures) or 0.0) > 0.0]
        if simulate and not missed and (report.ok or bounds is None):
            trial = simulate_mission(mission, motion)
            figures |= {name: _finite(value) for name, value in figures_of(motion, trial).items()}
            if trial is not None and not trial.ok:
                return Row(trial.status, trial.reason, figures)
    except BodyplanError as error:
        return Row("refused", str(error), figures)
    except Exception as error:  # one point that fails in a way of its own must not cost the others
        return Row("failed", f"{type(error).__name__}: {error}", figures)
    if not report.ok:
        return Row("check_failed", "; ".join(str(line) for line in report.failures[:5]), figures)
    if missed:
        said = " and ".join(f"{bound.text} with {bound.measure.of(figures):.6g}" for bound in missed)
        return Row(OUT_OF_BOUNDS, f"the plan misses {said}; not executed", figures)
    return Row("ok", "", figures)


@dataclass(frozen=True)
class _Planned:
    """A mission to plan, read already or not; two are equal where payload and changes are."""

    payload: Payload = field(compare=False)
    overrides: tuple[str, ...]
    mission: Mission | None = field(compare=False)
    content: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "content", self.payload.content)


@lru_cache(maxsize=4)
def _planned(asked: _Planned) -> tuple[Motion, Report]:
    motion = plan_mission(asked.mission or asked.payload.mission(asked.overrides))
    return motion, (check(motion) if motion.ok else Report(()))


def _finite(value: Any) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
