"""How large the rims of a robot are: radii of contact shapes at joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.robot.elements import Contact
from bodyplan.robot.model import Robot


def contact_radii(robot: Robot, q: ArrayLike | Mapping[str, ArrayLike]) -> Array:
    """Radius (..., c) m of every contact of the robot at joint coordinates ``q`` (..., n) rad or m: of a rim with a
    drive that which its joint makes (paper *wheels*, eq. (1)), else that of the contact. Raises InputError."""
    at = robot.vector(q)
    out = np.empty((*at.shape[:-1], len(robot.contacts)))
    for k, contact in enumerate(robot.contacts):
        drive = contact.drive
        out[..., k] = contact.radius if drive is None else drive.radius(at[..., robot.joint_index(drive.joint.name)])
    return out


def contacts_at(robot: Robot, q: ArrayLike | Mapping[str, ArrayLike]) -> tuple[Contact, ...]:
    """The contacts at one configuration ``q`` (n,): rims with a drive as rims of the radius that they have there."""
    radii = contact_radii(robot, q)
    return tuple(
        contact if contact.drive is None else replace(contact, radius=float(radius), drive=None)
        for contact, radius in zip(robot.contacts, radii, strict=True)
    )
