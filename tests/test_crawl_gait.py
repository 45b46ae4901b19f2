"""The crawl: feet at rest, support, exact rates, courses, loads."""

import numpy as np
import pytest

import bodyplan as bp
from crawl_cases import (
    ROUGH,
    center_by_hand,
    feet_by_hand,
    five_legs,
    margin_by_hand,
    normal_under,
    rough_height,
    stances,
    yaw_of,
)


@pytest.fixture(scope="module")
def rough():
    """A minute over +-40 mm, turning, with a body that keeps level."""
    gait = bp.Crawl((0.012, 0.003), 0.01, start=(-0.3, 0.2), heading=0.4)
    return bp.plan(bp.silo4(), gait, bp.Surface(ROUGH), bp.times(0, 60, dt=0.04)).raise_if_failed()


# --- feet, support, judge ---


def test_standing_feet_do_not_move_in_a_minute(rough):
    feet = feet_by_hand(rough)
    spans = list(stances(rough))
    assert len(spans) > 20
    for leg, rows in spans:
        assert np.abs(feet[rows, leg] - feet[rows[0], leg]).max() < 1e-12
        x, y, _ = ground = feet[rows[0], leg] - 0.01 * normal_under(feet[rows[0], leg])
        assert ground[2] == pytest.approx(rough_height(x, y), abs=1e-12)


def test_three_feet_stand_at_any_time_and_the_centre_of_mass_is_over_them(rough):
    feet, center = feet_by_hand(rough), center_by_hand(rough)
    standing = rough.contacts > 0.5
    assert standing.sum(axis=1).min() == 3 and standing.sum(axis=1).max() == 4
    found = np.array([margin_by_hand(f[on, :2], c[:2]) for f, on, c in zip(feet, standing, center, strict=True)])
    assert found.min() >= 0.02 - 1e-4
    swings = found[standing.sum(axis=1) == 3]
    assert swings.min() == pytest.approx(rough.facts["support_margin"], abs=1e-4)


def test_the_judge_agrees(rough):
    report = bp.check(rough)
    assert report.ok, report
    assert report["standing feet at rest"].value < 1e-12
    assert report["the centre of mass"].value >= 0.0199
    assert report["swinging feet clear"].value > 0.04
    assert report["clear of the floor"].value > -1e-9


def test_the_body_keeps_level_and_goes_the_course(rough):
    assert np.abs(rough.base[:, 4:6]).max() < 1e-15
    gait, end = rough.gait, rough.t[-1]
    # unicycle arc: integral of the turned velocity
    s = np.linspace(0.0, end, 20001)
    c, n = np.cos(0.4 + 0.01 * s), np.sin(0.4 + 0.01 * s)
    vx, vy = gait["velocity"]
    way = [np.trapezoid(c * vx - n * vy, s), np.trapezoid(n * vx + c * vy, s)]
    # it sways around it, and is ahead or behind by a step at most
    assert np.linalg.norm(rough.base[-1, :2] - [-0.3, 0.2] - way) < 0.05
    assert yaw_of(rough.base)[-1] == pytest.approx(0.4 + 0.01 * end, abs=0.01 * 3.0)
    height = rough.base[:, 2] - rough_height(*rough.base[:, :2].T)
    assert np.abs(height - 0.385 * 0.54).max() < 0.08


@pytest.mark.parametrize("make", [bp.silo4, bp.hexapod, five_legs, lambda: bp.silo4(passive=True)])
def test_four_five_and_six_legs_and_passive_feet(make):
    robot = make()
    motion = bp.plan(robot, bp.Crawl(), bp.Surface("0.02*sin(6*x)*cos(5*y)"), bp.times(0, 18, dt=0.05))
    report = bp.check(motion.raise_if_failed())
    assert report.ok, report
    assert report["the centre of mass"].value >= 0.0199
    passive = [not used for used in robot.actuated]
    assert not motion.q[:, passive].any()
    feet = feet_by_hand(motion)
    for leg, rows in stances(motion):
        assert np.abs(feet[rows, leg] - feet[rows[0], leg]).max() < 1e-12


def test_real_terrain():
    ground = bp.HeightMap.jacksboro()
    gait = bp.Crawl((0.01, 0.0), 0.005, start=(-0.4, 0.0), foothold="search")
    motion = bp.plan(bp.silo4(), gait, ground, bp.times(0, 24, dt=0.3)).raise_if_failed()
    feet = feet_by_hand(motion)
    for leg, rows in stances(motion):
        assert np.abs(feet[rows, leg] - feet[rows[0], leg]).max() < 1e-12
    report = bp.check(motion)
    assert report.ok, report


