"""The paper's rules against its equations in plain loops, and their derivatives against finite differences."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.curves import Constant, Segments
from bodyplan.fitting import GAUSS_P, mechanism, rule
from fit_cases import arc_rule, bend, double_rule

TWO_PLANES = bp.Serpenoid(1.1, 0.8, phase=0.4) + bp.Serpenoid(0.6, 0.5, plane="pitch", phase=1.0)
BENT = Segments([(0.3, 0.0, 0.0, 4.0), (0.2, 0.0, -5.0, 0.0), (0.9, 0.0, 2.0, 1.0)])
LENGTHS = np.array([0.1, 0.25, 0.15, 0.3, 0.2])


def columns(robot, kind):
    return [i for i, name in enumerate(robot.joints) if name.startswith(kind)]


@pytest.mark.parametrize("curve", [TWO_PLANES, BENT, bp.Spiral()], ids=["two planes", "jumps", "spiral"])
@pytest.mark.parametrize("p", [None, 0.789, 0.55, 1.0])
def test_arcs_by_equations_11_to_17(curve, p):
    robot = bp.snake(5, LENGTHS, "arc", axes="universal")
    found = rule(robot, p).evaluate(curve, 0.0, 0)
    for axis, kind in enumerate(("pitch", "yaw")):
        expected = arc_rule(curve, LENGTHS, GAUSS_P if p is None else p, axis)
        np.testing.assert_allclose(found.q[columns(robot, kind)], expected[1:], atol=2e-12)
        assert found.kink[axis] == pytest.approx(expected[0], abs=2e-12)


def test_the_gauss_node():
    assert pytest.approx(1 / 6, abs=1e-15) == GAUSS_P * (1 - GAUSS_P)
    assert rule(bp.snake(3, 0.1, "arc")).p == GAUSS_P


@pytest.mark.parametrize("p", [0.6, GAUSS_P, 1.0])
def test_one_arc(p):
    robot = bp.snake(1, 0.7, "arc")
    found = rule(robot, p).evaluate(TWO_PLANES, 0.0, 0)
    theta = bend(TWO_PLANES, (1 - p) * 0.7, p * 0.7, 1) / (2 * p - 1)
    assert found.q[0] == pytest.approx(theta, abs=1e-12)
    assert found.kink[1] == pytest.approx(bend(TWO_PLANES, 0.0, (1 - p) * 0.7, 1) - (1 - p) * theta, abs=1e-12)
    assert found.kink[0] == 0.0  # no joint bends about y


def test_double_joints_by_equations_33_34():
    robot = bp.snake(5, LENGTHS, "double", axes="universal", end_link=0.2)
    found = rule(robot).evaluate(TWO_PLANES, 0.2, 0)
    moved = bp.Serpenoid(1.1, 0.8, phase=0.4 + 2 * np.pi * 0.2 / 0.8) + bp.Serpenoid(
        0.6, 0.5, plane="pitch", phase=1.0 + 2 * np.pi * 0.2 / 0.5
    )
    pitch, yaw = (arc_rule(moved, LENGTHS, GAUSS_P, axis) for axis in (0, 1))
    expected = np.array([double_rule(a, b) for a, b in zip(pitch[1:], yaw[1:], strict=True)])
    np.testing.assert_allclose(found.q[columns(robot, "pitch")], expected[:, 0], atol=2e-12)
    np.testing.assert_allclose(found.q[columns(robot, "yaw")], expected[:, 1], atol=2e-12)
    # the virtual unit has no length: its bends stay those of an arc
    np.testing.assert_allclose(found.kink, [pitch[0], yaw[0]], atol=2e-12)


@pytest.mark.parametrize("axes", ["yaw", "pitch", "universal"])
def test_links_with_a_joint_of_the_axis_everywhere(axes):
    ends = np.cumsum(LENGTHS)
    middle = ends - LENGTHS / 2
    robot = bp.snake(5, LENGTHS, axes=axes)
    found = rule(robot).evaluate(BENT, 0.0, 0)
    for axis, kind in enumerate(("pitch", "yaw")):
        if axes in (kind, "universal"):
            expected = [bend(BENT, a, b, axis) for a, b in pairwise(middle)]
            np.testing.assert_allclose(found.q[columns(robot, kind)], expected, atol=1e-12)
            assert found.kink[axis] == pytest.approx(bend(BENT, 0.0, middle[0], axis), abs=1e-12)
        else:
            assert found.kink[axis] == 0.0


@pytest.mark.parametrize("links", [3, 4, 5, 8])
def test_alternating_links_by_equations_2_and_3(links):
    """Joint i takes what lies between joints i - 1 and i + 1: kappa(s), not kappa(l i)."""
    lengths = np.resize(LENGTHS, links) * 0.5
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    found = rule(bp.snake(links, lengths, axes="alternating")).evaluate(TWO_PLANES, 0.0, 0)
    expected = [bend(TWO_PLANES, ends[i - 1], ends[i + 1], i % 2) for i in range(1, links)]
    np.testing.assert_allclose(found.q, expected, atol=1e-12)
    np.testing.assert_allclose(found.kink, [bend(TWO_PLANES, 0.0, ends[1], 0), 0.0], atol=1e-12)


def test_alternating_arcs_are_taken_as_hinges_at_their_middles():
    ends = np.concatenate([[0.0], np.cumsum(LENGTHS)])
    middle = np.concatenate([[0.0], ends[1:] - LENGTHS / 2, ends[-1:]])
    for joint in ("arc", "double"):
        found = rule(bp.snake(5, LENGTHS, joint, axes="alternating")).evaluate(TWO_PLANES, 0.0, 0)
        expected = [bend(TWO_PLANES, middle[i - 1], middle[i + 1], i % 2) for i in range(1, 6)]
        np.testing.assert_allclose(found.q, expected, atol=1e-12)
        np.testing.assert_allclose(found.kink, [bend(TWO_PLANES, 0.0, middle[1], 0), 0.0], atol=1e-12)


def test_what_a_robot_bends_in_total():
    """Arcs: the polyline meets the curve's turning at shares p and 1 - p in the mean; constant curvature is met."""
    curve = Constant(kappa_p=0.7, kappa_y=-1.3)
    found = rule(bp.snake(5, LENGTHS, "arc", axes="universal")).evaluate(curve, 3.0)
    np.testing.assert_allclose(found.q.reshape(5, 2), np.outer(LENGTHS, [0.7, -1.3]), atol=1e-13)
    np.testing.assert_allclose(found.kink, 0.0, atol=1e-13)
    np.testing.assert_allclose(found.q1, 0.0, atol=1e-12)


