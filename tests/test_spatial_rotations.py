"""Rotations and the functions of an angle under them, against mpmath, SciPy and the group axioms."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bodyplan.spatial import (
    canonical,
    conjugate,
    hat,
    left_jacobian,
    matrix_from_quaternion,
    multiply,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    rotate,
    rotation_exp,
    rotation_log,
)
from bodyplan.spatial.coefficients import coefficients, inverse_coefficient

mpmath.mp.dps = 50
SHAPES = [(), (4,), (2, 3), (0,), (2, 0, 3)]
# angles where formulas of this kind lose digits: zero, underflow, the switch of the series, pi, 2 pi
ANGLES = [0.0, 1e-300, 1e-160, 1e-9, 1e-5, 1e-3, 0.1, 0.999, 1.0, 1.001, 2.0, 3.0, np.pi - 1e-8, np.pi, 4.0, 6.0]


def directions() -> st.SearchStrategy[np.ndarray]:
    number = st.floats(-1.0, 1.0)
    return (
        st.tuples(number, number, number)
        .map(np.array)
        .filter(lambda v: np.linalg.norm(v) > 1e-3)
        .map(lambda v: v / np.linalg.norm(v))
    )


def angles() -> st.SearchStrategy[float]:
    near_zero = st.floats(-18.0, 0.0).map(lambda e: 10.0**e)
    near_pi = st.floats(-14.0, -1.0).map(lambda e: np.pi - 10.0**e)
    return st.one_of(st.floats(0.0, 3.1), near_zero, near_pi)


@pytest.mark.parametrize("x", [*ANGLES, 6.283, 2 * np.pi - 1e-6, 6.5, 50.0])
def test_coefficients_against_mpmath(x: float) -> None:
    z = mpmath.mpf(x)
    if x == 0.0:
        want = [1, 0.5, mpmath.mpf(1) / 6]
    else:
        with mpmath.workdps(2500):
            want = [mpmath.sin(z) / z, (1 - mpmath.cos(z)) / z**2, (z - mpmath.sin(z)) / z**3]
    got = coefficients(np.float64(x))
    for g, w in zip(got, want, strict=True):
        # relative, except near the zeros of a function, where the size of its terms counts
        assert abs(float(g) - float(w)) <= 1e-15 * max(abs(float(w)), 1.0 / max(1.0, x * x)), x
    if x < 6.2:
        with mpmath.workdps(2500):
            d = mpmath.mpf(1) / 12 if x == 0 else (1 - z / 2 * mpmath.cot(z / 2)) / z**2
        assert float(inverse_coefficient(np.float64(x))) == pytest.approx(float(d), rel=3e-15)


@pytest.mark.parametrize("x", ANGLES)
def test_exp_is_the_matrix_exponential(x: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    want = mpmath.expm(mpmath.matrix(hat(x * axis).tolist()))
    assert np.abs(rotation_exp(x * axis) - np.array(want.tolist(), dtype=float)).max() < 5e-16


@settings(max_examples=60, deadline=None)
@given(directions(), angles())
def test_log_undoes_exp(axis: np.ndarray, angle: float) -> None:
    phi = angle * axis
    assert np.abs(quaternion_log(quaternion_exp(phi)) - phi).max() <= 4e-15
    assert np.abs(rotation_log(rotation_exp(phi)) - phi).max() <= 4e-15


@settings(max_examples=60, deadline=None)
@given(directions(), angles())
def test_matrix_and_quaternion_agree_with_scipy(axis: np.ndarray, angle: float) -> None:
    reference = Rotation.from_rotvec(angle * axis)
    q = canonical(quaternion_exp(angle * axis))
    assert np.abs(matrix_from_quaternion(q) - reference.as_matrix()).max() < 1e-15
    theirs = canonical(np.roll(reference.as_quat(), 1))
    assert min(np.abs(q - theirs).max(), np.abs(q + theirs).max()) < 1e-15
    assert np.abs(quaternion_from_matrix(reference.as_matrix()) - q).max() < 1e-15


@pytest.mark.parametrize(
    "axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (-0.6, 0, 0.8), (2 / 3, -2 / 3, 1 / 3)]
)
def test_half_turns(axis: tuple[float, float, float]) -> None:
    R = 2.0 * np.outer(axis, axis) - np.eye(3)
    q = quaternion_from_matrix(R)
    lead = np.flatnonzero(np.abs(q) > 1e-12)[0]
    assert q[lead] > 0.0
    assert np.abs(matrix_from_quaternion(q) - R).max() < 1e-15
    assert np.linalg.norm(rotation_log(R)) == pytest.approx(np.pi, rel=1e-15)


@pytest.mark.parametrize("shape", SHAPES)
def test_group_axioms(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    a, b, c = (quaternion_exp(rng.normal(size=(*shape, 3)) * 10.0 ** rng.uniform(-9, 0.5)) for _ in range(3))
    v = rng.normal(size=(*shape, 3))
    one = np.array([1.0, 0.0, 0.0, 0.0])
    assert multiply(a, b).shape == (*shape, 4)
    assert np.allclose(multiply(multiply(a, b), c), multiply(a, multiply(b, c)), rtol=0, atol=1e-15)
    assert np.allclose(multiply(a, conjugate(a)), one, rtol=0, atol=1e-15)
    assert np.array_equal(multiply(a, one), a)
    assert np.allclose(rotate(multiply(a, b), v), rotate(a, rotate(b, v)), rtol=0, atol=2e-15)
    R = matrix_from_quaternion(a)
    assert R.shape == (*shape, 3, 3)
    assert np.allclose(np.swapaxes(R, -1, -2) @ R, np.eye(3), rtol=0, atol=1e-15)
    assert np.allclose((R @ v[..., None])[..., 0], rotate(a, v), rtol=0, atol=2e-15)
    assert np.allclose(matrix_from_quaternion(multiply(a, b)), R @ matrix_from_quaternion(b), rtol=0, atol=2e-15)


def test_canonical_sign() -> None:
    assert np.array_equal(canonical([-0.5, 0.5, 0.5, -0.5]), [0.5, -0.5, -0.5, 0.5])
    assert np.array_equal(canonical([0.0, 0.0, -1.0, 0.0]), [0.0, 0.0, 1.0, 0.0])
    assert not np.signbit(canonical([-0.0, -1.0, 0.0, -0.0])).any()


@pytest.mark.parametrize("x", ANGLES)
def test_left_jacobian_is_the_integral_of_exp(x: float) -> None:
    phi = x * np.array([0.48, -0.6, 0.64])
    nodes, weights = np.polynomial.legendre.leggauss(30)
    integral = sum(w / 2 * rotation_exp((u + 1) / 2 * phi) for u, w in zip(nodes, weights, strict=True))
    assert np.abs(left_jacobian(phi) - integral).max() < 2e-15