def test_a_minute_is_the_beginning_of_two():
    """Nothing is integrated: a longer plan begins with a shorter one."""
    gait, ground = bp.Crawl((0.01, 0.002), 0.01), bp.Surface(ROUGH)
    short, long = (bp.plan(bp.silo4(), gait, ground, bp.times(0, end, dt=0.5)) for end in (12.0, 24.0))
    for name in ("q", "qd", "qdd", "base"):
        assert np.abs(getattr(short, name) - getattr(long, name)[:25]).max() < 1e-12


# --- exact rates ---


@pytest.mark.parametrize(
    ("robot", "gait", "ground"),
    [
        (bp.silo4(), bp.Crawl((0.01, 0.003), 0.03, body="follow", heading=1.0), bp.Surface(ROUGH)),
        (bp.silo4(), bp.Crawl((0.02, 0.0), foothold="search"), bp.Profile([(None, 0.0), (0.45, 0.06)])),
        (bp.silo4(passive=True), bp.Crawl((0.01, 0.0), body="follow"), bp.Plane(slope=(0.2, -0.1))),
        (bp.hexapod(), bp.Crawl((0.0, 0.01)), bp.Surface(ROUGH)),
    ],
)
def test_rates_and_accelerations_are_those_of_the_positions(robot, gait, ground):
    planner, h = gait.planner(robot, ground), 1e-4
    at = np.linspace(0.5, 15.5, 301)
    # not across the beginning or end of a phase, where the third derivative jumps
    phase = at % planner.step_time
    at = at[np.min([phase, np.abs(phase - planner.sway_time), planner.step_time - phase], axis=0) > 2 * h]
    motion = bp.plan(robot, gait, ground, np.stack([at - h, at, at + h], axis=1).ravel()).raise_if_failed()
    before, here, after = (slice(k, None, 3) for k in range(3))
    rate = (motion.q[after] - motion.q[before]) / (2 * h)
    change = (motion.qd[after] - motion.qd[before]) / (2 * h)
    assert np.abs(motion.qd).max() > 0.3
    assert np.abs(rate - motion.qd[here]).max() < 1e-6
    assert np.abs(change - motion.qdd[here]).max() < 1e-5


def test_swings_and_the_body_begin_and_end_at_rest_without_acceleration():
    motion = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0), 0.02, cycle_time=12.0, duty=0.85), bp.Surface(ROUGH),
                     bp.times(0, 24, dt=0.1))  # fmt: skip
    moments = np.concatenate([np.arange(0, 24, 3.0), np.arange(1.2, 24, 3.0)])
    rows = [int(np.abs(motion.t - moment).argmin()) for moment in moments]
    assert np.abs(motion.t[rows] - moments).max() < 1e-9
    assert np.abs(motion.qd[rows]).max() < 1e-9
    assert np.abs(motion.qdd[rows]).max() < 1e-7


# --- courses ---


@pytest.mark.parametrize(
    ("velocity", "yaw_rate"),
    [((0.01, 0.0), 0.0), ((-0.02, 0.0), 0.0), ((0.0, 0.01), 0.0), ((0.01, 0.01), 0.0), ((0.0, 0.0), 0.05),
     ((0.0, 0.0), -0.05), ((0.01, 0.004), 0.03), ((0.0, 0.0), 0.0)],
)  # fmt: skip
def test_a_cycle_on_the_level_closes_from_the_first_on(velocity, yaw_rate):
    robot, gait = bp.silo4(), bp.Crawl(velocity, yaw_rate, start=(1.0, -2.0), heading=2.5)
    period = gait.period(robot)
    t = np.linspace(0.0, 2.0 * period, 241)
    motion = bp.plan(robot, gait, bp.Plane(), t).raise_if_failed()
    assert np.abs(motion.q[120:] - motion.q[:121]).max() < 1e-10
    report = bp.check(motion)
    assert report.ok, report
    assert report["the cycle closes"].value < 1e-9
    # on the course: what the body does in a cycle is the turn by yaw_rate and the arc of the velocity
    turn = yaw_rate * period
    assert np.remainder(
        yaw_of(motion.base)[120:] - yaw_of(motion.base)[:121] - turn + 1, 2 * np.pi
    ) - 1 == pytest.approx(0.0, abs=1e-12)
    s = np.linspace(0.0, period, 20001)
    heading = 2.5 + yaw_rate * s
    vx, vy = velocity
    arc = [np.trapezoid(np.cos(heading) * vx - np.sin(heading) * vy, s),
           np.trapezoid(np.sin(heading) * vx + np.cos(heading) * vy, s)]  # fmt: skip
    c, n = np.cos(turn), np.sin(turn)
    before, after = motion.base[:121, :2] - [1.0, -2.0], motion.base[120:, :2] - [1.0, -2.0]
    turned = np.stack([c * before[:, 0] - n * before[:, 1], n * before[:, 0] + c * before[:, 1]], axis=1)
    assert np.abs(after - turned - arc).max() < 1e-9


