"""Plan and execution on one time axis: what the replay plays and the curves of advance are drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.motion import Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.robot.model import Robot
from bodyplan.show.carrying import Carrying
from bodyplan.show.following import Following
from bodyplan.show.inching import Inching, NotShown
from bodyplan.simulate.loop import Timing
from bodyplan.simulate.measure import at, directions
from bodyplan.simulate.reference import Reference
from bodyplan.simulate.trial import Trial

#: pictures a second, most pictures, and most numbers a replay may hold
RATE, MOST_FRAMES, MOST_NUMBERS = 25.0, 1500, 1_200_000


@dataclass(frozen=True, eq=False)
class Playback:
    """A motion as planned, cycle after cycle, and as executed, sampled for pictures.

    ``t`` (F,) s: 0 is the beginning of the measured part of the trial, or of the motion; before it the robot
    settles. ``planned`` (F, f, 7) poses of the robot's frames in the world, ``executed`` (E, f, 7) those of
    the trial at the first E of these times (E < F where the physics diverged), or None. ``planned_centre``
    (F, 3) and ``executed_centre`` (E, 3) m: centre of mass. ``period`` s of a cycle or None where the motion
    runs once; ``cycles``; ``ahead`` (cycles, 3) unit vectors of the planned advance and ``planned_advance``
    (cycles,) m its size.
    """

    motion: Motion
    t: Array
    planned: Array
    executed: Array | None
    planned_centre: Array
    executed_centre: Array | None
    period: float | None
    cycles: int
    ahead: Array
    planned_advance: Array

    @classmethod
    def of(cls, motion: Motion, trial: Trial | None) -> Playback:
        """The playback of a motion and its trial, if there is one."""
        reference = Reference.of(motion)
        if trial is None or len(trial.t) < 2:
            t = motion.t[_thinned(motion.t, motion.robot)] - motion.t[0]
            cycles = 1 if reference.period is None else max(1, int((t[-1] + 1e-9) / reference.period))
            phase, executed, executed_centre = t, None, None
        else:
            chosen = np.arange(len(trial.t))
            if trial.ok:  # the settling is worth seeing only where something went wrong
                chosen = np.flatnonzero(trial.t >= trial.start_time - 1e-9)
            chosen = chosen[_thinned(trial.t[chosen], motion.robot)]
            t, cycles = trial.t[chosen] - trial.start_time, trial.cycles
            phase = _phase(trial, reference, trial.t[chosen])
            executed = motion.robot.forward(trial.q[chosen], trial.base[chosen]).array
            executed_centre = centre_of_mass(motion.robot, executed)
        base = reference.bases(phase)
        planned = motion.robot.forward(reference.joints(phase), base).array
        period = reference.period
        steps = np.diff(_centres(reference, np.arange(cycles + 1.0) * reference.duration), axis=0)
        centre = centre_of_mass(motion.robot, planned)
        return cls(
            motion,
            t,
            planned,
            executed,
            centre,
            executed_centre,
            period,
            cycles,
            directions(steps),
            np.linalg.norm(steps, axis=1),
        )

    @property
    def span(self) -> float:
        """Time of one cycle, or of the whole motion, s."""
        return self.period if self.period is not None else float(self.t[-1])

    @cached_property
    def following(self) -> Following | None:
        """How the mechanism follows its curve over a cycle; None for a gait that follows none."""
        return Following.of(self.motion, self.span, self.period is not None)

    @cached_property
    def inching(self) -> Inching | NotShown | None:
        """How the body stands on its anchors; None for a gait that has none."""
        return Inching.of(self.motion, self.span, self.period is not None)

    @cached_property
    def carrying(self) -> Carrying | None:
        """What the wheels of a carried body do; None for other gaits."""
        return Carrying.of(self.motion)

    def advance(self, centre: Array) -> Array:
        """How far (k,) m centres of mass (k, 3) at the first k times have come along the planned direction
        since t = 0, each cycle measured along its own."""
        seams = np.arange(self.cycles + 1.0) * self.span
        seams[-1] = np.inf
        out = np.zeros(len(centre))
        time = self.t[: len(centre)]
        for cycle in range(self.cycles):
            start, end = seams[cycle], seams[cycle + 1]
            inside = (time >= start) & (time < end) if cycle else time < end
            first = at(time, centre, np.array([start]))[0] if len(time) > 1 else centre[0]
            before = 0.0 if cycle == 0 else self._reached(time, centre, cycle)
            out[inside] = before + (centre[inside] - first) @ self.ahead[cycle]
        return out

    def _reached(self, time: Array, centre: Array, cycle: int) -> float:
        """Advance at the end of the first ``cycle`` cycles."""
        places = at(time, centre, np.arange(cycle + 1.0) * self.span)
        return float(np.sum(np.diff(places, axis=0) * self.ahead[:cycle]))

    def lag(self) -> Array | None:
        """Executed minus planned advance (E,) m; None where nothing was executed."""
        if self.executed_centre is None:
            return None
        return self.advance(self.executed_centre) - self.advance(self.planned_centre[: len(self.executed_centre)])


def centre_of_mass(robot: Robot, poses: Array) -> Array:
    """Centre of mass (..., 3) m of a robot whose frames have poses (..., f, 7); the mean of the frames'
    origins where nothing has mass."""
    return center_from_poses(robot, poses) if robot.mass > 0.0 else np.asarray(poses[..., :3].mean(axis=-2))


def _centres(reference: Reference, phase: Array) -> Array:
    robot = reference.motion.robot
    base = reference.bases(phase)
    return centre_of_mass(robot, robot.forward(reference.joints(phase), base).array)


def _phase(trial: Trial, reference: Reference, t: Array) -> Array:
    """Phase of the plan at times of the trial: settling, ramp, then evenly."""
    keys = ("dt", "settle", "ramp", "record_dt")
    if any(key not in trial.settings for key in keys):  # a trial that was not made by simulate
        return np.asarray(t - trial.start_time)
    dt, settle, ramp, record = (float(trial.settings[key]) for key in keys)
    timing = Timing.of(reference, trial.cycles, dt=dt, settle=settle, ramp=ramp, record_dt=record)
    return timing.phase(t)


def _thinned(t: Array, robot: Robot) -> IntArray:
    """Indices of the samples nearest to an even grid of pictures, ends included."""
    most = int(min(MOST_FRAMES, max(2, MOST_NUMBERS // (7 * max(1, len(robot.frames))))))
    count = int(min(most, max(2.0, np.ceil((t[-1] - t[0]) * RATE) + 1.0)))
    grid = np.linspace(t[0], t[-1], count)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    nearest = np.where(grid - t[after - 1] <= t[after] - grid, after - 1, after)
    return np.unique(np.concatenate([[0], nearest, [len(t) - 1]])).astype(np.int64)
