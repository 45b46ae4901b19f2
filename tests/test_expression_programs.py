"""Programs of formulas: kernels against the rules run on arrays and intervals, and alone against all at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.errors import InputError
from bodyplan.expressions import Expression
from bodyplan.expressions.tape_kernel import tape_bounds, tape_jet, tape_range
from expression_cases import bounds_by_arrays, jet_by_arrays

NUMBERS = ["x", "y", "x", "y", "2", "0.5", "-1.5", "pi", "0"]
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs", "-"]
EXPONENTS = ["2", "3", "-1", "-2", "0.5", "1.5", "-0.5", "4", "-3"]
#: kinks, edges of domains, poles, and places where two of them meet
PLACES = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.5, 0.5], [2.0, -2.0], [0.0, -1.0], [-0.5, 0.5]])


def formulas() -> st.SearchStrategy[str]:
    """Formulas of every operation, defined or not."""

    def larger(part: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        two = st.tuples(part, part)
        return st.one_of(
            st.tuples(st.sampled_from("+-*/"), two).map(lambda v: f"({v[1][0]} {v[0]} {v[1][1]})"),
            st.tuples(st.sampled_from(UNARY), part).map(lambda v: f"{v[0]}({v[1]})"),
            st.tuples(st.sampled_from(["atan2", "min", "max"]), two).map(lambda v: f"{v[0]}({v[1][0]}, {v[1][1]})"),
            st.tuples(part, st.sampled_from(EXPONENTS)).map(lambda v: f"({v[0]})**{v[1]}"),
        )

    return st.recursive(st.sampled_from(NUMBERS), larger, max_leaves=8)


def made(text: str) -> Expression | None:
    try:
        return Expression(text)
    except InputError:  # a part without variables that is not finite
        return None


def places(seed: int) -> np.ndarray:
    return np.concatenate([PLACES, np.random.default_rng(seed).uniform(-2.0, 2.0, (20, 2))])


def close(found: np.ndarray, wanted: np.ndarray, slack: float) -> None:
    """Equal, nan and infinite numbers included; finite ones up to what rounding of the largest one can do."""
    size = np.abs(wanted[np.isfinite(wanted)]).max(initial=1.0)
    np.testing.assert_allclose(found, wanted, rtol=slack, atol=slack * size)


@given(formulas(), st.integers(0, 1000))
@settings(max_examples=100, deadline=None)
def test_programs_give_what_the_rules_give(text: str, seed: int) -> None:
    expression, at = made(text), places(seed)
    if expression is None:
        return
    value, gradient, hessian, culprit = jet_by_arrays(expression, [at[:, 0], at[:, 1]])
    found = expression.jet_or_nan(x=at[:, 0], y=at[:, 1])
    np.testing.assert_array_equal(np.isnan(found[0]), np.isnan(value))
    good = np.isfinite(value) & (np.abs(value) < 1e6)
    # near an edge of the domain derivatives grow, and one digit of a function's is worth more
    good &= np.isfinite(gradient).all(axis=1) & (np.abs(gradient).max(axis=1, initial=0.0) < 1e5)
    good &= np.isfinite(hessian).all(axis=(1, 2)) & (np.abs(hessian).max(axis=(1, 2), initial=0.0) < 1e6)
    for one, other in zip(found, (value, gradient, hessian), strict=True):
        close(one[good], other[good], 1e-7)
    if culprit:
        with pytest.raises(InputError) as caught:
            expression.value(x=at[:, 0], y=at[:, 1])
        assert repr(culprit if len(culprit) <= 80 else culprit[:77] + "...") in str(caught.value)


@given(formulas(), st.integers(0, 1000))
@settings(max_examples=100, deadline=None)
def test_enclosures_are_those_of_interval_arithmetic_and_hold(text: str, seed: int) -> None:
    expression, at = made(text), places(seed)
    if expression is None:
        return
    rng = np.random.default_rng(seed)
    half = 10.0 ** rng.uniform(-4.0, 0.5, at.shape) * (rng.random(at.shape) < 0.9)
    low, high = at - half, at + half
    found = expression.enclosure(x=(low[:, 0], high[:, 0]), y=(low[:, 1], high[:, 1]))
    wanted = bounds_by_arrays(expression, list(low.T), list(high.T))
    for one, other in zip(found, wanted, strict=True):
        assert not np.isnan(one).any()
        np.testing.assert_array_equal(np.isfinite(one), np.isfinite(other))
        small = np.isfinite(other) & (np.abs(other) < 1e6)
        close(one[small], other[small], 1e-7)
    np.testing.assert_array_equal(expression.extremes(x=(low[:, 0], high[:, 0]), y=(low[:, 1], high[:, 1])), found[0])
    inner = low + rng.uniform(0.0, 1.0, (40, *at.shape)) * (high - low)
    inner[:4] = np.where(np.array([[0, 0], [0, 1], [1, 0], [1, 1]])[:, None] > 0, high, low)
    jet = expression.jet_or_nan(x=inner[..., 0], y=inner[..., 1])
    near = np.abs(inner).min(
        axis=-1
    )  # where the digits of a pole or an edge are lost, bounds need not hold what is left
    for known, value in zip(found, jet, strict=True):
        whole = np.isfinite(jet[0]) & (near > 1e-2)
        defined = whole.reshape(*whole.shape, *(1,) * (value.ndim - 2)) & np.isfinite(value)
        slack = 1e-7 * (1.0 + np.abs(np.where(defined, value, 0.0)))
        assert np.all((value >= known[0] - slack) | ~defined)
        assert np.all((value <= known[1] + slack) | ~defined)


TEXTS = ["sin(0.5*(x+y))/15", "x**3*y - max(x, abs(y))", "atan2(y, x)*sqrt(x + 1)", "5", "y", "x*x*x"]


@pytest.mark.parametrize("text", TEXTS)
def test_one_place_alone_is_the_same_as_all_at_once(text: str) -> None:
    expression, at = Expression(text), places(3)
    low, high = at - 0.01, at + np.array([0.3, 0.02])
    value, gradient, hessian = expression.jet_or_nan(x=at[:, 0], y=at[:, 1])
    z, slope, bend = expression.enclosure(x=(low[:, 0], high[:, 0]), y=(low[:, 1], high[:, 1]))
    jet, bounds, extremes = expression.jet_tape, expression.bounds_tape, expression.range_tape
    rooms = [tape.registers.copy() for tape in (jet, bounds, extremes)]
    out, ends = np.empty(6), np.empty(13)
    for k, (x, y) in enumerate(at):
        tape_jet(jet, x, y, rooms[0], out)
        np.testing.assert_array_equal(
            out, [value[k], *gradient[k], hessian[k, 0, 0], hessian[k, 0, 1], hessian[k, 1, 1]]
        )
        tape_bounds(bounds, *low[k], *high[k], rooms[1], ends)
        wanted = [*z[:, k], *bend[:, k, 0, 0], *bend[:, k, 0, 1], *bend[:, k, 1, 1], np.inf]
        np.testing.assert_array_equal(ends, [*wanted, *slope[:, k, 0], *slope[:, k, 1]])
        few = np.empty(9)
        tape_bounds(bounds, *low[k], *high[k], rooms[1], few)
        np.testing.assert_array_equal(few, wanted)
        assert tape_range(extremes, *low[k], *high[k], rooms[2]) == tuple(z[:, k])
    tape_jet(jet, np.inf, 0.0, rooms[0], out)
    assert np.isnan(out).all()


def test_equal_parts_are_made_once_and_what_nobody_needs_is_left_out() -> None:
    assert len(Expression("sin(x*y) + sin(x*y)*sin(x*y)").range_tape.code) == 4
    assert len(Expression("x + y").jet_tape.code) == 1
    assert len(Expression("x").bounds_tape.code) == 0
    assert Expression("x + y").jet_tape is Expression("x + y").jet_tape


def test_a_constant_divided_by_zero_is_an_error_of_the_formula() -> None:
    for text in ("x/0", "1/(0*x)"):
        with pytest.raises(InputError, match="not finite"):
            Expression(text).jet(x=1.0, y=1.0)
    z, _, _ = Expression("x/0").enclosure(x=(1.0, 2.0), y=(1.0, 2.0))
    np.testing.assert_array_equal(z, [-np.inf, np.inf])


def test_an_angle_of_a_constant_has_bounds() -> None:
    z, slope, _ = Expression("atan2(2, x)").enclosure(x=(-1.0, 1.0), y=(0.0, 0.0))
    np.testing.assert_allclose(z, np.arctan2(2.0, [1.0, -1.0]), rtol=1e-11)
    assert slope[0, 0] <= -0.5 <= slope[1, 0]
