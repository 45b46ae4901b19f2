"""The virtual chassis: the mean frame of a body, which moves evenly while the body winds about it."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.model import Robot
from bodyplan.spatial import left_jacobian, matrix_from_quaternion, quaternion_from_matrix, twists


def mean_frames(robot: Robot, q: Array) -> Array:
    """Poses (T, 7) of the mean body frame seen from the base, for q (T, n).

    Its origin is the centre of mass, its rotation the chordal mean of the bodies' rotations since q = 0 weighted by
    mass (the rotation nearest to the weighted sum of their matrices): how a frame lies in its body does not count. A
    robot without masses counts every frame once.
    """
    poses = robot.forward(q)
    bodies = [robot.base_body, *(element.body for element in robot.elements)]
    mass = np.array([0.0 if body is None else body.mass for body in bodies])
    middle = np.array([(0.0, 0.0, 0.0) if body is None else body.com for body in bodies])
    if not mass.sum() > 0.0:
        mass, middle = np.ones(len(bodies)), np.zeros((len(bodies), 3))
    used = np.flatnonzero(mass)
    weights = mass[used] / mass.sum()
    rotations = matrix_from_quaternion(poses.array[:, used, 3:])
    points = poses.positions[:, used] + np.einsum("tfij,fj->tfi", rotations, middle[used])
    rest = robot.forward(np.zeros(robot.n)).rotations[used]
    turned = np.einsum("tfij,fkj,f->tik", rotations, rest, weights)
    return np.concatenate([np.einsum("tfi,f->ti", points, weights), mean_rotation(turned)], axis=-1)


def mean_pose(poses: Array) -> Array:
    """The pose (7,) in the middle of poses (N, 7): mean position, chordal mean of the rotations."""
    return np.concatenate([poses[:, :3].mean(axis=0), mean_rotation(matrix_from_quaternion(poses[:, 3:]).mean(axis=0))])


def mean_rotation(total: Array) -> Array:
    """Quaternions (..., 4) of the rotations nearest to matrices (..., 3, 3) in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(total)
    U = U.copy()
    U[..., :, 2] *= np.where(np.linalg.det(U @ Vt) < 0.0, -1.0, 1.0)[..., None]
    return quaternion_from_matrix(U @ Vt)


def part_of(advance: Array, turn: Array, share: Array) -> Array:
    """Poses (..., 7): the share (...,) of the screw motion ``p -> R(turn) p + advance``, turned evenly about one axis.

    ``turn`` (3,) rad may be longer than pi, ``advance`` (3,) m.
    """
    v = np.linalg.solve(left_jacobian(turn), advance)
    return twists.exp(np.asarray(share)[..., None] * np.concatenate([v, turn]))
