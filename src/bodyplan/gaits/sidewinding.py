"""Sidewinding: a wave in two planes, whose lowest points stand still while the body runs through them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.curves.base import BodyCurve
from bodyplan.curves.constant import Constant
from bodyplan.curves.serpenoid import Serpenoid
from bodyplan.errors import InputError
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.following import (
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
from bodyplan.gaits.pace import Pace
from bodyplan.gaits.placing import SAMPLES, TOLERANCE, across
from bodyplan.gaits.touching import touching
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial import GAUSS_NODES, compose, frames_from_nodes, quaternion_from_matrix
from bodyplan.spatial.poses import IDENTITY

#: share of the lift within which a contact counts as touching
TOUCH = 0.1
#: share of the speed along the body that what touches may have (mean)
CREEP = 0.4
#: steps over half a wavelength with which the torsion is followed from small amplitudes on
HALF = 64


class Sidewinding(Gait):
    """A compound serpenoid: a wave of ``alpha_yaw`` rad in the yaw plane and one of ``alpha_pitch`` rad in the pitch
    plane, of one ``wavelength`` m, the pitch wave ahead by ``phase`` rad.

    The body runs through the wave at ``speed`` m/s (``direction`` 1: the wave runs tailward), and the wave moves so
    that the centre line is at rest at its lowest points: a cycle (wavelength / speed) displaces the body by the curve's
    step over a wavelength less wavelength times the tangent at a lowest point. **The displacement points along +x**;
    the body's axis lies at ``direction_angle`` (a fact of the plan) to it. The tail end starts at the world's origin,
    the lowest contact of the whole motion touches the floor.

    Two waves out of phase roll the curve about its axis over every wavelength, to first order by
    pi alpha_yaw alpha_pitch sin(phase). A torsion ``.torsion`` (rad/m) undoes that and keeps the wave level. Joints
    that only bend follow it all the same: their planes of bending are turned, place by place, from the middle of the
    body on.

    ``start`` m: place of the tail end on the wave at t = 0. ``p``: parameter of eqs. (11)-(16) of paper *acm*.
    ``touch`` m: contacts that come down to within this height count as touching (default: a tenth of the lift; see
    :func:`bodyplan.gaits.touching.touching`). Raises InputError for values out of range, or amplitudes with which the
    wave is not level or nothing moves.
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
            if abs(value) > np.pi:
                raise InputError(f"{field}: must be within half a turn, 3.14159 rad, got {value:.6g} rad.")
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
    def torsion(self) -> float:
        """tau, rad/m, that keeps the wave level."""
        return _levelled(self).torsion

    def curve(self, at: float = 0.0) -> BodyCurve:
        """The wave from its place ``at`` m on: the compound serpenoid with the torsion that keeps it level."""
        return _wave(self, self.torsion, at)

    def period(self, robot: Robot, ground: Ground | None = None) -> float:
        """Time of one cycle, s: the wavelength over the speed."""
        return self.wavelength / self.pace.speed

    def fit_at(self, robot: Robot, t: float) -> Any:
        """The :class:`bodyplan.Fit` of the wave at time t s; its s = 0 is the middle of the body."""
        from bodyplan.fitting import fit

        middle = 0.5 * _sidewinder(self, robot).following.length
        sigma = float(self.pace.at(np.asarray(number(t, "t", at_least=0.0)))[0])
        return fit(self.curve(sigma + middle), robot, p=self.p, start=-middle)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. Raises InputError where the robot can follow no curve or the floor under
        the path is not level; samples beyond a joint limit have the status "limit"."""
        from_zero(t)
        body, level = _sidewinder(self, robot), _levelled(self)
        following = body.following
        sigma, speed, acceleration = self.pace.at(t)
        joints = body.joints(sigma, speed, acceleration)
        on_curve = following.poses(sigma)
        # the wave starts where the tail end is at the origin
        first = compose(level.pose, following.poses(np.array([self.pace.start]))[0])
        path = np.repeat(level.pose[None], len(t), axis=0)
        path[:, :3] += (t / self.period(robot))[:, None] * level.drift - first[:3]
        base = with_kink(compose(compose(path, on_curve), rolled(-body.turned(sigma))), joints.kink)
        rise, heights = rest_on_floor(robot, ground, joints.q, base, "Sidewinding")
        base[:, 2] += rise
        path[:, 2] += rise
        lift = float(heights.max(initial=0.0))
        covers = float(t[-1] - t[0]) >= 0.95 * self.period(robot)
        contacts, _, within = touching(heights, TOUCH * lift if self.touch is None else self.touch, covers)
        # the torsion does not move the points of the curve
        cycle = self.pace.at(through_cycle(self.period(robot)))
        farthest = following.farthest(cycle[0], body.joints(*cycle), -body.turned(cycle[0]))
        claims = [following.follows(path, sigma[:, None] + following.stations, farthest)]
        claims.append(closes(self.period(robot), level.advance, 0.0))
        if robot.contacts:
            data = {"height": within, "speed": self.pace.speed, "tolerance": CREEP}
            claims.append(Claim("grips", "what touches the floor is at rest", data))
        notes = rule_notes(following)
        notes.append("The world's x axis is the direction of travel; the body lies at direction_angle to it.")
        notes.append(f"A torsion of {level.torsion:.4g} rad/m keeps the wave level and turns the planes of bending.")
        notes.append(f"Contacts up to {within * 1e3:.3g} mm above the floor count as touching.")
        return following.motion(
            self,
            ground,
            t,
            base,
            joints,
            contacts=contacts,
            residual=following.residual(sigma, on_curve),
            claims=tuple(claims),
            facts=self._facts(body, level) | {"lift": lift, "contact_height": within},
            notes=tuple(notes),
        )

    def _facts(self, body: _Sidewinder, level: _Level) -> dict[str, float]:
        following = body.following
        period = self.period(following.robot)
        advance = float(level.advance[0])
        fine = np.linspace(0.0, period, FINE, endpoint=False)
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
            "torsion": level.torsion,
            "body_length": following.length,
            **peaks(body.joints(*self.pace.at(fine))),
            **fit_facts(self.fit_at(following.robot, 0.0)),
        }


@dataclass(frozen=True, eq=False)
class _Sidewinder:
    """A :class:`Sidewinding` fitted to a robot; ``following`` has the wave without its torsion (the same points)."""

    following: Following
    torsion: float

    def turned(self, sigma: Array) -> Array:
        """(T,) rad by which the bends at the tail are turned beyond those of the curve that was untwisted from s = 0:
        the turn is 0 in the middle of the body."""
        return -self.torsion * (sigma + 0.5 * self.following.length)

    def joints(self, sigma: Array, speed: Array, acceleration: Array) -> Joints:
        """The untwisted curve's bends, turned by an angle that changes with sigma: product rule."""
        nodes, curve = self.following.rule.nodes, self.following.curve
        begin = sigma[:, None]
        whole, here, there = curve.integral(begin, begin + nodes), curve.shape(begin), curve.shape(begin + nodes)
        first, last = curve.slope(begin), curve.slope(begin + nodes)
        # as complex numbers kappa_p + i kappa_y a turn is a factor
        phi = whole.kappa_p + 1j * whole.kappa_y
        phi1 = (there.kappa_p - here.kappa_p) + 1j * (there.kappa_y - here.kappa_y)
        phi2 = (last.kappa_p - first.kappa_p) + 1j * (last.kappa_y - first.kappa_y)
        rate = -1j * self.torsion
        turn = np.exp(1j * self.turned(sigma))[:, None]
        jets = (turn * phi, turn * (phi1 + rate * phi), turn * (phi2 + 2.0 * rate * phi1 + rate**2 * phi))
        bends = self.following.rule.apply(*(np.stack([jet.real, jet.imag], axis=-1) for jet in jets))
        return in_time(bends, speed, acceleration)


