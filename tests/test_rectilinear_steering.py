"""An inching snake that turns: closed chains, exact rates, headings as wanted, feet level and at rest."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.gaits.rectilinear.bent import Chain
from bodyplan.gaits.rectilinear.bowed import bowed
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.strides import start_spacings
from bodyplan.gaits.rectilinear.turning import Bends, turn


def snake(anchors, link=0.1, **options):
    settings = {"foot_radius": 0.003, "foot_spread": 0.06, "mass": 0.125} | options
    return bp.snake(4 * anchors - 2, link, axes="alternating", first="pitch", **settings)


def gait(anchors=3, schedule="wave", **options):
    settings = {"drive": "periodic", "spacing": 0.85, "share": 0.35, "lift": 0.03} | options
    return bp.Rectilinear(anchors, schedule=schedule, **settings)


@pytest.fixture(scope="module")
def turned_motion():
    return bp.plan(snake(3), gait(steer=[(1, 0.3)]), bp.Plane(), bp.times(0, 21, dt=0.01)).raise_if_failed()


def test_the_judge_finds_anchors_at_rest_and_rates_exact(turned_motion):
    report = bp.check(turned_motion)
    assert report.ok, report
    assert report["standing anchors"].value < 1e-13


def test_it_goes_straight_in_the_new_direction_at_the_end(turned_motion):
    poses = turned_motion.poses()
    places = np.stack([poses[f"link{i}"][-1, :3] for i in (1, 3, 5, 7, 9)])
    way = places[-1] - places[0]
    assert np.arctan2(way[1], way[0]) == pytest.approx(0.3, abs=1e-11)
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    assert np.ptp(places @ across) < 1e-12
    yaws = [turned_motion.joint(name) for name in turned_motion.joints if name.startswith("yaw")]
    assert max(abs(q[-1]) for q in yaws) < 1e-11
    assert max(np.abs(q).max() for q in yaws) > 0.05  # it did bend on the way


def test_both_feet_of_every_standing_anchor_are_on_the_floor(turned_motion):
    motion = turned_motion
    loaded = motion.contacts > 0.5
    poses = motion.poses()
    for k, contact in enumerate(motion.robot.contacts):
        if not contact.name.startswith("foot") or not loaded[:, k].any():
            continue
        frame = motion.robot.frame_index(contact.frame)
        height = poses.positions[:, frame, 2] + poses.rotations[:, frame, 2] @ np.array(contact.start)
        assert np.abs(height[loaded[:, k]] - 0.003).max() < 1e-12


def test_tail_and_head_links_stay_level(turned_motion):
    rotations = turned_motion.poses().rotations
    for frame in ("base", "link10"):
        assert np.abs(rotations[:, turned_motion.robot.frame_index(frame), 2, 0]).max() < 1e-12


@pytest.mark.parametrize(("anchors", "schedule"), [(3, "wave"), (5, "two-phase")])
@pytest.mark.parametrize("unequal", [False, True])
def test_every_move_reaches_its_stance_with_exact_derivatives(anchors, schedule, unequal):
    rng = np.random.default_rng(3)
    links = rng.uniform(0.08, 0.12, 4 * anchors - 2) if unequal else 0.1
    made = InchingSnake.of(snake(anchors, links), anchors, None)
    bends = Bends(made)
    long = 0.85 * (made.links[0::2] + made.links[1::2])
    start = bends.straight(start_spacings(long, 0.1, schedule), np.array([0.1, 0.2]), 0.4)
    found = turn(bends, start, 0.4 + 0.15, long, 0.1, schedule)
    assert found.status == "ok"
    assert np.abs(found.stances[-1].heading - 0.55).max() < 1e-11
    h = 1e-5
    for before, after, group in zip(found.stances, found.stances[1:], found.groups, strict=False):
        tau = np.array([0.2, 0.45, 0.8])
        here, ahead, behind = (bowed(bends, before, after, group, 0.02, tau + d) for d in (0.0, h, -h))
        assert here.solved.all()
        for values in ("joints", "yaws"):
            a, b, c = (getattr(x, values) for x in (behind, here, ahead))
            assert np.abs((c[0] - a[0]) / (2 * h) - b[1]).max() < 1e-7
            assert np.abs((c[1] - a[1]) / (2 * h) - b[2]).max() < 2e-6
        end = bowed(bends, before, after, group, 0.02, np.ones(1))
        assert np.abs(end.yaws[0, 0] - after.legs[0][:, [1, 3]].ravel()).max() < 1e-12
        assert np.abs(end.joints[1:]).max() < 1e-9  # at rest


def test_a_chain_agrees_with_products_of_rotations():
    rng = np.random.default_rng(1)
    angles, lengths = rng.normal(size=(5, 4)), rng.uniform(0.1, 1.0, 4)
    made = Chain.of("yzyz", lengths, np.zeros((5, 3)), np.repeat(np.eye(3)[None], 5, axis=0), angles)
    for row, q in enumerate(angles):
        at, turned = np.zeros(3), np.eye(3)
        for k, kind in enumerate("yzyz"):
            c, s = np.cos(q[k]), np.sin(q[k])
            # nose-up is a turn by -q about y
            step = [[c, 0, -s], [0, 1, 0], [s, 0, c]] if kind == "y" else [[c, -s, 0], [s, c, 0], [0, 0, 1]]
            turned = turned @ np.array(step)
            at = at + lengths[k] * turned[:, 0]
        assert np.abs(made.ends[row, 3] - at).max() < 1e-14
        assert np.abs(made.turns[row, 3] - turned).max() < 1e-14


def test_a_middle_anchor_turns_by_stride_over_distance_times_the_difference_of_its_neighbours():
    """To first order: d(heading) = stride / (distance of the neighbours) x (head's - tail's heading)."""
    made = InchingSnake.of(snake(3), 3, None)
    bends = Bends(made)
    long, stride = np.array([0.34, 0.34]), 0.12
    found = turn(bends, bends.straight(long, np.zeros(2), 0.0), 1e-4, long, stride, "wave")
    for before, after in zip(found.stances, found.stances[1:], strict=False):
        moved = np.linalg.norm(after.at[0, 1] - before.at[0, 1])
        if moved > 1e-6:
            tail, middle, head = before.heading[0]
            gap = np.linalg.norm(before.at[0, 2] - before.at[0, 0])
            assert after.heading[0, 1] - middle == pytest.approx(stride / gap * (head - tail), rel=2e-3)


def test_several_turns_and_a_turn_by_more_than_pi_take_the_short_way():
    motion = bp.plan(
        snake(3), gait(heading=3.0, steer=[(0, 3.1), (4, -3.1)]), bp.Plane(), bp.times(0, 33, dt=0.05)
    ).raise_if_failed()
    assert motion.facts["turn_angle"] == pytest.approx(2 * np.pi - 6.1, abs=1e-11)


def test_straight_cycles_are_those_of_the_gait_that_does_not_steer():
    straight = bp.plan(snake(3), gait(), bp.Plane(), bp.times(0, 6, dt=0.05))
    steered = bp.plan(snake(3), gait(steer=[(50, 0.1)]), bp.Plane(), bp.times(0, 6, dt=0.05))
    for name in ("q", "qd", "qdd", "base"):
        assert np.abs(getattr(straight, name) - getattr(steered, name)).max() < 1e-9


def test_what_cannot_steer_is_refused():
    with pytest.raises(InputError, match="yaw joint inside every link"):
        bp.plan(bp.snake(6, 0.2, axes="pitch"), gait(steer=[(0, 0.1)]), bp.Plane(), bp.times(0, 5, dt=0.1))
    with pytest.raises(InputError, match="level floor"):
        ground = bp.Profile([(None, 0.0), (3.0, 0.1)])
        bp.plan(snake(3), gait(steer=[(0, 0.1)]), ground, bp.times(0, 5, dt=0.1))
    for bad in ("left", [(1,)], [(1, 0.1), (1, 0.2)], [(-1, 0.1)], [(0, "20 mm")], 3):
        with pytest.raises(InputError, match="steer"):
            gait(steer=bad)
    with pytest.raises(InputError, match="lift must be > 0"):
        gait(steer=[(0, 0.1)], lift=0.0)


def test_a_turn_beyond_the_joint_limits_is_a_status():
    robot = snake(3, limits=(-1.7, 1.7))
    ok = bp.plan(robot, gait(share=0.3, steer=[(0, 0.05)]), bp.Plane(), bp.times(0, 7, dt=0.05))
    assert ok.ok
    tight = snake(3, limits=(-1.2, 1.2))
    failed = bp.plan(tight, gait(share=0.3, steer=[(0, 0.05)]), bp.Plane(), bp.times(0, 7, dt=0.05))
    assert not failed.ok and failed.status[-1] == "limit"
    assert np.isfinite(failed.q).all()
