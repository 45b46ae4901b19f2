"""Formulas: what is refused, exact derivatives against SymPy, bounds against samples."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.expressions import Expression

SMOOTH = [
    "sin(0.5*(x+y))/15",
    "0.02*sin(6*x)*cos(5*y)",
    "x**3*y**2 - 2*x*y + 7",
    "exp(-x**2 - y**2/3)*tan(x/3)",
    "log(2 + x*y)*sqrt(3 + x)",
    "atan2(x + 2*y, 4 - x*x) + atan(x*y)",
    "asin(x/3)*acos(y/3)",
    "sinh(x)*cosh(y) - tanh(x*y)**3",
    "(x**2 + y**2 + 1)**1.5/(1 + exp(x))",
    "(2 + x)**(-2)*(3 + y)**-0.5",
    "2**x - (2 + x*x)**y",
    "max(sin(x), 0.1*y, x - 2) + min(x*y, y - 3*x)",
    "abs(x - 2*y)*pi + e",
    "1/(x - y + 4)/(x + 3)",
    "-x**2 + +y",
    "5",
]
POINTS = np.array([[0.3, -0.7], [-1.1, 0.45], [1.4, 1.9], [0.001, -1.3]])


def sympy_jet(text: str, x: float, y: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Value, gradient and Hessian to 40 digits by symbolic differentiation."""
    sx, sy = sympy.symbols("x y", real=True)
    names = {
        "x": sx,
        "y": sy,
        "pi": sympy.pi,
        "e": sympy.E,
        "abs": sympy.Abs,
        "max": sympy.Max,
        "min": sympy.Min,
    }
    f = sympy.sympify(text, locals=names, rational=True)
    at = {sx: sympy.Rational(x), sy: sympy.Rational(y)}

    def number(expression: sympy.Expr) -> float:
        return float(expression.subs(at).evalf(40))

    first = [sympy.diff(f, v) for v in (sx, sy)]
    second = [[sympy.diff(d, v) for v in (sx, sy)] for d in first]
    return (
        number(f),
        np.array([number(d) for d in first]),
        np.array([[number(d) for d in row] for row in second]),
    )


@pytest.mark.parametrize("text", SMOOTH)
def test_derivatives_are_those_of_symbolic_differentiation(text: str) -> None:
    value, gradient, hessian = Expression(text).jet(x=POINTS[:, 0], y=POINTS[:, 1])
    for i, (x, y) in enumerate(POINTS):
        v, g, h = sympy_jet(text, float(x), float(y))
        scale = 1.0 + abs(v) + np.abs(g).max() + np.abs(h).max()
        assert abs(value[i] - v) <= 1e-14 * scale
        np.testing.assert_allclose(gradient[i], g, rtol=0, atol=1e-14 * scale)
        np.testing.assert_allclose(hessian[i], h, rtol=0, atol=1e-13 * scale)
    np.testing.assert_array_equal(Expression(text).value(x=POINTS[:, 0], y=POINTS[:, 1]), value)


def test_powers_with_whole_exponents_are_not_logarithms() -> None:
    assert Expression("x**0").value(x=0.0, y=0.0) == 1.0
    assert Expression("0**0 + 0*x").value(x=3.0, y=0.0) == 1.0
    assert Expression("(-2)**3").value(x=0.0, y=0.0) == -8.0
    value, gradient, hessian = Expression("x**3 + y**2").jet(x=-2.0, y=0.0)
    assert value == -8.0
    np.testing.assert_array_equal(gradient, [12.0, 0.0])
    np.testing.assert_array_equal(hessian, [[-12.0, 0.0], [0.0, 2.0]])
    assert Expression("x**-2").value(x=-2.0, y=0.0) == 0.25
    assert Expression("-x**2").value(x=3.0, y=0.0) == -9.0
    assert Expression("2**3**2").value(x=0.0, y=0.0) == 512.0
    np.testing.assert_array_equal(Expression("x**2").jet(x=0.0, y=0.0)[2], [[2.0, 0.0], [0.0, 0.0]])


def test_kinks_take_the_derivatives_of_one_side() -> None:
    np.testing.assert_array_equal(Expression("abs(x)").jet(x=[-1.0, 0.0, 1.0], y=0.0)[1][:, 0], [-1.0, 1.0, 1.0])
    np.testing.assert_array_equal(Expression("max(2*x, x)").jet(x=0.0, y=0.0)[1], [2.0, 0.0])
    np.testing.assert_array_equal(Expression("min(2*x, x)").jet(x=0.0, y=0.0)[1], [2.0, 0.0])
    kinks = Expression("abs(x - 1) + max(x, y)").kinks
    assert [float(k.value(x=3.0, y=0.5)) for k in kinks] == [2.0, 2.5]


