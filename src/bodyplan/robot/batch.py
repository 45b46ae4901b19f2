"""From what a user passes to what a kernel takes: joint arrays, base poses, batch shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Joint, Variable, WheelRadius
from bodyplan.robot.tables import COS_30

IDENTITY_POSE = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])


def joint_array(q: ArrayLike | Mapping[str, ArrayLike], joints: tuple[str, ...]) -> Array:
    """``q`` as a finite float64 array (..., n)."""
    if isinstance(q, Mapping):
        for name in q:
            if name not in joints:
                raise UnknownNameError("joint", name, joints, where="q")
        missing = [name for name in joints if name not in q]
        if missing:
            raise InputError(f"q: no value for joint {', '.join(missing)}.")
        values = [finite(q[name], f"q[{name!r}]") for name in joints]
        try:
            columns = np.broadcast_arrays(*values) if values else [np.zeros(())]
        except ValueError as error:
            raise InputError(f"q: shapes of the joints' values do not broadcast: {error}.") from error
        return np.stack(columns, axis=-1) if values else np.zeros((0,))
    out = finite(q, "q")
    if out.ndim == 0 or out.shape[-1] != len(joints):
        raise InputError(
            f"q: expected shape (..., {len(joints)}), one column for each joint, got {out.shape}."
        )
    return out


def flatten(q: Array, base: ArrayLike | None) -> tuple[tuple[int, ...], Array, Array]:
    """(batch shape, q (B, n), base (B or 1, 7)) for the kernels, contiguous and writeable."""
    shape = q.shape[:-1]
    if base is None:
        return shape, _plain(q.reshape(_size(shape), q.shape[-1])), IDENTITY_POSE
    pose = base_array(base)
    try:
        shape = np.broadcast_shapes(shape, pose.shape[:-1])
    except ValueError as error:
        raise InputError(
            f"base: batch shape {pose.shape[:-1]} does not broadcast with that of q, {q.shape[:-1]}."
        ) from error
    if pose.ndim == 1:
        return shape, _plain(q.reshape(_size(shape), q.shape[-1])), pose.reshape(1, 7)
    flat_q = np.broadcast_to(q, (*shape, q.shape[-1])).reshape(_size(shape), q.shape[-1])
    return shape, _plain(flat_q), _plain(np.broadcast_to(pose, (*shape, 7)).reshape(_size(shape), 7))


def base_array(base: ArrayLike) -> Array:
    """Checked base poses (..., 7), quaternions of length 1 to rounding."""
    pose = np.array(finite(base, "base"))
    if pose.ndim == 0 or pose.shape[-1] != 7:
        raise InputError(f"base: expected shape (..., 7), position and quaternion wxyz, got {pose.shape}.")
    norm = np.linalg.norm(pose[..., 3:], axis=-1, keepdims=True)
    if np.any(np.abs(norm - 1.0) > 1e-9):
        worst = float(norm.flat[np.argmax(np.abs(norm - 1.0))])
        raise InputError(f"base: quaternions (w, x, y, z) must have length 1 to 1e-9, got {worst:.12g}.")
    pose[..., 3:] /= norm
    return pose


def raise_if_bad(index: int) -> None:
    """InputError for what a kernel returns when configuration ``index`` is not finite."""
    if index >= 0:
        raise InputError(f"q: every value must be finite, configuration {index} is not.")


def variable(value: Variable, q: Array, column: Mapping[str, int]) -> Any:
    """Value (...,) of an element's variable at ``q`` (..., n)."""
    if isinstance(value, Joint):
        return value.offset + value.scale * q[..., column[value.name]]
    if isinstance(value, WheelRadius):
        return value.rubber + value.link * COS_30 * np.cos(0.5 * q[..., column[value.joint.name]])
    return np.full(q.shape[:-1], value)


def _size(shape: tuple[int, ...]) -> int:
    return int(np.prod(shape, dtype=np.int64))


def _plain(a: Array) -> Array:
    """C-contiguous and writeable: Numba compiles a kernel once for every kind of array it meets."""
    return a if a.flags.c_contiguous and a.flags.writeable else np.array(a, order="C")
