"""References for tests of crawling: random legs, forward kinematics of feet and support written down once more."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import bodyplan as bp
from bodyplan.robot import Joint, Row

#: hills and hollows of 80 mm
ROUGH = "0.04*sin(6*x)*cos(5*y)"
VARIABLES = ("theta", "d", "a", "epsilon")


def random_legs(rng: np.random.Generator, legs: int = 3) -> bp.Robot:
    """Legs of 3-6 rows behind a mount: three actuated joints on any of the variables, with scales and offsets,
    constants on the others, at times a joint that drives a second variable, or a passive one. Balls beside the last
    frames."""
    rows, contacts = {}, []
    for k in range(legs):
        name, count = f"leg{k}", int(rng.integers(3, 7))
        table: list[dict[str, Any]] = [
            {"theta": rng.uniform(-3, 3), "d": rng.uniform(-0.2, 0.2), "a": rng.uniform(0.1, 0.3),
             "epsilon": rng.uniform(-2, 2)}
            for _ in range(count)
        ]  # fmt: skip
        places = rng.permutation([(i, j) for i in range(count) for j in range(4)])[:5]
        labels = [f"{name}.j{j}" for j in range(3)]
        kinds = [VARIABLES[j] in ("theta", "epsilon") for _, j in places]
        if kinds[3] in kinds[:3] and rng.random() < 0.5:
            labels.append(labels[kinds.index(kinds[3])])
        if rng.random() < 0.5:
            labels.append(f"{name}.passive")
        for (i, j), label in zip(places, labels, strict=False):
            scale = rng.uniform(0.5, 1.5) * rng.choice([-1.0, 1.0])
            table[i][VARIABLES[j]] = Joint(label, rng.uniform(-0.5, 0.5), scale, actuated=not label.endswith("passive"))
        rows[name] = [Row(theta=2 * np.pi * k / legs, a=0.3), *(Row(**row) for row in table)]
        ball = rng.uniform(-0.05, 0.05, 3).tolist()
        contacts.append(bp.Contact(f"{name}.foot", f"{name}.{count + 1}", "sphere", 0.01, start=ball))
    return bp.Robot.from_rows(rows, contacts=contacts)


def five_legs(**options: Any) -> bp.Robot:
    """Five legs around a round body."""
    turns = np.arange(5) * 2 * np.pi / 5
    return bp.walker({f"l{k}": (0.15 * np.cos(a), 0.15 * np.sin(a), a) for k, a in enumerate(turns)}, **options)


def feet_by_hand(motion: Any) -> np.ndarray:
    """Centres (T, m, 3) of the balls in the world, from products of 4x4 matrices, row by row."""
    robot = motion.robot
    base = _pose(motion.base)
    feet = []
    for chain in robot.chains:
        T = base
        for row in chain.elements:
            theta, d, a, epsilon = (_value(getattr(row, f), robot, motion.q) for f in VARIABLES)
            T = T @ _turn(2, theta) @ _move(2, d) @ _move(0, a) @ _turn(0, epsilon)
        end = chain.frame_name(len(chain.elements) - 1)
        ball = next(c for c in robot.contacts if c.frame == end and c.shape == "sphere")
        feet.append((T @ np.array([*ball.start, 1.0]))[:, :3])
    return np.stack(feet, axis=1)


def center_by_hand(motion: Any) -> np.ndarray:
    """Centre of mass (T, 3): rods from joint to joint, and the body in the middle of the base."""
    robot, base = motion.robot, _pose(motion.base)
    total, moment = robot.base_body.mass, robot.base_body.mass * base[:, :3, 3]
    for chain in robot.chains:
        T = base
        for row in chain.elements:
            before = T[:, :3, 3]
            theta, d, a, epsilon = (_value(getattr(row, f), robot, motion.q) for f in VARIABLES)
            T = T @ _turn(2, theta) @ _move(2, d) @ _move(0, a) @ _turn(0, epsilon)
            if row.body is not None:
                total += row.body.mass
                moment = moment + row.body.mass * 0.5 * (before + T[:, :3, 3])
    return moment / total


def margin_by_hand(points: np.ndarray, at: np.ndarray) -> float:
    """Distance of ``at`` (2,) from the nearest edge of the hull of points (k, 2), negative outside: the least over all
    directions of how far the hull reaches beyond it, which only normals of edges can be."""
    least = np.inf
    for i in range(len(points)):
        for j in range(len(points)):
            way = points[j] - points[i]
            if i != j and np.hypot(*way) > 0.0:
                normal = np.array([way[1], -way[0]]) / np.hypot(*way)
                if np.all((points - points[i]) @ normal <= 1e-12):
                    least = min(least, float((points[i] - at) @ normal))
    return least


def _value(value: Any, robot: bp.Robot, q: np.ndarray) -> np.ndarray:
    if isinstance(value, Joint):
        return value.offset + value.scale * q[:, robot.joint_index(value.name)]
    return np.full(len(q), float(value))


def _turn(axis: int, angle: np.ndarray) -> np.ndarray:
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    i, j = (1, 2) if axis == 0 else (0, 1)
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i], T[:, i, j] = np.sin(angle), -np.sin(angle)
    return T


def _move(axis: int, length: np.ndarray) -> np.ndarray:
    T = np.tile(np.eye(4), (len(length), 1, 1))
    T[:, axis, 3] = length
    return T


def _pose(base: np.ndarray) -> np.ndarray:
    w, x, y, z = base[:, 3:].T
    T = np.tile(np.eye(4), (len(base), 1, 1))
    T[:, :3, :3] = np.moveaxis(
        np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        ),
        -1,
        0,
    )
    T[:, :3, 3] = base[:, :3]
    return T


def rough_height(x: Any, y: Any) -> Any:
    """Of ROUGH."""
    return 0.04 * np.sin(6 * x) * np.cos(5 * y)


def rough_normal(x: Any, y: Any) -> np.ndarray:
    """Upward unit normal of ROUGH."""
    slope = np.array([-0.24 * np.cos(6 * x) * np.cos(5 * y), 0.2 * np.sin(6 * x) * np.sin(5 * y), 1.0])
    return slope / np.linalg.norm(slope)


def normal_under(centre: np.ndarray, radius: float = 0.01) -> np.ndarray:
    """Normal of ROUGH where a ball with its ``centre`` (3,) a radius off it touches it."""
    point = centre
    for _ in range(200):
        point = centre - radius * rough_normal(point[0], point[1])
    return rough_normal(point[0], point[1])


def stances(motion: Any) -> Iterator[tuple[int, np.ndarray]]:
    """(leg, rows) of every time in which a foot stands, of feet in the order of the contacts."""
    for leg, on in enumerate((motion.contacts > 0.5).T[: len(motion.robot.chains)]):
        ends = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
        for first, last in ends.reshape(-1, 2):
            yield leg, np.arange(first, last)


def yaw_of(base: np.ndarray) -> np.ndarray:
    """Heading (T,) rad of poses (T, 7)."""
    w, x, y, z = base[..., 3:].T
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
