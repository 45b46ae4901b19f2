"""Any transform, and any turn about or slide along an axis, as rows of the extended D-H table.

A row ``Rz(theta) Tz(d) Tx(a) Rx(epsilon)`` turns and shifts; what is left after one or two of them is a turn about the
new z axis, ``Rz(t)``, which commutes with a joint on that axis and merges with the row that comes next. The origin of
the frame before a joint is the place that the model gives the joint, not the foot of a common normal, which may be far
away.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.elements import Body, Joint, Row, Variable

#: what counts as rounding, m or the sine of an angle
NONE = 1e-15


@dataclass(frozen=True)
class Screw:
    """A joint at the end of a fixed transform: ``before`` (4, 4) leads to a frame about whose z axis the joint
    ``turns``, or along which it slides, by ``drive``."""

    before: Array
    drive: Joint
    turns: bool


@dataclass(frozen=True)
class Constant:
    """A row of constants: rad and m."""

    theta: float
    d: float
    a: float
    epsilon: float


def axis_frame(axis: Array) -> tuple[Array, float]:
    """(A (3, 3), sign): a rotation whose z axis is ``sign`` times the unit vector ``axis`` (3,), and whose inverse is
    one turn about x and one about z, neither of them where none is needed."""
    x, y, z = axis
    across = math.hypot(x, y)
    if across < NONE:
        return np.eye(3), math.copysign(1.0, z)
    if y < 0.0 or (y == 0.0 and x < 0.0):
        across = -across
    side = np.array([y / across, -x / across, 0.0])
    return np.column_stack([side, np.cross(axis, side), axis]), 1.0


def along(amount: float, turns: bool) -> Array:
    """(4, 4) of a turn about z, rad, or a shift along it, m."""
    out = np.eye(4)
    if turns:
        c, s = math.cos(amount), math.sin(amount)
        out[:2, :2] = [[c, -s], [s, c]]
    else:
        out[2, 3] = amount
    return out


def decompose(transform: Array) -> tuple[list[Constant], float, float]:
    """(rows, t, s) with ``transform`` (4, 4) = rows Rz(t) Tz(s): at most two rows, none where z stays on its line."""
    R, (x, y, z) = transform[:3, :3], transform[:3, 3].tolist()
    across = math.hypot(R[0, 2], R[1, 2])
    if across < NONE and R[2, 2] > 0.0 and math.hypot(x, y) < NONE:
        return [], _tidy(math.atan2(R[1, 0], R[0, 0])), _tidy(z)
    if across < NONE:
        return _parallel(R, x, y, z)
    # Rz(theta) Rx(epsilon) takes z to (sin(theta) sin(epsilon), -cos(theta) sin(epsilon), cos(epsilon))
    sine = -across if R[1, 2] > 0.0 else across
    theta, epsilon = math.atan2(R[0, 2] / sine, -R[1, 2] / sine), math.atan2(sine, R[2, 2])
    cosine, height = math.cos(theta), math.sin(theta)
    aside = y * cosine - x * height
    if abs(aside) < NONE:
        return [_row(theta, z, x * cosine + y * height, epsilon)], _rest(R, theta, epsilon), 0.0
    ahead, length = _ahead(x, y)
    rows = [_row(ahead, z, length, 0.0), _row(theta - ahead, 0.0, 0.0, epsilon)]
    return rows, _rest(R, theta, epsilon), 0.0


def _parallel(R: Array, x: float, y: float, z: float) -> tuple[list[Constant], float, float]:
    """The same where the new z axis is parallel to the old one, or points the other way."""
    ahead, length = _ahead(x, y) if math.hypot(x, y) >= NONE else (0.0, 0.0)
    turn = math.atan2(R[1, 0], R[0, 0])
    if R[2, 2] > 0.0:
        return [_row(ahead, z, length, 0.0)], _tidy(_wrapped(turn - ahead)), 0.0
    return [_row(ahead, z, length, math.pi)], _tidy(_wrapped(ahead - turn)), 0.0


def _rest(R: Array, theta: float, epsilon: float) -> float:
    """t of Rz(theta) Rx(epsilon) Rz(t) = R, from what the first two leave of R: exact also where both are near 0."""
    c, s = math.cos(theta), math.sin(theta)
    first = c * R[0, 0] + s * R[1, 0]
    second = math.cos(epsilon) * (c * R[1, 0] - s * R[0, 0]) + math.sin(epsilon) * R[2, 0]
    return _tidy(math.atan2(second, first))


def _ahead(x: float, y: float) -> tuple[float, float]:
    """Heading and length of (x, y), the heading within a right angle of x."""
    length = math.copysign(math.hypot(x, y), x if x != 0.0 else y)
    return math.atan2(y / length, x / length), length


def _row(theta: float, d: float, a: float, epsilon: float) -> Constant:
    return Constant(_tidy(_wrapped(theta)), _tidy(d), _tidy(a), _tidy(epsilon))


def _wrapped(angle: float) -> float:
    return math.remainder(angle, math.tau)


def _tidy(value: float) -> float:
    """Rounding of what should be nothing, away."""
    return 0.0 if abs(value) < NONE else float(value)


@dataclass
class _Table:
    """Rows being written. ``theta`` and ``d`` wait for the row that they begin."""

    rows: list[Row] = field(default_factory=list)
    theta: Variable = 0.0
    d: Variable = 0.0

    def fixed(self, transform: Array) -> None:
        constants, turn, shift = decompose(transform)
        for row in constants:
            self.rows.append(Row(_plus(self.theta, row.theta), _plus(self.d, row.d), row.a, row.epsilon))
            self.theta, self.d = 0.0, 0.0
        self.theta, self.d = _plus(self.theta, turn), _plus(self.d, shift)

    def driven(self, drive: Joint, turns: bool) -> None:
        if isinstance(self.theta if turns else self.d, Joint):
            self.close()
        if turns:
            self.theta = _plus(drive, self.theta)
        else:
            self.d = _plus(drive, self.d)

    def close(self) -> None:
        self.rows.append(Row(self.theta, self.d))
        self.theta, self.d = 0.0, 0.0


def _plus(one: Variable, other: Variable) -> Variable:
    """Sum of two variables of which one at most is driven."""
    if isinstance(one, Joint):
        return replace(one, offset=_tidy(one.offset + float(other)))  # type: ignore[arg-type]
    if isinstance(other, Joint):
        return _plus(other, one)
    return _tidy(float(one) + float(other))  # type: ignore[arg-type]


def rows_of(screws: Sequence[Screw], after: Array, name: str, body: Body | None, inner: Sequence[str]) -> list[Row]:
    """Rows that lead through ``screws`` and then ``after`` (4, 4) to the frame ``name``, which carries ``body``. Frames
    on the way take their names from ``inner``, as far as needed (:func:`most_rows`)."""
    table = _Table()
    for screw in screws:
        table.fixed(screw.before)
        table.driven(screw.drive, screw.turns)
    table.fixed(after)
    if (table.theta, table.d) != (0.0, 0.0) or not table.rows:
        table.close()
    rows = [replace(row, name=between) for row, between in zip(table.rows[:-1], inner, strict=False)]
    return [*rows, replace(table.rows[-1], name=name, body=body)]


def most_rows(screws: Sequence[Screw]) -> int:
    """The most rows that :func:`rows_of` can make."""
    return 3 * len(screws) + 3
