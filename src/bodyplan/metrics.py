"""metrics.json and its schema: every number of a run, for programs."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from bodyplan.check import Line
from bodyplan.show.beside import Beside
from bodyplan.show.outcome import Comparison, Grid, Outcome, Variant, five_point_gaps

STRICT = ConfigDict(extra="forbid")


class Metrics(BaseModel):
    """All figures of a run; SI units, radians. ``plan`` are the planner's facts, ``trial`` the physics (None where
    it was not run; a value is None where it does not exist)."""

    model_config = STRICT
    format: Literal["bodyplan metrics 1"] = "bodyplan metrics 1"
    mission: str
    title: str
    overrides: list[str]
    verdict: Literal["ok", "failed"]
    versions: dict[str, str]
    samples: int
    duration_s: float
    statuses: dict[str, int]
    plan: dict[str, float]
    five_point: dict[str, float]
    checks: list[Line]
    trial: dict[str, float | int | str | None] | None
    settings: dict[str, Any] | None
    warnings: list[str]
    compared: list[Comparison]
    variants: list[Variant]
    grid: Grid | None = None
    paper: list[Beside] = []


def metrics_of(outcome: Outcome) -> Metrics:
    """The metrics of a run."""
    motion, trial = outcome.motion, outcome.trial
    statuses, counts = np.unique(motion.status, return_counts=True)
    return Metrics(
        mission=outcome.name,
        title=outcome.title,
        overrides=list(outcome.overrides),
        verdict="ok" if outcome.ok else "failed",
        versions=outcome.versions,
        samples=len(motion.t),
        duration_s=float(motion.t[-1] - motion.t[0]),
        statuses={str(s): int(n) for s, n in zip(statuses, counts, strict=True)},
        plan=dict(motion.facts),
        five_point=five_point_gaps(motion),
        checks=list(outcome.report),
        trial=None if trial is None else trial.metrics(),
        settings=None if trial is None else dict(trial.settings),
        warnings=[] if trial is None else list(trial.warnings),
        compared=list(outcome.others),
        variants=list(outcome.variants),
        grid=outcome.grid,
        paper=list(outcome.paper),
    )
