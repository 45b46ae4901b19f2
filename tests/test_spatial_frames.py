"""Frames along a curve: closed forms, order, jumps, an independent integrator, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bodyplan.errors import InputError, SolveError
from bodyplan.spatial import GAUSS_NODES, curve_frames, exp, frames_from_nodes, hat, matrix_from_quaternion

START = np.array([0.3, -0.2, 1.0, 0.5, 0.5, -0.5, 0.5])


def twisted(s: np.ndarray) -> np.ndarray:
    return np.stack([0.3 * np.cos(2 * s), 1.5 * np.sin(3 * s + 0.2), 2 * np.cos(s)], axis=-1)


def sampled(shape, length: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    h = np.full(steps, length / steps)
    return shape((np.arange(steps)[:, None] + np.array(GAUSS_NODES)) * length / steps), h


@pytest.fixture(scope="module")
def reference() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Paper acm eq. (1) as it is printed, row by row, integrated by DOP853."""

    def rates(s: float, y: np.ndarray) -> np.ndarray:
        e_r, e_p, e_y = y[3:6], y[6:9], y[9:12]
        tau, kappa_p, kappa_y = twisted(np.array([s]))[0]
        return np.concatenate(
            [e_r, kappa_y * e_p - kappa_p * e_y, -kappa_y * e_r + tau * e_y, kappa_p * e_r - tau * e_p]
        )

    s = np.linspace(0.0, 5.0, 21)
    begin = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    y = solve_ivp(rates, (0.0, 5.0), begin, method="DOP853", rtol=3e-14, atol=1e-15, t_eval=s).y.T
    return s, y[:, :3], np.swapaxes(y[:, 3:].reshape(-1, 3, 3), 1, 2)


def test_against_an_independent_integrator(reference) -> None:
    s, points, frames = reference
    c, R = curve_frames(twisted, s)
    assert np.abs(c - points).max() < 1e-12
    assert np.abs(R - frames).max() < 1e-12
    assert np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max() < 1e-14


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-10])
def test_error_is_within_the_tolerance(reference, tolerance: float) -> None:
    s, points, frames = reference
    # few stations, so that the steps are the rule's own
    c, R = curve_frames(twisted, s[[0, -1]], tolerance=tolerance)
    assert np.abs(c[-1] - points[-1]).max() < tolerance
    assert np.abs(R[-1] - frames[-1]).max() < tolerance


def test_order_six(reference) -> None:
    _, points, _ = reference
    errors = []
    for steps in (40, 80):
        u, h = sampled(twisted, 5.0, steps)
        errors.append(np.abs(frames_from_nodes(u, h)[-1, :3] - points[-1]).max())
    assert 5.7 < np.log2(errors[0] / errors[1]) < 6.5


def test_constant_shape_is_one_screw() -> None:
    shape = np.array([0.7, -1.2, 2.0])
    s = np.array([0.0, 0.4, 3.0, 3.0, 11.0])
    c, R = curve_frames(lambda t: np.tile(shape, (len(t), 1)), s, START)
    rest = exp(np.outer(s, [1.0, 0.0, 0.0, *shape]))
    R0 = matrix_from_quaternion(START[3:])
    assert np.abs(c - (START[:3] + rest[:, :3] @ R0.T)).max() < 2e-14
    assert np.abs(R - R0 @ matrix_from_quaternion(rest[:, 3:])).max() < 2e-14
    poses = frames_from_nodes(np.tile(shape, (1, 3, 1)), [11.0], START)
    assert np.abs(poses[-1, :3] - c[-1]).max() < 2e-14


