"""A body's pose as coordinates x, y, z, roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).

The rates of roll, pitch and yaw are not the angular velocity, which paper *legs* writes with the same letter: the
difference is up to 69 % of them within +-0.5 rad. :func:`coordinate_jacobian` goes from one to the other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError
from bodyplan.robot.batch import base_array
from bodyplan.spatial import quaternion_from_matrix

#: names of the coordinates, and their units
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")


def coordinates_from_pose(pose: ArrayLike) -> Array:
    """(..., 6) x, y, z in m, roll, pitch, yaw in rad, of poses (..., 7); pitch within +-pi/2.

    From the quaternion by half sums and differences of roll and yaw (Bernardes and Viollet 2022): to rounding for every
    attitude. At pitch = pi/2 only yaw - roll is defined, at -pi/2 only yaw + roll; the other is then arbitrary.
    """
    pose = base_array(pose)
    w, x, y, z = np.moveaxis(pose[..., 3:], -1, 0)
    a, b, c, d = w - y, x + z, w + y, z - x
    half_sum, half_difference = np.arctan2(b, a), np.arctan2(d, c)
    pitch = 2.0 * np.arctan2(np.hypot(c, d), np.hypot(a, b)) - 0.5 * np.pi
    angles = np.stack([half_sum - half_difference, pitch, half_sum + half_difference], axis=-1)
    turns = np.where(angles > np.pi, -1.0, np.where(angles < -np.pi, 1.0, 0.0))
    return np.concatenate([pose[..., :3], angles + 2.0 * np.pi * turns], axis=-1)


def pose_from_coordinates(coordinates: ArrayLike) -> Array:
    """Poses (..., 7) of coordinates (..., 6): x, y, z in m, roll, pitch, yaw in rad."""
    c = _six(coordinates)
    return np.concatenate([c[..., :3], quaternion_from_matrix(_rotation(c))], axis=-1)


def coordinate_jacobian(coordinates: ArrayLike) -> Array:
    """(..., 6, 6): body-fixed twist (v, omega) per unit rate of each of the ``coordinates`` (..., 6).

    Upper left R^T; lower right the columns x, Rx^T y, (Ry Rx)^T z. Singular at pitch = +-pi/2.
    """
    c = _six(coordinates)
    sr, cr, sp, cp = np.sin(c[..., 3]), np.cos(c[..., 3]), np.sin(c[..., 4]), np.cos(c[..., 4])
    J = np.zeros((*c.shape[:-1], 6, 6))
    J[..., :3, :3] = np.swapaxes(_rotation(c), -1, -2)
    J[..., 3, 3] = 1.0
    J[..., 4, 4], J[..., 5, 4] = cr, -sr
    J[..., 3, 5], J[..., 4, 5], J[..., 5, 5] = -sp, sr * cp, cr * cp
    return J


def _six(coordinates: ArrayLike) -> Array:
    c = finite(coordinates, "coordinates")
    if c.ndim == 0 or c.shape[-1] != 6:
        raise InputError(f"coordinates: expected shape (..., 6): {', '.join(COORDINATES)}; got {c.shape}.")
    return c


def _rotation(c: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), (..., 3, 3)."""
    (sr, sp, sy), (cr, cp, cy) = (np.moveaxis(f(c[..., 3:]), -1, 0) for f in (np.sin, np.cos))
    R = np.empty((*c.shape[:-1], 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = -sp, cp * sr, cp * cr
    return R
