"""Loads and holding torques against virtual work, hand statics and MuJoCo; margins and clearance of the parts."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import pose
from bodyplan.gaits.rectilinear.holding import holding, support_margin
from bodyplan.gaits.rectilinear.snake import InchingSnake
from rectilinear_cases import anchors_of

G = 9.81
ALONG = np.array([1.0, 0.0, 0.0])


def random_snake(rng: Any, anchors: int, axes: str = "alternating") -> tuple[bp.Robot, np.ndarray]:
    units = 4 * anchors - 2 if axes == "alternating" else 2 * anchors
    lengths = rng.uniform(0.05, 0.15, units)
    options = {"first": "pitch"} if axes == "alternating" else {}
    return bp.snake(units, lengths, axes=axes, radius=0.01, mass=float(rng.uniform(0.1, 0.4)), **options), lengths


def stand(rng: Any, robot: bp.Robot, count: int, samples: int) -> tuple[InchingSnake, np.ndarray, Any, np.ndarray]:
    """A snake on anchors at random, with its joints and the base that put it there."""
    snake = InchingSnake.of(robot, count, None)
    a, b = snake.links[0::2], snake.links[1::2]
    low, high = np.abs(a - b), a + b
    spans = low + (high - low) * rng.uniform(0.4, 0.9, (samples, count - 1))
    anchors = np.array([anchors_of(s, np.zeros(count - 1), (0.3, 0.1)) for s in spans])
    anchors[..., 1] += rng.uniform(0.0, 0.01, (samples, count))
    found = pose(anchors, snake.links)
    assert np.isfinite(found.joints).all()
    base = np.zeros((samples, 7))
    base[:, 3], base[:, 0], base[:, 2] = 1.0, anchors[:, 0, 0] - snake.tail, anchors[:, 0, 1]
    return snake, anchors, found, base


def energy(lengths: Any, weight: float, pitches: dict[int, float], start: Any, tilt: float) -> tuple[float, dict]:
    """Potential energy of units of equal weight in a row, and the height of every pitch joint; unit i + 1 is bent by
    ``pitches[i]`` against unit i."""
    at, angle, total, heights = np.array(start, float), tilt, 0.0, {}
    for i, length in enumerate(lengths):
        if i in pitches:
            heights[i] = at[1]
            angle += pitches[i]
        step = length * np.array([np.cos(angle), np.sin(angle)])
        total += weight * (at[1] + 0.5 * step[1])
        at = at + step
    return total, heights


@pytest.mark.parametrize(("count", "axes"), [(3, "alternating"), (3, "pitch"), (3, "universal"), (5, "alternating"),
                                             (7, "alternating")])  # fmt: skip
def test_torques_are_those_of_virtual_work(count: int, axes: str) -> None:
    """Every joint's torque is what potential energy less the work of the anchors' loads changes by when it turns; and
    nothing changes when the whole snake tilts or rises."""
    rng = np.random.default_rng(count + len(axes))
    robot, lengths = random_snake(rng, count, axes)
    snake, anchors, found, base = stand(rng, robot, count, 6)
    standing = np.ones((6, count), dtype=bool)
    standing[1:3, 1] = standing[3:, 0] = False
    q = snake.q(found.all_joints)
    held = holding(snake, robot.forward(q, base).array, ALONG, anchors[..., 0], standing)
    assert held is not None
    assert np.all(held.loads[~standing] == 0.0)
    pitch = {int(name[5:]): k for k, name in enumerate(robot.joints) if name.startswith("pitch")}
    feet = [int(robot.joints[k][5:]) for k in snake.columns[0::2]]
    weight, h = robot.mass / len(lengths) * G, 1e-6
    for t in range(6):

        def potential(turned: dict[int, float], rise: float = 0.0, tilt: float = 0.0, t: int = t) -> float:
            bends = {i: -q[t, k] + turned.get(i, 0.0) for i, k in pitch.items()}
            total, heights = energy(lengths, weight, bends, (base[t, 0], base[t, 2] + rise), tilt)
            return total - sum(load * heights[i] for load, i in zip(held.loads[t], feet, strict=True))

        for i, k in pitch.items():
            slope = (potential({i: h}) - potential({i: -h})) / (2 * h)
            # q turns nose down
            assert held.torques[t, k] == pytest.approx(-slope, abs=1e-7), (t, i)
        assert potential({}, rise=h) - potential({}, rise=-h) == pytest.approx(0.0, abs=1e-12)
        assert potential({}, tilt=h) - potential({}, tilt=-h) == pytest.approx(0.0, abs=1e-13)
    yaws = [k for k, name in enumerate(robot.joints) if name.startswith("yaw")]
    assert np.all(held.torques[:, yaws] == 0.0)


def test_two_anchors_by_hand() -> None:
    """A level beam: six units of 1 kg and 1 m, on the first and the last of its anchors at 1, 3 and 5 m."""
    robot = bp.snake(6, 1.0, axes="pitch", radius=0.01, mass=1.0)
    snake = InchingSnake.of(robot, 3, None)
    anchors = np.array([[1.0, 3.0, 5.0]])
    base = np.array([[0.0, 0, 0, 1, 0, 0, 0]])
    poses = robot.forward(np.zeros((1, 5)), base).array
    both = holding(snake, poses, ALONG, anchors, np.array([[True, False, True]]))
    assert both is not None
    np.testing.assert_allclose(both.loads, [[3 * G, 0.0, 3 * G]], atol=1e-12)
    # nose-up moment ahead of each joint: what is ahead weighs (5, 4, 3, 2, 1) G at half of its length
    carried = [5 * 2.5 - 3 * 4, 4 * 2 - 3 * 3, 3 * 1.5 - 3 * 2, 2 * 1 - 3 * 1, 1 * 0.5]
    np.testing.assert_allclose(both.torques, [-G * np.array(carried)], atol=1e-12)
    np.testing.assert_allclose((both.center, both.margin), ([3.0], [2.0]), atol=1e-12)
    tips = holding(snake, poses, ALONG, anchors, np.array([[False, False, True]]))
    assert tips is not None and tips.margin[0] == pytest.approx(-2.0)
    assert tips.loads[0, 2] == pytest.approx(6 * G)


def test_loads_never_pull_where_the_margin_is_positive_and_are_the_best_of_those() -> None:
    """Of all subsets of the anchors: the loads that hold with the least sum of squared torques and do not pull."""
    compared = pulling = 0
    for seed in range(25):
        rng = np.random.default_rng(seed)
        count = (3, 5, 7)[seed % 3]
        robot, lengths = random_snake(rng, count)
        snake, anchors, found, base = stand(rng, robot, count, 4)
        standing = rng.random((4, count)) < 0.75
        standing[~standing.any(axis=1), 0] = True
        poses = robot.forward(snake.q(found.all_joints), base)
        held = holding(snake, poses.array, ALONG, anchors[..., 0], standing)
        assert held is not None
        pitch = [k for k, name in enumerate(robot.joints) if name.startswith("pitch")]
        places = np.array([int(robot.joints[k][5:]) for k in pitch])
        own = [places.tolist().index(int(robot.joints[k][5:])) for k in snake.columns[0::2]]
        ends = [robot.frame_index(f"link{i + 1}") for i in range(len(lengths))]
        x = np.concatenate([base[:, :1], poses.positions[:, ends, 0]], axis=1)
        middle = 0.5 * (x[:, 1:] + x[:, :-1])
        weight = robot.mass / len(lengths) * G
        for t in range(4):
            feet = np.flatnonzero(standing[t])
            center = middle[t].mean()
            margin = min(center - anchors[t, feet, 0].min(), anchors[t, feet, 0].max() - center)
            assert held.margin[t] == pytest.approx(margin, abs=1e-12)
            assert held.loads[t].sum() == pytest.approx(robot.mass * G)
            if margin <= 0.0:
                pulling += held.loads[t].min() < 0.0
                continue
            assert held.loads[t].min() > -1e-9
            assert held.loads[t] @ anchors[t, :, 0] == pytest.approx(robot.mass * G * center)
            carried = np.array([weight * (middle[t, i:] - x[t, i]).sum() for i in places])
            arms = np.array([[anchors[t, f, 0] - x[t, i] if own[f] > j else 0.0 for f in feet] for j, i in
                             enumerate(places)])  # fmt: skip
            best = np.inf
            for size in range(2, len(feet) + 1):
                for some in map(list, combinations(range(len(feet)), size)):
                    sums = np.array([np.ones(size), anchors[t, feet[some], 0]])
                    system = np.block([[arms[:, some].T @ arms[:, some], sums.T], [sums, np.zeros((2, 2))]])
                    right = [*(arms[:, some].T @ carried), robot.mass * G, robot.mass * G * center]
                    loads = np.linalg.lstsq(system, right, rcond=None)[0][:size]
                    balanced = np.abs(sums @ loads - right[-2:]).max() < 1e-8
                    if balanced and loads.min() > -1e-9:
                        best = min(best, float(np.sum((carried - arms[:, some] @ loads) ** 2)))
            assert np.sum(held.torques[t] ** 2) == pytest.approx(best, rel=1e-6)
            compared += 1
    assert compared > 40 and pulling > 5


def test_mujoco_needs_the_same_torques() -> None:
    """Inverse dynamics at rest, high above the floor, with the anchors' loads pushing up on the links that they are
    on: nothing is left for the free base, and for the joints what is held."""
    mujoco = pytest.importorskip("mujoco")
    from bodyplan.simulate.model import build

    rng = np.random.default_rng(0)
    robot, _ = random_snake(rng, 3)
    snake, anchors, found, base = stand(rng, robot, 3, 3)
    base[:, 2] += 10.0
    q = snake.q(found.all_joints)
    standing = np.array([[1, 1, 1], [1, 0, 1], [0, 1, 1]], dtype=bool)
    held = holding(snake, robot.forward(q, base).array, ALONG, anchors[..., 0], standing)
    assert held is not None
    physics = build(robot, bp.Plane(), [-9, -9, -9], [9, 9, 9])
    model = physics.model
    model.opt.gravity[:] = 0.0, 0.0, -G
    data = mujoco.MjData(model)
    dofs = [model.joint(name).dofadr[0] for name in physics.drives.names]
    for t in range(3):
        data.qpos[:] = physics.qpos(q[t], base[t])
        data.qvel[:], data.qacc[:] = 0.0, 0.0
        mujoco.mj_inverse(model, data)
        left = data.qfrc_inverse.copy()
        for load, name, (x, z) in zip(held.loads[t], snake.frames[0::2], anchors[t], strict=True):
            jacobian = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, np.array([x, 0.0, z + 10.0]), model.body(name).id)
            left -= jacobian.T @ [0.0, 0.0, load]
        np.testing.assert_allclose(left[:6], 0.0, atol=1e-9)
        torques = np.zeros(robot.n)
        np.add.at(torques, physics.drives.joint, left[dofs] * physics.drives.scale)
        np.testing.assert_allclose(torques, held.torques[t], atol=1e-9)


def test_no_masses_no_loads() -> None:
    tail = [bp.Row(a=1.0, name="tail"), bp.Row(epsilon=-np.pi / 2, name="up")]
    rows = [bp.Row(theta=bp.Joint(f"p{i}"), a=1.0, name=f"l{i}") for i in range(1, 6)]
    robot = bp.Robot.from_rows({"body": [*tail, *rows]})
    snake = InchingSnake.of(robot, 3, None)
    poses = robot.forward(np.zeros((1, robot.n)))
    assert holding(snake, poses.array, ALONG, np.array([[1.0, 3.0, 5.0]]), np.ones((1, 3), dtype=bool)) is None
    assert snake.balance is None


def test_margin_without_any_anchor() -> None:
    out = support_margin(np.array([[0.0, 1.0, 2.0]]), np.array([0.5]), np.zeros((1, 3), dtype=bool))
    assert out[0] == -np.inf
