"""What holds for every body curve: integrals, slopes, frames, tables."""

from __future__ import annotations

import json

import numpy as np
import pytest

import bodyplan as bp
from bodyplan import curves as bc
from bodyplan.curves.quadrature import shape_integral
from bodyplan.spatial import compose, curve_frames, exp, matrix_from_quaternion
from curve_cases import CURVES, SAMPLED, SEGMENTS, followed, integrated

EVERY = pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES.keys())
PLACES = np.array([0.83, -0.4, 0.0, 1.7, 0.31, 0.83])


@EVERY
def test_integrals(curve: bc.BodyCurve) -> None:
    pairs = [(-0.3, 0.2), (0.11, 0.93), (0.4, 1.9)]
    a, b = np.array(pairs).T
    exact = np.array([integrated(curve, x, y) for x, y in pairs])
    for values in (curve.integral(a, b), shape_integral(curve, a, b)):
        assert np.abs(np.stack(values, axis=-1) - exact).max() < 1e-13
    assert np.abs(np.stack(curve.integral(b, a), axis=-1) + exact).max() < 1e-13
    # any shapes that broadcast, and empty ones
    assert curve.integral(a[:, None], b).kappa_y.shape == (3, 3)
    assert curve.integral(0.1, 0.1) == (0.0, 0.0, 0.0)
    assert curve.integral(np.empty(0), 1.0).tau.shape == (0,)


@EVERY
def test_slopes_are_those_of_the_shape(curve: bc.BodyCurve) -> None:
    h = 1e-4
    s = np.linspace(-0.4, 1.6, 173)
    s = s[np.all(np.abs(s[:, None] - curve.breaks) > 3 * h, axis=1)]
    values = [np.stack(curve.shape(s + k * h)) for k in (-2, -1, 1, 2)]
    slope = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)
    assert np.abs(np.stack(curve.slope(s)) - slope).max() < 1e-8 * (1.0 + np.abs(slope).max())


@EVERY
def test_frames_against_an_independent_integrator(curve: bc.BodyCurve) -> None:
    start = exp([0.3, -0.2, 1.0, 0.4, -1.1, 0.7])
    turn = matrix_from_quaternion(start[3:])
    points, frames = curve.frames(PLACES, start)
    assert points.shape == (6, 3)
    assert frames.shape == (6, 3, 3)
    for i, s in enumerate(PLACES[:5]):
        point, frame = followed(curve, s) if s else (np.zeros(3), np.eye(3))
        assert np.abs(points[i] - (start[:3] + turn @ point)).max() < 1e-10
        assert np.abs(frames[i] - turn @ frame).max() < 1e-10
    assert np.array_equal(points[0], points[5])
    assert np.abs(np.swapaxes(frames, 1, 2) @ frames - np.eye(3)).max() < 1e-14


@EVERY
def test_frames_begin_at_the_start_of_the_curve(curve: bc.BodyCurve) -> None:
    points, frames = curve.frames([0.0, 0.2])
    assert np.abs(points[0] - curve.start[:3]).max() < 1e-15
    assert np.abs(frames[0] - matrix_from_quaternion(curve.start[3:])).max() < 1e-15
    # placed elsewhere, all moves with it
    move = exp([1.0, 2.0, -1.0, 0.2, 0.9, -0.3])
    there, turned = curve.frames([0.0, 0.2], compose(move, curve.start))
    R = matrix_from_quaternion(move[3:])
    assert np.abs(there - (move[:3] + points @ R.T)).max() < 1e-14
    assert np.abs(turned - R @ frames).max() < 1e-14


@EVERY
def test_untwisted_has_the_same_points_and_does_not_roll(curve: bc.BodyCurve) -> None:
    plain = curve.untwisted()
    s = np.linspace(-0.4, 1.6, 41)
    assert not plain.twisted
    assert not np.any(plain.shape(s).tau)
    assert curve.twisted == bool(np.any(curve.shape(s).tau))
    points, frames = curve.frames(s)
    same, level = plain.frames(s)
    # the general integrator, from the shape alone
    also, rolled = bc.BodyCurve.frames(plain, s, tolerance=1e-12)
    assert np.abs(same - points).max() < 1e-10
    assert np.abs(level[:, :, 0] - frames[:, :, 0]).max() < 1e-10
    assert np.abs(also - points).max() < 1e-10
    assert np.abs(rolled - level).max() < 1e-10
    assert plain.untwisted() is plain


