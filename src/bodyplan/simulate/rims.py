"""What a robot's joints on wheels mean in physics: which move, and which only say where the ground touches.

A rim is a circle on a frame that turns, its hub. The model of a robot on wheels (:func:`bodyplan.robot.rovers.rover`)
describes the point that touches by a passive joint, the contact angle, next to the hub. No motor turns a contact
angle: it is an outcome. Such joints are :class:`Pointer` here and become no part of the physics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.robot.elements import Contact, Joint, Row, WheelRadius
from bodyplan.robot.model import Robot
from bodyplan.simulate.inertia import Inertial
from bodyplan.spatial.rotations import rotate

#: mass of the ring of a wheel that changes its radius, over that of the robot: 24 tips of 5 g on 10 kg
RING_SHARE = 0.012
#: a tip's radius over the wheel's largest where the wheel has no rubber, and at most over its smallest
BARE_TIP, SMALL_TIP = 0.05, 0.5


@dataclass(frozen=True)
class Rim:
    """A rim: its ``contact``, the frame ``axle`` before its own, and the joint ``spin`` that turns it (or None)."""

    contact: Contact
    axle: str
    spin: str | None


@dataclass(frozen=True)
class Pointer:
    """A passive joint that points at where rims touch: its ``frame``, ``column`` in q, the ``axle`` it turns about,
    the names of the ``rims`` about that axle; it points at ``offset + scale q`` rad from the axle's x about its z."""

    frame: str
    column: int
    axle: str
    rims: tuple[str, ...]
    offset: float
    scale: float


def rims_of(robot: Robot) -> tuple[Rim, ...]:
    """All rims of a robot, in the order of its contacts."""
    found = []
    before, rows = _previous(robot), dict(zip(robot.frames[1:], robot.elements, strict=True))
    for contact in robot.contacts:
        if contact.shape == "rim":
            row = rows.get(contact.frame)
            turns = isinstance(row, Row) and isinstance(row.theta, Joint)
            spin = row.theta.name if turns else None  # type: ignore[union-attr]
            found.append(Rim(contact, before.get(contact.frame, "base"), spin))
    return tuple(found)


def pointers_of(robot: Robot) -> tuple[Pointer, ...]:
    """The contact angles of a robot: rows that a passive joint turns about the axle of a rim, with nothing on them
    or behind them and nothing else that the joint moves. Raises InputError for a wheel-radius law anywhere else than
    on such a row or a rim, and for one whose joint also moves something else."""
    before, uses = _previous(robot), _uses(robot)
    busy = {contact.frame for contact in robot.contacts} | set(before.values())
    rims: dict[str, list[str]] = {}
    for rim in rims_of(robot):
        rims.setdefault(rim.axle, []).append(rim.contact.name)
    found = []
    for frame, row in zip(robot.frames[1:], robot.elements, strict=True):
        axle = before[frame]
        if isinstance(row, Row) and axle in rims and frame not in busy and row.body is None:
            theta, length = row.theta, row.a
            others = any(isinstance(v, Joint) for v in (row.d, length, row.epsilon))
            if isinstance(theta, Joint) and not theta.actuated and uses[theta.name] == 1 and not others:
                # a negative length points backwards
                offset = theta.offset + (np.pi if isinstance(length, (int, float)) and length < 0.0 else 0.0)
                column = robot.joint_index(theta.name)
                found.append(Pointer(frame, column, axle, tuple(rims[axle]), offset, theta.scale))
                continue
        for law in (getattr(row, field) for field in row.VARIABLES):
            if isinstance(law, WheelRadius):
                raise InputError(
                    f"joint {law.joint.name!r}: a wheel-radius law in physics needs a rim that follows it; it can also "
                    f"drive the way to where that rim touches, but frame {frame!r} is not such a place (nothing on "
                    "it, turned by a passive joint about the axle of the rim). Drive the length by a prismatic joint "
                    "instead."
                )
    for contact in robot.contacts:
        if contact.drive is not None and uses.get(contact.drive.joint.name):
            raise InputError(
                f"joint {contact.drive.joint.name!r}: changes the radius of rim {contact.name!r} and also moves a row; "
                "in physics it can do only one of both."
            )
    return tuple(found)


def _previous(robot: Robot) -> dict[str, str]:
    """Frame -> the frame before it."""
    out = {}
    for chain in robot.chains:
        before = robot.frames[robot.frame_index(chain.parent)]
        for i in range(len(chain.elements)):
            out[chain.frame_name(i)] = before
            before = chain.frame_name(i)
    return out


