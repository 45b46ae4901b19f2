"""Variables of an element written as text: ``"90 deg"``, ``"knee"``, ``"0.5*j3 - 0.1"``, ``"90 deg - hip"``.

One sum of terms separated by ``+`` or ``-`` with spaces around them (a joint name may hold a hyphen). One
term at most names a joint, optionally with a factor: ``j``, ``-j``, ``0.5*j``, ``j*0.5``, ``j/2``. The others
are quantities: a number, with or without a unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from bodyplan.arrays import number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Joint, Variable, WheelRadius
from bodyplan.units import SI_UNITS, to_si

MAX_TEXT = 200
_EXAMPLE = {"angle": "an angle such as '90 deg'", "length": "a length such as '25 mm'"}
_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"([+-]?{_NUMBER})\s*([A-Za-zµ°][A-Za-zµ°0-9/*^ ]{{0,30}})?")
_NAME = r"[^\W\d][\w.:\-]*"
_JOINT = re.compile(
    rf"(?P<minus>-)?\s*(?:(?P<before>{_NUMBER})\s*\*\s*)?(?P<name>{_NAME})"
    rf"(?:\s*(?P<how>[*/])\s*(?P<after>{_NUMBER}))?"
)


def quantity(value: Any, dimension: str, where: str, unit: str | None = None) -> float:
    """A number (in ``unit``, or SI) or a text such as ``"25 mm"`` in SI; InputError names ``where``."""
    if isinstance(value, str):
        found = _QUANTITY.fullmatch(value.strip()) if len(value) <= MAX_TEXT else None
        if not found:
            raise InputError(
                f"{where}: {value[:MAX_TEXT]!r} is not a {dimension}; write a number or a number with a unit."
            )
        if found[2]:
            return to_si(value.strip(), dimension, where)
        value = float(found[1])
    if unit is not None and unit != SI_UNITS[dimension]:
        return to_si(f"{number(value, where)!r} {unit}", dimension, where)
    return to_si(value, dimension, where)


def variable(value: Any, dimension: str, where: str, unit: str | None = None) -> Variable:
    """A constant or a drive: from a number, a text as above, ``{"joint", "offset", "scale"}`` or
    ``{"wheel_radius", "link", "rubber"}`` (the joint's name, m, m).

    ``dimension`` is "angle" or "length"; ``unit`` is that of plain numbers (None: SI).
    """
    if isinstance(value, Mapping):
        return _from_mapping(value, dimension, where)
    if not isinstance(value, str):
        return quantity(value, dimension, where, unit)
    if len(value) > MAX_TEXT:
        raise InputError(f"{where}: text of {len(value)} characters; at most {MAX_TEXT} are allowed.")
    joint: Joint | None = None
    offset = 0.0
    for sign, term in _terms(value):
        if _QUANTITY.fullmatch(term):
            offset += sign * quantity(term, dimension, where, unit)
            continue
        found = _JOINT.fullmatch(term)
        if not found or joint is not None:
            raise InputError(
                f"{where}: {value!r} is neither {_EXAMPLE[dimension]} nor one joint "
                "with a factor and an offset such as '0.5*knee' or 'knee + 0.1' (spaces around + and -)."
            )
        scale = sign * (-1.0 if found["minus"] else 1.0) * float(found["before"] or 1.0)
        if found["after"]:
            after = float(found["after"])
            if found["how"] == "/" and after == 0.0:
                raise InputError(f"{where}: {value!r} divides by 0.")
            scale = scale * after if found["how"] == "*" else scale / after
        with located(where):
            joint = Joint(found["name"], 0.0, scale)
    if joint is None:
        return offset
    return Joint(joint.name, offset, joint.scale)


def _terms(text: str) -> list[tuple[float, str]]:
    pieces = re.split(r"\s+([+-])\s+", text.strip())
    signs = [1.0, *(1.0 if p == "+" else -1.0 for p in pieces[1::2])]
    return list(zip(signs, (p.strip() for p in pieces[::2]), strict=True))


def _from_mapping(value: Mapping[str, Any], dimension: str, where: str) -> Variable:
    valid = ("wheel_radius", "link", "rubber") if "wheel_radius" in value else ("joint", "offset", "scale")
    for key in value:
        if key not in valid:
            raise UnknownNameError("field", key, valid, where=where)
    if valid[0] not in value or (valid[0] == "wheel_radius" and "link" not in value):
        raise InputError(
            f"{where}: a drive needs joint = name, or wheel_radius = name and link = length, got {value!r}."
        )
    if valid[0] == "wheel_radius":
        link = quantity(value["link"], "length", f"{where}.link")
        rubber = quantity(value.get("rubber", 0.0), "length", f"{where}.rubber")
        with located(where):
            return WheelRadius(Joint(value["wheel_radius"]), link, rubber)
    offset = quantity(value.get("offset", 0.0), dimension, f"{where}.offset")
    scale = number(value.get("scale", 1.0), f"{where}.scale")
    with located(where):
        return Joint(value["joint"], offset, scale)


@contextmanager
def located(where: str) -> Iterator[None]:
    """Put ``where`` before the message of an InputError that leaves the block."""
    try:
        yield
    except InputError as error:
        error.args = (f"{where}: {error}",)
        raise
