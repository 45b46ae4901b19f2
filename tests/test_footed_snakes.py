"""Snakes with feet on their pitch joints: order of axes, parts, masses, neighbours, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.missions import parse_mission
from bodyplan.motion import Motion
from bodyplan.robot.neighbours import separate_contacts

MISSION = """title = "t"
[robot]
kind = "snake"
links = 5
link_length = "100 mm"
axes = "alternating"
first = "pitch"
foot_radius = "30 mm"
foot_spread = "6 cm"
[gait]
kind = "concertina"
body_modules = 2
[ground]
kind = "plane"
"""


def footed(links: int = 6, **options: Any) -> bp.Robot:
    options = {"axes": "alternating", "first": "pitch", "foot_radius": 0.03, "foot_spread": 0.06} | options
    return bp.snake(links, 0.1, **options)


def still(robot: bp.Robot, q: Any) -> Motion:
    size = 60
    shape = np.tile(np.asarray(q, dtype=float), (size, 1))
    base = np.tile([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], (size, 1))
    zero = np.zeros_like(shape)
    t = np.linspace(0.0, 1.0, size)
    return Motion(robot, bp.Plane(), {}, t, base, shape, zero, zero, np.zeros(size), np.full(size, "ok"))


@pytest.mark.parametrize("joint", ["straight", "arc", "double"])
def test_alternating_axes_may_begin_with_either(joint: str) -> None:
    by_yaw = bp.snake(6, 0.1, joint, axes="alternating")
    by_pitch = bp.snake(6, 0.1, joint, axes="alternating", first="pitch")
    assert bp.snake(6, 0.1, joint, axes="alternating", first="yaw") == by_yaw
    assert by_yaw.joints[:5] == ("yaw1", "pitch2", "yaw3", "pitch4", "yaw5")
    assert by_pitch.joints[:5] == ("pitch1", "yaw2", "pitch3", "yaw4", "pitch5")


@pytest.mark.parametrize(("axes", "first", "places"), [
    ("alternating", "pitch", [1, 3, 5]), ("alternating", "yaw", [2, 4]),
    ("pitch", "yaw", [1, 2, 3, 4, 5]), ("universal", "yaw", [1, 2, 3, 4, 5]),
])  # fmt: skip
def test_feet_stand_on_the_axis_of_every_pitch_joint(axes: str, first: str, places: list[int]) -> None:
    robot = footed(axes=axes, first=first)
    feet = [c for c in robot.contacts if c.shape == "sphere"]
    assert [c.name for c in feet] == [f"foot{i}.{side}" for i in places for side in ("left", "right")]
    poses = robot.forward(np.zeros(robot.n))
    for contact in feet:
        i, side = contact.name.removeprefix("foot").split(".")
        sign = 1.0 if side == "left" else -1.0
        assert contact.frame == f"link{i}" and contact.radius == 0.03
        at = poses[contact.frame][:3] + contact.start
        np.testing.assert_allclose(at, [0.1 * int(i), 0.06 * sign, 0.0], atol=1e-15)
        # the axis of the joint goes through them: turning it moves only what is ahead
        turned = robot.forward({name: 0.7 * (name == f"pitch{i}") for name in robot.joints})
        np.testing.assert_array_equal(turned[contact.frame], poses[contact.frame])
        assert abs(turned[f"link{int(i) + 1}"][2]) > 0.05
    # the links are what they were
    assert [c.name for c in robot.contacts if c.shape == "capsule"] == [f"link{i}" for i in range(1, 7)]


def test_without_spread_there_is_one_foot_a_joint() -> None:
    robot = footed(foot_spread=0.0, friction=0.8)
    feet = {c.name: c for c in robot.contacts if c.shape == "sphere"}
    assert list(feet) == ["foot1", "foot3", "foot5"]
    assert feet["foot3"].start == (0.0, 0.0, 0.0) and feet["foot3"].friction == 0.8


def test_the_body_is_half_as_thick_as_its_feet_and_feet_weigh_nothing() -> None:
    robot = footed()
    assert {c.radius for c in robot.contacts if c.shape == "capsule"} == {0.015}
    bare = bp.snake(6, 0.1, axes="alternating", first="pitch", radius=0.015)
    assert robot.mass == bare.mass and bare.mass == pytest.approx(6 * 1000 * np.pi * 0.015**2 * 0.12)
    for with_feet, without in zip(robot.elements, bare.elements, strict=True):
        if with_feet.body is not None and without.body is not None:
            assert (with_feet.body.mass, with_feet.body.com) == (without.body.mass, without.body.com)
    # a link with feet turns about its centre like the same link as a cylinder
    body = robot.elements[robot.frame_index("link1") - 1].body
    assert body is not None and body.inertia is not None
    across = body.mass * (3 * 0.015**2 + 0.1**2) / 12
    np.testing.assert_allclose(body.inertia, [0.5 * body.mass * 0.015**2, across, across, 0, 0, 0], rtol=1e-14)
    assert footed(mass=0.2).mass == pytest.approx(1.2)
    assert footed(radius=0.03).contacts[0].radius == 0.03


def test_feet_are_neighbours_of_each_other_and_of_the_links_that_meet_there() -> None:
    robot = footed(8, foot_spread=0.12)
    names = [c.name for c in robot.contacts]
    apart = {frozenset((names[i], names[j])) for i, j in separate_contacts(robot)}
    for i in (1, 3, 5, 7):
        left, right = f"foot{i}.left", f"foot{i}.right"
        assert frozenset((left, right)) not in apart
        for side in (left, right):
            assert frozenset((side, f"link{i}")) not in apart and frozenset((side, f"link{i + 1}")) not in apart
            assert i > 5 or frozenset((side, f"foot{i + 2}.left")) in apart
            assert i > 5 or frozenset((side, f"link{i + 3}")) in apart


@pytest.mark.parametrize("spread", [0.0, 0.06, 0.12])
def test_a_footed_snake_is_clear_of_itself_unless_it_folds(spread: float) -> None:
    robot = footed(8, foot_spread=spread)
    rng = np.random.default_rng(3)
    assert bp.check(still(robot, np.zeros(robot.n))).ok
    for _ in range(20):
        q = rng.uniform(-0.6, 0.6, robot.n)
        report = bp.check(still(robot, q))
        assert report.ok, (q, report.failures)
    folded = {"pitch1": 0.0, "pitch3": -2.9, "pitch5": 0.0, "pitch7": 0.0}
    q = robot.vector({name: folded.get(name, 0.0) for name in robot.joints})
    assert {line.kind for line in bp.check(still(robot, q)).failures} == {"self"}


def test_round_trips(tmp_path: Any) -> None:
    robot = footed(limits=(-1.5, 1.5))
    assert bp.Robot.from_dict(robot.to_dict()) == robot
    robot.to_toml(tmp_path / "snake.toml")
    assert bp.Robot.from_toml(tmp_path / "snake.toml") == robot


def test_feet_in_a_mission() -> None:
    assert parse_mission(MISSION, "m", "m.toml", None, ()).robot == footed(5)


@pytest.mark.parametrize(("options", "message"), [
    ({"foot_radius": None}, "foot_spread.*no feet"),
    ({"foot_radius": 0.0}, "foot_radius.*> 0.0"),
    ({"foot_spread": -0.01}, "foot_spread.*>= 0.0"),
    ({"radius": 0.031}, "radius: must be <= foot_radius = 0.03"),
    ({"joint": "double"}, 'foot_radius: only joint="straight".*double'),
    ({"axes": "yaw", "first": "yaw"}, "foot_radius.*pitch.*'yaw' axes"),
    ({"links": 2, "first": "yaw"}, "foot_radius.*pitch"),
    ({"axes": "pitch"}, 'first: only axes="alternating".*pitch'),
    ({"first": "roll"}, "pitch, yaw"),
])  # fmt: skip
def test_refusals(options: dict[str, Any], message: str) -> None:
    with pytest.raises(bp.InputError, match=message):
        footed(**options)
