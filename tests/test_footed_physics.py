"""A snake on its feet in physics, on floors in steps and under ceilings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.motion import Motion

STEPS = [(None, 0.0), (0.9, 0.05), (2.5, 0.0)]
UNDER = [(None, 0.4), (1.0, 0.2), (2.2, None)]


def snake(**options: Any) -> bp.Robot:
    return bp.snake(
        8, 0.1, **({"axes": "alternating", "first": "pitch", "foot_radius": 0.03, "foot_spread": 0.05} | options)
    )


def still(robot: bp.Robot, ground: bp.Profile, x: float, z: float, seconds: float = 1.0) -> Motion:
    """Straight, its feet on a floor at height ``z``, its tail at ``x``."""
    base = np.tile([x, 0.0, z + 0.03, 1.0, 0.0, 0.0, 0.0], (2, 1))
    none = np.zeros((2, robot.n))
    loaded = np.tile([c.shape == "sphere" for c in robot.contacts], (2, 1))
    return Motion(robot, ground, {}, [0.0, seconds], base, none, none, none, np.zeros(2), np.full(2, "ok"), (), loaded)


@pytest.mark.parametrize("friction", [None, (0.2, 0.6, 0.4)], ids=["plain", "scales"])
@pytest.mark.parametrize(("x", "z"), [(-0.9, 0.0), (1.1, 0.05)])
def test_a_straight_snake_stands_still_on_its_feet_under_a_ceiling(x: float, z: float, friction: Any) -> None:
    motion = still(snake(), bp.Profile(STEPS, UNDER), x, z)
    report = bp.check(motion)
    assert report.ok, report.failures
    assert report["clear of the floor"].value == pytest.approx(0.0, abs=1e-12)
    trial = bp.simulate(motion, friction=friction, settle=0.5, ramp=0.0)
    assert trial.ok and trial.warnings == ()
    # it sags on its servos and then rests
    later = trial.t >= trial.start_time
    assert np.abs(trial.com[later] - trial.com[-1]).max() < 2e-4
    assert np.abs(trial.base[later, :3] - motion.base[0, :3]).max() < 2e-3
    assert trial.tilt is not None and trial.tilt < 0.01
