"""metrics.json and its schema: every number of a run, for programs."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from bodyplan.show.outcome import Outcome, five_point_gaps

STRICT = ConfigDict(extra="forbid")


class Check(BaseModel):
    """One line of the judge's report."""

    model_config = STRICT
    what: str
    value: float | None
    limit: float | None
    unit: str
    at_least: bool
    passed: bool | None
    detail: str
    kind: str


class Other(BaseModel):
    """Figures of a mission, for comparison; speeds in m/s, torque in N m."""

    model_config = STRICT
    name: str
    title: str
    ratio: float | None
    speed: float | None
    planned_speed: float | None
    peak_joint_rate: float
    peak_torque: float | None
    cost_of_transport: float | None
    status: str


class VariantRow(BaseModel):
    """Peak rate and acceleration of a variant of the gait, exact and by the five-point formula."""

    model_config = STRICT
    label: str
    peak_rate: float
    peak_acceleration: float
    five_point_rate: float
    five_point_acceleration: float


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
    checks: list[Check]
    trial: dict[str, float | int | str | None] | None
    settings: dict[str, Any] | None
    warnings: list[str]
    compared: list[Other]
    variants: list[VariantRow]


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
        checks=[Check(**line.to_dict()) for line in outcome.report],
        trial=None if trial is None else trial.metrics(),
        settings=None if trial is None else dict(trial.settings),
        warnings=[] if trial is None else list(trial.warnings),
        compared=[Other(**other.to_dict()) for other in outcome.others],
        variants=[VariantRow(**variant.to_dict()) for variant in outcome.variants],
    )
