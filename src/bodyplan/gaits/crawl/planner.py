"""The plan of a crawl, step by step: footholds, sway of the body, swings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice, pairwise
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError, Status
from bodyplan.gaits.crawl.footholds import Footholds
from bodyplan.gaits.crawl.legs import Legs, stance_of
from bodyplan.gaits.crawl.poses import over, plane_through
from bodyplan.gaits.crawl.shell import Shell, needed_by, shell_of
from bodyplan.gaits.crawl.steps import Course, Step, clear_swing, clear_swings, first_swings, swing_path
from bodyplan.gaits.crawl.sway_kernel import sways
from bodyplan.gaits.crawl.verdict import Failure, Lookout
from bodyplan.ground.base import Ground

if TYPE_CHECKING:
    from bodyplan.gaits.crawl.gait import Crawl

#: shares of the way to the centroid of the support that are tried as sway
SHARES = np.linspace(0.0, 1.0, 41)
#: places of a swing at which the support is tried
PLACES = np.linspace(0.0, 1.0, 9)
#: weight of sway against the logarithms of the distances from the edges
SWAY_COST = 0.5
#: what is tried where they come too near: so many footholds and swings, the body higher by such shares
SPOTS, SWINGS, RISES = 25, 12, (0.0, 0.06, 0.12, 0.2)
#: a share of sway with which steps to come are guessed
AHEAD = 0.4
#: most steps of one plan: a mistyped time should not eat the machine
MOST_STEPS = 20_000
#: most steps that are planned at once, as if the first way of making each were good
AT_ONCE = 16
#: m of distances that rounding may change; m and rad of poses that are told apart
EXACT, SAME = 1e-9, 1e-12


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


@dataclass(frozen=True, eq=False)
class _Way:
    """A way of making a step after the body's pose ``before`` (6,), and what is wrong with it, if anything is."""

    step: Step
    before: Array
    failure: Failure | None


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
    lookout: Lookout | None = field(init=False)
    _spots: dict[int, Footholds] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.guess = stance_of(self.legs, (self.offsets - [0.0, 0.0, self.height]).tobytes()).copy()
        self.shell = shell_of(self.legs)
        self.needed, self.lookout = np.zeros(0), None
        if self.shell is not None:
            self.needed = needed_by(self.shell, self.guess.tobytes(), self.clearance)
            self.lookout = Lookout(self.legs, self.ground, self.shell, self.guess, self.needed)

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
        feet, failure = np.zeros((count, 3)), Failure()
        total = math.ceil(until / self.step_time)
        total += int(total * self.step_time < until) - int((total - 1) * self.step_time >= until > 0.0)
        self._look_ahead(-1 - count, min(total, AT_ONCE))
        for place, leg in enumerate(self.order):
            feet[leg], why = self._footholds(place - count).first
            if why:
                reason = f"{self.legs.names[leg]} has no foothold to begin on: {why}"
                failure = Failure(Status.NO_CONTACT, reason, 0.0)
        first, begun = self._before(feet), feet
        steps: list[Step] = []
        before, at_once = first, AT_ONCE
        while failure.status == Status.OK and len(steps) < total:
            ways: list[_Way | None] = [*self._ahead(len(steps), feet, before, min(at_once, total - len(steps)))]
            kept = 0
            for way in ways or [None]:
                step = self._step(len(steps), feet, before, way)
                if not isinstance(step, Step):
                    failure = step or failure
                    break
                steps.append(step)
                feet, before, kept = step.after, step.pose, kept + 1
            # where the first ways are no good, less is planned at once
            at_once = min(2 * at_once, AT_ONCE) if kept >= len(ways) else max(kept, 1)
        return Plan(self.legs, first, begun, tuple(steps), self.guess, failure.status, failure.reason, failure.time)

    def repeats(self, plan: Plan) -> bool:
        """Whether a plan of one cycle on level ground goes on as it began: its last step leads to where its first one
        came from, but for rounding."""
        poses = np.array([plan.first, plan.steps[-1].pose])
        at, heading = self.course.along(np.array([-1, len(plan.steps) - 1]) * self.step_time)
        c, s = np.cos(heading), np.sin(heading)
        x, y = (poses[:, :2] - at).T
        poses[:, 0], poses[:, 1], poses[:, 5] = c * x + s * y, c * y - s * x, poses[:, 5] - heading
        return bool(np.abs(poses[1] - poses[0]).max() <= SAME)

    def _before(self, feet: Array) -> Array:
        """Pose (6,) of the body at the end of the step before the first, in which the last leg has come to its place
        among ``feet`` (m, 3): so that a walk that repeats does so from the beginning."""
        leg, before = self.order[-1], feet.copy()
        spot, why = self._footholds(-1 - len(self.legs)).first
        before[leg] = feet[leg] if why else spot
        shape = clear_swing(self.ground, before[leg], feet[leg], self.lift, self.legs.legs[leg].radius)
        pose, _, _, _ = self._body(leg, -1, before, feet, shape or (self.lift, 1.0))
        return pose

    def _ahead(self, n: int, feet: Array, before: Array, count: int) -> list[_Way]:
        """The first way of making each of at most ``count`` steps from step ``n`` on, after ``feet`` (m, 3) and the
        body's pose ``before`` (6,); up to the first step for which that is none, for all but what links or body could
        touch."""
        numbers = range(n, n + count)
        self._look_ahead(n, n + count)
        legs = [self.order[k % len(self.legs)] for k in numbers]
        stands = [feet]
        for k, leg in zip(numbers, legs, strict=True):
            spot, why = self._footholds(k).first
            if why:
                break
            after = stands[-1].copy()
            after[leg] = spot
            stands.append(after)
        steps: list[Step] = []
        try:
            for k, leg, swing in zip(numbers, legs, self._first_swings(stands, legs), strict=False):
                if swing is None:
                    break
                step = self._posed(leg, k, stands[k - n], stands[k - n + 1], swing)
                if isinstance(step, Failure):
                    break
                steps.append(step)
            poses = [before, *(step.pose for step in steps)]
            failures = self._verdicts(steps, n, poses[:-1])
        except InputError:  # beyond the edge of the ground, perhaps in a step that will not be made
            return []
        return [_Way(*way) for way in zip(steps, poses, failures, strict=False)]

    def _first_swings(self, stands: list[Array], legs: list[int]) -> Iterator[tuple[float, float] | None]:
        """The first clear swing from each of some stances (m, 3) to the next, if there is one."""
        radii = self.legs.radii
        ends = [(a[j], b[j], radii[j]) for (a, b), j in zip(pairwise(stands), legs, strict=False)]
        if not ends:
            return
        before, after, sizes = (np.array(part) for part in zip(*ends, strict=True))
        try:
            good = first_swings(self.ground, before, after, self.lift, sizes)
        except InputError:  # beyond the edge of the ground
            good = np.zeros(len(ends), dtype=bool)
        for is_good, (start, end, radius) in zip(good, ends, strict=True):
            yield (self.lift, 1.0) if is_good else clear_swing(self.ground, start, end, self.lift, radius)

    def _verdicts(self, steps: Sequence[Step], n: int, before: Sequence[Array]) -> list[Failure | None]:
        """What comes too near to anything in steps from step ``n`` on, after the body's poses ``before`` (6,)."""
        if self.lookout is None or not steps:
            return [None] * len(steps)
        return self.lookout.verdicts(steps, np.array(before), self._later(steps, n))

    def _step(self, n: int, feet: Array, before: Array, way: _Way | None) -> Step | Failure | None:
        """Step ``n``, in which a leg swings while the others stay at ``feet`` (m, 3), after the body's pose ``before``
        (6,), by the first ``way`` of :meth:`_ahead`; None where that begins elsewhere."""
        if way is None:
            return self._searched(n, feet, before, None)
        if not np.array_equal(way.step.before, feet):
            return None
        failure = way.failure
        if not np.array_equal(way.before, before):
            (failure,) = self._verdicts([way.step], n, [before])
        return way.step if failure is None else self._searched(n, feet, before, failure)

    def _searched(self, n: int, feet: Array, before: Array, known: Failure | None) -> Step | Failure:
        """Step ``n`` as in :meth:`_step`, the first way of which is ``known`` to fail, if it is. If links or body come
        too near to anything, other swings, footholds and heights of the body are tried; if nothing helps, what comes
        nearest to it says why."""
        leg, spots = self.order[n % len(self.legs)], self._footholds(n)
        _, why = spots.first
        if why:
            begin = n * self.step_time
            at = f"{self.legs.names[leg]} finds no foothold at {begin + self.sway_time:.4g} s"
            return Failure(Status.NO_CONTACT, f"{at}: {why}", begin)
        best: Failure | None = None
        for rise in RISES:
            doubtful: Failure | None = None
            for spot in _spread(spots):
                step = self._tried(leg, n, feet, before, spot, rise * self.height, known)
                known = None
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

    def _tried(
        self, leg: int, n: int, feet: Array, before: Array, spot: Array, rise: float, known: Failure | None
    ) -> Step | Failure:
        """Step ``n`` to ``spot`` (3,) with the body ``rise`` m higher than usual, the first swing of which is ``known``
        to fail, if it is."""
        after = feet.copy()
        after[leg] = spot
        radius = self.legs.legs[leg].radius
        best: Failure | None = None
        for swing in islice(clear_swings(self.ground, feet[leg], spot, self.lift, radius), SWINGS):
            step = self._posed(leg, n, feet, after, swing, rise)
            if isinstance(step, Failure):
                return best or step
            failure = known or self._verdicts([step], n, [before])[0]
            known = None
            if failure is None:
                return step
            if best is None or failure.short < best.short:
                best = failure
            if not failure.raising:
                break
        at = n * self.step_time + self.sway_time
        reason = f"{self.legs.names[leg]} cannot swing over the ground at {at:.4g} s"
        return best or Failure(Status.BELOW_FLOOR, reason, n * self.step_time)

    def _posed(
        self, leg: int, n: int, feet: Array, after: Array, swing: tuple[float, float], rise: float = 0.0
    ) -> Step | Failure:
        """Step ``n`` by one ``swing`` (lift m, early), whatever links or body could touch."""
        name, begin = self.legs.names[leg], n * self.step_time
        lift_off = begin + self.sway_time
        pose, margin, share, reached = self._body(leg, n, feet, after, swing, rise)
        if not reached.all():
            lost = self.legs.names[int(np.flatnonzero(~reached)[0])]
            what = "its way" if lost == name else f"where {lost} stands"
            reason = f"{what} is out of reach while {name} swings at {lift_off:.4g} s"
            return Failure(Status.OUT_OF_REACH, reason, begin)
        if margin < self.margin - EXACT and self.gait.sway == "auto":
            reason = (
                f"no sway gives {self.margin:.4g} m of margin while {name} swings at {lift_off:.4g} s, the "
                f"most is {margin:.4g} m"
            )
            if len(self.legs) == 3:
                reason += " (two feet are no support: a crawl needs four legs)"
            return Failure(Status.TIPS_OVER, reason, begin)
        return Step(leg, begin, lift_off, lift_off + self.swing_time, pose, feet, after, *swing, margin, share)

    def _later(self, steps: Sequence[Step], n: int) -> Array:
        """Guesses (s, k, 6) of the body's poses in the steps after each of some steps, from step ``n`` on, until its
        leg swings again, with more and less sway."""
        count = len(self.legs)
        numbers = n + np.arange(len(steps))[:, None] + np.arange(1, count)
        at, heading = self.course.along(np.asarray(numbers * self.step_time))
        after = np.array([step.after[:, :2] for step in steps])
        swinging = np.array(self.order)[numbers % count]
        centroid = (after.sum(axis=1)[:, None] - np.take_along_axis(after, swinging[..., None], axis=1)) / (count - 1)
        shares = np.array([(0.0, step.share, AHEAD) for step in steps])[:, None, :, None]
        ways = np.empty((*numbers.shape, 3, 3))
        ways[..., :2] = at[:, :, None] + shares * (centroid - at)[:, :, None]
        ways[..., 2] = heading[..., None]
        return np.array(
            [self.over(self.plane(step.after), way.reshape(-1, 3)) for step, way in zip(steps, ways, strict=True)]
        )

    def _footholds(self, n: int) -> Footholds:
        """Those of the foot that swings in step ``n``: below where the body will be in the middle of its stance, or
        near there."""
        if n not in self._spots:
            self._look_ahead(n, n + 1)
        return self._spots[n]

    def _look_ahead(self, first: int, last: int) -> None:
        """Judge the footholds of steps from ``first`` up to ``last`` at once; those of steps before are done with."""
        spots = {n: known for n, known in self._spots.items() if n >= first}
        new = [n for n in range(first, last) if n not in spots]
        if new:
            count, numbers = len(self.legs), np.array(new)
            at, heading = self.course.along((numbers + 0.5 * count) * self.step_time)
            legs = np.array(self.order)[numbers % count]
            c, s = np.cos(heading), np.sin(heading)
            x, y = self.offsets[legs, :2].T
            nominal = at + np.stack([c * x - s * y, s * x + c * y], axis=1)
            for n, leg, place in zip(new, legs, nominal, strict=True):
                radius = self.legs.legs[leg].radius
                spots[n] = Footholds(self.ground, place, radius, self.gait.max_slope, self.search)
            Footholds.look_ahead([spots[n] for n in new])
        self._spots = spots

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
        """:func:`plane_through` the ground below all ``feet`` (m, 3)."""
        return plane_through(feet - self.legs.radii[:, None] * [0.0, 0.0, 1.0])

    def over(self, plane: Array, ways: Array) -> Array:
        """:func:`over` a :meth:`plane` as high as the body is, level or along it."""
        return over(plane, ways, self.height + float(self.legs.radii.mean()), self.gait.body == "follow")

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
