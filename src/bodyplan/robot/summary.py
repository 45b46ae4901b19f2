"""A robot as tables to read: chains, rows, joints, contacts, in degrees and millimetres."""

from __future__ import annotations

import math
from collections.abc import Callable

from bodyplan.robot.elements import Arc, Element, Joint, Variable, WheelRadius
from bodyplan.robot.model import Robot

Table = tuple[str, list[str], list[list[str]]]


def summary(robot: Robot) -> tuple[str, list[Table]]:
    """One line about the robot, and tables (title, header, rows of texts). A variable is written as in a CSV table:
    "90 deg", "fl.knee + 90 deg", "0.5*knee"."""
    m, n = len(robot.chains), robot.n
    passive = n - int(robot.actuated.sum())
    head = (
        f"{robot.name}: {_count(m, 'chain')}, {_count(len(robot.frames), 'frame')}, {_count(n, 'joint')}"
        f"{f' ({passive} passive)' if passive else ''}, {_count(len(robot.contacts), 'contact')}, {robot.mass:.4g} kg; "
        f"P ({6 * m}, 6), Q ({6 * m}, {n})"
    )
    chains = [
        [chain.name, chain.parent, robot.frames[end], str(len(chain.elements))]
        for chain, end in zip(robot.chains, robot.ends, strict=True)
    ]
    tables: list[Table] = [
        ("Chains", ["chain", "from", "to", "rows"], chains),
        ("Rows", ["chain", "from", "to", "theta", "d", "a", "epsilon", "mass"], _rows(robot)),
        ("Joints", ["q", "joint", "from", "to", "rate", "effort", "drive"], _joints(robot)),
    ]
    if robot.contacts:
        tables.append(("Contacts", ["contact", "frame", "shape", "radius"], _contacts(robot)))
    return head, tables


def variable_text(variable: Variable, angle: bool) -> str:
    """A constant or driven variable as it would be written in a table."""
    if isinstance(variable, WheelRadius):
        return f"{_size(variable.link)}*cos(30 deg)*cos({variable.joint.name}/2) + {_size(variable.rubber)}"
    measure = _angle if angle else _size
    if not isinstance(variable, Joint):
        return measure(variable)
    scale = variable.scale
    driven = {1.0: variable.name, -1.0: f"-{variable.name}"}.get(scale, f"{scale:.6g}*{variable.name}")
    if variable.offset == 0.0:
        return driven
    return f"{driven} {'-' if variable.offset < 0 else '+'} {measure(abs(variable.offset))}"


def _rows(robot: Robot) -> list[list[str]]:
    out = []
    for chain in robot.chains:
        before = chain.parent
        for i, element in enumerate(chain.elements):
            mass = "" if element.body is None else f"{element.body.mass:.4g} kg"
            out.append([chain.name, before, chain.frame_name(i), *_cells(element), mass])
            before = chain.frame_name(i)
    return out


def _cells(element: Element) -> list[str]:
    if isinstance(element, Arc):
        pitch, yaw = (variable_text(v, True) for v in (element.pitch, element.yaw))
        return [f"pitch {pitch}", f"yaw {yaw}", f"arc of {_size(element.length)}", ""]
    return [variable_text(getattr(element, field), field in element.ANGLES) for field in element.VARIABLES]


def _joints(robot: Robot) -> list[list[str]]:
    out = []
    for i, (joint, kind) in enumerate(zip(robot.joint_info, robot.kinds, strict=True)):
        turns = kind == "angle"
        measure = _angle if turns else _size
        low, high = ("", "") if joint.limits is None else (_bound(limit, measure) for limit in joint.limits)
        rate = "" if joint.rate is None else f"{measure(joint.rate)}/s"
        effort = "" if joint.effort is None else f"{joint.effort:.4g} {'N m' if turns else 'N'}"
        out.append([str(i), joint.name, low, high, rate, effort, "" if joint.actuated else "passive"])
    return out


def _contacts(robot: Robot) -> list[list[str]]:
    return [[c.name, c.frame, c.shape, _size(c.radius) if c.radius else ""] for c in robot.contacts]


def _bound(limit: float, measure: Callable[[float], str]) -> str:
    return measure(limit) if math.isfinite(limit) else ""


def _angle(value: float) -> str:
    return "0" if value == 0.0 else f"{math.degrees(value):.6g} deg"


def _size(value: float) -> str:
    return "0" if value == 0.0 else f"{1e3 * value:.6g} mm"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
