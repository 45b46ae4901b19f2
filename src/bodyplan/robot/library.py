"""Ready robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import finite, number, whole
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Arc, Body, Contact, Element, Joint, Row
from bodyplan.robot.model import Robot

DENSITY = 1000.0  # kg/m^3, water: what a link weighs when nobody says
AXES = ("yaw", "pitch", "alternating", "universal")
MAX_LINKS = 10_000


def snake(
    links: int,
    link_length: float | Sequence[float],
    joint: str = "straight",
    *,
    axes: str = "yaw",
    radius: float | None = None,
    mass: float | None = None,
    limits: Any = None,
    rate: float | None = None,
    effort: float | None = None,
    friction: float | None = None,
    name: str | None = None,
) -> Robot:
    """A snake of ``links`` links, frames "link1" (tail) to "linkN" (head) at the front end of each link.

    The base is the rear end of link 1, x along it, z up; every link frame has x along its link and is upright
    at zero angles. ``link_length`` in m: one number, or one a link.

    ``joint="straight"``: rigid links; joint i turns between links i and i + 1, so N - 1 bends. ``"arc"``:
    every link is itself a bending segment of constant curvature (paper *acm*), joint i bends link i, N bends.

    ``axes``: "yaw" (about z; joints "yaw1", ...), "pitch" (right-handed about y, nose down; "pitch1", ...),
    "alternating" (odd joints yaw, even ones pitch: "yaw1", "pitch2", ...; paper *acm*), "universal" (at every
    joint yaw, then pitch: "yaw1", "pitch1", ...).

    ``radius`` m of the round body (default 0.3 of the mean link length). ``mass`` kg of one link (default:
    the volume of its capsule at 1000 kg/m^3), at the middle of the link. ``limits`` (low, high) rad, ``rate``
    rad/s and ``effort`` N m for every joint. ``friction``: Coulomb coefficient of the belly.

    Contacts, one a link and named like it: a straight link is a capsule over its whole length. A bending link
    is a sphere at its front end: that point is on the body's centre line at every bend.

    Raises InputError for a value out of range, UnknownNameError for an unknown joint or axes.
    """
    count = whole(links, "links", at_least=1, at_most=MAX_LINKS)
    if joint not in ("straight", "arc"):
        raise UnknownNameError("joint", joint, ("straight", "arc"), where="snake")
    if axes not in AXES:
        raise UnknownNameError("axes", axes, AXES, where="snake")
    lengths = _lengths(link_length, count)
    thick = number(0.3 * float(lengths.mean()) if radius is None else radius, "radius", above=0.0)
    info = {"limits": limits, "rate": rate, "effort": effort}

    elements: list[Element] = []
    contacts: list[Contact] = []
    for i, length in enumerate(lengths.tolist(), start=1):
        weight = DENSITY * np.pi * thick**2 * (length + 4.0 / 3.0 * thick) if mass is None else mass
        body = Body(mass=float(weight), com=(-0.5 * length, 0.0, 0.0))
        frame = f"link{i}"
        if joint == "arc":
            elements.append(Arc(length, **_bends(i, axes, info), name=frame, body=body))
            contacts.append(Contact(frame, frame, "sphere", thick, friction=friction))
            continue
        elements.extend(_straight(i - 1, length, axes, info, frame, body))
        contacts.append(Contact(frame, frame, "capsule", thick, start=(-length, 0.0, 0.0), friction=friction))
    return Robot.from_rows({"body": elements}, contacts=contacts, name="snake" if name is None else name)


def _bends(i: int, axes: str, info: dict[str, Any]) -> dict[str, Joint]:
    """The joints at place ``i`` by the axis they turn about."""
    yaw = axes in ("yaw", "universal") or (axes == "alternating" and i % 2 == 1)
    pitch = axes in ("pitch", "universal") or (axes == "alternating" and i % 2 == 0)
    joints = {"yaw": yaw, "pitch": pitch}
    return {axis: Joint(f"{axis}{i}", **info) for axis, there in joints.items() if there}


def _straight(i: int, length: float, axes: str, info: dict[str, Any], frame: str, body: Body) -> list[Element]:
    """Rows of the link behind joint ``i`` (0: the first link, which has none)."""
    bends = _bends(i, axes, info) if i else {}
    quarter = 0.5 * np.pi
    if "pitch" not in bends:
        return [Row(theta=bends.get("yaw", 0.0), a=length, name=frame, body=body)]
    # Rx(-90 deg) lays the turning axis z along +y, Rx(+90 deg) sets the link upright again
    return [
        Row(theta=bends.get("yaw", 0.0), epsilon=-quarter, name=f"pre{i}"),
        Row(theta=bends["pitch"], a=length, epsilon=quarter, name=frame, body=body),
    ]


def _lengths(link_length: ArrayLike, count: int) -> Any:
    lengths = finite(link_length, "link_length")
    if lengths.ndim == 0:
        lengths = np.full(count, float(lengths))
    if lengths.shape != (count,):
        raise InputError(f"link_length: expected one number or {count}, one a link, got shape {lengths.shape}.")
    if np.any(lengths <= 0.0):
        raise InputError(f"link_length: must be > 0, got {float(lengths.min())}.")
    return lengths
