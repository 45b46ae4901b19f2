"""The least friction: the slope of a plane, proofs from both sides, what has none or needs forces without bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import bodyplan as bp
from bodyplan.errors import SolveError
from statics_cases import FLAT, UP, WHEELS, cast, excess, left_over, on_slope, parts, rough, short, tilted

needs = bp.solve.required_friction


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 7), st.floats(0.001, 3.0))
def test_on_a_plane_it_is_the_slope(seed: int, k: int, slope: float) -> None:
    rng = np.random.default_rng(seed)
    turn = tilted(slope) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn[:, 2] = tilted(slope)[:, 2]  # any axes within the plane
    points = rng.normal(size=(k, 2)) @ np.linalg.svd(turn[:, 2:].T)[2][1:]
    share = rng.dirichlet(np.ones(k))
    got = needs(points, np.tile(turn[:, 2], (k, 1)), points.T @ share + rng.uniform(0.0, 1.0) * UP)
    assert got.status == "ok"
    assert got.attained
    assert got.mu == pytest.approx(slope, rel=1e-11)
    assert float(got) == got.mu
    # every force is along the weight
    assert np.abs(got.forces[:, :2]).max() < 1e-10
    assert got.forces.sum(axis=0) == pytest.approx(UP, abs=1e-12)


def test_on_level_ground_there_is_none() -> None:
    got = needs(WHEELS, FLAT, [0.1, 0.0, 0.15])
    assert got.mu == 0.0
    assert got.status == "ok"
    steps = needs(WHEELS + np.outer([0.2, 0.0, 0.1], UP), FLAT, [0.1, 0.0, 0.15])
    assert steps.mu == 0.0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 7))
def test_proved_from_above_and_below(seed: int, k: int) -> None:
    """Forces with that ratio balance; with less friction even cones made of flat sides, that hold the round ones,
    do not."""
    points, normals, com = cast(seed, k)
    got = needs(points, normals, com, 1.0)
    assume(got.status == "ok" and got.attained)
    assert excess(got.forces, normals, got.mu) < 1e-11 * np.abs(got.forces).max()
    assert left_over(points, com, got.forces, 1.0) < 1e-11
    assume(1e-3 < got.mu < 10.0 and np.abs(got.forces).max() < 100.0)
    tangent = parts(got.forces, normals)[1]
    assert short(points, normals, com, got.mu, tangent) < 1e-9
    assert short(points, normals, com, got.mu * (1.0 - 1e-4), tangent) > 1e-8


@pytest.mark.parametrize("seed", range(4))
def test_it_is_where_forces_begin(seed: int) -> None:
    """By bisection of whether there are contact forces."""
    points, normals, com = rough(seed, 3 + seed % 3)

    def stands(mu: float) -> float:
        return 1.0 if bp.solve.contact_forces(points, normals, com, 5.0, mu).status == "ok" else -1.0

    assert brentq(stands, 0.0, 3.0, xtol=1e-11) == pytest.approx(needs(points, normals, com).mu, abs=1e-10)


def test_one_wheel_on_steep_ground() -> None:
    """Three contacts, one of them on a side wall of angle a: with the weight over the other two it needs nothing."""
    points = np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.4, 0.0]])
    normals = np.array([UP, UP, [0.0, -1.0, 0.3]])
    assert needs(points, normals, [0.1, 0.0, 0.2]).mu == 0.0
    # a ladder on two contacts: both forces meet the weight in one point
    ladder = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
    walls = np.array([UP, [-1.0, 0.0, 0.0]])
    got = needs(ladder, walls, [0.5, 0.0, 1.0])
    # F_1 = (mu a, 0, a), F_2 = (-b, 0, mu b): with weight 1, b = mu a, a + mu b = 1, and moments about the foot
    # 0.5 = mu b + 2 b
    mu = got.mu
    a = 1.0 / (1.0 + mu**2)
    assert mu * mu * a + 2.0 * mu * a == pytest.approx(0.5, abs=1e-12)


def test_a_load_along_the_ground() -> None:
    """A pull of a tenth of the weight needs a tenth; the size of a weight alone does not matter."""
    pull = [0.6, 0.8, 0.0, 0.0, 0.0, 0.0]
    got = needs(WHEELS, FLAT, [0.0, 0.0, 0.0], 10.0, wrench=pull)
    assert got.mu == pytest.approx(0.1, abs=1e-12)
    points, normals, com = rough(2, 4)
    assert needs(points, normals, com, 1e-6).mu == pytest.approx(needs(points, normals, com, 1e6).mu, rel=1e-12)


def test_over_an_edge_and_beyond() -> None:
    points, normals, _ = on_slope(0.4)
    edge = needs(points, normals, 0.5 * (points[0] + points[1]) + 0.3 * UP)
    assert edge.mu == pytest.approx(0.4, rel=1e-11)
    beyond = needs(points, normals, 1.01 * 0.5 * (points[0] + points[1]) - 0.01 * points[2] + 0.3 * UP)
    assert beyond.status == "tips_over"
    assert np.isinf(beyond.mu)
    assert not beyond.attained
    assert "whatever" in beyond.reason()
    with pytest.raises(SolveError, match="tips_over"):
        beyond.raise_if_failed()


def test_pulling_up_is_no_matter_of_friction() -> None:
    got = needs(WHEELS, FLAT, [0.0, 0.0, 0.1], [0.0, 0.0, 3.0])
    assert got.status == "tips_over"
    assert needs(WHEELS, FLAT, [0.0, 0.0, 0.1], 0.0).mu == 0.0


@pytest.mark.parametrize("lean", [0.0, 0.2, 0.5])
def test_between_walls_any_more_is_enough(lean: float) -> None:
    """Walls that lean over by a slope need more friction than the slope, and with just that forces of any size would
    not do. A groove holds with none."""
    points = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    normals = np.array([[0.0, -1.0, -lean], [0.0, 1.0, -lean]])
    got = needs(points, normals, [0.0, 0.0, 0.0])
    assert got.status == "ok"
    assert not got.attained
    assert got.mu == pytest.approx(lean, abs=1e-9)
    assert np.all(np.isnan(got.forces))
    more = bp.solve.contact_forces(points, normals, [0.0, 0.0, 0.0], 1.0, lean + 1e-3)
    assert more.status == "ok"
    less = bp.solve.contact_forces(points, normals, [0.0, 0.0, 0.0], 1.0, lean)
    assert less.status == "slips"
    assert "more than" in less.reason()
    groove = needs(points, normals * [1.0, 1.0, -1.0], [0.0, 0.0, 0.0])
    assert groove.mu == 0.0
    assert groove.attained == (lean > 0.0)


def test_a_batch_of_slopes() -> None:
    slopes = np.linspace(0.0, 1.5, 31)
    cases = [on_slope(float(s)) for s in slopes]
    points, normals, com = (np.stack(parts) for parts in zip(*cases, strict=True))
    got = needs(points, normals, com)
    assert got.mu.shape == (31,)
    assert got.mu == pytest.approx(slopes, abs=1e-12)
    assert got.ok.all()
    assert np.abs(got.forces - np.outer([0.3, 0.2, 0.5], UP)).max() < 1e-9
