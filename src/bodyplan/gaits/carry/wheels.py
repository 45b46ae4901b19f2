"""The wheels of a robot, read off its rows: where they are, how they turn, how their radius follows a joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError
from bodyplan.robot.elements import Chain, Contact, Joint, Row, WheelRadius
from bodyplan.robot.model import Robot
from bodyplan.spatial import matrix_from_quaternion

#: relative error up to which a radius beyond its range is rounding
ROUNDING = 1e-12


@dataclass(frozen=True)
class Wheel:
    """One wheel. ``centre`` (3,) m and the unit vectors ``ahead``, ``down``, ``axle`` (3,) in the base: a point of the
    rim at the contact angle phi is ``centre + R (sin(phi) ahead + cos(phi) down)``; ``axle = ahead x down`` points
    left.

    ``law``: the radius, that of a joint or a fixed one in m. ``rim``: number of its contact. ``angle``, ``adjust``,
    ``spin``: columns of its joints in q (``adjust`` None where the radius is fixed). The angle's row turns by
    ``offset + scale q`` from the axle's x axis, the hub's by ``turn q``.
    """

    name: str
    centre: Array
    ahead: Array
    down: Array
    axle: Array
    law: WheelRadius | float
    rim: int
    angle: int
    adjust: int | None
    spin: int
    offset: float
    scale: float
    turn: float
    limits: tuple[float, float]
    across: Array

    @property
    def columns(self) -> list[int]:
        """Columns of its joints in q: contact angle, spin and, with a variable radius, the adjusting one."""
        return [self.angle, self.spin, *([] if self.adjust is None else [self.adjust])]

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest radius m within the limits of the adjusting joint."""
        if not isinstance(self.law, WheelRadius):
            return self.law, self.law
        low, high = self.limits
        return float(self.law.radius(high)), float(self.law.radius(low))

    def angle_of(self, radius: Array) -> tuple[Array, BoolArray]:
        """Adjusting angle q (...,) rad of radii (...,) m (paper *wheels*, eq. (1), solved for q), clipped where they
        are beyond the range, and whether they are within it; 0 for a wheel of fixed radius."""
        low, high = self.range
        inside = (radius >= low - ROUNDING * high) & (radius <= high + ROUNDING * high)
        if not isinstance(self.law, WheelRadius):
            return np.zeros(np.shape(radius)), np.asarray(inside)
        span = self.law.largest - self.law.rubber
        share = (np.clip(radius, low, high) - self.law.rubber) / span
        # acos loses half of the digits next to q = 0; asin of half the gap keeps them
        gap = np.clip(0.5 * (1.0 - share), 0.0, 1.0)
        q = 4.0 * np.arcsin(np.sqrt(gap))
        return np.asarray(np.clip(q, *self.limits)), np.asarray(inside)

    def joint_angle(self, phi: Array) -> Array:
        """Coordinate (...,) of the contact's joint at contact angles phi (...,), in (-pi, pi] / |scale|."""
        u = np.sin(phi)[..., None] * self.ahead + np.cos(phi)[..., None] * self.down
        along = np.cross(self.axle, self.across)
        theta = np.arctan2(u @ along, u @ self.across) - self.offset
        return np.asarray((np.remainder(theta + np.pi, 2.0 * np.pi) - np.pi) / self.scale)


class Wheels:
    """All wheels of a robot, in the order of its rims."""

    def __init__(self, robot: Robot, wheels: tuple[Wheel, ...]) -> None:
        self.robot, self.wheels = robot, wheels
        self.names = tuple(wheel.name for wheel in wheels)
        self.centres = np.array([wheel.centre for wheel in wheels])
        #: (k, 3, 3): rows ahead, down, axle
        self.axes = np.array([[wheel.ahead, wheel.down, wheel.axle] for wheel in wheels])

    def __len__(self) -> int:
        return len(self.wheels)

    def __iter__(self) -> Iterator[Wheel]:
        return iter(self.wheels)

    @staticmethod
    def of(robot: Robot) -> Wheels:
        """The wheels of ``robot``: contacts of shape "rim" about the z axis of a hub that turns on an axle fixed to the
        base, each with a chain from that axle to the point that touches, as :func:`bodyplan.robot.rovers.rover` makes
        them. InputError where there are none or one is not like that."""
        return _wheels(robot)


