"""Walking robots: any number of equal legs around a body, from the D-H table of paper *legs*."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError
from bodyplan.robot.elements import Body, Contact, Joint, Row
from bodyplan.robot.model import Robot

QUARTER, DEGREE = 0.5 * math.pi, math.pi / 180.0
JOINTS = ("shoulder", "hip", "knee")
LINKS = (0.06, 0.24, 0.24)
LIMITS = ((-80.0 * DEGREE, 80.0 * DEGREE), (-60.0 * DEGREE, 90.0 * DEGREE), (-160.0 * DEGREE, 0.0))
RATE, EFFORT, MASS, FOOT, SOLE = 90.0 * DEGREE, 100.0, 30.0, 0.01, 0.02
#: shares of the robot's mass in all coxae, thighs and shins together; the body has the rest
SHARES = (0.12, 0.14, 0.06)
#: of a shin's mass, what its foot takes when the foot has joints of its own
FOOT_SHARE = 0.25
#: thickness of a link that can touch over that of the foot's ball
SLIM = 0.8
#: height of the body over its mean side
FLATNESS = 0.3


class _Legs(NamedTuple):
    """What all legs of a robot have in common."""

    links: Array
    masses: tuple[float, float, float]
    joints: tuple[Mapping[str, Any], ...]
    radius: float
    friction: float | None
    sole: float | None
    shell: bool


def walker(
    mounts: Mapping[str, Sequence[float]],
    *,
    links: Sequence[float] = LINKS,
    body: float | Sequence[float] | None = None,
    passive: bool = False,
    sole: float | None = None,
    mass: float = MASS,
    foot_radius: float = FOOT,
    limits: Any = None,
    rate: float | Sequence[float] | None = RATE,
    effort: float | Sequence[float] | None = EFFORT,
    friction: float | None = None,
    shell: bool = False,
    name: str = "walker",
) -> Robot:
    """A body with a leg at each of ``mounts``: name -> (x m, y m, heading rad) of a shoulder in the base frame.

    The base is in the middle of the body, x forward, y left, z up. A leg "a" (chain "a", paper *legs* Table 1) has
    the joints

    * "a.shoulder" about z: 0 points the leg along its heading, positive turns it counter-clockwise seen from above;
    * "a.hip": 0 lays the thigh level, positive raises it;
    * "a.knee": 0 stretches the leg, negative bends the shin down.

    ``links`` (3,) m: coxa, thigh, shin (a_1, a_2, a_3). Frames "a.shoulder", "a.hip", "a.knee" are at the joints and
    "a.foot" at the end; there is the contact "a.foot", a ball of ``foot_radius`` m with Coulomb coefficient
    ``friction``. With SILO4's links a leg stands well at shoulder 0, hip 0, knee -120 deg (foot 0.18 m out from the
    shoulder's axis, 0.208 m below it) or, closer in, at hip -14, knee -130 deg (0.10 m out, 0.20 m below).

    ``passive``: the foot has the three joints of Table 1 without actuators, "a.ankle", "a.heel", "a.sole", with frames
    of the same names; the contact is ``sole`` m (default 20 mm, d_6 = -sole) below the ankle.

    ``limits`` (low, high) rad for all joints, or three such pairs for shoulder, hip, knee (default +-80, -60 to 90,
    -160 to 0 deg). ``rate`` rad/s (default 90 deg/s) and ``effort`` N m (default 100): one number, or three; None: no
    limit. Passive joints have none.

    ``mass`` kg of the whole robot. How it is spread is an assumption: 68 % in the body, a solid box as large as
    ``body`` (side, or (length, width), m; default: the rectangle around the mounts) and 0.3 of its mean side high;
    12 % in all coxae, 14 % in the thighs, 6 % in the shins, as rods along the links.

    ``shell``: the body (contact "body", a box) and the links (capsules "a.coxa", "a.thigh", "a.shin", 0.8 times as
    thick as the foot's ball) can touch, too, and are drawn as solids; else only feet touch.

    Raises InputError for a value out of range, a name that is not one, options that do not go together.
    """
    legs = _mounts(mounts)
    sizes = finite(links, "links", (3,))
    if np.any(sizes <= 0.0):
        raise InputError(f"links: every length must be > 0, got {sizes.tolist()}.")
    total, radius = number(mass, "mass", above=0.0), number(foot_radius, "foot_radius", above=0.0)
    length, width = _sides(body, legs)
    height = FLATNESS * 0.5 * (length + width)
    info = _properties(limits, rate, effort)
    coxa, thigh, shin = (share * total / len(legs) for share in SHARES)
    own = _Legs(sizes, (coxa, thigh, shin), info, radius, friction, _sole(sole, passive), shell)

    rows = {leg: _rows(leg, place, own) for leg, place in legs.items()}
    contacts = [Contact(f"{leg}.foot", f"{leg}.foot", "sphere", radius, friction=friction) for leg in legs]
    if shell:
        half = 0.5 * length, 0.5 * width, 0.5 * height
        contacts.append(Contact("body", "base", "box", half=half, friction=friction))
        contacts.extend(contact for leg in legs for contact in _capsules(leg, own))
    rest = total * (1.0 - sum(SHARES))
    xx, yy, zz = (rest / 12.0 * (a**2 + b**2) for a, b in ((width, height), (length, height), (length, width)))
    base = Body(mass=rest, com=(0.0, 0.0, 0.0), inertia=(xx, yy, zz, 0.0, 0.0, 0.0))
    return Robot.from_rows(rows, contacts=contacts, base_body=base, name=name)


def silo4(
    *,
    body: float | Sequence[float] = 0.31,
    links: Sequence[float] = LINKS,
    passive: bool = False,
    sole: float | None = None,
    mass: float = MASS,
    foot_radius: float = FOOT,
    limits: Any = None,
    rate: float | Sequence[float] | None = RATE,
    effort: float | Sequence[float] | None = EFFORT,
    friction: float | None = None,
    shell: bool = False,
    name: str = "silo4",
) -> Robot:
    """SILO4, the quadruped of paper *legs*: legs "fl", "fr", "hl", "hr" with shoulders on a 310 mm square.

    Each leg points along its diagonal at shoulder 0; links 60, 240, 240 mm (from the literature; not in the paper).
    ``body``: side of the square of the shoulders, or (length, width) of a rectangle, m. Joints, frames, contacts,
    typical stances and all other options as in :func:`walker`; with ``passive`` the robot is that of Table 1 (24
    joints, 12 of them passive). Masses, limits, rates and efforts are assumptions. Raises InputError.
    """
    x, y = (0.5 * side for side in _pair(body))
    mounts = {
        leg: (sx * x, sy * y, math.atan2(sy * y, sx * x))
        for leg, sx, sy in (("fl", 1, 1), ("fr", 1, -1), ("hl", -1, 1), ("hr", -1, -1))
    }
    return walker(
        mounts,
        links=links,
        body=body,
        passive=passive,
        sole=sole,
        mass=mass,
        foot_radius=foot_radius,
        limits=limits,
        rate=rate,
        effort=effort,
        friction=friction,
        shell=shell,
        name=name,
    )


def hexapod(
    *,
    body: float | Sequence[float] = (0.5, 0.25),
    waist: float | None = None,
    splay: float = 30.0 * DEGREE,
    links: Sequence[float] = LINKS,
    passive: bool = False,
    sole: float | None = None,
    mass: float = MASS,
    foot_radius: float = FOOT,
    limits: Any = None,
    rate: float | Sequence[float] | None = RATE,
    effort: float | Sequence[float] | None = EFFORT,
    friction: float | None = None,
    shell: bool = False,
    name: str = "hexapod",
) -> Robot:
    """A six-legged robot: legs "l1", "l2", "l3" on the left from front to rear, "r1", "r2", "r3" on the right.

    ``body`` (length, width) m of the rectangle of the four outer shoulders (or the side of a square); the middle
    shoulders are ``waist`` m apart (default: the width; more for a body that is oval seen from above). At shoulder 0
    the middle legs point straight aside, the front and rear ones ``splay`` rad further forward and back. Joints,
    frames, contacts, typical stances and all other options as in :func:`walker`. Raises InputError.
    """
    length, width = _pair(body)
    middle = width if waist is None else number(waist, "waist", above=0.0)
    turn = number(splay, "splay", at_least=-QUARTER, at_most=QUARTER)
    places = ((0.5 * length, 0.5 * width, turn), (0.0, 0.5 * middle, 0.0), (-0.5 * length, 0.5 * width, -turn))
    mounts = {
        f"{side}{i}": (x, sign * y, sign * (QUARTER - forward))
        for side, sign in (("l", 1.0), ("r", -1.0))
        for i, (x, y, forward) in enumerate(places, start=1)
    }
    return walker(
        mounts,
        links=links,
        body=(length, max(width, middle)),
        passive=passive,
        sole=sole,
        mass=mass,
        foot_radius=foot_radius,
        limits=limits,
        rate=rate,
        effort=effort,
        friction=friction,
        shell=shell,
        name=name,
    )


# --- one leg ------------------------------------------------------------------------------------------------


def _rows(leg: str, mount: Array, legs: _Legs) -> list[Row]:
    """Rows of paper *legs* Table 1: mount, shoulder, hip, knee and, with ``sole``, ankle, heel, sole."""
    x, y, heading = mount.tolist()
    bearing = math.atan2(y, x)
    a1, a2, a3 = legs.links.tolist()
    shoulder, hip, knee = (Joint(f"{leg}.{name}", **info) for name, info in zip(JOINTS, legs.joints, strict=True))
    # the mount row turns x towards the shoulder, the shoulder's offset on to the heading
    aim = math.remainder(heading - bearing, math.tau)
    shoulder = Joint(shoulder.name, aim, 1.0, shoulder.limits, shoulder.rate, shoulder.effort)
    coxa, thigh, shin = legs.masses
    radius, foot = legs.radius, 0.0 if legs.sole is None else FOOT_SHARE * shin
    rows = [
        Row(theta=bearing, a=math.hypot(x, y), name=f"{leg}.shoulder"),
        Row(theta=shoulder, a=a1, epsilon=QUARTER, name=f"{leg}.hip", body=Body.rod(coxa, a1, radius)),
        Row(theta=hip, a=a2, name=f"{leg}.knee", body=Body.rod(thigh, a2, radius)),
    ]
    end = "foot" if legs.sole is None else "ankle"
    rows.append(Row(theta=knee, a=a3, name=f"{leg}.{end}", body=Body.rod(shin - foot, a3, radius)))
    if legs.sole is not None:
        ankle, heel, turn = (
            Joint(f"{leg}.{name}", offset, actuated=False)
            for name, offset in (("ankle", 0.0), ("heel", QUARTER), ("sole", QUARTER))
        )
        rows += [
            Row(theta=ankle, epsilon=QUARTER, name=f"{leg}.heel"),
            Row(theta=heel, epsilon=-QUARTER, name=f"{leg}.sole"),
            # z of the sole points back up the shank, so the ground is on its negative side
            Row(theta=turn, d=-legs.sole, name=f"{leg}.foot", body=Body(mass=foot)),
        ]
    return rows


def _capsules(leg: str, legs: _Legs) -> list[Contact]:
    """The links as capsules back along x of the frame that each ends in."""
    ends = ("hip", "knee", "foot" if legs.sole is None else "ankle")
    # the ball must touch the ground alone: a shin keeps off it
    short = (0.0, 0.0, 2.0 * legs.radius if legs.sole is None else 0.0)
    return [
        Contact(
            f"{leg}.{part}",
            f"{leg}.{end}",
            "capsule",
            SLIM * legs.radius,
            start=(-length, 0.0, 0.0),
            end=(0.0 - min(gap, 0.5 * length), 0.0, 0.0),
            friction=legs.friction,
        )
        for part, end, length, gap in zip(("coxa", "thigh", "shin"), ends, legs.links.tolist(), short, strict=True)
    ]


# --- options ------------------------------------------------------------------------------------------------


def _mounts(mounts: Mapping[str, Sequence[float]]) -> dict[str, Array]:
    if not isinstance(mounts, Mapping) or not mounts:
        raise InputError(f"mounts: expected leg names with their (x, y, heading), got {mounts!r}.")
    return {leg: finite(place, f"mounts[{leg!r}]", (3,)) for leg, place in mounts.items()}


def _pair(body: ArrayLike) -> tuple[float, float]:
    sides = finite(body, "body")
    if sides.shape not in ((), (2,)) or np.any(sides <= 0.0):
        raise InputError(f"body: expected a side or (length, width) in m, each > 0, got {body!r}.")
    length, width = np.broadcast_to(sides, (2,)).tolist()
    return length, width


def _sides(body: ArrayLike | None, legs: Mapping[str, Array]) -> tuple[float, float]:
    if body is not None:
        return _pair(body)
    length, width = np.ptp([place[:2] for place in legs.values()], axis=0).tolist()
    if min(length, width) <= 0.0:
        raise InputError("body: the mounts do not span a rectangle; give (length, width) in m.")
    return length, width


def _sole(sole: float | None, passive: bool) -> float | None:
    if passive:
        return number(SOLE if sole is None else sole, "sole", above=0.0)
    if sole is not None:
        raise InputError(f"sole: only a passive foot has one; got {sole!r} with passive = {passive!r}.")
    return None


def _properties(limits: Any, rate: Any, effort: Any) -> tuple[Mapping[str, Any], ...]:
    """limits, rate and effort of shoulder, hip and knee."""
    ranges = np.asarray(LIMITS) if limits is None else finite(limits, "limits")
    if ranges.shape not in ((2,), (3, 2)):
        raise InputError(f"limits: expected (low, high) or three such pairs, got {limits!r}.")
    pairs = np.broadcast_to(ranges, (3, 2)).tolist()
    most = {"rate": _three(rate, "rate"), "effort": _three(effort, "effort")}
    return tuple(
        {"limits": tuple(pair), "rate": most["rate"][i], "effort": most["effort"][i]} for i, pair in enumerate(pairs)
    )


def _three(value: Any, field: str) -> list[float] | list[None]:
    if value is None:
        return [None] * 3
    numbers = finite(value, field)
    if numbers.shape not in ((), (3,)):
        raise InputError(f"{field}: expected one number, or three for {', '.join(JOINTS)}, got {value!r}.")
    return list(np.broadcast_to(numbers, (3,)).tolist())