def test_twisted_curves_are_untwisted_first():
    helix = Constant(tau=3.0, kappa_y=5.0)
    robot = bp.snake(6, 0.1, "double", axes="universal")
    np.testing.assert_allclose(
        rule(robot).evaluate(helix, 0.3).q1, rule(robot).evaluate(helix.untwisted(), 0.3).q1, atol=1e-12
    )
    assert np.ptp(rule(robot).evaluate(helix, [0.0, 0.5], 0).q[:, 0]) > 0.01


ROBOTS = {
    "straight": bp.snake(6, [0.1, 0.2, 0.1, 0.15, 0.2, 0.1], axes="alternating"),
    "universal": bp.snake(6, 0.15, axes="universal"),
    "arc": bp.snake(5, LENGTHS, "arc", axes="universal"),
    "double": bp.snake(5, LENGTHS, "double", axes="universal"),
    "double, alternating": bp.snake(5, LENGTHS, "double", axes="alternating"),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_derivatives_along_the_curve(name):
    angles, h = rule(ROBOTS[name]), 1e-4
    starts = np.linspace(-0.3, 1.7, 9)
    at = angles.evaluate(TWO_PLANES, starts)
    steps = [angles.evaluate(TWO_PLANES, starts + k * h) for k in (-2, -1, 1, 2)]
    for value, slope in (("q", "q1"), ("q1", "q2"), ("kink", "kink1"), ("kink1", "kink2")):
        a, b, c, d = (getattr(step, value) for step in steps)
        numeric = (a - 8 * b + 8 * c - d) / (12 * h)
        exact = getattr(at, slope)
        np.testing.assert_allclose(exact, numeric, atol=2e-9 * max(1.0, np.abs(exact).max()))
    assert np.abs(at.q2).max() > 1.0


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e-2, 0.7, 1.3, 4.0])
def test_derivatives_of_double_joints_through_zero(scale):
    """Along a straight line of arc angles that passes near 0, or far beyond pi/2 (|theta| up to 4 rad)."""
    angles = rule(ROBOTS["double"])
    generator = np.random.default_rng(5)
    phi, phi1, phi2 = generator.normal(size=(3, len(angles.nodes), 2)) * scale * 0.15

    def at(t):
        return angles.apply(phi + t * phi1 + 0.5 * t * t * phi2, phi1 + t * phi2, phi2)

    h = 1e-3
    a, b, c, d = (at(k * h) for k in (-2, -1, 1, 2))
    np.testing.assert_allclose(at(0.0).q1, (a.q - 8 * b.q + 8 * c.q - d.q) / (12 * h), atol=2e-9 * scale)
    np.testing.assert_allclose(at(0.0).q2, (a.q1 - 8 * b.q1 + 8 * c.q1 - d.q1) / (12 * h), atol=2e-9 * scale)