@lru_cache(maxsize=64)
def _wheels(robot: Robot) -> Wheels:
    rims = [(i, contact) for i, contact in enumerate(robot.contacts) if contact.shape == "rim"]
    if not rims:
        raise InputError(f"robot {robot.name!r}: has no wheels (contacts of shape 'rim'); see bodyplan.rover.")
    return Wheels(robot, tuple(_wheel(robot, i, contact) for i, contact in rims))


def _wheel(robot: Robot, rim: int, contact: Contact) -> Wheel:
    def refused(why: str) -> InputError:
        return InputError(f"robot {robot.name!r}, contact {contact.name!r}: {why}; see bodyplan.rover for a wheel.")

    if any(contact.start):
        raise refused("the rim must be centred on its hub")
    hub, parent = _element_before(robot, contact.frame)
    if hub is None or not isinstance(hub.theta, Joint) or any(not isinstance(v, float) or v for v in (hub.d, hub.a)):
        raise refused("its frame must be a hub: a row that turns about its own z axis")
    if not _fixed(robot, parent):
        raise refused(f"the axle {parent!r} must be fixed to the base")
    chain, row = _contact_row(robot, contact, parent)
    if row is None or chain is None or not isinstance(row.theta, Joint):
        raise refused(f"no chain from the axle {parent!r} ends in a row of a contact angle and the rim's radius")
    pose = robot.forward(np.zeros(robot.n))[parent]
    axes = matrix_from_quaternion(pose[3:])
    x, axle = axes[:, 0], axes[:, 2]
    down = np.array([0.0, 0.0, -1.0])
    down = down - (down @ axle) * axle
    if np.linalg.norm(down) < 1e-9:
        raise refused("an upright axle has no lowest point")
    down /= np.linalg.norm(down)
    law = contact.drive if contact.drive is not None else contact.radius
    adjust = robot.joint_index(law.joint.name) if isinstance(law, WheelRadius) else None
    low, high = (0.0, 0.0) if adjust is None else robot.limits[adjust].tolist()
    return Wheel(
        name=chain.name,
        centre=pose[:3],
        ahead=np.cross(down, axle),
        down=down,
        axle=axle,
        law=law,
        rim=rim,
        angle=robot.joint_index(row.theta.name),
        adjust=adjust,
        spin=robot.joint_index(hub.theta.name),
        offset=row.theta.offset,
        scale=row.theta.scale,
        turn=hub.theta.scale,
        limits=(low, high),
        across=x,
    )


def _element_before(robot: Robot, frame: str) -> tuple[Row | None, str]:
    """The row that ends in ``frame``, and the frame that it starts from."""
    index = robot.frame_index(frame)
    for chain, end in zip(robot.chains, robot.ends, strict=True):
        first = end - len(chain.elements) + 1
        if first <= index <= end:
            element = chain.elements[index - first]
            parent = chain.parent if index == first else chain.frame_name(index - first - 1)
            return (element if isinstance(element, Row) else None), robot.frames[robot.frame_index(parent)]
    return None, "base"


def _fixed(robot: Robot, frame: str) -> bool:
    """Whether nothing between the base and ``frame`` is driven."""
    while frame != "base":
        row, frame = _element_before(robot, frame)
        if row is None or any(not isinstance(getattr(row, field), float) for field in Row.VARIABLES):
            return False
    return True


def _contact_row(robot: Robot, rim: Contact, axle: str) -> tuple[Chain | None, Row | None]:
    """The chain whose last row leads from the axle to the rim's contact point, and that row."""
    for chain in robot.chains:
        row, parent = _element_before(robot, chain.frame_name(len(chain.elements) - 1))
        if row is None or parent != axle or not isinstance(row.theta, Joint) or row.d != 0.0:
            continue
        if (rim.drive is None and row.a == rim.radius) or (rim.drive is not None and row.a == rim.drive):
            return chain, row
    return None, None
