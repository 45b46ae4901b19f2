"""Poses and twists: group axioms, SciPy's matrix exponential, adjoints by conjugation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from bodyplan.spatial import (
    adjoint,
    adjoint_inverse,
    apply,
    bracket,
    compose,
    exp,
    hat,
    inverse,
    log,
    matrix_from_pose,
    matrix_from_quaternion,
    pose_from_matrix,
    relative,
)

SHAPES = [(), (4,), (2, 3), (0,)]


def generator(xi: np.ndarray) -> np.ndarray:
    out = np.zeros((4, 4))
    out[:3, :3], out[:3, 3] = hat(xi[3:]), xi[:3]
    return out


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-14.0, 0.49))
def test_exp_is_the_matrix_exponential_and_log_undoes_it(seed: int, exponent: float) -> None:
    xi = np.random.default_rng(seed).normal(size=6)
    xi[3:] *= 10.0**exponent / np.linalg.norm(xi[3:])
    pose = exp(xi)
    assert np.abs(matrix_from_pose(pose) - expm(generator(xi))).max() < 5e-15
    assert np.abs(log(pose) - xi).max() < 1e-14


@pytest.mark.parametrize("gap", [1e-2, 1e-5, 1e-8, 1e-12])
def test_log_near_a_half_turn(gap: float) -> None:
    xi = np.array([0.3, -0.7, 0.2, *((np.pi - gap) * np.array([0.36, 0.48, -0.8]))])
    assert np.abs(log(exp(xi)) - xi).max() < 1e-14


@pytest.mark.parametrize("shape", SHAPES)
def test_group_axioms(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(2)
    a, b, c = (exp(rng.normal(size=(*shape, 6))) for _ in range(3))
    p = rng.normal(size=(*shape, 3))
    assert compose(a, b).shape == (*shape, 7)
    assert np.allclose(compose(compose(a, b), c), compose(a, compose(b, c)), rtol=0, atol=4e-15)
    assert np.allclose(compose(a, inverse(a)), [0, 0, 0, 1, 0, 0, 0], rtol=0, atol=2e-15)
    assert np.allclose(relative(a, b), compose(inverse(a), b), rtol=0, atol=4e-15)
    assert np.allclose(apply(compose(a, b), p), apply(a, apply(b, p)), rtol=0, atol=4e-15)
    assert np.allclose(matrix_from_pose(compose(a, b)), matrix_from_pose(a) @ matrix_from_pose(b), rtol=0, atol=4e-15)
    assert np.allclose(pose_from_matrix(matrix_from_pose(a)), a, rtol=0, atol=2e-15)


def test_broadcasting() -> None:
    rng = np.random.default_rng(3)
    a, b = exp(rng.normal(size=(3, 1, 6))), exp(rng.normal(size=(4, 6)))
    assert compose(a, b).shape == (3, 4, 7)
    assert np.array_equal(compose(a, b)[1, 2], compose(a[1, 0], b[2]))


def test_adjoint_is_conjugation() -> None:
    rng = np.random.default_rng(4)
    a, xi, eta = exp(rng.normal(size=6)), rng.normal(size=6), rng.normal(size=6)
    T, R = matrix_from_pose(a), matrix_from_quaternion(a[3:])
    moved = T @ generator(xi) @ np.linalg.inv(T)
    assert np.abs(generator(adjoint(a[:3], R) @ xi) - moved).max() < 1e-14
    assert np.abs(adjoint(a[:3], R) @ adjoint_inverse(a[:3], R) - np.eye(6)).max() < 1e-14
    x, y = generator(xi), generator(eta)
    assert np.abs(generator(bracket(xi, eta)) - (x @ y - y @ x)).max() < 1e-14
    # Ad of exp(xi) to first order is the bracket
    h = 1e-6
    small = exp(h * xi)
    first = (adjoint(small[:3], matrix_from_quaternion(small[3:])) @ eta - eta) / h
    assert np.abs(first - bracket(xi, eta)).max() < 1e-5
