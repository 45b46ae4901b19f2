"""Rotations: unit quaternions (wxyz), 3x3 matrices, rotation vectors. NumPy, any leading batch shape.

Matrices map coordinates in the rotated frame to the frame it is seen from. Rotation vectors are axis times
angle in rad. ``q`` and ``-q`` are the same rotation; functions that return quaternions say where they choose.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.spatial.coefficients import coefficients, sinc

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def hat(v: ArrayLike) -> Array:
    """Cross-product matrix [v] (..., 3, 3) of vectors (..., 3): ``hat(a) @ b = a x b``."""
    v = np.asarray(v, dtype=np.float64)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def canonical(q: ArrayLike) -> Array:
    """The one of ``q`` and ``-q`` (..., 4) whose first non-zero entry is positive; -0.0 becomes 0.0."""
    q = np.asarray(q, dtype=np.float64)
    sign = np.zeros(q.shape[:-1])
    for k in range(4):
        sign = np.where(sign == 0.0, np.sign(q[..., k]), sign)
    return np.asarray(np.where(sign < 0.0, -1.0, 1.0)[..., None] * q + 0.0)


def multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Hamilton product p q (..., 4), broadcast: the rotation q followed by p."""
    a, b = np.broadcast_arrays(np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64))
    out = np.empty(a.shape)
    out[..., 0] = a[..., 0] * b[..., 0] - np.sum(a[..., 1:] * b[..., 1:], axis=-1)
    out[..., 1:] = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return out


def conjugate(q: ArrayLike) -> Array:
    """The inverse rotation of unit quaternions (..., 4)."""
    return np.multiply(q, (1.0, -1.0, -1.0, -1.0))


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Vectors ``v`` (..., 3) turned by unit quaternions ``q`` (..., 4), broadcast."""
    q, v = np.asarray(q, dtype=np.float64), np.asarray(v, dtype=np.float64)
    twice = 2.0 * np.cross(q[..., 1:], v)
    return np.asarray(v + q[..., :1] * twice + np.cross(q[..., 1:], twice))


def matrix_from_quaternion(q: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    q = np.asarray(q, dtype=np.float64)
    w, x, y, z = (q[..., k] for k in range(4))
    out = np.empty((*q.shape[:-1], 3, 3))
    out[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    out[..., 0, 1], out[..., 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    out[..., 0, 2], out[..., 2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    out[..., 1, 2], out[..., 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
    return out


def quaternion_from_matrix(R: ArrayLike) -> Array:
    """Canonical unit quaternions (..., 4) of rotation matrices (..., 3, 3), accurate at every angle.

    Row k of ``K`` is 4 q_k q; the row with the largest diagonal entry has no cancellation (Shepperd 1978).
    """
    R = np.asarray(R, dtype=np.float64)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    K = np.empty((*R.shape[:-2], 4, 4))
    K[..., 0, 0], K[..., 1, 1] = 1.0 + xx + yy + zz, 1.0 + xx - yy - zz
    K[..., 2, 2], K[..., 3, 3] = 1.0 - xx + yy - zz, 1.0 - xx - yy + zz
    for i, j, value in (
        (0, 1, R[..., 2, 1] - R[..., 1, 2]),
        (0, 2, R[..., 0, 2] - R[..., 2, 0]),
        (0, 3, R[..., 1, 0] - R[..., 0, 1]),
        (1, 2, R[..., 0, 1] + R[..., 1, 0]),
        (1, 3, R[..., 0, 2] + R[..., 2, 0]),
        (2, 3, R[..., 1, 2] + R[..., 2, 1]),
    ):
        K[..., i, j] = K[..., j, i] = value
    best = np.argmax(np.diagonal(K, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(K, best[..., None, None], axis=-2)[..., 0, :]
    return canonical(row / np.linalg.norm(row, axis=-1, keepdims=True))


def quaternion_exp(phi: ArrayLike) -> Array:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) rad: (cos(x/2), phi sin(x/2)/x)."""
    phi = np.asarray(phi, dtype=np.float64)
    half = 0.5 * np.linalg.norm(phi, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * sinc(half) * phi], axis=-1)


def quaternion_log(q: ArrayLike) -> Array:
    """Rotation vectors (..., 3) rad, length in [0, pi], of unit quaternions (..., 4)."""
    q = canonical(q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    # angle / sine -> 2 / w at the identity
    ratio = np.where(sine == 0.0, 2.0, angle / np.where(sine == 0.0, 1.0, sine))
    return np.asarray(ratio * q[..., 1:])


def rotation_exp(phi: ArrayLike) -> Array:
    """exp([phi]) (..., 3, 3) of rotation vectors (..., 3) rad (Rodrigues)."""
    return matrix_from_quaternion(quaternion_exp(phi))


def rotation_log(R: ArrayLike) -> Array:
    """Rotation vectors (..., 3) rad, length in [0, pi], of rotation matrices (..., 3, 3)."""
    return quaternion_log(quaternion_from_matrix(R))


def left_jacobian(phi: ArrayLike) -> Array:
    """V(phi) = integral of exp(u [phi]) over u in [0, 1] = I + B [phi] + C [phi]^2, (..., 3, 3).

    It maps d(phi)/dt to the angular velocity in the fixed frame; its transpose to that in the turned frame.
    """
    phi = np.asarray(phi, dtype=np.float64)
    _, b, c = coefficients(np.linalg.norm(phi, axis=-1))
    skew = hat(phi)
    return np.asarray(np.eye(3) + b[..., None, None] * skew + c[..., None, None] * (skew @ skew))
