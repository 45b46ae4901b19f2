"""Poses and compact Jacobians of several frames in one pass: the fast path of the kinematics."""

from __future__ import annotations

import math
from collections.abc import Mapping

from numpy import empty, ndarray
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError
from bodyplan.robot.batch import FLOAT, NO_POSE, SHARED_FROM, flatten, joint_array, run
from bodyplan.robot.jacobian_kernel import jacobian_kernel
from bodyplan.robot.spread_kernel import spread_kernel
from bodyplan.robot.tables import Paths

NOTHING = empty(0)


class Reach:
    """C target frames at a batch of configurations. Arrays, with any leading batch shape:

    * ``positions`` (..., C, 3) m and ``rotations`` (..., C, 3, 3), in the world of the base pose;
    * ``twists`` (..., K, 6): body-fixed (v, omega) of a target per unit rate of one joint. Target c has the
      rows ``offsets[c]:offsets[c + 1]``, one for each joint between the base and it in the order of the
      robot's joints; ``joints`` (K,) is the joint of every row. :meth:`jacobian` is one target's (..., 6, k).
    """

    __slots__ = ("_batch", "_paths", "positions", "rotations", "twists")

    def __init__(self, paths: Paths, shape: tuple[int, ...]) -> None:
        self._paths, self._batch = paths, shape
        position, rotation, twist = paths.shapes
        self.positions = empty(shape + position)
        self.rotations = empty(shape + rotation)
        self.twists = empty(shape + twist)

    @property
    def offsets(self) -> IntArray:
        """(C + 1,) first row of every target in ``twists``, and their number."""
        return self._paths.offsets

    @property
    def joints(self) -> IntArray:
        """(K,) joint of every row of ``twists``."""
        return self._paths.joints

    def jacobian(self, target: int) -> Array:
        """(..., 6, k): columns for the joints ``joints[offsets[target]:offsets[target + 1]]``; a view."""
        return self.twists[..., self.offsets[target] : self.offsets[target + 1], :].swapaxes(-1, -2)

    def stacked(self) -> Array:
        """(..., 6 C, n): the Jacobians of all targets over each other, a column for every joint (Q)."""
        return self._spread(NOTHING, self._empty(self._paths.one[0]))[1]

    def carried(self) -> Array:
        """(..., 6 C, 6): twists of targets rigidly attached to the base per unit base twist (P), for a base
        at the identity pose."""
        return self._spread(self._empty(6), NOTHING)[0]

    def velocity_model(self) -> tuple[Array, Array]:
        """(P, Q) of :meth:`carried` and :meth:`stacked` in one pass."""
        return self._spread(self._empty(6), self._empty(self._paths.one[0]))

    def _empty(self, columns: int) -> Array:
        return empty((*self._batch, 6 * self._paths.shapes[0][0], columns))

    def _spread(self, P: Array, Q: Array) -> tuple[Array, Array]:
        paths = self._paths
        arrays = self.positions, self.rotations, self.twists, paths.offsets, paths.joints
        spread_kernel(math.prod(self._batch), paths.one[0], *arrays, P, Q)
        return P, Q

    def __repr__(self) -> str:
        return f"Reach(batch={self._batch}, targets={len(self.offsets) - 1}, columns={len(self.joints)})"


def reach(
    paths: Paths,
    q: ArrayLike | Mapping[str, ArrayLike],
    base: ArrayLike | None,
    out: Reach | None,
) -> Reach:
    """Poses and joint twists of the targets of ``paths``, into ``out`` where given."""
    if base is None and type(q) is ndarray and q.dtype is FLOAT and q.flags.carray:
        # Nothing to convert. One vector, as in a control loop, has a kernel of its own.
        if q.shape == paths.one:
            at = _result(paths, (), out)
            if jacobian_kernel(True, q, NO_POSE, paths.ints, paths.floats, at.positions, at.rotations, at.twists) < 0:
                return at
        elif q.ndim == 2 and q.shape[1:] == paths.one and len(q) < SHARED_FROM:
            at = _result(paths, q.shape[:1], out)
            arrays = at.positions, at.rotations, at.twists
            if jacobian_kernel(len(q), q.reshape(-1), NO_POSE, paths.ints, paths.floats, *arrays) < 0:
                return at
    q = joint_array(q, paths.names, kernel_checks=True)
    shape, flat, pose = flatten(q, base)
    at = _result(paths, shape, out)
    size, n, rank = math.prod(shape), paths.one[0], len(shape)
    flat_out = [a.reshape(size, *a.shape[rank:]) for a in (at.positions, at.rotations, at.twists)]

    def kernel(first: int, last: int) -> int:
        bases = pose if len(pose) < 2 else pose[first:last]
        parts = (a[first:last] for a in flat_out)
        return int(jacobian_kernel(last - first, flat[first * n : last * n], bases, paths.ints, paths.floats, *parts))

    run(q, size, kernel)
    return at


def _result(paths: Paths, shape: tuple[int, ...], out: Reach | None) -> Reach:
    if out is None:
        return Reach(paths, shape)
    if type(out) is not Reach or out._paths is not paths or out._batch != shape:
        raise InputError(f"out: expected a result for the same frames with batch shape {shape}, got {out!r}.")
    return out
