"""The plan of a crawl, step by step: footholds, sway of the body, swings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError, Status
from bodyplan.gaits.crawl.footholds import foothold
from bodyplan.gaits.crawl.legs import Legs, stance_guess
from bodyplan.gaits.crawl.steps import Course, Step, clear_swing, swing_path
from bodyplan.ground.base import Ground
from bodyplan.robot.masses import center_of_mass
from bodyplan.spatial import quaternion_exp, rotate
from bodyplan.spatial.hulls import edge_distances
from bodyplan.spatial.rotations import conjugate, multiply

if TYPE_CHECKING:
    from bodyplan.gaits.crawl.gait import Crawl

#: shares of the way to the centroid of the support that are tried as sway
SHARES = 41
#: places of a swing at which the support is tried
PLACES = np.linspace(0.0, 1.0, 9)
#: weight of sway against the logarithms of the distances from the edges
SWAY_COST = 0.5
#: most steps of one plan: a mistyped time should not eat the machine
MOST_STEPS = 20_000
#: m of distances that rounding may change
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Plan:
    """``first`` (6,): pose of the body at time 0; ``feet`` (m, 3) m then; ``steps``; ``guess`` (n,) of the joints;
    ``status`` with the ``reason`` and the ``time`` s from which it holds."""

    legs: Legs
    first: Array
    feet: Array
    steps: tuple[Step, ...]
    guess: Array
    status: Status = Status.OK
    reason: str = ""
    time: float = np.inf


@dataclass(frozen=True)
class _Failure:
    """Why there is no step, and from which time s on."""

    status: Status = Status.OK
    reason: str = ""
    time: float = np.inf


@dataclass
class Planner:
    """Plans ``gait`` for ``legs`` on ``ground``, with the gait's numbers for this robot: ``order`` of the legs, s of
    sway and swing, m of ``height``, ``lift``, ``margin`` and ``search`` (0: none), and ``offsets`` (m, 3) m of the feet
    from the middle of the body, in its heading, on level ground."""

    gait: Crawl
    legs: Legs
    ground: Ground
    course: Course
    order: tuple[int, ...]
    sway_time: float
    swing_time: float
    height: float
    lift: float
    margin: float
    search: float
    offsets: Array
    guess: Array = field(init=False)

    def __post_init__(self) -> None:
        stance = self.offsets - [0.0, 0.0, self.height]
        q, _ = self.legs.place(stance[None], stance_guess(self.legs, stance))
        self.guess = q[0]

    @property
    def step_time(self) -> float:
        """s from one step to the next."""
        return self.sway_time + self.swing_time

    def made(self, until: float) -> Plan:
        """Steps for ``until`` s at least. InputError for more than MOST_STEPS."""
        if until > MOST_STEPS * self.step_time:
            raise InputError(
                f"Crawl: {until:.4g} s are {until / self.step_time:.3g} steps of {self.step_time:.3g} s, more than the "
                f"{MOST_STEPS} allowed: a slower walk, a longer cycle_time, or a shorter time."
            )
        count = len(self.legs)
        feet, failure = np.zeros((count, 3)), _Failure()
        for place, leg in enumerate(self.order):
            feet[leg], why = self._foothold(leg, place - count)
            if why:
                reason = f"{self.legs.names[leg]} has no foothold to begin on: {why}"
                failure = _Failure(Status.NO_CONTACT, reason, 0.0)
        first, begun = self._before(self.order[-1], feet), feet
        steps: list[Step] = []
        while failure.status == Status.OK and len(steps) * self.step_time < until:
            step = self._step(self.order[len(steps) % count], len(steps), feet)
            if isinstance(step, _Failure):
                failure = step
            else:
                steps.append(step)
                feet = step.after
        return Plan(self.legs, first, begun, tuple(steps), self.guess, failure.status, failure.reason, failure.time)

    def _before(self, leg: int, feet: Array) -> Array:
        """Pose (6,) of the body at the end of the step before the first, in which ``leg`` has come to its place among
        ``feet`` (m, 3): so that a walk that repeats does so from the beginning."""
        before = feet.copy()
        spot, why = self._foothold(leg, -1 - len(self.legs))
        before[leg] = feet[leg] if why else spot
        shape = clear_swing(self.ground, before[leg], feet[leg], self.lift, self.legs.legs[leg].radius)
        pose, _, _, _ = self._body(leg, -1, before, feet, shape or (self.lift, 1.0))
        return pose

    def _step(self, leg: int, n: int, feet: Array) -> Step | _Failure:
        """Step ``n``, in which ``leg`` swings while the others stay at ``feet`` (m, 3)."""
        name, begin = self.legs.names[leg], n * self.step_time
        lift_off = begin + self.sway_time
        after = feet.copy()
        after[leg], why = self._foothold(leg, n)
        if why:
            return _Failure(Status.NO_CONTACT, f"{name} finds no foothold at {lift_off:.4g} s: {why}", begin)
        radius = self.legs.legs[leg].radius
        shape = clear_swing(self.ground, feet[leg], after[leg], self.lift, radius)
        if shape is None:
            return _Failure(Status.BELOW_FLOOR, f"{name} cannot swing over the ground at {lift_off:.4g} s", begin)
        pose, margin, share, reached = self._body(leg, n, feet, after, shape)
        if not reached.all():
            lost = self.legs.names[int(np.flatnonzero(~reached)[0])]
            what = "its way" if lost == name else f"where {lost} stands"
            reason = f"{what} is out of reach while {name} swings at {lift_off:.4g} s"
            return _Failure(Status.OUT_OF_REACH, reason, begin)
        if margin < self.margin - EXACT and self.gait.sway == "auto":
            reason = (
                f"no sway gives {self.margin:.4g} m of margin while {name} swings at {lift_off:.4g} s, the "
                f"most is {margin:.4g} m"
            )
            if len(self.legs) == 3:
                reason += " (two feet are no support: a crawl needs four legs)"
            return _Failure(Status.TIPS_OVER, reason, begin)
        return Step(leg, begin, lift_off, lift_off + self.swing_time, pose, feet, after, *shape, margin, share)

    def _foothold(self, leg: int, n: float) -> tuple[Array, str]:
        """Centre (3,) m of a foot that swings in step ``n``: below where the body will be in the middle of its stance,
        or near there; and why there is none."""
        at, heading = self.course.at((n + 0.5 * len(self.legs)) * self.step_time)
        c, s = np.cos(heading), np.sin(heading)
        x, y = self.offsets[leg, :2]
        nominal = at + np.array([c * x - s * y, s * x + c * y])
        return foothold(
            self.ground,
            nominal,
            self.legs.legs[leg].radius,
            self.gait.max_slope,
            self.search,
        )

    def _body(
        self, leg: int, n: float, before: Array, after: Array, shape: tuple[float, float] = (0.0, 1.0)
    ) -> tuple[Array, float, float, BoolArray]:
        """Pose (6,) of the body while ``leg`` swings in step ``n``, the least margin m, the share of the sway and
        which feet (m,) are in reach."""
        at, heading = self.course.at(n * self.step_time)
        others = [j for j in range(len(self.legs)) if j != leg]
        stance = before[others]
        centroid = stance[:, :2].mean(axis=0)
        shares = np.linspace(0.0, 1.0, SHARES) if self.gait.sway == "auto" else np.array([float(self.gait.sway)])
        poses = np.stack([self.pose(at + s * (centroid - at), heading, before) for s in shares])
        swung, _, _ = swing_path(before[leg], after[leg], *shape, PLACES)
        feet = np.repeat(before[None], len(PLACES), axis=0)
        feet[:, leg] = swung
        every = np.repeat(poses, len(PLACES), axis=0)
        targets = np.tile(feet, (len(shares), 1, 1))
        base = base_of(every)
        q, placed = self.legs.place(seen_from(base, targets), self.guess)
        reached: BoolArray = np.all(placed.reshape(len(shares), len(PLACES), -1), axis=1)
        good: BoolArray = np.all(reached, axis=1)
        center = (center_of_mass(self.legs.robot, q, base) if self.legs.robot.mass > 0.0 else base)[:, :2]
        distances = edge_distances(np.repeat(stance[None, :, :2], len(center), axis=0), center)
        least = distances.min(axis=1).reshape(len(shares), -1).min(axis=1)
        logs = np.log(
            np.maximum(distances, 1e-6) / self.height, where=np.isfinite(distances), out=np.zeros_like(distances)
        )
        barrier = logs.sum(axis=1).reshape(len(shares), -1).min(axis=1) - SWAY_COST * shares**2
        limits = self.legs.robot.limits
        inside = np.all((q >= limits[:, 0] - EXACT) & (q <= limits[:, 1] + EXACT), axis=1)
        within: BoolArray = np.all(inside.reshape(len(shares), -1), axis=1)
        k = self._chosen(least, barrier, good, within)
        return poses[k], float(least[k]), float(shares[k]), reached[k]

    def _chosen(self, least: Array, barrier: Array, good: BoolArray, within: BoolArray) -> int:
        """Which sway of those that are ``good``: the least that gives the margin, or the best by the barrier or the
        margin; if it can be with all joints ``within`` their limits."""
        if not good.any():
            return 0  # no sway at all
        enough = good & (least >= self.margin - EXACT)
        wanted = barrier if self.gait.stability == "barrier" else least
        for mine in (enough & within, enough):
            if mine.any():
                first = self.gait.stability == "margin"
                return int(mine.argmax() if first else np.where(mine, wanted, -np.inf).argmax())
        return int(np.where(good, least, -np.inf).argmax())

    def pose(self, at: Array, heading: float, feet: Array) -> Array:
        """(6,) x, y, z, roll, pitch, yaw over the plane through all feet, level or along it."""
        radii = np.array([leg.radius for leg in self.legs.legs])
        ground = feet - radii[:, None] * [0.0, 0.0, 1.0]
        design = np.concatenate([ground[:, :2], np.ones((len(ground), 1))], axis=1)
        (gx, gy, g0), *_ = np.linalg.lstsq(design, ground[:, 2], rcond=None)
        z = gx * at[0] + gy * at[1] + g0 + self.height + float(radii.mean())
        roll = pitch = 0.0
        if self.gait.body == "follow":
            c, s = np.cos(heading), np.sin(heading)
            ahead, left = gx * c + gy * s, -gx * s + gy * c
            pitch = -np.arctan(ahead)
            roll = np.arctan(left * np.cos(pitch))
        return np.array([at[0], at[1], z, roll, pitch, heading])


def base_of(poses: Array) -> Array:
    """Base poses (T, 7) from x, y, z, roll, pitch, yaw (T, 6): R = Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = np.eye(3)
    turn = multiply(
        multiply(quaternion_exp(poses[:, 5:6] * z), quaternion_exp(poses[:, 4:5] * y)),
        quaternion_exp(poses[:, 3:4] * x),
    )
    return np.concatenate([poses[:, :3], turn], axis=1)


def seen_from(base: Array, points: Array) -> Array:
    """World points (T, m, 3) in the frames of ``base`` (T, 7)."""
    back = conjugate(base[:, None, 3:])
    return np.asarray(rotate(back, points - base[:, None, :3]))