def test_straight_line_and_circle() -> None:
    c, R = curve_frames(lambda t: np.zeros((len(t), 3)), [0.0, 2.0])
    assert np.array_equal(c, [[0, 0, 0], [2, 0, 0]])
    assert np.array_equal(R, np.tile(np.eye(3), (2, 1, 1)))
    # positive yaw curvature turns left, positive pitch curvature noses down
    left, _ = curve_frames(lambda t: np.tile([0.0, 0.0, 1.0], (len(t), 1)), [0.0, np.pi / 2])
    down, _ = curve_frames(lambda t: np.tile([0.0, 1.0, 0.0], (len(t), 1)), [0.0, np.pi / 2])
    assert np.allclose(left[-1], [1, 1, 0], rtol=0, atol=1e-15)
    assert np.allclose(down[-1], [1, 0, -1], rtol=0, atol=1e-15)


@pytest.mark.parametrize("where", [1.2345, 0.0123, 2.9999, 1.5, 0.1875 + 1e-4])
def test_a_jump_of_the_shape_is_found(where: float) -> None:
    def shape(s: np.ndarray) -> np.ndarray:
        return np.stack([0 * s, 0 * s, np.where(s < where, 1.0, -2.0)], axis=-1)

    c, R = curve_frames(shape, [0.0, 3.0])
    first, second = exp([where, 0, 0, 0, 0, where]), exp([3 - where, 0, 0, 0, 0, -2 * (3 - where)])
    R1, R2 = matrix_from_quaternion(first[3:]), matrix_from_quaternion(second[3:])
    assert np.abs(c[-1] - (first[:3] + R1 @ second[:3])).max() < 1e-10
    assert np.abs(R[-1] - R1 @ R2).max() < 1e-10


def test_batch_equals_one_by_one() -> None:
    rng = np.random.default_rng(5)
    u, h = rng.normal(size=(2, 3, 7, 3, 3)), rng.uniform(0.05, 0.3, size=7)
    starts = exp(rng.normal(size=(2, 3, 6)))
    poses = frames_from_nodes(u, h, starts)
    assert poses.shape == (2, 3, 8, 7)
    assert np.array_equal(poses[1, 2], frames_from_nodes(u[1, 2], h, starts[1, 2]))
    assert np.abs(poses[..., 0, :] - starts).max() < 1e-15
    assert frames_from_nodes(np.zeros((0, 4, 3, 3)), np.ones(4)).shape == (0, 5, 7)


def test_frames_of_one_station() -> None:
    c, R = curve_frames(twisted, [2.0], START)
    assert np.array_equal(c[0], START[:3])
    assert np.abs(R[0] - matrix_from_quaternion(START[3:])).max() < 1e-15
    assert np.abs(hat([1.0, 2.0, 3.0]) @ [1.0, 2.0, 3.0]).max() == 0.0


def test_refusals() -> None:
    with pytest.raises(InputError, match="decrease"):
        curve_frames(twisted, [1.0, 0.5])
    with pytest.raises(InputError, match="tolerance"):
        curve_frames(twisted, [0.0, 1.0], tolerance=0.0)
    with pytest.raises(InputError, match="length 1"):
        curve_frames(twisted, [0.0, 1.0], [0, 0, 0, 1, 1, 0, 0])
    with pytest.raises(InputError, match=r"shape\(s\)"):
        curve_frames(lambda s: np.full((len(s), 3), np.nan), [0.0, 1.0])
    with pytest.raises(InputError, match=r"shape\(s\)"):
        curve_frames(lambda s: np.zeros((len(s), 2)), [0.0, 1.0])
    with pytest.raises(InputError, match="shapes"):
        frames_from_nodes(np.zeros((4, 3, 2)), np.ones(4))
    with pytest.raises(InputError, match="start"):
        frames_from_nodes(np.zeros((4, 3, 3)), np.ones(4), np.zeros((5, 7)))
    with pytest.raises(InputError, match="length 1"):
        frames_from_nodes(np.zeros((4, 3, 3)), np.ones(4), np.zeros(7))
    with pytest.raises(SolveError, match="not_converged"):
        noise = np.random.default_rng(0)
        curve_frames(lambda s: noise.normal(size=(len(s), 3)) * 1e3, [0.0, 1.0])
