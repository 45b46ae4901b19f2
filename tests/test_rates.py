"""The five-point formula: exact for quartics, fourth order, one-sided at the ends."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.rates import five_point


def test_exact_for_quartic_polynomials_everywhere():
    x = np.linspace(-1, 2, 31)
    p = np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.7, -0.4])
    np.testing.assert_allclose(five_point(p(x), x[1] - x[0]), p.deriv()(x), atol=1e-12)


def test_error_is_of_fourth_order():
    def error(h):
        x = np.arange(0.0, 2.0 + h / 2, h)
        return np.abs(five_point(np.sin(3 * x), h) - 3 * np.cos(3 * x)).max()

    assert np.log2(error(0.02) / error(0.01)) == pytest.approx(4.0, abs=0.15)


def test_columns_and_functions():
    x = np.linspace(0, 1, 11)
    both = five_point(np.column_stack([x, x**2]), 0.1)
    np.testing.assert_allclose(both, np.column_stack([np.ones(11), 2 * x]), atol=1e-13)
    assert five_point(np.exp, 1e-2)(0.3) == pytest.approx(np.exp(0.3), rel=1e-9)


@pytest.mark.parametrize(
    "f,h", [(np.zeros(4), 0.1), (np.zeros(9), 0.0), (np.zeros(9), -1.0), (3.0, 0.1), ([1, 2, np.nan, 4, 5], 1)]
)
def test_refuses(f, h):
    with pytest.raises(bp.InputError):
        five_point(f, h)
