"""Ready robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import finite, number, whole
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.model import Robot
from bodyplan.robot.snakes import AXES, END_LINK, FIRST, Feet, Parts, Units, arcs, doubles, straight

DENSITY = 1000.0  # kg/m^3, water: what a link weighs when nobody says
DEGREE = np.pi / 180.0
JOINTS = ("straight", "arc", "double")
MAX_LINKS = 10_000


def snake(
    links: int,
    link_length: float | Sequence[float],
    joint: str = "straight",
    *,
    axes: str = "yaw",
    first: str = "yaw",
    end_link: float | None = None,
    radius: float | None = None,
    foot_radius: float | None = None,
    foot_spread: float = 0.0,
    mass: float | None = None,
    limits: Any = None,
    rate: float | None = None,
    effort: float | None = None,
    friction: float | None = None,
    name: str | None = None,
) -> Robot:
    """A snake of ``links`` units, frames "link1" (tail) to "linkN" (head) at the front end of each unit.

    The base is the rear end of unit 1, x along it, z up; every frame "link1", ... has x along its unit and is
    upright at zero angles. ``link_length`` in m of a unit: one number, or one a unit.

    ``joint`` (paper *acm*):

    * "straight": units are rigid links; joint i turns between links i and i + 1, so N - 1 bends.
    * "arc": every unit is itself a bending segment of constant curvature, joint i bends unit i, N bends.
    * "double": every unit is a double joint (Fig. 9), joint i bends unit i, N bends: an end link, half of the
      angles, a middle link, the other half, an end link. ``end_link`` is R_s of eqs. (23), (24), the length of an
      end link over that of the unit, in (0, 0.5) (default 0.18, the paper's; printed there as "1.6 ~ 1.8" for 0.16
      to 0.18). Seen from the tail the order is yaw, pitch, pitch, yaw, so that unit i turns by Rz(yaw) half way,
      Ry(pitch) and Rz(yaw) half way again; the joint coordinate is the whole angle.

    ``axes``: "yaw" (about z; joints "yaw1", ...), "pitch" (right-handed about y, nose down; "pitch1", ...),
    "alternating" (odd joints yaw, even ones pitch: "yaw1", "pitch2", ...; with ``first`` "pitch" the other way round:
    "pitch1", "yaw2", ...), "universal" (at every joint both: "yaw1", "pitch1", ...; a straight joint turns by yaw,
    then by pitch).

    ``radius`` m of the round body (default 0.3 of the mean unit length). ``mass`` kg of one unit (default: the
    volume of its capsule at 1000 kg/m^3), spread evenly along it. ``limits`` (low, high) rad, ``rate`` rad/s and
    ``effort`` N m for every joint. ``friction``: Coulomb coefficient of the belly.

    Contacts, named like their frame: a straight link is a capsule over its whole length. Arcs touch where they meet,
    on the centre line at every bend: a capsule reaches from there an eighth of a unit each way along the tangent
    ("tail" on the base, "link1", ...); half of a unit's mass is at each of its ends. Of double joints every rigid
    part is a capsule
    over its whole length: "tail" (the first end link, on the base), "middle1" (the middle link of unit 1, whose
    frame is at its front end and may lie on its side), "link1" (the front end link of unit 1 and the rear one of
    unit 2, one part), ..., "linkN" (the last end link).

    ``foot_radius`` m gives a snake of straight joints feet: balls on the axis of every joint that pitches, "foot2" for
    joint 2, or "foot2.left" and "foot2.right" at ``foot_spread`` m to either side of it. They belong to the link behind
    the joint and weigh nothing. The body must then be no thicker than its feet, or the ground would carry it elsewhere:
    ``radius`` is half of ``foot_radius`` by default.

    Raises InputError for a value out of range and for options that do not go together (``end_link`` without double
    joints, ``first`` without alternating axes, feet without straight joints that pitch), UnknownNameError for an
    unknown joint or axes.
    """
    count = whole(links, "links", at_least=1, at_most=MAX_LINKS)
    if joint not in JOINTS:
        raise UnknownNameError("joint", joint, JOINTS, where="snake")
    if axes not in AXES:
        raise UnknownNameError("axes", axes, AXES, where="snake")
    if end_link is not None and joint != "double":
        raise InputError(f'end_link: only joint="double" has end links, joint is {joint!r}; got {end_link!r}.')
    share = number(END_LINK if end_link is None else end_link, "end_link", above=0.0, below=0.5)
    if first not in FIRST:
        raise UnknownNameError("first", first, FIRST, where="snake")
    if first != "yaw" and axes != "alternating":
        raise InputError(f'first: only axes="alternating" has a first axis, axes is {axes!r}; got {first!r}.')
    lengths = _lengths(link_length, count)
    feet = _feet(foot_radius, foot_spread, joint)
    usual = 0.3 * float(lengths.mean()) if feet is None else 0.5 * feet.radius
    thick = number(usual if radius is None else radius, "radius", above=0.0)
    if feet is not None and thick > feet.radius:
        raise InputError(
            f"radius: must be <= foot_radius = {feet.radius}, or the body would lie on the ground; got {thick}."
        )
    info = {"limits": limits, "rate": rate, "effort": effort}

    weights = DENSITY * np.pi * thick**2 * (lengths + 4.0 / 3.0 * thick)
    if mass is not None:
        weights = np.full(count, number(mass, "mass", above=0.0))
    units = Units(lengths, weights, thick, axes, info, friction, first, feet)
    if feet is not None and not any("pitch" in units.bends(i) for i in range(1, count)):
        raise InputError(f"foot_radius: feet are on joints that pitch; {count} links with {axes!r} axes have none.")
    parts = straight(units) if joint == "straight" else arcs(units) if joint == "arc" else doubles(units, share)
    return _robot(parts, "snake" if name is None else name)


def acm_l2(
    joints: int = 9,
    *,
    limits: Any = (-75.0 * DEGREE, 75.0 * DEGREE),
    rate: float | None = None,
    effort: float | None = 0.5,
    friction: float | None = None,
    name: str = "acm_l2",
) -> Robot:
    """ACM-L2 (paper *acm*, Table I and section V): a snake of nine two-axis double joints of 78 mm, R_s = 0.18.

    18 joint coordinates "yaw1", "pitch1", ..., each within +-75 deg and with 0.5 N m at most; a round body of 50 mm
    across. The printed length of 800 mm is 98 mm more than nine joints: a head and a tail that do not bend, here
    49 mm each. They are the ends of the contacts "link9" and "tail" and no joint's concern; the base is still the
    rear end of unit 1. They matter: a sinus-lifting body of 702 mm stands on two places at a time and swings about
    them. The 0.99 kg are spread evenly along the 800 mm.

    ``joints``: number of units, for longer and shorter robots of the same make. ``limits``, ``rate``, ``effort`` and
    ``friction`` as in :func:`snake`. Raises InputError for a value out of range.
    """
    count = whole(joints, "joints", at_least=1, at_most=MAX_LINKS)
    unit, tips, kg_per_m = 0.078, 0.049, 0.99 / 0.8
    units = Units(
        lengths=np.full(count, unit),
        masses=np.full(count, kg_per_m * unit),
        radius=0.025,
        axes="universal",
        info={"limits": limits, "rate": rate, "effort": effort},
        friction=friction,
    )
    return _robot(doubles(units, END_LINK, tips), name)


def _robot(parts: Parts, name: str) -> Robot:
    return Robot.from_rows({"body": parts.elements}, contacts=parts.contacts, base_body=parts.base_body, name=name)


def _feet(radius: float | None, spread: float, joint: str) -> Feet | None:
    wide = number(spread, "foot_spread", at_least=0.0)
    if radius is None:
        if wide > 0.0:
            raise InputError(f"foot_spread: a snake without foot_radius has no feet; got {spread!r}.")
        return None
    if joint != "straight":
        raise InputError(f'foot_radius: only joint="straight" has feet, joint is {joint!r}; got {radius!r}.')
    return Feet(number(radius, "foot_radius", above=0.0), wide)


def _lengths(link_length: ArrayLike, count: int) -> Any:
    lengths = finite(link_length, "link_length")
    if lengths.ndim == 0:
        lengths = np.full(count, float(lengths))
    if lengths.shape != (count,):
        raise InputError(f"link_length: expected one number or {count}, one a link, got shape {lengths.shape}.")
    if np.any(lengths <= 0.0):
        raise InputError(f"link_length: must be > 0, got {float(lengths.min())}.")
    return lengths
