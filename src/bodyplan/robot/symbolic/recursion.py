"""The recursion of the kinematic kernels over expressions: poses and joint twists of a frame, element by element.

An :class:`Arithmetic` says what becomes of intermediate results: formulas leave them as they are, code gives them
names. Turns about parallel axes in a row are added up before they are used, so that formulas have cos(hip + knee).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import sympy as sp

from bodyplan.robot.elements import Arc, Element, Joint, Row, Variable, WheelRadius, joint_of
from bodyplan.robot.formulas import Entries, Scalar, arc_pose, arc_velocity, cross, row_velocity
from bodyplan.robot.model import Robot

Angles = tuple[Variable, ...]


class Arithmetic(Protocol):
    """How variables of elements become expressions."""

    def keep(self, value: Scalar) -> Scalar:
        """An intermediate result that will be used again."""

    def value(self, variable: Variable, angle: bool) -> Scalar:
        """theta, d, a, epsilon, pitch or yaw, in rad or m."""

    def slope(self, drive: Variable) -> Scalar:
        """d(variable)/d(joint coordinate)."""

    def cos_sin(self, angles: Angles) -> tuple[Scalar, Scalar]:
        """Cosine and sine of a sum of variables."""

    def bend(self, pitch: Scalar, yaw: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """(A, B, C) of :mod:`bodyplan.robot.symbolic.arcs` for an arc."""


@dataclass
class Walk:
    """A frame seen from the base or the base seen from a frame: axes x, y, z and origin r, all (3,), while turns about
    z are pending; ``columns``: joint -> body-fixed twist (6,) per unit rate."""

    how: Arithmetic
    x: list[Scalar] = field(default_factory=lambda: [sp.S.One, sp.S.Zero, sp.S.Zero])
    y: list[Scalar] = field(default_factory=lambda: [sp.S.Zero, sp.S.One, sp.S.Zero])
    z: list[Scalar] = field(default_factory=lambda: [sp.S.Zero, sp.S.Zero, sp.S.One])
    r: list[Scalar] = field(default_factory=lambda: [sp.S.Zero] * 3)
    pending: Angles = ()
    columns: dict[str, list[Scalar]] = field(default_factory=dict)

    def mixed(self, c: Scalar, u: list[Scalar], s: Scalar, v: list[Scalar]) -> list[Scalar]:
        """c u + s v."""
        return [self.how.keep(c * a + s * b) for a, b in zip(u, v, strict=True)]

    def shifted(self, length: Scalar, axis: list[Scalar]) -> None:
        self.r = [self.how.keep(a + length * b) for a, b in zip(self.r, axis, strict=True)]

    def column(self, drive: Variable, v: list[Scalar], omega: list[Scalar]) -> None:
        """Add what one drive contributes to the column of its joint."""
        assert isinstance(drive, (Joint, WheelRadius))
        slope, name = self.how.slope(drive), joint_of(drive).name
        before = self.columns.get(name, [sp.S.Zero] * 6)
        twist = [self.how.keep(entry) for entry in [*v, *omega]]
        self.columns[name] = [self.how.keep(a + slope * b) for a, b in zip(before, twist, strict=True)]


def path_to_base(robot: Robot, frame: int) -> list[Element]:
    """The elements from a frame (index in ``robot.frames``) back to the base."""
    before = [robot.frame_index(chain.parent) if i == 0 else None
              for chain in robot.chains for i in range(len(chain.elements))]  # fmt: skip
    out = []
    while frame > 0:
        out.append(robot.elements[frame - 1])
        start = before[frame - 1]
        frame = frame - 1 if start is None else start
    return out


def base_from(robot: Robot, frame: int, how: Arithmetic) -> Walk:
    """The base seen from a frame, and the columns of the frame's body-fixed Jacobian: a turn about an axis w through r
    gives (r x w, w), a slide along u gives (u, 0)."""
    walk = Walk(how)
    for element in path_to_base(robot, frame):
        if isinstance(element, Arc):
            _undo_arc(walk, element)
        else:
            _undo_row(walk, element)
    _flush(walk, -1)
    return walk


def frame_from(robot: Robot, frame: int, how: Arithmetic) -> Walk:
    """A frame seen from the base: the same chain walked outwards, which gives the shortest formulas of a pose."""
    walk = Walk(how)
    for element in reversed(path_to_base(robot, frame)):
        if isinstance(element, Arc):
            _flush(walk, 1)
            end, R = arc_pose(_length(element), *_bent(how, element)[:4])
            for axis, length in zip((walk.x, walk.y, walk.z), end, strict=True):
                walk.shifted(length, axis)
            _turn(walk, R)
            continue
        theta, d, a, epsilon = (getattr(element, name) for name in element.VARIABLES)
        if not _is_zero(theta):
            walk.pending = (*walk.pending, theta)
        if not _is_zero(d):
            walk.shifted(how.value(d, False), walk.z)
        if not _is_zero(a):
            walk.shifted(how.value(a, False), _turned_x(walk, 1))
        if not _is_zero(epsilon):
            _flush(walk, 1)
            c, s = how.cos_sin((epsilon,))
            walk.y, walk.z = walk.mixed(c, walk.y, s, walk.z), walk.mixed(-s, walk.y, c, walk.z)
    _flush(walk, 1)
    return walk


def element_formulas(element: Element, how: Arithmetic) -> tuple[Entries, Entries]:
    """(D (6, 6), E (6, 4 or 2)) of one element."""
    if isinstance(element, Arc):
        return arc_velocity(_length(element), *_bent(how, element))
    d, a = how.value(element.d, False), how.value(element.a, False)
    c, s = how.cos_sin((element.theta,))
    return row_velocity(c, s, d, a, *how.cos_sin((element.epsilon,)))


# --- one element --------------------------------------------------------------------------------------------


def _undo_row(walk: Walk, row: Row) -> None:
    how = walk.how
    if not _is_zero(row.epsilon):
        _flush(walk, -1)
        c, s = how.cos_sin((row.epsilon,))
        if _driven(row.epsilon):
            walk.column(row.epsilon, cross(walk.r, walk.x), walk.x)
        walk.y, walk.z = walk.mixed(c, walk.y, -s, walk.z), walk.mixed(s, walk.y, c, walk.z)
    if not _is_zero(row.a):
        x = _turned_x(walk, -1)
        if _driven(row.a):
            walk.column(row.a, x, [sp.S.Zero] * 3)
        walk.shifted(-how.value(row.a, False), x)
    if not _is_zero(row.d):
        if _driven(row.d):
            walk.column(row.d, walk.z, [sp.S.Zero] * 3)
        walk.shifted(-how.value(row.d, False), walk.z)
    if not _is_zero(row.theta):
        if _driven(row.theta):
            walk.column(row.theta, cross(walk.r, walk.z), walk.z)
        walk.pending = (*walk.pending, row.theta)


def _undo_arc(walk: Walk, arc: Arc) -> None:
    _flush(walk, -1)
    how, length = walk.how, _length(arc)
    bent = _bent(how, arc)
    end, R = arc_pose(length, *bent[:4])
    R = [[how.keep(entry) for entry in row] for row in R]
    _, E = arc_velocity(length, *bent)
    for k, drive in enumerate((arc.pitch, arc.yaw)):
        if _driven(drive):
            own = [how.keep(row[k]) for row in E]
            v, omega = (
                [how.keep(sum(w * axis[i] for w, axis in zip(part, (walk.x, walk.y, walk.z), strict=True)))
                 for i in range(3)]
                for part in (own[:3], own[3:])
            )  # fmt: skip
            walk.column(drive, [a + b for a, b in zip(v, cross(walk.r, omega), strict=True)], omega)
    _turn(walk, [list(column) for column in zip(*R, strict=True)])
    for axis, amount in zip((walk.x, walk.y, walk.z), end, strict=True):
        walk.shifted(-how.keep(amount), axis)


def _turn(walk: Walk, R: Entries) -> None:
    """Axes times R: new axis j is the sum of R[i][j] times old axis i."""
    old = (walk.x, walk.y, walk.z)
    walk.x, walk.y, walk.z = (
        [walk.how.keep(sum(R[i][j] * old[i][k] for i in range(3))) for k in range(3)] for j in range(3)
    )


def _turned_x(walk: Walk, sign: int) -> list[Scalar]:
    """The x axis after the pending turns; ``sign`` 1: walking outwards, -1: towards the base."""
    if not walk.pending:
        return walk.x
    c, s = walk.how.cos_sin(walk.pending)
    return walk.mixed(c, walk.x, sign * s, walk.y)


def _flush(walk: Walk, sign: int) -> None:
    """Carry the pending turns out."""
    if walk.pending:
        c, s = walk.how.cos_sin(walk.pending)
        walk.x, walk.y = walk.mixed(c, walk.x, sign * s, walk.y), walk.mixed(-sign * s, walk.x, c, walk.y)
        walk.pending = ()


def _bent(how: Arithmetic, arc: Arc) -> tuple[Scalar, ...]:
    """(pitch, yaw, A, B, C) of an arc."""
    p, y = how.value(arc.pitch, True), how.value(arc.yaw, True)
    return (p, y, *how.bend(p, y))


def _length(arc: Arc) -> Scalar:
    return sp.Float(arc.length)


def _driven(variable: Variable) -> bool:
    return isinstance(variable, (Joint, WheelRadius))


def _is_zero(variable: Variable) -> bool:
    return not _driven(variable) and variable == 0.0
