"""What a report shows: a motion with its checks, its trial, other missions' figures, and variants of the gait."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.check import Report
from bodyplan.motion import Motion
from bodyplan.rates import five_point

if TYPE_CHECKING:
    from bodyplan.simulate import Trial


@dataclass(frozen=True)
class Comparison:
    """Figures of another mission, run the same way: advance executed / planned, speeds in m/s, torque in N m."""

    name: str
    title: str
    ratio: float | None
    speed: float | None
    planned_speed: float | None
    peak_joint_rate: float
    peak_torque: float | None
    cost_of_transport: float | None
    status: str

    @classmethod
    def of(cls, name: str, title: str, motion: Motion, trial: Trial | None) -> Comparison:
        """The figures of a planned and simulated motion."""
        rate = float(np.abs(motion.qd).max(initial=0.0))
        planned = motion.facts.get("speed")
        if trial is None:
            return cls(name, title, None, None, planned, rate, None, None, "not simulated")
        metrics: dict[str, Any] = dict(trial.metrics())
        return cls(name, title, metrics["advance_ratio"], metrics["speed_m_s"], metrics["planned_speed_m_s"], rate,
                   metrics.get("peak_torque_Nm"), metrics["cost_of_transport"], trial.status)

    def to_dict(self) -> dict[str, Any]:
        """JSON types."""
        return dict(vars(self))


@dataclass(frozen=True)
class Variant:
    """Peak joint rate (rad/s) and acceleration (rad/s^2) of a variant of the gait: exact within smooth pieces, and by
    the paper's five-point formula at the motion's sampling, which also sees the jumps of the rates."""

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

    def to_dict(self) -> dict[str, Any]:
        """JSON types."""
        return dict(vars(self))


def five_point_rates(motion: Motion) -> tuple[Any, Any]:
    """Joint rates and accelerations (T, n) as the paper takes them: the five-point formula, once and twice."""
    h = float(np.diff(motion.t).mean())
    rate = five_point(motion.q, h)
    return rate, five_point(rate, h)


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

    @property
    def ok(self) -> bool:
        """True where every check passed and the physics, where it was run, did not diverge."""
        return self.report.ok and (self.trial is None or self.trial.ok)

    @property
    def itself(self) -> Comparison:
        """This run's own row beside the others."""
        return Comparison.of(self.name, self.title, self.motion, self.trial)
