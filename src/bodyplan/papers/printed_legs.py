"""Equations (1)-(13) of paper *legs* as printed, in numbers, and one leg of its Table 1."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot import Joint, Robot, Row

#: m: a_0 .. a_3, d_0, d_2 of (12), d_6
A, D_0, D_2, D_6 = (0.2, 0.06, 0.24, 0.25), 0.05, 0.03, -0.02
QUARTER = 0.5 * np.pi


def shoulder_to_contact(theta_0: float) -> Robot:
    """Table 1: from the body to the contact, joints theta_1 .. theta_6."""
    return Robot.from_rows(
        {
            "leg": [
                Row(theta=theta_0, d=D_0, a=A[0], name="SR"),
                Row(theta=Joint("theta_1"), a=A[1], epsilon=QUARTER, name="HP"),
                Row(theta=Joint("theta_2"), a=A[2], name="KE"),
                Row(theta=Joint("theta_3"), a=A[3], name="AE"),
                Row(theta=Joint("theta_4"), epsilon=QUARTER, name="HL"),
                Row(theta=Joint("theta_5", offset=QUARTER), epsilon=-QUARTER, name="SE"),
                Row(theta=Joint("theta_6", offset=QUARTER), d=D_6, name="CT"),
            ]
        }
    )


def adjoint(R: Array, p: Array) -> Array:
    """(6, 6): the body-fixed twist of a frame at ``p``, turned by ``R``, on a body with a body-fixed twist."""
    skew = np.array([[0.0, -p[2], p[1]], [p[2], 0.0, -p[0]], [-p[1], p[0], 0.0]])
    return np.block([[R.T, -R.T @ skew], [np.zeros((3, 3)), R.T]])


def row(theta: float, d: float, a: float, epsilon: float) -> tuple[Array, Array]:
    """D (6, 6) and E (6, 4) by (2), (3) as printed."""
    (c, s), (ce, se) = (np.cos(theta), np.sin(theta)), (np.cos(epsilon), np.sin(epsilon))
    R = np.array([[c, s, 0.0], [-ce * s, ce * c, se], [se * s, -se * c, ce]])
    S = np.array([[0.0, d, -a * s], [-d, 0.0, a * c], [a * s, -a * c, 0.0]])
    upper = np.array([[0.0, 0.0, 1.0, 0.0], [a * ce, se, 0.0, 0.0], [-a * se, ce, 0.0, 0.0]])
    lower = np.array([[0.0, 0.0, 0.0, 1.0], [se, 0.0, 0.0, 0.0], [ce, 0.0, 0.0, 0.0]])
    return np.block([[R, R @ S], [np.zeros((3, 3)), R]]), np.vstack([upper, lower])


def row_truth(theta: float, d: float, a: float, epsilon: float) -> tuple[Array, Array]:
    """The same by differentiating the product Rz(theta) Tz(d) Tx(a) Rx(epsilon) with complex steps."""

    def transform(x: Any) -> Any:
        (c, s), (ce, se) = (np.cos(x[0]), np.sin(x[0])), (np.cos(x[3]), np.sin(x[3]))
        Rz = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=complex)
        Rx = np.array([[1, 0, 0, 0], [0, ce, -se, 0], [0, se, ce, 0], [0, 0, 0, 1]], dtype=complex)
        T = np.eye(4, dtype=complex)
        T[0, 3], T[2, 3] = x[2], x[1]
        return Rz @ T @ Rx

    x = np.array([theta, d, a, epsilon], dtype=complex)
    T = transform(x).real
    columns = []
    for k in range(4):
        moved = transform(x + 1e-30j * np.eye(4)[k]).imag / 1e-30
        rate = np.linalg.inv(T) @ moved
        columns.append([*rate[:3, 3], rate[2, 1], rate[0, 2], rate[1, 0]])
    return adjoint(T[:3, :3], T[:3, 3]), np.array(columns).T


def _blocks(turn: Any, corner: Any) -> Array:
    return np.block([[np.array(turn, dtype=float), np.array(corner, dtype=float)], [np.zeros((3, 3)), np.array(turn)]])


def _shoulder(theta: Sequence[float]) -> tuple[Array, Array | None]:
    c, s, d, a = np.cos(theta[0]), np.sin(theta[0]), D_0, A[0]
    turn = [[c, s, 0], [-s, c, 0], [0, 0, 1]]
    return _blocks(turn, [[-d * s, d * c, 0], [-d * c, -d * s, a], [a * s, -a * c, 0]]), None


def _hip(theta: Sequence[float]) -> tuple[Array, Array | None]:
    c, s = np.cos(theta[1] - theta[0]), np.sin(theta[1] - theta[0])
    return _blocks([[c, s, 0], [-s, c, 0], [0, 0, 1]], np.zeros((3, 3))), np.array([0, 0, 0, 0, 0, 1.0])


def _knee(theta: Sequence[float]) -> tuple[Array, Array | None]:
    c, s, d, a = np.cos(theta[2]), np.sin(theta[2]), D_2, A[2]
    corner = [[d * c, d * s, 0], [-d * s, d * c, a], [-a * c, -a * s, 0]]
    return _blocks([[s, -c, 0], [c, s, 0], [0, 0, 1]], corner), np.array([0, a, 0, 0, 0, 1.0])


def _ankle(theta: Sequence[float]) -> tuple[Array, Array | None]:
    c, s, a = np.cos(theta[3]), np.sin(theta[3]), A[3]
    corner = [[0, 0, 0], [0, 0, a], [a * c, -a * s, 0]]
    return _blocks([[c, s, 0], [-s, c, 0], [0, 0, 1]], corner), np.array([0, a, 0, 0, 0, 1.0])


#: number -> (theta_0 ...) -> (matrix (6, 6), column of the rate (6,) or None)
EQUATIONS: dict[int, Callable[[Sequence[float]], tuple[Array, Array | None]]] = {
    10: _shoulder,
    11: _hip,
    12: _knee,
    13: _ankle,
}