@lru_cache(maxsize=16)
def _sidewinder(gait: Sidewinding, robot: Robot) -> _Sidewinder:
    following = Following(robot, gait.curve(), gait.p)
    following.must_bend(following.curve, gait.pace.start, "Sidewinding")
    return _Sidewinder(following, gait.torsion)


def _wave(gait: Sidewinding, torsion: float, at: float = 0.0, share: float = 1.0) -> BodyCurve:
    """The wave from ``at`` m on, with a ``share`` of its amplitudes."""
    wave = gait.wavelength
    ahead = 2.0 * np.pi / wave * at
    pitch = Serpenoid(share * gait.alpha_pitch, wave, wave, phase=gait.phase + ahead, plane="pitch")
    return Serpenoid(share * gait.alpha_yaw, wave, wave, phase=ahead) + pitch + Constant(tau=torsion, length=wave)


@dataclass(frozen=True, eq=False)
class _Level:
    """The wave laid level, at rest at its lowest points. ``torsion`` rad/m; ``pose`` (7,) of its frame at s = 0;
    ``advance`` (3,) m: how far the body moves a cycle, along x; ``drift`` (3,) m: how far the wave does; ``angle`` rad
    from the body's axis to the advance, positive to the left."""

    torsion: float
    pose: Array
    advance: Array
    drift: Array
    angle: float


