"""Options of inching: cycles, headings, joints, ceilings, margins; what cannot be made is a status, misuse refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import pose, under_ceilings
from rectilinear_cases import FEET, THIN, TIPS, failures, paper_snake, planned, snake, unit_ends


def test_cycles_then_it_stands() -> None:
    robot = snake()
    endless, twice = bp.Rectilinear(dwell=0.1), bp.Rectilinear(dwell=0.1, cycles=2)
    period = endless.period(robot)
    assert period == pytest.approx(3.3) and twice.period(robot) is None
    t = np.linspace(0.0, 3.0 * period, 100)
    free, bound = bp.plan(robot, endless, bp.Plane(), t), bp.plan(robot, twice, bp.Plane(), t)
    going = t <= 2.0 * period
    np.testing.assert_allclose(bound.q[going], free.q[going], atol=1e-12)
    np.testing.assert_allclose(bound.base[going], free.base[going], atol=1e-12)
    assert np.ptp(bound.base[~going], axis=0).max() == 0.0 and np.all(bound.qd[~going] == 0.0)
    assert bound.facts["advance"] == pytest.approx(2.0 * free.facts["advance_per_cycle"])
    assert bound.base[-1, 0] == pytest.approx(bound.facts["advance"]) and failures(bound) <= {TIPS}


def test_dwell_is_rest() -> None:
    motion = planned(snake(), bp.Rectilinear(dwell=0.5), samples=451)
    inside = np.zeros(len(motion.t), dtype=bool)
    for _, start, end in motion.stages:
        inside |= (motion.t > start + 1e-9) & (motion.t < end - 1e-9)
    assert (~inside).sum() > 100 and np.all(motion.qd[~inside] == 0.0) and np.all(motion.qdd[~inside] == 0.0)


@pytest.mark.parametrize("heading", [0.3, -2.5, np.pi, 7.0])
def test_any_heading_is_the_same_gait_turned(heading: float) -> None:
    straight = planned(snake(), bp.Rectilinear())
    turned = planned(snake(), bp.Rectilinear(heading=heading, start=(1.0, -2.0)))
    np.testing.assert_array_equal(turned.q, straight.q)
    along = np.array([np.cos(heading), np.sin(heading)])
    np.testing.assert_allclose(turned.base[:, :2], [1.0, -2.0] + straight.base[:, :1] * along, atol=1e-12)
    np.testing.assert_array_equal(turned.base[:, 2], straight.base[:, 2])
    np.testing.assert_allclose(turned.torques, straight.torques, atol=1e-12)
    assert failures(turned) == failures(straight)


def test_chosen_joints_and_those_that_are_left() -> None:
    robot = bp.snake(9, 0.1, axes="pitch", radius=0.01)
    used = ("pitch1", "pitch2", "pitch4", "pitch7", "pitch8")
    motion = planned(robot, bp.Rectilinear(joints=used))
    moving = {name for name, column in zip(robot.joints, motion.q.T, strict=True) if np.abs(column).max() > 0.0}
    assert moving == set(used) and failures(motion) <= {TIPS}
    spread = planned(robot, bp.Rectilinear())
    moving = {name for name, column in zip(robot.joints, spread.q.T, strict=True) if np.abs(column).max() > 0.0}
    assert {"pitch1", "pitch8"} < moving and len(moving) == 5


def test_grounds_that_are_level() -> None:
    robot, gait = snake(), bp.Rectilinear()
    floor = planned(robot, gait)
    for ground, lift in ((bp.Plane(height=0.4), 0.4), (bp.Profile(-0.2), -0.2), (bp.Profile(0.3, 1.0), 0.3),
                         (bp.Corridor(width=0.5), 0.0)):  # fmt: skip
        other = planned(robot, gait, ground)
        np.testing.assert_allclose(other.q, floor.q, atol=1e-12)
        np.testing.assert_allclose(other.base[:, 2], floor.base[:, 2] + lift, atol=1e-12)
        assert failures(other) <= {TIPS}


@pytest.mark.parametrize("radius", [0.003, 0.02])
def test_a_ceiling_of_the_ground_counts_with_the_body_s_radius(radius: float) -> None:
    robot = snake(5, radius=radius)
    gait = {"anchors": 5, "schedule": "two-phase"}
    given = planned(robot, bp.Rectilinear(ceiling=0.13, **gait))
    ground = bp.Profile(0.0, 0.13 + 2.0 * radius)
    found = planned(robot, bp.Rectilinear(**gait), ground)
    assert found.facts["advance_per_cycle"] == pytest.approx(given.facts["advance_per_cycle"], rel=1e-9)
    np.testing.assert_allclose(found.q, given.q, atol=1e-9)
    report = bp.check(found)
    assert not {line.what for line in report.failures}
    top = unit_ends(found, np.full(18, 0.1))[..., 2].max() + radius
    assert 0.13 + 2.0 * radius - 1e-4 < top <= 0.13 + 2.0 * radius + 1e-12
    # the smaller of both holds
    both = planned(robot, bp.Rectilinear(ceiling=0.2, **gait), ground)
    np.testing.assert_array_equal(both.q, found.q)


@pytest.mark.parametrize("options", [
    {}, {"drive": "periodic"}, {"drive": "paper"}, {"drive": [0.1, 0.2, 0.1]}, {"spacing": 0.5},
    {"spacing": (0.3, 0.9)}, {"drive": "periodic", "spacing": 0.97, "lift": 0.1}, {"lift": 0.3},
])  # fmt: skip
@pytest.mark.parametrize("room", [0.001, 0.02, 0.08, 0.095])
def test_too_low_a_ceiling_is_a_status_not_a_traceback(options: dict[str, Any], room: float) -> None:
    for ground, given in ((bp.Profile(0.0, room + 0.01), {}), (bp.Plane(), {"ceiling": room})):
        motion = planned(snake(), bp.Rectilinear(**options, **given), ground, samples=61)
        for values in (motion.q, motion.qd, motion.qdd, motion.base, motion.residual, motion.torques):
            assert np.isfinite(values).all()
        if np.all(motion.status == "ok"):
            assert room >= 0.08 and failures(motion) <= {TIPS}, "where it goes it touches nothing"
        else:
            assert set(motion.status) <= {"above_ceiling", "out_of_reach", "collapsed", "links_crossing"}
            assert motion.status[0] != "ok" and any("Stops at 0 s" in note for note in motion.notes)
            assert np.all(motion.qd == 0.0), "it stands"


@pytest.mark.parametrize("options", [
    {"lift": 3.0}, {"drive": [5.0, 5.0, 5.0]}, {"drive": [0.3, 0.1, 0.1], "spacing": 0.6}, {"margin": 0.01},
])  # fmt: skip
def test_what_cannot_be_made_is_a_status(options: dict[str, Any]) -> None:
    motion = planned(snake(), bp.Rectilinear(**options))
    assert set(motion.status) <= {"out_of_reach", "collapsed", "tips_over", "links_crossing"}
    assert np.isfinite(motion.q).all() and np.all(motion.qd == 0.0)
    assert any("Stops" in note for note in motion.notes)
    limited = planned(snake(limits=(-0.01, 0.01)), bp.Rectilinear())
    assert set(limited.status) == {"limit"} and np.isfinite(limited.q).all()


def test_unequal_links_fold_no_farther_than_they_can() -> None:
    """Links of 0.2 and 0.08 m: a leg shorter than 0.12 m has no elbow at all."""
    robot = bp.snake(6, [0.1, 0.2, 0.08, 0.15, 0.12, 0.05], axes="pitch", radius=0.002)
    for drive, status in (
        ([0.15, 0.05, 0.05], "ok"),
        ([0.17, 0.05, 0.05], "collapsed"),
        ([0.2, 0.1, 0.1], "collapsed"),
    ):
        motion = bp.plan(robot, bp.Rectilinear(drive=drive, cycles=1), bp.Plane(), np.linspace(0, 3, 61))
        assert set(motion.status) == {status} and np.isfinite(motion.q).all()
        assert "links clear of each other" not in failures(motion) or status != "ok"


# --- support ---


def test_margins_of_three_and_of_five() -> None:
    """Three moved one by one have none; five in two phases have 2300 mm with legs of 3200 and 2000 mm."""
    links = [1e-6, *[2.0] * 8, 1e-6]
    five = bp.snake(10, links, axes="pitch", radius=1e-4)
    gait = bp.Rectilinear(5, drive=[1.2] * 5, spacing=0.8, schedule="two-phase", lift=0.2)
    motion = planned(five, gait)
    assert motion.facts["support_margin"] == pytest.approx(2.3, abs=5e-4) and not failures(motion)
    three = bp.snake(6, [1e-6, *[2.0] * 4, 1e-6], axes="pitch", radius=1e-4)
    tips = bp.Rectilinear(drive="paper", spacing=(0.7, 0.3), lift=0.15, cycles=1)
    motion = bp.plan(three, tips, bp.Plane(), np.array([0.0, 1e-3, 2e-3]))
    assert motion.facts["support_margin"] == pytest.approx(-0.4, abs=1e-4)
    assert failures(motion) == {TIPS}
    assert any("never have a positive support margin" in note for note in motion.notes)
    assert any("Tips" in note and "400" in note for note in motion.notes)
    rng = np.random.default_rng(1)
    for _ in range(2):
        spacing = tuple(rng.uniform(0.5, 1.0, 2))
        found = planned(three, bp.Rectilinear(spacing=spacing, lift=0.1))
        assert found.facts["support_margin"] < 1e-9


def test_a_margin_that_is_asked_for_is_kept() -> None:
    free = planned(snake(5), bp.Rectilinear(5, schedule="two-phase", spacing=0.9, margin=-9.0))
    wanted = free.facts["support_margin"] + 0.05
    kept = planned(snake(5), bp.Rectilinear(5, schedule="two-phase", spacing=0.9, margin=wanted), samples=2001)
    assert kept.facts["support_margin"] == pytest.approx(wanted, abs=1e-4)
    assert kept.facts["support_margin"] >= wanted - 1e-9
    assert kept.facts["advance_per_cycle"] < free.facts["advance_per_cycle"]


def test_contacts_and_forces_are_those_of_the_standing_anchors() -> None:
    motion = planned(bp.snake(10, 0.1, **FEET), bp.Rectilinear())
    names = [c.name for c in motion.robot.contacts]
    feet = [[names.index(f"foot{i}.{side}") for side in ("left", "right")] for i in (1, 5, 9)]
    weight = motion.robot.mass * 9.81
    np.testing.assert_allclose(motion.forces[..., 2].sum(axis=1), weight, rtol=1e-12)
    assert np.all(motion.forces[..., :2] == 0.0)
    for k, (_, start, end) in enumerate(motion.stages):
        inside = (motion.t > start + 1e-9) & (motion.t < end - 1e-9)
        assert np.all(motion.contacts[inside][:, feet[k]] == 0.0)
        standing = [c for other in range(3) if other != k for c in feet[other]]
        assert np.all(motion.contacts[inside][:, standing] == 1.0)
    others = [k for k in range(len(names)) if k not in np.ravel(feet)]
    assert np.all(motion.contacts[:, others] == 0.0) and np.all(motion.forces[:, others] == 0.0)


# --- under ceilings ---


def test_table_of_speeds_under_ceilings() -> None:
    robot = paper_snake()
    rows = under_ceilings(robot, bp.Rectilinear(lift=0, move_time=1.0), [1.0, 1.2, 1.9])
    strides = [row.stride["fastest"] for row in rows]
    np.testing.assert_allclose(strides[:2], [0.53590, 0.8], atol=5e-6)
    for row in rows:
        assert row.speed["fastest"] == pytest.approx(row.stride["fastest"] / 3.0)
        assert row.stride["periodic"] == pytest.approx(min(row.stride["fastest"], 2.4))
        # the rule's 60 % of a straight leg needs 1833 mm
        assert row.stride["paper"] == (None if row.ceiling < 1.83303 else pytest.approx(2.4))
    for bad in ([0.0], [-1.0], [np.nan], [1.0] * 201):
        with pytest.raises(bp.InputError, match="ceilings"):
            under_ceilings(robot, bp.Rectilinear(), bad)


# --- refusals ---

ROBOTS: dict[str, tuple[Any, Any, str]] = {
    "too few joints": (lambda: bp.snake(8, 0.1, **THIN), {}, "3 anchors need 5 pitch joints, 'snake' has 4"),
    "seven anchors": (snake, {"anchors": 7}, "7 anchors need 13 pitch joints, 'snake' has 5"),
    "yaw only": (lambda: bp.snake(12, 0.1), {}, "need 5 pitch joints, 'snake' has 0"),
    "arcs": (lambda: bp.snake(8, 0.1, "arc", axes="universal"), {}, "rigid links"),
    "doubles": (lambda: bp.snake(8, 0.1, "double", axes="universal"), {}, "rigid links"),
    "unknown joints": (snake, {"joints": ["a", "b", "c", "d", "e"]}, "unknown pitch joint 'a'"),
    "a yaw joint": (snake, {"joints": ["pitch1", "yaw2", "pitch3", "pitch5", "pitch7"]}, "unknown pitch joint 'yaw2'"),
    "order": (snake, {"joints": ["pitch3", "pitch1", "pitch5", "pitch7", "pitch9"]}, "from tail to head"),
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_that_are_refused(name: str) -> None:
    make, options, message = ROBOTS[name]
    with pytest.raises(bp.InputError, match=message):
        bp.plan(make(), bp.Rectilinear(**options), bp.Plane(), np.arange(3.0))


@pytest.mark.parametrize(("ground", "options", "message"), [
    (bp.Plane(slope=(0.1, 0.0)), {}, "level floor or steps"), (bp.Surface("0.01*x"), {}, "level floor or steps"),
    (bp.Surface("0*x"), {}, "level floor or steps"),
    (bp.Profile([(None, 0.0), (2.0, 0.05)]), {"heading": 0.1}, "heading must be 0"),
    (bp.Profile([(None, 0.0), (2.0, 0.05)]), {"heading": np.pi}, "heading must be 0"),
])  # fmt: skip
def test_grounds_that_are_refused(ground: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(bp.InputError, match=message):
        bp.plan(snake(), bp.Rectilinear(**options), ground, np.arange(3.0))


def test_no_time_before_the_beginning() -> None:
    with pytest.raises(bp.InputError, match="starts at t = 0"):
        bp.plan(snake(), bp.Rectilinear(), bp.Plane(), [-1.0, 0.0, 1.0])


@pytest.mark.parametrize(("options", "message"), [
    ({"anchors": 2}, "anchors"), ({"anchors": 3.5}, "anchors"), ({"anchors": 102}, "anchors"),
    ({"anchors": True}, "anchors"), ({"drive": [1.0, 2.0]}, "drive"), ({"drive": [1.0, 2.0, -1.0]}, "drive"),
    ({"drive": "fast"}, "fastest, paper, periodic"), ({"schedule": "gallop"}, "two-phase, wave"),
    ({"anchors": 4, "schedule": "two-phase"}, "anchors: must be odd"),
    ({"anchors": 5, "schedule": "two-phase", "drive": "paper"}, "one after another"),
    ({"spacing": 0.0}, "spacing"), ({"spacing": 1.1}, "spacing"), ({"spacing": (1, 1, 1)}, "spacing"),
    ({"spacing": "wide"}, "spacing"), ({"share": 0.0}, "share"), ({"share": 1.0}, "share"), ({"lift": -0.1}, "lift"),
    ({"path": "square"}, "cycloid"), ({"ceiling": 0.0}, "ceiling"), ({"clearance": -1.0}, "clearance"),
    ({"move_time": 0.0}, "move_time"), ({"dwell": -1.0}, "dwell"), ({"cycles": 0}, "cycles"),
    ({"heading": np.nan}, "heading"), ({"start": (1, 2, 3)}, "start"), ({"joints": "pitch1"}, "joints"),
    ({"joints": ["pitch1"]}, "joints: 3 anchors use 5"),
    ({"margin": "wide"}, "margin"),
])  # fmt: skip
def test_options_that_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(bp.InputError, match=message):
        bp.Rectilinear(**options)


def test_options_come_back() -> None:
    gait = bp.Rectilinear(5, drive=[0.1] * 5, spacing=0.9, lift=0.02, ceiling=0.3, heading=0.4, cycles=3, dwell=0.1)
    again = bp.Rectilinear(**{k: v for k, v in gait.to_dict().items() if k != "kind"})
    assert again.to_dict() == gait.to_dict()
    motion = bp.plan(snake(5), gait, bp.Plane(), np.arange(4.0))
    assert motion.gait == gait.to_dict()


def test_a_pose_of_the_motion_is_a_pose() -> None:
    """The gait's joints at any time are the inverse kinematics of its anchors."""
    motion = planned(snake(), bp.Rectilinear(), samples=31)
    at = unit_ends(motion, np.full(10, 0.1))
    found = pose(at[:, [1, 5, 9]][..., [0, 2]], 0.2)
    mine = [motion.robot.joints.index(f"pitch{i}") for i in (1, 3, 5, 7, 9)]
    np.testing.assert_allclose(found.all_joints, -motion.q[:, mine], atol=2e-7)
