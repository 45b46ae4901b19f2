"""Robots on wheels that change their radius (paper *wheels*), in any number and at any places of a body."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from bodyplan.arrays import finite, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Body, Contact, Joint, Row, WheelRadius
from bodyplan.robot.model import Robot

QUARTER = 0.5 * math.pi
NAMES = ("fl", "fr", "r")
LINK, RUBBER, MASS, THICKNESS = 0.3, 0.02, 10.0, 0.02
#: rubber on concrete (Table 1)
RUBBER_FRICTION = 1.0


class _Wheel(NamedTuple):
    """One wheel: place (x, y, z) m and heading rad of its axle's frame in the base, radius and mass."""

    place: tuple[float, float, float]
    heading: float
    radius: WheelRadius | float
    mass: float


def tri_wheel(
    link: float | Mapping[str, float] = LINK,
    half_length: float = 0.6,
    half_width: float = 0.6,
    rubber: float | Mapping[str, float] = RUBBER,
    mass: float = MASS,
    *,
    radius: float | Mapping[str, float] | None = None,
    thickness: float = THICKNESS,
    com: ArrayLike = (0.0, 0.0, 0.0),
    wheel_mass: float = 0.0,
    limits: Any = None,
    rate: float | None = None,
    effort: float | None = None,
    spin_rate: float | None = None,
    spin_effort: float | None = None,
    friction: float | Mapping[str, float] | None = RUBBER_FRICTION,
    name: str = "tri_wheel",
) -> Robot:
    """The three-wheeled robot of paper *wheels* (Figs. 3 to 6, Table 1).

    The base frame is the paper's X_CG Y_CG Z_CG: in the middle of the body at the height of the axles, x forward, y
    left, z up. ``half_length`` and ``half_width`` m are the paper's L_x and L_y: the wheels' centres are (eq. (8))

    * "fl", front left, at (L_x, L_y, 0); "fr", front right, at (L_x, -L_y, 0); "r", rear, at (-L_x, 0, 0),

    so that the body is 2 L_x long and 2 L_y wide; its hull is ``thickness`` m thick (the paper does not say; 0: none).
    ``link`` m is the length w of a wheel's legs, ``rubber`` m the height R_ru of its tread, ``mass`` kg of the whole.
    ``friction`` is 1 as in Table 1, also of wheels that a mapping does not name. Joints, frames, contacts and the other
    options are those of :func:`rover`, of which this is one. Raises InputError for a value out of range.
    """
    x = number(half_length, "half_length", above=0.0)
    y = number(half_width, "half_width", above=0.0)
    return rover(
        {"fl": (x, y), "fr": (x, -y), "r": (-x, 0.0)},
        link=link,
        rubber=rubber,
        radius=radius,
        body=(2.0 * x, 2.0 * y),
        thickness=thickness,
        mass=mass,
        com=com,
        wheel_mass=wheel_mass,
        limits=limits,
        rate=rate,
        effort=effort,
        spin_rate=spin_rate,
        spin_effort=spin_effort,
        friction=friction
        if not isinstance(friction, Mapping)
        else {**dict.fromkeys(NAMES, RUBBER_FRICTION), **friction},
        name=name,
    )


