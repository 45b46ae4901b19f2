"""What physics makes of the concertina gaits: bars measured beforehand, and the controls that give them a meaning."""

import numpy as np
import pytest

import bodyplan as bp

pytest.importorskip("mujoco")

SNAKE = bp.snake(26, 0.05, radius=0.015, mass=0.05)
SCALES = bp.Friction(forward=0.1, backward=0.45, sideways=0.1)
GRIPPING_SCALES = bp.Friction(forward=0.1, backward=0.45, sideways=0.45)


def corridor(width):
    return bp.Corridor(width, height=0.06, friction=0.05, wall_friction=1.0)


def trial(options, ground, servo, friction=None):
    gait = bp.Concertina(**options)
    motion = bp.plan(SNAKE, gait, ground, np.linspace(0.0, gait.period(SNAKE), 301))
    return bp.simulate(motion, cycles=1, servo=servo, friction=friction)


@pytest.fixture(scope="module")
def mirrored():
    """The paper's stages and their mirror image between walls 8 mm narrower than the contracted body."""
    return trial({"contraction": "mirror"}, corridor(0.135), (20.0, 0.4))


@pytest.fixture(scope="module")
def waves():
    return trial(
        {"body_modules": 8, "omega": 1.2, "extension": 0.35, "waves": 2, "max_joint_rate": 1.0},
        corridor(0.1),
        (20.0, 0.4),
    )


def test_the_paper_s_gait_loses_two_thirds_where_folds_let_go(mirrored):
    assert 0.30 <= mirrored.advance_ratio <= 0.45
    assert mirrored.peak_torque <= 1.2
    slip = mirrored.slip_by_stage()
    first = [slip[f"stretch {part}"]["along"] for part in ("head", "module 4", "module 3")]
    assert abs(sum(first)) <= 0.002
    late = [slip[f"stretch {part}"]["along"] for part in ("module 1", "tail")]
    assert sum(late) < -0.03  # the last two stages, with fewer than two folds holding


def test_travelling_waves_keep_their_advance(mirrored, waves):
    assert waves.advance_ratio >= 0.90
    assert waves.peak_torque <= 0.6 * mirrored.peak_torque


def test_waves_are_faster_than_the_warped_mirror_at_equal_joint_rate(waves):
    mirror = trial(
        {"body_modules": 8, "omega": 1.2, "contraction": "mirror", "max_joint_rate": 1.0}, corridor(0.1), (20.0, 0.4)
    )
    assert waves.speed >= 1.4 * mirror.speed


def test_one_wave_in_the_corridor():
    one = trial({"body_modules": 8, "omega": 1.2, "extension": 0.7, "max_joint_rate": 1.0}, corridor(0.1), (20.0, 0.4))
    assert one.advance_ratio >= 0.90


def test_too_little_squeeze_does_not_hold(waves):
    loose = trial(
        {"body_modules": 8, "omega": 1.2, "extension": 0.35, "waves": 2, "max_joint_rate": 1.0},
        corridor(0.106),
        (20.0, 0.4),
    )
    assert loose.advance_ratio < 0.6 * waves.advance_ratio


def test_scales_on_the_flat():
    literal = trial({"contraction": "literal"}, bp.Plane(), (5.0, 0.1), SCALES)
    mirror = trial({"contraction": "mirror"}, bp.Plane(), (5.0, 0.1), SCALES)
    wave = trial({"extension": 0.4, "max_joint_rate": 0.6}, bp.Plane(), (5.0, 0.1), SCALES)
    assert literal.advance_ratio >= 0.45
    assert mirror.advance_ratio >= 0.33
    assert wave.advance_ratio >= 0.90


def test_two_waves_on_scales_are_faster_than_the_warped_mirror_at_equal_joint_rate():
    mirror = trial({"contraction": "mirror", "max_joint_rate": 0.6}, bp.Plane(), None, SCALES)
    waves = trial({"extension": 0.35, "waves": 2, "max_joint_rate": 0.6}, bp.Plane(), None, SCALES)
    assert waves.speed >= 1.8 * mirror.speed


def test_scales_that_hold_sideways_favour_the_mirror():
    literal = trial({"contraction": "literal"}, bp.Plane(), (5.0, 0.1), GRIPPING_SCALES)
    mirror = trial({"contraction": "mirror"}, bp.Plane(), (5.0, 0.1), GRIPPING_SCALES)
    assert mirror.advance_ratio >= 0.25
    assert mirror.advance_ratio >= 1.4 * literal.advance_ratio


def test_without_scales_nothing_advances():
    control = trial({"contraction": "mirror"}, bp.Plane(), (5.0, 0.1), 0.3)
    assert abs(control.advance_ratio) <= 0.15
