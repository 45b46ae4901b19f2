"""Sums, untwisted curves, transitions and steering: what they add, and that nothing jumps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan import curves as bc
from bodyplan.curves.quadrature import shape_integral

A, B = bc.Serpenoid(1.0, 0.8), bc.SinusLift(1.3, 0.3) + bc.Constant(0.5, 0.2, -1.0)


def jumps(curve: bc.BodyCurve, place: float, order: int) -> float:
    """Jump (largest component) of the ``order``-th derivative at a place, by one-sided differences of the slope."""
    h, weights = 1e-4, (-11, 18, -9, 2)
    if order == 0:
        values = [np.stack(curve.shape(place + x)) for x in (1e-13, -1e-13)]
    elif order == 1:
        values = [np.stack(curve.slope(place + x)) for x in (1e-13, -1e-13)]
    else:
        values = [
            sum(w * np.stack(curve.slope(place + side * n * h)) for n, w in enumerate(weights)) / (6 * side * h)
            for side in (1, -1)
        ]
    return float(np.abs(values[0] - values[1]).max())


@pytest.mark.parametrize(
    "curve",
    [
        bc.Transition(A, B, 0.3, 0.4),
        bc.Transition(bc.Spiral(), A, -0.2, 1.5),
        bc.Steering([0.0, 0.25, 1.0], [2.0, -1.0, 0.0], 0.5, initial=0.7),
    ],
)
def test_nothing_jumps(curve: bc.BodyCurve) -> None:
    for place in curve.breaks:
        assert jumps(curve, place, 0) < 1e-10
        assert jumps(curve, place, 1) < 1e-9
        assert jumps(curve, place, 2) < 2e-3
    # a control: a jump would be seen
    assert jumps(bc.Segments([(0.5, 1.0, 0.0, 0.0)]), 0.5, 0) == 1.0


def test_transition_is_one_curve_before_and_the_other_behind() -> None:
    curve = bc.Transition(A, B, 0.3, 0.4)
    before, behind = np.linspace(-1.0, 0.3, 20), np.linspace(0.7 + 1e-12, 3.0, 20)
    for values in ("shape", "slope"):
        assert np.array_equal(np.stack(getattr(curve, values)(before)), np.stack(getattr(A, values)(before)))
        assert np.array_equal(np.stack(getattr(curve, values)(behind)), np.stack(getattr(B, values)(behind)))
    half = [0.5 * (x + y) for x, y in zip(A.shape(0.5), B.shape(0.5), strict=True)]
    assert np.abs(np.stack(curve.shape(0.5)) - half).max() < 1e-14
    # far behind, integrals are those of the second curve
    far = np.stack(curve.integral(1e3, 1e3 + 0.1)) - np.stack(B.integral(1e3, 1e3 + 0.1))
    assert np.array_equal(far, np.zeros(3))
    assert curve.period is None
    assert curve.length == A.length


def test_transition_starts_where_the_first_curve_does() -> None:
    points = np.array([[1.0, 2.0, 3.0], [1.2, 2.1, 3.0], [1.3, 2.3, 3.1], [1.3, 2.5, 3.3]])
    sampled = bc.Sampled(points)
    curve = bc.Transition(sampled, bc.Spiral(), 0.3, 0.1)
    assert np.array_equal(curve.start, sampled.start)
    assert np.abs(curve.frames([0.0, 0.25])[0] - sampled.frames([0.0, 0.25])[0]).max() < 1e-10
    # only the breaks that are left
    assert np.array_equal(curve.breaks, [*sampled.stations[:2], 0.3, 0.4])
    assert sampled.stations[2] > 0.4


@settings(max_examples=30, deadline=None)
@given(
    values=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=4),
    gap=st.floats(0.05, 2.0),
    width=st.floats(0.05, 2.0),
    a=st.floats(-2.0, 9.0),
    b=st.floats(-2.0, 9.0),
)
def test_steering(values: list[float], gap: float, width: float, a: float, b: float) -> None:
    places = gap * np.arange(len(values))
    curve = bc.Steering(places, values, width, initial=0.5)
    assert float(curve.shape(-0.1).kappa_y) == 0.5
    assert abs(float(curve.shape(places[-1] + width).kappa_y) - values[-1]) < 1e-14
    if gap >= width:
        assert np.abs(curve.shape(places + width).kappa_y - values).max() < 1e-14
    exact, numeric = curve.integral(a, b).kappa_y, shape_integral(curve, a, b).kappa_y
    assert abs(exact - numeric) < 1e-13
    # a change takes half of its width, as far as the heading goes
    whole = float(curve.integral(-1.0, places[-1] + width + 3.0).kappa_y)
    parts = np.diff(values, prepend=0.5) * (places[-1] + width + 3.0 - places - 0.5 * width)
    assert abs(whole - (0.5 * (places[-1] + width + 4.0) + parts.sum())) < 1e-12


def test_steering_far_away_is_exact() -> None:
    curve = bc.Steering([0.0, 1e4], [5.0, -3.0], 0.5)
    assert abs(float(curve.integral(9e3, 9e3 + 0.1).kappa_y) - 0.5) < 1e-11
    assert abs(float(curve.integral(2e4, 2e4 + 0.5).kappa_y) + 1.5) < 1e-14


def test_sums_are_flat_and_keep_the_first_length() -> None:
    total = (bc.Serpenoid(1.0, length=2.0) + bc.Spiral()) + (bc.Constant() + bc.Constant(1.0))
    assert [part.kind for part in total.parts] == ["serpenoid", "spiral", "constant", "constant"]
    assert total.length == 2.0
    assert total == bc.Sum(total.parts)
    assert np.array_equal(
        (bc.Spiral() + bc.Constant(kappa_y=1.0)).shape([0.1]).kappa_y, bc.Spiral().shape([0.1])[2] + 1
    )
    for bad in ([], [1.0], 3, [bc.Spiral(), "spiral"]):
        with pytest.raises(bp.InputError, match="parts"):
            bc.Sum(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("wavelengths", "period"),
    [((1.0, 0.5), 1.0), ((0.5, 1.0), 1.0), ((0.3, 0.1), 0.3), ((1.0, 0.7), None), ((1.0, 1.0 / 3.0, 0.25), 1.0)],
)
def test_period_of_a_sum(wavelengths: tuple, period: float | None) -> None:
    total = bc.Sum([bc.Serpenoid(1.0, w) for w in wavelengths] + [bc.Constant(kappa_y=0.3)])
    assert total.period == period
    assert bc.Sum([bc.Constant(), bc.Constant(1.0)]).period == 0.0
    assert (bc.Serpenoid(1.0) + bc.Segments([bc.Line(1.0)])).period is None


def test_period_of_an_untwisted_curve() -> None:
    wave = bc.Serpenoid(1.0, 0.5)
    assert (wave + bc.Constant(4.0 * np.pi)).untwisted().period == 0.5
    assert (wave + bc.Constant(-12.0 * np.pi)).untwisted().period == 0.5
    assert (wave + bc.Constant(6.0 * np.pi)).untwisted().period is None
    assert wave.untwisted() is wave
    assert bc.Constant(3.0, 0.0, 1.0).untwisted().period == 2.0 * np.pi / 3.0
    assert bc.Constant(3.0).untwisted().period == 0.0


@settings(max_examples=20, deadline=None)
@given(turn=st.floats(-9.0, 9.0), k=st.floats(-9.0, 9.0), direction=st.floats(-3.0, 3.0))
def test_untwisted_constant_is_the_spiral(turn: float, k: float, direction: float) -> None:
    curve = bc.Untwisted(bc.Constant(turn, -k * np.sin(direction), k * np.cos(direction)))
    spiral = bc.Spiral(k, turn, phase=direction)
    s = np.linspace(-1.0, 2.0, 20)
    for name in ("shape", "slope"):
        ours, theirs = np.stack(getattr(curve, name)(s)), np.stack(getattr(spiral, name)(s))
        assert np.abs(ours - theirs).max() < 1e-13 * (1.0 + abs(k)) * (1.0 + abs(turn))
    for ours, theirs in zip(curve.frames(s), spiral.frames(s), strict=True):
        assert np.abs(ours - theirs).max() < 1e-13


def test_refusals() -> None:
    for bad in (None, 3.0, {"kind": "spiral"}):
        with pytest.raises(bp.InputError, match="curve"):
            bc.Untwisted(bad)  # type: ignore[arg-type]
        with pytest.raises(bp.InputError, match="after"):
            bc.Transition(A, bad, 0.0, 1.0)  # type: ignore[arg-type]
    for width in (0.0, -1.0, np.nan):
        with pytest.raises(bp.InputError, match="width"):
            bc.Transition(A, B, 0.0, width)
        with pytest.raises(bp.InputError, match="width"):
            bc.Steering([0.0], [1.0], width)
    with pytest.raises(bp.InputError, match="width"):
        bc.Transition(A, B, 1e20, 1.0)
    with pytest.raises(bp.InputError, match="ascend"):
        bc.Steering([0.0, 0.0], [1.0, 2.0], 1.0)
    with pytest.raises(bp.InputError, match="one for each place"):
        bc.Steering([0.0, 1.0], [1.0], 1.0)
