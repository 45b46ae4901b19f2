"""Sidewinding: a wave in two planes, whose lowest points stand still while the body runs through them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.curves.base import BodyCurve
from bodyplan.curves.serpenoid import Serpenoid
from bodyplan.errors import InputError
from bodyplan.gaits import chassis
from bodyplan.gaits.base import Gait
from bodyplan.gaits.following import Following, peaks, rest_on_floor, rule_notes, with_kink
from bodyplan.gaits.pace import Pace
from bodyplan.gaits.placing import NO_TURN, SAMPLES, TOLERANCE
from bodyplan.gaits.serpentine import CLOSED, FINE
from bodyplan.gaits.touching import touching
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial import compose, matrix_from_quaternion, quaternion_from_matrix, twists
from bodyplan.spatial.poses import IDENTITY

#: share of the lift within which a contact counts as touching
TOUCH = 0.1
#: share of the speed along the body that what touches may have (mean)
CREEP = 0.35


class Sidewinding(Gait):
    """A compound serpenoid: a wave of ``alpha_yaw`` rad in the yaw plane and one of ``alpha_pitch`` rad in the pitch
    plane, of one ``wavelength`` m, the pitch wave ahead by ``phase`` rad.

    The body runs through the wave at ``speed`` m/s (``direction`` 1: the wave runs tailward), and the wave moves so
    that the centre line at the lowest point under the body's middle is at rest there: a cycle (wavelength / speed)
    displaces the body by the curve's step over a wavelength less wavelength times the tangent at the lowest point.
    **The displacement points along +x**; the body's axis lies at ``direction_angle`` (a fact of the plan) to it. The
    tail end starts at the world's origin, the lowest contact of the whole motion touches the floor.

    Two waves out of phase also roll the curve a little about its axis over every wavelength (to first order pi times
    the product of the two amplitudes times sin(phase)), and joints that only bend cannot undo it: the body's middle is
    kept level, the ends lean by a share of that roll (fact ``roll_per_wavelength``).

    ``start`` m: place of the tail end on the wave at t = 0. ``p``: parameter of eqs. (11)-(16) of paper *acm*.
    ``touch`` m: contacts within this height of the floor count as touching (default: a tenth of the lift). Raises
    InputError for values out of range, or amplitudes for which nothing moves.
    """

    kind: ClassVar[str] = "sidewinding"
    UNITS: ClassVar[Mapping[str, str]] = {
        "alpha_yaw": "angle",
        "alpha_pitch": "angle",
        "wavelength": "length",
        "phase": "angle",
        "speed": "speed",
        "start": "length",
        "touch": "length",
    }

    def __init__(
        self,
        alpha_yaw: float,
        alpha_pitch: float,
        wavelength: float,
        *,
        phase: float = 0.5 * np.pi,
        speed: float = 0.1,
        direction: int = 1,
        start: float = 0.0,
        p: float | None = None,
        touch: float | None = None,
    ) -> None:
        self.alpha_yaw, self.alpha_pitch = number(alpha_yaw, "alpha_yaw"), number(alpha_pitch, "alpha_pitch")
        for field, value in (("alpha_yaw", self.alpha_yaw), ("alpha_pitch", self.alpha_pitch)):
            if value == 0.0:
                raise InputError(f"{field}: must not be 0, sidewinding needs a wave in both planes.")
        self.wavelength = number(wavelength, "wavelength", above=0.0)
        self.phase = number(phase, "phase")
        self.pace = Pace.of(speed, direction, start, 0.0, None)
        self.p = None if p is None else number(p, "p", above=0.5, at_most=1.0)
        self.touch = None if touch is None else number(touch, "touch", above=0.0)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {
            "kind": self.kind,
            "alpha_yaw": self.alpha_yaw,
            "alpha_pitch": self.alpha_pitch,
            "wavelength": self.wavelength,
            "phase": self.phase,
            "speed": self.pace.speed,
            "direction": self.pace.direction,
            "start": self.pace.start,
            "p": self.p,
            "touch": self.touch,
        }

    @property
    def curve(self) -> BodyCurve:
        """The compound serpenoid."""
        pitch = Serpenoid(self.alpha_pitch, self.wavelength, self.wavelength, phase=self.phase, plane="pitch")
        return Serpenoid(self.alpha_yaw, self.wavelength, self.wavelength) + pitch

    def period(self, robot: Robot) -> float:
        """Time of one cycle, s: the wavelength over the speed."""
        return self.wavelength / self.pace.speed

    def fit_at(self, robot: Robot, t: float) -> Any:
        """The :class:`bodyplan.Fit` of the curve at time t s."""
        from bodyplan.fitting import fit

        sigma = float(self.pace.at(np.asarray(number(t, "t", at_least=0.0)))[0])
        return fit(self.curve, robot, p=self.p, start=sigma)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. Raises InputError where the robot can follow no curve or the floor under
        the path is not level; samples beyond a joint limit have the status "limit"."""
        if t[0] < 0.0:
            raise InputError(f"t: the gait starts at t = 0, got {t[0]}.")
        level = _levelled(self)
        following = Following(robot, self.curve, self.p)
        sigma, speed, acceleration = self.pace.at(t)
        joints = following.joints(sigma, speed, acceleration)
        on_curve = following.poses(sigma)
        path = level.path(sigma, t / self.period(robot), 0.5 * following.length)
        base = with_kink(compose(path, on_curve), joints.kink)
        first = self.pace.start
        tail = compose(level.path(np.array([first]), np.zeros(1), 0.5 * following.length), following.poses(np.array([first])))
        rise, heights = rest_on_floor(robot, ground, joints.q, base - np.append(tail[0, :2], np.zeros(5)), "Sidewinding")
        shift = np.array([-tail[0, 0], -tail[0, 1], rise, 0.0, 0.0, 0.0, 0.0])
        base, path = base + shift, path + shift
        lift = float(heights.max(initial=0.0))
        contacts, _, within = touching(heights, TOUCH * lift if self.touch is None else self.touch)
        claims = [following.follows(path, sigma[:, None] + following.stations)]
        data = {"period": self.period(robot), "advance": level.advance, "turn": 0.0, "tolerance": CLOSED}
        claims.append(Claim("periodic", "the cycle closes", data))
        if robot.contacts:
            data = {"height": within, "speed": self.pace.speed, "tolerance": CREEP}
            claims.append(Claim("grips", "what touches the floor is at rest", data))
        notes = rule_notes(following)
        notes.append("The world's x axis is the direction of travel; the body lies at direction_angle to it.")
        notes.append(f"Contacts within {within * 1e3:.3g} mm of the floor count as touching.")
        return Motion(
            robot=robot,
            ground=ground,
            gait=self.to_dict(),
            t=t,
            base=base,
            q=joints.q,
            qd=joints.qd,
            qdd=joints.qdd,
            residual=following.residual(sigma, on_curve),
            status=following.within_limits(joints.q),
            claims=tuple(claims),
            contacts=contacts,
            facts=self._facts(following, level) | {"lift": lift, "contact_height": within},
            notes=tuple(notes),
        )

    def _facts(self, following: Following, level: _Level) -> dict[str, float]:
        period = self.period(following.robot)
        advance = float(np.linalg.norm(level.advance))
        fine = np.linspace(0.0, period, FINE, endpoint=False)
        fit = self.fit_at(following.robot, 0.0)
        return {
            "period": period,
            "advance_per_cycle": advance,
            "sideways_per_cycle": 0.0,
            "advance_per_body_length": advance / following.length,
            "speed": advance / period,
            "no_slip_speed": advance / period,
            "speed_along_body": self.pace.speed,
            "wavelength": self.wavelength,
            "direction_angle": level.angle,
            "roll_per_wavelength": level.roll,
            "body_length": following.length,
            **peaks(following.joints(*self.pace.at(fine))),
            "fit_error": float(fit.error),
            "fit_distance": float(fit.max_distance),
        }


