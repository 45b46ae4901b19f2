"""The judge on wheels: it measures contact, rolling and clearance itself, and finds what is not as claimed."""

from dataclasses import replace

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.check import Line

ROBOT = bp.tri_wheel()
GROUND = bp.Surface("0.04*sin(4*x+y)")
TOUCH, ROLL, CLEAR = "rims touch", "wheels roll", "the hull is clear"


@pytest.fixture(scope="module")
def motion() -> bp.Motion:
    return bp.plan(ROBOT, bp.Carry([(0, 0), (0.5, 0.1), (1.0, 0.0)], speed=0.3), GROUND, bp.times(0, 2, dt=0.02))


def tampered(motion: bp.Motion, joint: str, change: np.ndarray | float) -> bp.Motion:
    q = motion.q.copy()
    q[:, ROBOT.joint_index(joint)] += change
    return motion.replace(q=q)


def line(motion: bp.Motion, what: str) -> Line:
    return bp.check(motion)[what]


def test_a_plan_passes(motion: bp.Motion) -> None:
    report = bp.check(motion)
    assert report.ok, str(report)
    assert report[TOUCH].value == pytest.approx(0.0, abs=1e-9) and report[TOUCH].kind == "rim_touches"
    assert report[ROLL].value == pytest.approx(0.0, abs=1e-3) and report[CLEAR].value > 0.05


@pytest.mark.parametrize("name", ["fl", "fr", "r"])
def test_a_wheel_too_small_hangs_and_one_too_large_sinks(motion: bp.Motion, name: str) -> None:
    larger, smaller = (line(tampered(motion, f"{name}.adjust", d), TOUCH) for d in (-0.01, 0.01))
    assert larger.passed is False and "below the ground" in larger.detail and f"{name}.rim" in larger.detail
    assert smaller.passed is False and "above it" in smaller.detail
    assert larger.value == pytest.approx(0.01 * 0.13 * 0.9, rel=0.2)


def test_a_millimetre_at_one_moment_is_found(motion: bp.Motion) -> None:
    base = motion.base.copy()
    base[37, 2] -= 1e-3
    found = line(motion.replace(base=base), TOUCH)
    assert found.passed is False and found.value == pytest.approx(1e-3, rel=0.05)
    assert f"at {motion.t[37]:.4g} s" in found.detail


def test_a_second_place_of_the_rim_in_the_ground_is_found() -> None:
    """Over narrow waves the planned contact is on one flank; a wheel as large as the other one allows sinks into it."""
    waves = bp.Surface("-0.05*cos(22*x)")
    robot = bp.rover({"a": (0.0, 0.0)}, body=(0.1, 0.1))
    at = bp.gaits.carry.pose(robot, waves, (0.01, 0.0), 0.2)
    s = np.linspace(-0.3, 0.3, 600_001)
    other = s > -0.01  # ground on the far side of the trough
    sine, depth = s[other], 0.2 + 0.05 * np.cos(22 * (0.01 + s[other]))
    wrong = float(np.hypot(sine, depth)[sine < 0.12].min())  # the nearest place over there
    assert wrong > at["a"].radius
    motion = bp.plan(robot, bp.Carry(("0.01+0*t", "0*t"), height=0.2, heading=0.0), waves, np.array([0.0, 1.0]))
    law = robot.contacts[0].drive
    assert law is not None and bp.check(motion)[TOUCH].passed
    q = motion.q.copy()
    q[:, 1] = 2.0 * np.arccos((wrong + 1e-4 - law.rubber) / (law.link * np.cos(np.radians(30))))
    assert bp.check(motion.replace(q=q))[TOUCH].passed is False


def test_hubs_that_slip_are_found(motion: bp.Motion) -> None:
    slow = tampered(motion, "fl.spin", -0.1 * motion.joint("fl.spin"))
    found = line(slow, ROLL)
    assert found.passed is False and "fl.rim" in found.detail
    law = ROBOT.contacts[0].drive
    assert law is not None
    missing = 0.1 * motion.qd[:, ROBOT.joint_index("fl.spin")] * law.radius(motion.joint("fl.adjust"))
    hubs = np.stack([motion.poses()[f"{name}.hub"][:, :3] for name in ("fl", "fr", "r")])
    speed = np.linalg.norm(np.diff(hubs, axis=1), axis=2) / 0.02
    expected = np.quantile(np.abs(missing), 0.95) / np.sqrt(np.mean(np.square(speed)))
    assert found.value == pytest.approx(float(expected), rel=0.02)
    assert line(slow, TOUCH).passed


def test_rolling_needs_samples_that_are_near_enough(motion: bp.Motion) -> None:
    few = bp.plan(ROBOT, bp.Carry("line", speed=2.0, height=0.1), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert line(few, ROLL).passed is None and "too few samples" in line(few, ROLL).detail
    still = bp.plan(ROBOT, bp.Carry("line", distance="0*t"), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert line(still, ROLL).passed is None and "nothing moves" in line(still, ROLL).detail


def test_a_hull_in_the_ground_is_found() -> None:
    mound = bp.Surface("0.1*exp(-40*(x**2+y**2))")
    motion = bp.plan(ROBOT, bp.Carry(("0.05*t", "0*t"), height=0.12, heading=0.0), mound, bp.times(0, 1, dt=0.05))
    assert line(motion, CLEAR).value == pytest.approx(0.01, abs=1e-3) and line(motion, CLEAR).passed
    thick = bp.tri_wheel(thickness=0.06)
    found = line(replace(motion, robot=thick), CLEAR)
    assert found.passed is False and found.value == pytest.approx(-0.01, abs=1e-3) and "body" in found.detail


def test_only_solved_samples_are_claimed() -> None:
    motion = bp.plan(ROBOT, bp.Carry("line", height="0.15+0.1*t"), bp.Plane(), bp.times(0, 2, dt=0.05))
    report = bp.check(motion)
    assert not report.ok and [failed.kind for failed in report.failures] == ["solved"]
    assert f"{int((motion.status == 'ok').sum())} samples" in report[TOUCH].detail
    none = bp.plan(ROBOT, bp.Carry("line", height=1.0), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert not none.claims and not bp.check(none).ok


def test_places_off_the_map_fail_instead_of_raising() -> None:
    field = bp.HeightMap(np.zeros((9, 17)), 0.25, (-2.0, -1.0))
    motion = bp.plan(ROBOT, bp.Carry("line", height=0.2), field, bp.times(0, 1, dt=0.1))
    assert bp.check(motion).ok
    away = motion.replace(base=motion.base + 1.3 * np.eye(7)[0])
    assert line(away, TOUCH).passed is False and "outside" in line(away, TOUCH).detail
