"""Orientation of the body from roll, pitch and heading: R = Ry(pitch) Rx(roll) Rz(yaw) (paper *wheels*, eq. (4)).

Roll and pitch turn about the world's x and y axes, as in the paper; yaw is a turn about the body's own z axis, and
what is asked for is a **heading** psi: the direction of the horizontal projection of the body's x axis. Both are tied
by

    yaw = atan2(cos(pitch) sin(psi), cos(roll) cos(psi) - sin(roll) sin(pitch) sin(psi)),

which is exact and closed (the notes' correction of eqs. (18) to (23): those integrate rates and drift).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.expressions import Expression
from bodyplan.spatial import quaternion_from_matrix

_YAW = Expression("atan2(cos(pitch)*sin(psi), cos(roll)*cos(psi) - sin(roll)*sin(pitch)*sin(psi))",
                  ("psi", "roll", "pitch"))  # fmt: skip


@dataclass(frozen=True)
class Function:
    """A function of time at T times: value, first and second derivative, each (T,)."""

    value: Array
    first: Array
    second: Array


@dataclass(frozen=True)
class Turning:
    """Orientations (T, 3, 3) world_from_body, angular velocities and accelerations (T, 3) in the world, rad/s, rad/s^2,
    and the yaw (T,) rad with its derivatives."""

    matrix: Array
    spin: Array
    gain: Array
    yaw: Function

    @property
    def quaternion(self) -> Array:
        """Unit quaternions wxyz (T, 4)."""
        return quaternion_from_matrix(self.matrix)


def yaw(heading: ArrayLike, roll: ArrayLike = 0.0, pitch: ArrayLike = 0.0) -> Array:
    """The yaw (...,) rad at which the body's x axis has the direction ``heading`` (...,) rad seen from above, for roll
    and pitch (...,) rad within +-pi/2; paper *wheels*, eqs. (18) to (23), corrected (exact and closed)."""
    return _YAW.value(psi=heading, roll=roll, pitch=pitch)


def heading(yaw: ArrayLike, roll: ArrayLike = 0.0, pitch: ArrayLike = 0.0) -> Array:
    """The direction (...,) rad, seen from above, of the body's x axis at a yaw (...,) rad: the inverse of
    :func:`yaw`."""
    a, b, c = (np.asarray(v, dtype=np.float64) for v in (yaw, roll, pitch))
    x = np.cos(c) * np.cos(a) + np.sin(c) * np.sin(b) * np.sin(a)
    return np.asarray(np.arctan2(np.cos(b) * np.sin(a), x))


def turning(psi: Function, roll: Function, pitch: Function) -> Turning:
    """Orientation, angular velocity and acceleration at T times, exact."""
    value, gradient, hessian = _YAW.jet(psi=psi.value, roll=roll.value, pitch=pitch.value)
    first = np.stack([psi.first, roll.first, pitch.first], axis=1)
    second = np.stack([psi.second, roll.second, pitch.second], axis=1)
    rate = np.sum(gradient * first, axis=1)
    change = np.sum(gradient * second, axis=1) + np.einsum("ti,tij,tj->t", first, hessian, first)
    turned = Function(value, rate, change)
    across, lengthwise, upright = _axes(roll.value, pitch.value)
    # pitch about the world's y, roll about x turned by the pitch, yaw about the body's z
    by_pitch = pitch.first[:, None] * across
    by_roll = by_pitch + roll.first[:, None] * lengthwise
    spin = by_roll + rate[:, None] * upright
    gain = (
        pitch.second[:, None] * across
        + roll.second[:, None] * lengthwise
        + np.cross(by_pitch, roll.first[:, None] * lengthwise)
        + change[:, None] * upright
        + np.cross(by_roll, rate[:, None] * upright)
    )
    return Turning(matrix(value, roll.value, pitch.value), spin, gain, turned)


def matrix(yaw: Array, roll: Array, pitch: Array) -> Array:
    """R = Ry(pitch) Rx(roll) Rz(yaw), (..., 3, 3): eq. (4) with the sign of its third row mended."""
    ca, sa, cb, sb, cc, sc = (f(v) for v in (yaw, roll, pitch) for f in (np.cos, np.sin))
    out = np.empty((*np.shape(yaw), 3, 3))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = cc * ca + sc * sb * sa, -cc * sa + sc * sb * ca, sc * cb
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = cb * sa, cb * ca, -sb
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2] = -sc * ca + cc * sb * sa, sc * sa + cc * sb * ca, cc * cb
    return out


def _axes(roll: Array, pitch: Array) -> tuple[Array, Array, Array]:
    """The axes (T, 3) of pitch, roll and yaw in the world: y, Ry x, Ry Rx z."""
    zero, one = np.zeros_like(roll), np.ones_like(roll)
    cb, sb, cc, sc = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
    return (
        np.stack([zero, one, zero], axis=1),
        np.stack([cc, zero, -sc], axis=1),
        np.stack([sc * cb, -sb, cc * cb], axis=1),
    )
