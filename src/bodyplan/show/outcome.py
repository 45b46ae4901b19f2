"""What a report shows: a motion with its checks, its trial, other missions' figures, and variants of the
gait."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module  # the package itself is above every floor and is looked up by name
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.check import Report
from bodyplan.motion import Motion
from bodyplan.rates import five_point
from bodyplan.show.beside import Beside

if TYPE_CHECKING:
    from bodyplan.simulate import Trial


@dataclass(frozen=True)
class Comparison:
    """Figures of another mission, run the same way: advance executed / planned, speeds in m/s, torque in N m, slip
    angle in rad, executed over no-slip speed, advance along the body's own heading over planned; ``figures``: every
    number of :func:`figures_of`. ``status`` "lost", with the ``reason``, where it could not be run."""

    name: str
    title: str
    ratio: float | None
    speed: float | None
    planned_speed: float | None
    peak_joint_rate: float | None
    peak_torque: float | None
    cost_of_transport: float | None
    status: str
    slip_angle: float | None = None
    no_slip_ratio: float | None = None
    forward_ratio: float | None = None
    figures: Mapping[str, float | None] = field(default_factory=dict)
    reason: str = ""

    @classmethod
    def lost(cls, name: str, title: str, reason: str) -> Comparison:
        """A mission that could not be run: no figures, but why."""
        return cls(name, title, None, None, None, None, None, None, "lost", reason=reason)

    @classmethod
    def of(cls, name: str, title: str, motion: Motion, trial: Trial | None) -> Comparison:
        """The figures of a planned and simulated motion."""
        rate = float(np.abs(motion.qd).max(initial=0.0))
        planned = motion.facts.get("speed")
        figures = figures_of(motion, trial)
        if trial is None:
            return cls(name, title, None, None, planned, rate, None, None, "not simulated", figures=figures)
        metrics: dict[str, Any] = dict(trial.metrics())
        return cls(
            name,
            title,
            metrics["advance_ratio"],
            metrics["speed_m_s"],
            metrics["planned_speed_m_s"],
            rate,
            metrics.get("peak_torque_Nm"),
            metrics["cost_of_transport"],
            trial.status,
            metrics.get("slip_angle_rad"),
            no_slip_ratio(motion, trial),
            metrics.get("forward_ratio"),
            figures,
        )


def figures_of(motion: Motion, trial: Trial | None) -> dict[str, float | None]:
    """Every number of a run by name: "plan." and a fact of the planner, "trial." and a measure of the physics (SI)."""
    out: dict[str, float | None] = {f"plan.{name}": value for name, value in motion.facts.items()}
    for name, value in ({} if trial is None else trial.metrics()).items():
        if not isinstance(value, str):
            out[f"trial.{name}"] = None if value is None else float(value)
    return out


def no_slip_ratio(motion: Motion, trial: Trial | None) -> float | None:
    """Executed speed over the speed of a body that does not slip; None where the plan names none (its fact
    ``no_slip_speed``) or nothing was executed."""
    speed = motion.facts.get("no_slip_speed")
    if trial is None or trial.speed is None or not speed:
        return None
    return trial.speed / speed


@dataclass(frozen=True)
class GridPoint:
    """One mission at one value of a grid: figures as those of a :class:`Comparison`; ``status`` "ok", that of the plan
    or of the physics, "refused", "failed" or "lost", with the ``reason``."""

    mission: str
    value: float
    status: str
    reason: str = ""
    advance_ratio: float | None = None
    speed: float | None = None
    no_slip_ratio: float | None = None
    peak_torque: float | None = None
    cost_of_transport: float | None = None
    slip_angle: float | None = None
    forward_ratio: float | None = None


@dataclass(frozen=True)
class Grid:
    """Missions at each of ``values`` of the field ``key``; ``points`` mission by mission, this one first."""

    key: str
    label: str
    values: tuple[float, ...]
    missions: tuple[str, ...]
    points: tuple[GridPoint, ...]

    def of(self, mission: str) -> list[GridPoint]:
        """The points of one mission, in the order of the values."""
        return [point for point in self.points if point.mission == mission]


@dataclass(frozen=True)
class Variant:
    """Peak joint rate (rad/s) and acceleration (rad/s^2) of a variant of the gait: exact within smooth
    pieces, and by the paper's five-point formula at the motion's sampling, which also sees the jumps of the
    rates."""

    label: str
    peak_rate: float
    peak_acceleration: float
    five_point_rate: float
    five_point_acceleration: float

    @classmethod
    def of(cls, label: str, motion: Motion) -> Variant:
        """Measured on a motion with even samples."""
        rate, acceleration = five_point_rates(motion)
        return cls(label, *(float(np.abs(a).max(initial=0.0)) for a in (motion.qd, motion.qdd, rate, acceleration)))


def five_point_rates(motion: Motion) -> tuple[Any, Any]:
    """Joint rates and accelerations (T, n) as the paper takes them: the five-point formula, once and
    twice."""
    h = float(np.diff(motion.t).mean())
    rate = five_point(motion.q, h)
    return rate, five_point(rate, h)


def five_point_gaps(motion: Motion) -> dict[str, float]:
    """How far the five-point formula is from the exact rates (rad/s) and accelerations (rad/s^2), rms and
    largest; empty where the samples are fewer than five or uneven, or there are no joints."""
    step = np.diff(motion.t)
    if len(motion.t) < 5 or motion.q.size == 0 or np.ptp(step) > 1e-6 * step.mean():
        return {}
    out = {}
    for name, taken, exact in zip(
        ("rate", "acceleration"), five_point_rates(motion), (motion.qd, motion.qdd), strict=True
    ):
        out[f"{name}_gap_rms"] = float(np.sqrt(np.mean((taken - exact) ** 2)))
        out[f"{name}_gap_max"] = float(np.abs(taken - exact).max())
    return out


@dataclass(frozen=True)
class Outcome:
    """Everything that a run found out."""

    name: str
    title: str
    about: str
    mission_text: str
    overrides: tuple[str, ...]
    motion: Motion
    report: Report
    trial: Trial | None = None
    others: tuple[Comparison, ...] = ()
    variants: tuple[Variant, ...] = ()
    grid: Grid | None = None
    paper: tuple[Beside, ...] = ()

    @property
    def ok(self) -> bool:
        """True where every check passed and the physics, where it was run, did not diverge."""
        return self.report.ok and (self.trial is None or self.trial.ok)

    @property
    def itself(self) -> Comparison:
        """This run's own row beside the others."""
        return Comparison.of(self.name, self.title, self.motion, self.trial)

    @property
    def versions(self) -> dict[str, str]:
        """Versions of what made the numbers."""
        versions = {"bodyplan": str(import_module("bodyplan").__version__)}
        versions |= {"python": platform.python_version(), "numpy": np.__version__}
        if self.trial is not None and "mujoco" in self.trial.settings:
            versions["mujoco"] = str(self.trial.settings["mujoco"])
        return versions
