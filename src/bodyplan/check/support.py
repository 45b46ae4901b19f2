"""The support polygon: how far inside of it, seen from above, the centre of mass is."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.motion import Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.spatial import apply
from bodyplan.spatial.hulls import edge_distances

#: points of a shape that are higher than its lowest by less stand with it, m
FLAT = 1e-9


def polygon_margin(motion: Motion, samples: Any = slice(None)) -> Array:
    """(k,) m: distance of the centre of mass from the nearest edge of the hull of what carries the robot, negative
    outside, at ``samples`` of the motion; minus infinity where fewer than three points carry. For motions that name
    their contacts, of robots with mass."""
    robot = motion.robot
    poses = robot.forward(motion.q[samples], motion.base[samples])
    loaded = np.asarray(motion.contacts)[samples] > 0.5
    center = center_from_poses(robot, poses.array)[:, :2]
    places, carries = [], []
    for contact, on in zip(robot.contacts, loaded.T, strict=True):
        points = apply(poses[contact.frame][:, None], contact.points())
        lowest = points[..., 2] <= points[..., 2].min(axis=1, keepdims=True) + FLAT
        places.append(points[..., :2])
        carries.append(lowest & on[:, None])
    every, standing = np.concatenate(places, axis=1), np.concatenate(carries, axis=1)
    out = np.full(len(center), -np.inf)
    for pattern in np.unique(standing, axis=0):
        if pattern.sum() >= 3:
            rows = np.flatnonzero((standing == pattern).all(axis=1))
            out[rows] = edge_distances(every[rows][:, pattern], center[rows]).min(axis=1)
    return out
