"""Homogeneous transforms of anchors (paper *rectilinear*, (1)-(34)): one seen from another, and what drives it on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen
from bodyplan.errors import InputError

#: how far a matrix may be from a rotation
RIGID = 1e-9


@dataclass(frozen=True, eq=False)
class Transform:
    """Homogeneous transforms: ``matrix`` (..., 4, 4), position in m. ``np.asarray`` gives the matrix. Raises InputError
    for what is not a rigid transform."""

    matrix: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen(matrices(self.matrix, "matrix")))

    @classmethod
    def _made(cls, matrix: Array) -> Transform:
        """Of a product of rigid transforms, whose rounding adds up."""
        out = object.__new__(cls)
        object.__setattr__(out, "matrix", frozen(matrix))
        return out

    @property
    def position(self) -> Array:
        """(..., 3) m: P of (7), (13)."""
        return self.matrix[..., :3, 3]

    @cached_property
    def orientation(self) -> Array:
        """(..., 3) rad: theta_x, theta_y, theta_z of (4)-(6), R = Rz(theta_z) Ry(theta_y) Rx(theta_x).

        theta_y is in [-pi/2, pi/2]. The paper divides by cos(theta_y), which is 0 at +-90 deg; here theta_x is read
        after undoing theta_z, so that the three angles give the rotation back everywhere. At +-90 deg itself, where
        only their sum or difference counts, theta_z is 0.
        """
        n, s, a = (self.matrix[..., :3, i] for i in range(3))
        flat = np.hypot(n[..., 0], n[..., 1])
        # at +-90 deg what is left of n_x, n_y is rounding, and any theta_z will do
        z = np.where(flat > 1e-15, np.arctan2(n[..., 1], n[..., 0]), 0.0)
        y = np.arctan2(-n[..., 2], flat)
        cos, sin = np.cos(z), np.sin(z)
        x = np.arctan2(sin * a[..., 0] - cos * a[..., 1], cos * s[..., 1] - sin * s[..., 0])
        return frozen(np.stack([x, y, z], axis=-1))

    @property
    def L1(self) -> Array:
        """(...,) m: horizontal distance (8), (31), (33). z is up; (15) has y up."""
        return np.asarray(np.hypot(self.position[..., 0], self.position[..., 1]))

    @property
    def L2(self) -> Array:
        """(...,) m: distance (9), (14), (32), (34), with each side's own L1 under the root."""
        return np.asarray(np.linalg.norm(self.position, axis=-1))

    @property
    def inverse(self) -> Transform:
        """The transform back."""
        return Transform._made(_inverse(self.matrix))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Any:
        return np.array(self.matrix, dtype=dtype) if copy or dtype is not None else self.matrix

    def __matmul__(self, other: ArrayLike | Transform) -> Transform:
        return Transform._made(self.matrix @ matrices(other, "transform"))


def relative(
    start: ArrayLike | Transform,
    end: ArrayLike | Transform,
    start_drive: ArrayLike | Transform | None = None,
    end_drive: ArrayLike | Transform | None = None,
) -> Transform:
    """``end`` seen from ``start`` (1)-(3), (10)-(12): T_start^-1 T_end; after their drives (25)-(34):
    D_start^-1 T_start^-1 T_end D_end.

    Every argument: transforms (..., 4, 4), or positions (..., 3) in m of frames that are parallel to the world's;
    batches broadcast. (25)-(30) as printed carry copy errors and hold for parallel frames only, where they come to
    P + d_end - d_start; the product holds always. Raises InputError for what is not a rigid transform.
    """
    before = _inverse(matrices(start, "start")) @ matrices(end, "end")
    if start_drive is not None:
        before = _inverse(matrices(start_drive, "start_drive")) @ before
    if end_drive is not None:
        before = before @ matrices(end_drive, "end_drive")
    return Transform._made(before)


def drive(before: ArrayLike | Transform, after: ArrayLike | Transform) -> Transform:
    """The drive transform (16)-(24) of one anchor from A to B: D = T_A^-1 T_B, so that T_B = T_A D.

    Arguments as in :func:`relative`. The printed P_TA^TB = P_MA^MB = P_HA^HB (24) is not meant: Fig. 8 drives the tail
    by 720 mm and the others by 1680 mm.
    """
    return Transform._made(_inverse(matrices(before, "before")) @ matrices(after, "after"))


def matrices(given: ArrayLike | Transform, field: str) -> Array:
    """Rigid transforms (..., 4, 4) from such, or from positions (..., 3). InputError otherwise."""
    if isinstance(given, Transform):
        return given.matrix
    values = finite(given, field)
    if values.shape[-2:] == (4, 4):
        turn = values[..., :3, :3]
        off = np.abs(np.swapaxes(turn, -1, -2) @ turn - np.eye(3)).max(initial=0.0)
        last = np.abs(values[..., 3, :] - [0.0, 0.0, 0.0, 1.0]).max(initial=0.0)
        if off > RIGID or last > RIGID or np.any(np.linalg.det(turn) < 0.0):
            raise InputError(
                f"{field}: not a rigid transform: its upper left 3 x 3 part must be a rotation (off by {off:.3g}) and "
                f"its last row 0, 0, 0, 1 (off by {last:.3g})."
            )
        return values
    if values.ndim and values.shape[-1] == 3:
        out = np.zeros((*values.shape[:-1], 4, 4))
        out[...] = np.eye(4)
        out[..., :3, 3] = values
        return out
    raise InputError(f"{field}: expected transforms (..., 4, 4) or positions (..., 3), got shape {values.shape}.")


def _inverse(matrix: Array) -> Array:
    out = np.zeros_like(matrix)
    turn = np.swapaxes(matrix[..., :3, :3], -1, -2)
    out[..., :3, :3] = turn
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", turn, matrix[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out
