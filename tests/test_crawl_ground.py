"""Where a crawl puts its feet, how they swing over the ground, and ground that cannot be walked."""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.errors import SolveError
from bodyplan.gaits.crawl.steps import clear_swing, swing_path
from crawl_cases import ROUGH, feet_by_hand, margin_by_hand, normal_under, stances

STAIRS = [(None, 0.0), (0.5, 0.04), (0.8, 0.08), (1.1, 0.04)]


# --- swings ---


@pytest.mark.parametrize(("rise", "early"), [(0.05, 1.0), (0.05, 0.5), (-0.05, 0.5), (0.0, 0.35)])
def test_the_path_of_a_swing(rise, early):
    start, end = np.array([0.1, -0.2, 0.3]), np.array([0.25, 0.0, 0.3 + rise])
    tau, h = np.linspace(0.0, 1.0, 2001), 1e-5
    place, velocity, acceleration = swing_path(start, end, 0.06, early, tau)
    assert np.array_equal(place[0], start) and np.array_equal(place[-1], end)
    assert np.abs(velocity[[0, -1]]).max() == 0.0 and np.abs(acceleration[[0, -1]]).max() == 0.0
    mid = tau[1:-1]
    ahead, behind = (swing_path(start, end, 0.06, early, mid + d) for d in (h, -h))
    assert np.abs((ahead[0] - behind[0]) / (2 * h) - velocity[1:-1]).max() < 1e-7
    assert np.abs((ahead[1] - behind[1]) / (2 * h) - acceleration[1:-1]).max() < 3e-4 / early
    # never back, upright over its line, and lifted by as much as it says
    along = (place - start)[:, :2] @ (end - start)[:2] / 0.25
    assert np.all(np.diff(along) > -1e-15)
    assert np.abs((place - start)[:, :2] @ [0.2, -0.15]).max() < 1e-15
    # either way of telling it gives one path
    back, _, _ = swing_path(end, start, 0.06, early, 1.0 - tau)
    assert rise == 0.0 or np.abs(back - place).max() < 1e-15
    if early == 1.0:
        share = tau**3 * (10 - 15 * tau + 6 * tau**2)
        assert np.abs(place[:, 2] - 0.3 - rise * share - 0.06 * (4 * tau * (1 - tau)) ** 3).max() < 1e-15
    elif rise > 0.0:  # up before it goes along
        up = place[:, 2] >= 0.3 + rise
        assert along[np.flatnonzero(up)[0]] < 0.06


# --- footholds ---


def test_feet_stand_on_treads_off_risers_and_edges():
    ground = bp.Profile(STAIRS)
    gait = bp.Crawl((0.01, 0.0), foothold="search")
    motion = bp.plan(bp.silo4(), gait, ground, bp.times(0, 130, dt=0.2)).raise_if_failed()
    assert bp.check(motion).ok
    feet = feet_by_hand(motion)
    levels = set()
    for leg, rows in stances(motion):
        x, _, z = feet[rows[0], leg]
        levels.add(round(z - 0.01, 9))
        assert min(abs(x - edge) for edge, _ in STAIRS[1:]) >= 0.01 - 1e-9
    assert levels == {0.0, 0.04, 0.08}
    assert feet[-1, :, 0].min() > 0.8 and feet[-1, :, 0].max() > 1.5


def test_nearest_stands_where_it_should_and_says_so_where_it_cannot():
    gait = bp.Crawl((0.01, 0.0))
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 12, dt=0.1))
    stairs = bp.plan(bp.silo4(), gait, bp.Profile(STAIRS), bp.times(0, 60, dt=0.1))
    assert not stairs.ok and stairs.status[-1] == "no_contact"
    first = np.flatnonzero(stairs.status != "ok")[0]
    assert np.array_equal(stairs.q[:first][: len(motion.q)], motion.q[: min(first, len(motion.q))])
    note = next(note for note in stairs.notes if note.startswith("Stops"))
    assert "fl finds no foothold at 16.2 s" in note and 'foothold = "search"' in note
    assert f"Stops at {stairs.t[first]:.4g} s" in note
    # it waits where it is, on all feet
    assert not stairs.qd[first:].any() and stairs.contacts[first:].all()


@pytest.mark.parametrize("steepest", [7.0, 8.0])
def test_a_search_keeps_to_ground_that_is_flat_enough(steepest):
    limit = np.radians(steepest)
    options = {"foothold": "search", "search_radius": 0.15, "max_slope": limit}
    searched, nearest = (
        bp.Crawl((0.01, 0.0), **given).planner(bp.silo4(), bp.Surface(ROUGH)).made(24.0)
        for given in (options, {"max_slope": 1.5})
    )
    assert searched.status == "ok"
    moved = 0
    for step, plain in zip(searched.steps, nearest.steps, strict=True):
        found, nominal = step.after[step.leg], plain.after[step.leg]
        assert np.arccos(normal_under(found)[2]) <= limit + 1e-6
        assert np.linalg.norm(found[:2] - nominal[:2]) <= 0.15 + 0.01
        if np.arccos(normal_under(nominal)[2]) <= limit - 1e-6:
            assert np.array_equal(found, nominal)
        else:
            moved += 1
    assert moved > 0


