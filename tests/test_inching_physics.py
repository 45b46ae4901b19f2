"""What physics makes of inching: bars measured beforehand, and controls.

Links of 200 mm between pitch joints (two modules of 100 mm and 125 g), paired ball feet of 3 mm at +-60 mm, 1 s a move.
"""

import numpy as np
import pytest

import bodyplan as bp

pytest.importorskip("mujoco")

SERVO = (150.0, 3.0)


def snake(anchors, foot_radius=0.003):
    return bp.snake(
        4 * anchors - 2,
        0.1,
        axes="alternating",
        first="pitch",
        foot_radius=foot_radius,
        foot_spread=0.06,
        mass=0.125,
    )


def plan(gait, robot, ground=None, until=None):
    on = bp.Plane() if ground is None else ground
    end = gait.period(robot, on) if until is None else until
    return bp.plan(robot, gait, on, bp.times(0, end, dt=0.02))


def trial(motion, friction=0.8, **options):
    return bp.simulate(motion, friction=friction, servo=SERVO, **options)


def stroke_share(run, stride):
    """Largest slip of a standing anchor over the stride."""
    return max(slip.largest for slip in run.slips) / stride


@pytest.fixture(scope="module")
def two_phases():
    gait = bp.Rectilinear(5, schedule="two-phase", drive="periodic", spacing=0.8, lift=0.03)
    motion = plan(gait, snake(5))
    return motion, trial(motion, cycles=2)


def test_five_anchors_in_two_phases_go_as_planned(two_phases):
    motion, run = two_phases
    assert 0.97 <= run.advance_ratio <= 1.03
    assert stroke_share(run, motion.facts["advance_per_cycle"]) <= 0.05
    assert run.lift_ratio >= 0.8
    # it stands all the time: the body stays as level as its servos hold it
    assert run.tilt <= np.radians(2.0)
    assert bp.check(motion)["the centre of mass"].value > 0.1


def test_it_starts_at_rest_in_its_first_pose(two_phases):
    _, run = two_phases
    assert run.settings["ramp"] == 0.0


def test_holding_torques_are_those_that_physics_needs(two_phases):
    motion, run = two_phases
    # slow moves: the peak executed is the planned holding torque and what the moves add
    assert 0.8 * motion.facts["peak_holding_torque"] <= run.peak_torque <= 1.6 * motion.facts["peak_holding_torque"]


def test_three_anchors_of_equal_spacing_advance_though_they_have_no_margin():
    motion = plan(bp.Rectilinear(3, drive="paper", lift=0.03), snake(3))
    run = trial(motion, cycles=2)
    assert 0.97 <= run.advance_ratio <= 1.03
    assert run.lift_ratio >= 0.8
    assert bp.check(motion)["the centre of mass"].value == pytest.approx(0.0, abs=1e-6)


def test_a_short_rear_leg_makes_the_head_drag_while_advance_does_not_show_it():
    """With T to M shorter than M to H the head comes down ahead of the centre of mass: it tips and drags."""
    motion = plan(bp.Rectilinear(3, drive="periodic", spacing=(0.5, 0.9), lift=0.03), snake(3))
    run = trial(motion, cycles=2)
    assert 0.97 <= run.advance_ratio <= 1.03
    assert run.lift_ratio <= 0.5
    line = bp.check(motion)["the centre of mass"]
    # equal links: (MH - TM) / 4 = 0.04 from the legs alone; tail and head are equal here
    assert line.passed is False and line.value < -0.03 and "tips" in line.detail


def test_without_lift_equal_friction_takes_it_nowhere_and_a_ratchet_takes_it_all_the_way():
    motion = plan(bp.Rectilinear(5, schedule="two-phase", drive="periodic", spacing=0.8, lift=0.0), snake(5))
    plain, ratchet = trial(motion, cycles=2), trial(motion, bp.Friction(0.1, 0.45, 0.3), cycles=2)
    assert abs(plain.advance_ratio) <= 0.15
    assert ratchet.advance_ratio >= 0.95


def test_larger_feet_roll_and_inflate_the_advance(two_phases):
    gait = bp.Rectilinear(5, schedule="two-phase", drive="periodic", spacing=0.8, lift=0.03)
    large = trial(plan(gait, snake(5, foot_radius=0.02)), cycles=2)
    assert large.advance_ratio > two_phases[1].advance_ratio + 0.02


def test_it_inches_under_a_ceiling_without_touching_it():
    ceiling = 0.16
    gait = bp.Rectilinear(5, schedule="two-phase", lift=0.03)
    motion = plan(gait, snake(5), bp.Profile(0.0, ceiling))
    run = trial(motion, cycles=2)
    assert 0.97 <= run.advance_ratio <= 1.03
    # executed elbows: planned ones touch the ceiling at their highest
    robot = motion.robot
    elbows = [robot.frame_index(f"link{i}") for i in range(3, 18, 4)]
    high = robot.forward(run.q, run.base).positions[:, elbows, 2].max()
    assert high + 0.003 <= ceiling + 0.002


def test_stairs_up_and_down():
    ground = bp.Profile([(None, 0.0), (2.2, 0.03), (3.0, 0.0)], [(None, 0.22), (2.0, 0.25), (3.3, 0.22)])
    # servos let the body sag by 6 mm: what lies low must be lifted over edges by more than that
    gait = bp.Rectilinear(5, schedule="two-phase", lift=0.05)
    motion = plan(gait, snake(5), ground, until=24.0).raise_if_failed()
    report = bp.check(motion)
    assert report.ok, report
    assert report["the centre of mass"].value > 0.05
    # beyond the second edge with its head
    head = motion.poses()["link17"]
    assert head[-1, 0] > 3.0 and head[:, 2].max() > 0.03
    run = trial(motion)
    assert 0.97 <= run.advance_ratio <= 1.03
    # as far as legs of soft servos lean when folded high; a snake that tips leans by much more
    assert run.tilt <= np.radians(5.0)


def test_steering_ends_with_the_wanted_heading_in_physics():
    heading = np.radians(12.0)
    gait = bp.Rectilinear(
        5, schedule="two-phase", drive="periodic", spacing=0.85, share=0.35, lift=0.03, steer=[(0, heading)]
    )
    motion = bp.plan(snake(5), gait, bp.Plane(), bp.times(0, 16.0, dt=0.02)).raise_if_failed()
    run = trial(motion)
    assert motion.facts["turn_angle"] == pytest.approx(heading, abs=1e-11)
    w, z = run.base[-1, 3], run.base[-1, 6]
    assert 2.0 * np.arctan2(z, w) == pytest.approx(heading, abs=np.radians(1.0))
    assert 0.97 <= run.advance_ratio <= 1.03
