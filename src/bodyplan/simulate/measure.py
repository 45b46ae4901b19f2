"""From records of a run to the measures of a trial."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.motion import Claim, Motion
from bodyplan.simulate.friction import UPRIGHT
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.model import Physics
from bodyplan.simulate.reference import Reference
from bodyplan.simulate.trial import Lift, Slip
from bodyplan.spatial.rotations import conjugate, multiply, rotate

#: planned advance a cycle below which a motion is not meant to go anywhere, m
NOWHERE = 1e-9
#: planned turn below which a motion is not meant to turn, rad, and horizontal part of the base's x axis below which it
#: has no heading
STRAIGHT, NO_HEADING = 0.1, 0.1
#: s: the shortest flight; a body that falls as long has hopped a millimetre high
HOP = 0.03


class Meter:
    """Sums over time steps of the servos' error, torque and work; u actuators."""

    def __init__(self, u: int) -> None:
        self.steps = 0
        self.error_square, self.error_most = np.zeros(u), np.zeros(u)
        self.force_square, self.force_most = np.zeros(u), np.zeros(u)
        self.positive, self.absolute = np.zeros(u), np.zeros(u)
        self._a = np.zeros(u)

    def add(self, target: Array, length: Array, velocity: Array, force: Array) -> None:
        """One time step; every argument (u,), all at the same instant."""
        a = self._a
        np.subtract(target, length, out=a)
        np.abs(a, out=a)
        np.maximum(self.error_most, a, out=self.error_most)
        self.error_square += a * a
        np.abs(force, out=a)
        np.maximum(self.force_most, a, out=self.force_most)
        self.force_square += a * a
        np.multiply(force, velocity, out=a)
        self.positive += np.maximum(a, 0.0)
        self.absolute += np.abs(a)
        self.steps += 1

    def per_joint(self, physics: Physics) -> dict[str, Array]:
        """Measures (n,) for Trial, 0 for passive joints."""
        count = max(self.steps, 1)
        columns = {
            "tracking_rms": np.sqrt(self.error_square / count),
            "tracking_max": self.error_most,
            "torque_rms": np.sqrt(self.force_square / count),
            "torque_peak": self.force_most,
        }
        out = {name: np.zeros(physics.robot.n) for name in columns}
        for name, values in columns.items():
            out[name][physics.servos] = values
        return out


class Sliding:
    """Horizontal speeds along and across the axes of the capsules that touch the ground, summed over records."""

    def __init__(self, physics: Physics) -> None:
        mj, model = mujoco(), physics.model
        self.geoms = np.flatnonzero((model.geom_type == mj.mjtGeom.mjGEOM_CAPSULE) & (model.geom_bodyid > 0))
        self.bodies = model.geom_bodyid[self.geoms]
        self.ground = physics.solid_geoms
        self.along, self.across = 0.0, 0.0

    def add(self, data: Any) -> None:
        """The state of ``data``, whose contacts and velocities must be those of one instant."""
        pairs = data.contact.geom[: data.ncon]
        touching = pairs[np.isin(pairs, self.ground).any(axis=1)]
        mine = np.isin(self.geoms, touching)
        if not mine.any():
            return
        geoms, moving = self.geoms[mine], data.cvel[self.bodies[mine]]
        # spatial velocity (omega, v) at the robot's centre of mass, and the way from there
        away = data.geom_xpos[geoms] - data.subtree_com[1]
        velocity = (moving[:, 3:] + np.cross(moving[:, :3], away))[:, :2]
        axis = data.geom_xmat[geoms].reshape(-1, 3, 3)[:, :2, 2]
        size = np.linalg.norm(axis, axis=1)
        upright = size < UPRIGHT  # no horizontal axis to slip across
        ahead = axis / np.maximum(size, UPRIGHT)[:, None]
        self.along += float(np.abs((velocity * ahead).sum(axis=1))[~upright].sum())
        self.across += float(np.abs(velocity[:, 1] * ahead[:, 0] - velocity[:, 0] * ahead[:, 1])[~upright].sum())

    @property
    def angle(self) -> float | None:
        """rad in [0, pi/2], or None where nothing slid."""
        return float(np.arctan2(self.across, self.along)) if self.along + self.across > 0.0 else None