def rover(
    wheels: Mapping[str, Sequence[float]],
    *,
    link: float | Mapping[str, float] = LINK,
    rubber: float | Mapping[str, float] = RUBBER,
    radius: float | Mapping[str, float] | None = None,
    body: ArrayLike | None = None,
    thickness: float = THICKNESS,
    mass: float = MASS,
    com: ArrayLike = (0.0, 0.0, 0.0),
    wheel_mass: float = 0.0,
    limits: Any = None,
    rate: float | None = None,
    effort: float | None = None,
    spin_rate: float | None = None,
    spin_effort: float | None = None,
    friction: float | Mapping[str, float] | None = None,
    name: str = "rover",
) -> Robot:
    """A body on wheels of adjustable (paper *wheels*, eqs. (1), (7) to (11)) or fixed radius.

    ``wheels``: name -> (x, y), (x, y, z) or (x, y, z, heading) of its centre in the base frame, m, and the direction in
    which it rolls, rad from x about z. ``radius`` m makes wheels of fixed radius: one number for all of them, or a
    mapping for those that it names. ``link`` (w) and ``rubber`` (R_ru) in m of the others: one number, or a mapping
    that names each.

    A wheel "a" is two chains. Chain "a" is that of the paper, from the body to the point that touches: frames "a.mount"
    and "a.axle" (at the wheel's centre; z is the axle and points left, y is down), and "a.contact", whose row has the
    contact angle and the radius. Chain "a.wheel" hangs on the axle: frame "a.hub" turns with the wheel and carries the
    contact "a.rim", a thin rim of the same radius. Joints:

    * "a.contact", not actuated: the angle phi of the contact point seen from the axle, 0 below it, positive ahead of
      it: u = sin(phi) x - cos(phi) z;
    * "a.adjust" (not with a fixed radius): the angle q of the adjusting motor, R = w cos(q/2) cos(30 deg) + R_ru, in
      ``limits`` (low, high) rad (default and widest 0 to pi) with at most ``rate`` rad/s and ``effort`` N m;
    * "a.spin": the turn of the wheel about its axle; positive rolls it forward; at most ``spin_rate`` rad/s and
      ``spin_effort`` N m.

    Chains, and so joints, come in this order: those of the paper, then those of the hubs. The contact "body" is the
    hull, a box of ``body`` (length, width) m (default: the rectangle around the wheels' centres) and ``thickness`` m
    about the base; 0 leaves it out.

    ``mass`` kg of the whole robot; all of it is at ``com`` (3,) m of the base as in the paper, except ``wheel_mass`` kg
    in each hub, taken for a ring of half the largest radius. Its moment of inertia is that of the hull, a solid box.
    ``friction``: Coulomb coefficient of the rims and the hull, or a mapping for the rims that it names.

    Raises InputError for a value out of range, UnknownNameError for a radius, link, rubber or friction of a wheel that
    is none.
    """
    if not isinstance(wheels, Mapping) or not wheels:
        raise InputError(f"wheels: expected wheel names with their (x, y) or (x, y, z, heading), got {wheels!r}.")
    total = number(mass, "mass", above=0.0)
    each = number(wheel_mass, "wheel_mass", at_least=0.0)
    rest = total - each * len(wheels)
    if rest <= 0.0:
        raise InputError(f"wheel_mass: {len(wheels)} wheels of {each} kg leave nothing of the {total} kg for the body.")
    adjusting = {"limits": _limits(limits), "rate": rate, "effort": effort}
    spinning = {"rate": spin_rate, "effort": spin_effort}
    built = {
        wheel: _Wheel(*_place(place, wheel), _radius(wheel, wheels, link, rubber, radius, adjusting), each)
        for wheel, place in wheels.items()
    }
    length, width = _sides(body, list(built.values()))
    height = number(thickness, "thickness", at_least=0.0)

    rows = {wheel: _contact_rows(wheel, made) for wheel, made in built.items()}
    rows |= {f"{wheel}.wheel": [_hub(wheel, made, spinning)] for wheel, made in built.items()}
    grips = {wheel: _of(wheel, wheels, friction, "friction", every=False) for wheel in built}
    contacts = [_rim(wheel, made, grips[wheel]) for wheel, made in built.items()]
    if height > 0.0:
        half = (0.5 * length, 0.5 * width, 0.5 * height)
        hull = None if isinstance(friction, Mapping) else friction
        contacts.append(Contact("body", "base", "box", half=half, friction=hull))
    x, y, z = finite(com, "com", (3,)).tolist()
    moments = (rest / 12.0 * (a**2 + b**2) for a, b in ((width, height), (length, height), (length, width)))
    xx, yy, zz = moments
    return Robot.from_rows(
        rows,
        parents={f"{wheel}.wheel": f"{wheel}.axle" for wheel in built},
        contacts=contacts,
        base_body=Body(mass=rest, com=(x, y, z), inertia=(xx, yy, zz, 0.0, 0.0, 0.0)),
        name=name,
    )


# --- one wheel ----------------------------------------------------------------------------------------------


def _contact_rows(wheel: str, made: _Wheel) -> list[Row]:
    """Mount, axle, and the row of the contact: eqs. (8) to (11), all axles pointing left."""
    x, y, z = made.place
    # a wheel in the middle plane is reached along x, also backwards
    bearing, way = (math.atan2(y, x), math.hypot(x, y)) if y != 0.0 else (0.0, x)
    angle = Joint(f"{wheel}.contact", offset=QUARTER, scale=-1.0, actuated=False)
    return [
        Row(theta=bearing, d=z, a=way, name=f"{wheel}.mount"),
        Row(theta=made.heading - bearing, epsilon=-QUARTER, name=f"{wheel}.axle"),
        Row(theta=angle, a=made.radius, name=f"{wheel}.contact"),
    ]


