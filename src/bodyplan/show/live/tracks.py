"""A motion and its trial as functions of time: where everything is that the viewer draws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bodyplan import curves
from bodyplan.arrays import Array, IntArray
from bodyplan.errors import BodyplanError
from bodyplan.motion import Claim, Motion
from bodyplan.robot.elements import Contact
from bodyplan.robot.masses import center_from_poses
from bodyplan.robot.model import Robot
from bodyplan.robot.rims import contact_radii
from bodyplan.show.shapes import extent
from bodyplan.simulate.loop import Timing
from bodyplan.simulate.reference import Reference
from bodyplan.simulate.trial import Trial
from bodyplan.spatial.rotations import conjugate, multiply, quaternion_exp, quaternion_log, rotate

#: times at which the whole motion is looked at, for its extent and the way of its centre of mass
LOOKS, WAY = 60, 400
#: most footholds that are drawn; points of a body curve
MOST_FOOTHOLDS, CURVE_POINTS = 2000, 90


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A robot at one time: ``poses`` (f, 7) of its frames, ``radii`` (c,) m of its contacts, ``centre`` (3,) m."""

    poses: Array
    radii: Array
    centre: Array


class Tracks:
    """Where a motion, and its trial if there is one, is at times from 0 to ``duration`` s.

    With a trial, time 0 is the beginning of its measured part, and the plan goes on cycle after cycle beside it.
    """

    def __init__(self, motion: Motion, trial: Trial | None = None) -> None:
        self.motion, self.trial = motion, trial if trial is not None and len(trial.t) > 1 else None
        self.robot: Robot = motion.robot
        self.reference = Reference.of(motion)
        self._timing = None if self.trial is None else _timing(self.reference, self.trial)
        length = float(motion.t[-1] - motion.t[0])
        self.duration = length
        if self.trial is not None:
            self.duration = max(float(self.trial.t[-1] - self.trial.start_time), 0.1 * length)

    def phase(self, time: float) -> float:
        """Phase of the plan (s after its first sample) at a time."""
        if self._timing is None or self.trial is None:
            return time
        return float(self._timing.phase(np.array([time + self.trial.start_time]))[0])

    def planned(self, time: float) -> Snapshot:
        """The planned robot at a time."""
        phase = self.phase(time)
        return self._snapshot(self.reference.joints(phase), self.reference.base(phase))

    def executed(self, time: float) -> Snapshot | None:
        """The robot in the physics at a time, its last record beyond them; None without a trial."""
        trial = self.trial
        if trial is None:
            return None
        at = float(np.clip(time + trial.start_time, trial.t[0], trial.t[-1]))
        i = int(np.clip(np.searchsorted(trial.t, at, side="right") - 1, 0, len(trial.t) - 2))
        s = (at - trial.t[i]) / (trial.t[i + 1] - trial.t[i])
        a, b = trial.base[i], trial.base[i + 1]
        turned = multiply(a[3:], quaternion_exp(s * quaternion_log(multiply(conjugate(a[3:]), b[3:]))))
        base = np.concatenate([a[:3] + s * (b[:3] - a[:3]), turned])
        return self._snapshot(trial.q[i] + s * (trial.q[i + 1] - trial.q[i]), base)

    def _snapshot(self, q: Array, base: Array) -> Snapshot:
        poses = self.robot.forward(q, base).array
        return Snapshot(poses, contact_radii(self.robot, q), centre_of_mass(self.robot, poses))

    def sample(self, time: float) -> int:
        """The sample of the motion nearest to a time, in its cycle."""
        phase = self.phase(time)
        if self.reference.period is not None:
            phase %= self.reference.period
        t = self.motion.t
        return int(np.argmin(np.abs(t - (t[0] + phase))))

    def stages(self, time: float) -> list[str]:
        """Names of the stages that a time falls into."""
        at = self.motion.t[0] + self.phase(time)
        if self.reference.period is not None:
            at = self.motion.t[0] + (at - self.motion.t[0]) % self.reference.period
        return list(dict.fromkeys(name for name, start, end in self.motion.stages if start <= at < end))

    def way(self, executed: bool = False) -> tuple[Array, Array]:
        """Times (k,) s and centre of mass (k, 3) m then, over the whole duration."""
        times = np.linspace(0.0, self.duration, WAY)
        if executed and self.trial is not None:
            at = self.trial.t - self.trial.start_time
            return times, np.stack([np.interp(times, at, self.trial.com[:, i]) for i in range(3)], axis=-1)
        return times, centre_of_mass(self.robot, self._poses(times))

    def _poses(self, times: Array) -> Array:
        phases = np.array([self.phase(float(time)) for time in times])
        return self.robot.forward(self.reference.joints(phases), self.reference.bases(phases)).array

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Corners (3,), (3,) m of a box around the robot at all times, planned and executed."""
        times = np.linspace(0.0, self.duration, LOOKS)
        tracks = [self._poses(times)]
        if self.trial is not None and self.trial.ok:
            shown = np.unique(np.linspace(0, len(self.trial.t) - 1, LOOKS).round().astype(int))
            tracks.append(self.robot.forward(self.trial.q[shown], self.trial.base[shown]).array)
        return extent(tracks, self.robot)

    def touching(self, time: float, now: Snapshot) -> tuple[Array, Array]:
        """Lowest points (k, 3) m of the contacts that the plan means to carry load at a time, and their forces (k, 3)
        N, zero where the motion has none."""
        if self.motion.contacts is None:
            return np.zeros((0, 3)), np.zeros((0, 3))
        i = self.sample(time)
        carrying = np.flatnonzero(self.motion.contacts[i])
        points = [self._lowest(int(c), now) for c in carrying]
        forces = np.zeros((len(carrying), 3)) if self.motion.forces is None else self.motion.forces[i][carrying]
        return np.array(points).reshape(-1, 3), np.asarray(forces)

    def _lowest(self, number: int, now: Snapshot) -> Array:
        contact = self.robot.contacts[number]
        return lowest(contact, now.poses[self.robot.frame_index(contact.frame)], float(now.radii[number]))

    @cached_property
    def footholds(self) -> Array:
        """Points (k, 3) m where feet (balls on a frame) stand that the motion claims to be at rest."""
        feet: dict[str, list[int]] = {}
        for number, contact in enumerate(self.robot.contacts):
            if contact.shape == "sphere":
                feet.setdefault(contact.frame, []).append(number)
        rests: list[tuple[float, str]] = []
        for claim in self.motion.claims:
            if claim.kind == "at_rest":
                rests += [(t, str(f)) for t in _starts(claim, self.motion) for f in claim.data["frames"] if f in feet]
        if not rests:
            return np.zeros((0, 3))
        times = sorted({t for t, _ in rests})
        phases = np.array(times) - self.motion.t[0]
        poses = self.robot.forward(self.reference.joints(phases), self.reference.bases(phases)).array
        place = {t: i for i, t in enumerate(times)}
        points = [
            lowest(self.robot.contacts[n], poses[place[t], self.robot.frame_index(f)], self.robot.contacts[n].radius)
            for t, f in rests[:MOST_FOOTHOLDS]
            for n in feet[f]
        ]
        return np.unique(np.round(points, 5), axis=0)

    @cached_property
    def _curve_claim(self) -> Claim | None:
        return next((c for c in self.motion.claims if c.kind in ("on_curve", "follows")), None)

    @cached_property
    def _curve_samples(self) -> IntArray:
        claim = self._curve_claim
        if claim is not None and claim.kind == "on_curve":
            return np.asarray(claim.data["samples"]).astype(np.int64)
        return np.arange(len(self.motion.t))

    def curve(self, time: float) -> Array | None:
        """Points (k, 3) m of the body curve that the motion claims to lie on at a time; None where there is none."""
        claim = self._curve_claim
        if claim is None:
            return None
        off = np.abs(self._curve_samples - self.sample(time))
        k = int(np.argmin(off))
        if off[k] > 1:  # the claim is about other times
            return None
        try:
            points = self._planar(claim, k) if claim.kind == "on_curve" else self._followed(claim, k)
        except BodyplanError:  # the rest of the picture is worth having without it
            return None
        return self._along(points, time)

    def _along(self, points: Array, time: float) -> Array:
        """The curve of a sample in the cycle that a time falls into."""
        phase, i = self.phase(time), self.sample(time)
        here, there = self.reference.base(phase), self.reference.base(float(self.motion.t[i] - self.motion.t[0]))
        turn = multiply(here[3:], conjugate(there[3:]))
        cycles = self.reference.period is not None and phase >= self.reference.period
        return np.asarray(here[:3] + rotate(turn, points - there[:3])) if cycles else points

    def _planar(self, claim: Claim, k: int) -> Array:
        data = claim.data
        pose, unit = np.asarray(data["pose"])[k], float(data["unit"])
        given = {n: np.asarray(v)[k] if np.ndim(v) else v for n, v in data["parameters"].items()}
        curve = curves.from_parameters(str(data["curve"]), given)
        i = int(self._curve_samples[k])
        frames = [self.robot.frame_index(str(name)) for name in data["frames"]]
        places = self.robot.forward(self.motion.q[i], self.motion.base[i]).positions[frames]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        ahead = (places[:, :2] - pose[:2]) @ np.array([c, s])
        x = np.linspace(0.0, max(float(ahead.max()), 0.0), 3 * CURVE_POINTS)
        y = curve(x / unit) * unit * float(data.get("flip", 1.0))
        height = np.full(len(x), places[:, 2].mean())
        return np.stack([pose[0] + c * x - s * y, pose[1] + s * x + c * y, height], axis=-1)

    def _followed(self, claim: Claim, k: int) -> Array:
        places, pose = np.asarray(claim.data["places"])[k], np.asarray(claim.data["pose"])
        made = curves.from_dict(claim.data["curve"])
        s = np.linspace(float(places.min()), float(places.max()), CURVE_POINTS)
        return made.frames(s, pose if pose.ndim == 1 else pose[k], tolerance=1e-5)[0]


def centre_of_mass(robot: Robot, poses: Array) -> Array:
    """Centre of mass (..., 3) m at poses (..., f, 7); the mean of the frames for a robot without masses."""
    return center_from_poses(robot, poses) if robot.mass > 0.0 else np.asarray(poses[..., :3].mean(axis=-2))


def lowest(contact: Contact, pose: Array, radius: float) -> Array:
    """The lowest point (3,) m of a contact whose frame has the pose (7,)."""
    down = np.array([0.0, 0.0, -1.0])
    place = pose[:3] + rotate(pose[3:], contact.points())
    low = place[int(np.argmin(place[:, 2]))]
    if contact.shape == "box":
        return np.asarray(low)
    if contact.shape == "rim":
        axis = rotate(pose[3:], np.array([0.0, 0.0, 1.0]))
        inside = down - axis * float(axis @ down)
        size = float(np.linalg.norm(inside))
        return np.asarray(low + (radius * inside / size if size > 1e-9 else 0.0))
    return np.asarray(low + radius * down)


def _starts(claim: Claim, motion: Motion) -> list[float]:
    """When the rest of a claim begins, again and again where it does."""
    start, every = float(claim.data["start"]), claim.data.get("every")
    count = 1 if not every else int(max(0.0, motion.t[-1] - start) / float(every)) + 1
    return [max(start + i * float(every or 0.0), float(motion.t[0])) for i in range(min(count, MOST_FOOTHOLDS))]


def _timing(reference: Reference, trial: Trial) -> Timing | None:
    keys = ("dt", "settle", "ramp", "record_dt")
    if any(key not in trial.settings for key in keys):  # a trial that was not made by simulate
        return None
    dt, settle, ramp, record = (float(trial.settings[key]) for key in keys)
    return Timing.of(reference, trial.cycles, dt=dt, settle=settle, ramp=ramp, record_dt=record)
