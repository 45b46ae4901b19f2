"""Where a robot's masses are: the centre of every body, and the centre of mass of the whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.errors import InputError
from bodyplan.robot.elements import Body, Contact
from bodyplan.robot.model import Robot
from bodyplan.spatial.rotations import conjugate, rotate

#: half width of a rim's cylinder over its radius (a contact names the circle only)
RIM_HALF_WIDTH = 0.1


def mass_points(robot: Robot) -> tuple[IntArray, Array, Array]:
    """(frames (b,), masses (b,) kg, centres (b, 3) m): every :class:`Body` of the robot, that of the base included, as
    a mass at a point that is fixed in its frame; ``frames`` are indices in ``robot.frames``. See :func:`centre_of`
    for a body that names no centre of mass."""
    shapes: dict[str, list[Contact]] = {}
    for contact in robot.contacts:
        shapes.setdefault(contact.frame, []).append(contact)
    previous = previous_origins(robot)
    bodies = [robot.base_body, *(element.body for element in robot.elements)]
    some = [(i, body) for i, body in enumerate(bodies) if body is not None]
    centres = [centre_of(body, shapes.get(robot.frames[i], []), previous[i]) for i, body in some]
    return (
        np.array([i for i, _ in some], dtype=np.int64),
        frozen([body.mass for _, body in some]),
        frozen(np.reshape(centres, (-1, 3))),
    )


def center_of_mass(robot: Robot, q: ArrayLike | Mapping[str, ArrayLike], base: ArrayLike | None = None) -> Array:
    """Centre of mass (..., 3) m in the world at joint coordinates ``q`` (..., n) rad or m and base poses ``base``
    (..., 7), as in :meth:`Robot.forward`. Raises InputError for a robot without mass."""
    return center_from_poses(robot, robot.forward(q, base).array)


def center_from_poses(robot: Robot, poses: Array) -> Array:
    """Centre of mass (..., 3) m of a robot whose frames have poses (..., F, 7). Raises InputError for a robot without
    mass."""
    frames, masses, centres = mass_points(robot)
    if not len(frames):
        raise InputError(f"robot {robot.name!r}: has no mass; give its rows or its base a Body.")
    places = poses[..., frames, :3] + rotate(poses[..., frames, 3:], centres)
    return np.asarray(masses @ places / masses.sum())


def centre_of(body: Body, contacts: Sequence[Contact], previous: ArrayLike) -> Array:
    """Centre of mass (3,) m of a body in its frame: where the body says, or else the centroid of the ``contacts`` on
    the frame as homogeneous solids, or without any the middle of a rod from ``previous`` (3,), the origin of the
    previous frame in this one, to the origin."""
    if body.com is not None:
        return np.array(body.com)
    if not contacts:
        return 0.5 * np.asarray(previous, dtype=np.float64)
    return centroid(contacts)


def centroid(contacts: Sequence[Contact]) -> Array:
    """Centroid (3,) m of contact shapes on one frame, each weighing its volume also where they overlap."""
    volumes = np.array([volume(contact) for contact in contacts])
    return np.asarray(volumes @ np.array([middle(contact) for contact in contacts]) / volumes.sum())


def volume(contact: Contact) -> float:
    """Volume of a contact shape, m^3."""
    r = contact.radius
    if contact.shape == "box":
        return 8.0 * float(np.prod(contact.half))
    if contact.shape == "rim":
        return float(np.pi * r**2 * 2.0 * RIM_HALF_WIDTH * r)
    ball = float(4.0 / 3.0 * np.pi * r**3)
    if contact.shape == "sphere":
        return ball
    return float(np.pi * r**2 * np.linalg.norm(np.subtract(contact.end, contact.start))) + ball


def middle(contact: Contact) -> Array:
    """Centroid (3,) m of a contact shape in its frame."""
    if contact.shape == "capsule":
        return np.asarray(0.5 * np.add(contact.start, contact.end))
    return np.array(contact.start)


def previous_origins(robot: Robot) -> Array:
    """(F, 3) m: the origin of the frame before each frame, seen from it, at q = 0; zero for the base."""
    rest = robot.forward(np.zeros(robot.n))
    before = [0]
    for chain in robot.chains:
        parent = robot.frame_index(chain.parent)
        for _ in chain.elements:
            before.append(parent)
            parent = len(before) - 1
    return np.asarray(rotate(conjugate(rest.quaternions), rest.positions[before] - rest.positions))