@given(st.sampled_from(SMOOTH), st.sampled_from([(), (0,), (1,), (3,), (2, 1, 2), (0, 4)]))
@settings(max_examples=40, deadline=None)
def test_every_batch_shape(text: str, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.0, 1.5, shape), rng.uniform(-1.0, 1.5, shape)
    expression = Expression(text)
    value, gradient, hessian = expression.jet(x=x, y=y)
    assert (value.shape, gradient.shape, hessian.shape) == (shape, (*shape, 2), (*shape, 2, 2))
    assert expression.value(x=x, y=y).shape == shape
    np.testing.assert_array_equal(hessian, np.swapaxes(hessian, -1, -2))
    for index in np.ndindex(shape):
        alone = expression.jet(x=x[index], y=y[index])
        for whole, part in zip((value, gradient, hessian), alone, strict=True):
            np.testing.assert_allclose(whole[index], part, rtol=1e-14, atol=1e-15)


def test_arrays_broadcast_and_results_can_be_written() -> None:
    value, gradient, _ = Expression("3").jet(x=np.zeros((4, 1)), y=np.zeros(3))
    assert value.shape == (4, 3)
    assert gradient.shape == (4, 3, 2)
    value[0, 0] = 1.0


def test_other_variables() -> None:
    path = Expression("0.3*sin(t)**2", variables=("t",))
    value, rate, second = path.jet(t=[0.4])
    assert rate.shape == (1, 1)
    np.testing.assert_allclose(
        [value[0], rate[0, 0], second[0, 0, 0]],
        [0.3 * np.sin(0.4) ** 2, 0.3 * np.sin(0.8), 0.6 * np.cos(0.8)],
        rtol=1e-15,
    )
    with pytest.raises(UnknownNameError, match="x"):
        path.value(x=1.0)
    with pytest.raises(InputError, match="no value for y"):
        Expression("x").value(x=1.0)
    with pytest.raises(InputError, match="already a constant"):
        Expression("e", variables=("e",))
    with pytest.raises(InputError, match="every name once"):
        Expression("t", variables=("t", "t"))
    with pytest.raises(InputError, match="not a name"):
        Expression("t", variables=("t s",))


# fmt: off
REFUSED = [
    "__import__('os')", "x.real", "x.__class__", "(lambda: 1)()", "[1, 2]", "{1: 2}", "x if y else 1",
    "x < y", "x and y", "1or x", "not x", "'text'", "b'x'", "True", "None", "...", "1j", "f'{x}'",
    "x := 1", "x, y", "(yield x)", "[z for z in x]", "x[0]", "x % 2", "x // 2", "x @ y", "x & 1", "~x",
    "sin(x=1)", "max(*x)", "sin(**x)", "await x", "x; y", "import os", "x = 3", "x #", "x \\\n y", "sin",
    "sin()", "sin(x, y)", "atan2(x)", "max(x)", "f(x)", "exec(x)", "foo", "X", "_", "sin(x)(y)", "2x",
    "x y", "(x", "x)", "", "  ", "θ", "x²", "x\0", "1e999", "1/0", "0**-1", "log(-1)", "(-8)**(1/3)",
    "9**9**9", "x**65", "x**-65", "x**1e9", "10**400", "x^2",
]
# fmt: on
TOO_LARGE = [
    "(" * 400 + "x" + ")" * 400,
    "-" * 1900 + "x",
    "sin(" * 250 + "x" + ")" * 250,
    "x+" * 900 + "x",
    "1" * 3000,
    "+".join(["x*y"] * 500),
]


@pytest.mark.parametrize("text", [*REFUSED, *TOO_LARGE, None, 3, ["x"]])
def test_anything_else_is_refused_as_text(text: object) -> None:
    with pytest.raises(InputError) as caught:
        Expression(text)  # type: ignore[arg-type]
    assert len(str(caught.value)) < 600


