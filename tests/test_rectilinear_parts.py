"""Parts of an inching body keep clear of each other: against the judge's distances in space, and as drives use it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import pose
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.motion import Motion
from rectilinear_cases import THIN, TIPS, anchors_of, failures, planned, snake

CLEAR = "links clear of each other"
ROBOTS: dict[str, Any] = {
    "thin": lambda: snake(radius=0.01),
    "thick": lambda: bp.snake(10, 0.1, axes="alternating", first="pitch"),
    "feet": lambda: bp.snake(10, 0.1, **(THIN | {"foot_radius": 0.03, "foot_spread": 0.06})),
    "feet close by": lambda: bp.snake(10, 0.1, **(THIN | {"foot_radius": 0.03, "foot_spread": 0.028})),
    "feet in line": lambda: bp.snake(10, 0.1, **(THIN | {"foot_radius": 0.03})),
    "pitch only": lambda: bp.snake(6, 0.2, axes="pitch", radius=0.02),
    "unequal": lambda: bp.snake(6, [0.1, 0.3, 0.1, 0.1, 0.3, 0.1], axes="pitch", radius=0.01),
    "more joints": lambda: bp.snake(13, 0.1, axes="pitch", radius=0.01),
}


def still(robot: bp.Robot, q: Any) -> Motion:
    base = np.tile([0.0, 0.0, 9.0, 1.0, 0.0, 0.0, 0.0], (2, 1))
    shape = np.tile(q, (2, 1))
    zero = np.zeros_like(shape)
    return Motion(robot, bp.Plane(), {}, np.array([0.0, 1.0]), base, shape, zero, zero, np.zeros(2), np.full(2, "ok"))


@pytest.mark.parametrize("name", ROBOTS)
def test_overlaps_are_those_of_the_judge(name: str) -> None:
    """Bent at random: parts are nearer than they must be exactly where the judge finds them in each other, and where
    nothing lies to their side by as much as it finds."""
    robot = ROBOTS[name]()
    snake_ = InchingSnake.of(robot, 3, None)
    parts, rng = snake_.parts, np.random.default_rng(len(name))
    assert parts is not None
    a, b = snake_.links[0::2], snake_.links[1::2]
    low, high = np.abs(a - b), a + b
    found = {True: 0, False: 0}
    for _ in range(60):
        spans = low + (high - low) * rng.uniform(0.02, 0.98, 2)
        slopes = rng.uniform(-0.9, 0.9, 2)
        stance = pose(anchors_of(spans * np.cos(slopes), spans * np.sin(slopes)), snake_.links)
        points = stance.points[:, [0, 2]]
        into = float(parts.overlaps(points, stance.angles, snake_.tail).max())
        gap = bp.check(still(robot, snake_.q(stance.all_joints)))[CLEAR].value
        assert gap is not None
        if abs(gap) > 1.1e-3 * parts.need.max():  # parts keep 1e-3 more apart
            assert (into > 0.0) == (gap < 0.0), (into, gap)
            found[into > 0.0] += 1
        if "feet" not in name and -parts.need.max() < into < 0.999 * parts.need.max():
            assert into == pytest.approx(-gap, abs=1.1e-3 * parts.need.max())
    assert min(found.values()) >= 5, found


def test_parts_beside_each_other_need_less_in_the_plane() -> None:
    """Feet of 30 mm at 28 mm to either side and links of 5 mm: balls on one side need 60 mm, on both sides what is left
    of that over 56 mm across, a ball and a link what is left of 35 mm over 28 mm, two links 10 mm."""
    parts = InchingSnake.of(ROBOTS["feet close by"](), 3, None).parts
    assert parts is not None
    needs = 1.001 * np.array([0.01, 0.035, 0.06])
    across = [0.0, 0.028, 0.056]
    wanted = [0.0, needs[2], *np.sqrt(needs**2 - np.square(across))]
    np.testing.assert_allclose(np.unique(np.round(parts.need, 12)), np.unique(np.round(wanted, 12)), atol=1e-12)


@pytest.mark.parametrize("schedule", ["wave", "two-phase"])
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("lift", [0.0, 0.04])
def test_the_fastest_drive_folds_as_far_as_parts_are_clear(name: str, schedule: str, lift: float) -> None:
    robot = ROBOTS[name]()
    motion = planned(robot, bp.Rectilinear(schedule=schedule, lift=lift), samples=121)
    assert set(motion.status) == {"ok"} and failures(motion) <= {TIPS}
    gap = bp.check(motion)[CLEAR].value
    radius = max(c.radius for c in robot.contacts)
    assert 0.0 <= gap <= 0.05 * radius + 2e-4, "no farther and no less"


def test_unequal_links_do_not_lie_on_each_other_or_cross() -> None:
    """Links of 0.3 and 0.1 m fold to 0.2 m only if they may lie on each other; elbows that lean forward meet a leg."""
    robot = ROBOTS["unequal"]()
    motion = planned(robot, bp.Rectilinear(lift=0.0))
    short = 0.4 - motion.facts["advance_per_cycle"]
    assert 0.2 < short < 0.25 and not failures(motion) - {TIPS}
    facing = bp.snake(6, [0.1, 0.3, 0.2, 0.2, 0.3, 0.1], axes="pitch", radius=0.005)
    for spacing in (0.9, 0.6, 0.4):
        motion = planned(facing, bp.Rectilinear(spacing=spacing, lift=0.02))
        if set(motion.status) == {"ok"}:
            assert not failures(motion) - {TIPS}
        else:
            assert set(motion.status) <= {"links_crossing", "collapsed"}
    assert set(motion.status) == {"links_crossing"}, "at 0.4 of straight its elbows stand in each other"


def test_parts_that_are_far_apart_cost_nothing_to_tell() -> None:
    """Two hundred units: as far as parts of neighbouring legs, and no farther."""
    robot = bp.snake(202, 0.1, axes="pitch", radius=0.005)
    snake_ = InchingSnake.of(robot, 101, None)
    parts = snake_.parts
    assert parts is not None
    stance = pose(anchors_of(np.full(100, 0.1), np.zeros(100)), snake_.links)
    into = parts.overlaps(stance.points[:, [0, 2]], stance.angles, snake_.tail)
    assert np.all(into < 0.0)
    crossed = stance.points[:, [0, 2]].copy()
    crossed[-1] = crossed[2]  # the head end among the tail's links
    assert parts.overlaps(crossed, stance.angles, snake_.tail)[1] > 0.0
    broken = crossed.copy()
    broken[3] = np.nan
    assert np.all(parts.overlaps(broken, stance.angles, snake_.tail) == -np.inf)


def test_robots_whose_parts_may_all_touch_have_none() -> None:
    one = bp.snake(6, 0.1, axes="pitch", radius=0.005)
    bare = bp.Robot(one.name, one.chains, contacts=())
    assert InchingSnake.of(one, 3, None).parts is not None and InchingSnake.of(bare, 3, None).parts is None
    motion = planned(bare, bp.Rectilinear(lift=0.0))
    assert motion.facts["advance_per_cycle"] == pytest.approx(0.2, rel=1e-5), "a body without thickness folds flat"


@pytest.mark.parametrize("name", ROBOTS)
def test_parts_at_one_place_count_as_one(name: str) -> None:
    """Left and right feet lie in each other in the plane: without one of them, all overlaps are as they were."""
    robot = ROBOTS[name]()
    snake_ = InchingSnake.of(robot, 3, None)
    parts, rng = snake_.parts, np.random.default_rng(len(name))
    assert parts is not None
    merged = parts.merged()
    places = {(int(k), *np.ravel(ends)) for k, ends in zip(parts.link, parts.ends, strict=True)}
    assert len(merged.link) == len(places) <= len(parts.link)
    assert (len(merged.link) < len(parts.link)) == (name in ("feet", "feet close by"))
    assert (np.diff(merged.link) >= 0).all()
    points, angles = rng.normal(0.0, 0.1, (200, 5, 2)), rng.uniform(-np.pi, np.pi, (200, 4))
    points[..., 0] += np.linspace(0.0, 0.2, 5)
    same = merged.overlaps(points, angles, snake_.tail), parts.overlaps(points, angles, snake_.tail)
    np.testing.assert_array_equal(*same)
    assert (same[0] > 0.0).any() and (same[0] < 0.0).any()
