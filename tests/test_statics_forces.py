"""Contact forces within friction cones: facts, certificates of the smallest sum of squares, another optimiser."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize

import bodyplan as bp
from bodyplan.errors import SolveError
from statics_cases import FLAT, UP, WHEELS, cast, equations, excess, left_over, nearest, on_slope, parts, rough, unit

forces = bp.solve.contact_forces


# --- facts ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("objective", ["min_norm", "min_ratio"])
def test_three_wheels_on_flat_ground(objective: str) -> None:
    """The notes' loads: a quarter, a quarter, a half."""
    robot = bp.tri_wheel()
    frames = robot.forward(np.zeros(robot.n), [0.0, 0.0, 0.3, 1.0, 0.0, 0.0, 0.0])
    names = ("fl", "fr", "r")
    points = np.array([frames[f"{name}.axle"][:2] for name in names])
    assert np.abs(points - WHEELS[:, :2]).max() < 1e-12
    got = forces(WHEELS, FLAT, [0.0, 0.0, 0.3], 10.0 * 9.81, 0.5, objective)
    assert got.status == "ok"
    assert got.reason() == ""
    assert np.abs(got.forces - 98.1 * np.outer([0.25, 0.25, 0.5], UP)).max() < 1e-12
    assert got.worst < 1e-14
    assert got.raise_if_failed() is got


def test_one_contact_carries_all_or_nothing() -> None:
    got = forces([[0.3, 0.1, 0.0]], [[0.0, 0.0, 2.0]], [0.3, 0.1, 0.9], 7.0, 0.0)
    assert got.status == "ok"
    assert np.abs(got.forces - 7.0 * UP).max() < 1e-12
    over = forces([[0.3, 0.1, 0.0]], [UP], [0.3001, 0.1, 0.9], 7.0, 5.0)
    assert over.status == "tips_over"
    assert np.isinf(over.needed)
    assert np.all(np.isnan(over.forces))
    leaning = forces([[0.3, 0.1, 0.0]], [[0.3, 0.0, 1.0]], [0.3, 0.1, 0.9], 7.0, 0.2)
    assert leaning.status == "slips"
    assert leaning.needed == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize("slope", [0.05, 0.3, 1.7])
def test_on_a_plane_the_friction_needed_is_the_slope(slope: float) -> None:
    points, normals, com = on_slope(slope)
    assert forces(points, normals, com, 50.0, slope * (1 + 1e-9)).status == "ok"
    slips = forces(points, normals, com, 50.0, slope * (1 - 1e-9))
    assert slips.status == "slips"
    assert slips.needed == pytest.approx(slope, rel=1e-12)
    assert f"{slope:.4g}" in slips.reason()
    # with just this ratio everywhere every force is along the weight, and the moments say how large
    just = forces(points, normals, com, 50.0, slope)
    best = forces(points, normals, com, 50.0, 2.0 * slope, "min_ratio")
    for got in (just, best):
        assert got.worst == pytest.approx(slope, rel=1e-12)
        assert np.abs(got.forces - 50.0 * np.outer([0.3, 0.2, 0.5], UP)).max() < 1e-9


def test_tips_over_where_the_weight_leaves_the_support() -> None:
    inside, edge, outside = (forces(WHEELS, FLAT, [x, 0.0, 0.15], 10.0, 0.8) for x in (0.59, 0.6, 0.61))
    assert inside.status == edge.status == "ok"
    assert outside.status == "tips_over"
    assert "whatever" in outside.reason()
    assert np.abs(edge.forces - [5.0 * UP, 5.0 * UP, 0.0 * UP]).max() < 1e-12
    corner = forces(WHEELS, FLAT, [-0.6, 0.0, 0.15], 10.0, 0.0)
    assert np.abs(corner.forces - [0.0 * UP, 0.0 * UP, 10.0 * UP]).max() < 1e-12
    assert corner.worst == 0.0
    with pytest.raises(SolveError, match="tips_over") as caught:
        forces(WHEELS, FLAT, [[0.0, 0.0, 0.1], [0.61, 0.0, 0.15]], 10.0, 0.8).raise_if_failed()
    assert caught.value.index == 1


