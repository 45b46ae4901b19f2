"""Intervals of torques: worked by hand, random forces within, planes that touch the cones as proofs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.errors import SolveError
from statics_cases import FLAT, UP, WHEELS, cast, equations, excess, left_over, most, on_slope, parts, rough

interval = bp.solve.torque_interval


def test_two_feet_that_push_apart() -> None:
    """Feet at x = +-1 with half of the weight each: along x each may push the other by mu W / 2."""
    points, normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.tile(UP, (2, 1))
    levers = np.zeros((3, 2, 3))
    levers[0, 0] = [0.2, 0.0, 0.0]  # along x
    levers[1, 0] = [0.0, 0.0, 0.3]  # along the normal, which is known
    levers[2, 0], levers[2, 1] = [0.5, 0.0, 0.0], [0.5, 0.0, 0.0]  # the sum along x, which is none
    got = interval(points, normals, [0.0, 0.0, 0.4], 10.0, 0.6, levers)
    low, high = got
    assert low == pytest.approx([-0.2 * 3.0, 0.3 * 5.0, 0.0], abs=1e-11)
    assert high == pytest.approx([0.2 * 3.0, 0.3 * 5.0, 0.0], abs=1e-11)
    assert np.abs(got.high_forces[0] - [[3.0, 0.0, 5.0], [-3.0, 0.0, 5.0]]).max() < 1e-9


def test_without_friction_three_contacts_leave_nothing_open() -> None:
    rng = np.random.default_rng(0)
    levers = rng.normal(size=(4, 3, 3))
    low, high = interval(WHEELS, FLAT, [0.0, 0.0, 0.15], 98.1, 0.0, levers)
    want = levers[:, :, 2] @ [0.25, 0.25, 0.5] * 98.1
    assert low == pytest.approx(want, rel=1e-12)
    assert high == pytest.approx(want, rel=1e-12)


def test_four_feet_without_friction() -> None:
    """A square: one diagonal may carry it all, or the other; a foot carries between nothing and half."""
    points = np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])
    levers = np.zeros((4, 4, 3))
    levers[np.arange(4), np.arange(4), 2] = 1.0
    low, high = interval(points, np.tile(UP, (4, 1)), [0.0, 0.0, 0.5], 8.0, 0.0, levers)
    assert low == pytest.approx(np.zeros(4), abs=1e-11)
    assert high == pytest.approx(np.full(4, 4.0), abs=1e-11)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.floats(0.1, 1.2))
def test_no_end_can_be_moved(seed: int, k: int, mu: float) -> None:
    """The forces at an end are admissible, and nothing within planes that hold the cones, some of which touch them at
    those forces, goes further."""
    points, normals, com = cast(seed, k)
    levers = np.random.default_rng(seed + 1).normal(size=(2, k, 3))
    got = interval(points, normals, com, 1.0, mu, levers)
    stands = bp.solve.contact_forces(points, normals, com, 1.0, mu)
    assert got.status == stands.status
    assume(got.status == "ok")
    inside = np.einsum("mki,ki->m", levers, stands.forces)
    assert np.all(got.low <= inside + 1e-9)
    assert np.all(got.high >= inside - 1e-9)
    for sign, ends, forces in ((-1.0, got.low, got.low_forces), (1.0, got.high, got.high_forces)):
        for gain, end, F in zip(levers, ends, forces, strict=True):
            if not np.isfinite(end):
                bound = most(sign * gain, points, normals, com, 1.0, mu, np.zeros((k, 3)))
                assert bound == np.inf
                continue
            size = np.abs(F).max()
            assert excess(F, normals, mu) < 1e-9 * size
            assert left_over(points, com, F, 1.0) < 1e-10
            assert np.sum(gain * F) == pytest.approx(end, abs=1e-10 * size)
            bound = most(sign * gain, points, normals, com, 1.0, mu, parts(F, normals)[1])
            if size < 50.0:
                assert bound == pytest.approx(sign * end, abs=1e-7 * size)


def test_random_forces_are_within() -> None:
    points, normals, com = rough(4, 4)
    mu = 1.0
    levers = np.random.default_rng(2).normal(size=(3, 4, 3))
    got = interval(points, normals, com, 20.0, mu, levers)
    start = bp.solve.contact_forces(points, normals, com, 20.0, mu).forces
    A = equations(points, com)
    free = np.linalg.svd(A)[2][6:]
    rng = np.random.default_rng(3)
    seen = []
    F = start
    for _ in range(4000):  # hit and run: a step along a direction without net force, as far as it stays within
        way = (rng.normal(size=len(free)) @ free).reshape(4, 3)
        step = 40.0 * rng.uniform()
        while excess(F + step * way, normals, mu) > 0.0:
            step *= 0.7
        F = F + rng.uniform() * step * way
        seen.append(np.einsum("mki,ki->m", levers, F))
    low, high = np.min(seen, axis=0), np.max(seen, axis=0)
    assert np.all(low >= got.low - 1e-9)
    assert np.all(high <= got.high + 1e-9)
    assert np.all(high - low > 0.5 * (got.high - got.low))


def test_more_friction_leaves_more_open() -> None:
    points, normals, com = rough(6, 3)
    levers = np.random.default_rng(7).normal(size=(2, 3, 3))
    needed = bp.solve.required_friction(points, normals, com, 5.0)
    just = interval(points, normals, com, 5.0, float(needed.mu), levers)
    assert just.status == "ok"
    only = np.einsum("mki,ki->m", levers, needed.forces)
    assert just.low == pytest.approx(only, abs=1e-8)
    assert just.high == pytest.approx(only, abs=1e-8)
    last = just
    for mu in (1.1 * needed.mu, 1.5 * needed.mu, 2.0 * needed.mu):
        now = interval(points, normals, com, 5.0, mu, levers)
        assert np.all(now.low < last.low)
        assert np.all(now.high > last.high)
        last = now


def test_squeezing_has_no_limit() -> None:
    points, normals = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]), np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    levers = np.zeros((2, 2, 3))
    levers[0, 0, 1] = levers[1, 0, 2] = 1.0
    got = interval(points, normals, [0.0, 0.0, 0.0], 6.0, 0.25, levers)
    assert got.low[0] == -np.inf
    assert got.high[0] == pytest.approx(-12.0, abs=1e-9)
    # moments about x allow no more on one side than on the other
    assert (got.low[1], got.high[1]) == pytest.approx((3.0, 3.0), abs=1e-9)
    assert np.all(np.isnan(got.low_forces[0]))


def test_what_does_not_stand_has_no_interval() -> None:
    points, normals, com = on_slope(0.4)
    levers = np.ones((2, 3, 3))
    got = interval(
        np.stack([points, WHEELS]), np.stack([normals, FLAT]), np.stack([com, [0, 0, 0.1]]), 9.0, 0.3, levers
    )
    assert got.status.tolist() == ["slips", "ok"]
    assert np.all(np.isnan(got.low[0]))
    assert got.low.shape == (2, 2)
    assert got.low_forces.shape == (2, 2, 3, 3)
    assert "0.4" in got.reason(0)
    with pytest.raises(SolveError, match="slips"):
        got.raise_if_failed()
