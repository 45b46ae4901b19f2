"""What physics makes of the crawl: bars measured beforehand, and controls.

SILO4 of 30 kg on ball feet of 10 mm, friction 0.8, servos of 4000 N m / rad, time steps of 1 ms.
"""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.simulate.reference import Reference

pytest.importorskip("mujoco")

SERVO = (4000.0, 80.0)


def walk(gait, ground, until, robot=None):
    return bp.plan(robot or bp.silo4(), gait, ground, bp.times(0, until, dt=0.02)).raise_if_failed()


def trial(motion, **options):
    """At full speed from the first sample on: a walk begins at rest."""
    return bp.simulate(motion, friction=0.8, servo=SERVO, ramp=0.0, **options)


def height_error(motion, run):
    """Largest difference of height of executed and planned base, m."""
    measured = run.t >= run.start_time
    planned = Reference.of(motion).bases(run.t[measured] - run.start_time)
    return float(np.abs(run.base[measured, 2] - planned[:, 2]).max())


def tilts(motion, run):
    """Largest angle between the z axes of executed and planned base, rad."""
    measured = run.t >= run.start_time
    planned = Reference.of(motion).bases(run.t[measured] - run.start_time)
    up = np.array([0.0, 0.0, 1.0])
    one, other = (bp.spatial.rotate(base[:, 3:], up) for base in (run.base[measured], planned))
    return float(np.arccos(np.clip(np.sum(one * other, axis=1), -1.0, 1.0)).max())


def assert_bars(motion, run, tilt):
    assert run.ok and not [text for text in run.warnings if "not solved" in text]
    assert bp.check(motion)["the centre of mass"].value >= 0.01
    assert 0.97 <= run.advance_ratio <= 1.03
    assert run.tilt <= np.radians(tilt)
    assert tilts(motion, run) == pytest.approx(run.tilt, abs=1e-3)
    assert height_error(motion, run) <= 4e-3
    assert run.slips and max(slip.largest for slip in run.slips) <= 8e-3
    assert run.peak_torque <= 1.4 * motion.facts["peak_holding_torque"]
    assert run.lift_ratio >= 0.8


@pytest.fixture(scope="module")
def level():
    motion = walk(bp.Crawl((0.01, 0.0)), bp.Plane(), 24)
    return motion, trial(motion, cycles=2)


def test_on_the_level(level):
    assert_bars(*level, tilt=0.3)


@pytest.mark.parametrize(("height", "tilt"), [(0.02, 0.5), (0.04, 0.8)])
def test_over_hills_and_hollows(height, tilt):
    ground = bp.Surface(f"{height}*sin(6*x)*cos(5*y)")
    motion = walk(bp.Crawl((0.01, 0.0), foothold="search"), ground, 24)
    assert_bars(motion, trial(motion), tilt)


def test_crabwise_backward_and_turning():
    motion = walk(bp.Crawl((-0.006, 0.006), 0.01), bp.Surface("0.02*sin(6*x)*cos(5*y)"), 24)
    run = trial(motion)
    assert_bars(motion, run, tilt=0.5)
    assert abs(run.turned[-1]) <= np.radians(1.0)


def test_as_fast_as_the_joints_go():
    motion = walk(bp.Crawl((0.03, 0.0)), bp.Surface("0.02*sin(6*x)*cos(5*y)"), 13)
    run = trial(motion)
    assert 0.97 <= run.advance_ratio <= 1.03
    assert run.tilt <= np.radians(0.6)
    assert height_error(motion, run) <= 4e-3


def test_stairs():
    ground = bp.Profile([(None, 0.0), (0.45, 0.04), (0.7, 0.08)])
    motion = walk(bp.Crawl((0.012, 0.0), foothold="search", clearance=0.01), ground, 60, bp.silo4(shell=True))
    run = trial(motion)  # links and body can touch, too: torques say whether they do
    assert bp.check(motion)["links and body clear of the ground"].value >= 0.005
    assert_bars(motion, run, tilt=0.5)
    assert run.base[-1, 2] - run.base[0, 2] > 0.03


def test_six_legs():
    motion = walk(bp.Crawl((0.01, 0.0)), bp.Surface("0.02*sin(6*x)*cos(5*y)"), 18, bp.hexapod(shell=True))
    assert_bars(motion, trial(motion), tilt=0.3)


def test_up_a_slope_along_it():
    motion = walk(bp.Crawl((0.01, 0.0), body="follow"), bp.Plane(slope=(0.2, 0.1)), 18)
    run = trial(motion)
    # loaded contacts creep downhill a little
    assert 0.95 <= run.advance_ratio <= 1.03
    assert run.tilt <= np.radians(0.5)
    assert max(slip.largest for slip in run.slips) <= 8e-3
    assert height_error(motion, run) <= 4e-3


def test_a_planned_tip_is_one(level):
    """Front legs first without sway: the centre of mass is outside of the feet by 12 mm. The robot rocks onto the foot
    that should swing, which stays on the ground, while the advance does not show it; with sway it walks."""
    options = {"cycle_time": 16.0, "sequence": ("fl", "hl", "fr", "hr")}
    tipping = walk(bp.Crawl((0.01, 0.0), sway=0, **options), bp.Plane(), 16)
    assert tipping.facts["support_margin"] < -0.01
    assert bp.check(tipping)["the centre of mass"].passed is False
    run = trial(tipping, cycles=1)
    assert run.tilt > np.radians(3.0)
    assert run.lift_ratio < 0.2
    assert max(slip.largest for slip in run.slips) > 0.02
    assert 0.97 <= run.advance_ratio <= 1.03
    swaying = walk(bp.Crawl((0.01, 0.0), **options), bp.Plane(), 16)
    assert_bars(swaying, trial(swaying, cycles=1), tilt=0.3)


def test_larger_feet_roll_and_inflate_the_advance(level):
    robot = bp.silo4(foot_radius=0.02)
    motion = walk(bp.Crawl((0.01, 0.0)), bp.Plane(), 24, robot)
    assert trial(motion, cycles=2).advance_ratio > level[1].advance_ratio + 0.015


def test_holding_torques_are_those_that_physics_needs(level):
    motion, run = level
    assert 0.9 * motion.facts["peak_holding_torque"] <= run.peak_torque


def test_it_starts_at_rest_in_its_first_pose(level):
    motion, _ = level
    assert bp.simulate(motion, friction=0.8, servo=SERVO, cycles=1).settings["ramp"] == 0.0