class Airborne:
    """Time steps without contact with the ground, in flights of at least :data:`HOP`: stiff contacts chatter, and what
    slides fast hops a little."""

    def __init__(self, physics: Physics) -> None:
        self.steps, self.longest = 0, 0
        self._least, self._now = math.ceil(HOP / physics.model.opt.timestep), 0
        self._ground = physics.solid_geoms
        pairs = np.stack([physics.model.pair_geom1, physics.model.pair_geom2], axis=-1)
        self._elsewhere = not np.isin(pairs, self._ground).any(axis=-1).all()

    def add(self, data: Any) -> None:
        """The contacts of one time step."""
        if data.ncon and (not self._elsewhere or np.isin(data.contact.geom[: data.ncon], self._ground).any()):
            self._now = 0
            return
        self._now += 1
        if self._now >= self._least:
            self.steps += self._least if self._now == self._least else 1
            self.longest = max(self.longest, self._now)


@dataclass(frozen=True, eq=False)
class Records:
    """What a run recorded: t (S,), base (S, 7), q (S, n), torque (S, n), com (S, 3)."""

    t: Array
    base: Array
    q: Array
    torque: Array
    com: Array


def planned_advance(physics: Physics, reference: Reference, cycles: int) -> Array:
    """Planned displacement (cycles, 3) m of the centre of mass in each cycle."""
    mj = mujoco()
    data = mj.MjData(physics.model)
    centres = []
    for cycle in range(cycles + 1):
        phase = cycle * reference.duration
        data.qpos[:] = physics.qpos(reference.joints(phase), reference.base(phase))
        mj.mj_kinematics(physics.model, data)
        mj.mj_comPos(physics.model, data)
        centres.append(data.subtree_com[1].copy())
    return np.diff(np.array(centres), axis=0)


def progress_of(records: Records, planned: Array, start: float, period: float) -> dict[str, Any]:
    """``advance``, ``advance_ratios``, ``sideways`` and ``speed`` for Trial."""
    cycles = len(planned)
    centres = at(records.t, records.com, start + period * np.arange(cycles + 1.0))
    advance = np.diff(centres, axis=0)
    ahead = directions(planned)
    along = np.sum(advance * ahead, axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0], 0.0 * ahead[:, 0]], axis=1)
    size = np.linalg.norm(planned, axis=1)
    return {
        "advance": advance,
        "advance_ratios": along / size if np.all(size > NOWHERE) else None,
        "sideways": np.sum(advance * left, axis=1),
        "speed": float(along.sum() / (cycles * period)),
    }


