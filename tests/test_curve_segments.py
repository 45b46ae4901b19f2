"""Lines, arcs and helices end to end: closed forms, every way to give them, refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.curves import Bend, Constant, Helix, Line, from_dict
from bodyplan.curves.quadrature import shape_integral


def test_circle_helix_and_line() -> None:
    curve = bp.Segments(
        [Line(0.3), {"kind": "arc", "radius": 0.2, "angle": "90 deg"}, {"kind": "arc", "length": 0.1, "radius": 0.1}]
    )
    points, frames = curve.frames([-1.0, 0.3, curve.length - 0.1, 0.3 + 0.1 * np.pi, curve.length, curve.length + 2.0])
    assert np.abs(points[0] - [-1.0, 0.0, 0.0]).max() < 1e-15
    assert np.abs(points[1] - [0.3, 0.0, 0.0]).max() < 1e-15
    assert np.abs(points[2] - [0.5, 0.2, 0.0]).max() < 1e-15
    assert np.abs(points[3] - points[2]).max() < 1e-15
    heading = np.pi / 2 + 1.0
    end = points[2] + 0.1 * np.array([np.sin(heading) - 1.0, -np.cos(heading), 0.0])
    assert np.abs(points[4] - end).max() < 1e-15
    assert np.abs(points[5] - end - 2.0 * np.array([np.cos(heading), np.sin(heading), 0.0])).max() < 1e-14
    assert np.abs(frames[:, :, 2] - [0.0, 0.0, 1.0]).max() < 1e-15


@settings(max_examples=40, deadline=None)
@given(
    radius=st.floats(0.02, 2.0),
    pitch=st.floats(-1.0, 1.0),
    turns=st.floats(0.1, 3.0),
    direction=st.floats(-4.0, 4.0),
)
def test_helix_has_its_radius_pitch_and_turns(radius: float, pitch: float, turns: float, direction: float) -> None:
    curve = bp.Segments([Helix(radius=radius, pitch=pitch, turns=turns, direction=direction)])
    assert curve.length == pytest.approx(turns * np.hypot(2 * np.pi * radius, pitch), rel=1e-14)
    s = np.linspace(0.0, curve.length, 50)
    points = curve.frames(s)[0]
    # the axis: through the centre, along torsion e_r + curvature e_r x n with n towards the centre
    towards = np.array([0.0, np.cos(direction), np.sin(direction)])
    rise = pitch / (2 * np.pi)
    axis = (rise * np.array([1.0, 0.0, 0.0]) + radius * np.cross([1.0, 0.0, 0.0], towards)) / np.hypot(radius, rise)
    from_axis = points - radius * towards
    height = from_axis @ axis
    assert np.abs(np.linalg.norm(from_axis - height[:, None] * axis, axis=1) - radius).max() < 1e-13 * (1 + radius)
    assert abs(height[-1] - turns * pitch) < 1e-13 * (1.0 + curve.length)
    # the same by curvature and torsion
    square = radius**2 + rise**2
    other = bp.Segments(
        [Helix(curvature=radius / square, torsion=rise / square, length=curve.length, direction=direction)]
    )
    assert np.abs(other.frames(s)[0] - points).max() < 1e-13 * (1.0 + curve.length)


def test_torsion_of_points_is_torsion_plus_twist() -> None:
    # three ways to the same points: a bend that turns in the frame, a frame that rolls, half of each
    s = np.linspace(0.0, 0.5, 20)
    ways = [
        Helix(curvature=6.0, torsion=4.0, length=0.5),
        Bend(curvature=6.0, length=0.5, twist=4.0),
        Helix(curvature=6.0, torsion=1.0, length=0.5, twist=3.0),
        (0.5, 4.0, 0.0, 6.0),
    ]
    curves = [bp.Segments([way]) for way in ways]
    for curve in curves[1:]:
        assert np.abs(curve.frames(s)[0] - curves[0].frames(s)[0]).max() < 1e-14
    assert [curve.twisted for curve in curves] == [False, True, True, True]
    # a helix without twist is the paper's spiral, eq. (5)
    inside = s[:-1]
    spiral = bp.Spiral(6.0, 4.0)
    assert np.abs(np.stack(curves[0].shape(inside)) - np.stack(spiral.shape(inside))).max() < 1e-14
    assert np.abs(curves[0].frames(s)[1] - spiral.frames(s)[1]).max() < 1e-14


@pytest.mark.parametrize(
    ("piece", "same"),
    [
        ({"length": 0.3, "angle": 0.6}, {"length": 0.3, "curvature": 2.0}),
        ({"length": 0.3, "radius": 0.5}, {"length": 0.3, "curvature": 2.0}),
        ({"radius": 0.5, "angle": 0.6}, {"length": 0.3, "curvature": 2.0}),
        ({"curvature": 2.0, "angle": 0.6}, {"length": 0.3, "curvature": 2.0}),
        ({"radius": 0.5, "angle": -0.6}, {"length": 0.3, "curvature": -2.0}),
        ({"radius": -0.5, "angle": 0.6}, {"length": 0.3, "curvature": -2.0}),
        ({"curvature": -2.0, "angle": -0.6}, {"length": 0.3, "curvature": 2.0}),
        ({"length": 0.3, "angle": -0.6}, {"length": 0.3, "curvature": 2.0, "direction": np.pi}),
        ({"length": "300 mm", "angle": "0.6 rad"}, {"length": 0.3, "radius": "50 cm"}),
    ],
)
def test_ways_to_give_an_arc(piece: dict, same: dict) -> None:
    curves = [bp.Segments([{"kind": "arc", **table}]) for table in (piece, same)]
    s = np.linspace(0.0, 0.29, 9)
    assert curves[0].length == pytest.approx(0.3, rel=1e-15)
    assert np.abs(np.stack(curves[0].shape(s)) - np.stack(curves[1].shape(s))).max() < 1e-14


def test_directions() -> None:
    ends = [bp.Segments([Bend(length=0.1, angle=0.5, direction=d)]).frames([0.1])[0][0] for d in (0.0, np.pi / 2)]
    assert ends[0][1] > 0.02  # to the left
    assert abs(ends[0][2]) < 1e-15
    assert ends[1][2] > 0.02  # up
    assert abs(ends[1][1]) < 1e-15


pieces = st.one_of(
    st.builds(Line, st.floats(0.01, 1.0), st.floats(-9.0, 9.0)),
    st.builds(
        Bend,
        length=st.floats(0.01, 1.0),
        angle=st.floats(-3.0, 3.0),
        direction=st.floats(-4.0, 4.0),
        twist=st.floats(-9.0, 9.0),
    ),
    st.builds(
        Helix,
        curvature=st.floats(-9.0, 9.0),
        torsion=st.floats(-9.0, 9.0),
        length=st.floats(0.01, 1.0),
        direction=st.floats(-4.0, 4.0),
        twist=st.floats(-9.0, 9.0),
    ),
    st.tuples(st.floats(0.01, 1.0), *[st.floats(-9.0, 9.0)] * 3),
)


@settings(max_examples=40, deadline=None)
@given(parts=st.lists(pieces, min_size=1, max_size=5))
def test_any_pieces(parts: list) -> None:
    curve = bp.Segments(parts)
    s = np.linspace(-0.3, curve.length + 0.3, 29)
    # exact integrals and frames against the general ways
    exact, numeric = np.stack(curve.integral(s, s[::-1])), np.stack(shape_integral(curve, s, s[::-1]))
    assert np.abs(exact - numeric).max() < 1e-13
    points, frames = curve.frames(s)

    class Plain(bp.BodyCurve):
        length, breaks, slope, to_dict = curve.length, curve.breaks, curve.slope, curve.to_dict

        def shape(self, s):
            return curve.shape(s)

    general, turned = Plain().frames(s, tolerance=1e-12)
    assert np.abs(points - general).max() < 1e-11
    assert np.abs(frames - turned).max() < 1e-11
    assert np.abs(np.swapaxes(frames, 1, 2) @ frames - np.eye(3)).max() < 1e-14
    assert from_dict(json.loads(json.dumps(curve.to_dict()))) == curve
    # one piece alone, then the others from its end
    whole = sum(part[0] if isinstance(part, tuple) else part.size for part in parts)
    assert curve.length == pytest.approx(whole, rel=1e-14)


def test_straight_outside_and_the_value_behind_a_jump() -> None:
    curve = bp.Segments([(0.5, 1.0, 2.0, 3.0)])
    assert np.array_equal(curve.shape([-1e-9, 0.0, 0.25, 0.5, 0.5 + 1e-9]).kappa_y, [0.0, 3.0, 3.0, 3.0, 0.0])
    assert np.array_equal(curve.breaks, [0.0, 0.5])
    assert np.abs(np.stack(curve.integral(-3.0, 7.0)) - [0.5, 1.0, 1.5]).max() < 1e-15
    inner = Constant(1.0, 2.0, 3.0)
    assert np.abs(curve.frames([0.1, 0.5])[0] - inner.frames([0.1, 0.5])[0]).max() < 1e-15


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ([], "at least one"),
        ({"kind": "line", "length": 1.0}, "expected a list"),
        ("line", "expected a list"),
        ([{"kind": "lines", "length": 1.0}], r"pieces\[0\].*Did you mean 'line'"),
        ([{"length": 1.0}], "kind of piece"),
        ([{"kind": "line"}], "needs length"),
        ([Line(1.0), {"kind": "arc", "length": 1.0}], r"pieces\[1\].*two of length"),
        ([{"kind": "arc", "length": 1.0, "angle": 1.0, "radius": 1.0}], "two of length"),
        ([{"kind": "arc", "curvature": 1.0, "radius": 1.0}], "two of length"),
        ([{"kind": "arc", "length": 0.0, "angle": 1.0}], "length"),
        ([{"kind": "arc", "length": 1.0, "radius": 0.0}], "radius"),
        ([{"kind": "arc", "curvature": 0.0, "angle": 1.0}], "needs a length"),
        ([{"kind": "arc", "curvature": 1.0, "angle": 0.0}], "needs a length"),
        ([{"kind": "arc", "length": 1.0, "bend": 1.0}], "unknown option 'bend'"),
        ([{"kind": "arc", "length": "1 s", "angle": 1.0}], "not a length"),
        ([{"kind": "helix", "length": 1.0}], "curvature and torsion"),
        ([{"kind": "helix", "length": 1.0, "curvature": 1.0, "pitch": 1.0}], "curvature and torsion"),
        ([{"kind": "helix", "radius": 1.0, "pitch": 1.0}], "length or turns"),
        ([{"kind": "helix", "radius": 1.0, "pitch": 1.0, "length": 1.0, "turns": 1.0}], "length or turns"),
        ([{"kind": "helix", "radius": -1.0, "pitch": 1.0, "turns": 1.0}], "radius"),
        ([{"kind": "helix", "curvature": 0.0, "torsion": 0.0, "turns": 1.0}], "turns"),
        ([(1.0, 2.0, 3.0)], r"pieces\[0\].*shape"),
        ([(1.0, 2.0, np.inf, 3.0)], "finite"),
        ([(-1.0, 2.0, 3.0, 3.0)], "length"),
        ([(1e20, 0.0, 0.0, 0.0), (1e-3, 0.0, 0.0, 1.0)], "too different"),
        ([None], r"pieces\[0\]"),
        ([3.0], r"pieces\[0\]: a table with a kind, or \(length, tau, kappa_p, kappa_y\)"),
    ],
)
def test_refusals(given: object, text: str) -> None:
    with pytest.raises(bp.InputError, match=text):
        bp.Segments(given)  # type: ignore[arg-type]
