"""Statics of a robot on its feet: what each carries, and the torques that hold it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.gaits.crawl.legs import Legs
from bodyplan.robot.masses import center_from_poses, mass_points
from bodyplan.spatial import rotate

GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class Holding:
    """``loads`` (T, m) N, upright, of the feet, negative where the ground would have to pull; ``torques`` (T, n) N m (N
    of slides); ``peak`` N m."""

    loads: Array
    torques: Array
    peak: float


def holding(legs: Legs, q: Array, base: Array, standing: BoolArray) -> Holding | None:
    """Statics without friction at ``q`` (T, n), ``base`` (T, 7) with feet ``standing`` (T, m): the loads of least
    square that hold. None for a robot without masses."""
    robot = legs.robot
    frames, masses, centres = mass_points(robot)
    if not len(frames) or not masses.sum() > 0.0:
        return None
    poses = robot.forward(q, base).array
    center = center_from_poses(robot, poses)
    places = poses[:, frames, :3] + rotate(poses[:, frames, 3:], centres)
    weight = float(masses.sum()) * GRAVITY
    parts = [leg.jacobian(poses) for leg in legs.legs]
    feet = np.stack([part[2] for part in parts], axis=1)
    loads = np.zeros(standing.shape)
    for pattern in np.unique(standing, axis=0):
        rows, on = np.flatnonzero((standing == pattern).all(axis=1)), np.flatnonzero(pattern)
        away = feet[np.ix_(rows, on)][..., :2] - center[rows, None, :2]
        balance = np.concatenate([np.ones((len(rows), 1, len(on))), np.swapaxes(away, 1, 2)], axis=1)
        loads[np.ix_(rows, on)] = weight * np.linalg.pinv(balance)[:, :, 0]
    torques = np.zeros_like(q)
    for j, leg in enumerate(legs.legs):
        axis, place, _, columns = parts[j]
        chain = set(leg.frames[1:])
        for k, drive in enumerate(leg.drives):
            # what lies beyond the drive in its chain
            beyond = [b for b, frame in enumerate(frames) if frame in chain and frame >= leg.frames[drive.element + 1]]
            if drive.turns:
                lifted = np.cross(axis[:, k, None], places[:, beyond] - place[:, k, None])[..., 2]
            else:
                lifted = np.repeat(axis[:, k, None, 2], len(beyond), axis=1)
            torque = GRAVITY * lifted @ masses[beyond] - columns[:, 2, k] * loads[:, j]
            torques[:, drive.column] += drive.scale * torque
    return Holding(loads, torques, float(np.abs(torques).max(initial=0.0)))
