"""A body that follows a curve: joints exact in time, poses of its frames, what it says of itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan import curves, fitting
from bodyplan.arrays import Array, BoolArray, TextArray
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError, Status
from bodyplan.gaits.base import Gait
from bodyplan.gaits.placing import TOLERANCE
from bodyplan.gaits.planar import level_floor
from bodyplan.gaits.touching import lowest_points
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial import compose, multiply, quaternion_from_matrix
from bodyplan.spatial.poses import IDENTITY

if TYPE_CHECKING:
    from bodyplan.fitting import Bends

#: frames may leave the curve by this many times the largest distance that a fit leaves, no less than a share of the
#: body's length, no more than a share of a unit (see :class:`Following`): coarser mechanisms do not follow it
TWICE, LEAST, NEAR = 2.0, 1e-4, 0.5
#: fits of a cycle that the distance is taken from
FITS = 25
#: share of the speed along the body by which its frames may move otherwise (root mean square)
SLIP = 0.35
#: samples of a cycle for peaks of rates
FINE = 2000
#: m and rad: how well a cycle closes
CLOSED = 1e-9
#: samples of the integration that are done again with a wider step
PROBES = 2000


def body_curve(curve: Any, field: str) -> BodyCurve:
    """A curve, or one from its table; InputError naming the field otherwise."""
    if isinstance(curve, BodyCurve):
        return curve
    if isinstance(curve, Mapping):
        try:
            made: BodyCurve = curves.from_dict(curve)
        except InputError as error:
            raise InputError(f"{field}: {error}") from error
        return made
    raise InputError(f"{field}: expected a body curve or a table with its kind, got {curve!r}.")


def frames_of(curve: BodyCurve, s: Array) -> Array:
    """Poses (T, 7) of a curve's frames at s (T,) m, seen from its frame at s = 0."""
    points, rotations = curve.frames(s, IDENTITY, tolerance=TOLERANCE)
    return np.concatenate([points, quaternion_from_matrix(rotations)], axis=-1)


@dataclass(frozen=True)
class Joints:
    """q, dq/dt, d2q/dt2 (T, n) and the base seen from the curve's frame at the tail, quaternions ``kink`` (T, 4)."""

    q: Array
    qd: Array
    qdd: Array
    kink: Array


class Following:
    """A robot of one chain on a curve. ``curve`` does not twist; ``rule`` is the paper's, with parameter ``p``."""

    def __init__(self, robot: Robot, curve: BodyCurve, p: float | None) -> None:
        self.robot, self.curve = robot, curve.untwisted()
        self.rule = fitting.rule(robot, p)
        self.length: float = self.rule.mechanism.length
        along = robot.forward(np.zeros(robot.n)).positions[:, 0]
        # frames at one place are one point
        first = np.flatnonzero(np.diff(along, prepend=-1.0) > 1e-9 * self.length)
        self.frames: tuple[str, ...] = tuple(robot.frames[i] for i in first)
        #: (F,) m: places of ``frames`` along the body
        self.stations: Array = along[first]
        made = self.rule.mechanism
        #: m: length of body for every bend about one axis
        self.unit: float = self.length / min(len(made.joints_of(axis)) for axis in made.axes)

    def must_bend(self, curve: BodyCurve, start: float, gait: str) -> None:
        """InputError where ``curve`` bends about an axis that no joint of the robot bends about."""
        mechanism = self.rule.mechanism
        s = start + np.linspace(0.0, max(self.length, curve.period or 0.0), 257)
        shape = curve.shape(s)
        for axis, bends in enumerate((shape.kappa_p, shape.kappa_y)):
            if axis not in mechanism.axes and float(np.abs(bends).max()) * self.length > 1e-6:
                name = ("pitch", "yaw")[axis]
                raise InputError(f"{gait}: the curve bends in {name}, and {self.robot.name!r} has no {name} joints.")

    def joints(self, sigma: Array, speed: Array, acceleration: Array) -> Joints:
        """Joints when the tail is at ``sigma`` (T,) m with that speed and acceleration along the curve: chain rule."""
        bends = self.rule.evaluate(self.curve, sigma, derivatives=2)
        return in_time(bends, speed, acceleration)

    def poses(self, s: Array) -> Array:
        """Poses (T, 7) of the curve's frames at s (T,) m, seen from its frame at s = 0."""
        return frames_of(self.curve, s)

    def residual(self, s: Array, poses: Array) -> Array:
        """(T,) m: what eq. (1) leaves: the poses against an integration of the curve with wider steps."""
        probes = np.unique(np.linspace(0, len(s) - 1, min(len(s), PROBES)).round().astype(np.int64))
        points, _ = self.curve.frames(s[probes], IDENTITY, tolerance=100.0 * TOLERANCE)
        off = np.linalg.norm(points - poses[probes, :3], axis=-1)
        return np.asarray(np.interp(np.arange(len(s)), probes, off))

    def farthest(self, sigma: ArrayLike, joints: Joints, roll: Array) -> float:
        """m: largest distance that the mechanism leaves to the curve with its tail at ``sigma`` (T,) m, its base rolled
        there by ``roll`` (T,) rad against the curve's frame."""
        turns = multiply(rolled(roll)[:, 3:], joints.kink)
        places = np.broadcast_to(sigma, np.shape(roll))
        return float(fitting.largest_distances(self.robot, self.curve, places, joints.q, turns).max())

    def follows(self, pose: Array, places: Array, distance: float, label: str = "frames on the body curve") -> Claim:
        """The claim that the frames are on the curve at ``places`` (T, F) m when its s = 0 lies at ``pose``, as near as
        this mechanism can be: ``distance`` m is the largest that fits to the curve leave."""
        return Claim(
            "follows",
            label,
            {
                "curve": self.curve.to_dict(),
                "pose": pose,
                "places": places,
                "frames": list(self.frames),
                "tolerance": min(NEAR * self.unit, max(TWICE * distance, LEAST * self.length)),
            },
        )

    def motion(
        self,
        gait: Gait,
        ground: Ground,
        t: Array,
        base: Array,
        joints: Joints,
        *,
        contacts: BoolArray | None,
        **more: Any,
    ) -> Motion:
        """The motion of this robot; ``contacts`` (T, c) True where one touches, ``more`` as of :class:`Motion`."""
        return Motion(
            robot=self.robot,
            ground=ground,
            gait=gait.to_dict(),
            t=t,
            base=base,
            q=joints.q,
            qd=joints.qd,
            qdd=joints.qdd,
            status=self.within_limits(joints.q),
            contacts=None if contacts is None else contacts.astype(np.float64),
            **more,
        )

    def within_limits(self, q: Array) -> TextArray:
        """(T,) status: "limit" where a joint is beyond its limits."""
        low, high = self.robot.limits[:, 0], self.robot.limits[:, 1]
        beyond = np.any((q < low - 1e-12) | (q > high + 1e-12), axis=1)
        return np.where(beyond, Status.LIMIT.value, Status.OK.value).astype("U24")