def test_zero_bends_have_derivatives():
    angles = rule(ROBOTS["double"])
    phi1 = np.ones((len(angles.nodes), 2)) * angles.nodes[:, None]
    found = angles.apply(0.0 * phi1, phi1, 0.0 * phi1)
    assert np.all(found.q == 0.0)
    np.testing.assert_allclose(found.q1, np.repeat(LENGTHS, 2), atol=1e-13)
    np.testing.assert_allclose(found.q2, 0.0, atol=1e-13)


def test_double_joints_bend_beyond_pi():
    """(34) with asin would fold yaws beyond pi back."""
    angles = rule(bp.snake(1, 1.0, "double", axes="universal"))
    for theta in (3.0, 3.3, 4.0):
        found = angles.apply(theta * angles.nodes[:, None] * np.array([1e-9, 1.0]))
        assert found.q[0] == pytest.approx(theta, abs=1e-8)


def test_another_order_of_axes():
    """Pitch, yaw, yaw, pitch: the paper's rule with the parts of the axes exchanged; the middle link points as the
    middle of the arc."""
    pitch, yaw = bp.Joint("a"), bp.Joint("b")
    up, back, half = {"epsilon": -0.5 * np.pi}, {"epsilon": 0.5 * np.pi}, 0.5
    rows = [
        bp.Row(a=0.2, **up),
        bp.Row(theta=pitch.share(half), **back),
        bp.Row(theta=yaw.share(half), a=0.6, name="middle"),
        bp.Row(theta=yaw.share(half), **up),
        bp.Row(theta=pitch.share(half), a=0.2, **back, name="head"),
    ]
    robot = bp.Robot.from_rows({"body": rows})
    angles = rule(robot)
    phi = np.array([0.9, -1.4]) * angles.nodes[:, None]
    found = angles.apply(phi)
    poses = robot.forward(found.q)
    arc = bp.Robot.from_rows({"body": [bp.Arc(0.5, 0.45, -0.7, name="m"), bp.Arc(0.5, 0.45, -0.7, name="e")]})
    expected = arc.forward(np.zeros(0))
    np.testing.assert_allclose(poses.rotations[3, :, 0], expected.rotations[1, :, 0], atol=1e-14)
    np.testing.assert_allclose(poses["head"][3:], expected["e"][3:], atol=1e-14)


