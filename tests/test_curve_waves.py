"""Serpenoid, spiral, sinus-lifting: closed forms, the level c1, refusals."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import jv

import bodyplan as bp
from bodyplan.curves.quadrature import shape_integral

ALPHA, LIFT = 5.0 * np.pi / 12.0, 0.3
numbers = st.floats(-3.0, 3.0)
sizes = st.floats(0.05, 3.0)
twists = st.one_of(st.floats(-30.0, 30.0), st.sampled_from([0.0, 1e-9, -1e-30]))


def test_serpenoid_heading_and_advance() -> None:
    curve = bp.Serpenoid(np.pi / 3, 0.8)
    # heading alpha (1 - cos x): back where it was after a wavelength, 2 alpha half way
    assert abs(float(curve.integral(0.0, 0.4).kappa_y) - 2.0 * np.pi / 3) < 1e-15
    assert abs(float(curve.integral(0.0, 0.8).kappa_y)) < 1e-15
    # a wavelength advances by J0(alpha) along the mean heading alpha
    points, _ = curve.frames([0.8])
    along = 0.8 * jv(0, np.pi / 3) * np.array([np.cos(np.pi / 3), np.sin(np.pi / 3), 0.0])
    assert np.abs(points[0] - along).max() < 1e-12


@settings(max_examples=40, deadline=None)
@given(alpha=numbers, wavelength=sizes, phase=numbers, lift=st.floats(-1.0, 1.0), c1=numbers, a=numbers, b=numbers)
def test_integrals_of_waves(
    alpha: float, wavelength: float, phase: float, lift: float, c1: float, a: float, b: float
) -> None:
    k = 2 * mpmath.pi / mpmath.mpf(wavelength)
    x, y = k * mpmath.mpf(a) + phase, k * mpmath.mpf(b) + phase
    # what rounding of the angle alone may cost
    room = 1e-15 * (4.0 + float(abs(x) + abs(y))) * (1.0 + abs(alpha) + abs(lift) + abs(c1))
    yaw = alpha * (mpmath.cos(x) - mpmath.cos(y))
    pitch = c1 * (y - x) - mpmath.mpf(lift) / 2 * (mpmath.sin(2 * y) - mpmath.sin(2 * x))
    wave = bp.Serpenoid(alpha, wavelength, phase=phase, plane="pitch").integral(a, b)
    assert abs(wave.kappa_p - float(yaw)) < room
    assert wave.kappa_y == wave.tau == 0.0
    lifted = bp.SinusLift(alpha, lift, wavelength, c1, phase=phase).integral(a, b)
    assert abs(lifted.kappa_y - float(yaw)) < room
    assert abs(lifted.kappa_p - float(pitch)) < room


@settings(max_examples=40, deadline=None)
@given(k=st.floats(-20.0, 20.0), t=twists, phase=numbers, s=numbers)
def test_spiral_is_a_helix(k: float, t: float, phase: float, s: float) -> None:
    curve = bp.Spiral(k, t, phase=phase)
    point, rotation = (value[0] for value in curve.frames([s]))
    # the helix of curvature k and torsion t: about its axis (Darboux vector t e_r + k e_y of the rolled frame)
    size = np.hypot(k, t)
    turn = np.array([[1, 0, 0], [0, np.cos(phase), -np.sin(phase)], [0, np.sin(phase), np.cos(phase)]])
    forward = np.array([1.0, 0.0, 0.0])
    axis = np.array([t, 0.0, k]) / size if size > 0.0 else forward
    across, along = forward - (forward @ axis) * axis, (forward @ axis) * axis
    side = np.cross(axis, forward)
    if size > 0.0:
        rise = 2.0 * np.sin(0.5 * size * s) ** 2 / size  # (1 - cos)/size without its cancellation
        place = along * s + across * np.sin(size * s) / size + side * rise
    else:
        place = forward * s
    e_r = along + across * np.cos(size * s) + side * np.sin(size * s)
    room = 1e-14 * (1.0 + size * abs(s)) * (1.0 + abs(s))
    assert np.abs(point - turn @ place).max() < room
    assert np.abs(rotation[:, 0] - turn @ e_r).max() < room
    assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-14
    # e_y, e_p: no roll, and the curvature vector is k cos e_p + k sin e_y
    shape = curve.shape(s)
    bend = turn @ (k * (np.cross(axis, e_r) * size / k if k else np.zeros(3)))
    assert np.abs(shape.kappa_y * rotation[:, 1] - shape.kappa_p * rotation[:, 2] - bend).max() < 20 * room
    exact, numeric = curve.integral(-0.3, s), shape_integral(curve, -0.3, s)
    assert max(abs(float(u - v)) for u, v in zip(exact, numeric, strict=True)) < 1e-13


def test_spiral_defaults_are_the_papers() -> None:
    curve = bp.Spiral(length=2.0)
    assert (curve.curvature, curve.twist) == (6.0, 1.8)
    assert curve.period == 2.0 * np.pi / 1.8
    assert bp.Spiral(3.0, 0.0).period == 0.0


def test_c1_of_the_paper_and_level() -> None:
    paper = bp.SinusLift(ALPHA, LIFT, c1="paper")
    assert round(paper.c1, 5) == -0.09185
    assert abs(paper.c1 + (0.043 * ALPHA**4 + 0.105 * ALPHA**2) * LIFT) < 1e-16
    level = bp.SinusLift(ALPHA, LIFT)
    assert abs(level.c1 + 0.0895123330077702) < 1e-12
    assert level.to_dict()["c1"] is None
    assert paper.to_dict()["c1"] == "paper"
    assert bp.SinusLift(ALPHA, LIFT, c1=-0.09).c1 == -0.09
    # eq. (37) does not keep level, by some hundredths of a rad a wavelength
    turned = paper.frames([1.0])[1][0]
    assert 1e-3 < np.arccos((np.trace(turned) - 1.0) / 2.0) < 0.1


@pytest.mark.parametrize("alpha", [0.3, 1.0, ALPHA, 1.8, 2.6, 3.5])
def test_c1_to_first_order(alpha: float) -> None:
    # -lift J2 / J0; odd in the lift, so that what is left falls with its square
    off = []
    for lift in (1e-2, 1e-3):
        c1 = bp.SinusLift(alpha, lift).c1
        off.append(abs(c1 / lift + jv(2, alpha) / jv(0, alpha)))
        assert bp.SinusLift(alpha, -lift).c1 == pytest.approx(-c1, abs=1e-15)
    assert off[1] < 1e-3
    assert 95.0 < off[0] / off[1] < 105.0


@settings(max_examples=25, deadline=None)
@given(alpha=st.floats(-1.7, 1.7), lift=st.floats(-0.5, 0.5), wavelength=sizes, phase=numbers)
def test_level_over_a_wavelength(alpha: float, lift: float, wavelength: float, phase: float) -> None:
    curve = bp.SinusLift(alpha, lift, wavelength, phase=phase)
    s = np.array([0.0, 0.3, 1.0, 1.3]) * wavelength
    points, frames = curve.frames(s, tolerance=1e-12)
    assert np.abs(frames[2] - frames[0]).max() < 1e-11
    assert np.abs(frames[3] - frames[1]).max() < 1e-11
    # seen from where kappa_y = 0 the curve advances in its own plane: e_y of that place
    first = bp.SinusLift(alpha, lift, wavelength)
    points, frames = first.frames(np.array([0.0, 0.5, 1.0]) * wavelength, tolerance=1e-12)
    assert np.abs(frames[1][:, 2] - [0.0, 0.0, 1.0]).max() < 1e-11
    assert abs(points[2, 2]) < 1e-11


def test_bends_are_lifted() -> None:
    curve = bp.SinusLift(ALPHA, LIFT)
    points, _ = curve.frames(np.array([0.0, 0.25, 0.5, 0.75, 1.0]))
    assert points[1, 2] > 0.01
    assert points[3, 2] > 0.01
    assert np.abs(points[[0, 2, 4], 2]).max() < 1e-10


def test_no_level_value() -> None:
    for alpha, lift in ((2.0, 0.3), (2.4048255576957727, 0.01), (2.4048, 0.3), (1.8, 1.0), (1.0, 1e9), (1e5, 0.1)):
        with pytest.raises(bp.InputError, match="c1"):
            bp.SinusLift(alpha, lift)
        assert bp.SinusLift(alpha, lift, c1=0.0).c1 == 0.0
    # the value before it ceases to exist, found another way: two roots of the pitch over half a wavelength meet
    assert -0.56 < bp.SinusLift(2.0, 0.28).c1 < -0.55


def test_refusals() -> None:
    for cls, good in ((bp.Serpenoid, (1.0,)), (bp.SinusLift, (1.0, 0.1)), (bp.Spiral, ())):
        for length in (0.0, -1.0, np.inf, "1 m"):
            with pytest.raises(bp.InputError, match="length"):
                cls(*good, length=length)
        with pytest.raises(bp.InputError, match="phase"):
            cls(*good, phase=np.nan)
    with pytest.raises(bp.UnknownNameError, match="plane"):
        bp.Serpenoid(1.0, plane="roll")
    with pytest.raises(bp.InputError, match="paper"):
        bp.SinusLift(1.0, 0.1, c1="level")


def test_quadrature_of_rough_shapes() -> None:
    class Rough(bp.BodyCurve):
        length = 1.0

        def shape(self, s):
            x = np.asarray(s, dtype=float)
            return bp.curves.Shape(np.sqrt(np.abs(x - 0.3)), np.where(x < 0.7, 1.0, -2.0), np.exp(-((50 * x) ** 2)))

        def slope(self, s):
            raise NotImplementedError

        def to_dict(self):
            return {}

    # neither the root nor the jump is among the breaks
    a, b = np.array([-1.0, 0.0, 0.31]), np.array([2.0, 0.69, 0.9])
    values = shape_integral(Rough(), a, b)
    for i in range(3):
        root = [(x - 0.3) * np.sqrt(abs(x - 0.3)) / 1.5 for x in (a[i], b[i])]
        assert abs(values.tau[i] - (root[1] - root[0])) < 1e-13
        assert abs(values.kappa_p[i] - (min(b[i], 0.7) - a[i] - 2.0 * max(b[i] - 0.7, 0.0))) < 1e-13
        assert abs(values.kappa_y[i] - quad(lambda x: np.exp(-((50 * x) ** 2)), a[i], b[i], points=[0.0])[0]) < 1e-13


def test_many_intervals_far_away() -> None:
    # a gait that has run long: the table follows, and large sums do not spoil small differences
    curve = bp.Serpenoid(1.0) + bp.curves.Constant(3.0)
    plain = curve.untwisted()
    for far in (0.0, 1e3, 12.0, -1e4):
        a = far + np.linspace(0.0, 2.0, 4001)
        values = plain.integral(a, a + 0.1)
        for i in (0, 1234, 4000):
            psi = float(curve.integral(0.0, a[i]).tau)
            exact = quad(
                lambda s, a=a[i], psi=psi: float(curve.shape(s).kappa_y) * np.cos(psi + 3.0 * (s - a)), a[i], a[i] + 0.1
            )[0]
            assert abs(values.kappa_y[i] - exact) < 1e-13 + 1e-15 * abs(far)
