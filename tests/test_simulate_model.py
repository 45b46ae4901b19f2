"""The MuJoCo model of a robot: its kinematics, masses and contacts against the robot's own."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.ground import Corridor, Plane, Surface
from bodyplan.ground.base import Solid
from bodyplan.robot.elements import Arc, Body, Contact, Joint, Row, WheelRadius
from bodyplan.robot.library import snake
from bodyplan.robot.model import Robot
from bodyplan.simulate import Friction, Physics, build, default_servo
from bodyplan.simulate.friction import as_friction, pair_friction
from bodyplan.simulate.inertia import inertial
from bodyplan.spatial.rotations import matrix_from_quaternion

BOX = ([-3.0] * 3, [3.0] * 3)
BELLY = (Contact("belly", "base", "sphere", 0.1),)


def random_robot(seed: int) -> Robot:
    """One to three chains of rows with any of the four variables driven, offsets, negative scales, shared
    joints, massless rows, a chain that hangs on another."""
    rng = np.random.default_rng(seed)
    chains: dict[str, list[Row]] = {}
    for c in range(rng.integers(1, 4)):
        rows = []
        for r in range(rng.integers(1, 6)):
            values: dict[str, Any] = {}
            for field in Row.VARIABLES:
                scale = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 2.0))
                driven = Joint(f"{c}.{r}.{field}", float(rng.normal()), scale)
                values[field] = driven if rng.random() < 0.5 else float(rng.normal())
            if rng.random() < 0.3:
                values["theta"] = Joint(f"shared{c}", float(rng.normal()), float(rng.uniform(0.2, 1.5)))
            rows.append(Row(**values, body=Body(mass=float(rng.uniform(0.1, 2))) if rng.random() < 0.6 else None))
        chains[f"c{c}"] = rows
    parents = {"c1": "c0.1"} if "c1" in chains else None
    return Robot.from_rows(chains, parents=parents, contacts=BELLY, base_body=Body(mass=2.0))


def posed(physics: Physics, q: np.ndarray, base: np.ndarray) -> Any:
    data = mujoco.MjData(physics.model)
    data.qpos[:] = physics.qpos(q, base)
    mujoco.mj_forward(physics.model, data)
    return data


def random_pose(rng: np.random.Generator) -> np.ndarray:
    turn = rng.normal(size=4)
    return np.concatenate([rng.normal(size=3), turn / np.linalg.norm(turn)])


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_sites_and_their_jacobians_are_those_of_the_robot(seed: int) -> None:
    robot = random_robot(seed)
    physics = build(robot, Plane(), *BOX)
    rng = np.random.default_rng(seed)
    q, base = rng.normal(size=robot.n), random_pose(rng)
    data = posed(physics, q, base)
    np.testing.assert_allclose(physics.q(data.qpos), q, atol=1e-13)
    poses = robot.forward(q, base)
    turn = matrix_from_quaternion(base[3:])
    for frame in robot.frames:
        site = data.site(frame)
        np.testing.assert_allclose(site.xpos, poses[frame][:3], atol=2e-13)
        np.testing.assert_allclose(site.xmat.reshape(3, 3), matrix_from_quaternion(poses[frame][3:]), atol=2e-13)
        linear, angular = np.zeros((3, physics.model.nv)), np.zeros((3, physics.model.nv))
        mujoco.mj_jacSite(physics.model, data, linear, angular, site.id)
        mine = np.zeros((6, robot.n))
        # chain rule: MuJoCo's joints are scale * q
        moved = np.concatenate([linear, angular])[:, physics.dof_at] * physics.drives.scale
        np.add.at(mine.T, physics.drives.joint, moved.T)
        J = robot.jacobian(q, frame, reference="world")
        np.testing.assert_allclose(mine, np.concatenate([turn @ J[:3], turn @ J[3:]]), atol=1e-12)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_total_mass_is_that_of_the_robot(seed: int) -> None:
    robot = random_robot(seed)
    model = build(robot, Plane(), *BOX).model
    assert model.body_mass.sum() == pytest.approx(robot.mass, rel=1e-10)
    moving = model.body_dofnum > 0
    assert model.body_mass[moving].min() > 0.0


@pytest.mark.parametrize("k", [2, 4, 8])
def test_an_arc_is_off_by_no_more_than_stated(k: int) -> None:
    length, pitch, yaw = 0.3, -0.4, 0.9
    body = Body(mass=0.2)
    arc = Arc(length, Joint("p", offset=0.1, scale=-1.0), Joint("y"), name="tip", body=body)
    robot = Robot.from_rows({"a": [arc]}, base_body=Body(mass=1.0), contacts=BELLY)
    q, here = np.array([0.1 - pitch, yaw]), np.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0])
    data = posed(build(robot, Plane(), *BOX, arc_joints=k), q, here)
    pose = robot.forward(q, here)["tip"]
    phi = float(np.hypot(pitch, yaw))
    error = float(np.linalg.norm(data.site("tip").xpos - pose[:3]))
    assert error < 1.2 * length * phi**2 / (12.0 * k**2)
    turned = data.site("tip").xmat.reshape(3, 3).T @ matrix_from_quaternion(pose[3:])
    assert np.arccos(np.clip(0.5 * (np.trace(turned) - 1.0), -1.0, 1.0)) < 0.25 * phi**3 / k**2


def test_an_arc_without_joints_is_exact() -> None:
    arc = Arc(0.3, 0.7, -0.5, name="tip", body=Body(mass=0.2))
    robot = Robot.from_rows({"a": [Row(theta=0.4, a=0.1), arc]}, base_body=Body(mass=1.0), contacts=BELLY)
    here = random_pose(np.random.default_rng(1))
    data = posed(build(robot, Plane(), *BOX), np.zeros(0), here)
    np.testing.assert_allclose(data.site("tip").xpos, robot.forward(np.zeros(0), here)["tip"][:3], atol=1e-13)


SHAPES = {
    "capsule": (Contact("c", "f", "capsule", 0.03, start=(0.1, -0.2, 0.3), end=(0.4, 0.1, 0.2)), "capsule"),
    "sphere": (Contact("c", "f", "sphere", 0.04, start=(0.1, 0.2, -0.1)), "sphere"),
    "box": (Contact("c", "f", "box", start=(0.1, 0.0, 0.2), half=(0.1, 0.2, 0.05)), "box"),
    "rim": (Contact("c", "f", "rim", 0.2, start=(0.0, 0.1, 0.2)), "cylinder"),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_inertia_of_a_contact_shape_is_that_of_mujocos_solid(shape: str) -> None:
    contact, kind = SHAPES[shape]
    place = f'pos="{" ".join(map(str, contact.start))}"'
    if shape == "capsule":
        place = f'fromto="{" ".join(map(str, (*contact.start, *contact.end)))}"'
    size = {"box": contact.half, "rim": (0.2, 0.02)}.get(shape, (contact.radius,))
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><worldbody><body><joint/><geom type="{kind}" mass="1.7" {place} '
        f'size="{" ".join(map(str, size))}"/></body></worldbody></mujoco>'
    )
    model = spec.compile()
    turn = matrix_from_quaternion(model.body_iquat[1])
    mass, com, inertia = inertial(Body(mass=1.7), [contact], [0.0, 0.0, 0.0])
    assert mass == 1.7
    np.testing.assert_allclose(com, model.body_ipos[1], atol=1e-12)
    np.testing.assert_allclose(inertia, turn @ np.diag(model.body_inertia[1]) @ turn.T, atol=1e-12)


def test_inertia_falls_back_to_a_rod_and_a_ball_of_water() -> None:
    mass, com, inertia = inertial(Body(mass=0.001), [], [-2.0, 0.0, 0.0])
    np.testing.assert_allclose(com, [-1.0, 0.0, 0.0])
    np.testing.assert_allclose(np.diag(inertia)[1:], mass * 4.0 / 12.0, rtol=1e-6)
    ball = inertial(Body(mass=1000.0), [], [0.0, 0.0, 0.0]).inertia
    radius = (3.0 / (4.0 * np.pi)) ** (1.0 / 3.0)
    np.testing.assert_allclose(ball, 400.0 * radius**2 * np.eye(3), rtol=1e-12)
    given_inertia = Body(mass=2.0, com=(1.0, 2.0, 3.0), inertia=(3.0, 4.0, 5.0, 0.1, 0.2, 0.3))
    _, com, inertia = inertial(given_inertia, list(BELLY), [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(com, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(inertia, [[3.0, 0.1, 0.2], [0.1, 4.0, 0.3], [0.2, 0.3, 5.0]])


def test_two_overlapping_shapes_weigh_by_volume() -> None:
    ends = [
        Contact("a", "f", "sphere", 0.1, start=(0.0, 0.0, 0.0)),
        Contact("b", "f", "sphere", 0.1, start=(1.0, 0, 0)),
    ]
    mass, com, inertia = inertial(Body(mass=2.0), ends, [0.0, 0.0, 0.0])
    np.testing.assert_allclose(com, [0.5, 0.0, 0.0], atol=1e-15)
    own = 0.4 * mass * 0.01
    np.testing.assert_allclose(np.diag(inertia), [own, own + 0.5, own + 0.5], rtol=1e-12)


def test_limits_efforts_and_passive_joints_reach_the_model() -> None:
    rows = [
        Row(theta=Joint("a", 0.2, -2.0, limits=(-0.5, 1.0), effort=3.0), a=0.1, body=Body(mass=1.0)),
        Row(theta=Joint("free", actuated=False), a=0.1, body=Body(mass=1.0)),
    ]
    physics = build(Robot.from_rows({"c": rows}, contacts=BELLY), Plane(), *BOX, servo=(7.0, 0.5))
    model = physics.model
    np.testing.assert_allclose(model.joint("a").range, [-2.0, 1.0])
    assert model.joint("a").limited[0] and not model.joint("free").limited[0]
    assert model.nu == 1 and physics.servos.tolist() == [0]
    np.testing.assert_allclose(model.actuator_forcerange[0], [-3.0, 3.0])
    np.testing.assert_allclose(model.actuator_gear[0, 0], -0.5)
    assert model.actuator_gainprm[0, 0] == 7.0 and model.actuator_biasprm[0, 2] == -0.5


def test_the_servo_of_a_shared_joint_reads_and_drives_the_joint_coordinate() -> None:
    half = Joint("bend").share(0.5)
    rows = [Row(theta=half, a=0.1, body=Body(mass=0.3)), Row(theta=half, a=0.1, body=Body(mass=0.3))]
    physics = build(Robot.from_rows({"c": rows}, contacts=BELLY, base_body=Body(mass=1.0)), Plane(), *BOX)
    data = posed(physics, np.array([0.8]), np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    assert data.actuator_length[0] == pytest.approx(0.8, abs=1e-14)
    data.ctrl[:] = 0.8 + 1.0 / physics.gains[0, 0]  # one N m
    mujoco.mj_forward(physics.model, data)
    # virtual work: the force on q is the sum of scale * torque
    torque = physics.drives.scale @ data.qfrc_actuator[physics.dof_at]
    assert torque == pytest.approx(1.0, rel=1e-9) == data.actuator_force[0]


def test_default_servo_is_twice_the_weight_times_the_length() -> None:
    robot = snake(10, 0.1, radius=0.02, mass=0.2)
    gains = default_servo(robot)
    assert gains["yaw3"] == pytest.approx((2.0 * 2.0 * 9.81 * 1.0, 2.0 * 2.0 * 9.81 / 50.0))
    assert set(gains) == set(robot.joints)


def test_floor_friction_may_be_overridden_and_walls_keep_theirs() -> None:
    contact = Contact("c", "base", "sphere", 0.1, friction=0.7)
    floor, wall = Solid("f", "plane", "floor", friction=0.2), Solid("w", "box", "wall", friction=0.9)
    assert pair_friction(floor, contact, None) == (0.2, 0.2)
    assert pair_friction(Solid("f", "plane", "floor"), contact, None) == (0.7, 0.7)
    assert pair_friction(Solid("f", "plane", "floor"), BELLY[0], None) == (0.5, 0.5)
    assert pair_friction(floor, contact, 0.3) == (0.3, 0.3)
    assert pair_friction(floor, contact, Friction(0.1, 0.4, 0.2)) == (0.4, 0.2)
    assert pair_friction(wall, contact, 0.3) == (0.9, 0.9)
    assert as_friction([0.1, 0.2, 0.3]) == Friction(0.1, 0.2, 0.3)


def test_self_collision_is_an_option_and_spares_neighbours() -> None:
    robot = snake(4, 0.1, radius=0.02)
    assert build(robot, Plane(), *BOX).model.npair == 4
    assert build(robot, Plane(), *BOX, self_collision=True).model.npair == 4 + 3
    assert build(robot, Corridor(0.5), *BOX).model.npair == 12


def test_misuse_names_what_is_wrong() -> None:
    robot = snake(3, 0.1, radius=0.02)
    scales = Friction(0.1, 0.4, 0.2)
    bare = Robot.from_rows({"a": [Row(theta=Joint("x"), a=0.1)]}, contacts=BELLY)
    wheel = Robot.from_rows({"w": [Row(d=WheelRadius(Joint("r"), 0.1), body=Body(mass=1.0))]}, contacts=BELLY)
    heavy = Body(mass=1.0, inertia=(1.0, 1.0, 9.0, 0.0, 0.0, 0.0))
    impossible = Robot.from_rows({"a": [Row(theta=Joint("x"), body=heavy)]}, contacts=BELLY)
    square = Contact("square", "base", "box", half=(0.1, 0.1, 0.1))
    square_robot = Robot.from_rows({"a": [Row(a=0.1)]}, base_body=Body(mass=1.0), contacts=[square])
    with pytest.raises(InputError, match="no mass"):
        build(bare, Plane(), *BOX)
    with pytest.raises(InputError, match=r"wheel-radius.*"):
        build(wheel, Plane(), *BOX)
    with pytest.raises(InputError, match="cannot be simulated"):
        build(impossible, Plane(), *BOX)
    with pytest.raises(InputError, match="scales need a plane"):
        build(robot, Surface("0.01*sin(x)"), *BOX, friction=scales)
    with pytest.raises(InputError, match=r"scales need capsules or spheres.*'square'"):
        build(square_robot, Plane(), *BOX, friction=scales)
    with pytest.raises(UnknownNameError, match="yaw1"):
        build(robot, Plane(), *BOX, servo={"yaw9": (1.0, 0.1)})
    with pytest.raises(InputError, match=r"\(kp, kv\)"):
        build(robot, Plane(), *BOX, servo=(1.0,))  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"Friction\.backward"):
        Friction(0.1, -0.1, 0.1)
    with pytest.raises(InputError, match="triple"):
        as_friction((0.1, 0.2))