@pytest.mark.parametrize("over", ["edge", "corner"])
@pytest.mark.parametrize("slope", [0.2, 0.9])
def test_on_a_slope_over_an_edge(slope: float, over: str) -> None:
    """What cannot carry anything is in the way of no proof."""
    points, normals, _ = on_slope(slope)
    share = np.array([0.3, 0.7, 0.0]) if over == "edge" else np.array([0.0, 1.0, 0.0])
    com = points.T @ share + 0.2 * UP
    best = forces(points, normals, com, 10.0, 2.0 * slope, "min_ratio")
    assert best.status == "ok"
    assert np.abs(best.forces - 10.0 * np.outer(share, UP)).max() < 1e-9
    small = forces(points, normals, com, 10.0, 2.0 * slope)
    assert small.status == "ok"
    assert np.abs(small.forces[share == 0.0]).max() < 1e-9
    assert left_over(points, com, small.forces, 10.0) < 1e-12


def test_a_push_is_held_by_friction() -> None:
    """A further force is part of the load: with it the needed ratio is its share of the weight."""
    push = [3.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    got = forces(WHEELS, FLAT, [0.0, 0.0, 0.0], 10.0, 0.31, "min_ratio", wrench=push)
    assert got.worst == pytest.approx(0.3, abs=1e-12)
    assert got.forces.sum(axis=0) == pytest.approx([-3.0, 0.0, 10.0], abs=1e-11)
    short = forces(WHEELS, FLAT, [0.0, 0.0, 0.0], 10.0, 0.29, wrench=push)
    assert short.status == "slips"
    assert short.needed == pytest.approx(0.3, abs=1e-12)


def test_a_moment_moves_the_loads() -> None:
    """A moment about y of the weight times 0.3 m acts as a centre of mass 0.3 m further ahead."""
    turned = forces(WHEELS, FLAT, [0.0, 0.0, 0.2], 10.0, 0.5, wrench=[0.0, 0.0, 0.0, 0.0, 3.0, 0.0])
    moved = forces(WHEELS, FLAT, [0.3, 0.0, 0.2], 10.0, 0.5)
    assert np.abs(turned.forces - moved.forces).max() < 1e-12


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


def test_between_two_walls() -> None:
    """Squeezing: the smallest normal force is that whose friction carries half of the weight."""
    points, normals = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]), np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    got = forces(points, normals, [0.0, 0.0, 0.0], 6.0, 0.25)
    assert np.abs(got.forces - [[0.0, -12.0, 3.0], [0.0, 12.0, 3.0]]).max() < 1e-10
    assert forces(points, normals, [0.0, 0.0, 0.0], 6.0, 0.0).status == "slips"
    endless = forces(points, normals, [0.0, 0.0, 0.0], 6.0, 0.25, "min_ratio")
    assert endless.status == "not_converged"
    assert "without bound" in endless.reason()


# --- the smallest ---------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 8), st.floats(0.05, 1.5))
def test_the_smallest_sum_of_squares_by_its_dual(seed: int, k: int, mu: float) -> None:
    """Weak duality: whatever the twist y, sum F^2 >= 2 y . load - |P(A^T y)|^2 for all forces in equilibrium, with P(z)
    the forces in the cones nearest to z. A twist with which both sides agree proves that nothing is smaller."""
    points, normals, com = cast(seed, k)
    got = forces(points, normals, com, 1.0, mu)
    assume(got.status == "ok")
    F = got.forces
    assert left_over(points, com, F, 1.0) < 1e-12
    assert excess(F, normals, mu) < 1e-12
    needed = float(bp.solve.required_friction(points, normals, com))
    assume(mu > needed * (1.0 + 1e-4))  # nearer to it the twist grows without bound
    A = equations(points, com)
    y = twist(A, F, normals, mu)
    z = (A.T @ y).reshape(k, 3)
    dual = 2.0 * y[2] - np.sum(nearest(z, normals, mu) ** 2)
    assert np.sum(F**2) - dual < 1e-7 * np.sum(F**2)
    # of two points that prove each other so the distance squared is at most that gap; P(z) also is F to rounding
    assert np.abs(nearest(z, normals, mu) - F).max() < 1e-7 * (1.0 + np.abs(y).max())


