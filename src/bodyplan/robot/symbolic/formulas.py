"""Variables and drives as formulas in the joints' symbols."""

from __future__ import annotations

from typing import Any

import sympy as sp

from bodyplan.robot.elements import Joint, Variable, WheelRadius
from bodyplan.robot.formulas import Scalar
from bodyplan.robot.symbolic.arcs import ArcA, ArcB, ArcC
from bodyplan.robot.symbolic.numbers import angle, plain
from bodyplan.robot.symbolic.recursion import Angles


class Formulas:
    """:class:`~bodyplan.robot.symbolic.recursion.Arithmetic` that leaves everything as it is: a joint is the symbol of
    its name, pi/2 is exact, pure numbers are worked out."""

    def keep(self, value: Scalar) -> Any:
        value = sp.sympify(value)
        # a length times sqrt(2)/2 is only a length
        return value.evalf() if value.is_number and value.has(sp.Float) else value

    def value(self, variable: Variable, angle: bool) -> Any:
        return formula(variable, turns=angle)

    def slope(self, drive: Variable) -> Any:
        if isinstance(drive, WheelRadius):
            return formula(drive, turns=False).diff(sp.Symbol(drive.joint.name))
        assert isinstance(drive, Joint)
        return plain(drive.scale)

    def cos_sin(self, angles: Angles) -> tuple[Any, Any]:
        total = sum((formula(variable, turns=True) for variable in angles), sp.S.Zero)
        return sp.cos(total), sp.sin(total)

    def bend(self, pitch: Scalar, yaw: Scalar) -> tuple[Any, Any, Any]:
        z = pitch * pitch + yaw * yaw
        return ArcA(z), ArcB(z), ArcC(z)


def formula(variable: Variable, *, turns: bool) -> Any:
    """A constant or driven variable: ``offset + scale q``, or the radius law of an adjustable wheel."""
    if isinstance(variable, WheelRadius):
        q = sp.Symbol(variable.joint.name)
        return plain(variable.rubber) + plain(variable.link) * sp.sqrt(3) / 2 * sp.cos(q / 2)
    number = angle if turns else plain
    if isinstance(variable, Joint):
        return number(variable.offset) + plain(variable.scale) * sp.Symbol(variable.name)
    return number(variable)
