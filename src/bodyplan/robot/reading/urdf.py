"""URDF, read: https://wiki.ros.org/urdf/XML. Meshes, visuals, transmissions and simulator tags are ignored."""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.drive_text import located
from bodyplan.robot.elements import Body, Contact, Joint
from bodyplan.robot.files import read_text
from bodyplan.robot.reading.pruning import pruned
from bodyplan.robot.reading.rows import Screw, along, axis_frame
from bodyplan.robot.reading.shapes import Shape, rounded
from bodyplan.robot.reading.tree import Link, Parts, Tree, parts_of, unique

MOVING = ("revolute", "continuous", "prismatic")
#: numbers from which on a limit is none: URDF has no word for infinity
BOUNDLESS = 1e30


def read_urdf(
    path: str | os.PathLike[str],
    mimic: bool = True,
    ends: Sequence[str] | None = None,
    contacts: Sequence[Contact] | None = None,
) -> Parts:
    """Arguments of Robot from a URDF file (:meth:`bodyplan.robot.model.Robot.from_urdf`). InputError names the file and
    the link or joint."""
    text = read_text(path)
    with located(str(path)):
        if "<!ENTITY" in text:
            raise InputError("defines entities; a robot needs none.")
        try:
            root = ET.fromstring(text)
        except (ET.ParseError, ValueError) as error:
            raise InputError(f"is not XML: {error}.") from error
        tree = _tree(root, Path(path).stem, mimic)
        return parts_of(tree if ends is None else pruned(tree, ends), contacts)


def _tree(root: ET.Element, stem: str, mimic: bool) -> Tree:
    if root.tag != "robot":
        raise InputError(f"is not URDF: the first element is <{root.tag}>, not <robot>.")
    if any("xacro" in element.tag for element in root.iter()):
        raise InputError("has xacro macros; expand them first, as in: xacro robot.urdf.xacro > robot.urdf.")
    links = _named(root, "link")
    joints = _named(root, "joint")
    parents: dict[str, ET.Element] = {}
    for name, joint in joints.items():
        ends = {end: _link_of(joint, end, name, links) for end in ("parent", "child")}
        if ends["child"] in parents:
            one, two = parents[ends["child"]].get("name"), name
            raise InputError(
                f"link {ends['child']!r}: is the child of joints {one!r} and {two!r}; a link can hang on one only, "
                "and closed loops are not supported."
            )
        parents[ends["child"]] = joint
    roots = [name for name in links if name not in parents]
    if not links:
        raise InputError("has no links.")
    if not roots:
        raise InputError("has no root: every link hangs on another, in a closed loop.")
    if len(roots) > 1:
        raise InputError(f"has {len(roots)} roots, links that hang on no other: {', '.join(map(repr, roots[:10]))}.")
    base = _base(roots[0], links, joints)
    drives = _drives(joints, mimic)
    shapes = _shapes(links)
    made = [
        Link(name, parent, *_moves(parents[name], drives), body=_body(links[name]), shapes=shapes[name])
        for name, parent in _order(roots[0], base, links, joints)
    ]
    return Tree(root.get("name", "").strip() or stem, tuple(made), base, _body(links[base]), shapes[base])


# --- the tree -----------------------------------------------------------------------------------------------


def _named(root: ET.Element, tag: str) -> dict[str, ET.Element]:
    found: dict[str, ET.Element] = {}
    for element in root.iterfind(tag):
        name = element.get("name")
        if not name:
            raise InputError(f"a <{tag}> has no name.")
        if name in found:
            raise InputError(f"two {tag}s are named {name!r}.")
        found[name] = element
    return found


def _link_of(joint: ET.Element, end: str, name: str, links: Mapping[str, ET.Element]) -> str:
    link = _end(joint, end)
    if not link:
        raise InputError(f"joint {name!r}: names no {end} link.")
    if link not in links:
        raise UnknownNameError("link", link, links, where=f"joint {name!r}, {end}")
    return link


def _base(root: str, links: Mapping[str, ET.Element], joints: Mapping[str, ET.Element]) -> str:
    """The link that is the base: the root, or what floats on a root that is nothing but a name for the world. Raises
    InputError for joints of kinds that no robot here has."""
    base = root
    below = [name for name, joint in joints.items() if _end(joint, "parent") == root]
    for name, joint in joints.items():
        kind = joint.get("type", "")
        if kind in ("fixed", *MOVING):
            continue
        if kind == "floating" and below == [name] and len(links[root]) == 0:
            base = _end(joint, "child")
        elif kind in ("floating", "planar"):
            raise InputError(
                f"joint {name!r}: is {kind}; inside a robot only fixed, {', '.join(MOVING)} joints are supported "
                "(the base floats by itself)."
            )
        else:
            raise UnknownNameError("type", kind, ("fixed", *MOVING), where=f"joint {name!r}")
    return base


