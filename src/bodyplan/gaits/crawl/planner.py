"""The plan of a crawl, step by step: footholds, sway of the body, swings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import Status
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
PLACES = np.linspace(0.0, 1.0, 7)
#: weight of sway against the logarithms of the distances from the edges
SWAY_COST = 0.5
#: rings and directions of a search for footholds
RINGS, DIRECTIONS = 8, 24
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


@dataclass
class Planner:
    """Plans ``gait`` for ``legs`` on ``ground``."""

    gait: Crawl
    legs: Legs
    ground: Ground
    course: Course
    sway_time: float
    swing_time: float
    height: float
    offsets: Array  # (m, 3) of the feet from the middle of the body, in its heading, on level ground
    guess: Array = field(init=False)

    def __post_init__(self) -> None:
        rough = stance_guess(self.legs, self._reach())
        q, _ = self.legs.place((self.offsets - [0.0, 0.0, self.height])[None], rough)
        self.guess = q[0]

    def _reach(self) -> tuple[float, float]:
        out = self.offsets[:, :2] - self.legs.roots[:, :2]
        return float(np.linalg.norm(out, axis=1).mean()), -self.height

    @property
    def step_time(self) -> float:
        """s from one step to the next."""
        return self.sway_time + self.swing_time

    def made(self, until: float) -> Plan:
        """Steps for ``until`` s at least."""
        order, count = self.gait.order(self.legs.names), len(self.legs)
        feet = np.zeros((count, 3))
        status, reason, time = Status.OK, "", np.inf
        for place, leg in enumerate(order):
            spot, why = self._foothold(leg, place - count)
            if why:
                status, reason, time = (
                    Status.NO_CONTACT,
                    f"{self.legs.names[leg]} has no foothold to begin on: {why}",
                    0.0,
                )
            feet[leg] = spot
        pose, _, _, _ = self._body(order[-1], -1, feet, feet)
        first, begun = pose, feet.copy()
        steps: list[Step] = []
        n = 0
        while status == Status.OK and n * self.step_time < until:
            leg = order[n % count]
            after = feet.copy()
            after[leg], why = self._foothold(leg, n)
            begin = n * self.step_time
            lift_off = begin + self.sway_time
            name = self.legs.names[leg]
            if why:
                status, reason, time = Status.NO_CONTACT, f"{name} finds no foothold at {lift_off:.4g} s: {why}", begin
                break
            radius = self.legs.legs[leg].radius
            shape = clear_swing(self.ground, feet[leg], after[leg], self.gait.step_height, radius)
            if shape is None:
                status, reason, time = (
                    Status.BELOW_FLOOR,
                    f"{name} cannot swing over the ground at {lift_off:.4g} s",
                    begin,
                )
                break
            pose, margin, share, standing = self._body(leg, n, feet, after, shape)
            if not standing:
                status, time = Status.OUT_OF_REACH, begin
                reason = f"a foot is out of reach while {name} swings at {lift_off:.4g} s"
            elif margin < self.gait.margin - EXACT and self.gait.sway == "auto":
                status, time = Status.TIPS_OVER, begin
                reason = (
                    f"no sway gives {self.gait.margin:.4g} m of margin while {name} swings at {lift_off:.4g} s, the "
                    f"most is {margin:.4g} m"
                )
            if status != Status.OK:
                break
            steps.append(
                Step(leg, begin, lift_off, lift_off + self.swing_time, pose, feet.copy(), after, *shape, margin, share)
            )
            feet = after
            n += 1
        return Plan(self.legs, first, begun, tuple(steps), self.guess, status, reason, time)

    def _foothold(self, leg: int, n: float) -> tuple[Array, str]:
        """Centre (3,) m of a foot that swings in step ``n``: below where the body will be in the middle of its stance;
        and why there is none."""
        at, heading = self.course.at((n + 0.5 * len(self.legs)) * self.step_time)
        c, s = np.cos(heading), np.sin(heading)
        x, y = self.offsets[leg, :2]
        nominal = at + np.array([c * x - s * y, s * x + c * y])
        radius = self.legs.legs[leg].radius
        tried = nominal[None]
        if self.gait.foothold == "search":
            rings = self.gait.search_radius * np.arange(1, RINGS + 1) / RINGS
            angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
            ways = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
            tried = np.concatenate([tried, nominal + (rings[:, None, None] * ways).reshape(-1, 2)])
        normals = self.ground.normal(tried)
        points = np.concatenate([tried, self.ground.height(tried)[:, None]], axis=1)
        centres = points + radius * normals
        gap = self.ground.clearance(centres) - radius
        # a ball in a corner or a hollow narrower than itself does not stand on this point
        stands = gap >= -EXACT - 1e-3 * radius
        centres = centres + np.maximum(-gap, 0.0)[:, None] * normals
        flat = np.arccos(np.clip(normals[:, 2], -1.0, 1.0)) <= self.gait.max_slope + EXACT
        good = np.flatnonzero(stands & flat)
        if len(good):
            return centres[good[0]], ""
        what = "within the search radius" if self.gait.foothold == "search" else "there"
        return centres[0], f"the ground is steeper than {np.degrees(self.gait.max_slope):.3g} deg, or an edge, {what}"

    def _body(
        self, leg: int, n: float, before: Array, after: Array, shape: tuple[float, float] = (0.0, 1.0)
    ) -> tuple[Array, float, float, bool]:
        """Pose (6,) of the body while ``leg`` swings in step ``n``, the least margin m, the share of the sway and
        whether every foot is in reach."""
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
        good = np.asarray(placed.all(axis=1).reshape(len(shares), -1).all(axis=1))
        center = center_of_mass(self.legs.robot, q, base)[:, :2]
        distances = edge_distances(np.repeat(stance[None, :, :2], len(center), axis=0), center)
        least = distances.min(axis=1).reshape(len(shares), -1).min(axis=1)
        logs = np.log(
            np.maximum(distances, 1e-6) / self.height, where=np.isfinite(distances), out=np.zeros_like(distances)
        )
        barrier = logs.sum(axis=1).reshape(len(shares), -1).min(axis=1) - SWAY_COST * shares**2
        k = self._chosen(least, barrier, good)
        return poses[k], float(least[k]), float(shares[k]), bool(good[k])

    def _chosen(self, least: Array, barrier: Array, good: BoolArray) -> int:
        """Which sway: the least that gives the margin, or the best by the barrier or the margin."""
        reachable = np.where(good, 1.0, -np.inf)
        if not good.any():
            return 0
        enough = np.flatnonzero(good & (least >= self.gait.margin - EXACT))
        if self.gait.stability == "margin" and len(enough):
            return int(enough[0])
        if self.gait.stability == "barrier":
            best = np.where(good & (least >= self.gait.margin - EXACT), barrier, -np.inf)
            if np.isfinite(best).any():
                return int(best.argmax())
        return int(np.where(reachable > 0.0, least, -np.inf).argmax())

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
