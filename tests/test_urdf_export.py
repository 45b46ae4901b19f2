"""URDF, written: Pinocchio, MuJoCo and bodyplan itself read the robot's own kinematics back."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import bodyplan as bp
from bodyplan.export import format_of
from bodyplan.robot import Arc, Body, Contact, Joint, Robot, Row, WheelRadius
from bodyplan.robot.masses import center_of_mass
from robot_cases import random_robot
from urdf_cases import Reference, laws, mimics, off, random_q

ROBOTS = {
    "straight": lambda: bp.snake(6, 0.1),
    "double": lambda: bp.snake(5, 0.1, joint="double"),
    "alternating": lambda: bp.snake(6, 0.1, axes="alternating", limits=(-1.2, 1.2)),
    "universal": lambda: bp.snake(5, 0.1, axes="universal"),
    "double universal": lambda: bp.snake(4, 0.1, joint="double", axes="universal"),
    "silo4": bp.silo4,
    "silo4 passive": lambda: bp.silo4(passive=True, shell=True),
    "hexapod": bp.hexapod,
    "tri_wheel": bp.tri_wheel,
}


def without_arcs(seed: int) -> Robot:
    """A random robot, joints shared between its chains, every arc a row instead."""
    robot = random_robot(np.random.default_rng(seed), 1 + seed % 3, variable=0.5, share=0.4)
    rows = {
        chain.name: [Row(e.yaw, 0.0, e.length, e.pitch) if isinstance(e, Arc) else e for e in chain.elements]
        for chain in robot.chains
    }
    return Robot.from_rows(rows, parents={c.name: c.parent for c in robot.chains}, name=f"random{seed}")


def coordinates(robot: Robot, q: np.ndarray) -> dict[str, float]:
    """The file's joint coordinates: the robot's, or the radius for a joint that changes a wheel."""
    radius = laws(robot)
    return {
        f"{name}.radius" if name in radius else name: float(radius[name].radius(value)) if name in radius else value
        for name, value in zip(robot.joints, q.tolist(), strict=True)
    }


def mujoco_model(path: Path, massless: bool) -> Any:
    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    if massless:
        spec.compiler.boundmass = spec.compiler.boundinertia = 1e-9
    return spec.compile()


def same_everywhere(robot: Robot, path: Path, seed: int) -> None:
    robot.to_urdf(path)
    reference, back = Reference(path), Robot.from_urdf(path)
    model = mujoco_model(path, robot.mass == 0.0)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    for _ in range(2):
        q = random_q(robot, rng)
        values = coordinates(robot, q)
        assert set(back.joints) == set(values)
        poses, read = robot.forward(q), back.forward(values)
        reference.set(values)
        for j in range(model.njnt):
            leader, factor, offset = reference.line(model.joint(j).name)
            data.qpos[model.jnt_qposadr[j]] = offset + factor * values[leader]
        mujoco.mj_kinematics(model, data)
        for frame in robot.frames:
            assert off(poses[frame], *reference.pose(frame)) < 1e-12
            np.testing.assert_allclose(read[frame], poses[frame], rtol=0.0, atol=1e-12)
            if frame != "base":  # MuJoCo makes it the world
                body = data.body(frame)
                assert off(poses[frame], body.xpos, body.xmat.reshape(3, 3)) < 1e-12
        if not laws(robot):
            columns = [back.joint_index(name) for name in robot.joints]
            for frame in robot.frames[1:]:
                np.testing.assert_allclose(
                    back.jacobian(values, frame)[:, columns], robot.jacobian(q, frame), rtol=0.0, atol=1e-12
                )
        if robot.mass:
            centre = reference.pin.centerOfMass(reference.model, reference.data, reference.at)
            np.testing.assert_allclose(centre, center_of_mass(robot, q), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_our_robots_are_read_back(name: str, tmp_path: Path) -> None:
    same_everywhere(ROBOTS[name](), tmp_path / "robot.urdf", 1)


@pytest.mark.parametrize("seed", [0, 2, 3, 4, 5, 6, 8, 9, 10, 11])
def test_random_robots_are_read_back(seed: int, tmp_path: Path) -> None:
    robot, path = without_arcs(seed), tmp_path / "robot.urdf"
    mixed = [
        name
        for name in laws(robot)
        if any(isinstance(v := getattr(e, f), Joint) and v.name == name for e in robot.elements for f in e.VARIABLES)
    ]
    if mixed:
        with pytest.raises(bp.InputError, match=f"joint '{mixed[0]}': drives the radius of a wheel and also"):
            robot.to_urdf(path)
    else:
        same_everywhere(robot, path, seed)


def test_contacts_masses_and_limits_come_back(tmp_path: Path) -> None:
    for robot in (bp.silo4(shell=True), bp.snake(5, 0.1, axes="universal", limits=(-1.0, 1.0)), bp.tri_wheel()):
        path = tmp_path / "robot.urdf"
        robot.to_urdf(path)
        back = Robot.from_urdf(path)
        here, there = ({c.name: c for c in r.contacts} for r in (robot, back))
        assert set(here) == set(there)
        for name, contact in here.items():
            assert (there[name].shape, there[name].frame) == (contact.shape, contact.frame)
            assert there[name].radius == pytest.approx(contact.radius, rel=1e-15)
            np.testing.assert_allclose(there[name].points(), contact.points(), rtol=0.0, atol=1e-15)
        assert back.mass == pytest.approx(robot.mass, rel=1e-10)
        assert back.base_body == robot.base_body
        for joint in robot.joint_info:
            if joint.name in back.joints:
                assert back.joint_info[back.joint_index(joint.name)].limits == joint.limits
                assert back.efforts[back.joint_index(joint.name)] == robot.efforts[robot.joint_index(joint.name)]
                assert back.rates[back.joint_index(joint.name)] == robot.rates[robot.joint_index(joint.name)]


def test_halves_of_a_double_joint_mimic_a_joint_that_has_its_angle(tmp_path: Path) -> None:
    path = tmp_path / "snake.urdf"
    bp.snake(3, 0.1, joint="double", limits=(-1.0, 1.0), rate=2.0).to_urdf(path)
    assert mimics(path) == {
        "middle1.theta": ("yaw1", 0.5, 0.0),
        "link1.theta": ("yaw1", 0.5, 0.0),
        "middle2.theta": ("yaw2", 0.5, 0.0),
        "link2.theta": ("yaw2", 0.5, 0.0),
        "middle3.theta": ("yaw3", 0.5, 0.0),
        "link3.theta": ("yaw3", 0.5, 0.0),
    }
    root = ET.parse(path).getroot()
    found = {j.get("name"): j for j in root.iterfind("joint")}
    limit, half = found["yaw1"].find("limit"), found["link1.theta"].find("limit")
    assert limit is not None and half is not None
    assert (limit.get("lower"), limit.get("upper"), limit.get("velocity")) == ("-1", "1", "2")
    assert (half.get("lower"), half.get("upper"), half.get("velocity")) == ("-0.5", "0.5", "1")
    # MuJoCo ties them as well
    assert mujoco_model(path, False).neq == 6


def test_the_first_on_a_branch_leads_the_others(tmp_path: Path) -> None:
    bend, path = Joint("bend", limits=(-1.0, 2.0)), tmp_path / "robot.urdf"
    rows = [Row(theta=Joint("bend", scale=-1.0), a=0.1), Row(theta=bend, a=0.1), Row(theta=bend.share(0.3), a=0.1)]
    Robot.from_rows({"arm": rows}).to_urdf(path)
    assert mimics(path) == {"arm.2.theta": ("bend", 1.0, 0.0), "arm.3.theta": ("bend", 0.3, 0.0)}
    assert Robot.from_urdf(path).limits.tolist() == [[-1.0, 2.0]]


def test_a_radius_law_is_a_slide_whose_coordinate_is_the_radius(tmp_path: Path) -> None:
    wheel, path = Joint("q", limits=(-1.0, 2.0), rate=0.5), tmp_path / "robot.urdf"
    law, other = WheelRadius(wheel, 0.2, 0.01), WheelRadius(wheel, 0.3, 0.02)
    Robot.from_rows({"a": [Row(a=law), Row(theta=Joint("turn"), d=other, a=0.1)]}).to_urdf(path)
    back = Robot.from_urdf(path)
    assert back.joints == ("q.radius", "turn")
    # the largest radius is inside the range of the angle
    np.testing.assert_allclose(back.limits[0], [law.radius(2.0), law.radius(0.0)], rtol=1e-15)
    assert back.rates[0] == pytest.approx(0.5 * abs(law.slope(math.pi)), rel=1e-15)
    for q in (-1.0, 0.4, 2.0):
        ours = Robot.from_rows({"a": [Row(a=law), Row(theta=Joint("turn"), d=other, a=0.1)]}).forward([q, 0.3])
        read = back.forward([float(law.radius(q)), 0.3])
        np.testing.assert_allclose(read["a.2"], ours["a.2"], rtol=0.0, atol=1e-15)


def test_links_that_move_without_a_mass_get_a_speck(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    bp.snake(4, 0.1, axes="universal").to_urdf(path)
    for link in ET.parse(path).getroot().iterfind("link"):
        mass = link.find("inertial/mass")
        if mass is not None and link.get("name", "").startswith("pre"):
            assert 0.0 < float(mass.get("value", "")) < 1e-9
    # a robot without mass stays one
    Robot.from_rows({"arm": [Row(theta=Joint("j"), a=0.1)]}).to_urdf(path)
    assert "inertial" not in path.read_text(encoding="utf-8") and Robot.from_urdf(path).mass == 0.0


def test_a_motion_saves_its_robot(tmp_path: Path) -> None:
    robot = bp.snake(8, 0.06, radius=0.015)
    motion = bp.plan(robot, bp.Serpentine(bp.Serpenoid(alpha=0.5)), bp.Plane(), bp.times(0, 1, dt=0.1))
    motion.save(tmp_path / "motion.urdf")
    robot.to_urdf(tmp_path / "robot.urdf")
    assert (tmp_path / "motion.urdf").read_bytes() == (tmp_path / "robot.urdf").read_bytes()
    assert format_of("x.urdf").name == "urdf"


def test_names_that_are_taken_are_avoided(tmp_path: Path) -> None:
    rows = [
        Row(theta=Joint("b.theta"), a=0.1, name="b.fixed"),
        Row(theta=Joint("b.fixed", scale=2.0), d=Joint("x"), a=0.2, name="b"),
        Row(theta=Joint("y"), name="b.theta"),
    ]
    robot, path = Robot.from_rows({"arm": rows}), tmp_path / "robot.urdf"
    same_everywhere(robot, path, 7)


def test_misuse_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    with pytest.raises(bp.InputError, match="frame 'link1': an arc segment bends all along"):
        bp.snake(3, 0.1, joint="arc").to_urdf(path)
    wheel = Joint("q")
    with pytest.raises(bp.InputError, match="joint 'q': drives the radius of a wheel and also a row"):
        Robot.from_rows({"a": [Row(a=WheelRadius(wheel, 0.2), theta=wheel)]}).to_urdf(path)
    with pytest.raises(bp.InputError, match="Motion or a Robot"):
        bp.export.format_of(path).writer("robot", path)
    with pytest.raises(bp.InputError, match="does not exist"):
        bp.silo4().to_urdf(tmp_path / "nowhere" / "robot.urdf")
    assert list(tmp_path.iterdir()) == []


def test_bodies_without_an_inertia_have_that_of_their_shapes(tmp_path: Path) -> None:
    ball = Contact("ball", "arm.1", "sphere", 0.1, start=(0.2, 0.0, 0.0))
    robot = Robot.from_rows({"arm": [Row(theta=Joint("j"), body=Body(mass=2.0))]}, contacts=[ball])
    robot.to_urdf(tmp_path / "robot.urdf")
    body = Robot.from_urdf(tmp_path / "robot.urdf").elements[0].body
    assert body is not None and body.inertia is not None
    assert body.com == pytest.approx((0.2, 0.0, 0.0), abs=1e-16)
    assert body.inertia == pytest.approx((0.008, 0.008, 0.008, 0.0, 0.0, 0.0), abs=1e-16)  # 2/5 m r^2
