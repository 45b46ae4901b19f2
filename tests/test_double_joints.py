"""Double and arc-shaped joints in MuJoCo: coupled hinges whose servo works on the joint coordinate."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.motion import Motion
from bodyplan.robot.snakes import AXES
from bodyplan.simulate import build

mujoco = pytest.importorskip("mujoco")

BOX = (np.full(3, -5.0), np.full(3, 5.0))
HIGH = np.array([0.0, 0.0, 3.0, 1.0, 0.0, 0.0, 0.0])


def motion(robot, q, t):
    base = np.tile([0.0, 0.0, robot.contacts[0].radius, 1.0, 0.0, 0.0, 0.0], (len(t), 1))
    qd = np.gradient(q, t, axis=0)
    return Motion(robot, bp.Plane(), {}, t, base, q, qd, np.zeros_like(q), np.zeros(len(t)), np.full(len(t), "ok"))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(AXES))
def test_mujoco_s_frames_are_those_of_the_robot(seed, axes):
    rng = np.random.default_rng(seed)
    robot = bp.snake(4, rng.uniform(0.05, 0.2, 4), "double", axes=axes, end_link=float(rng.uniform(0.05, 0.45)))
    physics = build(robot, bp.Plane(), *BOX)
    q = rng.uniform(-1.5, 1.5, robot.n)
    turn = rng.normal(size=4)
    base = np.concatenate([rng.uniform(-1.0, 1.0, 3), turn / np.linalg.norm(turn)])
    data = mujoco.MjData(physics.model)
    data.qpos[:] = physics.qpos(q, base)
    mujoco.mj_kinematics(physics.model, data)
    poses = robot.forward(q, base)
    for i, name in enumerate(robot.frames):
        site = data.site(name)
        assert np.abs(site.xpos - poses.positions[i]).max() < 1e-13
        assert np.abs(site.xmat.reshape(3, 3) - poses.rotations[i]).max() < 1e-13
    assert np.abs(physics.q(data.qpos) - q).max() < 1e-14 and physics.coupling_error(data.qpos) < 1e-14


def test_every_axis_of_a_double_joint_is_two_hinges_with_half_the_angle():
    robot = bp.snake(3, 0.1, "double", axes="universal")
    model = build(robot, bp.Plane(), *BOX).model
    assert model.njnt == 1 + 2 * robot.n and model.nu == robot.n and model.neq == robot.n
    assert model.body_mass.sum() == pytest.approx(robot.mass, rel=1e-9)


@pytest.mark.parametrize(("joint", "pieces"), [("double", 2), ("arc", 4)])
def test_the_servo_pushes_the_joint_coordinate(joint, pieces):
    robot = bp.snake(2, 0.1, joint, axes="universal", mass=0.1)
    physics = build(robot, bp.Plane(), *BOX, servo=(8.0, 0.06))
    data = mujoco.MjData(physics.model)
    q = np.array([0.4, -0.3, 0.2, 0.5])
    data.qpos[:] = physics.qpos(q, HIGH)
    offset = np.array([0.05, -0.02, 0.03, 0.01])
    data.ctrl[:] = (q + offset)[physics.servos]
    mujoco.mj_forward(physics.model, data)
    assert np.abs(data.actuator_length - q).max() < 1e-14
    assert np.abs(data.actuator_force - 8.0 * offset).max() < 1e-13
    # virtual work: the torque on q is the sum over its hinges of scale times torque, the same on each hinge
    for column in range(robot.n):
        mine = physics.drives.joint == column
        torques = data.qfrc_actuator[physics.dof_at][mine]
        assert mine.sum() == pieces and np.ptp(torques) < 1e-13
        assert torques @ physics.drives.scale[mine] == pytest.approx(8.0 * offset[column], rel=1e-12)


def test_hinges_stay_in_step_under_load():
    # a cantilever: the head and three units are lifted and swing sideways
    robot = bp.acm_l2(effort=None)
    t = np.linspace(0.0, 2.0, 101)
    q = np.zeros((101, robot.n))
    q[:, robot.joint_index("pitch6")] = -0.6 * (1.0 - np.cos(np.pi * t)) / 2.0
    q[:, robot.joint_index("yaw7")] = 0.8 * np.sin(np.pi * t)
    trial = bp.simulate(motion(robot, q, t), settle=0.2, servo=(8.0, 0.06), friction=0.5)
    assert trial.ok and trial.peak_torque > 0.3
    # "out of step" is said from 1 mrad on
    assert not any("out of step" in text for text in trial.warnings), trial.warnings
    assert trial.tracking_max.max() < 0.15


def test_effort_is_that_of_the_joint_coordinate():
    robot = bp.acm_l2()  # its motors cannot lift the head and four units
    t = np.linspace(0.0, 1.0, 51)
    q = np.zeros((51, robot.n))
    q[:, robot.joint_index("pitch5")] = -0.4 * np.sin(np.pi * t)
    trial = bp.simulate(motion(robot, q, t), settle=0.2, ramp=0.0, servo=(60.0, 0.5))
    assert trial.peak_torque == pytest.approx(0.5, rel=1e-9)
    assert np.abs(trial.torque).max() <= 0.5 * (1.0 + 1e-9)
    assert any("'pitch5' is at its effort 0.5" in text for text in trial.warnings)


def test_arcs_are_as_many_hinges_as_the_settings_say():
    robot = bp.snake(3, 0.1, "arc", mass=0.1)
    still = motion(robot, np.zeros((2, 3)), np.array([0.0, 0.2]))
    assert bp.simulate(still, settle=0.0, ramp=0.0).settings["arc_joints"] == 4
    assert bp.simulate(still, settle=0.0, ramp=0.0, arc_joints=6).settings["arc_joints"] == 6
    assert build(robot, bp.Plane(), *BOX, arc_joints=6).model.njnt == 1 + 18


def test_self_collision_spares_what_the_body_connects():
    robot = bp.snake(4, 0.1, "double", axes="universal", radius=0.03, mass=0.1)
    t = np.array([0.0, 0.5])
    trial = bp.simulate(motion(robot, np.zeros((2, robot.n)), t), settle=0.0, ramp=0.0, self_collision=True)
    assert trial.ok and np.abs(trial.q).max() < 1e-3
