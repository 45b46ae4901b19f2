"""Links on a curve by circles: on the curve, one link apart, the nearest ahead; and the exact length."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import bodyplan as bp
from bodyplan.curves import ConcertinaCurve


@settings(max_examples=60, deadline=None)
@given(
    body=st.lists(st.floats(0.0, 0.9), min_size=2, max_size=5),
    head=st.floats(0.0, 0.9),
    tail=st.floats(0.0, 1.0),
    omega=st.floats(0.4, 4.0),
    rule=st.sampled_from(["cut", "product", "natural"]),
    lengths=st.lists(st.floats(0.05, 1.6), min_size=1, max_size=12),
    start=st.floats(0.0, 6.0),
)
def test_joints_are_on_the_curve_one_link_apart(body, head, tail, omega, rule, lengths, start):
    curve = ConcertinaCurve(body, head, tail=tail, omega=omega, rule=rule)
    points, angles = bp.links_on_curve(curve, lengths, start=start)
    assert points.shape == (len(lengths) + 1, 2) and angles.shape == (len(lengths),)
    np.testing.assert_allclose(points[:, 1], curve(points[:, 0]), atol=1e-13)
    steps = np.diff(points, axis=0)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=1), lengths, rtol=1e-12)
    np.testing.assert_allclose(angles, np.arctan2(steps[:, 1], steps[:, 0]), atol=1e-14)
    assert np.all(steps[:, 0] > 0.0)


@pytest.mark.parametrize("gammas", [(0.0, 0.0, 0.0, 0.0), (0.05, 0.3, 0.6, 0.2)])
@pytest.mark.parametrize("omega", [1.0, 1.7, 2.2, 3.0, 6.0])
def test_nearest_ahead_also_where_a_circle_meets_the_curve_several_times(omega, gammas):
    curve = ConcertinaCurve(gammas, gammas[-1], omega=omega)
    several = 0
    points, _ = bp.links_on_curve(curve, 1.0, 14)
    for here, there in pairwise(points):
        x = np.linspace(here[0], here[0] + 1.0, 4001)
        inside = np.hypot(x - here[0], curve(x) - here[1]) - 1.0
        crossings = np.flatnonzero((inside[:-1] < 0.0) & (inside[1:] >= 0.0))
        several += len(crossings) > 1
        if len(crossings):
            assert x[crossings[0]] - 1e-12 <= there[0] <= x[crossings[0] + 1] + 1e-12
        else:
            assert there[0] == pytest.approx(here[0] + 1.0, abs=1e-12)
    if omega >= 3.0 and not any(gammas):
        assert several > 0  # else this test has lost its point


def test_agrees_with_a_bracketed_root_finder():
    curve = ConcertinaCurve([0.2, 0.4, 0.1, 0.3], 0.5)
    points, _ = bp.links_on_curve(curve, 0.7, 20, start=0.3)
    x = 0.3
    for k in range(20):
        y = float(curve(x))
        x = brentq(
            lambda s, x=x, y=y: (s - x) ** 2 + (float(curve(s)) - y) ** 2 - 0.49, x, x + 0.7 * (1 + 1e-12), xtol=1e-14
        )
        assert points[k + 1, 0] == pytest.approx(x, abs=1e-11)


def test_batch_equals_one_by_one():
    rng = np.random.default_rng(1)
    body, start = rng.uniform(0, 0.8, (5, 4)), rng.uniform(0, 2, 5)
    batch = bp.links_on_curve(ConcertinaCurve(body, 0.2), 0.8, 10, start=start)
    assert batch.points.shape == (5, 11, 2) and batch.status.shape == (5,)
    for i in range(5):
        one = bp.links_on_curve(ConcertinaCurve(body[i], 0.2), 0.8, 10, start=start[i])
        np.testing.assert_array_equal(batch.points[i], one.points)
        assert one.status == batch.status[i]


def test_a_joint_on_the_peak_where_the_slope_vanishes():
    # the distance starts to grow at rate 0 there: an iteration that trusts its small first step would stop at once
    curve = ConcertinaCurve([0.0] * 4, 0.0)
    for start in (np.pi / 2, np.nextafter(np.pi / 2, 0.0), np.nextafter(np.pi / 2, 9.0), 1.5 * np.pi):
        points, _ = bp.links_on_curve(curve, 0.75, 6, start=start)
        np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), 0.75, rtol=1e-12)
        np.testing.assert_allclose(points[:, 1], np.sin(points[:, 0]), atol=1e-13)


def test_half_waves_cut_off_are_too_tight_however_flat():
    curve = ConcertinaCurve([0.0] * 4, 0.0)
    assert bp.links_on_curve(curve, 7.0, 1).status == "too_tight"
    flat = ConcertinaCurve([0.0] * 4, 0.0, tail=0.01)
    assert bp.links_on_curve(flat, 7.0, 1).status == "ok"


def test_a_fold_under_a_link_is_a_status():
    curve = ConcertinaCurve([0.0] * 4, 0.0, omega=8.0)
    fit = bp.links_on_curve(curve, 2.0, 3)
    assert fit.status == "too_tight" and fit.link == 0 and not fit.ok
    with pytest.raises(bp.SolveError, match="link 1"):
        fit.raise_if_failed()
    fine = bp.links_on_curve(curve, 0.05, 3)
    assert fine.status == "ok" and fine.raise_if_failed() is fine


def test_published_exact_length():
    length = bp.exact_link_length(26, 4, 1.0)
    assert length == pytest.approx(0.873938881878, abs=5e-13) and length.status == "ok"
    points, _ = bp.links_on_curve(ConcertinaCurve([0.0] * 4, 0.0), length, 26)
    np.testing.assert_allclose(points[-1], [6 * np.pi, 0.0], atol=1e-11)
    assert 26 * length - 6 * np.pi == pytest.approx(3.87286, abs=5e-6)
    assert (26 * length - 6 * np.pi) / (26 * length) == pytest.approx(0.1704, abs=5e-5)


def test_longer_and_shorter_links_than_exact():
    contracted = ConcertinaCurve([0.0] * 4, 0.0)
    longer, _ = bp.links_on_curve(contracted, 1.0, 26)
    assert 26.0 - longer[-1, 0] == pytest.approx(3.7398, abs=5e-5) and longer[-1, 1] == 0.0
    shorter, _ = bp.links_on_curve(contracted, 0.8, 26)
    assert abs(shorter[-1, 1]) == pytest.approx(0.998, abs=5e-4)


@settings(max_examples=10, deadline=None)
@given(
    ratios=st.lists(st.floats(0.7, 1.4), min_size=14, max_size=30),
    modules=st.sampled_from([2, 4]),
    omega=st.floats(0.8, 1.3),
)
def test_exact_scale_of_unequal_links(ratios, modules, omega):
    scale = bp.exact_link_length(ratios, modules, omega)
    curve = ConcertinaCurve([0.0] * modules, 0.0, omega=omega)
    points, _ = bp.links_on_curve(curve, float(scale) * np.array(ratios))
    np.testing.assert_allclose(points[-1], [curve.flat_from, 0.0], atol=1e-10)
    # read from the head, the same chain covers the curve: the contracted body is its own point reflection
    back, _ = bp.links_on_curve(curve, float(scale) * np.array(ratios[::-1]))
    np.testing.assert_allclose(points[-1] - points[::-1], back, atol=1e-9)


def test_no_exact_length_is_a_status():
    # one link cannot start at the tail, end on the axis at x' and be shorter than the curve that it must cover
    lengths = [bp.exact_link_length(n, m, w) for n, m, w in ((2, 8, 3.0), (3, 6, 2.0), (5, 9, 3.0), (1, 4, 1.0))]
    assert all(x.status in ("no_exact_length", "too_tight") for x in lengths)
    for x in lengths:
        assert np.isnan(x) == (x.status == "no_exact_length")
        with pytest.raises(bp.SolveError):
            x.raise_if_failed()


@pytest.mark.parametrize(
    "arguments",
    [
        {"link_length": 0.0, "links": 3},
        {"link_length": -1.0, "links": 3},
        {"link_length": 1.0},
        {"link_length": 1.0, "links": 0},
        {"link_length": [1.0, 2.0], "links": 3},
        {"link_length": [1.0, np.nan]},
        {"link_length": [[1.0]]},
        {"link_length": 1.0, "links": 3, "start": -0.1},
        {"link_length": []},
    ],
)
def test_refuses(arguments):
    with pytest.raises(bp.InputError):
        bp.links_on_curve(ConcertinaCurve([0.1, 0.1], 0.1), **arguments)


def test_refuses_other_curves():
    with pytest.raises(bp.InputError, match="ConcertinaCurve"):
        bp.links_on_curve(np.sin, 1.0, 3)
