"""Poses and compact Jacobians of several frames in one pass: the fast path of the kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray
from bodyplan.robot import batch
from bodyplan.robot.kernels import jacobian_kernel
from bodyplan.robot.tables import Paths, Tables
from bodyplan.spatial.rotations import hat


@dataclass(frozen=True, slots=True)
class Reach:
    """C target frames at a batch of configurations. Arrays, with any leading batch shape:

    * ``positions`` (..., C, 3) m and ``rotations`` (..., C, 3, 3), in the world of the base pose;
    * ``twists`` (..., K, 6): body-fixed (v, omega) of a target per unit rate of one joint. Target c has rows
      ``offsets[c]:offsets[c + 1]``, one for each joint between the base and it, and ``joints`` (K,) is the joint
      of every row. :meth:`jacobian` is one target's (..., 6, k).
    """

    positions: Array
    rotations: Array
    twists: Array
    offsets: IntArray
    joints: IntArray

    def jacobian(self, target: int) -> Array:
        """(..., 6, k): columns for the joints ``joints[offsets[target]:offsets[target + 1]]``; a view."""
        return self.twists[..., self.offsets[target] : self.offsets[target + 1], :].swapaxes(-1, -2)

    def stacked(self, n: int) -> Array:
        """(..., 6 C, n): the Jacobians of all targets over each other, a column for each of n joints (Q)."""
        lead, C = self.twists.shape[:-2], len(self.offsets) - 1
        out = np.zeros((*lead, 6 * C, n))
        for c in range(C):
            span = slice(self.offsets[c], self.offsets[c + 1])
            out[..., 6 * c : 6 * c + 6, self.joints[span]] = self.twists[..., span, :].swapaxes(-1, -2)
        return out

    def carried(self) -> Array:
        """(..., 6 C, 6): twists of targets rigidly attached to the base per unit base twist (P), for a base at
        the identity pose."""
        Rt = self.rotations.swapaxes(-1, -2)
        out = np.zeros((*Rt.shape[:-2], 6, 6))
        out[..., :3, :3] = out[..., 3:, 3:] = Rt
        out[..., :3, 3:] = -Rt @ hat(self.positions)
        return out.reshape(*Rt.shape[:-3], -1, 6)


def reach(tables: Tables, paths: Paths, q: Array, base: ArrayLike | None) -> Reach:
    """Poses and joint twists of the targets of ``paths`` at ``q`` (..., n)."""
    shape, flat, pose = batch.flatten(q, base)
    B, C, K = len(flat), len(paths.starts) - 1, len(paths.joints)
    position, rotation, twist = np.empty((B, C, 3)), np.empty((B, C, 3, 3)), np.empty((B, K, 6))
    batch.raise_if_bad(
        jacobian_kernel(
            flat, pose, *tables, paths.starts, paths.steps, paths.offsets, position, rotation, twist
        )
    )
    return Reach(
        position.reshape(*shape, C, 3),
        rotation.reshape(*shape, C, 3, 3),
        twist.reshape(*shape, K, 6),
        paths.offsets,
        paths.joints,
    )
