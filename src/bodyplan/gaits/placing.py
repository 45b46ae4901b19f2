"""Where a curve lies in the world: level, heading along x; and how a period of it moves on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.curves.base import BodyCurve
from bodyplan.spatial import (
    compose,
    inverse,
    matrix_from_quaternion,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    rotate,
)
from bodyplan.spatial.poses import IDENTITY

#: samples of a period (the mean of a smooth periodic function converges faster than any power of them)
SAMPLES = 512
#: error of frames along curves, m and rad
TOLERANCE = 1e-12
#: rad: a smaller turn over a period is none
NO_TURN = 1e-9
#: cosine of the angle up to which two directions count as the same way
SAME_WAY = 0.7


@dataclass(frozen=True, eq=False)
class Placing:
    """A curve in the world. ``pose`` (7,) of its frame at s = 0, the start of the body at the origin.

    For a periodic curve ``period`` m (the body's length where the shape is constant) and the motion over it,
    ``p -> R(turn) p + advance``: ``turn`` (3,) rad, a rotation vector, may be longer than pi, ``advance`` (3,) m. For
    others these are None.
    """

    pose: Array
    period: float | None = None
    step: Array | None = None  # the same, seen from the curve's frame at s = 0
    bend: float = 0.0  # rad: integral of kappa_y over the period

    def raised(self, height: float) -> Placing:
        """The same, ``height`` m higher."""
        return Placing(self.pose + height * np.eye(7)[2], self.period, self.step, self.bend)

    @property
    def turn(self) -> Array:
        """(3,) rad."""
        if self.step is None:
            return np.zeros(3)
        turn = matrix_from_quaternion(self.pose[3:]) @ quaternion_log(self.step[3:])
        angle = float(np.linalg.norm(turn))
        if angle <= NO_TURN:
            return np.zeros(3)
        # turned by more than pi about the vertical: the logarithm counts modulo 2 pi
        whole = np.round((self.bend - turn[2]) / (2.0 * np.pi)) * 2.0 * np.pi
        if np.hypot(turn[0], turn[1]) <= NO_TURN and abs(self.bend - turn[2] - whole) <= NO_TURN:
            return np.array([0.0, 0.0, turn[2] + whole])
        return turn

    @property
    def advance(self) -> Array:
        """(3,) m."""
        if self.step is None:
            return np.zeros(3)
        if not self.turn.any():
            return np.asarray(matrix_from_quaternion(self.pose[3:]) @ self.step[:3])
        return compose(compose(self.pose, self.step), inverse(self.pose))[:3]

    @property
    def displacement(self) -> Array:
        """(3,) m: how far the start of the body has moved after one period."""
        return self.moved(np.zeros(3))

    def moved(self, point: Array) -> Array:
        """(3,) m: displacement of a point over one period."""
        return rotate(quaternion_exp(self.turn), point) + self.advance - point


def place(curve: BodyCurve, start: float, length: float) -> Placing:
    """Lay a curve down for a body of ``length`` m whose tail end begins at s = ``start``, at the world's origin.

    A periodic curve repeats by a screw motion. Where it does not turn (waves), its displacement over a period points
    along +x, and the mean of e_y over the period is upright as nearly as that allows. Where it turns about that mean
    (steering), the axis is upright, so that the path stays level, and the first displacement points along +x. Where it
    goes on along the axis (spirals), the axis is +x. Otherwise it is laid like a wave. A curve that does not repeat
    is laid by the stretch under the body.
    """
    repeat = curve.period
    span = repeat or length
    at = start + span * np.arange(SAMPLES + 1) / SAMPLES
    points, rotations = curve.frames(at, IDENTITY, tolerance=TOLERANCE)
    poses = np.concatenate([points, quaternion_from_matrix(rotations)], axis=-1)
    ahead = points[-1] - points[0]
    up = rotations[:-1, :, 2].mean(axis=0)
    step = None if repeat is None else compose(poses[-1], inverse(poses[0]))
    x, z, keep = ahead, up, "x"
    if step is not None:
        turn = quaternion_log(step[3:])
        angle = float(np.linalg.norm(turn))
        if angle > NO_TURN:
            axis = turn / angle
            if abs(axis @ up) >= SAME_WAY:
                z, keep = np.copysign(1.0, axis @ up) * axis, "z"
            elif abs(axis @ ahead) >= SAME_WAY * float(np.linalg.norm(ahead)):
                x = np.copysign(1.0, axis @ ahead) * axis
        else:
            step = np.concatenate([ahead, IDENTITY[3:]])
    first = rotations[0]
    if np.linalg.norm(x) <= 1e-9 * span:
        x = first[:, 0]
    if keep == "x":
        x = x / np.linalg.norm(x)
        z = across(z, x, first)
    else:
        x = across(x, z, first)
    turned = np.stack([x, np.cross(z, x), z])  # world from curve
    pose = np.concatenate([-turned @ points[0], quaternion_from_matrix(turned)])
    bend = 0.0 if step is None else float(curve.integral(start, start + span).kappa_y)
    return Placing(pose, None if step is None else float(span), step, bend)


def across(v: Array, axis: Array, frame: Array) -> Array:
    """The unit vector nearest to ``v`` across a unit ``axis``; where ``v`` lies along it, one of the frame's."""
    for candidate in (v, frame[:, 2], frame[:, 1], frame[:, 0]):
        across = candidate - (candidate @ axis) * axis
        size = float(np.linalg.norm(across))
        if size > 1e-6:
            return np.asarray(across / size)
    raise AssertionError("three axes of a frame cannot all lie along one")