def test_the_joints_do_not_know_where_the_floor_is():
    t = bp.times(0, 12, dt=0.1)
    here = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.004), 0.02), bp.Plane(), t)
    there = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.004), 0.02, start=(3.0, -5.0), heading=2.0), bp.Plane(1.5), t)
    for name in ("q", "qd", "qdd"):
        assert np.abs(getattr(here, name) - getattr(there, name)).max() < 1e-9
    away = here.base[:, :2]
    turned = np.stack([np.cos(2.0) * away[:, 0] - np.sin(2.0) * away[:, 1],
                       np.sin(2.0) * away[:, 0] + np.cos(2.0) * away[:, 1]], axis=1)  # fmt: skip
    assert np.abs(there.base[:, :2] - turned - [3.0, -5.0]).max() < 1e-12
    assert np.abs(there.base[:, 2] - here.base[:, 2] - 1.5).max() < 1e-12


def test_a_mirrored_walk_is_the_mirrored_walk():
    mirror = {"fl": "fr", "fr": "fl", "hl": "hr", "hr": "hl"}
    order = ("hl", "fl", "hr", "fr")
    t = bp.times(0, 12, dt=0.1)
    left = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.003), 0.02, sequence=order), bp.Plane(), t)
    right = bp.plan(bp.silo4(), bp.Crawl((0.01, -0.003), -0.02, sequence=[mirror[k] for k in order]), bp.Plane(), t)
    for leg in order:
        for joint, sign in (("shoulder", -1.0), ("hip", 1.0), ("knee", 1.0)):
            off = left.joint(f"{leg}.{joint}") - sign * right.joint(f"{mirror[leg]}.{joint}")
            assert np.abs(off).max() < 1e-10


def test_backward_is_forward_on_a_robot_that_looks_the_other_way():
    """The default order is seen in the direction of travel, crabwise too: a square robot needs the same sway."""
    shares = [
        bp.plan(bp.silo4(), bp.Crawl(v), bp.Plane(), bp.times(0, 12, dt=0.5)).facts["largest_sway_share"]
        for v in ((0.01, 0.0), (-0.01, 0.0), (0.0, 0.01), (0.0, -0.01))
    ]
    assert np.ptp(shares) == 0.0


# --- loads and torques ---


def test_the_feet_carry_the_robot():
    """Forces and moments about the centre of mass balance, and the virtual work of the joints is that of the loads."""
    motion = bp.plan(bp.silo4(), bp.Crawl(), bp.Surface(ROUGH), bp.times(0, 12, dt=0.25))
    feet, center = feet_by_hand(motion), center_by_hand(motion)
    loads = motion.forces[..., 2]
    assert np.abs(loads.sum(axis=1) - 30 * 9.81).max() < 1e-9
    moment = np.einsum("tm,tmc->tc", loads, feet[..., :2] - center[:, None, :2])
    assert np.abs(moment).max() < 1e-9
    assert not loads[motion.contacts < 0.5].any()
    assert loads[motion.contacts > 0.5].min() > 0.0
    assert motion.facts["peak_holding_torque"] == pytest.approx(np.abs(motion.torques).max())
    h = 1e-6
    for k in range(0, len(motion.t), 12):
        for j in range(12):
            up, down = (motion.replace(q=motion.q + s * h * np.eye(12)[j]) for s in (1, -1))
            lift = 30 * 9.81 * (center_by_hand(up)[k, 2] - center_by_hand(down)[k, 2]) / (2 * h)
            push = np.sum(loads[k] * (feet_by_hand(up)[k, :, 2] - feet_by_hand(down)[k, :, 2])) / (2 * h)
            assert motion.torques[k, j] == pytest.approx(lift - push, abs=1e-5)
