"""What moves come to on their way, against the snake at the same places and at many more."""

from __future__ import annotations

import numpy as np
import pytest

from bodyplan.gaits.rectilinear.extremes import extremes
from bodyplan.gaits.rectilinear.moves import Moves, bends


def random_moves(rng: np.random.Generator, size: int, links: np.ndarray) -> Moves:
    """Of a snake with ``links`` over ground that is not level; some anchors stand, some slide."""
    count = len(links) // 2 + 1
    gaps = rng.uniform(0.5, 0.85, (size, count - 1)) * (links[0::2] + links[1::2])
    before = np.zeros((size, count, 2))
    before[:, 1:, 0] = np.cumsum(gaps, axis=1)
    before[..., 1] = rng.uniform(-0.01, 0.01, (size, count))
    moving = rng.uniform(size=(size, count)) < 0.6
    after = before + moving[..., None] * rng.uniform(-0.01, 0.01, before.shape)
    lift = np.where(rng.uniform(size=moving.shape) < 0.7, moving * 0.02, 0.0)
    early = np.where(rng.uniform(size=moving.shape) < 0.5, 1.0, rng.uniform(0.3, 1.0, moving.shape))
    return Moves(before, after, lift, early, ("",) * size)


def at_places(moves: Moves, links: np.ndarray, places: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Anchors' heights (M, P, N), elbows' heights (M, P, N - 1) and rates of joints (M, P, 2 N - 1)."""
    which = np.repeat(np.arange(len(moves))[:, None], places, axis=1)
    state = moves.state(links, which, np.broadcast_to(np.linspace(0.0, 1.0, places), which.shape))
    return state.anchors[..., 1], state.elbows(links)[..., 1], bends(state.first)


@pytest.mark.parametrize("count", [3, 5, 8])
def test_they_are_the_largest_of_the_states(count: int) -> None:
    rng = np.random.default_rng(count)
    links = rng.uniform(0.08, 0.12, 2 * count - 2)
    moves = random_moves(rng, 40, links)
    for places in (3, 64, 201):
        heights, elbows, rates = at_places(moves, links, places)
        found = extremes(moves, links, places)
        np.testing.assert_array_equal(found.height, heights.max(axis=1))
        np.testing.assert_allclose(found.bend, np.abs(np.diff(heights, 2, axis=1)).max(axis=1), rtol=0.0, atol=1e-16)
        np.testing.assert_allclose(found.elbow, elbows.max(axis=(1, 2)), rtol=1e-14)
        np.testing.assert_allclose(found.rate, np.abs(rates).max(axis=(1, 2)), rtol=1e-13)


def test_what_stands_neither_rises_nor_bends_nor_turns() -> None:
    links = np.full(6, 0.1)
    moves = random_moves(np.random.default_rng(1), 5, links)
    still = Moves(moves.before, moves.before, 0.0 * moves.lift, moves.early, moves.names)
    found = extremes(still, links, 21)
    np.testing.assert_array_equal(found.height, still.before[..., 1])
    assert not found.bend.any() and not found.rate.any()


def test_legs_that_do_not_reach_are_not_known() -> None:
    """One that does not, behind and ahead of others that do, at one place of its move only."""
    links = np.full(8, 0.1)
    moves = random_moves(np.random.default_rng(2), 6, links)
    for m, i in ((1, 0), (3, 2), (4, 4)):
        moves.after[m, i] = moves.before[m, i] + [-0.25 if i < 3 else 0.25, 0.0]
    found = extremes(moves, links, 33)
    unknown = np.isin(np.arange(6), (1, 3, 4))
    np.testing.assert_array_equal(np.isnan(found.elbow), unknown)
    assert np.isfinite(found.height).all() and np.isfinite(found.rate[~unknown]).all()
