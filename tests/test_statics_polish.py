"""Steps of Newton's method that are held back: from the normal equations what the singular values give, or refused."""

import numpy as np
import pytest

from bodyplan.solve.statics.polish_kernel import WELL, factored, held_back, well_conditioned


@pytest.mark.parametrize("size", [1, 2, 7, 16])
def test_held_back_steps_are_those_of_the_singular_values(size: int) -> None:
    rng = np.random.default_rng(size)
    judged = 0
    for _ in range(100):
        U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for _ in range(2))
        s = 10.0 ** rng.uniform(-3.0, 1.0, size)
        jacobian, rest = U * s @ V, rng.normal(size=size)
        normal, lower, step = np.empty((size, size)), np.empty((size, size)), np.empty(size)
        well = well_conditioned(jacobian, normal, lower)
        condition = np.sqrt(np.sum(s**2) * np.sum(s**-2.0))
        assert well == (condition <= WELL) or abs(condition / WELL - 1.0) < 1e-6
        if not well:
            continue
        judged += 1
        for damping in (0.0, 1e-9, 1e-3, 1.0, 1e3):
            assert held_back(jacobian, rest, normal, damping**2, lower, step)
            expected = -V.T @ (s / (s**2 + damping**2) * (U.T @ rest))
            np.testing.assert_allclose(step, expected, atol=1e-7 * np.abs(expected).max())
    assert judged > 20


def test_singular_ones_and_nearly_singular_ones_are_left_to_the_singular_values() -> None:
    rng = np.random.default_rng(3)
    for size in (2, 5, 16):
        normal, lower = np.empty((size, size)), np.empty((size, size))
        for least in (0.0, 1e-300, 1e-16, 1e-12, 1e-8, 0.9 / WELL):
            for _ in range(20):
                U, V = (np.linalg.qr(rng.normal(size=(size, size)))[0] for _ in range(2))
                s = np.append(np.ones(size - 1), least)
                assert not well_conditioned(U * s @ V, normal, lower)
        assert not well_conditioned(np.zeros((size, size)), normal, lower)
    assert not factored(np.diag([1.0, -1.0]), 0.5, np.empty((2, 2)))
    assert factored(np.diag([1.0, -1.0]), 1.5, np.empty((2, 2)))
