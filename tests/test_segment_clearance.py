"""Clearance of whole segments: against dense points, corners that reach through, and the judge that uses it."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.ground import Corridor, Ground, Plane, Profile, Surface
from bodyplan.motion import Motion
from bodyplan.spatial import apply

POINTS = 4001
STAIR = Profile([(None, 0.0), (0.5, 0.1)])


def random_profile(rng: np.random.Generator) -> Profile:
    """Up to 7 steps of floor and ceiling, parts of the ceiling open."""
    count = int(rng.integers(0, 8))
    floor = [None, *np.sort(rng.uniform(-3, 3, count))], rng.uniform(-0.5, 0.5, count + 1)
    ceiling = [None, *np.sort(rng.uniform(-3, 3, count))], rng.uniform(0.6, 1.5, count + 1)
    ceiling[1][rng.random(count + 1) < 0.3] = np.inf
    return Profile(*(list(zip(x, z.tolist(), strict=True)) for x, z in (floor, ceiling)))


def random_segments(rng: np.random.Generator, ground: Profile) -> np.ndarray:
    """Short and long, level and upright ones, and some that begin on a step or in its plane."""
    ends = rng.uniform((-4.0, -1.0, -1.2), (4.0, 1.0, 2.0), (24, 2, 3))
    ends[:6, 1] = ends[:6, 0] + rng.normal(size=(6, 3)) * 0.2
    ends[6:10, 1, 0] = ends[6:10, 0, 0]
    ends[10:14, 1, 2] = ends[10:14, 0, 2]
    if len(ground.breaks):
        ends[14:18, 0, 0] = rng.choice(ground.breaks, 4)
        ends[16:20, 0, 2] = ground.height(ends[16:20, 0, :2])
        ends[17, 1, 0] = ends[17, 0, 0]
    ends[20, 1] = ends[20, 0]
    return ends


def dense(ground: Ground, ends: np.ndarray) -> np.ndarray:
    s = np.linspace(0.0, 1.0, POINTS)[:, None]
    return np.asarray(ground.clearance(ends[:, None, 0] * (1 - s) + ends[:, None, 1] * s).min(axis=-1))


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_profile_s_is_the_smallest_clearance_along_the_segment(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ground = random_profile(rng)
    ends = random_segments(rng, ground)
    got, sampled = ground.segment_clearance(ends), dense(ground, ends)
    apart = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1) / (POINTS - 1)
    # clearance changes by no more than the way between two samples
    assert np.all(got <= sampled + 1e-12)
    assert np.all(got >= sampled - 0.5 * apart - 1e-12)
    np.testing.assert_allclose(ground.segment_clearance(ends[:, ::-1]), got, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("ends", "expected"), [
    ([(0.2, 0.3), (0.3, 0.3)], np.hypot(0.2, 0.2)),  # from the corner
    ([(0.2, 0.05), (0.4, 0.05)], 0.05),  # from the lower tread
    ([(0.2, 0.09), (0.46, 0.09)], 0.04),  # from the face
    ([(0.4, 0.2), (0.6, 0.2)], 0.1),  # along over the corner
    ([(0.45, 0.10), (0.55, 0.20)], np.sqrt(0.5) * 0.05),  # leaning over the corner
    ([(0.4, 0.1), (0.6, 0.1)], 0.0),  # lies on the tread
    ([(0.5, 0.0), (0.5, 0.1)], 0.0),  # lies on the face
    ([(0.4, 0.14), (0.6, 0.04)], -0.06),  # an end inside
    ([(0.48, 0.05), (0.6, 0.11)], -0.08 / 3.0),  # through the corner: both faces as far at x = 0.79 / 1.5
    ([(0.1, -0.3), (0.2, -0.1)], -0.3),
    ([(0.2, -0.2), (0.9, -0.2)], -0.3),  # deeper under the upper tread
])  # fmt: skip
def test_at_one_step(ends: list[tuple[float, float]], expected: float) -> None:
    at = np.array([[x, 3.0 * i, z] for i, (x, z) in enumerate(ends)])  # y does not matter
    assert float(STAIR.segment_clearance(at)) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("reach", [1e-9, 0.003, 0.03])
def test_a_corner_that_reaches_through_is_the_deepest_point_of_the_cut(reach: float) -> None:
    # a line at 45 degrees, the corner (0.5, 0.1) `reach` beyond it: in the middle of the cut both faces are as far
    middle = np.array([0.5, 0.0, 0.1]) + np.sqrt(0.5) * reach * np.array([1.0, 0.0, -1.0])
    along = np.sqrt(0.5) * np.array([1.0, 0.0, 1.0])
    ends = np.stack([middle - 0.1 * along, middle + 0.1 * along])
    assert STAIR.clearance(ends).min() > 0.0
    assert float(STAIR.segment_clearance(ends)) == pytest.approx(-np.sqrt(0.5) * reach, rel=1e-6)


def test_planes_are_exact_and_other_grounds_take_nine_points() -> None:
    rng = np.random.default_rng(0)
    ends = rng.uniform(-1.0, 1.0, (3, 5, 2, 3))
    plane = Plane(0.1, slope=(0.3, -0.2))
    np.testing.assert_array_equal(plane.segment_clearance(ends), plane.clearance(ends).min(axis=-1))
    s = np.linspace(0.0, 1.0, 9)[:, None]
    for ground in (Surface("0.1*sin(x)*y"), Corridor(0.7)):
        points = ends[..., None, 0, :] * (1 - s) + ends[..., None, 1, :] * s
        np.testing.assert_array_equal(ground.segment_clearance(ends), ground.clearance(points).min(axis=-1))
    for ground in (plane, STAIR, Corridor(0.7)):
        assert ground.segment_clearance(np.zeros((0, 2, 3))).shape == (0,)
        assert ground.segment_clearance(np.zeros((2, 3))).shape == ()
        with pytest.raises(bp.InputError, match=r"ends.*\(\.\.\., 2, 3\)"):
            ground.segment_clearance(np.zeros((4, 3)))
        with pytest.raises(bp.InputError, match="finite"):
            ground.segment_clearance(np.full((2, 3), np.nan))


def test_a_floor_alone_has_no_ceiling() -> None:
    ground = Profile([(None, 0.0), (0.5, 0.1)], ceiling=0.3, friction=0.4)
    assert ground.floor_alone() == Profile([(None, 0.0), (0.5, 0.1)], friction=0.4)
    assert float(ground.segment_clearance([[0.0, 0.0, 0.2], [0.2, 0.0, 0.2]])) == pytest.approx(0.1)
    assert float(ground.floor_alone().segment_clearance([[0.0, 0.0, 0.2], [0.2, 0.0, 0.2]])) == pytest.approx(0.2)


def test_a_hundred_thousand_segments_take_a_moment() -> None:
    rng = np.random.default_rng(1)
    x = np.linspace(-3.0, 3.0, 9)
    ground = Profile([(None, 0.0), *zip(x, rng.uniform(-0.5, 0.5, 9), strict=True)], ceiling=0.8)
    ends = rng.uniform((-4.0, -1.0, -1.0), (4.0, 1.0, 1.0), (100_000, 2, 3))
    ends[:, 1] = ends[:, 0] + 0.1 * rng.normal(size=(100_000, 3))
    ground.segment_clearance(ends[:1])  # compiles
    start = time.perf_counter()
    ground.segment_clearance(ends)
    assert time.perf_counter() - start < 1.0  # some 0.05 s on two cores


# --- the judge ---


def leaning(clips: float) -> Motion:
    """A link of 1 m over a stair edge at a third of its length, which reaches ``clips`` m into its side."""
    robot = bp.snake(1, 1.0, radius=0.01)
    angle = np.arctan(0.5)
    along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    edge = np.array([0.5, 0.1])
    rear = edge + (0.01 - clips) * normal - 0.36 * along
    base = np.tile([rear[0], 0.0, rear[1], np.cos(angle / 2), 0.0, -np.sin(angle / 2), 0.0], (2, 1))
    none = np.zeros((2, 0))
    floor = [(None, rear[1] - 0.5), (0.5, 0.1), (0.52, rear[1] - 0.5)]
    ground = Profile(floor, ceiling=rear[1] + 1.0)
    return Motion(robot, ground, {}, [0.0, 1.0], base, none, none, none, np.zeros(2), np.full(2, "ok"))


def test_a_link_that_clips_a_stair_edge_between_two_points_is_found() -> None:
    clear = bp.check(leaning(-0.001))
    assert clear.ok and clear["clear of the floor"].value == pytest.approx(0.001, abs=1e-12)
    clipped = leaning(0.004)
    points = np.linspace([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 5)
    pose = clipped.poses()["link1"][0]
    # five points along the link see nothing
    assert float(clipped.ground.clearance(apply(pose, points)).min()) > 0.01
    report = bp.check(clipped)
    line = report["clear of the floor"]
    assert line.passed is False and line.value == pytest.approx(-0.004, abs=1e-12)
    assert {failure.kind for failure in report.failures} == {"ground"}