def twist(A: np.ndarray, F: np.ndarray, normals: np.ndarray, mu: float) -> np.ndarray:
    """The y whose A^T y has F as its nearest point within the cones, by linear programming on the worst miss."""
    rows: list[np.ndarray] = []
    limit: list[float] = []

    def within(row: np.ndarray, value: float) -> None:
        rows.append(row)
        limit.append(value)

    def equal(row: np.ndarray, value: float) -> None:
        within(row, value)
        within(-row, -value)

    normal, tangent = parts(F, normals)
    scale = np.abs(F).max()
    for i, n in enumerate(unit(normals)):
        block = A[:, 3 * i : 3 * i + 3]
        r = np.linalg.norm(tangent[i])
        if np.abs(F[i]).max() < 1e-11 * scale:  # no force: A^T y against all of the cone
            first, second = np.linalg.svd(n[None])[2][1:]
            for a in np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False):
                within(block @ (n + mu * (np.cos(a) * first + np.sin(a) * second)), 0.0)
        elif r < mu * normal[i] - 1e-9 * scale:  # inside
            for j in range(3):
                equal(block[:, j], F[i, j])
        else:  # on the edge: F and something outwards
            way = tangent[i] / r
            for direction in (np.cross(n, way), F[i] / np.linalg.norm(F[i])):
                equal(block @ direction, direction @ F[i])
            outward = way - mu * n
            within(-(block @ outward), -outward @ F[i])
    table = np.concatenate([np.array(rows), -np.ones((len(rows), 1))], axis=1)
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    free = [(None, None)] * 6 + [(0.0, None)]
    return np.asarray(linprog(np.eye(7)[6], table, np.array(limit), bounds=free, options=options).x[:6])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("k", [2, 3, 4])
def test_the_smallest_sum_of_squares_by_another_optimiser(seed: int, k: int) -> None:
    points, normals, com = rough(seed, k)
    if k == 2:
        com = points.T @ [0.4, 0.6] + 0.3 * UP
    needed = bp.solve.required_friction(points, normals, com)
    assert needed.status == "ok"
    mu = 1.05 * needed.mu
    got = forces(points, normals, com, 1.0, mu)
    A = equations(points, com)
    # steps within the equations, so that these hold: the rest is a problem without them
    free = np.linalg.svd(A)[2][np.linalg.matrix_rank(A) :].T

    def at(v: np.ndarray) -> np.ndarray:
        return (needed.forces.ravel() + free @ v).reshape(k, 3)

    def room(v: np.ndarray) -> np.ndarray:
        normal, tangent = parts(at(v), normals)
        return np.concatenate([(mu * normal) ** 2 - np.sum(tangent**2, axis=1), normal])

    other = minimize(
        lambda v: np.sum(at(v) ** 2),
        np.zeros(free.shape[1]),
        jac=lambda v: 2.0 * free.T @ at(v).ravel(),
        constraints={"type": "ineq", "fun": room},
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-15},
    )
    assert np.abs(at(other.x) - got.forces).max() < 1e-6
    assert np.sum(got.forces**2) <= other.fun * (1.0 + 1e-9)


def test_where_friction_holds_nothing_back_it_is_the_pseudo_inverse() -> None:
    points, normals, com = rough(1, 5)
    got = forces(points, normals, com, 30.0, 5.0)
    want = np.linalg.pinv(equations(points, com)) @ [0.0, 0.0, 30.0, 0.0, 0.0, 0.0]
    assert np.abs(got.forces.ravel() - want).max() < 1e-12


@pytest.mark.parametrize("k", [3, 4, 6])
def test_the_least_worst_ratio(k: int) -> None:
    for seed in range(5):
        points, normals, com = rough(seed, k)
        needed = bp.solve.required_friction(points, normals, com)
        got = forces(points, normals, com, 3.0, 1.0, "min_ratio")
        assert got.status == "ok"
        assert got.worst == pytest.approx(needed.mu, rel=1e-11)
        assert np.abs(got.forces - 3.0 * needed.forces).max() < 1e-9
        assert left_over(points, com, got.forces, 3.0) < 1e-12
        # of all with this ratio the smallest: also where only this much friction is given
        just = forces(points, normals, com, 3.0, float(needed.mu))
        assert np.abs(just.forces - got.forces).max() < 1e-9
        assert np.sum(forces(points, normals, com, 3.0, 1.0).forces ** 2) <= np.sum(got.forces**2) * (1 + 1e-12)
