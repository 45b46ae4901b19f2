"""Units of snakes as elements and contacts: rigid links, arc-shaped joints, double joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.elements import Arc, Body, Contact, Element, Joint, Row

AXES = ("yaw", "pitch", "alternating", "universal")
FIRST = ("yaw", "pitch")
QUARTER = 0.5 * np.pi
END_LINK = 0.18


class Feet(NamedTuple):
    """Balls of ``radius`` m on the axis of every pitch joint, ``spread`` m to the left and to the right of the body."""

    radius: float
    spread: float = 0.0


class Parts(NamedTuple):
    """What a snake is made of."""

    elements: list[Element]
    contacts: list[Contact]
    base_body: Body | None = None


@dataclass(frozen=True)
class Units:
    """Units of a snake from tail to head: ``lengths`` (N,) m and ``masses`` (N,) kg, ``radius`` m, ``axes``,
    properties of every joint (``info``), ``friction`` of the belly; ``first`` axis of "alternating", ``feet``."""

    lengths: Array
    masses: Array
    radius: float
    axes: str
    info: Mapping[str, Any]
    friction: float | None
    first: str = "yaw"
    feet: Feet | None = None

    def bends(self, i: int) -> dict[str, Joint]:
        """The joints at place ``i`` (from 1) by the axis that they turn about."""
        turn = (self.first == "yaw") == (i % 2 == 1)
        yaw = self.axes in ("yaw", "universal") or (self.axes == "alternating" and turn)
        pitch = self.axes in ("pitch", "universal") or (self.axes == "alternating" and not turn)
        joints = {"yaw": yaw, "pitch": pitch}
        return {axis: Joint(f"{axis}{i}", **self.info) for axis, there in joints.items() if there}

    def capsule(self, name: str, frame: str, behind: float, ahead: float = 0.0) -> Contact:
        """A capsule along x of a frame, from ``behind`` m behind its origin to ``ahead`` m before it."""
        start, end = (0.0 - behind, 0.0, 0.0), (ahead, 0.0, 0.0)
        return Contact(name, frame, "capsule", self.radius, start=start, end=end, friction=self.friction)

    def soles(self, i: int, frame: str) -> list[Contact]:
        """The feet of the joint at place ``i``, which is at the origin of ``frame``; none where it does not pitch."""
        if self.feet is None or "pitch" not in self.bends(i):
            return []
        radius, spread = self.feet
        sides = {f"foot{i}.left": spread, f"foot{i}.right": -spread} if spread > 0.0 else {f"foot{i}": 0.0}
        return [
            Contact(name, frame, "sphere", radius, start=(0.0, y, 0.0), friction=self.friction)
            for name, y in sides.items()
        ]


def straight(units: Units) -> Parts:
    """Rigid links; joint i turns between links i and i + 1, and has its feet at the front end of link i."""
    parts = Parts([], [])
    sizes = _sizes(units)
    for i, (length, mass) in enumerate(sizes, start=1):
        frame = f"link{i}"
        soles = units.soles(i, frame) if i < len(sizes) else []
        body = Body(mass=mass, com=(-0.5 * length, 0.0, 0.0))
        if soles:  # feet have no mass of their own, and would else count as part of the solid that the link is
            body = Body.rod(mass, length, units.radius)
        bends = units.bends(i - 1) if i > 1 else {}
        if "pitch" in bends:
            # Rx(-90 deg) lays the turning axis z along +y, Rx(+90 deg) sets the link upright again
            parts.elements.append(Row(theta=bends.get("yaw", 0.0), epsilon=-QUARTER, name=f"pre{i - 1}"))
            parts.elements.append(Row(theta=bends["pitch"], a=length, epsilon=QUARTER, name=frame, body=body))
        else:
            parts.elements.append(Row(theta=bends.get("yaw", 0.0), a=length, name=frame, body=body))
        parts.contacts.extend([units.capsule(frame, frame, length), *soles])
    return parts


def arcs(units: Units) -> Parts:
    """Every unit bends with constant curvature.

    Contacts and masses sit on the frames between the units: half of a unit's mass at each of its ends. A capsule
    reaches an eighth of a unit along the tangent, by which it leaves an arc of 1 rad by less than 1 % of its length.
    """
    sizes = [(0.0, 0.0), *_sizes(units), (0.0, 0.0)]
    parts = Parts([], [])
    bodies = []
    for i, ((rear, rear_mass), (front, front_mass)) in enumerate(pairwise(sizes)):
        name, frame = ("tail", "base") if i == 0 else (f"link{i}", f"link{i}")
        parts.contacts.append(units.capsule(name, frame, 0.125 * rear, 0.125 * front))
        bodies.append(_halves(rear, rear_mass, front, front_mass, units.radius))
        if i:
            parts.elements.append(Arc(rear, **units.bends(i), name=frame, body=bodies[i]))
    return parts._replace(base_body=bodies[0])


def _halves(rear: float, rear_mass: float, front: float, front_mass: float, radius: float) -> Body:
    """Half of the unit behind a frame and half of the one before it, as cylinders."""
    masses, sizes = 0.5 * np.array([rear_mass, front_mass]), 0.5 * np.array([rear, front])
    middles = 0.5 * sizes * [-1.0, 1.0]
    total = float(masses.sum())
    com = float(masses @ middles) / total
    spread = masses @ (sizes**2 / 12.0 + (middles - com) ** 2)
    across = float(0.25 * total * radius**2 + spread)
    return Body(mass=total, com=(com, 0.0, 0.0), inertia=(0.5 * total * radius**2, across, across, 0.0, 0.0, 0.0))


def doubles(units: Units, end_link: float, tips: float = 0.0) -> Parts:
    """Double joints (paper *acm*, Figs. 2 and 9): end link, half of the angles, middle link, the other half, end link.

    What lies between the last hinge of a unit and the first one of the next is one rigid part. Masses are spread
    evenly along each unit. ``tips``: length m of a head and of a tail that do not bend, beyond the units and as heavy
    per length as the unit next to them.
    """
    sizes = _sizes(units)
    tail = end_link * sizes[0][0]
    tail_body = Body(mass=(tail + tips) / sizes[0][0] * sizes[0][1], com=(0.5 * (tail - tips), 0.0, 0.0))
    parts = Parts([], [units.capsule("tail", "base", tips, tail)], tail_body)
    for i, (length, mass) in enumerate(sizes, start=1):
        end, middle = end_link * length, (1.0 - 2.0 * end_link) * length
        inner = Body(mass=(1.0 - 2.0 * end_link) * mass, com=(-0.5 * middle, 0.0, 0.0))
        # the front end link is one part with the rear end link of the next unit
        ahead, ahead_mass = (end_link * x for x in sizes[i]) if i < len(sizes) else (tips, tips / length * mass)
        end_mass = end_link * mass
        com = 0.5 * (ahead_mass * ahead - end_mass * end) / (end_mass + ahead_mass)
        outer = Body(mass=end_mass + ahead_mass, com=(com, 0.0, 0.0))
        parts.elements.extend(_double(i, end, middle, units.bends(i), inner, outer))
        parts.contacts.append(units.capsule(f"middle{i}", f"middle{i}", middle))
        parts.contacts.append(units.capsule(f"link{i}", f"link{i}", end, ahead))
    return parts


def _double(i: int, end: float, middle: float, bends: dict[str, Joint], inner: Body, outer: Body) -> list[Element]:
    """Rows of one double joint: yaw outside, pitch inside, half of each on both sides of the middle link."""
    half = {axis: joint.share(0.5) for axis, joint in bends.items()}
    yaw, pitch = half.get("yaw", 0.0), half.get("pitch", 0.0)
    rear, mid, front = f"rear{i}", f"middle{i}", f"link{i}"
    if "pitch" not in half:
        return [Row(a=end, name=rear), Row(theta=yaw, a=middle, name=mid, body=inner),
                Row(theta=yaw, a=end, name=front, body=outer)]  # fmt: skip
    if "yaw" not in half:
        return [Row(a=end, epsilon=-QUARTER, name=rear), Row(theta=pitch, a=middle, name=mid, body=inner),
                Row(theta=pitch, a=end, epsilon=QUARTER, name=front, body=outer)]  # fmt: skip
    return [
        Row(a=end, name=rear),
        Row(theta=yaw, epsilon=-QUARTER, name=f"pre{i}"),
        Row(theta=pitch, a=middle, name=mid, body=inner),
        Row(theta=pitch, epsilon=QUARTER, name=f"post{i}"),
        Row(theta=yaw, a=end, name=front, body=outer),
    ]


def _sizes(units: Units) -> list[tuple[float, float]]:
    """(length m, mass kg) of every unit."""
    return list(zip(units.lengths.tolist(), units.masses.tolist(), strict=True))
