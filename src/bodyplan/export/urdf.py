"""URDF: the robot alone, for ROS tools, Pinocchio, simulators.

Every frame is a link of the same name in the same place, and a joint named like one of the robot has its coordinate.
What URDF has no word for is written so:

* a row with several driven variables is several joints, with links "FRAME.theta" and so on between them;
* a joint that drives several variables is a leader that others, "FRAME.theta", mimic; where none of them is one to one
  (the two halves of a double joint) and before all others on one branch, the leader is a joint on the base that moves
  only a link "JOINT.coordinate";
* a length that follows the radius law of a wheel is a slide "JOINT.radius" whose coordinate is the radius itself;
* where there is no limit the number 1e30 stands, or, for a turn without followers, the type continuous;
* capsules are a cylinder and two spheres, rims flat cylinders of the largest radius;
* links that move without a mass get 1e-12 of the robot's, which some simulators need.

Which joints are passive, friction, and the law by which a rim follows a joint are not in it.
"""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.robot.elements import Arc, Contact, Drive, Joint, Row, WheelRadius, joint_of
from bodyplan.robot.masses import RIM_HALF_WIDTH, previous_origins
from bodyplan.robot.model import Robot
from bodyplan.simulate.inertia import Inertial, axis_of, inertial
from bodyplan.simulate.skeleton import SPECK

BOUNDLESS = 1e30
Z, X = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
AXES = {"theta": Z, "d": Z, "a": X, "epsilon": X}
TURNS = ("theta", "epsilon")


def write(motion_or_robot: Motion | Robot, path: str | os.PathLike[str]) -> None:
    """Write a robot, or that of a motion, to ``path``; the old file stays until all is written. Numbers read
    back equal.

    Raises InputError for a robot with arc segments, a joint that drives both a radius law and a row, and a missing
    folder.
    """
    written = text(motion_or_robot)
    with replacing(path) as file:
        file.write(written)


def text(motion_or_robot: Motion | Robot) -> str:
    """The XML that :func:`write` writes."""
    robot = motion_or_robot.robot if isinstance(motion_or_robot, Motion) else motion_or_robot
    if not isinstance(robot, Robot):
        raise InputError(f"expected a Motion or a Robot to write, got {motion_or_robot!r}.")
    root = _Writer(robot).root()
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


@dataclass(frozen=True)
class _Group:
    """What one coordinate of the robot drives: the joint ``leader`` in the file and how a variable is had from its
    coordinate x: ``scale`` x + ``offset``, both relative to the drives themselves (radius laws: to ``law``)."""

    joint: Joint
    leader: str
    drives: int
    led: tuple[str, str] | None  # the frame and field of the leading variable; None: a joint of its own
    law: WheelRadius | None = None

    @property
    def alone(self) -> bool:
        return self.drives == 1 and self.led is not None

    def line(self, drive: Drive) -> tuple[float, float]:
        """(offset, factor): the driven variable from the leader's coordinate."""
        if isinstance(drive, WheelRadius):
            law = self.law or drive
            factor = drive.link / law.link
            return drive.rubber - factor * law.rubber, factor
        return drive.offset, drive.scale

    def limits(self) -> tuple[float, float] | None:
        """The leader's range."""
        if self.law is None:
            return self.joint.limits
        low, high = self.joint.limits or (0.0, math.pi)
        full = math.isinf(high - low) or high - low >= 2.0 * math.tau
        # the law is a cosine of q/2, whose extremes are at multiples of one turn
        turns = range(2) if full else range(math.ceil(low / math.tau), math.floor(high / math.tau) + 1)
        at = [math.tau * k for k in turns] + ([] if full else [low, high])
        radii = self.law.radius(at)
        return float(radii.min()), float(radii.max())

    def rate(self) -> float | None:
        if self.law is None or self.joint.rate is None:
            return self.joint.rate
        return 0.5 * (self.law.largest - self.law.rubber) * self.joint.rate


