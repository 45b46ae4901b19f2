"""Centres of mass: against MuJoCo's of the same robot, and where a body says nothing, by hand."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import bodyplan as bp
from bodyplan.robot.masses import center_of_mass, mass_points
from bodyplan.simulate import build

BOX = ([-3.0] * 3, [3.0] * 3)


def quadruped() -> bp.Robot:
    """A trunk with four legs of two links: bodies with and without a centre, feet, a leg on a sliding mount."""
    rows: dict[str, list[Any]] = {}
    feet = []
    for k, (x, y) in enumerate([(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)]):
        rows[f"leg{k}"] = [
            bp.Row(theta=np.arctan2(y, x), a=float(np.hypot(x, y)), epsilon=np.pi / 2, name=f"mount{k}"),
            bp.Row(theta=bp.Joint(f"hip{k}", offset=-0.4), a=0.15, name=f"knee{k}", body=bp.Body(mass=0.4)),
            bp.Row(theta=bp.Joint(f"shank{k}"), a=0.2, d=bp.Joint(f"slide{k}"), name=f"foot{k}",
                   body=bp.Body(mass=0.2 + 0.1 * k, com=(-0.05, 0.0, 0.01 * k) if k else None)),
        ]  # fmt: skip
        feet.append(bp.Contact(f"toe{k}", f"foot{k}", "sphere", 0.03, start=(0.0, 0.01, 0.0)))
        feet.append(bp.Contact(f"calf{k}", f"foot{k}", "capsule", 0.02, start=(-0.2, 0.0, 0.0), end=(-0.05, 0.0, 0.0)))
    trunk = bp.Contact("trunk", "base", "box", start=(0.02, 0.0, 0.03), half=(0.2, 0.1, 0.05))
    rim = bp.Contact("rim", "knee0", "rim", 0.05, start=(-0.1, 0.0, 0.0))
    return bp.Robot.from_rows(rows, contacts=[trunk, rim, *feet], base_body=bp.Body(mass=3.0))


ROBOTS = {
    "straight": lambda: bp.snake(7, 0.1, axes="universal"),
    "double": lambda: bp.snake(4, [0.1, 0.2, 0.15, 0.1], "double", axes="universal"),
    "acm_l2": lambda: bp.acm_l2(),
    "quadruped": quadruped,
}


@pytest.mark.parametrize("name", ROBOTS)
def test_the_centre_of_mass_is_that_of_mujoco(name: str) -> None:
    robot = ROBOTS[name]()
    physics = build(robot, bp.Plane(), *BOX)
    rng = np.random.default_rng(4)
    q, turn = rng.uniform(-1.0, 1.0, (6, robot.n)), rng.normal(size=(6, 4))
    base = np.concatenate([rng.normal(size=(6, 3)), turn / np.linalg.norm(turn, axis=1, keepdims=True)], axis=1)
    mine = center_of_mass(robot, q, base)
    data = mujoco.MjData(physics.model)
    for k in range(6):
        data.qpos[:] = physics.qpos(q[k], base[k])
        mujoco.mj_kinematics(physics.model, data)
        mujoco.mj_comPos(physics.model, data)
        # frames without a body weigh 1e-12 of the robot there
        assert np.abs(mine[k] - data.subtree_com[1]).max() < 1e-10


def test_an_arc_is_as_near_to_mujoco_s_as_its_pieces_are_fine() -> None:
    robot = bp.snake(5, 0.1, "arc", axes="universal")
    q = np.random.default_rng(2).uniform(-0.5, 0.5, robot.n)
    base = np.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0])
    off = []
    for k in (8, 16):
        physics = build(robot, bp.Plane(), *BOX, arc_joints=k)
        data = mujoco.MjData(physics.model)
        data.qpos[:] = physics.qpos(q, base)
        mujoco.mj_kinematics(physics.model, data)
        mujoco.mj_comPos(physics.model, data)
        off.append(float(np.abs(center_of_mass(robot, q, base) - data.subtree_com[1]).max()))
    # the pieces approach the arc with the square of their number
    assert off[1] < 1e-4 and 3.5 < off[0] / off[1] < 4.5


def test_where_a_body_names_no_centre() -> None:
    robot = quadruped()
    frames, masses, centres = mass_points(robot)
    assert [robot.frames[i] for i in frames][:3] == ["base", "knee0", "foot0"]
    assert masses.sum() == pytest.approx(robot.mass, rel=1e-15)
    at = {robot.frames[i]: centre for i, centre in zip(frames, centres, strict=True)}
    np.testing.assert_allclose(at["base"], [0.02, 0.0, 0.03])  # its box
    np.testing.assert_allclose(at["knee0"], [-0.1, 0.0, 0.0])  # its rim
    np.testing.assert_allclose(at["knee1"], [-0.075, 0.0, 0.0], atol=1e-15)  # the middle of the rod
    np.testing.assert_allclose(at["foot1"], [-0.05, 0.0, 0.01])  # its own word
    toe, calf = 4 / 3 * np.pi * 0.03**3, np.pi * 0.02**2 * 0.15 + 4 / 3 * np.pi * 0.02**3
    np.testing.assert_allclose(
        at["foot0"], (toe * np.array([0, 0.01, 0]) - calf * np.array([0.125, 0, 0])) / (toe + calf)
    )


def test_the_middle_of_a_rod_that_is_bent_and_offset() -> None:
    bend = bp.Row(theta=0.7, d=0.3, a=0.4, epsilon=-0.5, body=bp.Body(mass=1.0))
    robot = bp.Robot.from_rows({"c": [bp.Row(a=0.1), bend]})
    poses = robot.forward(np.zeros(0))
    want = 0.5 * (poses.positions[1] + poses.positions[2])
    np.testing.assert_allclose(center_of_mass(robot, np.zeros(0)), want, atol=1e-15)


def test_batches_broadcast_and_a_robot_without_mass_is_refused() -> None:
    robot = bp.snake(3, 0.1)
    base = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (5, 1, 1))
    assert center_of_mass(robot, np.zeros((4, 2)), base).shape == (5, 4, 3)
    assert center_of_mass(robot, [0.0, 0.0]).shape == (3,)
    bare = bp.Robot.from_rows({"a": [bp.Row(theta=bp.Joint("x"), a=0.1)]})
    with pytest.raises(bp.InputError, match="no mass"):
        center_of_mass(bare, [0.0])
