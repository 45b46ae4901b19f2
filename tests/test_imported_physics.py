"""Robots of others in physics: their mass matrix is Pinocchio's, they stand, and odd inertias are joined or named."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.motion import Motion
from bodyplan.robot.elements import Body, Contact, Joint, Row
from bodyplan.robot.model import Robot
from bodyplan.simulate import build, simulate
from urdf_cases import data_file, pinocchio

BOX = ([-3.0] * 3, [3.0] * 3)
BELLY = (Contact("belly", "base", "sphere", 0.1),)


def mass_matrix(robot: Robot, q: Any) -> np.ndarray:
    """(n, n) of the joints, without armature."""
    physics = build(robot, bp.Plane(), *BOX, armature=0.0)
    data = mujoco.MjData(physics.model)
    data.qpos[:] = physics.qpos(q, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    mujoco.mj_forward(physics.model, data)
    columns = []
    for dof in physics.dof_at:
        column = np.zeros(physics.model.nv)
        mujoco.mj_mulM(physics.model, data, column, np.eye(physics.model.nv)[dof])
        columns.append(column[physics.dof_at])
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("file", ["a1.urdf", "hyq_no_sensors.urdf", "ur5_robot.urdf", "simple_humanoid.urdf"])
def test_mass_matrices_are_those_of_pinocchio(file: str) -> None:
    """HyQ's root link has an inertia that no body has; its trunk is fixed to it."""
    path = data_file(file)
    robot = Robot.from_urdf(path, contacts=BELLY)
    pin = pinocchio()
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.0, 1.0, robot.n)
    at = pin.neutral(model)
    places = [model.joints[model.getJointId(name)] for name in robot.joints]
    for joint, value in zip(places, q, strict=True):
        at[joint.idx_q] = value
    M = pin.crba(model, model.createData(), at)
    M = np.triu(M) + np.triu(M, 1).T
    v = [joint.idx_v for joint in places]
    want = M[np.ix_(v, v)]
    # bodies without mass or extent get some, many orders below what moves them
    assert np.abs(mass_matrix(robot, q) - want).max() < 1e-6 * np.abs(want).max()


def standing(robot: Robot, q: Any, height: float, seconds: float = 1.0) -> Motion:
    t = np.linspace(0.0, seconds, 51)
    zero = np.zeros((len(t), robot.n))
    base = np.tile([0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0], (len(t), 1))
    ok = np.full(len(t), "ok")
    return Motion(robot, bp.Plane(), {}, t, base, zero + q, zero, zero, np.zeros(len(t)), ok)


@pytest.mark.parametrize(
    ("file", "bend"), [("a1.urdf", {"thigh": 0.8, "calf": -1.6}), ("hyq_no_sensors.urdf", {"hfe": 0.7, "kfe": -1.4})]
)
def test_a_quadruped_stands_still(file: str, bend: dict[str, float]) -> None:
    robot = Robot.from_urdf(data_file(file))
    signs = {
        name: -1.0 if file.startswith("hyq") and name.split("_")[0] in ("lh", "rh") else 1.0 for name in robot.joints
    }
    q = np.array([next((v for k, v in bend.items() if k in n), 0.0) * signs[n] for n in robot.joints])
    feet = [c for c in robot.contacts if c.shape == "sphere"]
    assert len(feet) == 4
    poses = robot.forward(q)
    low = min(poses.array[robot.frame_index(c.frame), 2] - c.radius for c in feet)
    trial = simulate(standing(robot, q, -low), settle=1.0)
    assert trial.ok and not [text for text in trial.warnings if "air" in text or "limit" in text]
    assert np.abs(trial.base[-1, :2]).max() < 0.03 and trial.tilt is not None and trial.tilt < 0.05
    # at rest, and no servo fights the ground: less than the weight times a third of the legs' height
    largest = float(np.abs(trial.torque[-1]).max())
    assert largest < robot.mass * 9.81 * -low / 3.0
    assert np.abs(trial.torque[-1] - trial.torque[-10]).max() < 0.05 * largest


def arm(inertia: Any, moves: bool = True, company: Body | None = None) -> Robot:
    body = Body(mass=0.5, com=(0.0, 0.0, 0.0), inertia=inertia)
    tip = Row(a=0.2, theta=Joint("wrist") if moves else 0.0, body=body)
    rows = {"arm": [Row(a=0.3, theta=Joint("elbow"), body=company), tip]}
    return Robot.from_rows(rows, base_body=Body(mass=2.0), contacts=BELLY)


def test_a_point_on_a_link_swings_as_a_point() -> None:
    """No extent: the mass matrix of points."""
    q = np.array([0.3, -0.7])
    for moves in (True, False):
        robot = arm((0.0,) * 6, moves, Body(mass=0.4, com=(0.0,) * 3, inertia=(0.0,) * 6))
        M = mass_matrix(robot, q[: robot.n])
        way = 0.3**2 + 0.2**2 + 2 * 0.3 * 0.2 * (np.cos(q[1]) if moves else 1.0)
        assert M[0, 0] == pytest.approx(0.4 * 0.3**2 + 0.5 * way, abs=1e-8)
        if moves:
            assert M[1, 1] == pytest.approx(0.5 * 0.2**2, abs=1e-8)


def test_inertias_that_are_none_are_joined_with_what_carries_them_or_named() -> None:
    wrong = (1e-3, 1e-3, 9e-3, 0.0, 0.0, 0.0)
    carrier = Body(mass=1.0, com=(-0.15, 0.0, 0.0), inertia=(0.02, 0.02, 0.02, 0.0, 0.0, 0.0))
    M = mass_matrix(arm(wrong, False, carrier), np.zeros(1))
    assert M[0, 0] == pytest.approx(0.02 + 0.15**2 + 0.5 * 0.5**2 + 9e-3, abs=1e-12)
    with pytest.raises(InputError, match=r"inertia of arm.2 is that of no body. .* are 0.001, 0.001, 0.009 kg m\^2"):
        build(arm(wrong, True, carrier), bp.Plane(), *BOX)
    # six digits of a thin plate
    plate = mass_matrix(arm((1.00001e-3, 1e-3, 2.00002e-3, 0.0, 0.0, 0.0), True, carrier), np.zeros(2))
    assert plate[1, 1] == pytest.approx(0.5 * 0.2**2 + 2.00002e-3, abs=1e-7)
