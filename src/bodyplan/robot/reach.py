"""Poses and compact Jacobians of several frames in one pass: the fast path of the kinematics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray
from bodyplan.robot import batch
from bodyplan.robot.jacobian_kernel import jacobian_kernel
from bodyplan.robot.tables import Paths, Tables
from bodyplan.spatial.twists import adjoint_inverse


@dataclass(frozen=True, slots=True)
class Reach:
    """C target frames at a batch of configurations. Arrays, with any leading batch shape:

    * ``positions`` (..., C, 3) m and ``rotations`` (..., C, 3, 3), in the world of the base pose;
    * ``twists`` (..., K, 6): body-fixed (v, omega) of a target per unit rate of one joint. Target c has rows
      ``offsets[c]:offsets[c + 1]``, one for each joint between the base and it, and ``joints`` (K,) is the
      joint of every row. :meth:`jacobian` is one target's (..., 6, k).
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
        """(..., 6 C, 6): twists of targets rigidly attached to the base per unit base twist (P), for a base
        at the identity pose."""
        each = adjoint_inverse(self.positions, self.rotations)
        return each.reshape(*each.shape[:-3], 6 * each.shape[-3], 6)


def reach(tables: Tables, paths: Paths, q: Array, base: ArrayLike | None) -> Reach:
    """Poses and joint twists of the targets of ``paths`` at ``q`` (..., n)."""
    shape, flat, pose = batch.flatten(q, base)
    C, K = len(paths.offsets) - 1, len(paths.joints)
    # one configuration is a kernel of its own; the kernels take the batch as one axis
    size, lead = (len(flat), (len(flat),)) if shape else (True, ())
    position, rotation, twist = np.empty((*lead, C, 3)), np.empty((*lead, C, 3, 3)), np.empty((*lead, K, 6))
    batch.raise_if_bad(jacobian_kernel(size, flat.reshape(-1), pose, *tables, paths.ints, position, rotation, twist))
    if len(shape) > 1:
        position, rotation, twist = (a.reshape(*shape, *a.shape[1:]) for a in (position, rotation, twist))
    return Reach(position, rotation, twist, paths.offsets, paths.joints)
