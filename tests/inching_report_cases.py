"""Snakes that inch, to report on: planned once, executed once."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import bodyplan as bp
from bodyplan.show.inching import Inching
from bodyplan.show.playback import Playback
from bodyplan.simulate.trial import Trial

SCHEDULE = {"schedule": "two-phase", "lift": 0.04, "move_time": 1.0}


def footed(links: int = 18, link: float = 0.1, **options: Any) -> bp.Robot:
    made = {"foot_radius": 0.03 * link, "foot_spread": 0.6 * link, "mass": 125.0 * link**3} | options
    return bp.snake(links, link, axes="alternating", first="pitch", **made)


@lru_cache
def five() -> bp.Motion:
    """Five anchors in two phases under a level ceiling, one cycle and a bit."""
    gait = bp.Rectilinear(5, **SCHEDULE)
    return bp.plan(footed(), gait, bp.Profile(0.0, 0.16), bp.times(0.0, 2.5, dt=0.02))


@lru_cache
def five_trial() -> Trial:
    return bp.simulate(five(), cycles=2, friction=0.8, servo=(150, 3), settle=0.5, ramp=0.0)


@lru_cache
def three() -> bp.Motion:
    """The paper's Fig. 8, two cycles."""
    gait = bp.Rectilinear(3, drive="paper", spacing=(0.3, 0.7), lift=0.2, move_time=3.0)
    return bp.plan(footed(10, 1.0), gait, bp.Plane(), bp.times(0.0, 18.0, dt=0.02))


@lru_cache
def climber() -> bp.Motion:
    """Up a step and down again."""
    gait = bp.Rectilinear(5, **SCHEDULE | {"lift": 0.05})
    ground = bp.Profile([(None, 0.0), (1.2, 0.03), (2.0, 0.0)], [(None, 0.3), (1.5, 0.35)])
    return bp.plan(footed(), gait, ground, bp.times(0.0, 10.0, dt=0.02))


@lru_cache
def long_way() -> bp.Motion:
    """Three anchors whose drives differ, so that nothing repeats: 60 moves and more."""
    gait = bp.Rectilinear(3, drive=[0.02, 0.02 + 1e-6, 0.02], spacing=0.8, lift=0.01, move_time=0.25)
    return bp.plan(footed(10), gait, bp.Plane(), bp.times(0.0, 16.0, dt=0.02))


@lru_cache
def steered() -> bp.Motion:
    """A turn to the left."""
    gait = bp.Rectilinear(5, **SCHEDULE, spacing=0.9, steer=[(1, 0.2)])
    return bp.plan(footed(), gait, bp.Plane(), bp.times(0.0, 8.0, dt=0.02))


def inching(motion: bp.Motion) -> Inching:
    found = Playback.of(motion, None).inching
    assert isinstance(found, Inching)
    return found