def turned_of(
    records: Records, reference: Reference, phase: Callable[[Array], Array], start: float, period: float, cycles: int
) -> Array:
    """Turn (cycles,) rad about z from the planned base to the executed one, mean over the records of each cycle."""
    out = np.zeros(cycles)
    for cycle in range(cycles):
        first = start + cycle * period
        some = np.flatnonzero((records.t >= first) & (records.t <= first + period))
        some = some[:: max(1, len(some) // 100)]
        planned = reference.bases(phase(records.t[some]))[:, 3:]
        w, _, _, z = multiply(records.base[some, 3:], conjugate(planned)).T
        # turning by the double angle makes q and -q one, and means of angles well defined
        out[cycle] = np.angle(np.sum((w + 1j * z) ** 2))
    return out


def yaw_ratio_of(records: Records, reference: Reference, phase: Callable[[Array], Array], start: float) -> float | None:
    """Turn of the base about z from ``start`` s to the end, executed over planned; None where less than
    :data:`STRAIGHT` is planned, or where the base's x axis comes near the vertical."""
    some = records.t >= start - 1e-9
    ways = []
    for base in (records.base[some], reference.bases(phase(records.t[some]))):
        x, y, _ = rotate(base[:, 3:], np.array([1.0, 0.0, 0.0])).T
        if np.hypot(x, y).min(initial=np.inf) < NO_HEADING:
            return None
        heading = np.unwrap(np.arctan2(y, x))
        ways.append(float(heading[-1] - heading[0]))
    executed, planned = ways
    return executed / planned if abs(planned) >= STRAIGHT else None


def directions(planned: Array) -> Array:
    """Unit vectors (cycles, 3) of the planned advance; x where none is planned."""
    size = np.linalg.norm(planned, axis=1, keepdims=True)
    return np.where(size > NOWHERE, planned / np.maximum(size, NOWHERE), np.array([1.0, 0.0, 0.0]))


def tilt_of(records: Records, reference: Reference, phase: Callable[[Array], Array], start: float) -> float:
    """Largest angle rad from ``start`` s on between the planned and the executed z axis of the base."""
    some = records.t >= start - 1e-9
    up = np.array([0.0, 0.0, 1.0])
    planned = rotate(reference.bases(phase(records.t[some]))[:, 3:], up)
    executed = rotate(records.base[some, 3:], up)
    sine = np.linalg.norm(np.cross(planned, executed), axis=1)
    return float(np.max(np.arctan2(sine, np.sum(planned * executed, axis=1)), initial=0.0))


def height_of(
    records: Records, reference: Reference, phase: Callable[[Array], Array], start: float
) -> tuple[float, float]:
    """Executed less planned z of the base from ``start`` s on: (root mean square, largest size) m."""
    some = records.t >= start - 1e-9
    error = records.base[some, 2] - reference.bases(phase(records.t[some]))[:, 2]
    return float(np.sqrt(np.mean(np.square(error)))), float(np.max(np.abs(error)))


def slips_of(
    motion: Motion, records: Records, planned: Array, time_of: Callable[[float], float], period: float
) -> tuple[Slip, ...]:
    """What the ``at_rest`` claims of the motion became, cycle by cycle. ``time_of``: s of the trial at
    which the motion reaches a phase (s since its first sample). Intervals that end after the records are
    left out."""
    claims = [claim for claim in motion.claims if claim.kind == "at_rest"]
    if not claims:
        return ()
    positions = motion.robot.forward(records.q, records.base).positions
    ahead = directions(planned)
    out = []
    for claim in claims:
        tracks = positions[:, [motion.robot.frame_index(name) for name in claim.data["frames"]]]
        for cycle, times in _intervals(motion, claim, records, time_of, period, len(planned)):
            moved = at(records.t, tracks, times)
            moved -= moved[0].copy()
            along = float(np.mean(moved[-1] @ ahead[cycle]))
            largest = float(np.max(np.linalg.norm(moved, axis=-1)))
            stage = str(claim.data.get("stage", claim.label))
            out.append(Slip(stage, claim.label, cycle, float(times[0]), float(times[-1]), along, largest))
    return tuple(out)


def lifts_of(
    motion: Motion,
    records: Records,
    reference: Reference,
    phase: Callable[[Array], Array],
    time_of: Callable[[float], float],
    period: float,
    cycles: int,
) -> tuple[Lift, ...]:
    """What the ``lifted`` claims of the motion became, cycle by cycle, as :func:`slips_of`. ``phase``: that of the
    motion at times (k,) of the trial. Intervals without a record inside are left out."""
    claims = [claim for claim in motion.claims if claim.kind == "lifted"]
    if not claims:
        return ()
    robot = motion.robot
    heights = robot.forward(records.q, records.base).positions[..., 2]
    out = []
    for claim in claims:
        frames = [robot.frame_index(name) for name in claim.data["frames"]]
        for cycle, times in _intervals(motion, claim, records, time_of, period, cycles):
            if len(times) < 3:
                continue
            phases = phase(times)
            plan = robot.forward(reference.joints(phases), reference.bases(phases)).positions[:, frames, 2]
            stood = np.maximum(plan[0], plan[-1])
            made = at(records.t, heights[:, frames], times)
            planned, executed = (float((z - stood).max(axis=0).min()) for z in (plan, made))
            stage = str(claim.data.get("stage", claim.label))
            out.append(Lift(stage, claim.label, cycle, float(times[0]), float(times[-1]), planned, executed))
    return tuple(out)


def _intervals(
    motion: Motion, claim: Claim, records: Records, time_of: Callable[[float], float], period: float, cycles: int
) -> Iterator[tuple[int, Array]]:
    """(cycle, times (k,) s): the interval of a claim in every cycle of the trial, its start and end and the records
    between them."""
    last = float(records.t[-1]) + 1e-9 * period
    start, end = (float(claim.data[key]) - float(motion.t[0]) for key in ("start", "end"))
    # a window before the first sample comes again a period later; one that is cut in two is left out
    every = float(claim.data.get("every") or np.inf)
    if start < -1e-9 and np.isfinite(every):
        later = np.ceil(-start / every - 1e-9) * every
        start, end = start + later, end + later
    if start < -1e-9:
        return
    begin, stop = time_of(max(start, 0.0)), time_of(end)
    for cycle in range(cycles):
        t0, t1 = begin + cycle * period, stop + cycle * period
        if t0 < t1 <= last:
            between = records.t[(records.t > t0) & (records.t < t1)]
            yield cycle, np.concatenate([[t0], between, [t1]])


def at(t: Array, values: Array, times: Array) -> Array:
    """``values`` (S, ...) recorded at ``t`` (S,), linear between records, at ``times`` (k,)."""
    i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 2)
    s = np.clip((times - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0)
    s = s.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values[i] + s * (values[i + 1] - values[i]))


def cost_of_transport(work: float, weight: float, distance: float) -> float | None:
    """work / (weight distance) without unit, or None where nothing was travelled."""
    return work / (weight * distance) if distance > 0.0 else None
