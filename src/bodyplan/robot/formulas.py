"""The formulas of one element, entry by entry: written once, for floats, arrays and SymPy expressions alike.

Paper *legs* eqs. (1)-(4) for a row of the extended D-H table, paper *acm* eq. (1) for an arc. A scalar is anything
that adds and multiplies; sines and cosines, and an arc's functions of its angle, come from the caller.
"""

from __future__ import annotations

from typing import Any

Scalar = Any
Entries = list[list[Scalar]]


def row_pose(c: Scalar, s: Scalar, d: Scalar, a: Scalar, ce: Scalar, se: Scalar) -> tuple[list[Scalar], Entries]:
    """(position (3,), rotation (3, 3)) of ``Rz(theta) Tz(d) Tx(a) Rx(epsilon)``; c, s: cosine and sine of theta,
    ce, se: those of epsilon."""
    return [a * c, a * s, d], [[c, -s * ce, s * se], [s, c * ce, -c * se], [0, se, ce]]


def row_velocity(c: Scalar, s: Scalar, d: Scalar, a: Scalar, ce: Scalar, se: Scalar) -> tuple[Entries, Entries]:
    """(D (6, 6), E (6, 4)) of paper *legs* eqs. (2), (3), for body-fixed twists; columns of E: theta, d, a, epsilon."""
    turn = [[c, s, 0], [-s * ce, c * ce, se], [s * se, -c * se, ce]]
    carried = [
        [-d * s, d * c, 0],
        [a * s * se - d * c * ce, -a * c * se - d * s * ce, a * ce],
        [a * s * ce + d * c * se, d * s * se - a * c * ce, -a * se],
    ]
    A = [[0, 0, 1, 0], [a * ce, se, 0, 0], [-a * se, ce, 0, 0]]
    B = [[0, 0, 0, 1], [se, 0, 0, 0], [ce, 0, 0, 0]]
    return _blocks(turn, carried), A + B


def arc_pose(length: Scalar, p: Scalar, y: Scalar, A: Scalar, B: Scalar) -> tuple[list[Scalar], Entries]:
    """(position (3,), rotation (3, 3)) at the end of an arc with pitch p and yaw y: for phi = (0, p, y) the end point
    ``length`` times the integral of exp(u [phi]) e_x over u in [0, 1], the rotation I + A [phi] + B [phi]^2. A and B
    as in :mod:`bodyplan.spatial.coefficients`, at the angle |phi|."""
    rotation = [
        [1 - B * (p * p + y * y), -A * y, A * p],
        [A * y, 1 - B * y * y, B * p * y],
        [-A * p, B * p * y, 1 - B * p * p],
    ]
    return [length * A, length * B * y, -length * B * p], rotation


def arc_velocity(length: Scalar, p: Scalar, y: Scalar, A: Scalar, B: Scalar, C: Scalar) -> tuple[Entries, Entries]:
    """(D (6, 6), E (6, 2)) of an arc; columns of E: pitch, yaw. A, B, C at the angle |phi|."""
    position, R = arc_pose(length, p, y, A, B)
    # v: the slopes of the end point turned into the end frame; A^2 = 2 B - B^2 |phi|^2 cancels all that is not linear
    v = [[length * C * p, length * C * y], [0, length * B], [-length * B, 0]]
    # omega: columns 2 and 3 of the transposed left Jacobian I - B [phi] + C [phi]^2
    omega = [[B * y, -B * p], [1 - C * y * y, C * p * y], [C * p * y, 1 - C * p * p]]
    axes = [[R[k][i] for k in range(3)] for i in range(3)]
    return _blocks(axes, [cross(position, axis) for axis in axes]), v + omega


def cross(u: list[Scalar], v: list[Scalar]) -> list[Scalar]:
    """u x v."""
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def _blocks(turn: Entries, carried: Entries) -> Entries:
    """[turn, carried; 0, turn]: rows are the new axes seen from the previous frame, and position x axis."""
    return [[*t, *c] for t, c in zip(turn, carried, strict=True)] + [[0, 0, 0, *t] for t in turn]