def _hub(wheel: str, made: _Wheel, spinning: Mapping[str, Any]) -> Row:
    """The part that turns with the wheel."""
    joint = Joint(f"{wheel}.spin", **spinning)
    if made.mass == 0.0:
        return Row(theta=joint, name=f"{wheel}.hub")
    ring = made.mass * (0.5 * (made.radius.largest if isinstance(made.radius, WheelRadius) else made.radius)) ** 2
    inertia = (0.5 * ring, 0.5 * ring, ring, 0.0, 0.0, 0.0)
    return Row(theta=joint, name=f"{wheel}.hub", body=Body(mass=made.mass, com=(0.0, 0.0, 0.0), inertia=inertia))


def _rim(wheel: str, made: _Wheel, friction: float | None) -> Contact:
    size = {"drive": made.radius} if isinstance(made.radius, WheelRadius) else {"radius": made.radius}
    return Contact(f"{wheel}.rim", f"{wheel}.hub", "rim", friction=friction, **size)


# --- options ------------------------------------------------------------------------------------------------


def _place(place: Any, wheel: str) -> tuple[tuple[float, float, float], float]:
    """(x, y, z) m and heading rad."""
    given = finite(place, f"wheels[{wheel!r}]")
    if given.ndim != 1 or not 2 <= len(given) <= 4:
        raise InputError(f"wheels[{wheel!r}]: expected (x, y), (x, y, z) or (x, y, z, heading), got {place!r}.")
    x, y, z, heading = [*given.tolist(), 0.0, 0.0][:4]
    return (x, y, z), heading


def _radius(
    wheel: str,
    wheels: Mapping[str, Any],
    link: Any,
    rubber: Any,
    radius: Any,
    adjusting: Mapping[str, Any],
) -> WheelRadius | float:
    fixed = _of(wheel, wheels, radius, "radius", every=False)
    if fixed is not None:
        return number(fixed, _field("radius", radius, wheel), above=0.0)
    return WheelRadius(
        Joint(f"{wheel}.adjust", **adjusting),
        number(_of(wheel, wheels, link, "link"), _field("link", link, wheel), above=0.0),
        number(_of(wheel, wheels, rubber, "rubber"), _field("rubber", rubber, wheel), at_least=0.0),
    )


def _of(wheel: str, wheels: Mapping[str, Any], value: Any, field: str, every: bool = True) -> Any:
    """What ``value``, one for all or a mapping, says of a wheel."""
    if not isinstance(value, Mapping):
        return value
    for name in value:
        if name not in wheels:
            raise UnknownNameError("wheel", name, wheels, where=field)
    if wheel not in value and every:
        raise InputError(f"{field}: a mapping must name every wheel, {wheel!r} is missing.")
    return value.get(wheel)


def _field(field: str, value: Any, wheel: str) -> str:
    return f"{field}[{wheel!r}]" if isinstance(value, Mapping) else field


def _limits(limits: Any) -> tuple[float, float]:
    if limits is None:
        return 0.0, math.pi
    low, high = finite(limits, "limits", (2,)).tolist()
    if not 0.0 <= low < high <= math.pi:
        raise InputError(f"limits: expected (low, high) with 0 <= low < high <= pi rad, got {limits!r}.")
    return low, high


def _sides(body: ArrayLike | None, wheels: list[_Wheel]) -> tuple[float, float]:
    """Length and width of the hull, m."""
    if body is not None:
        length, width = finite(body, "body", (2,)).tolist()
        if min(length, width) <= 0.0:
            raise InputError(f"body: expected (length, width) in m, each > 0, got {body!r}.")
        return length, width
    # the smallest centred rectangle that has all wheels in it; a thin one if they are in line
    length, width = (2.0 * max(abs(wheel.place[axis]) for wheel in wheels) for axis in (0, 1))
    least = 0.1 * max(length, width)
    if least == 0.0:
        raise InputError("body: the only wheel is in the middle of the body; give (length, width) in m.")
    return max(length, least), max(width, least)