def _uses(robot: Robot) -> dict[str, int]:
    """How many variables a joint moves by itself (radius laws apart)."""
    uses: dict[str, int] = {}
    for element in robot.elements:
        for field in element.VARIABLES:
            value = getattr(element, field)
            if isinstance(value, Joint):
                uses[value.name] = uses.get(value.name, 0) + 1
    return uses


# --- the ring of a wheel --------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Ring:
    """A rim that changes its radius as balls on radial slides: ``tip`` m their radius, ``mass`` kg of all of them,
    ``rest`` m the way from the axle to their centres where their slides read 0; slide = sum of ``law[k] q^k`` m,
    off by at most ``error`` m between ``low`` and ``high`` rad."""

    rim: Rim
    law: Array
    rest: float
    tip: float
    mass: float
    error: float
    low: float
    high: float

    @property
    def joint(self) -> str:
        """The joint that changes the radius."""
        drive = self.rim.contact.drive
        assert drive is not None  # a ring is made of a rim with a drive
        return drive.joint.name


def ring_of(rim: Rim, drive: WheelRadius, low: float, high: float, mass: float) -> Ring:
    """The ring of a rim whose joint stays between ``low`` and ``high`` rad.

    MuJoCo ties a slide to a joint by a polynomial of degree 4. It is that through the law at the Chebyshev points: good
    to 1.1e-4 of the link's length over [0, pi], to 1.5e-5 over two thirds of that."""
    smallest = float(np.min(drive.radius([low, high])))
    tip = drive.rubber if drive.rubber > 0.0 else min(BARE_TIP * drive.largest, SMALL_TIP * smallest)
    if smallest < 1e-6 * drive.largest:
        raise InputError(f"rim {rim.contact.name!r}: has no radius left at q = {high:.6g} rad and no rubber on it.")
    rest = 0.5 * float(np.sum(drive.radius([low, high]))) - tip
    chebyshev = np.polynomial.Chebyshev.interpolate(lambda q: drive.radius(q) - tip - rest, 4, domain=[low, high])
    law = np.asarray(chebyshev.convert(kind=np.polynomial.Polynomial).coef, dtype=np.float64)
    law = np.concatenate([law, np.zeros(5 - len(law))])
    q = np.linspace(low, high, 400)
    error = float(np.max(np.abs(np.polynomial.polynomial.polyval(q, law) + rest + tip - drive.radius(q))))
    return Ring(rim, law, rest, tip, mass, error, low, high)


def lightened(whole: Inertial, parts: Sequence[tuple[float, Array]]) -> Inertial:
    """What is left of a body without masses (kg) at points (3,) m of it, so that body and masses together have the
    mass, the centre and the inertia that it had. Where no body has the inertia that would be left, it keeps its own
    in proportion to its mass."""
    mass = whole.mass - sum(m for m, _ in parts)
    com = (whole.mass * whole.com - sum((m * p for m, p in parts), np.zeros(3))) / mass
    inertia = whole.inertia + whole.mass * _offset(whole.com) - mass * _offset(com)
    inertia = inertia - sum((m * _offset(p) for m, p in parts), np.zeros((3, 3)))
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0.0 or moments[0] + moments[1] < moments[2]:
        inertia = whole.inertia * (mass / whole.mass)
    return Inertial(mass, com, inertia)


def _offset(d: Array) -> Array:
    return np.asarray(d @ d * np.eye(3) - np.outer(d, d))


def given_up(rings: Sequence[Ring], robot: Robot) -> dict[str, list[tuple[float, Array]]]:
    """Frame -> masses and their points that its body gives to rings: the hub where it is heavy enough, else the base.

    A ring is symmetric about its axle, so that the robot's mass and centre of mass stay what the model says. Raises
    InputError where neither can."""
    carried = dict(zip(robot.frames, [robot.base_body, *(element.body for element in robot.elements)], strict=True))
    rest = robot.forward(np.zeros(robot.n))
    out: dict[str, list[tuple[float, Array]]] = {}
    for ring in rings:
        frame, point = ring.rim.contact.frame, np.array(ring.rim.contact.start)
        hub = carried[frame]
        if hub is None or hub.mass <= ring.mass:
            pose = rest[frame]
            frame, point = "base", pose[:3] + rotate(pose[3:], point)
        out.setdefault(frame, []).append((ring.mass, point))
    for frame, parts in out.items():
        body = carried[frame]
        if body is None or body.mass <= sum(m for m, _ in parts):
            raise InputError(
                f"robot {robot.name!r}: {frame!r} has no mass to spare for the rings of its wheels, "
                f"{sum(m for m, _ in parts):.3g} kg; give it a heavier Body."
            )
    return out
