"""A robot as MuJoCo bodies, joints, sites and contact shapes.

Every frame of the robot becomes a body and a site of the same name, except those of contact angles, which are outcomes
(:mod:`bodyplan.simulate.rims`). A row ``Rz(theta) Tz(d) Tx(a)
Rx(epsilon)`` is one body with a joint for each driven variable: with the row at q = 0 as the body's rest
pose X, ``A a B b C c D d = X (BCD)^-1 a (BCD) (CD)^-1 b (CD) D^-1 c D d``, so that the joints, parent-most
first, are screws written in the body's own axes. MuJoCo's joint coordinate is ``scale * q`` of the drive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError
from bodyplan.robot.elements import Arc, Body, Contact, Joint, Row, Variable
from bodyplan.robot.masses import RIM_HALF_WIDTH, previous_origins
from bodyplan.robot.model import Robot
from bodyplan.simulate.inertia import Inertial, axis_of, inertial, joined, moved, sound
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.rims import RING_SHARE, Ring, given_up, lightened, pointers_of, rims_of, ring_of
from bodyplan.simulate.wheels import TIPS, add_motor, add_ring
from bodyplan.spatial.rotations import conjugate, matrix_from_quaternion, multiply, quaternion_exp, rotate

X, Y, Z = np.eye(3)
#: mass of a moving frame that carries none, over the robot's mass: MuJoCo needs a positive number, and
#: nothing ever rests on it because a joint's armature and the bodies behind it are many orders above
SPECK = 1e-12
SKIN = (0.86, 0.52, 0.25, 1.0)


@dataclass(frozen=True)
class Drives:
    """MuJoCo's D joints of a robot: ``names``, the column of q (``joint``, (D,)) and ``scale`` (D,) of each:
    MuJoCo coordinate = scale * q[joint]. ``rings``: wheels whose slides follow the joints as well."""

    names: tuple[str, ...]
    joint: IntArray
    scale: Array
    rings: tuple[Ring, ...] = ()


@dataclass(frozen=True)
class _Hinge:
    """One driven variable as a screw in the axes of its body."""

    joint: Joint
    label: str
    slides: bool
    axis: Array
    at: Array


class _Builder:
    def __init__(
        self, spec: Any, robot: Robot, armature: float, arc_joints: int, tips: int, ranges: Mapping[str, Any]
    ) -> None:
        self.mj, self.spec, self.robot = mujoco(), spec, robot
        self.armature, self.arc_joints, self.tips = armature, arc_joints, tips
        self.pointers = {pointer.frame for pointer in pointers_of(robot)}
        self.rings = _rings(robot, ranges)
        self.given = given_up(self.rings, robot)
        self.bodies: dict[str, Any] = {}
        self.contacts: dict[str, list[Contact]] = {}
        for contact in robot.contacts:
            self.contacts.setdefault(contact.frame, []).append(contact)
        rest = robot.forward(np.zeros(robot.n))
        self.rest = {name: rest[name] for name in robot.frames}
        self.previous = dict(zip(robot.frames, previous_origins(robot), strict=True))
        size = self.size = float(np.max(np.linalg.norm(rest.positions, axis=-1), initial=0.0))
        # what moves -> frames that are fixed to it, itself included, and what they carry
        self.leader: dict[str, str] = {}
        self.carried: dict[str, dict[str, Inertial]] = {}
        speck = max(SPECK * robot.mass, 1e-14)
        self.speck = Inertial(speck, np.zeros(3), max(speck * size**2, 1e-14) * np.eye(3))
        self.uses = self._count_uses()
        self.made: list[tuple[str, int, float]] = []

    def _count_uses(self) -> dict[str, list[float]]:
        """Scales of all MuJoCo joints that a joint coordinate drives."""
        uses: dict[str, list[float]] = {}
        for frame, element in zip(self.robot.frames[1:], self.robot.elements, strict=True):
            pieces = self.arc_joints if isinstance(element, Arc) else 1
            for field in element.VARIABLES:
                value = getattr(element, field)
                if isinstance(value, Joint) and frame not in self.pointers:
                    uses.setdefault(value.name, []).extend([value.scale / pieces] * pieces)
        return uses

    def build(self) -> Drives:
        base = self._body(self.spec.worldbody, "base", np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), [], free=True)
        self._furnish(base, "base", "base", self.robot.base_body, moves=True)
        for chain in self.robot.chains:
            parent = chain.parent
            for i, element in enumerate(chain.elements):
                frame = chain.frame_name(i)
                if isinstance(element, Arc):
                    self._add_arc(element, frame, parent)
                elif frame not in self.pointers:
                    self._add_row(element, frame, parent)
                parent = frame
        for leader, parts in self.carried.items():
            self._give(leader, parts)
        for ring in self.rings:
            self._add_wheel(ring)
        names, joints, scales = zip(*self.made, strict=True) if self.made else ((), (), ())
        return Drives(
            tuple(names),
            np.array(joints, dtype=np.int64),
            np.array(scales, dtype=np.float64),
            self.rings,
        )

    # --- elements -------------------------------------------------------------------------------------------

    def _add_row(self, row: Row, frame: str, parent: str) -> None:
        theta, d, a, epsilon = (_rest(getattr(row, field)) for field in row.VARIABLES)
        turn = multiply(quaternion_exp(theta * Z), quaternion_exp(epsilon * X))
        place = np.array([a * np.cos(theta), a * np.sin(theta), d])
        up = np.array([0.0, np.sin(epsilon), np.cos(epsilon)])  # the previous z axis, seen from the new frame
        previous = -a * X - d * up
        screws = {
            "theta": (False, up, previous),
            "d": (True, up, 0.0 * X),
            "a": (True, X, 0.0 * X),
            "epsilon": (False, X, 0.0 * X),
        }
        hinges = [
            _Hinge(value, f"{frame}.{field}", *screws[field])
            for field in row.VARIABLES
            if isinstance(value := getattr(row, field), Joint)
        ]
        body = self._body(self.bodies[parent], frame, place, turn, hinges)
        self._furnish(body, frame, parent, row.body, moves=bool(hinges))

    def _add_arc(self, arc: Arc, frame: str, parent: str) -> None:
        """An arc as k equal pieces that bend at their middles: the chord of a piece of angle 2y is too long
        by y^2/3 of its length, so the end of an arc of angle phi is off by about L phi^2 / (12 k^2). Yaw
        and pitch take turns in going first, which cancels the leading part of their commutator."""
        drives = {f: v for f in arc.VARIABLES if isinstance(v := getattr(arc, f), Joint)}
        if not drives:
            here, there = self.rest[parent], self.rest[frame]
            back = conjugate(here[3:])
            body = self._body(
                self.bodies[parent], frame, rotate(back, there[:3] - here[:3]), multiply(back, there[3:]), []
            )
            self._furnish(body, frame, parent, arc.body, moves=False)
            return
        body, before = self.bodies[parent], parent
        k, piece = self.arc_joints, arc.length / self.arc_joints
        angles = {f: _rest(getattr(arc, f)) / k for f in arc.VARIABLES}
        axes = {"pitch": Y, "yaw": Z}
        for i in range(k):
            last = i == k - 1
            first, second = ("yaw", "pitch") if i % 2 == 0 else ("pitch", "yaw")
            inner = quaternion_exp(angles[second] * axes[second])
            turn = multiply(quaternion_exp(angles[first] * axes[first]), inner)
            seen = {first: rotate(conjugate(inner), axes[first]), second: axes[second]}
            out = 0.5 * piece * X if last else 0.0 * X  # the last body's frame is the end of the arc
            hinges = [
                _Hinge(drives[f].share(1.0 / k), f"{frame}.{f}{i + 1}", False, seen[f], -out)
                for f in (first, second)
                if f in drives
            ]
            start = (0.5 * piece if i == 0 else piece) * X
            name = frame if last else f"{frame}~{i + 1}"
            body = self._body(body, name, start + rotate(turn, out), turn, hinges)
            if not last:
                self._mass(body, self.speck)
        self._furnish(body, frame, before, arc.body, moves=True)

    def _add_wheel(self, ring: Ring) -> None:
        column = self.robot.joint_index(ring.joint)
        if all(ring.joint != name for name, _, _ in self.made):
            hinge = add_motor(self.bodies[ring.rim.axle], ring.joint, self.armature, self.speck.mass)
            limits = self.robot.joint_info[column].limits
            if limits is not None:
                hinge.limited, hinge.range = self.mj.mjtLimited.mjLIMITED_TRUE, list(limits)
            self.made.append((ring.joint, column, 1.0))
        add_ring(self.spec, self.bodies[ring.rim.contact.frame], ring, self.tips, self.robot.mass)

    # --- pieces ---------------------------------------------------------------------------------------------

    def _body(self, parent: Any, name: str, at: Array, turn: Array, hinges: list[_Hinge], free: bool = False) -> Any:
        body = parent.add_body(name=name, pos=at, quat=turn)
        self.bodies[name] = body
        if free:
            body.add_freejoint(name="base~free")
        for hinge in hinges:
            joint, uses = hinge.joint, self.uses[hinge.joint.name]
            leads = all(joint.name != self.robot.joints[column] for _, column, _ in self.made)
            name = joint.name if len(uses) == 1 else f"{joint.name}@{hinge.label}"
            kind = self.mj.mjtJoint.mjJNT_SLIDE if hinge.slides else self.mj.mjtJoint.mjJNT_HINGE
            # armature on q: sum of scale^2 times that of each MuJoCo joint
            added = body.add_joint(
                name=name,
                type=kind,
                axis=hinge.axis,
                pos=hinge.at,
                armature=self.armature / float(np.square(uses).sum()),
            )
            if leads and joint.limits is not None:
                added.limited = self.mj.mjtLimited.mjLIMITED_TRUE
                added.range = sorted(joint.scale * limit for limit in joint.limits)
            self.made.append((name, self.robot.joints.index(joint.name), joint.scale))
        return body

    def _furnish(self, body: Any, frame: str, parent: str, carried: Body | None, *, moves: bool) -> None:
        leader = self.leader[frame] = frame if moves else self.leader.get(parent, parent)
        body.add_site(name=frame, size=[0.002] * 3, group=4)
        shapes = self.contacts.get(frame, [])
        for contact in shapes:
            if contact.drive is None:
                self._shape(body, contact)
        if carried is not None:
            whole = inertial(carried, shapes, self.previous[frame])
            whole = lightened(whole, self.given[frame]) if frame in self.given else whole
            self.carried.setdefault(leader, {})[frame] = whole
        elif moves:
            self._mass(body, self.speck)

    def _give(self, leader: str, parts: Mapping[str, Inertial]) -> None:
        """Their masses to frames that are fixed to each other. Where one is no body by itself (files give sensors of
        no extent, or any number, to links that are fixed to others), all go to the frame that moves them: the same
        motion."""
        given = {frame: sound(part, self.size) for frame, part in parts.items()}
        if all(part is not None for part in given.values()):
            for frame, part in given.items():
                assert part is not None
                self._mass(self.bodies[frame], part)
            return
        here = self.rest[leader]
        back = conjugate(here[3:])
        seen = []
        for frame, part in parts.items():
            there = self.rest[frame]
            turn = matrix_from_quaternion(multiply(back, there[3:]))
            seen.append(moved(part, rotate(back, there[:3] - here[:3]), turn))
        together = joined(seen)
        whole = sound(together, self.size)
        if whole is None:
            moments = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(together.inertia))
            raise InputError(
                f"robot {self.robot.name!r} cannot be simulated: the inertia of {', '.join(parts)} is that of no body. "
                f"Its principal moments are {moments} kg m^2; all must be > 0, none above the sum of the two others."
            )
        self._mass(self.bodies[leader], whole)

    @staticmethod
    def _mass(body: Any, inertial: Inertial) -> None:
        moment = inertial.inertia
        body.mass, body.ipos, body.explicitinertial = inertial.mass, inertial.com, True
        body.fullinertia = [*np.diag(moment), moment[0, 1], moment[0, 2], moment[1, 2]]

    def _shape(self, body: Any, contact: Contact) -> None:
        kinds, r = self.mj.mjtGeom, contact.radius
        at, turn, size = np.array(contact.start), np.array([1.0, 0.0, 0.0, 0.0]), [r, 0.0, 0.0]
        kind = kinds.mjGEOM_SPHERE
        if contact.shape == "box":
            kind, size = kinds.mjGEOM_BOX, list(contact.half)
        elif contact.shape == "rim":
            kind, size = kinds.mjGEOM_CYLINDER, [r, RIM_HALF_WIDTH * r, 0.0]
        elif contact.shape == "capsule":
            axis, length = axis_of(contact)
            if length > 0.0:
                kind, size = kinds.mjGEOM_CAPSULE, [r, 0.5 * length, 0.0]
                at, turn = 0.5 * np.add(contact.start, contact.end), _turn_z_to(axis)
        # no automatic collisions: who touches whom is said by explicit pairs
        body.add_geom(
            name=contact.name,
            type=kind,
            pos=at,
            quat=turn,
            size=size,
            contype=0,
            conaffinity=0,
            mass=0.0,
            rgba=SKIN,
        )


def add_robot(
    spec: Any,
    robot: Robot,
    *,
    armature: float = 1e-3,
    arc_joints: int = 4,
    rim_tips: int = TIPS,
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> Drives:
    """Add ``robot`` with a free base to an MjSpec. ``armature``: rotor inertia on every joint coordinate,
    kg m^2 (kg for a length). ``arc_joints``: pieces k of an arc segment, whose end is off by about L phi^2
    / (12 k^2). ``rim_tips``: balls of a wheel that changes its radius, whose mass is taken from its hub or the base;
    ``ranges``: the angles (low, high) rad that its joint uses, by name (default: its limits).

    A moving frame without a body gets 1e-12 of the robot's mass. Raises InputError for a robot without mass
    and for a wheel-radius drive without a rim.
    """
    if robot.mass <= 0.0:
        raise InputError(f"robot {robot.name!r}: has no mass; give its rows or its base a Body to simulate it.")
    return _Builder(spec, robot, armature, arc_joints, rim_tips, ranges or {}).build()


def _rings(robot: Robot, ranges: Mapping[str, tuple[float, float]]) -> tuple[Ring, ...]:
    """What wheels that change their radius are made from."""
    rings = []
    for rim in rims_of(robot):
        drive = rim.contact.drive
        if drive is not None:
            # a WheelRadius gives its joint limits where nobody else does
            low, high = ranges.get(drive.joint.name, robot.limits[robot.joint_index(drive.joint.name)])
            rings.append(ring_of(rim, drive, float(low), float(high), RING_SHARE * robot.mass))
    return tuple(rings)


def _rest(value: Variable) -> float:
    """The variable's value at q = 0."""
    return value.offset if isinstance(value, Joint) else float(value)  # type: ignore[arg-type]


def _turn_z_to(axis: Array) -> Array:
    """A rotation (wxyz) that takes z to the unit vector ``axis``."""
    if axis[2] < -0.9:  # next to the turn by pi, whose axis is not defined: go by way of x
        return multiply(_turn_z_to(-axis), np.array([0.0, 1.0, 0.0, 0.0]))
    q = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    return np.asarray(q / np.linalg.norm(q))
