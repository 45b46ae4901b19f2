"""The loop over time steps: targets, scales, walls, records, and a watch for divergence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.measure import Airborne, Meter, Records, Sliding
from bodyplan.simulate.model import Physics
from bodyplan.simulate.reference import Reference
from bodyplan.simulate.start import CLOSING, Walls

#: norm of all velocities (rad/s and m/s) beyond which the physics has left the real world
RUNAWAY = 1e4
#: time steps whose targets are computed at once
BLOCK = 1000
#: share of the time in the air from which on it is worth a warning
AIRBORNE = 0.01


@dataclass(frozen=True)
class Timing:
    """When what happens, in s: settle, then ramp, then (periodic) the measured cycles of ``span`` s.

    A motion that runs once has its ramp inside the measured part, which then lasts half a ramp longer.
    ``every``: time steps between records.
    """

    dt: float
    settle: float
    ramp: float
    span: float
    cycles: int
    every: int
    periodic: bool

    @classmethod
    def of(
        cls, reference: Reference, cycles: int, *, dt: float, settle: float, ramp: float, record_dt: float
    ) -> Timing:
        """The timing of ``cycles`` runs through the reference."""
        periodic = reference.period is not None
        # whole time steps, so that the phases do not depend on rounding
        settle, ramp = (round(x / dt) * dt for x in (settle, ramp))
        span = reference.duration if periodic else reference.duration + 0.5 * ramp
        return cls(dt, settle, ramp, span, cycles, max(1, round(record_dt / dt)), periodic)

    @property
    def start_time(self) -> float:
        """s at which the measured part begins."""
        return self.settle + (self.ramp if self.periodic else 0.0)

    @property
    def steps(self) -> int:
        """Number of time steps."""
        return int(np.ceil((self.start_time + self.cycles * self.span) / self.dt - 1e-6))

    @property
    def first_phase(self) -> float:
        """Phase in which the robot settles."""
        return -0.5 * self.ramp if self.periodic else 0.0

    def phase(self, t: Array) -> Array:
        """Phase of the motion (s) at times t (...,): at rest, then evenly speeding up over the ramp, then
        even."""
        s = np.maximum(t - self.settle, 0.0)
        ramp = max(self.ramp, 1e-300)
        return np.asarray(self.first_phase + np.where(s < self.ramp, 0.5 * s * s / ramp, s - 0.5 * self.ramp))

    def time_of(self, phase: float) -> float:
        """s at which the motion reaches a phase >= 0."""
        late = phase - self.first_phase
        if late < 0.5 * self.ramp:
            return self.settle + float(np.sqrt(2.0 * self.ramp * late))
        return self.settle + late + 0.5 * self.ramp


class Run:
    """One run of a compiled model through a reference."""

    def __init__(
        self,
        physics: Physics,
        data: Any,
        reference: Reference,
        timing: Timing,
        walls: Walls,
        report: Callable[[float], None] | None,
    ) -> None:
        self.physics, self.data, self.reference = physics, data, reference
        self.timing, self.walls, self.report = timing, walls, report
        self.meter, self.sliding = Meter(len(physics.servos)), Sliding(physics)
        self.failure = ""
        size = timing.steps // timing.every + 2
        model = physics.model
        self._qpos = np.zeros((size, model.nq))
        self._t, self._com, self._force = np.zeros(size), np.zeros((size, 3)), np.zeros((size, model.nu))
        self._touch = np.zeros((size, len(physics.wheels.pointers)))
        self.airborne, self._count = Airborne(physics), 0

    def go(self) -> None:
        """Run to the end, or until the physics diverges (then ``failure`` says how)."""
        mj, model, data, timing = mujoco(), self.physics.model, self.data, self.timing
        model.opt.disableflags |= int(mj.mjtDisableBit.mjDSBL_AUTORESET)  # a lost state must stay visible
        step, scales, meter, airborne = mj.mj_step, self.physics.scales, self.meter, self.airborne
        ctrl, qvel = data.ctrl, data.qvel
        length, velocity, force = data.actuator_length, data.actuator_velocity, data.actuator_force
        closing = round(CLOSING * timing.settle / timing.dt) if self.walls.depth > 0.0 else 0
        self.walls.close(model, 0.0 if closing else 1.0)
        measured, every, fastest = round(timing.start_time / timing.dt), timing.every, RUNAWAY**2
        mj.mj_forward(model, data)
        for k in range(timing.steps):
            if k % BLOCK == 0:
                targets = self._targets(k)
                if self.report is not None:
                    self.report(k / timing.steps)
            if k <= closing and closing:
                self.walls.close(model, k / closing)
            ctrl[:] = targets[k % BLOCK]
            if scales is not None:
                scales.update(model, data)
            if k % every:
                step(model, data)
            else:
                self._qpos[self._count] = data.qpos
                step(model, data)
                self._record(k * timing.dt)
            airborne.add(data)
            if not qvel.dot(qvel) < fastest:  # also catches NaN
                self.failure = self._diverged()
                return
            if k >= measured:
                # MuJoCo leaves these as they were at the beginning of the step
                meter.add(ctrl, length, velocity, force)
        self._qpos[self._count] = data.qpos
        mj.mj_forward(model, data)
        self._record(timing.steps * timing.dt)
        if self.report is not None:
            self.report(1.0)

    def records(self) -> Records:
        """What was recorded."""
        s, n = self._count, self.physics.robot.n
        torque = np.zeros((s, n))
        torque[:, self.physics.servos] = self._force[:s]
        return Records(self._t[:s], self._qpos[:s, :7], self._joints(), torque, self._com[:s])

    def _joints(self) -> Array:
        """Recorded joint coordinates (s, n). Contact angles are outcomes: they are as measured."""
        s, wheels = self._count, self.physics.wheels
        q = self.physics.q(self._qpos[:s])
        columns = [pointer.column for pointer in wheels.pointers]
        if columns and s:
            planned = self.reference.joints(self.timing.phase(self._t[:s]))[:, columns]
            q[:, columns] = wheels.angles(self._touch[:s], planned)
        return q

    def warnings(self) -> list[str]:
        """What to know of the run."""
        robot, found, s = self.physics.robot, list[str](), self._count
        if s == 0:
            return found
        q, force = self._joints(), self._force[:s]
        for i, column in enumerate(self.physics.servos):
            name, effort = robot.joints[column], robot.efforts[column]
            full = 100.0 * float(np.mean(np.abs(force[:, i]) >= effort * (1.0 - 1e-9)))
            if full > 0.0:
                found.append(f"servo of joint {name!r} is at its effort {effort:.4g} for {full:.1f} % of the time")
        low, high = robot.limits.T
        for column in np.flatnonzero(np.any((q < low) | (q > high), axis=0)):
            found.append(f"joint {robot.joints[column]!r} is pushed against its limit")
        air, longest = (steps * self.timing.dt for steps in (self.airborne.steps, self.airborne.longest))
        part = air / float(self._t[s - 1] or 1.0)
        if part > AIRBORNE:
            found.append(f"in the air for {100.0 * part:.1f} % of the time, for up to {longest:.2g} s at a stretch")
        slack = self.physics.coupling_error(self._qpos[:s])
        if slack > 1e-3:
            what = "slides of wheels" if self.physics.wheels.rings else "axes that share a joint"
            found.append(f"{what} are out of step by up to {slack:.2g} rad or m")
        if self.walls.depth > 0.0 and self.timing.settle == 0.0:
            found.append(f"without settling the run begins {1e3 * self.walls.depth:.2g} mm inside the walls")
        return found

    def _targets(self, first: int) -> Array:
        """(BLOCK, u) targets of the servos from time step ``first`` on."""
        t = (first + np.arange(float(BLOCK))) * self.timing.dt
        return self.reference.joints(self.timing.phase(t))[:, self.physics.servos]

    def _record(self, t: float) -> None:
        i, data = self._count, self.data
        self._t[i], self._com[i], self._force[i] = t, data.subtree_com[1], data.actuator_force
        self._touch[i] = self.physics.wheels.directions(data)
        if t >= self.timing.start_time:
            self.sliding.add(data)
        self._count = i + 1

    def _diverged(self) -> str:
        qvel, model = self.data.qvel, self.physics.model
        worst = int(np.argmax(np.where(np.isfinite(qvel), np.abs(qvel), np.inf)))
        name = model.joint(model.dof_jntid[worst]).name
        # records after the last finite state do not exist
        good = np.isfinite(self._qpos[: self._count]).all(axis=1) & np.isfinite(self._com[: self._count]).all(axis=1)
        good &= np.isfinite(self._force[: self._count]).all(axis=1)
        self._count = int(np.argmin(good)) if not good.all() else self._count
        return f"at t = {self.data.time:.4g} s the velocity of joint {name!r} is {qvel[worst]:.3g}"
