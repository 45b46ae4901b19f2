"""Swings and the legs that they bend: exact landing, rates and accelerations, also where a leg begins or ends straight;
the law of cosines in many digits is the reference."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.gaits.rectilinear.moves import Moves, bends
from bodyplan.gaits.rectilinear.swing import cycloid, swing
from rectilinear_cases import angles_by_hand, chain, joints_by_hand, swing_by_hand

#: places near both ends, where digits are lost first, and between
PLACES = [
    1e-8,
    1e-7,
    1e-6,
    1e-5,
    6e-5,
    1e-3,
    0.05,
    0.2,
    0.37,
    0.5,
    0.63,
    0.81,
    0.95,
    0.999,
    1 - 6e-5,
    1 - 1e-5,
    1 - 1e-7,
]


def one_move(before: Any, after: Any, lift: Any, early: Any = None) -> Moves:
    early = np.ones(len(before)) if early is None else early
    return Moves(*(np.array([x], dtype=float) for x in (before, after, lift, early)), ("move",))


def at(moves: Moves, links: Any, tau: Any) -> Any:
    tau = np.atleast_1d(tau)
    return moves.state(np.asarray(links, float), np.zeros(len(tau), dtype=int), tau)


MOVES = {
    "tail from a straight leg": ([[0, 0], [4, 0], [6, 0]], [[2.4, 0], [4, 0], [6, 0]], [0.2, 0, 0], None, [2.0] * 4),
    "head to a straight leg": ([[0, 0], [3, 0], [4.6, 0]], [[0, 0], [3, 0], [7, 0]], [0, 0, 0.2], None, [2.0] * 4),
    "middle, straight to straight": ([[0, 0], [2, 0], [6, 0]], [[0, 0], [4, 0], [6, 0]], [0, 0.15, 0], None, [2.0] * 4),
    "sliding from a straight leg": ([[0, 0], [4, 0], [6, 0]], [[2.4, 0], [4, 0], [6, 0]], [0, 0, 0], None, [2.0] * 4),
    "up a step, early": (
        [[0, 0], [1.0, 0], [2.1, 0.4]], [[0, 0], [1.4, 0.4], [2.1, 0.4]],
        [0, 0.15, 0], [1, 0.35, 1], [1, 0.9, 0.7, 0.8],
    ),
    "down a step, late": (
        [[0, 0.5], [1.2, 0.5], [1.9, 0.5]], [[0, 0.5], [1.2, 0.5], [2.4, 0.1]],
        [0, 0, 0.1], [1, 1, 0.5], [1, 0.9, 0.7, 0.8],
    ),
    "two at once": (
        [[0, 0], [2, 0], [3, 0], [5, 0], [6, 0]], [[0.9, 0], [2, 0], [3.9, 0], [5, 0], [6.9, 0]],
        [0.1, 0, 0.1, 0, 0.1], None, [1.0] * 8,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MOVES)
def test_angles_rates_and_accelerations(name: str) -> None:
    """To nine digits of each, however small they are near the ends."""
    before, after, lift, early, links = MOVES[name]
    early = [1.0] * len(before) if early is None else early
    state = at(one_move(before, after, lift, early), links, PLACES)
    with mp.workdps(120):

        def exact(tau: Any) -> list[Any]:
            anchors = []
            for (x0, z0), (x1, z1), height, share in zip(before, after, lift, early, strict=True):
                x0, z0, x1, z1, height, share = (mp.mpf(float(v)) for v in (x0, z0, x1, z1, height, share))
                dx, dz = swing_by_hand(tau, (x1 - x0, z1 - z0), height, share)
                anchors.append((x0 + dx, z0 + dz))
            return angles_by_hand(anchors, links)

        for k, place in enumerate(PLACES):
            tau, h = mp.mpf(place), mp.mpf(10) ** -18 * min(place, 1 - place)
            low, here, high = exact(tau - h), exact(tau), exact(tau + h)
            for i, angle in enumerate(here):
                assert abs(state.angles[k, i] - float(angle)) < 4e-15
                first, second = (high[i] - low[i]) / (2 * h), (high[i] - 2 * angle + low[i]) / h**2
                assert state.first[k, i] == pytest.approx(float(first), rel=1e-9, abs=1e-30), (place, i)
                assert state.second[k, i] == pytest.approx(float(second), rel=2e-8, abs=1e-24), (place, i)


@pytest.mark.parametrize("name", MOVES)
def test_moves_begin_and_end_at_rest_where_they_should(name: str) -> None:
    before, after, lift, early, links = MOVES[name]
    moves = one_move(before, after, lift, early)
    state = at(moves, links, [0.0, 1.0])
    np.testing.assert_array_equal(state.anchors, [before, after])
    for rate in (state.first, state.second):
        np.testing.assert_array_equal(rate, np.zeros_like(rate))
    # and come there steadily, also from a straight leg, whose angles go as the square root of what it is short
    for end in (0.0, 1.0):
        near = at(moves, links, np.abs(end - np.array([1e-2, 1e-3, 1e-4])))
        rates, changes = np.abs(near.first).max(axis=1), np.abs(near.second).max(axis=1)
        assert np.all(rates[1:] < 0.02 * rates[:-1]) and np.all(changes[1:] < 0.2 * changes[:-1])
        assert rates[0] < 0.02 and changes[0] < 4.0


def test_a_sloping_leg_that_begins_straight_has_finite_accelerations() -> None:
    """The lift goes as tau^4, and bends a sloping leg as tau^2: its rate begins at 0, its acceleration need not."""
    moves = one_move([[0, 0], [1.5, 2.0], [3.0, 2.0]], [[0.3, 0.4], [1.5, 2.0], [3.0, 2.0]], [0.1, 0, 0])
    tau = np.array([1e-6, 1e-5, 1e-4, 1e-3])
    near = at(moves, [1.25, 1.25, 1.0, 1.0], tau)
    np.testing.assert_allclose(near.first, near.second * tau[:, None], rtol=0.05, atol=1e-12)
    assert 1.0 < np.abs(near.second).max() < 20.0
    h = 1e-3 * tau
    around = [at(moves, [1.25, 1.25, 1.0, 1.0], tau + d) for d in (-h, h)]
    slope = (around[1].first - around[0].first) / (2 * h[:, None])
    np.testing.assert_allclose(slope, near.second, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", MOVES)
def test_points_and_joints_land_on_the_anchors(name: str) -> None:
    before, after, lift, early, links = MOVES[name]
    state = at(one_move(before, after, lift, early), links, np.linspace(0, 1, 101))
    joints = bends(state.angles)
    np.testing.assert_allclose(joints.sum(axis=1), 0.0, atol=1e-14)
    placed = chain(state.anchors[:, 0], joints, links)
    np.testing.assert_allclose(placed[:, 0::2], state.anchors, atol=2e-15 * 16)
    np.testing.assert_allclose(placed, state.points(np.asarray(links, float)), atol=2e-15 * 16)


def test_numeric_derivatives_of_anchors() -> None:
    rng = np.random.default_rng(3)
    step, lift, early = rng.normal(size=(40, 2)), rng.uniform(0, 0.4, 40), rng.uniform(0.25, 1.0, 40)
    tau, h = np.linspace(0.01, 0.99, 397)[:, None], 1e-5
    low, here, high = (swing(tau + d, step, lift, early) for d in (-h, 0.0, h))
    np.testing.assert_allclose((high.risen - low.risen) / (2 * h), here.velocity, atol=2e-6)
    # where a wait or a rise ends the third derivative jumps, and a difference across it is off by as much times h
    np.testing.assert_allclose((high.velocity - low.velocity) / (2 * h), here.acceleration, atol=2e-2)
    np.testing.assert_allclose(here.risen - here.landing, np.broadcast_to(step, here.risen.shape), atol=1e-15)


@given(st.floats(-17.0, 0.0), st.booleans())
def test_the_cycloid_keeps_its_digits_where_it_is_small(exponent: float, exactly: bool) -> None:
    u = 10.0**exponent if exactly else 10.0 ** (exponent / 8.0)
    with mp.workdps(80):
        exact = mp.mpf(u) - mp.sin(2 * mp.pi * mp.mpf(u)) / (2 * mp.pi)
        assert float(cycloid(np.array(u))) == pytest.approx(float(exact), rel=4e-15)


@settings(max_examples=60)
@given(
    st.floats(0.0, 1.0), st.tuples(st.floats(-1, 1), st.floats(-1, 1)), st.floats(0.0, 0.5), st.floats(0.25, 1.0)
)  # fmt: skip
def test_swings_against_their_formulas(tau: float, step: Any, lift: float, early: float) -> None:
    found = swing(np.array(tau), np.array(step), np.array(lift), np.array(early))
    with mp.workdps(40):
        exact = swing_by_hand(mp.mpf(tau), tuple(map(mp.mpf, step)), mp.mpf(lift), mp.mpf(early))
    np.testing.assert_allclose(found.risen, [float(v) for v in exact], atol=1e-15)
    np.testing.assert_allclose(found.landing, [float(v - w) for v, w in zip(exact, step, strict=True)], atol=1e-15)


def test_swings_go_one_way_and_clear_their_ends() -> None:
    """Along without turning back; up over level ground by the lift, over a step above both of its treads."""
    tau = np.linspace(0, 1, 401)
    for dz in (0.0, 0.3, -0.3):
        for early in (1.0, 0.6, 0.3):
            found = swing(tau, np.array([0.5, dz]), np.array(0.1), np.array(early))
            assert np.all(np.diff(found.risen[:, 0]) >= 0.0)
            assert found.risen[:, 1].max() >= max(dz, 0.0) + (0.09 if early == 0.3 else 0.02)
            assert np.all(found.risen[:, 1] >= min(dz, 0.0) - 1e-15)
    level = swing(tau, np.array([0.5, 0.0]), np.array(0.1), np.array(1.0))
    assert level.risen[:, 1].max() == level.risen[200, 1] == pytest.approx(0.1, rel=1e-15)
    # a step up that rises early is up before it goes along
    gone = []
    for early in (1.0, 0.6, 0.3):
        along, up = swing(tau, np.array([0.5, 0.3]), np.array(0.0), np.array(early)).risen.T
        gone.append(along[np.argmax(up > 0.75 * 0.3)] / 0.5)
    assert gone[0] == pytest.approx(0.75, abs=0.01) and gone[0] > gone[1] > gone[2] and gone[2] < 0.02


def test_lifting_before_advancing_overreaches_from_a_straight_leg_and_the_cycloid_does_not() -> None:
    links = np.full(4, 2.0)
    before, after = [[0, 0], [4, 0], [7, 0]], [[1.5, 0], [4, 0], [7, 0]]
    tau = np.linspace(0, 1, 2001)
    height = 0.2 * np.sin(np.pi * tau) ** 2
    up_first = np.stack(
        [1.5 * np.clip(2 * tau - 1, 0, 1), np.maximum(height, 0.2 * (tau > 0.5) * (tau < 0.8))], axis=-1
    )
    assert np.hypot(4.0 - up_first[:, 0], up_first[:, 1]).max() > 4.0 + 4e-3
    state = at(one_move(before, after, [0.2, 0, 0]), links, tau)
    assert np.isfinite(state.angles).all() and state.legs.short.min() >= 0.0
    assert np.linalg.norm(np.diff(state.anchors, axis=1)[:, 0], axis=1).max() <= 4.0
    waits = at(one_move(before, after, [0.2, 0, 0], [0.5, 1, 1]), links, tau)
    assert waits.legs.short.min() < -1e-2 and np.isnan(waits.angles).any()


@pytest.mark.parametrize("off", [-3e-14, -1e-15, 1e-15, 3e-14])
def test_a_leg_that_is_straight_but_for_rounding_begins_as_a_straight_one(off: float) -> None:
    """Anchors come from sums: a leg that is 1e-15 too short or too long for its links is meant to be straight."""
    links, tau = np.full(4, 2.0), np.array([1e-4, 1e-3, 1e-2, 0.3, 0.7])
    exact, rounded = (
        at(one_move([[x, 0], [4, 0], [6, 0]], [[x + 2.4, 0], [4, 0], [6, 0]], [0.2, 0, 0]), links, tau)
        for x in (0.0, off)
    )
    for name in ("angles", "first", "second"):
        np.testing.assert_allclose(getattr(rounded, name), getattr(exact, name), rtol=1e-9, atol=1e-15)


def test_the_lifted_middle_move_peaks_between_its_ends() -> None:
    """Fig. 8's middle move with 150 mm of lift: 1998.2 mm, its ends 1985.5."""
    links = np.full(4, 2000.0)
    before, after = [[1720, 0], [2200, 0], [5000, 0]], [[1720, 0], [3880, 0], [5000, 0]]
    state = at(one_move(before, after, [0, 150, 0]), links, np.linspace(0, 1, 20001))
    height = state.elbows(links)[..., 1].max(axis=1)
    assert max(height[0], height[-1]) == pytest.approx(1985.5, abs=0.05)
    assert height.max() == pytest.approx(1998.2, abs=0.05)


def test_sequences_of_moves_joined_are_themselves() -> None:
    parts = [one_move(*MOVES[n][:4]) for n in ("tail from a straight leg", "middle, straight to straight")]
    joined = Moves.joined(parts)
    assert len(joined) == 2 and joined.names == ("move", "move")
    np.testing.assert_array_equal(joined.moving, [[True, False, False], [False, True, False]])
    links, tau = np.full(4, 2.0), np.array([0.3, 0.8])
    both = joined.state(links, np.array([0, 1]), tau)
    for k, part in enumerate(parts):
        alone = at(part, links, tau[k])
        np.testing.assert_array_equal(both.angles[k], alone.angles[0])
        np.testing.assert_allclose(bends(both.angles)[k], joints_by_hand(both.anchors[k], links), atol=1e-7)