@EVERY
def test_period(curve: bc.BodyCurve) -> None:
    s = np.linspace(-0.4, 1.6, 23)
    if curve.period is None:
        # none of these repeats after any of the lengths that occur in it
        for length in (0.4, 0.5, 0.7, 0.8, 1.0, 2.0 * np.pi / 3.0):
            assert np.abs(np.stack(curve.shape(s + length)) - np.stack(curve.shape(s))).max() > 1e-3
    else:
        after = np.stack(curve.shape(s + (curve.period or 0.7)))
        assert np.abs(after - np.stack(curve.shape(s))).max() < 1e-12


@EVERY
def test_breaks_are_all_the_jumps(curve: bc.BodyCurve) -> None:
    breaks = curve.breaks
    assert np.all(np.diff(breaks) > 0.0)
    assert not breaks.flags.writeable
    # the value behind, also right at the jump; where a curve of pieces ends, the value in it
    at = np.stack(curve.shape(breaks))
    before, behind = (np.stack(curve.shape(breaks + side)) for side in (-1e-12, 1e-12))
    ends = np.isin(breaks, [SEGMENTS.length, SAMPLED.length])
    assert np.abs(at - np.where(ends, before, behind)).max(initial=0.0) < 1e-9
    s = np.linspace(-0.4, 1.6, 2001)
    near = np.any((s[:-1, None] < breaks) & (breaks <= s[1:, None]), axis=1)
    steps = np.abs(np.diff(np.stack(curve.shape(s)), axis=1)).max(axis=0)
    slope = np.abs(np.stack(curve.slope(s))).max()
    assert np.all(steps[~near] <= 1.1e-3 * slope + 1e-12)


@EVERY
def test_tables_round_trip(curve: bc.BodyCurve) -> None:
    table = curve.to_dict()
    again = bc.from_dict(json.loads(json.dumps(table)))
    assert type(again) is type(curve)
    assert again == curve
    assert hash(again) == hash(curve)
    assert again.to_dict() == table
    assert again.length == curve.length
    s = np.linspace(-0.4, 1.6, 17)
    assert np.array_equal(np.stack(again.shape(s)), np.stack(curve.shape(s)))
    assert type(curve).__name__ in repr(curve)
    for other in CURVES.values():
        assert (other == curve) == (other is curve)


@EVERY
def test_refusals(curve: bc.BodyCurve) -> None:
    for call in (curve.shape, curve.slope, curve.frames, lambda s: curve.integral(0.0, s)):
        with pytest.raises(bp.InputError, match="finite"):
            call([0.1, np.nan])
    with pytest.raises(bp.InputError, match="at least one"):
        curve.frames([])
    with pytest.raises(bp.InputError, match="length 1"):
        curve.frames([0.1], [0, 0, 0, 2, 0, 0, 0])
    with pytest.raises(bp.InputError, match="tolerance"):
        curve.frames([0.1], tolerance=0.0)
    with pytest.raises(bp.InputError, match="broadcast"):
        curve.integral([0.0, 0.1], [0.0, 0.1, 0.2])
    with pytest.raises(TypeError):
        curve + 1.0  # type: ignore[operator]


def test_tables_take_texts_with_units() -> None:
    curve = bc.from_dict(
        {
            "kind": "sum",
            "parts": [
                {"kind": "serpenoid", "alpha": "60 deg", "wavelength": "640 mm"},
                {"kind": "constant", "kappa_y": "90 deg/m"},
                {"kind": "steering", "places": ["20 cm"], "values": ["1 / m"], "width": "1 ft"},
            ],
        }
    )
    other = bc.Serpenoid(np.pi / 3, 0.64) + bc.Constant(kappa_y=np.pi / 2) + bc.Steering([0.2], [1.0], 0.3048)
    s = np.linspace(0.0, 1.0, 11)
    assert np.abs(np.stack(curve.shape(s)) - np.stack(other.shape(s))).max() < 1e-14


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"kind": "serpent"}, "Did you mean 'serpenoid'"),
        ({"alpha": 1.0}, "a table with a kind"),
        ("serpenoid", "a table with a kind"),
        ({"kind": 3}, "unknown kind"),
        ({"kind": "serpenoid"}, "needs alpha"),
        ({"kind": "serpenoid", "alfa": 1.0}, "Did you mean 'alpha'"),
        ({"kind": "serpenoid", "alpha": "3 s"}, "curve.alpha"),
        ({"kind": "serpenoid", "alpha": 1.0, "plane": "roll"}, "unknown plane"),
        ({"kind": "serpenoid", "alpha": 1.0, "wavelength": 0.0}, "wavelength"),
        ({"kind": "sum", "parts": []}, "at least one"),
        ({"kind": "sum", "parts": {"kind": "spiral"}}, "a list of curves"),
        ({"kind": "sum", "parts": [{"kind": "spiral", "length": -1}]}, "length"),
        ({"kind": "untwisted", "curve": 3}, "curve.curve"),
        ({"kind": "sinus-lift", "alpha": 1.0, "lift": 0.2, "c1": "papers"}, "c1"),
        ({"kind": "constant", "tau": "1 m"}, "curve.tau"),
        ({"kind": "steering", "places": [1.0], "values": [], "width": 1.0}, "one for each place"),
    ],
)
def test_tables_refuse(table: object, text: str) -> None:
    with pytest.raises(bp.InputError, match=text):
        bc.from_dict(table)  # type: ignore[arg-type]


