"""The concertina curve: continuity, kinks, flat part and arc length, against independent computations."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import bodyplan as bp
from bodyplan.curves import GAMMA_STAR, ConcertinaCurve, dynamic_curve, from_parameters

gammas = st.lists(st.floats(0.0, 0.95), min_size=1, max_size=6)


@settings(max_examples=60, deadline=None)
@given(
    body=gammas,
    head=st.floats(0.0, 0.95),
    tail=st.floats(0.0, 1.0),
    omega=st.floats(0.3, 3.0),
    rule=st.sampled_from(["cut", "product", "natural"]),
    crossing=st.integers(1, 4),
    lead=st.sampled_from([0.0, 0.7]),
)
def test_continuous_everywhere(body, head, tail, omega, rule, crossing, lead):
    curve = ConcertinaCurve(body, head, tail=tail, omega=omega, rule=rule, crossing=crossing, lead=lead)
    at = np.concatenate([curve.breaks, [lead]])
    eps = 1e-9
    np.testing.assert_allclose(curve(at + eps), curve(np.maximum(at - eps, 0.0)), atol=1e-7 * (1 + omega))
    assert curve(curve.flat_from + 1.0) == 0.0
    assert np.all(np.diff(curve.breaks) >= 0.0)
    assert curve.breaks[-1] == curve.flat_from


def test_contracted_is_a_sine():
    curve = ConcertinaCurve([0.0] * 4, 0.0, omega=1.0)
    x = np.linspace(0, curve.flat_from, 400)
    np.testing.assert_allclose(curve(x), np.sin(x), atol=1e-14)
    np.testing.assert_allclose(curve.slope(x[:-1]), np.cos(x[:-1]), atol=1e-14)
    assert curve.flat_from == pytest.approx(6 * np.pi, abs=1e-13)


def test_amplitudes_follow_the_value_at_the_junction():
    body, omega = [0.1, 0.3, 0.5], 1.4
    curve = ConcertinaCurve(body, 0.2, tail=0.9, omega=omega)
    value = 0.9
    for k, gamma in enumerate(body):
        start = (np.pi / 2 + k * np.pi) / omega
        assert curve(start) == pytest.approx(value, abs=1e-14)
        value *= float(dynamic_curve(np.pi / omega, gamma, omega))
    head = (np.pi / 2 + len(body) * np.pi) / omega
    assert curve(head) == pytest.approx(value, abs=1e-14)
    # eq. (7) with /omega everywhere
    assert curve.flat_from == pytest.approx(
        head + (2 * np.pi - np.arccos(0.2)) / (omega * np.sqrt(1 - 0.04)), abs=1e-13
    )


def test_cut_follows_the_module_to_its_own_first_zero():
    curve = ConcertinaCurve([0.1, 0.8, 0.3, 0.2], 0.5)
    start = 1.5 * np.pi
    assert curve.flat_from == pytest.approx(start + (np.pi - np.arccos(0.8)) / 0.6, abs=1e-13)
    amplitude = float(dynamic_curve(np.pi, 0.1))
    # at the end of the module the straight line would jump by F_0.8(pi)
    jump = curve(start + np.pi) / amplitude
    assert jump == pytest.approx(0.0777, abs=5e-5)
    product = ConcertinaCurve([0.1, 0.8, 0.3, 0.2], 0.5, rule="product")
    x = np.linspace(0, start + np.pi, 200)
    np.testing.assert_allclose(curve(x), product(x), atol=1e-15)
    assert product(start + np.pi + 0.3) != 0.0
    below = ConcertinaCurve([GAMMA_STAR - 1e-9, 0.0], 0.0)
    above = ConcertinaCurve([GAMMA_STAR + 1e-9, 0.0], 0.0)
    x = np.linspace(0, 15, 500)
    np.testing.assert_allclose(below(x), above(x), atol=1e-8)  # the cut sets in without a jump


def test_natural_modules_are_c1_and_the_paper_s_are_not():
    body = [0.2, 0.6, 0.75, 0.4]
    natural = ConcertinaCurve(body, 0.3, rule="natural")
    inner = natural.breaks[:-1]
    kinks = natural.slope(inner + 1e-12) - natural.slope(inner - 1e-12)
    assert np.abs(kinks).max() < 1e-10
    assert ConcertinaCurve([0.6], 0.3).slope(1.5 * np.pi - 1e-12) != pytest.approx(0.0, abs=1e-3)
    # the largest kink of the amplitude rule between modules of the same wave: 6.8 degrees
    grid = np.linspace(0.0, GAMMA_STAR, 2001)
    slopes = [abs(np.arctan(ConcertinaCurve([g], 0.0).slope(1.5 * np.pi - 1e-12))) for g in grid[::20]]
    assert np.degrees(max(slopes)) == pytest.approx(6.8, abs=0.1)


@pytest.mark.parametrize("gamma,omega", [(0.0, 1.0), (0.4, 1.0), (0.4, 2.0), (0.75, 0.7)])
def test_slope_where_the_head_meets_the_axis(gamma, omega):
    # omega exp(-gamma omega (x' - x_head)); 45 degrees when contracted with omega 1
    curve = ConcertinaCurve([0.0, 0.0], gamma, omega=omega)
    x_head = 2.5 * np.pi / omega
    expected = omega * np.exp(-gamma * omega * (curve.flat_from - x_head))
    assert abs(curve.slope(curve.flat_from - 1e-13)) == pytest.approx(expected, rel=1e-9)


@settings(max_examples=15, deadline=None)
@given(body=gammas, head=st.floats(0.0, 0.9), tail=st.floats(0.1, 1.0), omega=st.floats(0.5, 2.5))
def test_arclength_is_the_integral_of_the_slope(body, head, tail, omega):
    curve = ConcertinaCurve(body, head, tail=tail, omega=omega)
    x = 0.83 * curve.flat_from
    edges = [0.0, *[b for b in curve.breaks if b < x], x]
    expected = sum(
        quad(lambda s: float(np.hypot(1.0, curve.slope(s))), a, b, epsabs=1e-13, epsrel=1e-13, limit=200)[0]
        for a, b in pairwise(edges)
        if b > a
    )
    assert curve.arclength(x) == pytest.approx(expected, rel=2e-12)
    assert curve.arclength(curve.flat_from + 2.0) - curve.arclength(curve.flat_from) == pytest.approx(2.0, abs=1e-12)


def test_batch_equals_one_by_one():
    rng = np.random.default_rng(3)
    body, head, tail = rng.uniform(0, 0.9, (2, 3, 4)), rng.uniform(0, 0.9, (2, 3)), rng.uniform(0, 1, (2, 3))
    batch = ConcertinaCurve(body, head, tail=tail, omega=1.2)
    x = np.linspace(0, 20, 50)
    assert batch(x).shape == (2, 3, 50)
    for i in np.ndindex(2, 3):
        one = ConcertinaCurve(body[i], head[i], tail=tail[i], omega=1.2)
        np.testing.assert_array_equal(batch(x)[i], one(x))
        np.testing.assert_array_equal(batch.arclength(x)[i], one.arclength(x))
        assert batch.flat_from[i] == one.flat_from
        np.testing.assert_array_equal(batch.breaks[i], one.breaks)


def test_lead_moves_the_curve_on():
    plain, moved = ConcertinaCurve([0.1, 0.2], 0.3), ConcertinaCurve([0.1, 0.2], 0.3, lead=1.5)
    x = np.linspace(0, 12, 77)
    np.testing.assert_allclose(moved(x + 1.5), plain(x), atol=1e-14)
    assert np.all(moved(np.linspace(0, 1.5, 9)) == 0.0)


def test_offset_of_points_on_and_off_the_curve():
    curve = from_parameters("concertina", {"body_gammas": [0.1, 0.2], "head_gamma": 0.3})
    x = np.linspace(0.0, 5.0, 9)
    np.testing.assert_allclose(curve.offset(x, curve(x)), 0.0, atol=1e-16)
    assert curve.offset(x, curve(x) + 1e-6)[0] == pytest.approx(1e-6 / np.sqrt(2.0), rel=1e-5)
    with pytest.raises(bp.UnknownNameError, match="concertina"):
        from_parameters("concertino", {})


@pytest.mark.parametrize(
    "changes",
    [
        {"body_gammas": []},
        {"body_gammas": [0.1, 1.2]},
        {"body_gammas": [np.nan]},
        {"head_gamma": -0.1},
        {"omega": 0.0},
        {"crossing": 0},
        {"crossing": 1.5},
        {"rule": "cutt"},
        {"rule": "natural", "head_gamma": 1.0},
        {"lead": -1.0},
        {"body_gammas": np.zeros((3, 2)), "head_gamma": np.zeros(4)},
    ],
)
def test_refuses(changes):
    with pytest.raises(bp.InputError):
        ConcertinaCurve(**{"body_gammas": [0.1, 0.2], "head_gamma": 0.1, **changes})


def test_refuses_points_behind_the_tail():
    with pytest.raises(bp.InputError, match="tail"):
        ConcertinaCurve([0.1], 0.1)(-1.0)
