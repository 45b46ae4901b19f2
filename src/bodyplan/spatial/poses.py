"""Rigid displacements as pose arrays (..., 7): position (m) then unit quaternion wxyz, outer_from_inner.

NumPy, any leading batch shape, broadcasting.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.spatial.rotations import (
    canonical,
    conjugate,
    matrix_from_quaternion,
    multiply,
    quaternion_from_matrix,
    rotate,
)

IDENTITY = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """The pose a b (..., 7): ``b`` seen from where ``a`` is seen from; quaternions canonical."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return _pose(a[..., :3] + rotate(a[..., 3:], b[..., :3]), multiply(a[..., 3:], b[..., 3:]))


def inverse(a: ArrayLike) -> Array:
    """The pose (..., 7) that undoes ``a``."""
    a = np.asarray(a, dtype=np.float64)
    back = conjugate(a[..., 3:])
    return _pose(-rotate(back, a[..., :3]), back)


def relative(a: ArrayLike, b: ArrayLike) -> Array:
    """``b`` seen from ``a``: a^-1 b, (..., 7). The difference of positions is taken first, so that poses far
    from the origin lose nothing."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    back = conjugate(a[..., 3:])
    return _pose(rotate(back, b[..., :3] - a[..., :3]), multiply(back, b[..., 3:]))


def apply(a: ArrayLike, points: ArrayLike) -> Array:
    """Points (..., 3) in the inner frame of ``a`` (..., 7), seen from its outer frame."""
    a = np.asarray(a, dtype=np.float64)
    return np.asarray(a[..., :3] + rotate(a[..., 3:], points))


def pose_from_matrix(T: ArrayLike) -> Array:
    """Pose (..., 7) of homogeneous matrices (..., 4, 4)."""
    T = np.asarray(T, dtype=np.float64)
    return np.concatenate([T[..., :3, 3], quaternion_from_matrix(T[..., :3, :3])], axis=-1)


def matrix_from_pose(a: ArrayLike) -> Array:
    """Homogeneous matrices (..., 4, 4) of poses (..., 7)."""
    a = np.asarray(a, dtype=np.float64)
    T = np.zeros((*a.shape[:-1], 4, 4))
    T[..., :3, :3] = matrix_from_quaternion(a[..., 3:])
    T[..., :3, 3] = a[..., :3]
    T[..., 3, 3] = 1.0
    return T


def _pose(position: Array, quaternion: Array) -> Array:
    shape = np.broadcast_shapes(position.shape[:-1], quaternion.shape[:-1])
    out = np.empty((*shape, 7))
    out[..., :3], out[..., 3:] = position, canonical(quaternion)
    return out