@pytest.mark.parametrize(
    ("ground", "options"),
    [
        (bp.Profile(STAIRS), {"foothold": "search"}),
        (bp.Profile([(None, 0.0), (0.42, 0.08), (0.45, 0.0)]), {"foothold": "search"}),  # a thin wall
        (bp.Profile([(None, 0.0), (0.4, -0.06), (0.46, 0.0)]), {}),  # a ditch
        (bp.Surface("0.05*sin(9*x)*cos(8*y)"), {}),
        (bp.Surface("0.03*sin(20*x)"), {"foothold": "search", "search_radius": 0.1}),
        (bp.Plane(slope=(0.4, 0.2)), {}),
    ],
)
def test_swings_clear_the_ground_everywhere_on_their_way(ground, options):
    """Densely, between the places at which the planner looks."""
    planner = bp.Crawl((0.012, 0.002), **options).planner(bp.silo4(), ground)
    plan = planner.made(60.0)
    assert plan.status == "ok", plan.reason
    tau = np.linspace(0.0, 1.0, 801)
    for step in plan.steps:
        gap = ground.clearance(step.foot(tau)[0]) - 0.01
        assert gap.min() > -1e-9
        assert gap[400] > 0.005
        assert np.abs(gap[[0, -1]]).max() < 1e-8  # from ground to ground


def test_a_swing_over_what_is_in_the_way_is_the_lowest_tried():
    start, end = np.array([0.0, 0.0, 0.01]), np.array([0.3, 0.0, 0.01])
    wall = bp.Profile([(None, 0.0), (0.14, 0.1), (0.16, 0.0)])
    assert clear_swing(bp.Plane(), start, end, 0.05, 0.01) == (0.05, 1.0)
    lift, early = clear_swing(wall, start, end, 0.05, 0.01)
    assert 0.1 < lift < 0.2 and early == 1.0
    assert clear_swing(bp.Profile([(None, 0.0), (0.14, 10.0), (0.16, 0.0)]), start, end, 0.05, 0.01) is None
    assert clear_swing(bp.Profile(0.0, 0.03), start, end, 0.05, 0.01) is None  # under a ceiling


# --- what cannot be walked ---


def stopped(robot, gait, ground, until=24.0):
    motion = bp.plan(robot, gait, ground, bp.times(0, until, dt=0.1))
    bad = np.flatnonzero(motion.status != "ok")
    assert len(bad) and np.isfinite(motion.q).all() and np.isfinite(motion.qd).all()
    assert bp.check(motion).ok is False
    with pytest.raises(SolveError):
        motion.raise_if_failed()
    return str(motion.status[bad[0]]), float(motion.t[bad[0]]), " ".join(motion.notes[2:])


