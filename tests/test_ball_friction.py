"""Friction that depends on the direction of sliding, for spheres: a sled on four balls, pulled over the floor."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

from bodyplan.ground import Corridor, Ground, Plane, Profile
from bodyplan.motion import Motion
from bodyplan.robot.elements import Body, Contact, Row
from bodyplan.robot.model import Robot
from bodyplan.simulate import Friction, build, simulate
from bodyplan.simulate.friction import Balls, Runners, directed
from bodyplan.spatial.rotations import multiply, quaternion_exp

BOX = ([-5.0] * 3, [5.0] * 3)
G, MASS, RADIUS = 9.81, 0.7, 0.03
SCALES = Friction(forward=0.1, backward=0.35, sideways=0.25)
LEVEL = Profile([(None, 0.0), (4.5, 0.1)])


def sled(runner: bool = False) -> Robot:
    """A block that stands on four balls, or on two balls behind and a capsule in front."""
    places = {f"{x:+d}{y:+d}": (0.1 * x, 0.08 * y, 0.0) for x in (-1, 1) for y in (-1, 1)}
    feet = [Contact(f"ball{name}", "base", "sphere", RADIUS, start=at) for name, at in places.items()]
    if runner:
        feet[2:] = [Contact("runner", "base", "capsule", RADIUS, start=(0.05, 0.0, 0.0), end=(0.15, 0.0, 0.0))]
    # as low as the ground, so that pulling does not make it rock
    body = Body(mass=MASS, com=(0.0, 0.0, -RADIUS), inertia=(0.01, 0.01, 0.01, 0.0, 0.0, 0.0))
    return Robot.from_rows({"mark": [Row(a=0.1)]}, base_body=body, contacts=feet)


def pulled(robot: Robot, ground: Ground, heading: float, direction: float, pull: float, seconds: float = 0.6) -> Any:
    """Ways (3,) m and speeds (3,) m/s at the end of a sled that points to ``heading`` and is pulled in ``direction``,
    in the plane, by ``pull`` N through its centre of mass, after it has come to rest."""
    physics = build(robot, ground, *BOX, friction=SCALES)
    model, data = physics.model, mujoco.MjData(physics.model)
    turn = quaternion_exp([0.0, 0.0, heading])
    data.qpos[:] = physics.qpos(np.zeros(0), [0.0, 0.0, RADIUS, *turn])
    body = model.body("base").id
    for k in range(round((0.3 + seconds) / model.opt.timestep)):
        if k == 300:
            start = data.qpos[:3].copy()
            data.xfrc_applied[body, :2] = pull * np.cos(direction), pull * np.sin(direction)
        physics.scales.update(model, data)
        mujoco.mj_step(model, data)
    return data.qpos[:3] - start, data.qvel[:3].copy()


def law(angle: float) -> float:
    """Coefficient for sliding at an angle to forward."""
    along = SCALES.forward if np.cos(angle) > 0.0 else SCALES.backward
    return float(1.0 / np.hypot(np.cos(angle) / along, np.sin(angle) / SCALES.sideways))


@pytest.mark.parametrize("ground", [Plane(), LEVEL], ids=["plane", "boxes"])
@pytest.mark.parametrize("angle", [0.0, np.pi, 0.5 * np.pi, -0.5 * np.pi, 0.7, 2.4, -2.0])
def test_a_sled_on_balls_resists_as_the_law_says(ground: Ground, angle: float) -> None:
    heading, mu = 0.9, law(angle)
    direction = heading + angle
    resists = mu * MASS * G
    pull = 1.2 * resists  # gently: contacts as stiff as these chatter when they are dragged fast
    way, speed = pulled(sled(), ground, heading, direction, pull)
    along = np.array([np.cos(direction), np.sin(direction), 0.0])
    force = pull - MASS * float(speed @ along) / 0.6
    assert force == pytest.approx(resists, rel=0.02)
    # friction is against the motion, so that it goes where it is pulled
    assert np.linalg.norm(way - (way @ along) * along) < 0.02 * way @ along


@pytest.mark.parametrize("angle", [0.0, np.pi, 0.5 * np.pi, 0.7])
def test_a_weaker_pull_is_held(angle: float) -> None:
    way, speed = pulled(sled(), Plane(), 0.0, angle, 0.8 * law(angle) * MASS * G)
    assert np.linalg.norm(way) < 0.004 and np.linalg.norm(speed) < 0.01


def test_the_same_pull_moves_it_forward_and_not_backward() -> None:
    pull = 0.3 * MASS * G
    ahead, _ = pulled(sled(), Plane(), 0.0, 0.0, pull)
    back, _ = pulled(sled(), Plane(), 0.0, np.pi, pull)
    assert ahead[0] == pytest.approx(0.5 * (0.3 - 0.1) * G * 0.36, rel=0.02) and abs(back[0]) < 0.004


def test_balls_and_runners_go_together() -> None:
    robot = sled(runner=True)
    physics = build(robot, Plane(), *BOX, friction=SCALES)
    assert physics.scales is not None
    sizes = {type(part): len(part.pairs) for part in physics.scales.parts}
    assert sizes == {Balls: 2, Runners: 1}
    boxes = build(robot, LEVEL, *BOX, friction=SCALES)
    assert boxes.scales is not None
    assert {type(part): len(part.pairs) for part in boxes.scales.parts} == {Balls: 6}  # on two boxes
    way, _ = pulled(robot, Plane(), 0.4, 0.4, 0.3 * MASS * G)
    assert np.hypot(*way[:2]) == pytest.approx(0.5 * (0.3 - 0.1) * G * 0.36, rel=0.02)
    way, _ = pulled(robot, LEVEL, 0.4, 0.4, 0.3 * MASS * G)
    assert np.hypot(*way[:2]) == pytest.approx(0.5 * (0.3 - 0.1) * G * 0.36, rel=0.02)


def test_walls_keep_their_own_friction() -> None:
    physics = build(sled(), Corridor(0.5, wall_friction=0.8), *BOX, friction=SCALES)
    data = mujoco.MjData(physics.model)
    mujoco.mj_forward(physics.model, data)
    assert physics.scales is not None
    physics.scales.update(physics.model, data)
    assert physics.model.pair("ball+1+1 on left wall").friction[0] == 0.8
    assert physics.model.pair("ball+1+1 on floor").friction[0] == SCALES.forward


@pytest.mark.parametrize(("heading", "holds"), [(0.0, False), (np.pi, True), (0.5 * np.pi, False)])
def test_on_an_incline(heading: float, holds: bool) -> None:
    angle = 0.3
    turn = multiply(quaternion_exp([0.0, angle, 0.0]), quaternion_exp([0.0, 0.0, heading]))
    base = np.tile([0.0, 0.0, 0.1, *turn], (2, 1))
    none = np.zeros((2, 0))
    plane = Plane(slope=(-np.tan(angle), 0.0))
    motion = Motion(sled(), plane, {}, [0.0, 0.6], base, none, none, none, np.zeros(2), np.full(2, "ok"))
    trial = simulate(motion, friction=SCALES, settle=0.0, ramp=0.0)
    slid = float(np.linalg.norm(trial.com[-1] - trial.com[0]))
    if holds:
        assert slid < 0.002
    else:
        want = 0.5 * G * (np.sin(angle) - law(heading) * np.cos(angle)) * trial.t[-1] ** 2
        assert slid == pytest.approx(want, rel=0.02)


def test_the_law_at_its_edges() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    ahead = np.array([[0.6, 0.0, 0.8]])  # nose up: seen from above it is x

    def mu(velocity: Any, friction: Friction = SCALES, axes: Any = ahead) -> float:
        return float(directed(friction, np.array([velocity], dtype=float).T, np.asarray(axes).T, up.T)[0])

    assert mu([0.0, 0.0, 0.0]) == 0.1 and mu([0.0, 0.0, -1.0]) == 0.1
    assert mu([1e-12, 0.0, 0.0]) == pytest.approx(0.1) and mu([-1e-12, 0.0, 0.0]) == pytest.approx(0.35)
    assert mu([0.0, 2.0, 3.0]) == pytest.approx(0.25)
    assert mu([1.0, 1.0, 0.0]) == pytest.approx(np.sqrt(2.0) / np.hypot(10.0, 4.0))
    # no friction one way is none for every motion that has a part of it
    slick = Friction(0.0, 0.4, 0.2)
    assert mu([1.0, 0.0, 0.0], slick) == 0.0 and mu([1.0, 1.0, 0.0], slick) == 0.0
    assert mu([0.0, 1.0, 0.0], slick) == pytest.approx(0.2) and mu([-1.0, 0.0, 0.0], slick) == pytest.approx(0.4)
    # an upright axis has no forward
    assert mu([1.0, 0.0, 0.0], axes=up) == pytest.approx(0.25)
