"""How a trial begins: the robot on the floor, and walls that close in on it.

The robot starts in its first planned pose, moved up or down until it just touches the floor. A plan may press
into walls or a ceiling (that is what grips), and starting inside them would throw the robot out. So every
solid that is not a floor stands back at first, by as much as the robot reaches into it, and closes in
smoothly to its own place while the robot settles; from then on it stands still.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.robot.elements import Contact
from bodyplan.robot.model import Robot
from bodyplan.robot.rims import contacts_at
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.model import Physics
from bodyplan.spatial.rotations import rotate

#: part of the settling time in which walls close in; in the rest the robot comes to rest between them
CLOSING = 0.7


def on_the_floor(robot: Robot, q: Array, base: Array, ground: Ground) -> Array:
    """``base`` (7,) moved along z so that the lowest contact shape touches the floor.

    A ball of radius r on a slope with gradient g needs its centre r sqrt(1 + |g|^2) above the floor.
    """
    poses = robot.forward(q, base)
    lift = []
    for contact in contacts_at(robot, q):
        points, radius = _skeleton(contact)
        pose = poses[contact.frame]
        at = pose[:3] + rotate(pose[3:], points)
        slope = np.sqrt(1.0 + np.sum(np.square(ground.gradient(at)), axis=-1))
        lift.append(np.max(ground.height(at) + radius * slope - at[:, 2]))
    out: Array = base + max(lift) * np.eye(7)[2]
    return out


def _skeleton(contact: Contact) -> tuple[Array, float]:
    """Points (p, 3) in the frame whose balls of the returned radius make up the shape."""
    if contact.shape == "capsule":
        return np.linspace(contact.start, contact.end, 9), contact.radius
    if contact.shape == "rim":
        angle = np.linspace(0.0, 2.0 * np.pi, 65)[:-1]
        circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
        return np.asarray(contact.start) + contact.radius * circle, 0.0
    return contact.points(), contact.radius


@dataclass(frozen=True, eq=False)
class Walls:
    """Solids that stand back: indices of their geoms, their own places (w, 3) and the way back (w, 3) m."""

    geoms: IntArray
    home: Array
    back: Array

    @classmethod
    def around(cls, physics: Physics, data: Any) -> Walls:
        """Walls that clear the robot in the configuration of ``data``. Leaves the model with the walls back.

        Raises InputError where the robot is so deep inside a wall that there is no telling which way is out.
        """
        mj, model = mujoco(), physics.model
        geoms = physics.solid_geoms[~physics.role("floor")]
        home = model.geom_pos[geoms].copy()
        for _ in range(8):
            mj.mj_forward(model, data)
            deepest = dict.fromkeys(geoms.tolist(), (0.0, np.zeros(3)))
            for contact in data.contact[: data.ncon]:
                first, second = (int(g) for g in contact.geom)
                wall, sign = (first, -1.0) if first in deepest else (second, 1.0)
                # the contact normal points from the first geom to the second
                if wall in deepest and -contact.dist > deepest[wall][0]:
                    deepest[wall] = (-contact.dist, sign * np.array(contact.frame[:3]))
            if all(depth <= 1e-9 for depth, _ in deepest.values()):
                return cls(geoms, home, model.geom_pos[geoms] - home)
            for geom, (depth, out) in deepest.items():
                model.geom_pos[geom] += 1.001 * depth * out
        raise InputError("the first pose of the motion reaches through a wall; there is no way to start from it.")

    @property
    def depth(self) -> float:
        """How far the farthest wall stands back, m."""
        return float(np.max(np.linalg.norm(self.back, axis=-1), initial=0.0))

    def close(self, model: Any, part: float) -> None:
        """Move the walls in: ``part`` 0 stands back, 1 is their own place; smooth at both ends."""
        s = min(max(part, 0.0), 1.0)
        model.geom_pos[self.geoms] = self.home + (1.0 - s * s * (3.0 - 2.0 * s)) * self.back
