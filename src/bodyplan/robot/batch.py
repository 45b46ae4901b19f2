"""From what a user passes to what a kernel takes: joint arrays, base poses, batch shapes, threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Joint, Variable, WheelRadius
from bodyplan.threads import shared

FLOAT = np.dtype(np.float64)
NO_POSE = np.empty((0, 7))
IDENTITY_POSE = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
#: configurations from which on a batch is shared between threads, and the multiple that a share is
SHARED_FROM, SHARE = 8192, 16


def joint_array(
    q: ArrayLike | Mapping[str, ArrayLike], joints: tuple[str, ...], *, kernel_checks: bool = False
) -> Array:
    """``q`` as a float64 array (..., n), finite unless a kernel will look at every number anyway."""
    if isinstance(q, Mapping):
        for name in q:
            if name not in joints:
                raise UnknownNameError("joint", name, joints, where="q")
        missing = [name for name in joints if name not in q]
        if missing:
            raise InputError(f"q: no value for joint {', '.join(missing)}.")
        values = [finite(q[name], f"q[{name!r}]") for name in joints]
        try:
            return np.stack(np.broadcast_arrays(*values), axis=-1) if values else np.zeros((0,))
        except ValueError as error:
            raise InputError(f"q: shapes of the joints' values do not broadcast: {error}.") from error
    known = kernel_checks and type(q) is np.ndarray and q.dtype is FLOAT
    out: Array = q if known else finite(q, "q")  # type: ignore[assignment]
    if out.ndim == 0 or out.shape[-1] != len(joints):
        raise InputError(f"q: expected shape (..., {len(joints)}), one column for each joint, got {out.shape}.")
    return out


def flatten(q: Array, base: ArrayLike | None) -> tuple[tuple[int, ...], Array, Array]:
    """(batch shape, q (B n,), base (B or 1, 7), or (0, 7) for None), contiguous and writeable."""
    shape = q.shape[:-1]
    if base is None:
        return shape, plain(q).reshape(-1), NO_POSE
    pose = base_array(base)
    try:
        shape = np.broadcast_shapes(shape, pose.shape[:-1])
    except ValueError as error:
        raise InputError(
            f"base: batch shape {pose.shape[:-1]} does not broadcast with that of q, {q.shape[:-1]}."
        ) from error
    flat = plain(np.broadcast_to(q, (*shape, q.shape[-1]))).reshape(-1)
    if pose.ndim > 1:
        pose = plain(np.broadcast_to(pose, (*shape, 7)))
    return shape, flat, pose.reshape(-1, 7)


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


def plain(a: Array) -> Array:
    """C-contiguous and writeable: Numba compiles a kernel once for every kind of array it meets."""
    return a if a.flags.carray else np.array(a, order="C")


def run(q: Array, size: int, kernel: Callable[[int, int], int]) -> None:
    """Call ``kernel(first, last)`` over ``size`` configurations, large batches in several threads.

    InputError for ``q`` when a kernel met a number that is not finite.
    """
    if shared(kernel, size, threaded_from=SHARED_FROM, multiple=SHARE) >= 0:
        finite(q, "q")
        raise InputError("q: too large, a variable that it drives is not finite.")


def variable(value: Variable, q: Array, column: Mapping[str, int]) -> Any:
    """Value (...,) of an element's variable at ``q`` (..., n)."""
    if isinstance(value, Joint):
        return value.offset + value.scale * q[..., column[value.name]]
    if isinstance(value, WheelRadius):
        return value.radius(q[..., column[value.joint.name]])
    return np.full(q.shape[:-1], value)
