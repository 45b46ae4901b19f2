"""A snake seen from above: the straight links between its yaw joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.robot.model import Robot


@dataclass(frozen=True)
class PlanarSnake:
    """``lengths`` (n,) m of the straight parts between yaw joints, tail first; ``columns`` (n - 1,) of q that turn
    them; ``scale`` (n - 1,) rad of turn per unit of q; ``frames`` (n + 1,) names of frames at the joints' places
    (tail end first, head end last)."""

    lengths: Array
    columns: IntArray
    scale: Array
    frames: tuple[str, ...]

    @property
    def length(self) -> float:
        """Length of the straight snake, m."""
        return float(self.lengths.sum())

    def joints(self, angles: Array, joint_count: int) -> Array:
        """q (..., joint_count) for absolute angles (..., n) or their derivatives; the other joints stay 0."""
        q = np.zeros((*angles.shape[:-1], joint_count))
        q[..., self.columns] = np.diff(angles, axis=-1) / self.scale
        return q


def planar_snake(robot: Robot, gait: str) -> PlanarSnake:
    """The yaw joints of a one-chain robot that is straight along x at q = 0, read off its Jacobian there.

    Raises InputError (naming the gait) for robots with several chains, not straight at rest, without yaw joints,
    or with arc-shaped links.
    """
    if len(robot.chains) != 1:
        raise InputError(f"{gait}: needs a snake, a robot of one chain; {robot.name!r} has {len(robot.chains)}.")
    rest = np.zeros(robot.n)
    places = robot.forward(rest).positions
    along = places[:, 0]
    length = float(along[-1])
    if length <= 0.0 or np.any(np.abs(places[:, 1:]) > 1e-9 * max(length, 1e-9)) or np.any(np.diff(along) < -1e-12):
        raise InputError(f"{gait}: needs a snake that lies straight along x at q = 0; {robot.name!r} does not.")
    tip = robot.frames[-1]
    twists = robot.jacobian(rest, tip, reference="world")
    turn = twists[5]
    yaw = np.flatnonzero(np.abs(turn) > 1e-9)
    crooked = np.abs(twists[[2, 3, 4]][:, yaw]).max(initial=0.0)
    if yaw.size == 0 or crooked > 1e-9:
        raise InputError(f"{gait}: needs joints that turn about the vertical axis; {robot.name!r} has none such.")
    # a turn at x moves the tip sideways by (length - x)
    at = length - twists[1, yaw] / turn[yaw]
    order = np.argsort(at, kind="stable")
    yaw, at = yaw[order], at[order]
    stations = np.concatenate([[0.0], at, [length]])
    lengths = np.diff(stations)
    if np.any(lengths <= 1e-9 * length):
        raise InputError(f"{gait}: two yaw joints of {robot.name!r} are in one place, or one is at an end.")
    snake_frames = []
    for x in stations:
        nearest = int(np.argmin(np.abs(along - x)))
        if abs(along[nearest] - x) > 1e-9 * length:
            raise InputError(
                f"{gait}: needs straight links between frames; {robot.name!r} has a joint at "
                f"x = {x:.6g} m where no frame is (arc-shaped links?)."
            )
        snake_frames.append(robot.frames[nearest])
    # straight links: turning one joint must not move frames behind it
    return PlanarSnake(lengths, yaw, turn[yaw], tuple(snake_frames))


def level_floor(ground: Ground, points: Array, gait: str) -> float:
    """Height of the floor under points (..., 2), or InputError where it is not flat and level there."""
    heights = ground.height(points[..., 0], points[..., 1])
    spread = float(np.ptp(heights))
    if spread > 1e-9:
        raise InputError(
            f"{gait}: moves in a plane and needs a flat, level floor; this one rises by {spread:.3g} m "
            "under the body's path."
        )
    return float(np.mean(heights))


def resting_radius(robot: Robot) -> float:
    """Height of the base above the floor when the robot's contacts lie on it at q = 0, m (0 without contacts)."""
    if not robot.contacts:
        return 0.0
    rest = robot.forward(np.zeros(robot.n))
    lowest = np.inf
    for contact in robot.contacts:
        index = robot.frame_index(contact.frame)
        points = contact.points() @ rest.rotations[index].T + rest.positions[index]
        lowest = min(lowest, float(points[:, 2].min()) - contact.radius)
    return -lowest
