"""Rates of second derivatives along a way: of formulas and of grounds, against mpmath and differences."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.expressions import Expression

FORMULAS = (
    "sin(0.5*(x+y))/15",
    "x**3*y + tan(x)*exp(y/2)",
    "atan2(y, x+3)",
    "asin(x/4) + acos(y/5) + atan(x*y)",
    "sqrt(x*x+y*y+1)*log(3+x)",
    "sinh(x)*cosh(y) + tanh(x*y)",
    "(x+3)**2.5 - (2+x)**y",
    "1/(1+x**2) - x**2/(3+y)",
    "abs(x+3)*y**2 + min(x, y+9)**2*max(x, y-9)",
    "5",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_rates_of_a_jet_are_its_differences(text: str) -> None:
    rng = np.random.default_rng(0)
    formula = Expression(text)
    x, y, dx, dy = 0.5 * rng.normal(size=(4, 40))
    rates = formula.jet_rates(x=(x, dx), y=(y, dy))
    h = 1e-5
    after, before = formula.jet(x=x + h * dx, y=y + h * dy), formula.jet(x=x - h * dx, y=y - h * dy)
    for rate, a, b in zip(rates, after, before, strict=True):
        np.testing.assert_allclose(rate, (a - b) / (2 * h), rtol=1e-7, atol=1e-7)


@given(t=st.floats(-3.0, 3.0))
def test_third_derivative_of_a_formula_in_time(t: float) -> None:
    formula = Expression("sin(2*t)*exp(-t/3) + t**4/(1+t**2)", ("t",))
    third = formula.jet_rates(t=(t, 1.0))[2][0, 0]
    mpmath.mp.dps = 40
    exact = mpmath.diff(lambda s: mpmath.sin(2 * s) * mpmath.exp(-s / 3) + s**4 / (1 + s**2), t, 3)
    assert third == pytest.approx(float(exact), rel=1e-11, abs=1e-11)


def test_undefined_places_are_refused() -> None:
    with pytest.raises(bp.InputError, match="log"):
        Expression("log(x)").jet_rates(x=(-1.0, 1.0), y=(0.0, 0.0))
    with pytest.raises(bp.InputError, match="no value for y"):
        Expression("x*y").jet_rates(x=(1.0, 1.0))


def test_rates_of_the_hessian_of_grounds() -> None:
    rng = np.random.default_rng(1)
    waves = bp.Surface("0.1*sin(3*x)*cos(2*y)")
    hills = bp.HeightMap(rng.normal(size=(7, 9)), (0.3, 0.2))
    x, y = rng.uniform(0.1, 2.2, 100), rng.uniform(0.1, 1.1, 100)
    dx, dy = rng.normal(size=(2, 100))
    h = 1e-7
    for ground in (waves, hills):
        rate = ground.field_hessian_rate(x, y, dx, dy)
        change = ground.hessian(x + h * dx, y + h * dy) - ground.hessian(x - h * dx, y - h * dy)
        np.testing.assert_allclose(rate, change / (2 * h), rtol=1e-5, atol=1e-4)


def test_heights_of_a_map_are_the_values_of_its_jet() -> None:
    hills = bp.HeightMap(np.random.default_rng(2).normal(size=(6, 5)), 0.25, origin=(-0.3, 0.4))
    x, y = np.random.default_rng(3).uniform((-0.3, 0.4), (0.7, 1.65), (50, 2)).T
    np.testing.assert_allclose(hills.height(x, y), hills.field_jet(x, y)[0], rtol=0, atol=1e-14)
    assert hills.height([[-0.3, 0.4]]).shape == (1,)
    with pytest.raises(bp.InputError, match="outside"):
        hills.height(2.0, 2.0)
