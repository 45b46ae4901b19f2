"""`velocity_model` of random D-H tables against the paper's recursion typed anew, and against differences of poses.

Tables have 3-6 legs of 3-7 rows, revolute and prismatic, and go through CSV files. Nothing here uses the library's
formulas: D and E are eqs. (1)-(3) of paper *legs* as printed, the composite is the corrected order of notes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.robot import Joint, Robot, Row
from bodyplan.spatial import matrix_from_quaternion

VARIABLES = ("theta", "d", "a", "epsilon")


def printed_D(theta: float, d: float, a: float, epsilon: float) -> np.ndarray:
    """[R, R S; 0, R] with R and S of eq. (2)."""
    c, s, ce, se = np.cos(theta), np.sin(theta), np.cos(epsilon), np.sin(epsilon)
    R = np.array([[c, s, 0], [-ce * s, ce * c, se], [se * s, -se * c, ce]])
    S = np.array([[0, d, -a * s], [-d, 0, a * c], [a * s, -a * c, 0]])
    return np.block([[R, R @ S], [np.zeros((3, 3)), R]])


def printed_E(a: float, epsilon: float) -> np.ndarray:
    """[A; B] of eq. (3), columns theta, d, a, epsilon."""
    ce, se = np.cos(epsilon), np.sin(epsilon)
    A = [[0, 0, 1, 0], [a * ce, se, 0, 0], [-a * se, ce, 0, 0]]
    B = [[0, 0, 0, 1], [se, 0, 0, 0], [ce, 0, 0, 0]]
    return np.array([*A, *B])


def recursion(legs: dict[str, list[dict[str, Any]]], q: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """P = D_n-1 ... D_0 and Q = [D_n-1 ... D_1 E_0 | ... | E_n-1] of all legs; a joint has one column."""
    column = {name: i for i, name in enumerate(q)}
    P, Q = [], []
    for rows in legs.values():
        carried, columns = np.eye(6), np.zeros((6, len(q)))
        for row in rows:
            value = {k: q[v[0]] * v[1] + v[2] if isinstance(v, tuple) else v for k, v in row.items()}
            D, E = printed_D(**value), printed_E(value["a"], value["epsilon"])
            carried, columns = D @ carried, D @ columns
            for k, variable in enumerate(VARIABLES):
                if isinstance(row[variable], tuple):
                    name, scale, _ = row[variable]
                    columns[:, column[name]] += scale * E[:, k]
        P.append(carried)
        Q.append(columns)
    return np.vstack(P), np.vstack(Q)


def differences(robot: Robot, q: np.ndarray, h: float = 1e-6) -> tuple[np.ndarray, np.ndarray]:
    """P and Q from central differences of the poses that forward kinematics gives."""

    def twists(before: np.ndarray, at: np.ndarray, after: np.ndarray) -> np.ndarray:
        R = matrix_from_quaternion(at[..., 3:])
        v = np.einsum("mji,mj->mi", R, (after - before)[..., :3]) / (2 * h)
        W = np.einsum(
            "mji,mjk->mik", R, matrix_from_quaternion(after[..., 3:]) - matrix_from_quaternion(before[..., 3:])
        )
        return np.concatenate([v, np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=-1) / (2 * h)], axis=-1).reshape(
            -1
        )

    def feet(q: np.ndarray, base: np.ndarray) -> np.ndarray:
        return robot.forward(q, base).array[list(robot.ends)]

    rest = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    P, Q = np.empty((6 * len(robot.chains), 6)), np.empty((6 * len(robot.chains), robot.n))
    for k in range(6):
        moved = []
        for step in (-h, h):
            base = rest.copy()
            if k < 3:
                base[k] = step
            else:
                base[3], base[k + 1] = np.cos(step / 2), np.sin(step / 2)
            moved.append(feet(q, base))
        P[:, k] = twists(moved[0], feet(q, rest), moved[1])
    for k in range(robot.n):
        step = h * np.eye(robot.n)[k]
        Q[:, k] = twists(feet(q - step, rest), feet(q, rest), feet(q + step, rest))
    return P, Q


def random_table(rng: np.random.Generator) -> dict[str, list[dict[str, Any]]]:
    """Legs as lists of rows; a driven variable is (joint, scale, offset)."""
    legs: dict[str, list[dict[str, Any]]] = {}
    for leg in range(rng.integers(3, 7)):
        rows: list[dict[str, Any]] = []
        for i in range(rng.integers(3, 8)):
            row: dict[str, Any] = {
                "theta": float(rng.uniform(-3, 3)),
                "d": rng.uniform(-0.3, 0.3),
                "a": rng.uniform(-0.3, 0.3),
                "epsilon": rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(-3, 3)]),
            }
            for variable, share in (("theta", 0.7), ("d", 0.25), ("a", 0.1), ("epsilon", 0.1)):
                if rng.random() < share:
                    scale = float(rng.choice([1.0, -1.0, 0.5]))
                    row[variable] = (f"leg{leg}.{variable}{i}", scale, row[variable] if rng.random() < 0.5 else 0.0)
            rows.append(row)
        if not any(isinstance(v, tuple) for row in rows for v in row.values()):
            rows[0]["theta"] = (f"leg{leg}.theta0", 1.0, 0.0)
        legs[f"leg{leg}"] = rows
    return legs


def write_table(legs: dict[str, list[dict[str, Any]]], path: Path) -> None:
    """The table as a user writes it: degrees and millimetres, drives as text."""

    def cell(value: Any, to_unit: float) -> str:
        if not isinstance(value, tuple):
            return repr(float(value * to_unit))
        name, scale, offset = value
        driven = f"{scale!r}*{name}" if scale > 0 else f"-{-scale!r}*{name}"
        return driven if offset == 0.0 else f"{driven} {'-' if offset < 0 else '+'} {float(abs(offset) * to_unit)!r}"

    units = {"theta": 180 / np.pi, "epsilon": 180 / np.pi, "d": 1e3, "a": 1e3}
    lines = ["chain,from,to,theta [deg],d [mm],a [mm],epsilon [deg]"]
    for leg, rows in legs.items():
        for i, row in enumerate(rows):
            start = f"{leg}.f{i - 1}" if i else "BY"
            cells = [cell(row[variable], units[variable]) for variable in VARIABLES]
            lines.append(",".join([leg, start, f"{leg}.f{i}", *cells]))
    path.write_text("\n".join(lines) + "\n")


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**32 - 1))
def test_random_tables(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    legs = random_table(rng)
    write_table(legs, tmp_path / "table.csv")
    robot = Robot.from_table(tmp_path / "table.csv")
    names = [v[0] for rows in legs.values() for row in rows for v in row.values() if isinstance(v, tuple)]
    assert robot.joints == tuple(names)
    q = rng.uniform(-2, 2, robot.n)
    for ours, theirs in zip(robot.velocity_model(q), recursion(legs, dict(zip(names, q, strict=True))), strict=True):
        assert np.abs(ours - theirs).max() < 1e-12
    for ours, theirs in zip(robot.velocity_model(q), differences(robot, q), strict=True):
        assert np.abs(ours - theirs).max() < 2e-8


@pytest.mark.parametrize("make", [bp.silo4, bp.hexapod, lambda: bp.silo4(passive=True)])
def test_ready_walkers(make: Any) -> None:
    robot = make()
    legs = {
        chain.name: [
            {
                v: (x.name, x.scale, x.offset) if isinstance(x := getattr(row, v), Joint) else x
                for v in VARIABLES
                if isinstance(row, Row)
            }
            for row in chain.elements
        ]
        for chain in robot.chains
    }
    q = np.random.default_rng(2).uniform(-2, 2, robot.n)
    for ours, theirs in zip(
        robot.velocity_model(q), recursion(legs, dict(zip(robot.joints, q, strict=True))), strict=True
    ):
        assert np.abs(ours - theirs).max() < 1e-14
    for ours, theirs in zip(robot.velocity_model(q), differences(robot, q), strict=True):
        assert np.abs(ours - theirs).max() < 1e-8


@pytest.mark.parametrize("shape", [(), (0,), (1,), (17,), (2, 3), (2, 0, 3)])
def test_batches_are_their_members(shape: tuple[int, ...]) -> None:
    robot = bp.silo4(passive=True)
    q = np.random.default_rng(3).uniform(-2, 2, (*shape, robot.n))
    P, Q = robot.velocity_model(q)
    assert (P.shape, Q.shape) == ((*shape, 24, 6), (*shape, 24, 24))
    at = robot.ends_and_jacobians(q)
    assert np.array_equal(at.carried(), P)
    assert np.array_equal(at.stacked(), Q)
    for index in np.ndindex(*shape):
        one = robot.velocity_model(q[index])
        assert np.abs(one[0] - P[index]).max() < 4e-15
        assert np.abs(one[1] - Q[index]).max() < 4e-15


def test_results_belong_to_the_caller() -> None:
    """Nothing is shared between calls: a caller may change what it got."""
    robot, q = bp.silo4(), np.full(12, 0.3)
    P, Q = robot.velocity_model(q)
    kept = P.copy(), Q.copy()
    again = robot.velocity_model(-q)
    again[0][:], again[1][:] = 7.0, 7.0
    assert np.array_equal(P, kept[0])
    assert np.array_equal(Q, kept[1])
    P[:] = 0.0
    assert np.array_equal(robot.velocity_model(q)[0], kept[0])


def test_a_foot_that_stands_still() -> None:
    """Twists in use: with joint rates that cancel the body's motion at a foot, its pose stays to second order."""
    robot = bp.silo4(passive=True)
    rng = np.random.default_rng(4)
    q = rng.uniform(-0.5, 0.5, robot.n) + np.tile([0, 0, -1.2, 0, 0, 0], 4)
    P, Q = robot.velocity_model(q)
    V = rng.normal(size=6)
    rates = -np.linalg.solve(Q, P @ V)
    drift = []
    for h in (1e-3, 1e-4):
        base = bp.spatial.exp(h * V)
        feet = robot.forward(q + h * rates, base).positions[list(robot.ends)]
        drift.append(np.abs(feet - robot.forward(q).positions[list(robot.ends)]).max())
    assert drift[0] < 1e-4
    assert drift[0] / drift[1] == pytest.approx(100.0, rel=0.05)