@lru_cache(maxsize=16)
def _levelled(gait: Sidewinding) -> _Level:
    wave = gait.wavelength
    torsion = _torsion(gait)
    curve = _wave(gait, torsion)
    at = wave * np.arange(SAMPLES + 1) / SAMPLES
    points, frames = curve.frames(at, IDENTITY, tolerance=TOLERANCE)
    step = points[-1]
    if np.linalg.norm(step) <= 1e-9 * wave:
        raise InputError("alpha_yaw, alpha_pitch: with these the wave goes nowhere; choose smaller amplitudes.")
    x = step / np.linalg.norm(step)
    z = across(frames[:-1, :, 2].mean(axis=0), x, frames[0])
    k = int((points[:-1] @ z).argmin())
    low, high = at[k] - wave / SAMPLES, at[k] + wave / SAMPLES
    for _ in range(8):  # closes in on where the tangent is level, from falling to rising
        s = np.linspace(low, high, 33)
        tangents = curve.frames(s, IDENTITY, tolerance=TOLERANCE)[1][:, :, 0]
        rising = np.flatnonzero(tangents @ z > 0.0)
        i = int(rising[0]) if len(rising) else len(s) - 1
        low, high = s[max(i - 1, 0)], s[i]
    lowest = curve.frames(np.array([0.5 * (low + high)]), IDENTITY, tolerance=TOLERANCE)[1][0, :, 0]
    drift = -gait.pace.direction * wave * lowest
    drift -= (drift @ z) * z  # rounding
    advance = gait.pace.direction * step + drift
    size = float(np.linalg.norm(advance))
    if size <= 1e-9 * wave:
        raise InputError("alpha_yaw, alpha_pitch, phase: the lowest points run along with the body; nothing moves.")
    heading = advance / size
    left = np.cross(z, x)
    turned = np.stack([heading, np.cross(z, heading), z])  # world from curve
    pose = np.concatenate([np.zeros(3), quaternion_from_matrix(turned)])
    angle = float(np.arctan2(heading @ left, heading @ x))
    return _Level(torsion, pose, np.array([size, 0.0, 0.0]), turned @ drift, angle)


def _torsion(gait: Sidewinding) -> float:
    """The torsion with which the frame after a wavelength is the first one.

    After half a wavelength both curvatures have changed sign, as if the frame had rolled by pi: with H the rotation
    over half a wavelength, that over a whole one is (H Rx(pi))^2. It is the identity where H Rx(pi) turns by pi, so
    where the quaternion of H has no x: one equation for one torsion.
    """
    wave = gait.wavelength
    # for the way to the amplitudes the wave is taken at fixed places; its torsion is one number beside it
    h = 0.5 * wave / HALF
    places = (h * np.arange(HALF)[:, None] + h * np.array(GAUSS_NODES)).ravel()
    full, steps = np.stack(_wave(gait, 0.0).shape(places), axis=-1).reshape(HALF, 3, 3), np.full(HALF, h)
    twist = np.array([1.0, 0.0, 0.0])

    def near(share: float, torsion: float) -> float:
        return float(frames_from_nodes(share * full + torsion * twist, steps)[-1, 4])

    def roll(torsion: float) -> float:
        frame = _wave(gait, torsion).frames(np.array([0.5 * wave]), IDENTITY, tolerance=1e-13)[1][0]
        return float(quaternion_from_matrix(frame)[1])

    # of several torsions the one that grows from 0 with the amplitudes, at first with their product
    count = int(np.ceil(20.0 * (abs(gait.alpha_yaw) + abs(gait.alpha_pitch)))) + 1
    torsion: float = -np.pi * gait.alpha_yaw * gait.alpha_pitch * np.sin(gait.phase) / (wave * count**2)
    for k in range(1, count + 1):
        guess = torsion * (k / max(k - 1, 1)) ** 2
        found = _secant(partial(near, k / count), guess, 1e-4 / wave)
        if k == count and found is not None:
            found = _secant(roll, found, 1e-4 / wave)
        jumps = found is None or abs(found - guess) > 0.3 * abs(guess) + 0.05 / wave
        if found is None or jumps or abs(found) * wave >= np.pi:
            raise InputError(
                "alpha_yaw, alpha_pitch: no torsion keeps a wave of these amplitudes level; choose smaller ones."
            )
        torsion = found
    return torsion


def _secant(f: Callable[[float], float], guess: float, step: float) -> float | None:
    """The root of ``f`` near ``guess``, to rounding; None where it does not settle."""
    x, y = guess, guess + step
    fx, fy = f(x), f(y)
    for _ in range(40):
        if fy == fx:
            return y if abs(fy) < 1e-14 else None
        x, fx, y = y, fy, y - fy * (y - x) / (fy - fx)
        if not abs(y - guess) < 1e6 * step:
            return None
        if abs(y - x) <= 1e-11 * step:
            return y
        fy = f(y)
        if abs(fy) <= 1e-16:
            return y
    return y if abs(fy) < 1e-13 else None
