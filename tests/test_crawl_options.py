"""Options of the crawl, how they go together, and what is refused."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.gaits.crawl.motion import paces
from bodyplan.missions import load_mission
from crawl_cases import feet_by_hand


def swing_order(motion):
    """Names of the legs in the order in which they lift off."""
    names = [chain.name for chain in motion.robot.chains]
    off = np.diff(motion.contacts[:, : len(names)], axis=0)
    return [names[leg] for _, leg in sorted(zip(*np.nonzero(off < 0), strict=True))]


def test_the_sequence_is_kept():
    t = bp.times(0, 12, dt=0.1)
    assert swing_order(bp.plan(bp.silo4(), bp.Crawl(), bp.Plane(), t)) == ["hl", "fl", "hr", "fr"]
    assert swing_order(bp.plan(bp.silo4(), bp.Crawl((-0.01, 0)), bp.Plane(), t)) == ["fr", "hr", "fl", "hl"]
    given = ["fr", "hl", "fl", "hr"]
    assert swing_order(bp.plan(bp.silo4(), bp.Crawl(sequence=given), bp.Plane(), t)) == given
    six = bp.plan(bp.hexapod(), bp.Crawl(), bp.Plane(), bp.times(0, 18, dt=0.1))
    assert swing_order(six) == ["l3", "l2", "l1", "r3", "r2", "r1"]


def test_duty_and_cycle_time_are_kept():
    gait = bp.Crawl((0.005, 0.0), cycle_time=16.0, duty=0.8)
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 32, dt=0.01))
    assert motion.contacts[1:].mean(axis=0) == pytest.approx(0.8, abs=2e-3)
    assert motion.facts["cycle_time"] == pytest.approx(16.0) and gait.period(bp.silo4()) == pytest.approx(16.0)
    assert motion.facts["swing_time"] == pytest.approx(3.2) and motion.facts["sway_time"] == pytest.approx(0.8)
    assert motion.facts["advance_per_cycle"] == pytest.approx(0.08)


def test_numeric_sway_is_the_share_of_the_way_to_the_centroid():
    gait = bp.Crawl((0.01, 0.0), sway=0.3, cycle_time=12.0, duty=0.85)
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 24, dt=0.1))
    feet = feet_by_hand(motion)
    for n in range(1, 8):
        row = round((3.0 * n + 2.0) / 0.1)  # in the middle of a swing
        on = motion.contacts[row] > 0.5
        at = np.array([0.01 * 3.0 * n, 0.0])
        assert motion.base[row, :2] == pytest.approx(at + 0.3 * (feet[row, on, :2].mean(axis=0) - at), abs=1e-12)


def test_stability_takes_more_sway_for_more_margin():
    found = {
        stability: bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0), stability=stability), bp.Plane(), bp.times(0, 12, dt=0.1))
        for stability in ("margin", "barrier", "most")
    }
    margins = [motion.facts["support_margin"] for motion in found.values()]
    assert 0.02 <= margins[0] < margins[1] < margins[2]
    shares = [motion.facts["largest_sway_share"] for motion in found.values()]
    assert shares[0] < shares[1] <= shares[2]
    # nothing gives more than "most", and "margin" is the least of what gives enough
    for share in (0.2, 0.6, 1.0):
        other = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0), sway=share), bp.Plane(), bp.times(0, 12, dt=0.1))
        assert other.facts["support_margin"] <= margins[2] + 1e-12
    less = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0), sway=shares[0] - 0.025), bp.Plane(), bp.times(0, 12, dt=0.1))
    assert less.facts["support_margin"] < 0.02


@pytest.mark.parametrize("asked", [-0.02, 0.0, 0.01, 0.05, 0.1])
def test_the_margin_is_what_is_asked_for(asked):
    motion = bp.plan(bp.silo4(), bp.Crawl(margin=asked), bp.Plane(), bp.times(0, 12, dt=0.1)).raise_if_failed()
    assert motion.facts["support_margin"] >= asked
    line = bp.check(motion)["the centre of mass"]
    assert line.passed and line.limit == pytest.approx(asked, abs=2e-4)


@pytest.mark.parametrize("slope", [(0.3, 0.0), (-0.1, 0.25)])
def test_a_body_that_follows_lies_along_the_slope(slope):
    t = bp.times(0, 12, dt=0.1)
    normal = np.array([-slope[0], -slope[1], 1.0]) / np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2)
    for body, wanted in (("follow", normal), ("level", np.array([0.0, 0.0, 1.0]))):
        gait = bp.Crawl((0.01, 0.0), 0.02, heading=0.7, body=body)
        motion = bp.plan(bp.silo4(), gait, bp.Plane(slope=slope), t).raise_if_failed()
        up = bp.spatial.rotate(motion.base[:, 3:], np.array([0.0, 0.0, 1.0]))
        # the plane of the feet is that of their balls' lowest points
        assert np.abs(up - wanted).max() < 2e-3
        ahead = bp.spatial.rotate(motion.base[:, 3:], np.array([1.0, 0.0, 0.0]))
        assert np.arctan2(ahead[0, 1], ahead[0, 0]) == pytest.approx(0.7, abs=0.02 * 3.0)
        assert bp.check(motion).ok


def test_joints_have_time_for_what_they_have_to_do():
    """The default duty leaves swings more time where a joint would be too fast; no more where none has a limit."""
    ground, t = bp.Surface("0.02*sin(6*x)*cos(5*y)"), bp.times(0, 12, dt=0.02)
    motion = bp.plan(bp.silo4(), bp.Crawl((0.03, 0.0)), ground, t).raise_if_failed()
    assert bp.check(motion).ok
    swinging = 4 * motion.facts["swing_time"] / motion.facts["cycle_time"]
    assert 0.6 < swinging < 0.85
    free = bp.plan(bp.silo4(rate=None), bp.Crawl((0.03, 0.0)), ground, t)
    assert 4 * free.facts["swing_time"] == pytest.approx(0.6 * free.facts["cycle_time"])
    assert free.facts["peak_joint_rate"] > np.pi / 2
    slow = bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0)), ground, t)
    assert 4 * slow.facts["swing_time"] == pytest.approx(0.6 * slow.facts["cycle_time"])


def test_paces_are_the_largest_shares_of_the_rates():
    robot, gait = bp.silo4(), bp.Crawl((0.01, 0.0), cycle_time=12.0, duty=0.85)
    planner = gait.planner(robot, bp.Plane())
    swing, sway = paces(planner, planner.made(23.9))
    motion = bp.plan(robot, gait, bp.Plane(), bp.times(0, 24, dt=0.01))
    share = np.abs(motion.qd[1200:]).max(axis=1) / (np.pi / 2)
    swinging = motion.contacts[1200:].min(axis=1) < 0.5
    assert swing == pytest.approx(share[swinging].max(), rel=0.02)
    assert sway == pytest.approx(share[~swinging].max(), rel=0.02)


@pytest.mark.parametrize("size", [0.1, 3.0])
def test_options_left_out_go_with_the_size_of_the_robot(size):
    """A robot of another size walks in the same way: same joints at the same times."""
    plain, scaled = bp.silo4(), bp.silo4(body=0.31 * size, links=(0.06 * size, 0.24 * size, 0.24 * size),
                                         foot_radius=0.01 * size)  # fmt: skip
    t = bp.times(0, 12, dt=0.1)
    one = bp.plan(plain, bp.Crawl((0.01, 0.0)), bp.Plane(), t)
    other = bp.plan(scaled, bp.Crawl((0.01 * size, 0.0)), bp.Plane(), t).raise_if_failed()
    assert np.abs(one.q - other.q).max() < 1e-9
    assert np.abs(other.base[:, :3] - size * one.base[:, :3]).max() < 1e-9 * size
    assert other.facts["lift"] == pytest.approx(0.05 * size) and one.facts["lift"] == pytest.approx(0.05)


# --- sampling, bounds, bad input ---


@pytest.mark.parametrize("times", [
    np.linspace(0.0, 24.0, 49), np.linspace(5.0, 20.0, 301), np.sort(np.random.default_rng(1).uniform(0, 20, 200)),
    np.array([0.0, 30.0]),
])  # fmt: skip
def test_any_sampling_passes_the_judge(times):
    motion = bp.plan(bp.silo4(), bp.Crawl((0.03, 0.0)), bp.Surface("0.02*sin(6*x)*cos(5*y)"), times)
    report = bp.check(motion)
    assert report.ok, report


def test_too_many_steps_are_refused():
    for gait in (bp.Crawl((1e6, 0.0)), bp.Crawl(cycle_time=1e-6)):
        with pytest.raises(InputError, match=r"steps of .* more than the"):
            bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 12, dt=0.1))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"velocity": "fast"}, "velocity"),
        ({"velocity": 1.0}, r"velocity.*\(ahead, left\)"),
        ({"velocity": (0.1, 0.0, 0.1)}, "velocity.*0 if there is a third"),
        ({"velocity": (np.nan, 0.0)}, "velocity.*finite"),
        ({"yaw_rate": "left"}, "yaw_rate"),
        ({"step_height": 0.0}, "step_height.*> 0"),
        ({"cycle_time": -1.0}, "cycle_time"),
        ({"duty": 1.0}, "duty"),
        ({"duty": 0.75}, r"duty: 4 legs .* more than 0.75, got 0.75"),
        ({"sequence": "fl"}, "sequence"),
        ({"sequence": 5}, "sequence"),
        ({"sequence": [1, 2, 3, 4]}, "sequence"),
        ({"sequence": ["fl", "fr"]}, "sequence must name every leg once"),
        ({"sequence": ["fl", "fl", "hl", "hr"]}, "sequence must name every leg once"),
        ({"sequence": ["a", "fr", "hl", "hr"]}, "unknown leg 'a'.*fl, fr, hl, hr"),
        ({"sway": 2.0}, "sway"),
        ({"sway": "some"}, "unknown sway 'some'.*auto"),
        ({"sway": True}, "sway"),
        ({"stability": "best"}, "unknown stability.*barrier, margin, most"),
        ({"stability": ["most"]}, "unknown stability"),
        ({"margin": np.inf}, "margin"),
        ({"foothold": "any"}, "unknown foothold.*nearest, search"),
        ({"search_radius": 0.0}, "search_radius"),
        ({"max_slope": 2.0}, "max_slope"),
        ({"height": 0.0}, "height"),
        ({"reach": "far"}, "reach"),
        ({"reach": -0.3}, "reach: leg .* must stay on its side.*got -0.3"),
        ({"body": "up"}, "unknown body.*follow, level"),
        ({"start": (1.0,)}, "start"),
        ({"heading": None}, "heading"),
    ],
)
def test_refusals(options, says):
    with pytest.raises(InputError, match=says):
        bp.plan(bp.silo4(), bp.Crawl(**options), bp.Plane(), bp.times(0, 5, dt=0.5))


def test_times_before_the_beginning_and_legs_in_the_middle_are_refused():
    with pytest.raises(InputError, match="starts at t = 0"):
        bp.plan(bp.silo4(), bp.Crawl(), bp.Plane(), bp.times(-1, 5, dt=0.5))
    mounts = {"a": (0.1, 0.1, 0.7), "b": (-0.1, 0.1, 2.4), "c": (-0.1, -0.1, -2.4), "d": (0.0, 0.0, -0.7)}
    with pytest.raises(InputError, match="leg 'd' begins in the middle"):
        bp.plan(bp.walker(mounts), bp.Crawl(), bp.Plane(), bp.times(0, 5, dt=0.5))


def test_the_options_come_back():
    gait = bp.Crawl((0.01, 0.002, 0.0), 0.1, duty=0.9, sequence=["hl", "fl", "hr", "fr"], sway=0.5, body="follow")
    data = gait.to_dict()
    assert bp.Crawl(**{k: v for k, v in data.items() if k != "kind"}) == gait
    assert data["kind"] == "crawl" and gait != bp.Crawl()
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 5, dt=0.5))
    assert motion.gait == data


def test_a_mission_names_it_with_units(tmp_path):
    file = tmp_path / "walk.toml"
    file.write_text(
        "\n".join(
            [
                'title = "A walk"', "[robot]", 'kind = "silo4"',
                "[gait]", 'kind = "crawl"', 'velocity = ["10 mm/s", 0]',
                'yaw_rate = "1 deg/s"', 'step_height = "4 cm"', 'margin = "15 mm"', 'cycle_time = "12 s"',
                'max_slope = "30 deg"', 'search_radius = "60 mm"', 'height = "20 cm"', 'reach = "180 mm"',
                'heading = "90 deg"', 'start = ["10 cm", 0.2]', "duty = 0.85", 'sequence = ["hl", "fl", "hr", "fr"]',
                "[ground]", 'kind = "plane"', "[time]", 'stop = "12 s"', 'dt = "100 ms"',
            ]
        )
    )  # fmt: skip
    assert load_mission(file).gait == bp.Crawl(
        (0.01, 0.0), np.radians(1.0), step_height=0.04, margin=0.015, cycle_time=12.0, max_slope=np.radians(30.0),
        search_radius=0.06, height=0.2, reach=0.18, heading=np.radians(90.0), start=(0.1, 0.2), duty=0.85,
        sequence=["hl", "fl", "hr", "fr"],
    )  # fmt: skip
