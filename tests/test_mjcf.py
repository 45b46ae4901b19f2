"""The exported MJCF file, as MuJoCo reads it back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from bodyplan.errors import InputError
from bodyplan.export import mjcf
from bodyplan.ground import Corridor, Plane, Surface
from bodyplan.motion import Motion, times
from bodyplan.robot.elements import Arc, Body, Contact, Joint, Row
from bodyplan.robot.library import snake
from bodyplan.robot.model import Robot
from bodyplan.simulate import Friction, build
from bodyplan.spatial.rotations import matrix_from_quaternion, quaternion_exp

HILLS = Surface("0.02*sin(6*x)*cos(5*y)")


def mixed_robot() -> Robot:
    half = Joint("bend", offset=0.2, limits=(-1.0, 1.0), effort=3.0).share(0.5)
    inertia = (0.1, 0.12, 0.13, 0.01, 0.02, 0.003)
    rows = [
        Row(theta=half, a=1.0 / 3.0, epsilon=0.3, name="one", body=Body(mass=1.1, inertia=inertia)),
        Row(theta=half, d=Joint("slide", scale=-2.0), a=0.3, name="two"),
        Row(theta=Joint("free", actuated=False), epsilon=-0.7, a=0.1, name="three", body=Body(mass=0.5)),
    ]
    contacts = [
        Contact("rim", "one", "rim", 0.1),
        Contact("foot", "three", "sphere", 0.05),
        Contact("trunk", "base", "box", half=(0.1, 0.07, 0.04), start=(0.01, 0.0, 0.0)),
        Contact("keel", "base", "capsule", 0.02, start=(0.0, 0.0, -0.1), end=(0.1, 0.02, -0.13)),
    ]
    tail = [Arc(0.3, Joint("nod"), Joint("wag", scale=0.5), body=Body(mass=0.4))]
    return Robot.from_rows({"arm": rows, "tail": tail}, contacts=contacts, base_body=Body(mass=2.0), name="mixed")


def differing(one: Any, two: Any) -> list[str]:
    """Numeric fields in which two models of the same structure differ."""
    out = []
    for name in dir(one):
        a, b = getattr(one, name), getattr(two, name)
        # texts, a keyframe and lights (stored in single precision) are not physics
        if (
            isinstance(a, np.ndarray)
            and not name.startswith(("name", "key", "light", "_", "text", "paths", "site_size"))
            and not np.array_equal(a, b)
        ):
            out.append(name)
    return out


def test_the_file_is_the_model_that_is_simulated(tmp_path: Path) -> None:
    robot = mixed_robot()
    mjcf.write(robot, tmp_path / "robot.xml", HILLS, friction=0.4, servo=(3.0, 0.3))
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    reach = 2.0 * max(0.5, float(np.abs(robot.forward(np.zeros(robot.n)).positions).max()))
    physics = build(robot, HILLS, [-reach] * 3, [reach] * 3, friction=0.4, servo=(3.0, 0.3))
    assert differing(read, physics.model) == []
    assert [p.name for p in tmp_path.iterdir()] == ["robot.xml"]


def test_kinematics_of_the_file_are_those_of_the_robot(tmp_path: Path) -> None:
    robot = mixed_robot()
    mjcf.write(robot, tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    q = np.array([0.3, -0.2, 0.9, 0.0, 0.0])
    base = np.concatenate([[0.3, -0.1, 0.7], quaternion_exp([0.2, -0.5, 0.9])])
    data.qpos[:7] = base
    for name, value in (("bend@one.theta", 0.15), ("bend@two.theta", 0.15), ("slide", 0.4), ("free", 0.9)):
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    poses = robot.forward(q, base)
    for frame in robot.frames:
        np.testing.assert_allclose(data.site(frame).xpos, poses[frame][:3], atol=1e-13)
        turn = matrix_from_quaternion(poses[frame][3:])
        np.testing.assert_allclose(data.site(frame).xmat.reshape(3, 3), turn, atol=1e-13)
    # servos are named and scaled as the joints; the passive one has none
    assert [model.actuator(i).name for i in range(model.nu)] == ["bend", "slide", "nod", "wag"]
    assert data.actuator("bend").length[0] == pytest.approx(0.3, abs=1e-15)
    assert data.actuator("slide").length[0] == pytest.approx(-0.2, abs=1e-15)


def folded(ground: Any) -> Motion:
    robot, t = snake(6, 0.1, radius=0.02, mass=0.1), times(0.0, 1.0, 0.25)
    q = np.tile(0.6 * np.array([1.0, -1.0, 1.0, -1.0, 1.0]), (len(t), 1))
    base = np.tile(np.concatenate([[0.1, 0.0, 0.5], quaternion_exp([0.0, 0.0, -0.3])]), (len(t), 1))
    zero = np.zeros_like(q)
    return Motion(robot, ground, {}, t, base, q, zero, zero, np.zeros(len(t)), np.full(len(t), "ok"))


def test_a_motion_saves_its_robot_on_its_ground_in_its_first_pose(tmp_path: Path) -> None:
    motion = folded(Corridor(0.2, height=0.05, friction=0.2, wall_friction=0.9))
    motion.save(tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    np.testing.assert_array_equal(data.qpos[7:], motion.q[0])
    np.testing.assert_array_equal(data.ctrl, motion.q[0])
    # set down: it touches the floor and does not reach into it
    mujoco.mj_forward(model, data)
    assert data.qpos[2] == pytest.approx(0.02, abs=1e-12)
    np.testing.assert_allclose(model.pair("link1 on floor").friction[:2], 0.2)
    np.testing.assert_allclose(model.pair("link1 on left wall").friction[:2], 0.9)
    mujoco.mj_step(model, data, 200)
    assert np.abs(data.qpos[:3] - [0.1, 0.0, 0.02]).max() < 0.01


def test_a_height_field_is_written_into_the_file(tmp_path: Path) -> None:
    mjcf.write(folded(HILLS), tmp_path / "robot.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(model)
    data.qpos[:7] = [0, 0, 100, 1, 0, 0, 0]  # out of the way
    mujoco.mj_forward(model, data)
    for x, y in ((0.0, 0.0), (0.25, 0.1), (-0.3, 0.4), (0.41, -0.33)):
        down = mujoco.mj_ray(
            model, data, np.array([x, y, 5.0]), np.array([0, 0, -1.0]), None, 1, -1, np.zeros(1, np.int32)
        )
        assert 5.0 - down == pytest.approx(float(HILLS.height(x, y)), abs=2e-4)


def test_misuse_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no mass"):
        mjcf.write(Robot.from_rows({"a": [Row(theta=Joint("x"), a=0.1)]}), tmp_path / "robot.xml")
    with pytest.raises(InputError, match="scales need a plane"):
        mjcf.write(snake(3, 0.1), tmp_path / "robot.xml", HILLS, friction=Friction(0.1, 0.4, 0.2))
    with pytest.raises(InputError, match="has its own"):
        mjcf.write(folded(Plane()), tmp_path / "robot.xml", Plane())
    with pytest.raises(InputError, match="Motion or a Robot"):
        mjcf.write("robot", tmp_path / "robot.xml")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="does not exist"):
        mjcf.write(snake(3, 0.1), tmp_path / "nowhere" / "robot.xml")
    assert list(tmp_path.iterdir()) == []
