"""What physics makes of ACM-L2's serpentine and sinus-lifting movement: bars measured beforehand, and controls.

Speeds are over the no-slip speed, signed along the planned heading; the waves are those of paper *acm*, section V
(alpha = 5 pi / 12, c0 = 0.3), with a wavelength of 0.64 m at 0.25 Hz.
"""

import numpy as np
import pytest

import bodyplan as bp

pytest.importorskip("mujoco")

ALPHA, WAVELENGTH, SPEED = 5.0 * np.pi / 12.0, 0.64, 0.16
T = np.linspace(0.0, WAVELENGTH / SPEED, 201)


def trial(gait, ratio, cycles=1):
    """A trial on a belly that slides sideways ``ratio`` times as hard as along."""
    motion = bp.plan(bp.acm_l2(), gait, bp.Plane(), T)
    belly = bp.Friction(forward=0.2, backward=0.2, sideways=0.2 * ratio)
    return bp.simulate(motion, cycles=cycles, servo=(8.0, 0.06), friction=belly)


def flat(direction=1):
    return bp.Serpentine(bp.Serpenoid(ALPHA, WAVELENGTH), speed=SPEED, direction=direction)


def lifting(lift=0.3):
    return bp.SinusLifting(ALPHA, lift, WAVELENGTH, speed=SPEED)


@pytest.fixture(scope="module")
def lifted():
    return {ratio: trial(lifting(), ratio, cycles=2) for ratio in (1.0, 2.0)}


@pytest.fixture(scope="module")
def unlifted():
    return {ratio: trial(flat(), ratio) for ratio in (1.0, 2.0)}


def test_lifting_is_faster_than_sliding_flat_on_a_smooth_belly(lifted, unlifted):
    assert lifted[2.0].advance_ratio >= 0.80
    assert lifted[2.0].advance_ratio >= 1.3 * unlifted[2.0].advance_ratio
    # a serpenoid of uniform weight and Coulomb friction, infinitely long, makes 0.585 (force balance along it)
    assert unlifted[2.0].advance_ratio == pytest.approx(0.585, abs=0.05)


def test_lifting_needs_no_scales_at_all(lifted, unlifted):
    assert lifted[1.0].advance_ratio >= 0.65
    assert unlifted[1.0].advance_ratio <= 0.1


def test_torques_are_within_those_of_the_robot(lifted, unlifted):
    for run in (*lifted.values(), *unlifted.values()):
        assert run.ok and run.peak_torque <= 0.5
        assert not any("effort" in text or "out of step" in text or "limit" in text for text in run.warnings)


def test_the_slip_angle_falls_with_friction_across(lifted, unlifted):
    for runs in (lifted, unlifted):
        assert 0.0 < runs[2.0].slip_angle < runs[1.0].slip_angle < 0.5 * np.pi
        assert runs[2.0].metrics()["slip_angle_rad"] == runs[2.0].slip_angle
    # a body that follows its own path nearly: the part across is a fifth of that along
    assert unlifted[2.0].slip_angle < np.radians(15.0)


def test_speed_along_its_own_heading_is_what_a_swing_at_the_start_does_not_touch(lifted):
    run = lifted[1.0]  # isotropic friction holds no heading while the wave starts
    assert abs(run.turned[-1]) > 0.1
    assert run.forward_ratio > run.advance_ratio
    assert run.forward_ratio == pytest.approx(np.linalg.norm(run.advance.mean(axis=0)) / 0.394, abs=0.02)


def test_the_wave_the_other_way_goes_the_other_way():
    back = trial(flat(direction=-1), 2.0)
    assert back.planned_advance[0][0] < -0.3
    assert back.advance_ratio > 0.45 and back.speed > 0.0  # along the planned direction, which is backwards


def test_lifting_the_parts_between_the_bends_reverses_the_travel():
    assert trial(lifting(-0.3), 2.0).advance_ratio < -0.5


def test_a_belly_that_slides_easier_sideways_reverses_the_travel():
    assert trial(flat(), 0.5).advance_ratio < -0.4


# --- snakes of other joints ---


def run_cycle(robot, gait, **settings):
    period = gait.period(robot)
    motion = bp.plan(robot, gait, bp.Plane(), np.linspace(0.0, period, 201))
    return bp.simulate(motion, cycles=1, **settings)


@pytest.fixture(scope="module")
def modules():
    """Sixteen modules whose joints turn about z and y in turn."""
    return bp.snake(16, 0.06, axes="alternating", radius=0.02, mass=0.08)


def test_arcs_travel_on_scales():
    robot = bp.snake(9, 0.8 / 9, "arc", radius=0.025, mass=0.11)
    run = run_cycle(robot, flat(), friction=bp.Friction(0.2, 0.2, 0.4), servo=(8.0, 0.06))
    assert 0.4 < run.advance_ratio < 0.7 and not any("out of step" in text for text in run.warnings)


def test_sidewinding_needs_no_scales(modules):
    gait = bp.Sidewinding(0.6, 0.2, 0.64, speed=0.16)
    run = run_cycle(modules, gait, friction=0.5, servo=(10.0, 0.2))
    assert run.advance_ratio >= 0.75 and abs(run.sideways[0]) < 0.2 * np.linalg.norm(run.planned_advance[0])
    assert run.slip_angle > np.radians(30.0)  # it moves across its own axis, that is the point of it


def test_a_bent_body_rolls_sideways_by_its_girth(modules):
    run = run_cycle(modules, bp.Rolling(1.0, np.pi / 2.0), friction=0.5, servo=(10.0, 0.2))
    assert run.advance[0] == pytest.approx([0.0, 2.0 * np.pi * 0.02, 0.0], abs=0.01)