def _order(
    root: str, base: str, links: Mapping[str, ET.Element], joints: Mapping[str, ET.Element]
) -> Iterator[tuple[str, str]]:
    """(link, parent) of all links but the base, parents first, children as in the file."""
    children: dict[str, list[str]] = {}
    for joint in joints.values():
        children.setdefault(_end(joint, "parent"), []).append(_end(joint, "child"))
    waiting, reached = [base], {root, base}
    while waiting:
        parent = waiting.pop()
        below = children.get(parent, [])
        reached.update(below)
        yield from ((child, parent) for child in below)
        waiting += reversed(below)
    loop = [name for name in links if name not in reached]
    if loop:
        raise InputError(f"links {', '.join(map(repr, loop[:10]))}: hang on each other in a closed loop.")


def _end(joint: ET.Element, end: str) -> str:
    """The parent or child link of a joint that is known to have one."""
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


# --- joints -------------------------------------------------------------------------------------------------


def _drives(joints: Mapping[str, ET.Element], mimic: bool) -> dict[str, Joint | float]:
    """What moves every moving joint: a joint, itself or the one that it mimics; or a constant."""
    moving = {name: joint for name, joint in joints.items() if joint.get("type") in MOVING}
    names = dict(zip(moving, unique(name.replace("/", ".") for name in moving), strict=True))
    if not mimic:
        return {name: Joint(names[name], **_limits(joint, name)) for name, joint in moving.items()}
    return {name: _drive(name, moving, names, ()) for name in moving}


def _drive(
    name: str, moving: Mapping[str, ET.Element], names: Mapping[str, str], seen: tuple[str, ...]
) -> Joint | float:
    element = moving[name]
    mimic = element.find("mimic")
    if mimic is None:
        return Joint(names[name], **_limits(element, name))
    where = f"joint {name!r}, mimic"
    leader = mimic.get("joint", "")
    if leader not in moving:
        raise UnknownNameError("moving joint", leader, moving, where=where)
    if leader == name or leader in seen:
        raise InputError(f"{where}: joints {', '.join(map(repr, (*seen, name)))} mimic each other.")
    factor = _number(mimic, "multiplier", where, 1.0)
    offset = _number(mimic, "offset", where, 0.0)
    drive = _drive(leader, moving, names, (*seen, name))
    slides = [moving[joint].get("type") == "prismatic" for joint in (name, leader)]
    if slides[0] != slides[1]:
        raise InputError(f"{where}: one of {name!r} and {leader!r} turns and the other one slides.")
    if not isinstance(drive, Joint):
        return offset + factor * drive
    if factor == 0.0:
        return offset
    return replace(drive, offset=offset + factor * drive.offset, scale=factor * drive.scale)


def _limits(joint: ET.Element, name: str) -> dict[str, Any]:
    limit = joint.find("limit")
    if limit is None:
        return {}
    where = f"joint {name!r}, limit"
    rate, effort = (_number(limit, field, where, 0.0) for field in ("velocity", "effort"))
    out: dict[str, Any] = {}
    # 0 stands for "not known" where it is not simply wrong
    for field, value in (("rate", rate), ("effort", effort)):
        if 0.0 < value < BOUNDLESS:
            out[field] = value
    if joint.get("type") != "continuous":
        low, high = (_number(limit, field, where, 0.0) for field in ("lower", "upper"))
        if low > high:
            raise InputError(f"{where}: lower {low!r} is above upper {high!r}.")
        low, high = (math.copysign(math.inf, v) if abs(v) >= BOUNDLESS else v for v in (low, high))
        if low < high and (low, high) != (-math.inf, math.inf):
            out["limits"] = (low, high)
    return out


def _moves(joint: ET.Element, drives: Mapping[str, Joint | float]) -> tuple[tuple[Screw, ...], Array]:
    """Screws and the fixed transform after them that a URDF joint is."""
    name = joint.get("name", "")
    place = _origin(joint, f"joint {name!r}")
    if name not in drives:
        return (), place
    drive, turns = drives[name], joint.get("type") != "prismatic"
    element = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if element is None else _vector(element, "xyz", f"joint {name!r}, axis", (1, 0, 0))
    size = float(np.linalg.norm(axis))
    if size == 0.0:
        raise InputError(f"joint {name!r}, axis: must not be zero.")
    turned, sign = axis_frame(axis / size)
    frame = np.eye(4)
    frame[:3, :3] = turned
    if isinstance(drive, Joint):
        signed = replace(drive, offset=sign * drive.offset, scale=sign * drive.scale)
        return (Screw(place @ frame, signed, turns),), frame.T
    return (), place @ frame @ along(sign * drive, turns) @ frame.T