class _Writer:
    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.links, self.joints = set(robot.frames), set(robot.joints)
        self.contacts: dict[str, list[Contact]] = {}
        for contact in robot.contacts:
            self.contacts.setdefault(contact.frame, []).append(contact)
        self.out = ET.Element("robot", name=robot.name)
        self.ways = _ways(robot)
        self.groups = self._groups()
        previous = previous_origins(robot) if robot.n or robot.elements else np.zeros((1, 3))
        self.previous = dict(zip(robot.frames, previous, strict=True))
        size = float(np.max(np.linalg.norm(previous, axis=-1), initial=0.0))
        mass = max(SPECK * robot.mass, 1e-14)
        self.speck = Inertial(mass, np.zeros(3), max(mass * size**2, 1e-14) * np.eye(3))

    def root(self) -> ET.Element:
        base = self._link("base", False)
        body = self.robot.base_body
        if body is not None:
            _add_inertial(base, inertial(body, self.contacts.get("base", []), self.previous["base"]))
        self._shapes(base, "base")
        extra = [group for group in self.groups.values() if group.led is None]
        for group in extra:
            own = self._free(f"{group.leader}.coordinate", self.links)
            turns = group.law is None and self.robot.kinds[self.robot.joint_index(group.joint.name)] == "angle"
            self._joint(group, group.leader, "base", own, (0.0,) * 4, Z, turns, None)
            self._link(own, True)
        start = "base"
        if extra:
            # readers that want leaders before those that mimic them go by the names of joints; ~ is the last letter
            start = self._free("base.chains", self.links)
            self._named_joint(self._free(f"~{start}", self.joints), "fixed", "base", start, (0.0,) * 4)
            self._link(start, False)
        for chain in self.robot.chains:
            parent = start if chain.parent == "base" else chain.parent
            for i, row in enumerate(chain.elements):
                frame = chain.frame_name(i)
                if isinstance(row, Arc):
                    raise InputError(
                        f"chain {chain.name!r}, frame {frame!r}: an arc segment bends all along, which no joint of "
                        'URDF can do; take rigid links instead (joint="straight" or "double" of a snake).'
                    )
                self._row(row, frame, parent)
                parent = frame
        return self.out

    # --- joints ---------------------------------------------------------------------------------------------

    def _groups(self) -> dict[str, _Group]:
        """For every joint coordinate that moves something, by its name."""
        uses: dict[str, list[tuple[str, str, Drive]]] = {}
        for frame, element in zip(self.robot.frames[1:], self.robot.elements, strict=True):
            for field in element.VARIABLES:
                value = getattr(element, field)
                if isinstance(value, (Joint, WheelRadius)):
                    uses.setdefault(joint_of(value).name, []).append((frame, field, value))
        out = {}
        for joint in self.robot.joint_info:
            mine = uses[joint.name]
            laws = [use for use in mine if isinstance(use[2], WheelRadius)]
            if laws and len(laws) < len(mine):
                raise InputError(
                    f"joint {joint.name!r}: drives the radius of a wheel and also a row, first in frame "
                    f"{mine[0][0]!r}; URDF joints can follow each other by a straight line only."
                )
            if laws:
                law = laws[0][2]
                name = self._free(f"{joint.name}.radius", self.joints)
                self.out.append(ET.Comment(f" {name}: R = {_law(law, joint.name)} ".replace("--", "- -")))
                out[joint.name] = _Group(joint, name, len(mine), self._first(mine), law)  # type: ignore[arg-type]
            else:
                plain = abs(mine[0][2].scale) == 1.0  # type: ignore[union-attr]
                out[joint.name] = _Group(joint, joint.name, len(mine), self._first(mine) if plain else None)
        return out

    def _first(self, uses: list[tuple[str, str, Drive]]) -> tuple[str, str] | None:
        """The first of the driven variables, if all others are behind it on one branch."""
        frame, field, _ = uses[0]
        return (frame, field) if all(frame in self.ways[other] for other, _, _ in uses) else None

    def _row(self, row: Row, frame: str, parent: str) -> None:
        """The joints from one frame to the next: one for each driven variable, and a fixed one where constants are left
        that cannot be said in its origin."""
        values = {field: getattr(row, field) for field in row.VARIABLES}
        driven = [field for field in row.VARIABLES if isinstance(values[field], (Joint, WheelRadius))]
        origin = dict.fromkeys(row.VARIABLES, 0.0)
        for field in row.VARIABLES:
            value = values[field]
            if field not in driven:
                origin[field] = value
                continue
            group = self.groups[joint_of(value).name]
            offset, factor = group.line(value)
            origin[field] = offset
            axis, last = AXES[field], field == driven[-1]
            # a slide can be said at its end, and a turn too if what follows leaves the axis through the origin
            rest = {after: values[after] for after in row.VARIABLES[row.VARIABLES.index(field) + 1 :]} if last else {}
            if last and (field not in TURNS or rest.get("a", 0.0) == 0.0):
                origin |= rest
                if axis == Z:
                    axis = (0.0, _tidy(math.sin(origin["epsilon"])), _tidy(math.cos(origin["epsilon"])))
                child, rest = frame, {}
            else:
                child = self._free(f"{frame}.{field}", self.links)
            led = group.led == (frame, field)
            if led:
                axis = tuple(factor * x for x in axis) if factor < 0.0 else axis  # type: ignore[assignment]
            name = group.leader if led else self._free(f"{frame}.{field}", self.joints)
            place = tuple(origin[f] for f in row.VARIABLES)
            self._joint(group, name, parent, child, place, axis, field in TURNS, None if led else factor)
            if child == frame:
                self._furnish(row, frame, True)
                return
            self._link(child, True)
            parent, origin = child, dict.fromkeys(row.VARIABLES, 0.0)
        self._fixed(parent, frame, tuple(origin[f] for f in row.VARIABLES))
        self._furnish(row, frame, False)

    def _joint(
        self,
        group: _Group,
        name: str,
        parent: str,
        child: str,
        place: tuple[float, ...],
        axis: tuple[float, ...],
        turns: bool,
        factor: float | None,
    ) -> None:
        """One moving joint; ``factor``: of one that mimics the leader of its group, or None for the leader."""
        limits, rate, effort = group.limits(), group.rate(), group.joint.effort
        kind = "prismatic" if not turns else "revolute" if limits or not group.alone else "continuous"
        joint = self._named_joint(name, kind, parent, child, place)
        ET.SubElement(joint, "axis", xyz=_numbers(axis))
        if factor is not None:
            ET.SubElement(joint, "mimic", joint=group.leader, multiplier=_number(factor), offset="0")
        scale = 1.0 if factor is None else abs(factor)
        low, high = (-math.inf, math.inf) if limits is None else limits
        if factor is not None and factor < 0.0:
            low, high = -high, -low
        said = {"lower": _bound(scale * low), "upper": _bound(scale * high)} if kind != "continuous" else {}
        most = {
            "effort": BOUNDLESS if effort is None or group.law else effort,
            "velocity": BOUNDLESS if rate is None else scale * rate,
        }
        ET.SubElement(joint, "limit", said | {key: _number(value) for key, value in most.items()})

    def _fixed(self, parent: str, child: str, place: tuple[float, ...]) -> None:
        self._named_joint(self._free(f"{child}.fixed", self.joints), "fixed", parent, child, place)

    def _named_joint(self, name: str, kind: str, parent: str, child: str, place: tuple[float, ...]) -> ET.Element:
        theta, d, a, epsilon = place
        joint = ET.SubElement(self.out, "joint", name=name, type=kind)
        xyz = (_tidy(a * math.cos(theta)), _tidy(a * math.sin(theta)), d)
        ET.SubElement(joint, "origin", xyz=_numbers(xyz), rpy=_numbers((epsilon, 0.0, theta)))
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=child)
        return joint

    # --- links ----------------------------------------------------------------------------------------------

    def _link(self, name: str, moves: bool) -> ET.Element:
        link = ET.SubElement(self.out, "link", name=name)
        if moves and self.robot.mass > 0.0:
            _add_inertial(link, self.speck)
        return link

    def _furnish(self, row: Row, frame: str, moves: bool) -> None:
        link = self._link(frame, moves and row.body is None)
        if row.body is not None:
            _add_inertial(link, inertial(row.body, self.contacts.get(frame, []), self.previous[frame]))
        self._shapes(link, frame)

    def _shapes(self, link: ET.Element, frame: str) -> None:
        for contact in self.contacts.get(frame, []):
            for name, at, rpy, tag, sizes in _solids(contact):
                for use in ("visual", "collision"):
                    shape = ET.SubElement(link, use, name=name)
                    ET.SubElement(shape, "origin", xyz=_numbers(at), rpy=_numbers(rpy))
                    ET.SubElement(ET.SubElement(shape, "geometry"), tag, sizes)

    def _free(self, name: str, taken: set[str]) -> str:
        while name in taken:
            name += "~"
        taken.add(name)
        return name