@dataclass(frozen=True, eq=False)
class _Level:
    """The wave laid level, at rest at its lowest points.

    Over a wavelength the curve repeats by a screw motion with ``turn`` and ``step`` (3,), seen from its frame at
    s = 0. ``pose`` (7,) of that frame once the screw is undone: it has the axis level. ``advance`` (3,) m a cycle.
    ``angle`` rad from the body's axis to the advance, positive to the left; ``roll`` rad about the axis over a
    wavelength.
    """

    wavelength: float
    step: Array
    turn: Array
    pose: Array
    advance: Array
    angle: float
    roll: float

    def path(self, sigma: Array, cycles: Array, middle: float) -> Array:
        """Poses (T, 7) of the curve's frame at s = 0: the curve is screwed back as the body runs through it, so that
        the place ``middle`` m of the body stays upright, and moves on by ``advance`` a cycle."""
        out = compose(self.pose, chassis.part_of(self.step, self.turn, -(sigma + middle) / self.wavelength))
        out[:, :3] += cycles[:, None] * self.advance
        return out


@lru_cache(maxsize=16)
def _levelled(gait: Sidewinding) -> _Level:
    curve, wave = gait.curve, gait.wavelength
    at = wave * np.arange(SAMPLES + 1) / SAMPLES
    points, rotations = curve.frames(at, IDENTITY, tolerance=TOLERANCE)
    # log of the step over a wavelength: the curve repeats by exp of it
    screw = twists.log(np.concatenate([points[-1], quaternion_from_matrix(rotations[-1])]))
    if np.linalg.norm(screw[3:]) <= NO_TURN:
        screw = np.concatenate([points[-1], np.zeros(3)])
    v, turn = screw[:3], screw[3:]
    step = twists.exp(screw)[:3]

    def periodic(s: Array) -> tuple[Array, Array, Array]:
        """Points, their derivatives by s, and e_y, all with the screw undone: they repeat with the wavelength."""
        p, R = curve.frames(s, IDENTITY, tolerance=TOLERANCE)
        back = twists.exp(-(s / wave)[:, None] * screw)
        Q = matrix_from_quaternion(back[:, 3:])
        P = np.einsum("sij,sj->si", Q, p) + back[:, :3]
        slope = np.einsum("sij,sj->si", Q, R[:, :, 0]) - (np.cross(turn, P) + v) / wave
        return P, slope, np.einsum("sij,sj->si", Q, R[:, :, 2])

    P, slope, up = periodic(at)
    ahead = points[-1] if not turn.any() else (turn @ points[-1]) * turn
    if np.linalg.norm(ahead) <= 1e-9 * wave * max(1.0, float(turn @ turn)):
        raise InputError("alpha_yaw, alpha_pitch: with these the wave goes nowhere; choose smaller amplitudes.")
    x = ahead / np.linalg.norm(ahead)
    z = up[:-1].mean(axis=0)
    z = z - (z @ x) * x
    z /= np.linalg.norm(z)
    k = int((P[:-1] @ z).argmin())
    low, high = at[k] - wave / SAMPLES, at[k] + wave / SAMPLES
    for _ in range(8):
        s = np.linspace(low, high, 33)
        rising = np.flatnonzero(periodic(s)[1] @ z > 0.0)
        i = int(rising[0]) if len(rising) else 32
        low, high = s[max(i - 1, 0)], s[i]
    here = periodic(np.array([0.5 * (low + high)]))[1][0]
    advance = -gait.pace.direction * wave * here
    advance -= (advance @ z) * z  # rounding
    size = float(np.linalg.norm(advance))
    if size <= 1e-9 * wave:
        raise InputError("alpha_yaw, alpha_pitch, phase: the lowest points run along with the body; nothing moves.")
    heading = advance / size
    turned = np.stack([heading, np.cross(z, heading), z])  # world from curve
    left = np.cross(z, x)
    return _Level(
        wave,
        step,
        turn,
        np.concatenate([np.zeros(3), quaternion_from_matrix(turned)]),
        np.array([size, 0.0, 0.0]),
        float(np.arctan2(heading @ left, heading @ x)),
        float(turn @ x),
    )
