"""Rolling: the body keeps its shape while every section turns about its centre line, over the floor or round a pole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.curves.constant import Constant
from bodyplan.curves.spiral import Spiral
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.following import (
    CLOSED,
    FINE,
    Following,
    Joints,
    closes,
    fit_facts,
    in_time,
    peaks,
    rest_on_floor,
    rolled,
    rule_notes,
    through_cycle,
    with_kink,
)
from bodyplan.gaits.touching import pole_gaps
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial import apply, compose, quaternion_from_matrix, twists
from bodyplan.spatial.poses import IDENTITY

AROUND = ("floor", "pole")
AXES = ("x", "z")
#: 1/m, rad/s: curvature, twist and rate beyond it are refused, their squares would overflow
MOST = 1e6
#: rad: parts of an arc whose direction differs less from its middle's roll without slip
STRAIGHT = 0.35
#: share of the surface speed that what touches may have (mean)
CREEP = 0.4
#: share of the lift, of the radius for a pole, within which a contact counts as touching
TOUCH, TOUCH_POLE = 0.05, 0.5


class Rolling(Gait):
    """A body bent into an arc or a helix that stays as it is in space while every section rolls about its centre line:
    ``kappa_y = k cos(twist s + rate t + phase)``, ``kappa_p = -k sin(twist s + rate t + phase)``, eq. (5) of paper
    *acm* with a direction that turns.

    ``curvature`` k != 0 and ``twist`` (the torsion) in 1/m, ``rate`` != 0 in rad/s. Sections turn by -rate about the
    direction to the head, so their surface runs at rate times the radius r of the contacts. ``around``:

    * ``"floor"``: with twist 0 an arc lies flat, its middle along +x, and moves by rate r along +y (its middle rolls
      without slip; the slip grows with the arc's angle). A helix lies with its axis along +x, the middle of the body
      lowest, and moves by rate r across the tangent at its lowest points, where all coils roll without slip.
    * ``"pole"``: the helix (or ring) grips a pole of radius |k| / (k^2 + twist^2) - r from outside and climbs: by
      rate r |k| sign(twist) / sqrt(k^2 + twist^2) along the pole (sign(0) = 1), while it turns about it so that nothing
      slips. ``axis``: the pole,
      and so the head, points along "x" or up "z"; it goes through x = y = 0.

    The lowest contact of the whole motion touches the floor; with ``around="floor"`` the tail end starts at the
    world's origin. ``phase`` rad: direction of the bend at t = 0. ``p``: parameter of eqs. (11)-(16). ``touch`` m:
    contacts within this distance count as touching (default: a twentieth of the lift; half a radius from a pole).

    The joints are exact in time; their period is 2 pi / |rate|. Raises InputError for values out of range, and when
    planned for a robot without round contacts, or a pole with nothing left to grip.
    """

    kind: ClassVar[str] = "rolling"
    UNITS: ClassVar[Mapping[str, str]] = {
        "curvature": "curvature",
        "rate": "angular_rate",
        "twist": "curvature",
        "phase": "angle",
        "touch": "length",
    }

    def __init__(
        self,
        curvature: float,
        rate: float,
        twist: float = 0.0,
        *,
        around: str = "floor",
        axis: str = "x",
        phase: float = 0.0,
        p: float | None = None,
        touch: float | None = None,
    ) -> None:
        self.curvature, self.rate = number(curvature, "curvature"), number(rate, "rate")
        for field, value in (("curvature", self.curvature), ("rate", self.rate)):
            if value == 0.0:
                raise InputError(f"{field}: must not be 0.")
        self.twist = number(twist, "twist")
        for field, value in (("curvature", self.curvature), ("rate", self.rate), ("twist", self.twist)):
            if abs(value) > MOST:
                raise InputError(f"{field}: must be at most {MOST:g} either way, got {value!r}.")
        if around not in AROUND:
            raise UnknownNameError("around", around, AROUND)
        if axis not in AXES:
            raise UnknownNameError("axis", axis, AXES)
        if around == "floor" and axis != "x":
            raise InputError(f"axis: on the floor the helix lies along x, got {axis!r}; 'z' needs around='pole'.")
        self.around, self.axis = around, axis
        self.phase = number(phase, "phase")
        self.p = None if p is None else number(p, "p", above=0.5, at_most=1.0)
        self.touch = None if touch is None else number(touch, "touch", above=0.0)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        names = ("curvature", "rate", "twist", "around", "axis", "phase", "p", "touch")
        return {"kind": self.kind, **{name: getattr(self, name) for name in names}}

    def curve_at(self, t: float, length: float = 1.0) -> Spiral:
        """The body curve at time t s."""
        return Spiral(self.curvature, self.twist, length, phase=self.phase + self.rate * t)

    def period(self, robot: Robot, ground: Ground | None = None) -> float:
        """Time of one turn of the sections, s."""
        return 2.0 * np.pi / abs(self.rate)

    def fit_at(self, robot: Robot, t: float) -> Any:
        """The :class:`bodyplan.Fit` of the body curve at time t s."""
        from bodyplan.fitting import fit

        length = _rolled(self, robot).following.length
        return fit(self.curve_at(number(t, "t", at_least=0.0), length), robot, p=self.p)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. Raises InputError where the robot can follow no curve or has no round
        contacts, and where the floor under the path is not level; samples beyond a joint limit have the status
        "limit"."""
        from_zero(t)
        body = _rolled(self, robot)
        following = body.following
        joints = body.joints(t)
        path = compose(twists.exp(t[:, None] * body.motion), body.pose)
        base = with_kink(compose(path, rolled(-self.rate * t)), joints.kink)
        rise, heights = rest_on_floor(robot, ground, joints.q, base, "Rolling")
        base[:, 2] += rise
        path[:, 2] += rise
        up = np.array([0.0, 0.0, rise])
        step = twists.exp(self.period(robot) * body.motion)
        cycle = through_cycle(self.period(robot))
        places = np.broadcast_to(following.stations, (len(t), len(following.stations)))
        grip: dict[str, Any] = {"speed": abs(self.rate) * body.radius, "tolerance": CREEP}
        contacts = None
        if self.around == "pole":
            grip["pole"] = {"point": up, "direction": body.axis, "radius": body.pole}
            gaps = pole_gaps(robot, joints.q, base, up, body.axis, body.pole)
            grip["height"] = TOUCH_POLE * body.radius if self.touch is None else self.touch
            contacts = gaps <= grip["height"]
        elif self.twist == 0.0:
            grip |= {"height": float(heights.max()) + CLOSED, "contacts": body.middle}
        else:
            grip["height"] = TOUCH * float(heights.max()) if self.touch is None else self.touch
            contacts = heights <= grip["height"]
        claims = (
            following.follows(
                path,
                places,
                following.farthest(0.0, body.joints(cycle), -self.rate * cycle),
                "frames on the curve that stays in space",
            ),
            closes(self.period(robot), apply(step, -up) + up, self.period(robot) * body.motion[3:]),
            Claim("grips", "what touches is at rest", grip),
        )
        return following.motion(
            self,
            ground,
            t,
            base,
            joints,
            contacts=contacts,
            residual=np.full(len(t), body.residual),
            claims=claims,
            facts=self._facts(body, contacts is not None, float(heights.max()), grip["height"]),
            notes=tuple(self._notes(body)),
        )

    def _facts(self, body: _Roll, lifts: bool, lift: float, within: float) -> dict[str, float]:
        period = self.period(body.following.robot)
        bend = self.curvature**2 + self.twist**2
        moved = float(np.linalg.norm(body.motion[:3])) if self.around == "floor" else abs(body.climb)
        out = {
            "period": period,
            "advance_per_cycle": moved * period,
            "advance_per_body_length": moved * period / body.following.length,
            "speed": moved,
            "no_slip_speed": moved,
            "surface_speed": abs(self.rate) * body.radius,
            "helix_radius": abs(self.curvature) / bend,
            "helix_pitch": 2.0 * np.pi * abs(self.twist) / bend,
            "turns_of_helix": np.sqrt(bend) * body.following.length / (2.0 * np.pi),
            "body_length": body.following.length,
            **peaks(body.joints(np.linspace(0.0, period, FINE, endpoint=False))),
            **fit_facts(self.fit_at(body.following.robot, 0.0)),
            "lift": lift,
        }
        if lifts:
            out["contact_height"] = within
        if self.around == "pole":
            turning = float(body.motion[3:] @ body.axis)
            out |= {"pole_radius": body.pole, "climbing_speed": body.climb, "turning_rate": turning}
        else:
            out["direction_angle"] = float(np.arctan2(body.motion[1], body.motion[0]))
        return out

    def _notes(self, body: _Roll) -> list[str]:
        notes = rule_notes(body.following)
        if self.around == "pole":
            notes.append(
                f"The pole (radius {body.pole * 1e3:.4g} mm, through x = y = 0) is no ground: the plan says how the "
                "body climbs it, physics does not try it."
            )
        elif self.twist == 0.0:
            notes.append("Only the middle of an arc rolls without slip: its ends point elsewhere.")
        elif np.hypot(self.curvature, self.twist) * body.following.length < 4.0 * np.pi:
            notes.append("Warning: less than two coils touch the floor; the body may tip over its lowest point.")
        return notes


@dataclass(frozen=True, eq=False)
class _Roll:
    """A :class:`Rolling` fitted to a robot. ``pose`` (7,) of the curve at rest at t = 0 (its frame at the tail),
    ``motion`` (6,) the twist (m/s, rad/s) in the world that it moves on with; ``radius`` m of the contacts; ``axis``
    (3,) of the helix; ``pole`` m: radius of the pole it would grip; ``climb`` m/s along the axis; ``middle``: contacts
    on the straight part of an arc; ``residual`` m: how much the turning curve and the one at rest differ."""

    gait: Rolling
    following: Following
    pose: Array
    motion: Array
    radius: float
    axis: Array
    pole: float
    climb: float
    middle: list[str]
    residual: float

    @classmethod
    def of(cls, gait: Rolling, robot: Robot) -> _Roll:
        """InputError where the robot follows no curve, has no round contacts, or the pole would have no radius."""
        curve = Spiral(gait.curvature, gait.twist, phase=gait.phase)
        following = Following(robot, curve, gait.p)
        following.must_bend(Constant(0.0, gait.curvature, gait.curvature), 0.0, "Rolling")
        length = following.length
        radii = [c.radius for c in robot.contacts if c.shape in ("capsule", "sphere")]
        if not radii:
            raise InputError(
                f"Rolling: needs round contacts (capsules or spheres) to roll on; {robot.name!r} has none."
            )
        radius = max(radii)
        if gait.around == "floor" and gait.twist == 0.0:
            pose, motion, axis, pole, climb = _arc(gait, length, radius)
        else:
            pose, motion, axis, pole, climb = _helix(gait, curve, length, radius)
        rest = robot.forward(np.zeros(robot.n))
        at = {c.name: float(apply(rest[c.frame], c.points().mean(axis=0))[0]) for c in robot.contacts}
        middle = [name for name, x in at.items() if abs(x - 0.5 * length) * abs(gait.curvature) <= STRAIGHT]
        nearest = min(at, key=lambda name: abs(at[name] - 0.5 * length))
        differ = _difference(gait, length)
        return cls(gait, following, pose, motion, radius, axis, pole, climb, middle or [nearest], differ)

    def joints(self, t: Array) -> Joints:
        """Joints at times t (T,): the bends turn, d(kappa_p, kappa_y)/dt = rate (-kappa_y, kappa_p)."""
        rate, nodes = self.gait.rate, self.following.rule.nodes
        whole = self.following.curve.integral(0.0, nodes)
        c, s = np.cos(rate * t)[:, None], np.sin(rate * t)[:, None]
        phi = np.stack([c * whole.kappa_p - s * whole.kappa_y, c * whole.kappa_y + s * whole.kappa_p], axis=-1)
        turned = np.stack([-phi[..., 1], phi[..., 0]], axis=-1)
        bends = self.following.rule.apply(phi, rate * turned, -(rate**2) * phi)
        return in_time(bends, np.ones(len(t)), np.zeros(len(t)))


def _arc(gait: Rolling, length: float, radius: float) -> tuple[Array, Array, Array, float, float]:
    """Pose, motion, axis, pole radius and climb of an arc that lies flat, its middle along +x."""
    # the frame at the tail rolled so that the bend is in the plane, then the half angle back
    half = 0.5 * gait.curvature * length
    back = np.array([0.0, 0.0, 0.0, np.cos(0.5 * half), 0.0, 0.0, -np.sin(0.5 * half)])
    pose = compose(back, rolled(np.asarray(-gait.phase)))
    motion = np.array([0.0, gait.rate * radius, 0.0, 0.0, 0.0, 0.0])
    return pose, motion, np.array([0.0, 0.0, 1.0]), 0.0, 0.0


def _helix(gait: Rolling, curve: Spiral, length: float, radius: float) -> tuple[Array, Array, Array, float, float]:
    """The same for a helix, or a ring round a pole."""
    points, frames = curve.frames(np.array([0.0, 0.5 * length]), IDENTITY)
    k, twist = gait.curvature, gait.twist
    bend = k * k + twist * twist
    # normal n (towards the axis where k > 0) and binormal b, by eq. (1): k n = kappa_y e_p - kappa_p e_y
    angle = gait.phase + twist * np.array([0.0, 0.5 * length])
    n = np.cos(angle)[:, None] * frames[:, :, 1] + np.sin(angle)[:, None] * frames[:, :, 2]
    b = np.cross(frames[:, :, 0], n)
    darboux = (twist * frames[0, :, 0] + k * b[0]) / np.sqrt(bend)
    axis = np.copysign(1.0, twist) * darboux if twist else darboux
    centre = points + (k / bend) * n
    inwards = np.copysign(1.0, k) * n[1]  # at the middle of the body, towards the axis
    # the helix in axes of its own: along the axis, across, and up from the middle of the body
    own = np.stack([axis, np.cross(inwards, axis), inwards])
    world = own if gait.axis == "x" else own[[1, 2, 0]]
    along = world @ axis
    place = -points[0] if gait.around == "floor" else -centre[0]
    pose = compose(np.concatenate([np.zeros(3), quaternion_from_matrix(world)]), [*place, 1.0, 0.0, 0.0, 0.0])
    pole = abs(k) / bend - radius
    if gait.around == "floor":
        tangent = world @ frames[1, :, 0]
        v = gait.rate * radius * np.cross([0.0, 0.0, 1.0], tangent)
        return pose, np.concatenate([v, np.zeros(3)]), along, pole, 0.0
    if pole <= 0.0:
        raise InputError(
            f"curvature, twist: the helix has radius {abs(k) / bend:.4g} m, the body {radius:.4g} m: no pole fits in."
        )
    # no slip at the pole: climb along the axis, turn about it
    runs = gait.rate * radius * np.cross(frames[1, :, 0], inwards)
    climb = float(runs @ axis)
    turning = float(runs @ np.cross(axis, -inwards)) / pole
    return pose, np.concatenate([climb * along, turning * along]), along, pole, climb


def _difference(gait: Rolling, length: float) -> float:
    """m: largest difference of the head's place between the curve that turns, rolled back, and the curve at rest."""
    head = np.array([length])
    still = Spiral(gait.curvature, gait.twist, phase=gait.phase).frames(head, IDENTITY)[0][0]
    off = []
    for turned in np.linspace(0.0, 2.0 * np.pi, 9):
        point = Spiral(gait.curvature, gait.twist, phase=gait.phase + turned).frames(head, IDENTITY)[0][0]
        off.append(apply(rolled(np.asarray(-turned)), point) - still)
    return float(np.linalg.norm(off, axis=-1).max())


@lru_cache(maxsize=16)
def _rolled(gait: Rolling, robot: Robot) -> _Roll:
    return _Roll.of(gait, robot)