@given(
    n=st.integers(1, 40),
    p=st.floats(0.51, 1.0),
    alpha=st.floats(-1.5, 1.5),
    phase=st.floats(-7, 7),
    wave=st.floats(0.2, 3),
    twist=st.floats(-9, 9),
    start=st.floats(-5, 5),
)
@settings(max_examples=40, deadline=None)
def test_arcs_of_any_number(n, p, alpha, phase, wave, twist, start):
    curve = bp.Serpenoid(alpha, wave, phase=phase) + bp.Spiral(3.0, twist)
    found = rule(bp.snake(n, 1 / n, "arc", axes="universal"), p).evaluate(curve, start, 0)
    ends = np.linspace(0.0, 1.0, n + 1)
    early, late = ends[:-1] + (1 - p) / n, ends[:-1] + p / n

    def phi(s):
        return np.stack(curve.integral(start, start + s)[1:], axis=-1)

    # (11)-(17) say: the polyline of the forward angles meets phi at all `late`, that of the backward ones at `early`
    forward, backward = np.zeros((n, 2)), np.zeros((n, 2))
    forward[0] = (phi(late[0]) - phi(early[0])) / (2 * p - 1)
    backward[-1] = (phi(late[-1]) - phi(early[-1])) / (2 * p - 1)
    for i in range(1, n):
        forward[i] = (phi(late[i]) - phi(late[i - 1]) - (1 - p) * forward[i - 1]) / p
        backward[-1 - i] = (phi(early[n - i]) - phi(early[n - 1 - i]) - (1 - p) * backward[n - i]) / p
    expected = 0.5 * (forward + backward)
    np.testing.assert_allclose(found.q[0::2], expected[:, 0], atol=1e-10)
    np.testing.assert_allclose(found.q[1::2], expected[:, 1], atol=1e-10)
    np.testing.assert_allclose(found.kink, phi(early[0]) - (1 - p) * expected[0], atol=1e-10)


def test_batches_equal_loops():
    for robot in ROBOTS.values():
        angles = rule(robot)
        starts = np.linspace(0.0, 2.0, 6).reshape(2, 3)
        many = angles.evaluate(TWO_PLANES, starts)
        for index in np.ndindex(2, 3):
            one = angles.evaluate(TWO_PLANES, starts[index])
            for field in ("q", "q1", "q2", "kink", "kink1", "kink2"):
                np.testing.assert_allclose(getattr(many, field)[index], getattr(one, field), atol=1e-12)
        assert many.q.shape == (2, 3, robot.n)
        assert many.kink_quaternion.shape == (2, 3, 4)


def test_large_robots_have_sparse_weights():
    n = 1500
    robot = bp.snake(n, 1 / n, "arc")
    found = rule(robot).evaluate(bp.Serpenoid(1.0), [0.0, 0.1], 0)
    small = bp.Serpenoid(1.0)
    expected = [float(small.integral(0.1 + i / n, 0.1 + (i + 1) / n).kappa_y) for i in range(n)]
    # the rule turns a unit by what the curve bends along it, but for order 4
    np.testing.assert_allclose(found.q[1], expected, atol=1e-8)


def test_gain_and_sign_of_drives():
    """A coordinate that drives with a scale, about an axis that points the other way."""
    plain = bp.snake(3, 0.2)
    rows = [
        bp.Row(a=0.2, epsilon=np.pi),
        bp.Row(theta=bp.Joint("one", scale=0.5), a=0.2, epsilon=np.pi),
        bp.Row(theta=bp.Joint("two", scale=-2.0), a=0.2),
    ]
    odd = bp.Robot.from_rows({"body": rows})
    q = rule(plain).evaluate(TWO_PLANES, 0.1, 0).q
    np.testing.assert_allclose(rule(odd).evaluate(TWO_PLANES, 0.1, 0).q, [-q[0] / 0.5, -q[1] / 2.0], atol=1e-14)
    found = bp.fit(TWO_PLANES, odd)
    np.testing.assert_allclose(found.points([0.6]), bp.fit(TWO_PLANES, plain).points([0.6]), atol=1e-12)