def test_errors_say_what_and_what_else() -> None:
    with pytest.raises(InputError, match=r"'x\.real' is not allowed; write numbers, x, y, pi, e, .* sin, cos"):
        Expression("2 + x.real")
    with pytest.raises(UnknownNameError, match=r"unknown function 'sine'\. Did you mean 'sin'\?"):
        Expression("sine(x)")
    with pytest.raises(UnknownNameError, match=r"unknown name 'z'.*x, y"):
        Expression("x + z")
    with pytest.raises(InputError, match=r"written \*\*, not \^"):
        Expression("x^2")
    with pytest.raises(InputError, match="exponent in 'x\\*\\*99' is 99, at most 64"):
        Expression("1 + x**99")
    with pytest.raises(InputError, match="column"):
        Expression("sin(x))")


@pytest.mark.parametrize(
    ("text", "x"),
    [
        ("log(x)", -1.0),
        ("1/x", 0.0),
        ("sqrt(x)", -1.0),
        ("asin(x)", 1.5),
        ("atan(1/x)", 0.0),
        ("exp(-1/x**2)", 0.0),
        ("exp(800*x)", 2.0),
        ("x**0.5", -1.0),
        ("x**y", -1.0),
        ("1/exp(800*x)", 2.0),
        ("max(1, log(x))", -1.0),
    ],
)
def test_a_result_that_is_not_finite_names_formula_and_point(text: str, x: float) -> None:
    with pytest.raises(InputError) as caught:
        Expression(text).value(x=[0.25, x], y=0.5)
    assert repr(text) in str(caught.value)
    assert f"x = {x!r}, y = 0.5" in str(caught.value)


def test_a_missing_derivative_is_an_error_only_for_the_jet() -> None:
    root = Expression("sqrt(x**2 + y**2)")
    assert root.value(x=0.0, y=0.0) == 0.0
    with pytest.raises(InputError, match="without derivatives"):
        root.jet(x=0.0, y=0.0)
    assert np.isnan(Expression("log(x)").jet_or_nan(x=[-1.0, 1.0], y=0.0)[0]).tolist() == [True, False]


def test_points_must_be_finite_and_broadcast() -> None:
    with pytest.raises(InputError, match="finite"):
        Expression("x").value(x=np.nan, y=0.0)
    with pytest.raises(InputError, match="broadcast"):
        Expression("x").value(x=np.zeros(2), y=np.zeros(3))


BOUNDED = [
    *SMOOTH,
    "tan(3*x) + acos(y/2)",
    "log(x)*sqrt(y)",
    "cosh(x)*sinh(y)",
    "1/x + y**-3",
    "atan2(y, x)",
    "abs(x)**2.5",
]


@pytest.mark.parametrize("text", BOUNDED)
def test_bounds_hold_everywhere_in_the_box(text: str) -> None:
    rng = np.random.default_rng(7)
    centre, half = rng.uniform(-2.0, 2.0, (60, 2)), 10.0 ** rng.uniform(-3.0, 0.3, (60, 2))
    low, high = centre - half, centre + half
    expression = Expression(text)
    bounds = expression.enclosure(x=(low[:, 0], high[:, 0]), y=(low[:, 1], high[:, 1]))
    at = low + rng.uniform(0.0, 1.0, (300, 60, 2)) * (high - low)
    values = expression.jet_or_nan(x=at[..., 0], y=at[..., 1])
    for known, found in zip(bounds, values, strict=True):
        defined = np.isfinite(values[0]).reshape(*values[0].shape, *(1,) * (found.ndim - 2)) & np.isfinite(found)
        assert np.all((found >= known[0]) | ~defined)
        assert np.all((found <= known[1]) | ~defined)


def test_bounds_close_in_on_small_boxes() -> None:
    expression = Expression("0.3*sin(20*x)*cos(15*y) + atan(x*y)")
    for half in (1e-2, 1e-3, 1e-4):
        z, g, h = expression.enclosure(x=(0.4 - half, 0.4 + half), y=(0.2 - half, 0.2 + half))
        assert z[1] - z[0] < 40.0 * half
        assert (g[1] - g[0]).max() < 1000.0 * half
        assert (h[1] - h[0]).max() < 3e4 * half


def test_a_box_without_a_defined_point_has_empty_bounds() -> None:
    z, _, _ = Expression("sqrt(1 - x**2 - y**2)").enclosure(x=([2.0, 0.0], [3.0, 0.1]), y=([0.0, 0.0], [1.0, 0.1]))
    assert z[0, 0] == np.inf
    assert z[1, 0] == -np.inf
    assert np.all(np.isfinite(z[:, 1]))
