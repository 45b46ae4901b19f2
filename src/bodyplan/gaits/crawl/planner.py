"""The plan of a crawl, step by step: footholds, sway of the body, swings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError, Status
from bodyplan.gaits.crawl.footholds import Footholds
from bodyplan.gaits.crawl.legs import Legs, stance_guess
from bodyplan.gaits.crawl.shell import Shell, shell_of
from bodyplan.gaits.crawl.steps import Course, Step, blend, clear_swing, clear_swings, swing_path
from bodyplan.gaits.crawl.sway_kernel import sways
from bodyplan.ground.base import Ground
from bodyplan.spatial.rotations import conjugate, matrix_from_quaternion

if TYPE_CHECKING:
    from bodyplan.gaits.crawl.gait import Crawl

#: shares of the way to the centroid of the support that are tried as sway
SHARES = np.linspace(0.0, 1.0, 41)
#: places of a swing at which the support is tried
PLACES = np.linspace(0.0, 1.0, 9)
#: weight of sway against the logarithms of the distances from the edges
SWAY_COST = 0.5
#: where a step is looked at for what links and body could touch: of the body's move, and of the swing
MOVE, SWING = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 33)
_MOVED = blend(MOVE)[0]
#: what is tried where they come too near: so many footholds and swings, the body higher by such shares
SPOTS, SWINGS, RISES = 25, 12, (0.0, 0.06, 0.12, 0.2)
#: a share of sway with which steps to come are guessed
AHEAD = 0.4
#: most steps of one plan: a mistyped time should not eat the machine
MOST_STEPS = 20_000
#: m of distances that rounding may change, and by which it makes a difference of none
EXACT, TIE = 1e-9, 1e-12


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
    """Why there is no step, and from which time s on. ``short`` m: by how much links or body come too near to anything,
    0 where that is not why; ``elsewhere``: whether another foothold may help; ``made``: the step, where only later ones
    may not be."""

    status: Status = Status.OK
    reason: str = ""
    time: float = np.inf
    short: float = 0.0
    elsewhere: bool = False
    made: Step | None = None


@dataclass
class Planner:
    """Plans ``gait`` for ``legs`` on ``ground``, with the gait's numbers for this robot: ``order`` of the legs, s of
    sway and swing, m of ``height``, ``lift``, ``margin``, ``search`` (0: none) and ``clearance``, and ``offsets``
    (m, 3) m of the feet from the middle of the body, in its heading, on level ground."""

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
    clearance: float = 0.0
    guess: Array = field(init=False)
    shell: Shell | None = field(init=False)
    needed: Array = field(init=False)

    def __post_init__(self) -> None:
        stance = self.offsets - [0.0, 0.0, self.height]
        q, _ = self.legs.place(stance[None], stance_guess(self.legs, stance))
        self.guess = q[0]
        self.shell = shell_of(self.legs)
        self.needed = np.zeros(0) if self.shell is None else self.shell.needed(self.guess, self.clearance)

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
            feet[leg], why = self._footholds(leg, place - count).first
            if why:
                reason = f"{self.legs.names[leg]} has no foothold to begin on: {why}"
                failure = _Failure(Status.NO_CONTACT, reason, 0.0)
        first, begun = self._before(self.order[-1], feet), feet
        steps: list[Step] = []
        while failure.status == Status.OK and len(steps) * self.step_time < until:
            before = steps[-1].pose if steps else first
            step = self._step(self.order[len(steps) % count], len(steps), feet, before)
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
        spot, why = self._footholds(leg, -1 - len(self.legs)).first
        before[leg] = feet[leg] if why else spot
        shape = clear_swing(self.ground, before[leg], feet[leg], self.lift, self.legs.legs[leg].radius)
        pose, _, _, _ = self._body(leg, -1, before, feet, shape or (self.lift, 1.0))
        return pose

    def _step(self, leg: int, n: int, feet: Array, before: Array) -> Step | _Failure:
        """Step ``n``, in which ``leg`` swings while the others stay at ``feet`` (m, 3), after the body's pose
        ``before`` (6,). If links or body come too near to anything, other swings, footholds and heights of the body are
        tried; if nothing helps, what comes nearest to it says why."""
        spots = self._footholds(leg, n)
        _, why = spots.first
        if why:
            begin = n * self.step_time
            at = f"{self.legs.names[leg]} finds no foothold at {begin + self.sway_time:.4g} s"
            return _Failure(Status.NO_CONTACT, f"{at}: {why}", begin)
        best: _Failure | None = None
        for rise in RISES:
            doubtful: _Failure | None = None
            for spot in _spread(spots):
                step = self._tried(leg, n, feet, before, spot, rise * self.height)
                if isinstance(step, Step):
                    return step
                if step.short == 0.0 and best is None and doubtful is None:
                    return step
                if step.made is not None and (doubtful is None or step.short < doubtful.short):
                    doubtful = step
                elif step.made is None and step.short > 0.0 and (best is None or step.short < best.short):
                    best = step
                if not step.elsewhere:
                    break
            if doubtful is not None and doubtful.made is not None:
                return doubtful.made
        assert best is not None
        return best

    def _tried(self, leg: int, n: int, feet: Array, before: Array, spot: Array, rise: float) -> Step | _Failure:
        """Step ``n`` to ``spot`` (3,) with the body ``rise`` m higher than usual."""
        name, begin = self.legs.names[leg], n * self.step_time
        lift_off = begin + self.sway_time
        after = feet.copy()
        after[leg] = spot
        radius = self.legs.legs[leg].radius
        best: _Failure | None = None
        for swing in islice(clear_swings(self.ground, feet[leg], spot, self.lift, radius), SWINGS):
            pose, margin, share, reached = self._body(leg, n, feet, after, swing, rise)
            if not reached.all():
                lost = self.legs.names[int(np.flatnonzero(~reached)[0])]
                what = "its way" if lost == name else f"where {lost} stands"
                reason = f"{what} is out of reach while {name} swings at {lift_off:.4g} s"
                return best or _Failure(Status.OUT_OF_REACH, reason, begin)
            if margin < self.margin - EXACT and self.gait.sway == "auto":
                reason = (
                    f"no sway gives {self.margin:.4g} m of margin while {name} swings at {lift_off:.4g} s, the "
                    f"most is {margin:.4g} m"
                )
                if len(self.legs) == 3:
                    reason += " (two feet are no support: a crawl needs four legs)"
                return best or _Failure(Status.TIPS_OVER, reason, begin)
            touch_down = lift_off + self.swing_time
            step = Step(leg, begin, lift_off, touch_down, pose, feet, after, *swing, margin, share)
            failure, raising = self._touches(step, n, before)
            if failure is None:
                return step
            if best is None or failure.short < best.short:
                best = failure
            if not raising:
                break
        reason = f"{name} cannot swing over the ground at {lift_off:.4g} s"
        return best or _Failure(Status.BELOW_FLOOR, reason, begin)

    def _touches(self, step: Step, n: int, before: Array) -> tuple[_Failure | None, bool]:
        """What comes too near to the ground, or to what, in a step after the body's pose ``before`` (6,) and, as far as
        its foot stands there, in the steps after it; and whether a higher swing may help."""
        shell = self.shell
        if shell is None:
            return None, False
        leg, name = step.leg, self.legs.names[step.leg]
        poses = np.concatenate(
            [
                before + _MOVED[:, None] * (step.pose - before),
                np.broadcast_to(step.pose, (len(SWING), 6)),
                self._later(step, n),
            ]
        )
        feet = np.repeat(step.before[None], len(poses), axis=0)
        feet[len(MOVE) : len(MOVE) + len(SWING), leg] = step.foot(SWING)[0]
        feet[len(MOVE) + len(SWING) :] = step.after
        base = base_of(poses)
        q, placed = self.legs.place(seen_from(base, feet), self.guess)
        frames = self.legs.robot.forward(q, base).array
        spare = shell.gaps(self.ground, frames, self.needed) - self.needed
        spare[~placed.all(axis=1)] = np.inf
        first, last = len(MOVE), len(MOVE) + len(SWING)
        mine = shell.owners == leg
        when = f"while {name} swings at {step.lift_off:.4g} s"
        # the first of those that only rounding tells apart
        worst = spare[:last] <= spare[:last].min() + TIE
        row, part = np.unravel_index(int(worst.argmax()), worst.shape)
        short = -float(spare[row, part])
        if short > EXACT:
            if row < first:
                when = f"at {step.begin + self.sway_time * float(MOVE[row]):.4g} s, before {name} swings"
            what, wanted = shell.name(int(part)), float(self.needed[part])
            reason = f"{what} comes within {wanted - short:.3g} m of the ground {when}, clearance wants {wanted:.3g} m"
            raising = bool(mine[part] and first < row < last - 1)
            elsewhere = bool(mine[part] and row > first)
            return _Failure(Status.BELOW_FLOOR, reason, step.begin, short, elsewhere), raising
        gap, _, names = shell.nearest_pair(frames[:last])
        if gap < -EXACT:
            reason = f"{names[0]} and {names[1]} would be in each other {when}"
            return _Failure(Status.LINKS_CROSSING, reason, step.begin, -gap, True), False
        # how this leg will stand, as far as that can be guessed
        short = -float(spare[last:, mine].min(initial=np.inf))
        if short > EXACT:
            return _Failure(Status.BELOW_FLOOR, "", step.begin, short, True, step), False
        return None, False

    def _later(self, step: Step, n: int) -> Array:
        """Guesses (k, 6) of the body's poses in the steps after step ``n`` until its leg swings again, with more and
        less sway."""
        ways, plane = [], self.plane(step.after)
        for k in range(1, len(self.legs)):
            at, heading = self.course.at((n + k) * self.step_time)
            swinging = self.order[(n + k) % len(self.legs)]
            centroid = _others(step.after, swinging)[:, :2].mean(axis=0)
            ways += [(*(at + share * (centroid - at)), heading) for share in (0.0, step.share, AHEAD)]
        return self.over(plane, np.array(ways))

    def _footholds(self, leg: int, n: float) -> Footholds:
        """Those of a foot that swings in step ``n``: below where the body will be in the middle of its stance, or near
        there."""
        at, heading = self.course.at((n + 0.5 * len(self.legs)) * self.step_time)
        c, s = np.cos(heading), np.sin(heading)
        x, y = self.offsets[leg, :2]
        nominal = at + np.array([c * x - s * y, s * x + c * y])
        return Footholds(self.ground, nominal, self.legs.legs[leg].radius, self.gait.max_slope, self.search)

    def _body(
        self, leg: int, n: float, before: Array, after: Array, shape: tuple[float, float], rise: float = 0.0
    ) -> tuple[Array, float, float, BoolArray]:
        """Pose (6,) of the body, ``rise`` m higher than usual, while ``leg`` swings in step ``n``, the least margin m,
        the share of the sway and which feet (m,) are in reach."""
        at, heading = self.course.at(n * self.step_time)
        centroid = _others(before, leg)[:, :2].mean(axis=0)
        auto, legs, robot = self.gait.sway == "auto", self.legs, self.legs.robot
        shares = SHARES if auto else np.array([float(self.gait.sway)])
        ways = np.empty((len(shares), 3))
        ways[:, :2], ways[:, 2] = at + shares[:, None] * (centroid - at), heading
        poses = self.over(self.plane(before), ways)
        poses[:, 2] += rise
        swung, _, _ = swing_path(before[leg], after[leg], *shape, PLACES)
        least, barrier = np.full(len(shares), np.inf), np.full(len(shares), np.inf)
        reached, within = np.ones((len(shares), len(legs)), dtype=bool), np.ones(len(shares), dtype=bool)
        # the least sway that will do is known as soon as it is met
        enough = self.margin - EXACT if auto and self.gait.stability == "margin" else np.inf
        limits = robot.limits + np.array([-EXACT, EXACT])
        k = sways(legs.tables, legs.postures, self.guess, limits, poses, before, leg, swung, enough, self.height,
                  least, barrier, reached, within)  # fmt: skip
        if k < 0:
            good: BoolArray = np.all(reached, axis=1)
            k = self._chosen(least, barrier - SWAY_COST * shares**2, good, within)
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

    def plane(self, feet: Array) -> Array:
        """(3,) slopes along x and y, and height m at the origin, of the plane through the ground below all ``feet``
        (m, 3), at best."""
        ground = feet - self.legs.radii[:, None] * [0.0, 0.0, 1.0]
        design = np.concatenate([ground[:, :2], np.ones((len(ground), 1))], axis=1)
        return np.asarray(np.linalg.lstsq(design, ground[:, 2], rcond=None)[0])

    def over(self, plane: Array, ways: Array) -> Array:
        """(k, 6) x, y, z, roll, pitch, yaw at x, y, yaw (k, 3) over a :meth:`plane`, level or along it."""
        gx, gy, g0 = plane
        x, y, heading = ways.T
        out = np.zeros((len(ways), 6))
        out[:, 0], out[:, 1], out[:, 5] = x, y, heading
        out[:, 2] = gx * x + gy * y + g0 + self.height + float(self.legs.radii.mean())
        if self.gait.body == "follow":
            c, s = np.cos(heading), np.sin(heading)
            ahead, left = gx * c + gy * s, -gx * s + gy * c
            out[:, 4] = -np.arctan(ahead)
            out[:, 3] = np.arctan(left * np.cos(out[:, 4]))
        return out

    def pose(self, at: Array, heading: float, feet: Array) -> Array:
        """(6,) x, y, z, roll, pitch, yaw over the plane through all feet, level or along it."""
        return np.asarray(self.over(self.plane(feet), np.array([[at[0], at[1], heading]]))[0])


def _spread(spots: Footholds) -> Iterator[Array]:
    """Centres (3,) of SPOTS footholds, the best first; the others are looked for when they are asked for."""
    yield spots.first[0]
    every = spots.all
    for k in np.unique(np.linspace(0, len(every) - 1, SPOTS).astype(np.int64))[1:]:
        yield every[k]


def _others(feet: Array, leg: int) -> Array:
    """(m - 1, 3): all feet but one."""
    return np.concatenate([feet[:leg], feet[leg + 1 :]])


def base_of(poses: Array) -> Array:
    """Base poses (T, 7) from x, y, z, roll, pitch, yaw (T, 6): R = Rz(yaw) Ry(pitch) Rx(roll)."""
    out = np.empty((len(poses), 7))
    out[:, :3] = poses[:, :3]
    (cr, cp, cy), (sr, sp, sy) = np.cos(0.5 * poses[:, 3:].T), np.sin(0.5 * poses[:, 3:].T)
    out[:, 3] = cy * cp * cr + sy * sp * sr
    out[:, 4] = cy * cp * sr - sy * sp * cr
    out[:, 5] = cy * sp * cr + sy * cp * sr
    out[:, 6] = sy * cp * cr - cy * sp * sr
    return out


def seen_from(base: Array, points: Array) -> Array:
    """World points (T, m, 3) in the frames of ``base`` (T, 7)."""
    back = matrix_from_quaternion(conjugate(base[:, 3:]))
    return np.asarray(np.einsum("tij,tmj->tmi", back, points - base[:, None, :3]))
