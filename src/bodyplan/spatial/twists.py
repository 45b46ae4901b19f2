"""Twists (v, omega) (..., 6) in m and rad (or m/s and rad/s): exponential, logarithm, adjoint.

Body-fixed: both parts are in the axes of the moving frame, v at its origin. With T the pose of a frame,
dT/dt = T [V]. NumPy, any leading batch shape.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.spatial.coefficients import inverse_coefficient
from bodyplan.spatial.rotations import canonical, hat, left_jacobian, quaternion_exp, quaternion_log


def exp(xi: ArrayLike) -> Array:
    """Pose (..., 7) reached after unit time with the constant twist ``xi`` (..., 6): position V(phi) rho."""
    xi = np.asarray(xi, dtype=np.float64)
    position = (left_jacobian(xi[..., 3:]) @ xi[..., :3, None])[..., 0]
    return np.concatenate([position, canonical(quaternion_exp(xi[..., 3:]))], axis=-1)


def log(pose: ArrayLike) -> Array:
    """The twist (..., 6) with |phi| <= pi whose exponential is ``pose`` (..., 7)."""
    pose = np.asarray(pose, dtype=np.float64)
    phi = quaternion_log(pose[..., 3:])
    D = inverse_coefficient(np.linalg.norm(phi, axis=-1, keepdims=True))
    p = pose[..., :3]
    once = np.cross(phi, p)
    return np.concatenate([p - 0.5 * once + D * np.cross(phi, once), phi], axis=-1)


def adjoint(position: ArrayLike, rotation: ArrayLike) -> Array:
    """Ad (..., 6, 6) = [R, [p] R; 0, R] of a frame at ``position`` (..., 3) with ``rotation`` (..., 3, 3):
    from the twist of a rigid body in this frame to its twist in the frame that this one is seen from."""
    R = np.asarray(rotation, dtype=np.float64)
    return _blocks(R, hat(position) @ R)


def adjoint_inverse(position: ArrayLike, rotation: ArrayLike) -> Array:
    """Ad^-1 (..., 6, 6) = [R^T, -R^T [p]; 0, R^T]: from the twist of a frame to that of one rigidly attached
    to it at ``position`` (..., 3) with ``rotation`` (..., 3, 3)."""
    Rt = np.swapaxes(np.asarray(rotation, dtype=np.float64), -1, -2)
    return _blocks(Rt, -Rt @ hat(position))


def bracket(x: ArrayLike, y: ArrayLike) -> Array:
    """Lie bracket [x, y] (..., 6) of twists: (w1 x v2 - w2 x v1, w1 x w2)."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    v = np.cross(x[..., 3:], y[..., :3]) - np.cross(y[..., 3:], x[..., :3])
    return np.concatenate([v, np.cross(x[..., 3:], y[..., 3:])], axis=-1)


def _blocks(diagonal: Array, corner: Array) -> Array:
    out = np.zeros((*np.broadcast_shapes(diagonal.shape[:-2], corner.shape[:-2]), 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = diagonal
    out[..., :3, 3:] = corner
    return out
