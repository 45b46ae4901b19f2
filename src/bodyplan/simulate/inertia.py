"""Mass, centre and inertia of a frame, from its Body, its contact shapes or a plain rod."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.robot.elements import Body, Contact
from bodyplan.robot.masses import RIM_HALF_WIDTH, centre_of, centroid, middle, volume

#: density of water, kg/m^3: gives a rod or a bare motor a thickness where nothing else says
WATER = 1000.0
#: what an inertia may lack to be that of a body: a part of itself, for the digits of a file, and of m L^2 of a robot of
#: length L, for points without extent
ROUNDED, POINT = 1e-5, 1e-9
#: kg m^2: principal moments that MuJoCo takes for none
NONE = 1e-14


class Inertial(NamedTuple):
    """``mass`` kg, ``com`` (3,) m in the frame, ``inertia`` (3, 3) kg m^2 about ``com`` in frame axes."""

    mass: float
    com: Array
    inertia: Array


def inertial(body: Body, contacts: Sequence[Contact], previous: ArrayLike) -> Inertial:
    """Inertial properties of a frame that carries ``body`` and ``contacts``.

    The centre of mass is that of :func:`bodyplan.robot.masses.centre_of`; ``previous`` (3,) m is the origin of the
    previous frame in this one. Where ``body`` names no inertia it is that of the shapes as homogeneous solids about
    their centroid, or of a rod from ``previous`` to the origin, with the thickness that gives it the density of water
    (a sphere where the rod has no length).
    """
    if contacts:
        solids = [_solid(contact) for contact in contacts]
        centre, total = centroid(contacts), sum(s.mass for s in solids)
        unit = sum((s.inertia + s.mass * _offset(s.com - centre) for s in solids), np.zeros((3, 3))) / total
    else:
        unit = _rod(-np.asarray(previous, dtype=np.float64), body.mass)
    com = centre_of(body, contacts, previous)
    inertia = body.mass * unit
    if body.inertia is not None:
        xx, yy, zz, xy, xz, yz = body.inertia
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return Inertial(body.mass, com, inertia)


def sound(whole: Inertial, length: float) -> Inertial | None:
    """An inertia that a body can have: principal moments > 0, none above the sum of the others. One that lacks that by
    rounding, or has no extent, gets as much more about every axis; None where it lacks more. ``length`` m of the robot.
    """
    A, B, C = np.linalg.eigvalsh(whole.inertia)
    lacking = max(C - A - B, 2.0 * NONE - A)
    if lacking <= 0.0:
        return whole
    if lacking > max(ROUNDED * C, POINT * whole.mass * length**2, 2.0 * NONE):
        return None
    more = lacking + 1e-9 * abs(C) + NONE
    return whole._replace(inertia=whole.inertia + more * np.eye(3))


def joined(parts: Sequence[Inertial]) -> Inertial:
    """The inertia of parts that are one rigid body, all in one frame."""
    mass = sum(part.mass for part in parts)
    com = np.asarray(sum((part.mass * part.com for part in parts), np.zeros(3)) / mass)
    inertia = sum((part.inertia + part.mass * _offset(part.com - com) for part in parts), np.zeros((3, 3)))
    return Inertial(mass, com, np.asarray(inertia))


def moved(whole: Inertial, at: Array, turn: Array) -> Inertial:
    """The same seen from another frame, in which this one is at ``at`` (3,) m, turned by the matrix ``turn`` (3, 3)."""
    return Inertial(whole.mass, at + turn @ whole.com, turn @ whole.inertia @ turn.T)


def axis_of(contact: Contact) -> tuple[Array, float]:
    """(unit axis (3,), length m) of a capsule from start to end; z and 0 where both are the same point."""
    along = np.subtract(contact.end, contact.start)
    length = float(np.linalg.norm(along))
    return (along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])), length


def _solid(contact: Contact) -> Inertial:
    """Volume (as mass at density 1), centroid and inertia of a contact shape."""
    r, size, centre = contact.radius, volume(contact), middle(contact)
    if contact.shape == "sphere":
        return Inertial(size, centre, 0.4 * size * r**2 * np.eye(3))
    if contact.shape == "box":
        half = np.array(contact.half)
        return Inertial(size, centre, size / 3.0 * np.diag(half @ half - half**2))
    if contact.shape == "rim":
        return Inertial(size, centre, size * _cylinder(np.array([0.0, 0.0, 1.0]), r, 2.0 * RIM_HALF_WIDTH * r))
    axis, length = axis_of(contact)
    tube, caps = np.pi * r**2 * length, 4.0 / 3.0 * np.pi * r**3
    # two half balls: 2/5 m r^2 about the axis; across it, their centroids lie 3r/8 outside the tube's ends
    across = caps * (0.4 * r**2 + 0.25 * length**2 + 0.375 * r * length)
    line = np.outer(axis, axis)
    ends = across * (np.eye(3) - line) + 0.4 * caps * r**2 * line
    return Inertial(size, centre, tube * _cylinder(axis, r, length) + ends)


def _cylinder(axis: Array, radius: float, length: float) -> Array:
    """Inertia per mass (3, 3) of a solid cylinder about its centre."""
    line = np.outer(axis, axis)
    return (3.0 * radius**2 + length**2) / 12.0 * (np.eye(3) - line) + 0.5 * radius**2 * line


def _rod(rod: Array, mass: float) -> Array:
    """Inertia per mass (3, 3) of a rod about its middle, as thick as water of that mass and length."""
    length = float(np.linalg.norm(rod))
    ball = (3.0 * mass / (4.0 * np.pi * WATER)) ** (1.0 / 3.0)
    if length <= ball:
        return np.asarray(0.4 * ball**2 * np.eye(3))
    return _cylinder(rod / length, float(np.sqrt(mass / (np.pi * WATER * length))), length)


def _offset(d: Array) -> Array:
    """Parallel-axis term (3, 3) of a unit mass at d (3,)."""
    return np.asarray(d @ d * np.eye(3) - np.outer(d, d))
