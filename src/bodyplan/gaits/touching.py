"""Lowest points of a robot's contacts: how high a body rides, and which contacts touch."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.robot.model import Robot
from bodyplan.spatial import apply

#: samples handled at once
CHUNK = 20_000
#: m: a body whose contacts all stay within this touches everywhere
FLAT = 1e-6
#: share of the lift within which a contact counts as touching
TOUCH = 0.2


def lowest_points(robot: Robot, q: Array, base: Array) -> Array:
    """Height (T, c) m of the lowest point of every contact, for q (T, n) and base (T, 7)."""
    out = np.empty((len(q), len(robot.contacts)))
    for first in range(0, len(q), CHUNK):
        part = slice(first, first + CHUNK)
        poses = robot.forward(q[part], base[part])
        for k, contact in enumerate(robot.contacts):
            pose = poses[contact.frame]
            w, x, y, z = (pose[:, i] for i in range(3, 7))
            # the world's z seen from the frame
            up = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=-1)
            height = pose[:, 2] + (contact.points() @ up.T).min(axis=0)
            upright = np.sqrt(np.maximum(1.0 - up[:, 2] ** 2, 0.0)) if contact.shape == "rim" else 1.0
            out[part, k] = height - contact.radius * upright
    return out


def touching(heights: Array, within: float | None, whole: bool) -> tuple[BoolArray | None, float, float]:
    """Which contacts touch (T, c), the lift (m), and the height (m) up to which they do.

    ``heights`` (T, c) of the contacts' lowest points above the floor; ``within`` m, None for :data:`TOUCH` of the
    lift. A planned body is rigid and its ends may reach lower than all else, so with ``whole`` (the samples cover a
    cycle) the height counts from where most contacts come down to: the median of their lowest. None instead of a
    schedule where everything touches all the time.
    """
    lift = float(heights.max(initial=0.0))
    if lift <= FLAT:
        return None, lift, FLAT
    level = float(np.median(heights.min(axis=0))) if whole else 0.0
    limit = level + (TOUCH * lift if within is None else within)
    return heights <= limit, lift, limit


def pole_gaps(robot: Robot, q: Array, base: Array, point: Array, direction: Array, radius: float) -> Array:
    """Distances (T, c) m of capsules and spheres from a pole: a straight line through ``point`` along the unit vector
    ``direction``, of that ``radius``. Capsules are tried at 5 places."""
    out = np.empty((len(q), len(robot.contacts)))
    for first in range(0, len(q), CHUNK):
        part = slice(first, first + CHUNK)
        poses = robot.forward(q[part], base[part])
        for k, contact in enumerate(robot.contacts):
            ends = contact.points()
            tried = ends[:1] + np.linspace(0.0, 1.0, 5)[:, None] * (ends[-1:] - ends[:1])
            away = apply(poses[contact.frame][:, None], tried) - point
            away -= (away @ direction)[..., None] * direction
            out[part, k] = np.linalg.norm(away, axis=-1).min(axis=1) - contact.radius - radius
    return out
