"""The dynamic curve against the printed formula in 40 digits, its differential equation and its limits."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.curves import GAMMA_STAR, dynamic_curve, dynamic_slope
from bodyplan.curves.dynamic import crossing_of, dynamic_jet

mp.mp.dps = 40


def printed(x, gamma, omega):
    """Eq. (1) as printed."""
    x, gamma, omega = map(mp.mpf, (x, gamma, omega))
    beta = mp.sqrt(1 - gamma**2)
    return mp.exp(-gamma * omega * x) / beta * mp.sin(omega * beta * x + mp.acos(gamma))


reals = {"allow_nan": False, "allow_infinity": False}


@settings(max_examples=60, deadline=None)
@given(
    x=st.floats(0.0, 12.0, **reals),
    gamma=st.floats(0.0, 0.999999, **reals),
    omega=st.floats(0.1, 4.0, **reals),
)
def test_equals_the_printed_formula(x, gamma, omega):
    assert dynamic_curve(x, gamma, omega) == pytest.approx(float(printed(x, gamma, omega)), abs=2e-14)


@pytest.mark.parametrize("gamma", [0.0, 0.3, 0.9, 0.999999999, 1.0])
def test_is_the_free_response_of_a_damped_oscillator(gamma):
    f, fx, fxx, *_ = dynamic_jet(1.7, gamma, 1.3)
    assert fxx + 2 * gamma * 1.3 * fx + 1.3**2 * f == pytest.approx(0.0, abs=1e-14)
    assert dynamic_curve(0.0, gamma, 1.3) == 1.0
    assert dynamic_slope(0.0, gamma, 1.3) == 0.0


def test_regular_at_gamma_one():
    x = np.linspace(0, 10, 101)
    # the critically damped response
    np.testing.assert_allclose(dynamic_curve(x, 1.0), np.exp(-x) * (1 + x), rtol=1e-14)
    np.testing.assert_allclose(dynamic_curve(x, 1.0 - 1e-12), dynamic_curve(x, 1.0), atol=1e-11)


@pytest.mark.parametrize(
    "x,gamma,omega", [(0.3, 0.2, 1.3), (3.0, 0.8, 1.0), (0.01, 0.5, 1.0), (2.5, 0.999, 1.0), (7, 0.01, 2)]
)
def test_jet_against_forty_digits(x, gamma, omega):
    def at(*order):
        return float(mp.diff(lambda a, b: printed(a, b, omega), (x, gamma), order))

    wanted = [at(0, 0), at(1, 0), at(2, 0), at(0, 1), at(1, 1), at(0, 2)]
    np.testing.assert_allclose(dynamic_jet(x, gamma, omega), wanted, rtol=1e-12, atol=1e-13)


def test_gamma_star_is_where_a_module_stops_crossing():
    root = mp.findroot(lambda g: printed(mp.pi, g, 1), 0.67)
    assert pytest.approx(float(root), abs=1e-15) == GAMMA_STAR
    assert dynamic_curve(np.pi, 0.8) == pytest.approx(0.0777, abs=5e-5)
    assert dynamic_curve(np.pi / 2.5, 0.0, 2.5) == pytest.approx(-1.0, abs=1e-15)


@pytest.mark.parametrize("gamma,omega,count", [(0.0, 1.0, 1), (0.55, 1.7, 2), (0.8, 0.6, 3)])
def test_crossings_are_zeros(gamma, omega, count):
    x = crossing_of(gamma, omega, count)
    assert dynamic_curve(x, gamma, omega) == pytest.approx(0.0, abs=1e-14)
    signs = np.sign(dynamic_curve(np.linspace(0, x * (1 - 1e-9), 5001), gamma, omega))
    assert np.count_nonzero(np.diff(signs)) == count - 1


def test_broadcasts():
    assert dynamic_curve(np.zeros((3, 1)), np.zeros(4)).shape == (3, 4)
    assert dynamic_curve(np.zeros((0,)), 0.3).shape == (0,)


@pytest.mark.parametrize(
    "arguments", [(0.0, 1.1), (0.0, -0.1), (np.nan, 0.3), (0.0, 0.3, 0.0), (0.0, 0.3, -1.0), ("a", 0.3)]
)
def test_refuses(arguments):
    with pytest.raises(bp.InputError):
        dynamic_curve(*arguments)
