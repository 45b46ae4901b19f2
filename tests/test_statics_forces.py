"""Contact forces within friction cones: equilibrium, optimality by independent certificates, what slips and tips."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.errors import SolveError
from statics_cases import FLAT, WHEELS, cast, left_over, on_slope, parts, rough

forces = bp.solve.contact_forces
UP = np.array([0.0, 0.0, 1.0])


# --- facts ----------------------------------------------------------------------------------------------------


def test_three_wheels_on_flat_ground() -> None:
    """The notes' loads: a quarter, a quarter, a half."""
    for objective in ("min_norm", "min_ratio"):
        got = forces(WHEELS, FLAT, [0.0, 0.0, 0.15], 10.0 * 9.81, 0.5, objective)
        assert got.status == "ok"
        assert np.abs(got.forces - 98.1 * np.outer([0.25, 0.25, 0.5], UP)).max() < 1e-12
        assert got.worst < 1e-12
    robot = bp.tri_wheel()
    assert {contact.name for contact in robot.contacts} >= {"fl.rim", "fr.rim", "r.rim"}


def test_one_contact_carries_all_or_nothing() -> None:
    got = forces([[0.3, 0.1, 0.0]], [[0.0, 0.0, 2.0]], [0.3, 0.1, 0.9], 7.0, 0.0)
    assert got.status == "ok"
    assert np.abs(got.forces - 7.0 * UP).max() < 1e-12
    over = forces([[0.3, 0.1, 0.0]], [UP], [0.3001, 0.1, 0.9], 7.0, 5.0)
    assert over.status == "tips_over"
    assert np.isinf(over.needed)
    assert np.all(np.isnan(over.forces))


@pytest.mark.parametrize("slope", [0.05, 0.3, 1.7])
def test_on_a_plane_the_friction_needed_is_the_slope(slope: float) -> None:
    points, normals, com = on_slope(slope)
    assert forces(points, normals, com, 50.0, slope * (1 + 1e-9)).status == "ok"
    assert forces(points, normals, com, 50.0, slope).status == "ok"
    slips = forces(points, normals, com, 50.0, slope * (1 - 1e-9))
    assert slips.status == "slips"
    assert slips.needed == pytest.approx(slope, rel=1e-12)
    assert f"{slope:.4g}" in slips.reason()
    best = forces(points, normals, com, 50.0, 2.0 * slope, "min_ratio")
    assert best.worst == pytest.approx(slope, rel=1e-12)
    # with this ratio everywhere every force is along the weight
    assert np.abs(best.forces[:, :2]).max() < 1e-10


def test_tips_over_where_the_weight_leaves_the_support() -> None:
    inside, edge, outside = (forces(WHEELS, FLAT, [x, 0.0, 0.15], 10.0, 0.8) for x in (0.59, 0.6, 0.61))
    assert inside.status == edge.status == "ok"
    assert outside.status == "tips_over"
    assert np.abs(edge.forces - [5.0 * UP, 5.0 * UP, 0.0 * UP]).max() < 1e-11
    with pytest.raises(SolveError, match="tips_over"):
        outside.raise_if_failed()


def test_a_push_is_held_by_friction() -> None:
    """A further force is part of the load: with it the needed ratio is its share of the weight."""
    got = forces(WHEELS, FLAT, [0.0, 0.0, 0.0], 10.0, 0.31, "min_ratio", wrench=[3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert got.worst == pytest.approx(0.3, abs=1e-12)
    assert got.forces.sum(axis=0) == pytest.approx([-3.0, 0.0, 10.0], abs=1e-11)
    short = forces(WHEELS, FLAT, [0.0, 0.0, 0.0], 10.0, 0.29, wrench=[3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert short.status == "slips"
    assert short.needed == pytest.approx(0.3, abs=1e-12)


def test_weight_as_a_force_and_as_newtons() -> None:
    points, normals, com = rough(3)
    one = forces(points, normals, com, 12.0, 0.9)
    other = forces(points, normals, com, [0.0, 0.0, -12.0], 0.9)
    third = forces(points, normals, com, 0.0, 0.9, wrench=[0.0, 0.0, -12.0, 0.0, 0.0, 0.0])
    assert one.status == "ok"
    assert np.array_equal(one.forces, other.forces)
    assert np.abs(one.forces - third.forces).max() < 1e-12


def test_without_load_there_are_no_forces() -> None:
    for objective in ("min_norm", "min_ratio"):
        got = forces(WHEELS, FLAT, [9.0, 0.0, 0.15], 0.0, 0.0, objective)
        assert got.status == "ok"
        assert not got.forces.any()
        assert got.worst == 0.0


# --- certificates ---------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 8), st.floats(0.05, 1.5))
def test_smallest_norm_by_its_dual(seed: int, k: int, mu: float) -> None:
    """sum |F|^2 of any forces is at least 2 y.w - |P(y)|^2, P(y) the forces nearest to a rigid velocity field y within
    the cones (weak duality): where the two agree nothing is smaller."""
    points, normals, com = cast(seed, k)
    got = forces(points, normals, com, 20.0, mu)
    if got.status != "ok":
        needed = bp.solve.required_friction(points, normals, com)
        assert needed.mu > mu * (1 - 1e-10)
        return
    normal, tangent = parts(got.forces, normals)
    assert left_over(points, com, got.forces, 20.0) < 1e-12
    assert np.all(tangent <= mu * normal + 1e-12 * 20.0)
    # the rigid velocity field of which the forces are the nearest in their cones, by least squares over those that move
    F = got.forces
    A = np.concatenate([np.tile(np.eye(3), (k, 1, 1)), -np.cross(np.eye(3)[None], (points - com)[:, None, :])], axis=2)
    assert optimal(A, F, normals, mu)


def optimal(A: np.ndarray, F: np.ndarray, normals: np.ndarray, mu: float) -> bool:
    """Whether a field z_i = A_i y exists with F - z in the normal cone at F: linear conditions on y with signs, found
    by linear programming on the worst violation."""
    from scipy.optimize import linprog

    k, scale = len(F), np.abs(F).max()
    equal, right, upper, bound = [], [], [], []
    for i in range(k):
        n = normals[i] / np.linalg.norm(normals[i])
        fn = F[i] @ n
        t = F[i] - fn * n
        r = np.linalg.norm(t)
        if fn < 1e-9 * scale:  # nothing: z in the polar cone, by 64 of its edges
            p = np.linalg.svd(n[None])[2][1:]
            for angle in np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False):
                edge = n + mu * (np.cos(angle) * p[0] + np.sin(angle) * p[1])
                upper.append(edge @ A[i])
                bound.append(0.0)
            continue
        if r < mu * fn - 1e-9 * scale:  # inside: z is F
            equal.extend(A[i])
            right.extend(F[i])
            continue
        out = t / r - mu * n  # on the edge: z is F and something outwards
        side, along = np.cross(n, t / r), F[i] / np.linalg.norm(F[i])
        equal.extend([side @ A[i], along @ A[i]])
        right.extend([side @ F[i], along @ F[i]])
        upper.append(-(out @ A[i]))
        bound.append(-(out @ F[i]))
    tolerance = 1e-8 * scale
    rows = [*upper, *equal, *(-np.array(equal) if equal else [])]
    limits = [*bound, *right, *(-np.array(right) if right else [])]
    slack = -np.ones((len(rows), 1))
    answer = linprog(
        np.eye(7)[6], np.concatenate([np.array(rows), slack], axis=1), np.array(limits) / scale,
        bounds=[(None, None)] * 6 + [(0.0, None)],
    )  # fmt: skip
    return bool(answer.status == 0 and answer.fun * scale < tolerance)
