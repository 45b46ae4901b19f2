"""A robot as plain data (JSON types) and back, exactly."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

from bodyplan.arrays import number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.assemble import declare
from bodyplan.robot.drive_text import located, quantity, variable
from bodyplan.robot.elements import Arc, Body, Chain, Contact, Element, Joint, Row, WheelRadius, joint_kinds

Parts = tuple[str, tuple[Chain, ...], tuple[Contact, ...], Body | None]

# dimension of the numbers in a body or a contact; the others are taken in SI as they are
_DIMENSIONS = {"mass": "mass", "friction": "none"} | dict.fromkeys(("com", "start", "end", "half", "radius"), "length")
RATES = {"angle": "angular_rate", "length": "speed"}
EFFORTS = {"angle": "torque", "length": "force"}


def robot_to_dict(
    name: str,
    chains: Sequence[Chain],
    joints: Sequence[Joint],
    contacts: Sequence[Contact],
    base_body: Body | None,
) -> dict[str, Any]:
    """Plain data of a robot: ``name``, ``joints``, ``chains`` with ``elements``, ``contacts``, ``base_body``.
    What is None is left out; an infinite limit is the text "inf" or "-inf"."""
    out: dict[str, Any] = {
        "name": name,
        "joints": [_plain(joint, skip=("offset", "scale")) for joint in joints],
        "chains": [
            {
                "name": chain.name,
                "parent": chain.parent,
                "elements": [_element_data(e) for e in chain.elements],
            }
            for chain in chains
        ],
        "contacts": [_plain(contact) for contact in contacts],
    }
    if base_body is not None:
        out["base_body"] = _plain(base_body)
    return out


def robot_from_dict(data: Any) -> Parts:
    """Arguments of Robot from plain data: that of :func:`robot_to_dict`, or written by hand with quantities
    and drives as text (:mod:`bodyplan.robot.drive_text`) and what is at its default left out.

    Raises InputError naming the entry, such as ``chains[2].elements[0].theta``, that is wrong.
    """
    known = _table(data, "robot", ("name", "joints", "chains", "contacts", "base_body"))
    chains = tuple(_chain(item, f"chains[{i}]") for i, item in enumerate(_items(known.get("chains"), "chains")))
    if "joints" in known:
        kinds = joint_kinds(chains)
        items = _items(known["joints"], "joints")
        chains = declare(chains, [_joint(item, f"joints[{i}]", kinds) for i, item in enumerate(items)])
    contacts = tuple(
        _made(Contact, item, f"contacts[{i}]") for i, item in enumerate(_items(known.get("contacts", []), "contacts"))
    )
    base = known.get("base_body")
    return (
        known.get("name", "robot"),
        chains,
        contacts,
        None if base is None else _made(Body, base, "base_body"),
    )


# --- writing ------------------------------------------------------------------------------------------------


def _plain(item: Joint | Body | Contact, skip: tuple[str, ...] = ()) -> dict[str, Any]:
    values = {field.name: getattr(item, field.name) for field in fields(item) if field.name not in skip}
    return {field: _value(value) for field, value in values.items() if value is not None}


def _value(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_value(v) for v in value]
    if isinstance(value, (bool, str)):
        return value
    if isinstance(value, WheelRadius):
        return {"wheel_radius": value.joint.name, "link": float(value.link), "rubber": float(value.rubber)}
    return float(value) if math.isfinite(value) else str(float(value))


def _element_data(element: Element) -> dict[str, Any]:
    out: dict[str, Any] = {"kind": type(element).__name__.lower()}
    if isinstance(element, Arc):
        out["length"] = float(element.length)
    for field in element.VARIABLES:
        value = getattr(element, field)
        if isinstance(value, WheelRadius):
            out[field] = _value(value)
        elif isinstance(value, Joint):
            out[field] = {"joint": value.name, "offset": float(value.offset), "scale": float(value.scale)}
        else:
            out[field] = value
    if element.name is not None:
        out["name"] = element.name
    if element.body is not None:
        out["body"] = _plain(element.body)
    return out


# --- reading ------------------------------------------------------------------------------------------------


def _chain(data: Any, where: str) -> Chain:
    known = _table(data, where, ("name", "parent", "elements"))
    items = _items(known.get("elements"), f"{where}.elements")
    elements = tuple(_element(item, f"{where}.elements[{i}]") for i, item in enumerate(items))
    return Chain(known.get("name"), elements, known.get("parent", "base"))  # type: ignore[arg-type]


def _element(data: Any, where: str) -> Element:
    kind = data.get("kind", "row") if isinstance(data, Mapping) else "row"
    if kind not in ("row", "arc"):
        raise UnknownNameError("kind", kind, ("row", "arc"), where=where)
    make = Arc if kind == "arc" else Row
    extra = ("length",) if kind == "arc" else ()
    known = dict(_table(data, where, ("kind", *extra, *make.VARIABLES, "name", "body")))
    known.pop("kind", None)
    for field in make.VARIABLES:
        if field in known:
            dimension = "angle" if field in make.ANGLES else "length"
            known[field] = variable(known[field], dimension, f"{where}.{field}")
    if kind == "arc":
        if "length" not in known:
            raise InputError(f"{where}: an arc needs its length.")
        known["length"] = quantity(known["length"], "length", f"{where}.length")
    if known.get("body") is not None:
        known["body"] = _made(Body, known["body"], f"{where}.body")
    element: Element = _build(make, known, where)
    return element


def _joint(data: Any, where: str, kinds: Mapping[str, str]) -> Joint | str:
    if isinstance(data, str):
        return data
    known = dict(_table(data, where, ("name", "limits", "rate", "effort", "actuated")))
    kind = kinds.get(known.get("name", ""), "angle")
    if "limits" in known:
        known["limits"] = tuple(_limit(v, kind, f"{where}.limits") for v in _items(known["limits"], f"{where}.limits"))
    for field, dimension in (("rate", RATES[kind]), ("effort", EFFORTS[kind])):
        if field in known:
            known[field] = quantity(known[field], dimension, f"{where}.{field}")
    if not isinstance(known.get("actuated", True), bool):
        raise InputError(f"{where}.actuated: must be true or false, got {known['actuated']!r}.")
    joint: Joint = _build(Joint, known, where)
    return joint


def _limit(value: Any, kind: str, where: str) -> float:
    return float(value) if value in ("inf", "-inf", math.inf, -math.inf) else quantity(value, kind, where)


def _made(make: type[Any], data: Any, where: str) -> Any:
    known = dict(_table(data, where, tuple(field.name for field in fields(make))))
    for field, value in known.items():
        at = f"{where}.{field}"
        if field == "drive":
            known[field] = variable(value, "length", at)
        elif isinstance(value, (list, tuple)):
            known[field] = tuple(
                quantity(v, _DIMENSIONS[field], at) if field in _DIMENSIONS else number(v, at) for v in value
            )
        elif field in _DIMENSIONS:
            known[field] = quantity(value, _DIMENSIONS[field], at)
    return _build(make, known, where)


def _build(make: type[Any], known: Mapping[str, Any], where: str) -> Any:
    try:
        with located(where):
            return make(**known)
    except TypeError as error:
        missing = [field.name for field in fields(make) if field.name not in known and field.default is MISSING]
        raise InputError(f"{where}: {make.__name__} needs {', '.join(missing) or 'other fields'}.") from error


def _table(data: Any, where: str, valid: tuple[str, ...]) -> Mapping[str, Any]:
    if not isinstance(data, Mapping):
        raise InputError(f"{where}: expected a table of fields, got {data!r}.")
    for key in data:
        if key not in valid:
            raise UnknownNameError("field", key, valid, where=where)
    return data


def _items(data: Any, where: str) -> Sequence[Any]:
    if not isinstance(data, (list, tuple)):
        raise InputError(f"{where}: expected a list, got {data!r}.")
    return data
