"""Straight-line code: every intermediate result gets a name once, however often it is used."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
import sympy as sp

from bodyplan.robot.elements import Joint, Variable, WheelRadius, joint_of
from bodyplan.robot.formulas import Scalar
from bodyplan.robot.model import Robot
from bodyplan.robot.symbolic.formulas import formula
from bodyplan.robot.symbolic.numbers import machine
from bodyplan.robot.symbolic.recursion import Angles, base_from
from bodyplan.spatial.coefficients import coefficients

#: functions that the languages define themselves: sin(x)/x, and C(z, A) of an arc
SINC, ARC_C = sp.Function("sinc"), sp.Function("arc_c")


@dataclass(frozen=True)
class Line:
    """One assignment, or a remark where ``name`` is None."""

    name: Any
    value: Any


class Naming:
    """:class:`~bodyplan.robot.symbolic.recursion.Arithmetic` that names intermediate results "t0", "t1", ...; equal
    ones, also up to their sign, once. Inputs are ``joint_texts``: what stands for each joint in the code."""

    def __init__(self, joint_texts: dict[str, str]) -> None:
        self.lines: list[Line] = []
        self._inputs = {name: sp.Symbol(text) for name, text in joint_texts.items()}
        self._known: dict[Any, Any] = {}

    def remark(self, text: str) -> None:
        """A comment before what comes next."""
        self.lines.append(Line(None, text))

    def keep(self, value: Scalar) -> Any:
        value = sp.sympify(value)
        if value.is_Symbol:
            return value
        if value.is_number:
            return machine(value)
        if value.could_extract_minus_sign():
            return -self._named(-value)
        return self._named(value)

    def _named(self, value: Any) -> Any:
        if value.is_Symbol:
            return value
        if value not in self._known:
            self._known[value] = sp.Symbol(f"t{len(self._known)}")
            self.lines.append(Line(self._known[value], value))
        return self._known[value]

    def value(self, variable: Variable, angle: bool) -> Any:
        if isinstance(variable, WheelRadius):
            c, _ = self._half(variable)
            return self.keep(machine(variable.rubber) + self._depth(variable) * c)
        if isinstance(variable, Joint):
            return self.keep(machine(variable.offset) + machine(variable.scale) * self._inputs[variable.name])
        return machine(variable)

    def slope(self, drive: Variable) -> Any:
        if isinstance(drive, WheelRadius):
            _, s = self._half(drive)
            return self.keep(-0.5 * self._depth(drive) * s)
        assert isinstance(drive, Joint)
        return machine(drive.scale)

    def _depth(self, law: WheelRadius) -> Any:
        return machine(law.link * np.sqrt(0.75))

    def _half(self, law: WheelRadius) -> tuple[Any, Any]:
        half = self.keep(0.5 * self._inputs[law.joint.name])
        return self.keep(sp.cos(half)), self.keep(sp.sin(half))

    def cos_sin(self, angles: Angles) -> tuple[Any, Any]:
        """Sums by the addition theorem: two multiplications are cheaper than a sine."""
        c, s = sp.S.One, sp.S.Zero
        for variable in angles:
            ci, si = self._cos_sin(variable)
            c, s = self.keep(c * ci - s * si), self.keep(s * ci + c * si)
        return c, s

    def _cos_sin(self, variable: Variable) -> tuple[Any, Any]:
        exact = formula(variable, turns=True)
        if exact.is_number:
            return machine(sp.cos(exact)), machine(sp.sin(exact))
        # an offset of a quarter turn swaps sine and cosine in the formula already
        q = sp.Symbol(joint_of(variable).name)  # type: ignore[arg-type]  # a number has been returned above
        return self._trig(sp.cos(exact), q), self._trig(sp.sin(exact), q)

    def _trig(self, value: Any, q: Any) -> Any:
        if value.could_extract_minus_sign():
            return -self._trig(-value, q)
        offset, scaled = value.args[0].as_independent(q, as_Add=True)
        scale = scaled / q
        return self.keep(value.func(self.keep(machine(offset) + machine(scale) * self._inputs[q.name])))

    def bend(self, pitch: Scalar, yaw: Scalar) -> tuple[Any, Any, Any]:
        """As in the kernels: A and B from half of the angle, which cancels nothing."""
        z = self.keep(pitch * pitch + yaw * yaw)
        if z.is_number:
            A, B, C = (machine(f) for f in coefficients(np.sqrt(float(z))))
            return A, B, C
        plane = pitch == 0 or yaw == 0
        half = self.keep(0.5 * (pitch + yaw if plane else sp.sqrt(z)))
        ratio = self.keep(SINC(half))
        A = self.keep(ratio * self.keep(sp.cos(half)))
        B = self.keep(0.5 * ratio * ratio)
        return A, B, self.keep(ARC_C(z, A))


@dataclass(frozen=True)
class Program:
    """Code for C frames: its ``lines``, and which expressions the results are: ``positions`` (C, 3), ``rotations``
    (C, 3, 3), ``twists``: for each frame a mapping from the column of a joint to its body-fixed twist (6,)."""

    lines: list[Line]
    positions: list[list[Any]]
    rotations: list[list[list[Any]]]
    twists: list[dict[int, list[Any]]]

    @property
    def joint_of(self) -> list[int]:
        """Joint of every twist, frame after frame."""
        return [joint for columns in self.twists for joint in columns]

    @property
    def first(self) -> list[int]:
        """(C + 1,) number of the first twist of every frame, and of all twists."""
        return [0, *accumulate(len(columns) for columns in self.twists)]


def compute(robot: Robot, frames: tuple[int, ...], joint_texts: dict[str, str]) -> Program:
    """The program for ``frames`` (indices), without lines that nothing uses."""
    naming = Naming(joint_texts)
    positions, rotations, twists = [], [], []
    for frame in frames:
        naming.remark(f"{robot.frames[frame]}: from it back to the base")
        walk = base_from(robot, frame, naming)
        axes = [walk.x, walk.y, walk.z]
        rotations.append(axes)
        positions.append([naming.keep(-sum(a * b for a, b in zip(axis, walk.r, strict=True))) for axis in axes])
        columns = {robot.joint_index(name): twist for name, twist in walk.columns.items()}
        twists.append(dict(sorted(columns.items())))
    rows = (
        *positions,
        *(axis for axes in rotations for axis in axes),
        *(t for twist in twists for t in twist.values()),
    )
    return Program(_used(naming.lines, [x for row in rows for x in row]), positions, rotations, twists)


def _used(lines: list[Line], results: list[Any]) -> list[Line]:
    """Lines that the results need, and remarks that something follows."""
    needed = set().union(*(sp.sympify(x).free_symbols for x in results))
    kept: list[Line] = []
    for line in reversed(lines):
        if line.name is None:
            if kept and kept[-1].name is not None:
                kept.append(line)
        elif line.name in needed:
            needed |= line.value.free_symbols
            kept.append(line)
    return kept[::-1]