def through_cycle(period: float) -> Array:
    """(FITS,) s at which the distances of a cycle are taken."""
    return np.linspace(0.0, period, FITS)


def closes(period: float, advance: ArrayLike, turn: ArrayLike) -> Claim:
    """The claim that the cycle closes: after ``period`` s the base is moved as p -> R(turn) p + advance."""
    data = {"period": period, "advance": advance, "turn": turn, "tolerance": CLOSED}
    return Claim("periodic", "the cycle closes", data)


def fit_facts(fit: Any) -> dict[str, float]:
    """How well a fit matches its curve, as facts of a plan."""
    return {"fit_error": float(fit.error), "fit_distance": float(fit.max_distance)}


def in_time(bends: Bends, speed: Array, acceleration: Array) -> Joints:
    """Joints in time from derivatives by a parameter that has this speed and acceleration (T,)."""
    assert bends.q1 is not None and bends.q2 is not None
    v, a = speed[:, None], acceleration[:, None]
    return Joints(bends.q, bends.q1 * v, bends.q2 * v * v + bends.q1 * a, bends.kink_quaternion)


def with_kink(poses: Array, kink: Array) -> Array:
    """Poses (T, 7) of the base from those of the curve's frame at the tail and the kinks (T, 4) between them."""
    return compose(poses, np.concatenate([np.zeros((len(kink), 3)), kink], axis=-1))


def rolled(angle: Array) -> Array:
    """Poses (..., 7) rolled by angles (...,) rad about x."""
    out = np.zeros((*np.shape(angle), 7))
    out[..., 3], out[..., 4] = np.cos(0.5 * angle), np.sin(0.5 * angle)
    return out


def rest_on_floor(robot: Robot, ground: Ground, q: Array, base: Array, gait: str) -> tuple[float, Array]:
    """How much higher the base must lie for the lowest contact of the whole motion to touch the floor (m), and then the
    heights (T, c) of all contacts' lowest points above it. InputError where the floor under the path is not level."""
    points = robot.forward(q, base).positions
    floor = level_floor(ground, points[..., :2], gait)
    lowest = lowest_points(robot, q, base)
    if not lowest.size:
        return floor, lowest
    low = float(lowest.min())
    return floor - low, lowest - low


def rule_notes(following: Following) -> list[str]:
    """What the paper says otherwise about the rule that gave the joint angles."""
    kind = following.rule.mechanism.kind
    notes = []
    if kind == "straight":
        notes.append(
            "Eqs. (2), (3): the integrand is kappa(s), not kappa(l i) as printed; the virtual joint at the tail takes "
            "what lies before the first window."
        )
    else:
        p = following.rule.p
        default = "the Gauss node 1/2 + 1/(2 sqrt 3)" if p == fitting.GAUSS_P else "as asked"
        notes.append(
            f"Eqs. (11)-(17) with p = {p:.6g} ({default}; the paper rounds to 0.789); l_c and l_a are one length."
        )
    if kind == "double":
        notes.append(
            'Eqs. (33), (34) are taken in their limit at 0 and with atan2. The paper\'s R_s "1.6 ~ 1.8" is 0.16 ~ 0.18.'
        )
    notes.append(
        "The virtual joint theta_0 is a kink between the curve's frame and the base; without it the match is 17 to 80 "
        "times worse."
    )
    return notes


def peaks(joints: Joints) -> dict[str, float]:
    """Largest joint angle, rate and acceleration of samples that cover the motion finely."""
    return {
        "largest_joint_angle": float(np.abs(joints.q).max(initial=0.0)),
        "peak_joint_rate": float(np.abs(joints.qd).max(initial=0.0)),
        "peak_joint_acceleration": float(np.abs(joints.qdd).max(initial=0.0)),
    }