@pytest.mark.parametrize(
    ("robot", "gait", "ground", "status", "says"),
    [
        (bp.silo4(), bp.Crawl(foothold="search"), bp.Profile([(None, 0.0), (0.5, 2.0)]), "out_of_reach",
         "fr swings at 22.2 s"),
        (bp.silo4(), bp.Crawl(height=0.48), bp.Plane(), "out_of_reach", "stands is out of reach while hl swings"),
        (bp.silo4(), bp.Crawl(reach=0.5), bp.Plane(), "out_of_reach", "out of reach while hl swings"),
        (bp.silo4(), bp.Crawl(), bp.Plane(slope=(0.8, 0.0)), "no_contact", "steeper than 34.4 deg"),
        (bp.silo4(), bp.Crawl(foothold="search"), bp.Surface("2.0*x**4"), "no_contact", "within 0.05 m"),
        (bp.silo4(), bp.Crawl(), bp.Profile(0.0, 0.05), "below_floor", "hl cannot swing over the ground at 1.2 s"),
        (bp.silo4(), bp.Crawl(margin=0.2), bp.Plane(), "tips_over", "no sway gives 0.2 m of margin while hl swings"),
        (bp.silo4(), bp.Crawl((0.1, 0.0)), bp.Plane(), "limit", "shoulder is 2.9.* times as fast as it may be"),
        (bp.silo4(limits=((-0.1, 0.1), (-1, 1.5), (-2.8, 0))), bp.Crawl(), bp.Plane(), "limit",
         "shoulder is beyond its limits"),
        (bp.silo4(), bp.Crawl(step_height=0.5), bp.Plane(), "limit", "hip is beyond its limits"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_a_status_with_time_and_leg(robot, gait, ground, status, says):
    found, _, notes = stopped(robot, gait, ground)
    assert found == status
    assert re.search(says, notes), notes


def test_the_status_begins_with_the_step_that_cannot_be_made():
    status, time, notes = stopped(bp.silo4(), bp.Crawl(foothold="search"), bp.Profile([(None, 0.0), (0.5, 2.0)]))
    assert status == "out_of_reach" and time == pytest.approx(21.0) and "Stops at 21 s" in notes


def test_three_legs_tip():
    turns = (0.0, 2.1, 4.2)
    robot = bp.walker({f"l{k}": (0.15 * np.cos(a), 0.15 * np.sin(a), a) for k, a in enumerate(turns)})
    status, time, notes = stopped(robot, bp.Crawl(), bp.Plane(), 20.0)
    assert status == "tips_over" and time == 0.0
    assert "two feet are no support" in notes
    # who asks for no margin gets the walk, and the judge's word on it
    motion = bp.plan(robot, bp.Crawl(sway=0), bp.Plane(), bp.times(0, 9, dt=0.1))
    assert motion.ok and any("Tips" in note for note in motion.notes)
    line = bp.check(motion)["the centre of mass"]
    assert line.passed is False and "fewer than three points" in line.detail


def test_a_walk_without_sway_says_that_it_tips():
    gait = bp.Crawl((0.01, 0.0), sway=0, sequence=("fl", "hl", "fr", "hr"))
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 12, dt=0.05))
    assert motion.ok and motion.facts["support_margin"] < -0.005
    assert any("Tips" in note and "mm outside" in note for note in motion.notes)
    assert bp.check(motion)["the centre of mass"].passed is False


def test_the_edge_of_a_map_is_no_foothold():
    ground = bp.HeightMap(np.zeros((41, 61)), 0.05, (-1.0, -1.0))  # to x = 2
    for foothold in ("nearest", "search"):
        gait = bp.Crawl((0.01, 0.0), start=(1.3, 0.0), foothold=foothold)
        motion = bp.plan(bp.silo4(), gait, ground, bp.times(0, 60, dt=0.1))
        assert not motion.ok and motion.status[0] == "ok" and motion.status[-1] == "no_contact"
        assert any("finds no foothold" in note and "no ground" in note for note in motion.notes)
        assert feet_by_hand(motion)[..., 0].max() < 2.0
    beyond = bp.plan(bp.silo4(), bp.Crawl(start=(5.0, 0.0)), ground, bp.times(0, 12, dt=0.1))
    assert set(beyond.status) == {"no_contact"}


def test_a_robot_without_mass_walks_on_its_frame():
    contacts = [bp.Contact(f"{leg}.foot", f"{leg}.CT", "sphere", 0.01) for leg in ("fl", "hl", "hr", "fr")]
    table = bp.Robot.from_table("examples/silo4_legs.csv", contacts=contacts)
    plain = ("theta", "d", "a", "epsilon")
    rows = {chain.name: [bp.Row(**{name: getattr(row, name) for name in plain}) for row in chain.elements]
            for chain in table.chains}  # fmt: skip
    balls = [bp.Contact(f"{leg}.foot", f"{leg}.7", "sphere", 0.01) for leg in rows]
    bare = bp.Robot.from_rows(rows, contacts=balls)
    assert bare.mass == 0.0
    motion = bp.plan(bare, bp.Crawl(), bp.Plane(), bp.times(0, 12, dt=0.1)).raise_if_failed()
    assert motion.torques is None and motion.forces is None
    assert any("has no mass" in note for note in motion.notes)
    assert bp.check(motion).ok
    feet = feet_by_hand(motion)
    for feet_now, on, base in zip(feet, motion.contacts > 0.5, motion.base, strict=True):
        assert margin_by_hand(feet_now[on, :2], base[:2]) > 0.0199
    walked = bp.plan(table, bp.Crawl(), bp.Plane(), bp.times(0, 12, dt=0.1)).raise_if_failed()
    assert bp.check(walked).ok and walked.torques is not None


@given(
    st.tuples(st.floats(-0.015, 0.015), st.floats(-0.015, 0.015)), st.floats(-0.03, 0.03), st.floats(-3.0, 3.0),
    st.floats(0.0, 0.05), st.floats(2.0, 9.0), st.sampled_from(["nearest", "search"]),
    st.sampled_from(["level", "follow"]),
)  # fmt: skip
@settings(max_examples=10)
def test_any_walk_either_passes_the_judge_or_says_why(velocity, yaw_rate, heading, height, waves, foothold, body):
    gait = bp.Crawl(velocity, yaw_rate, heading=heading, foothold=foothold, body=body)
    ground = bp.Surface(f"{height}*sin({waves}*x)*cos({waves}*y)")
    motion = bp.plan(bp.silo4(), gait, ground, bp.times(0, 9, dt=0.15))
    report = bp.check(motion)
    assert np.isfinite(motion.q).all()
    assert report.ok == motion.ok, report
    feet = feet_by_hand(motion)
    solved = motion.status != "out_of_reach"
    for leg, rows in stances(motion):
        if solved[rows].all():
            assert np.abs(feet[rows, leg] - feet[rows[0], leg]).max() < 1e-9
    if motion.ok:
        steps = [np.abs(b - a).max() for a, b in pairwise(motion.q)]
        assert max(steps) <= 0.15 * np.pi / 2 + 1e-9  # no joint jumps