# --- what links carry ---------------------------------------------------------------------------------------


def _body(link: ET.Element) -> Body | None:
    inertial = link.find("inertial")
    if inertial is None:
        return None
    where = f"link {link.get('name')!r}, inertial"
    mass_of, inertia_of = inertial.find("mass"), inertial.find("inertia")
    mass = 0.0 if mass_of is None else _number(mass_of, "value", where, None)
    if mass < 0.0:
        raise InputError(f"{where}: mass must be at least 0, got {mass!r}.")
    if mass == 0.0:
        return None
    place = _origin(inertial, where)
    com = (place[0, 3], place[1, 3], place[2, 3])
    if inertia_of is None:
        return Body(mass=mass, com=com)
    xx, yy, zz, xy, xz, yz = (
        _number(inertia_of, field, f"{where}, inertia", 0.0) for field in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    moment = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not moment.any():
        return Body(mass=mass, com=com)
    R = place[:3, :3]
    moment = R @ moment @ R.T
    inertia = (*np.diag(moment).tolist(), float(moment[0, 1]), float(moment[0, 2]), float(moment[1, 2]))
    return Body(mass=mass, com=com, inertia=inertia)


def _shapes(links: Mapping[str, ET.Element]) -> dict[str, tuple[Shape, ...]]:
    """Collision shapes of every link, primitive ones only."""
    found: list[tuple[str, str, str, tuple[float, ...], Array]] = []
    for link, element in links.items():
        for i, collision in enumerate(element.iterfind("collision"), start=1):
            where = f"link {link!r}, collision {i}"
            shape = collision.find("geometry/*")
            if shape is None or shape.tag not in ("sphere", "box", "cylinder", "capsule"):
                continue
            if shape.tag == "box":
                sizes = tuple((0.5 * _vector(shape, "size", where, None)).tolist())
            else:
                fields = ("radius",) if shape.tag == "sphere" else ("radius", "length")
                sizes = tuple(_number(shape, field, where, None) for field in fields)
            if min(sizes) < 0.0:
                raise InputError(f"{where}: sizes of a {shape.tag} must be > 0, got {list(sizes)}.")
            if min(sizes) > 0.0 or (shape.tag == "capsule" and sizes[0] > 0.0):
                name = (collision.get("name") or (link if i == 1 else f"{link}.{i}")).strip().replace("/", ".")
                found.append((link, name or link, shape.tag, sizes, _origin(collision, where)))
    names = unique(name for _, name, *_ in found)
    out: dict[str, tuple[Shape, ...]] = dict.fromkeys(links, ())
    for (link, _, kind, sizes, place), name in zip(found, names, strict=True):
        out[link] += (Shape(name, kind, sizes, place),)
    return {link: rounded(shapes) for link, shapes in out.items()}


# --- numbers ------------------------------------------------------------------------------------------------


def _origin(element: ET.Element, where: str) -> Array:
    """(4, 4) of ``<origin xyz="" rpy=""/>``: Rz(yaw) Ry(pitch) Rx(roll)."""
    out = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        out[:3, 3] = _vector(origin, "xyz", f"{where}, origin", (0, 0, 0))
        roll, pitch, yaw = _vector(origin, "rpy", f"{where}, origin", (0, 0, 0)).tolist()
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
        out[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    return out


def _vector(element: ET.Element, field: str, where: str, default: Sequence[float] | None) -> Array:
    text = element.get(field)
    if text is None and default is not None:
        return np.array(default, dtype=np.float64)
    try:
        values = np.array([float(word) for word in (text or "").split()])
    except ValueError:
        values = np.array([])
    if values.shape != (3,) or not np.all(np.isfinite(values)):
        raise InputError(f"{where}: {field} must be three numbers, got {text!r}.")
    return values


def _number(element: ET.Element, field: str, where: str, default: float | None) -> float:
    text = element.get(field)
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if field in ("effort", "velocity", "lower", "upper") and math.isinf(value):
        return math.copysign(BOUNDLESS, value)
    if not math.isfinite(value):
        raise InputError(f"{where}: {field} must be a number, got {text!r}.")
    return value
