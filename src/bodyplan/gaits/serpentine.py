"""Serpentine movement: the body slides along a curve, so that the wave runs through it (paper *acm*, sections II-V)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.curves.base import BodyCurve
from bodyplan.curves.constant import Constant
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits import chassis
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.course import course_of
from bodyplan.gaits.following import (
    CLOSED,
    FINE,
    FITS,
    SLIP,
    Following,
    Joints,
    body_curve,
    closes,
    fit_facts,
    frames_of,
    peaks,
    rest_on_floor,
    rule_notes,
    with_kink,
)
from bodyplan.gaits.pace import Pace
from bodyplan.gaits.placing import SAME_WAY, Placing, place
from bodyplan.gaits.touching import touching
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial import compose, inverse, quaternion_exp, rotate
from bodyplan.units import to_si

BASES = ("follow", "chassis")
#: samples of a cycle for the mean frame of the virtual chassis
EVEN = 256
#: each is a curve inside a curve
MOST_CHANGES = 10


class Serpentine(Gait):
    """A body that moves along a curve: at time t it lies on arc lengths [sigma(t), sigma(t) + its length].

    ``curve``: a :class:`bodyplan.BodyCurve`, or its table. ``speed`` m/s along the body; ``direction`` 1 (the wave runs
    tailward and the body forward) or -1 (backward). ``start`` m: sigma at t = 0. ``ramp`` s: smooth start from rest,
    ``stop`` s: at rest again from then on (both C2: rates and accelerations of the joints do not jump).

    ``steer`` 1/m: offset of kappa_y. One number: the path turns by steer times a wavelength a cycle, to the left where
    positive. Or pairs (time s, value): from that time on the leading end takes that offset, within ``change_length``,
    and the body follows. ``changes``: pairs (time s, curve): the leading end goes over to the next curve within
    ``change_length`` m (default: a wavelength of the curve gone over to, or half the body where it has none) and the
    body follows; joint rates and accelerations do not jump. All of it is one curve at rest in space, without twist.

    ``base``: "follow" (no slip: the tail end lies on the curve) or "chassis" (virtual chassis: the mean body frame
    moves evenly, a periodic curve only). The joints are the same. The curve is laid level with its displacement over a
    period along +x (see :func:`bodyplan.gaits.placing.place`), the tail end starts at the world's origin, and the
    lowest contact of the whole motion touches the floor. ``p``: parameter of eqs. (11)-(16), default the Gauss node.
    ``touch`` m: contacts that come down to within this height count as touching (see
    :func:`bodyplan.gaits.touching.touching`); default a fifth of the lift.

    Facts of a gait that repeats: ``advance_per_cycle`` and ``sideways_per_cycle`` m are the x and y of the base's
    displacement over the cycle from t = 0, ``turn_per_cycle`` rad its turn about z. ``no_slip_speed`` m/s is that of
    the centre of mass (where there are no masses: the mean of the frames): its displacement over the cycle from t = 0
    by the period; ``speed`` is the same with the sign of ``direction``, along the axis for a spiral. Where the gait
    turns, base and centre are on circles of their own. A body that goes backward goes back along its curve: it turns by
    minus steer times a wavelength.

    Joint angles, rates and accelerations are exact in time, by the rule of :func:`bodyplan.fitting.rule`. Raises
    InputError for values out of range.
    """

    kind: ClassVar[str] = "serpentine"
    #: texts with units inside ``steer``, ``changes`` and ``curve`` are read there
    UNITS: ClassVar[Mapping[str, str]] = {
        "speed": "speed",
        "ramp": "time",
        "stop": "time",
        "change_length": "length",
        "start": "length",
        "touch": "length",
    }

    def __init__(
        self,
        curve: BodyCurve | Mapping[str, Any],
        speed: float = 0.1,
        direction: int = 1,
        steer: float | Sequence[tuple[float, float]] = 0.0,
        *,
        base: str = "follow",
        ramp: float = 0.0,
        stop: float | None = None,
        changes: Sequence[tuple[float, BodyCurve | Mapping[str, Any]]] = (),
        change_length: float | None = None,
        p: float | None = None,
        start: float = 0.0,
        touch: float | None = None,
    ) -> None:
        self.curve = body_curve(curve, "curve")
        self.pace = Pace.of(speed, direction, start, ramp, stop)
        if base not in BASES:
            raise UnknownNameError("base", base, BASES)
        self.base = base
        self.steer: float | tuple[tuple[float, float], ...]
        if isinstance(steer, (list, tuple)) and not steer:
            self.steer = 0.0  # no change: straight on
        elif isinstance(steer, (list, tuple)):
            self.steer = tuple(
                (to_si(a, "time", "steer"), to_si(b, "curvature", "steer")) for a, b in _pairs(steer, "steer")
            )
        else:
            self.steer = to_si(steer, "curvature", "steer")
        self.changes = tuple(
            (to_si(a, "time", "changes"), body_curve(b, "changes")) for a, b in _pairs(changes, "changes")
        )
        for field, rows in (("steer", self.steer), ("changes", self.changes)):
            if isinstance(rows, tuple) and any(b[0] <= a[0] for a, b in pairwise(rows)):
                raise InputError(f"{field}: times must increase, got {[row[0] for row in rows]}.")
            if isinstance(rows, tuple) and rows and rows[0][0] < 0.0:
                raise InputError(f"{field}: times must be >= 0, got {rows[0][0]}.")
            if isinstance(rows, tuple) and rows and self.pace.stop is not None and rows[-1][0] >= self.pace.stop:
                raise InputError(
                    f"{field}: times must be < stop, {self.pace.stop} s, after which the body goes nowhere; got "
                    f"{rows[-1][0]}."
                )
        if len(self.changes) > MOST_CHANGES:
            raise InputError(f"changes: at most {MOST_CHANGES}, got {len(self.changes)}.")
        self.change_length = None if change_length is None else number(change_length, "change_length", above=0.0)
        self.p = None if p is None else number(p, "p", above=0.5, at_most=1.0)
        self.touch = None if touch is None else number(touch, "touch", above=0.0)
        if base == "chassis" and not self._repeats:
            raise InputError(
                "base: 'chassis' needs a gait that repeats: a periodic curve, no changes, and one number for steer."
            )

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``; curves as tables."""
        return {"kind": self.kind, "curve": self.curve.to_dict(), **self._options()}

    def _options(self) -> dict[str, Any]:
        """All options but the curve."""
        return {
            "speed": self.pace.speed,
            "direction": self.pace.direction,
            "steer": [list(row) for row in self.steer] if isinstance(self.steer, tuple) else self.steer,
            "base": self.base,
            "ramp": self.pace.ramp,
            "stop": self.pace.stop,
            "changes": [[time, curve.to_dict()] for time, curve in self.changes],
            "change_length": self.change_length,
            "p": self.p,
            "start": self.pace.start,
            "touch": self.touch,
        }

    @property
    def _repeats(self) -> bool:
        """True where the curve under way is periodic."""
        fixed = not self.changes and not isinstance(self.steer, tuple)
        return fixed and self.curve.untwisted().period is not None

    def period(self, robot: Robot, ground: Ground | None = None) -> float | None:
        """Time of one cycle, s: a period of the curve over the speed; None where nothing repeats."""
        if not self._repeats or not self.pace.steady:
            return None
        repeat = self._body(robot).placing.period
        return None if repeat is None else repeat / self.pace.speed

    def course(self, robot: Robot) -> BodyCurve:
        """The curve that the whole motion runs along, without twist: with steering and changes, for this robot."""
        return self._body(robot).following.curve

    def fit_at(self, robot: Robot, t: float) -> Any:
        """The :class:`bodyplan.Fit` of the curve under way at time t s."""
        from bodyplan.fitting import fit

        body = self._body(robot)
        sigma = float(self.pace.at(np.asarray(number(t, "t", at_least=0.0)))[0])
        return fit(body.following.curve, robot, p=self.p, start=sigma)

    def _body(self, robot: Robot) -> SerpentineBody:
        return _fitted(self, robot)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. Raises InputError where the robot can follow no curve (see
        :func:`bodyplan.fitting.mechanism`) or the floor under the path is not level; samples beyond a joint limit have
        the status "limit"."""
        from_zero(t)
        body = self._body(robot)
        following = body.following
        sigma, speed, acceleration = self.pace.at(t)
        joints = following.joints(sigma, speed, acceleration)
        on_curve = following.poses(sigma)
        base = body.base(sigma, joints, on_curve)
        rise, heights = rest_on_floor(robot, ground, joints.q, base, type(self).__name__)
        base[:, 2] += rise
        placing = body.placing.raised(rise)
        pose = body.pose + rise * np.eye(7)[2]
        contacts, lift, within = touching(heights, self.touch, self._covers(robot, t))
        facts = body.facts(placing, rise, t)
        facts["lift"] = lift
        if contacts is not None:
            facts["contact_height"] = within
        return following.motion(
            self,
            ground,
            t,
            base,
            joints,
            contacts=contacts,
            residual=following.residual(sigma, on_curve),
            claims=tuple(
                self._claims(body, placing, pose, sigma, speed, base, on_curve, joints.kink, contacts is None)
            ),
            facts=facts,
            notes=tuple(self._notes(body, placing, within if contacts is not None else None)),
        )

    def _covers(self, robot: Robot, t: Array) -> bool:
        """True where the samples cover a cycle."""
        period = self.period(robot)
        return period is not None and float(t[-1] - t[0]) >= 0.95 * period

    def _claims(
        self,
        body: SerpentineBody,
        placing: Placing,
        pose: Array,
        sigma: Array,
        speed: Array,
        base: Array,
        on_curve: Array,
        kink: Array,
        flat: bool,
    ) -> list[Claim]:
        following = body.following
        places = sigma[:, None] + following.stations
        claims = []
        if self.base == "follow":
            claims.append(following.follows(pose, places, body.farthest(sigma)))
            data = {"frames": list(following.frames), "speed": speed, "tolerance": SLIP}
            claims.append(Claim("no_slip", "frames move along the body", data))
        else:
            # the curve moves with the chassis
            path = compose(base, inverse(with_kink(on_curve, kink)))
            claims.append(following.follows(path, places, body.farthest(sigma)))
        period = self.period(body.following.robot)
        if period is not None:
            claims.append(closes(period, *_cycle(placing, self.pace.direction)))
        if flat and following.robot.contacts:
            claims.append(Claim("on_floor", "the body lies on the floor", {"tolerance": CLOSED}))
        return claims

    def _notes(self, body: SerpentineBody, placing: Placing, within: float | None) -> list[str]:
        notes = rule_notes(body.following)
        notes.append(
            "The curve is laid level: its displacement over a period points along +x."
            if placing.period is not None
            else "The curve does not repeat: it is laid by the stretch under the body at the start."
        )
        climb = abs(float(placing.displacement[2]))
        if placing.period is not None and climb > 1e-6 * placing.period:
            notes.append(f"The curve leaves the level by {climb * 1e3:.3g} mm a period.")
        if within is not None:
            notes.append(f"Contacts up to {within * 1e3:.3g} mm above the floor count as touching.")
        if self.base == "chassis":
            notes.append("Virtual chassis: the mean body frame moves evenly; the frames are not free of slip.")
        return notes


@dataclass(frozen=True, eq=False)
class SerpentineBody:
    """A :class:`Serpentine` fitted to a robot: the curve under way, and where it lies. ``placing``: of the curve that
    the body begins on; ``pose`` (7,) of the frame at s = 0 of the curve under way, in the end without the rise to the
    floor. Both are one where nothing changes between s = 0 and the body."""

    gait: Serpentine
    following: Following
    placing: Placing
    pose: Array

    @classmethod
    def of(cls, gait: Serpentine, robot: Robot) -> SerpentineBody:
        """InputError where the robot follows no curve."""
        before = gait.curve.untwisted()
        following = Following(robot, before, gait.p)
        length = following.length
        course = course_of(gait, before, length)
        for curve in (before, *(after.untwisted() for _, after in gait.changes)):
            following.must_bend(curve, gait.pace.start, type(gait).__name__)
        first = before + Constant(kappa_y=gait.steer) if isinstance(gait.steer, float) and gait.steer else before
        placing = place(first, gait.pace.start, length)
        following = Following(robot, course, gait.p)
        pose = placing.pose
        if gait.changes or isinstance(gait.steer, tuple):
            # the two curves have one frame where the tail begins
            at = np.array([gait.pace.start])
            pose = compose(pose, compose(frames_of(first, at), inverse(frames_of(course, at)))[0])
        return cls(gait, following, placing, pose)

    def base(self, sigma: Array, joints: Joints, on_curve: Array) -> Array:
        """Base poses (T, 7) with the tail at ``sigma`` (T,) m, the frames of the curve there ``on_curve`` (T, 7)."""
        if self.gait.base == "follow":
            return with_kink(compose(self.pose, on_curve), joints.kink)
        return self._evenly(sigma, joints.q)

    def facts(self, placing: Placing, rise: float, t: Array) -> dict[str, float]:
        """Numbers of the plan, SI; ``placing`` as it lies in the end, ``rise`` m above that of this body."""
        gait, following = self.gait, self.following
        out = {"body_length": following.length, "speed_along_body": gait.pace.speed}
        period = gait.period(following.robot)
        if placing.period is not None and gait._repeats:
            wave = placing.period
            time = wave / gait.pace.speed
            advance, turn = _cycle(placing, gait.pace.direction)
            sigma = np.array([gait.pace.start])
            joints = following.joints(sigma, np.ones(1), np.zeros(1))
            base = self.base(sigma, joints, following.poses(sigma))
            base[:, 2] += rise
            centre = compose(base, chassis.mean_frames(following.robot, joints.q))
            moved, travelled = (rotate(quaternion_exp(turn), x) + advance - x for x in (base[0, :3], centre[0, :3]))
            size = float(np.linalg.norm(travelled))
            # a spiral turns about x, which moves its centre round but not along
            coils = abs(turn[0]) > SAME_WAY * float(np.linalg.norm(turn))
            speed = (abs(float(travelled[0])) if coils else size) / time
            out |= {
                "wavelength": wave,
                "advance_per_cycle": float(moved[0]),
                "sideways_per_cycle": float(moved[1]),
                "advance_per_body_length": float(moved[0]) / following.length,
                "speed": gait.pace.direction * speed,
                "no_slip_speed": size / time,
                "turn_per_cycle": float(turn[2]),
            }
            if period is not None:
                out["period"] = period
        fine = np.linspace(0.0, period, FINE, endpoint=False) if period else np.linspace(t[0], t[-1], FINE)
        out |= peaks(following.joints(*gait.pace.at(fine)))
        return out | fit_facts(gait.fit_at(following.robot, float(t[0])))

    def farthest(self, sigma: Array) -> float:
        """m: largest distance that fits leave to the curve where the tail comes to, ``sigma`` (T,) m, or over a period
        where the curve has one."""
        from bodyplan.fitting import fit

        curve = self.following.curve
        low, high = float(sigma.min()), float(sigma.max())
        if curve.period is not None:
            low, high = self.gait.pace.start, self.gait.pace.start + curve.period
        count = int(np.clip((high - low) / self.following.unit, FITS, FINE))
        found = fit(curve, self.following.robot, p=self.gait.p, start=np.linspace(low, high, count))
        return float(found.max_distance.max())

    @cached_property
    def _middle(self) -> Array:
        """Pose (7,) of the mean body frame at sigma = start, when it moves evenly: the mean over a cycle of where the
        body that follows the curve has it, less its even motion."""
        placing = self.placing
        assert placing.period is not None
        share = np.arange(EVEN) / EVEN
        sigma = self.gait.pace.start + share * placing.period
        joints = self.following.joints(sigma, np.ones(EVEN), np.zeros(EVEN))
        base = with_kink(compose(placing.pose, self.following.poses(sigma)), joints.kink)
        frames = compose(base, chassis.mean_frames(self.following.robot, joints.q))
        return chassis.mean_pose(compose(chassis.part_of(placing.advance, placing.turn, -share), frames))

    def _evenly(self, sigma: Array, q: Array) -> Array:
        """Base poses (T, 7) with which the mean body frame moves evenly with sigma."""
        placing = self.placing
        assert placing.period is not None
        share = (sigma - self.gait.pace.start) / placing.period
        mean = compose(chassis.part_of(placing.advance, placing.turn, share), self._middle)
        return compose(mean, inverse(chassis.mean_frames(self.following.robot, q)))


def _cycle(placing: Placing, direction: int) -> tuple[Array, Array]:
    """``advance`` (3,) m and ``turn`` (3,) rad of a cycle, ``p -> R(turn) p + advance``: the motion over a period of
    the curve, its inverse for a body that goes backward."""
    advance, turn = placing.advance, placing.turn
    if direction < 0:
        advance, turn = rotate(quaternion_exp(-turn), -advance), -turn
    return advance, turn


@lru_cache(maxsize=16)
def _fitted(gait: Serpentine, robot: Robot) -> SerpentineBody:
    return SerpentineBody.of(gait, robot)


def _pairs(rows: Any, field: str) -> list[tuple[Any, Any]]:
    if not isinstance(rows, (list, tuple)):
        raise InputError(f"{field}: expected pairs (time, value), got {rows!r}.")
    for row in rows:
        if not isinstance(row, (list, tuple)) or len(row) != 2:
            raise InputError(f"{field}: expected pairs (time, value), got {row!r}.")
    return [(row[0], row[1]) for row in rows]