def _ways(robot: Robot) -> dict[str, tuple[str, ...]]:
    """For every frame those on the way to it, itself last."""
    out: dict[str, tuple[str, ...]] = {"base": ("base",)}
    for chain in robot.chains:
        way = out[chain.parent]
        for i in range(len(chain.elements)):
            frame = chain.frame_name(i)
            way = out[frame] = (*way, frame)
    return out


_Solid = tuple[str, Array, tuple[float, float, float], str, dict[str, str]]


def _solids(contact: Contact) -> list[_Solid]:
    """(name, centre, rpy, tag, sizes) of the solids that make up a contact shape."""
    start, r = np.array(contact.start), contact.radius
    ball = {"radius": _number(r)}
    level = (0.0, 0.0, 0.0)
    if contact.shape == "box":
        return [(contact.name, start, level, "box", {"size": _numbers(2.0 * np.array(contact.half))})]
    if contact.shape == "rim":
        return [(contact.name, start, level, "cylinder", ball | {"length": _number(2.0 * RIM_HALF_WIDTH * r)})]
    axis, length = axis_of(contact)
    if contact.shape == "sphere" or length == 0.0:
        return [(contact.name, start, level, "sphere", ball)]
    # Rz(yaw) Ry(pitch) takes z to the axis
    x, y, z = axis.tolist()
    turn = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))
    end = np.array(contact.end)
    tube: _Solid = (contact.name, 0.5 * (start + end), turn, "cylinder", ball | {"length": _number(length)})
    caps = zip(("start", "end"), (start, end), strict=True)
    return [tube, *((f"{contact.name}.{side}", at, level, "sphere", ball) for side, at in caps)]


def _add_inertial(link: ET.Element, of: Inertial) -> None:
    out = ET.SubElement(link, "inertial")
    ET.SubElement(out, "origin", xyz=_numbers(of.com), rpy="0 0 0")
    ET.SubElement(out, "mass", value=_number(of.mass))
    names = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))
    ET.SubElement(out, "inertia", {name: _number(of.inertia[i, j]) for name, i, j in names})


def _law(law: object, joint: str) -> str:
    return f"{law.link} m * cos(30 deg) * cos({joint}/2) + {law.rubber} m" if isinstance(law, WheelRadius) else ""


def _bound(value: float) -> str:
    return _number(math.copysign(min(abs(value), BOUNDLESS), value))


def _tidy(value: float) -> float:
    """Rounding of what should be nothing, away."""
    return 0.0 if abs(value) < 1e-16 else value


def _number(value: float) -> str:
    value = float(value) + 0.0
    return str(int(value)) if value == int(value) and abs(value) < 1e9 else repr(value)


def _numbers(values: object) -> str:
    return " ".join(map(_number, np.ravel(values).tolist()))  # type: ignore[call-overload]
