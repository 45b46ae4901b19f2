"""Poses of a walking body: over the plane of its feet, and what is seen from it."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.spatial.rotations import conjugate, matrix_from_quaternion


def plane_through(points: Array) -> Array:
    """(3,) slopes along x and y, and height m at the origin, of the plane through all ``points`` (k, 3), at best."""
    design = np.concatenate([points[:, :2], np.ones((len(points), 1))], axis=1)
    return np.asarray(np.linalg.lstsq(design, points[:, 2], rcond=None)[0])


def over(plane: Array, ways: Array, height: float, follow: bool) -> Array:
    """(k, 6) x, y, z m, roll, pitch, yaw rad at x, y, yaw (k, 3), ``height`` m over a plane of :func:`plane_through`;
    level, or along it."""
    gx, gy, g0 = plane
    x, y, heading = ways.T
    out = np.zeros((len(ways), 6))
    out[:, 0], out[:, 1], out[:, 5] = x, y, heading
    out[:, 2] = gx * x + gy * y + g0 + height
    if follow:
        c, s = np.cos(heading), np.sin(heading)
        ahead, left = gx * c + gy * s, -gx * s + gy * c
        out[:, 4] = -np.arctan(ahead)
        out[:, 3] = np.arctan(left * np.cos(out[:, 4]))
    return out


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
    return turned_back(base, points - base[:, None, :3])


def turned_back(base: Array, vectors: Array) -> Array:
    """World vectors (T, m, 3) in the axes of ``base`` (T, 7)."""
    back = matrix_from_quaternion(conjugate(base[:, 3:]))
    return np.asarray(np.einsum("tij,tmj->tmi", back, vectors))