def test_nesting_is_bounded() -> None:
    table: dict[str, object] = {"kind": "spiral"}
    for _ in range(100):
        table = {"kind": "untwisted", "curve": table}
    with pytest.raises(bp.InputError, match="nested"):
        bc.from_dict(table)


def test_every_kind_is_registered() -> None:
    assert {type(curve) for curve in CURVES.values()} == set(bc.KINDS.values())
    for name in ("BodyCurve", "Sampled", "Segments", "Serpenoid", "SinusLift", "Spiral"):
        assert getattr(bp, name) is getattr(bc, name)


def test_a_curve_cannot_be_changed() -> None:
    curve = bp.Serpenoid(1.0)
    with pytest.raises(AttributeError, match="make a new one"):
        curve.alpha = 2.0
    assert curve.alpha == 1.0


@pytest.mark.parametrize(
    "curve",
    [
        bp.Serpenoid(1.1, 0.1),
        bp.SinusLift(1.3, 0.3, 0.1),
        bp.SinusLift(1.3, 0.3, 0.1, c1=0.02),
        bp.Serpenoid(0.8, 0.1, phase=0.4)
        + bp.Serpenoid(0.3, 0.1, phase=1.5, plane="pitch")
        + bc.Constant(0.5, 0.0, 1.0),
    ],
)
def test_far_along_a_periodic_curve(curve: bc.BodyCurve) -> None:
    # the same as going there step by step, ahead and back
    s = np.array([6.43, 6.2, -6.77, 0.03])
    near = curve.frames(s[3:])
    points, rotations = curve.frames(s)
    assert np.array_equal(points[3], near[0][0]) or np.abs(points[3] - near[0][0]).max() < 1e-14
    stepped, turned = curve_frames(lambda x: np.stack(curve.shape(x), axis=-1), [0.0, 6.2, 6.43], tolerance=1e-12)
    assert np.abs(points[[1, 0]] - stepped[1:]).max() < 1e-10
    assert np.abs(rotations[[1, 0]] - turned[1:]).max() < 1e-10
    back = curve.frames([-6.77, 0.0], np.array([0.3, 0.1, 0.2, 1.0, 0.0, 0.0, 0.0]))[0]
    assert np.abs(back[0] - points[2] - [0.3, 0.1, 0.2]).max() < 1e-12
    # and ten thousand periods on, a period is still the same screw
    there, turn = curve.frames([1000.0, 1000.1, 1000.2])
    first, second = (turn[i].T @ (there[i + 1] - there[i]) for i in (0, 1))
    assert np.abs(first - second).max() < 1e-9
    assert np.abs(turn[0].T @ turn[1] - turn[1].T @ turn[2]).max() < 1e-9


def test_the_end_of_a_curve_is_in_it() -> None:
    pieces = bp.Segments([{"kind": "line", "length": 0.2}, {"kind": "arc", "length": 0.3, "curvature": 4.0}])
    assert pieces.shape(pieces.length).kappa_y == 4.0
    assert pieces.shape(np.nextafter(pieces.length, 1.0)).kappa_y == 0.0
    sampled = bp.Sampled(pieces.frames(np.linspace(0.21, 0.5, 40))[0])
    assert abs(sampled.shape(sampled.length).kappa_y - 4.0) < 0.01