def test_longer_head_and_tail_are_rigid_parts():
    """A robot of equal double joints with an extra tail and head has the same units, and the tail is straight."""
    plain = bp.snake(4, 0.1, "double", axes="universal")
    elements = list(plain.chains[0].elements)
    longer = bp.Robot.from_rows({"body": [bp.Row(a=0.03), *elements, bp.Row(a=0.05)]})
    made = mechanism(longer)
    np.testing.assert_allclose(made.units, 0.03 + mechanism(plain).units, atol=1e-15)
    assert made.length == pytest.approx(0.48)
    found, shifted = rule(longer).evaluate(BENT, 0.0, 0), rule(plain).evaluate(BENT, 0.03, 0)
    np.testing.assert_allclose(found.q, shifted.q, atol=1e-13)
    np.testing.assert_allclose(
        found.kink - shifted.kink, [bend(BENT, 0.0, 0.03, 0), bend(BENT, 0.0, 0.03, 1)], atol=1e-13
    )


def leg(*rows):
    return bp.Robot.from_rows({"body": rows}, name="odd one")


@pytest.mark.parametrize(
    ("robot", "why"),
    [
        (bp.Robot.from_rows({"a": [bp.Row(a=1, theta=bp.Joint("x"))], "b": [bp.Row(a=1)]}, name="two"), "one chain"),
        (leg(bp.Row(a=1.0)), "no joints"),
        (leg(bp.Row(a=1.0), bp.Row(theta=bp.Joint("x"), a=1, d=0.1)), "straight along x"),
        (leg(bp.Row(a=1.0), bp.Row(theta=bp.Joint("x", offset=0.1), a=1)), "straight along x"),
        (leg(bp.Row(a=1.0), bp.Row(theta=bp.Joint("x"), a=-0.5)), "straight along x"),
        (leg(bp.Row(a=1.0), bp.Row(a=bp.Joint("x"))), "driven"),
        (leg(bp.Row(a=1.0), bp.Row(epsilon=bp.Joint("x"), a=1.0)), "rolls"),
        (leg(bp.Row(a=1.0, epsilon=0.3), bp.Row(theta=bp.Joint("x"), a=1.0)), "not about y or z"),
        (leg(bp.Arc(1.0, yaw=0.1), bp.Row(theta=bp.Joint("x"), a=1.0)), "bent at q = 0"),
        (leg(bp.Arc(1.0, yaw=bp.Joint("y")), bp.Row(theta=bp.Joint("x"), a=1.0)), "in one chain"),
        (leg(bp.Row(theta=bp.Joint("x")), bp.Row(theta=bp.Joint("y"), a=1.0)), "same axis at the same place"),
        (leg(bp.Row(theta=bp.Joint("x"), a=1.0), bp.Row(theta=bp.Joint("x", scale=2.0), a=1.0)), "equal shares"),
        (leg(bp.Arc(1.0, yaw=bp.Joint("y"), pitch=bp.Joint("y"))), "two axes"),
        (leg(*(bp.Row(theta=bp.Joint("x"), a=1.0) for _ in range(3))), "drives 3 bends"),
    ],
)
def test_robots_that_no_rule_is_known_for(robot, why):
    with pytest.raises(bp.InputError, match=why) as error:
        rule(robot)
    assert robot.name in str(error.value)


def test_bad_arguments():
    robot = bp.snake(3, 0.1, "arc")
    for p in (0.5, 1.01, math.nan, "0.7"):
        with pytest.raises(bp.InputError, match="p"):
            rule(robot, p)
    angles = rule(robot)
    assert rule(robot) is angles
    K = len(angles.nodes)
    with pytest.raises(bp.InputError, match="phi"):
        angles.apply(np.zeros((K + 1, 2)))
    with pytest.raises(bp.InputError, match="phi2"):
        angles.apply(np.zeros((K, 2)), None, np.zeros((K, 2)))
    with pytest.raises(bp.InputError, match="derivatives"):
        angles.evaluate(TWO_PLANES, 0.0, 3)
    with pytest.raises(bp.InputError, match="curve"):
        angles.evaluate("serpenoid", 0.0)
    with pytest.raises(bp.InputError, match="robot"):
        rule("snake")
