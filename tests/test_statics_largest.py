"""The largest of the least coefficients of many items, of which only a few are solved; and forces by projection."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.solve.statics.cones import ratios
from bodyplan.solve.statics.equilibrium import Loads
from bodyplan.solve.statics.friction import CLOSE, LeastFriction
from bodyplan.solve.statics.projection_kernel import project
from statics_cases import cast, rough


def batch(seed: int, k: int, size: int, along: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bodies that stand well, each another one or, ``along`` a way, each a little different from the last."""
    if not along:
        some = [rough(seed + i, k) for i in range(size)]
        return np.stack([s[0] for s in some]), np.stack([s[1] for s in some]), np.stack([s[2] for s in some])
    points, normals, com = rough(seed, k)
    rng = np.random.default_rng(seed)
    bend, wave = rng.normal(size=(2, k, 3)) * 0.1, np.linspace(0.0, 3.0, size)[:, None, None]
    return points + 0.0 * wave, normals + bend[0] * np.sin(wave) + bend[1] * np.cos(2.0 * wave), np.tile(com, (size, 1))


def least_of(points: np.ndarray, normals: np.ndarray, com: np.ndarray, weight: float) -> LeastFriction:
    return LeastFriction(Loads.of(points, normals, com, weight, None, None))


@pytest.mark.parametrize("along", [False, True])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 100), k=st.integers(3, 6))
def test_it_is_the_largest_of_all(along: bool, seed: int, k: int) -> None:
    points, normals, com = batch(seed, k, 24, along)
    every = bp.solve.required_friction(points, normals, com, forces=False).mu
    got = least_of(points, normals, com, 1.0).largest(np.full(24, np.inf))
    assert np.nanmax(got) == pytest.approx(every.max(), rel=1e-11, abs=1e-12)
    known = np.isfinite(got)
    np.testing.assert_allclose(got[known], every[known], rtol=1e-10, atol=1e-12)
    # neighbours bound each other; bodies that have nothing in common are told by projection
    assert known.sum() < 12


def test_bounds_that_are_given_spare_work() -> None:
    points, normals, com = batch(5, 4, 30, False)
    every = bp.solve.required_friction(points, normals, com, forces=False).mu
    got = least_of(points, normals, com, 1.0).largest(every * (1.0 + 1e-9))
    assert np.flatnonzero(np.isfinite(got)).tolist() == [int(every.argmax())]
    assert np.nanmax(got) == pytest.approx(every.max(), rel=1e-11)


def test_one_that_tips_over_decides() -> None:
    points, normals, com = batch(1, 3, 10, True)
    points[6, :, 2], normals[6], com[6] = 0.0, [0.0, 0.0, 1.0], [5.0, 0.0, 0.3]
    got = least_of(points, normals, com, 1.0).largest(np.full(10, np.inf))
    assert np.nanmax(got) == np.inf
    # three contacts in one line hold nothing beside it: mended forces do not balance there
    points[6] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    com[6] = [1.0, 0.3, 0.5]
    assert least_of(points, normals, com, 1.0).largest(np.full(10, np.inf))[6] == np.inf
    bound = np.full(10, np.inf)
    bound[6] = -np.inf
    assert np.nanmax(least_of(points, normals, com, 1.0).largest(bound)) < 2.0


def test_of_no_items_there_is_none() -> None:
    none = least_of(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)), 1.0)
    assert none.largest(np.zeros(0)).shape == (0,)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 6), st.floats(0.05, 2.0), st.integers(0, 60))
def test_projected_forces_balance_and_bound(seed: int, k: int, mu: float, rounds: int) -> None:
    """Whatever comes of it: no bound is below what is needed, and forces that are kept balance."""
    points, normals, com = cast(seed, k)
    touching = np.random.default_rng(seed).uniform(size=k) > 0.2
    loads = Loads.of(points, normals, com, 1.0, None, touching)
    equations, found = loads.equations, loads.parts
    x, bound = np.zeros((1, 3 * k)), np.full(1, np.inf)
    project(equations, found.inverse, loads.load, loads.touching, mu, rounds, x, bound)
    balances = np.abs(equations[0] @ x[0] + loads.load[0]).max() < 1e-10
    if np.isfinite(bound[0]) and balances:
        need = bp.solve.required_friction(points, normals, com, touching=touching, forces=False)
        assert bound[0] >= need.mu * (1.0 - 1e-10) - CLOSE
        # the last round is the one that got within, or none did
        assert ratios(x.reshape(1, k, 3)).max() == pytest.approx(bound[0], rel=1e-12) or bound[0] > mu
        assert np.abs(x.reshape(k, 3)[~touching]).max(initial=0.0) <= 1e-15 * np.abs(x).max()


def test_projection_finds_what_stands_with_room_to_spare() -> None:
    """Half as much friction again as is needed is found within a hundred rounds by three of four or more."""
    points, normals, com = batch(11, 4, 60, False)
    every = bp.solve.required_friction(points, normals, com, forces=False).mu
    loads = Loads.of(points, normals, com, 1.0, None, None)
    inverse = loads.parts.inverse
    within = 0
    for i, enough in enumerate(1.5 * every):
        x, bound, one = np.zeros((1, 12)), np.full(1, np.inf), slice(i, i + 1)
        project(loads.equations[one], inverse[one], loads.load[one], loads.touching[one], enough, 100, x, bound)
        assert bound[0] >= every[i] * (1.0 - 1e-10)
        within += bool(bound[0] <= enough * (1.0 + 1e-6))
    assert within > 45
