"""Trial: what physics made of a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from bodyplan.arrays import Array, frozen
from bodyplan.errors import SolveError, Status


@dataclass(frozen=True)
class Slip:
    """What frames did that the plan claims to be at rest, over one interval of one cycle.

    ``stage`` and ``label`` are those of the claim, ``start`` and ``end`` in s of the trial. ``along`` m:
    mean over the frames of their displacement along the planned advance (negative: slipped back).
    ``largest`` m: the farthest that any of them went from where it was at the start.
    """

    stage: str
    label: str
    cycle: int
    start: float
    end: float
    along: float
    largest: float


@dataclass(frozen=True)
class Lift:
    """How far frames rose that the plan claims to lift, over one interval of one cycle.

    ``stage`` and ``label`` are those of the claim, ``start`` and ``end`` in s of the trial. ``planned`` and
    ``executed`` m: the largest rise of a frame above the higher of its planned heights at start and end, the smallest
    over the frames. Negative where a frame never came up to where it was planned to stand.
    """

    stage: str
    label: str
    cycle: int
    start: float
    end: float
    planned: float
    executed: float


@dataclass(frozen=True, eq=False)
class Trial:
    """A motion as MuJoCo executed it. All arrays are read-only; quantities that do not exist are None.

    Records, every ``settings["record_dt"]`` s from the start of settling: ``t`` (S,) s; ``base`` (S, 7)
    pose of the base, wxyz; ``q`` (S, n) joint coordinates (contact angles of wheels: measured from the loads, as
    planned where there are none); ``torque`` (S, n) actuator torque N m or force N, 0 for passive joints; ``com``
    (S, 3) centre of mass.

    The measured part begins at ``start_time`` s and has ``cycles`` whole cycles of ``period`` s.
    ``planned_advance`` (cycles, 3) and ``advance`` (cycles, 3) m: displacement of the centre of mass a
    cycle. ``advance_ratios`` (cycles,): executed over planned, along the planned direction; None where none
    is planned. ``sideways`` (cycles,) m: horizontal, positive to the left of the planned direction.
    ``speed`` m/s: mean, along the planned direction. ``turned`` (cycles,) rad in (-pi, pi]: how far the base is
    turned about z from the planned one, mean over each cycle: a body may swing round while it starts and then keep
    its heading. ``yaw_ratio``: turn of the base about z, executed over planned; None where less than 0.1 rad is
    planned. ``tilt`` rad: largest angle between the planned and the executed z axis of the base. ``height_rms`` and
    ``height_max`` m: root mean square and largest size of executed less planned z of the base, at the same phase of
    the motion. ``slips`` and ``lifts``: see :class:`Slip` and :class:`Lift`.

    ``slip_angle`` rad in [0, pi/2]: atan2(sum of \\|v across\\|, sum of \\|v along\\|) of the velocities of the middles
    of those capsules that touch the ground, horizontal, across and along their axes, over the records of the
    measured part; lifted parts do not count. 0 for a body that follows its own path; None without capsules.

    Per joint, over the measured part and every time step: ``tracking_rms`` and ``tracking_max`` (n,) rad or
    m of target - executed, ``torque_rms`` and ``torque_peak`` (n,). ``positive_work`` J: sum over joints of
    the time integral of max(torque * rate, 0), what motors must give if nothing is won back in braking;
    ``absolute_work`` J: that of \\|torque * rate\\|. ``cost_of_transport``: positive work / (m g distance
    along the planned direction), None unless it advances.

    ``status`` "ok" or "diverged" with ``reason``; a diverged trial keeps its records up to there and has no
    measures. ``warnings``: what to know of the run. ``settings``: everything it was run with.
    """

    joints: tuple[str, ...]
    kinds: tuple[str, ...]
    t: Array
    base: Array
    q: Array
    torque: Array
    com: Array
    start_time: float
    period: float
    cycles: int
    planned_advance: Array
    advance: Array | None = None
    advance_ratios: Array | None = None
    sideways: Array | None = None
    speed: float | None = None
    turned: Array | None = None
    yaw_ratio: float | None = None
    tilt: float | None = None
    height_rms: float | None = None
    height_max: float | None = None
    slip_angle: float | None = None
    slips: tuple[Slip, ...] = ()
    lifts: tuple[Lift, ...] = ()
    tracking_rms: Array | None = None
    tracking_max: Array | None = None
    torque_rms: Array | None = None
    torque_peak: Array | None = None
    positive_work: float | None = None
    absolute_work: float | None = None
    cost_of_transport: float | None = None
    status: str = Status.OK.value
    reason: str = ""
    warnings: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))

    @property
    def ok(self) -> bool:
        """True unless the physics diverged."""
        return self.status == Status.OK.value

    @property
    def advance_ratio(self) -> float | None:
        """Advance executed / planned, mean over the cycles; None where none is planned or the run diverged."""
        return None if self.advance_ratios is None else float(self.advance_ratios.mean())

    @property
    def forward_ratio(self) -> float | None:
        """Like ``advance_ratio``, but along the planned direction turned by ``turned``: what the body makes of its own
        heading."""
        if self.advance_ratios is None or self.advance is None or self.turned is None:
            return None
        cos, sin = np.cos(self.turned), np.sin(self.turned)
        x, y, z = self.planned_advance.T
        ahead = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)
        return float(np.mean(np.sum(self.advance * ahead, axis=1) / np.sum(np.square(ahead), axis=1)))

    @property
    def peak_torque(self) -> float | None:
        """Largest torque (N m; force in N) of any joint in the measured part; None where the run diverged."""
        return None if self.torque_peak is None else float(self.torque_peak.max(initial=0.0))

    @property
    def lift_ratio(self) -> float | None:
        """Smallest rise executed / planned of all ``lifts``; None where none is planned or the run diverged."""
        return min((lift.executed / lift.planned for lift in self.lifts if lift.planned > 0.0), default=None)

    def slip_by_stage(self) -> dict[str, dict[str, float]]:
        """Stage -> ``along`` (m a cycle: summed over its claims, mean over cycles) and ``largest`` (m), in
        the order of the claims."""
        out: dict[str, dict[str, float]] = {}
        for slip in self.slips:
            row = out.setdefault(slip.stage, {"along": 0.0, "largest": 0.0})
            row["along"] += slip.along / len({s.cycle for s in self.slips if s.stage == slip.stage})
            row["largest"] = max(row["largest"], slip.largest)
        return out

    def metrics(self) -> dict[str, float | int | str | None]:
        """Flat and JSON-able; None where a quantity does not exist."""
        planned = float(np.linalg.norm(self.planned_advance[0]))
        out: dict[str, float | int | str | None] = {
            "status": self.status,
            "reason": self.reason,
            "warnings": len(self.warnings),
            "cycles": self.cycles,
            "period_s": self.period,
            "planned_advance_m": planned,
            "planned_speed_m_s": planned / self.period,
            "advance_m": None if self.speed is None else self.speed * self.period,
            "advance_ratio": self.advance_ratio,
            "forward_ratio": self.forward_ratio,
            "turned_rad": None if self.turned is None else float(self.turned[-1]),
            "yaw_ratio": self.yaw_ratio,
            "tilt_rad": self.tilt,
            "height_rms_m": self.height_rms,
            "height_max_m": self.height_max,
            "slip_angle_rad": self.slip_angle,
            "lift_ratio": self.lift_ratio,
            "sideways_m": None if self.sideways is None else float(self.sideways.mean()),
            "speed_m_s": self.speed,
        }
        for i in range(self.cycles):
            ratio = None if self.advance_ratios is None else float(self.advance_ratios[i])
            out[f"advance_ratio_cycle_{i + 1}"] = ratio
        for kind, unit, load in (("angle", "rad", "torque_Nm"), ("length", "m", "force_N")):
            mine = np.array([k == kind for k in self.kinds], dtype=bool)
            if mine.any():
                out[f"tracking_rms_{unit}"] = _root_mean_square(self.tracking_rms, mine)
                out[f"tracking_max_{unit}"] = _largest(self.tracking_max, mine)
                out[f"rms_{load}"] = _root_mean_square(self.torque_rms, mine)
                out[f"peak_{load}"] = _largest(self.torque_peak, mine)
        out["positive_work_J"] = self.positive_work
        out["absolute_work_J"] = self.absolute_work
        out["cost_of_transport"] = self.cost_of_transport
        for stage, row in self.slip_by_stage().items():
            out[f"slip_m.{stage}"] = row["along"]
            out[f"slip_largest_m.{stage}"] = row["largest"]
        return out

    def raise_if_failed(self) -> Trial:
        """This trial, or SolveError with the status and the reason."""
        if not self.ok:
            raise SolveError(self.status, self.reason)
        return self

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trial):
            return NotImplemented
        return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        ratio = "" if self.advance_ratio is None else f", advance {self.advance_ratio:.3g} of the plan"
        return f"Trial({self.status}, {self.cycles} cycles of {self.period:.3g} s{ratio})"


def _root_mean_square(values: Array | None, chosen: Any) -> float | None:
    return None if values is None else float(np.sqrt(np.mean(np.square(values[chosen]))))


def _largest(values: Array | None, chosen: Any) -> float | None:
    return None if values is None else float(np.max(values[chosen]))


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return isinstance(a, np.ndarray) and isinstance(b, np.ndarray) and np.array_equal(a, b)
    return bool(a == b)
