"""Motion as an MCAP log of ROS 2 messages: what Foxglove and RViz play, ``ros2 bag`` and other tools read.

/joint_states has a sensor_msgs/msg/JointState a sample; /tf a tf2_msgs/msg/TFMessage with the tree of frames: the
fixed frame, the base in it, every chain's frames one in the other, as robot_state_publisher would. Markers draw robot
and ground on them: /markers/robot (again every second, for who comes late), /markers/moving, /markers/ground.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.export.markers import Markers, stamped
from bodyplan.export.messages import definition
from bodyplan.export.ros import MOST_SECONDS, NANO, nanoseconds, split
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial.poses import relative

#: most pictures a second of what changes its shape
PICTURES = 30


def write(
    motion: Motion,
    path: str | os.PathLike[str],
    *,
    fixed_frame: str = "world",
    start: float | None = None,
    markers: str = "yes",
) -> None:
    """Write the motion to ``path``; efforts are its torques where it has any.

    ``fixed_frame``: name of the world's frame. ``start``: stamp of the first sample in s (Unix time where the log is
    to look like one of today); the motion's own times where None. ``markers``: "no" leaves them out. Raises InputError,
    MissingExtraError without the extra "ros".
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError as error:
        raise MissingExtraError("mcap-ros2-support", "ros", "an MCAP log") from error

    robot = motion.robot
    if not isinstance(fixed_frame, str) or not fixed_frame or fixed_frame in robot.frames:
        raise InputError(f"fixed_frame: must be a name that is no frame of the robot, got {fixed_frame!r}.")
    if markers not in ("yes", "no"):
        raise InputError(f"markers: must be yes or no, got {markers!r}.")
    stamps = _stamps(motion, start)
    names = [fixed_frame, *robot.frames]
    parents = tree(robot)
    arms = transforms(motion, parents).tolist()
    efforts = [[]] * len(motion.t) if motion.torques is None else motion.torques.tolist()
    drawn = Markers(motion, fixed_frame) if markers == "yes" else None
    with replacing(path, "wb") as file, Writer(file) as writer:
        log = _Log(writer)
        writer.add_metadata("bodyplan", {"robot": robot.name, "gait": str(motion.gait.get("kind", ""))})
        due = {"robot": stamps[0], "moving": stamps[0]}
        rows = zip(stamps, motion.q.tolist(), motion.qd.tolist(), efforts, arms, strict=True)
        for k, (at, q, qd, effort, poses) in enumerate(rows):
            stamp = dict(zip(("sec", "nanosec"), split(at), strict=True))
            state = {"name": robot.joints, "position": q, "velocity": qd, "effort": effort}
            log.write("/joint_states", "sensor_msgs/JointState", {"header": _header(stamp, "")} | state, at)
            arm = [_transform(stamp, names[parents[i] + 1], names[i + 1], pose) for i, pose in enumerate(poses)]
            log.write("/tf", "tf2_msgs/TFMessage", {"transforms": arm}, at)
            if drawn is None:
                continue
            if k == 0:
                log.draw("/markers/ground", drawn.ground, stamp, at)
            if at >= due["robot"]:
                log.draw("/markers/robot", drawn.still, stamp, at)
                due["robot"] = at + NANO
            if at >= due["moving"] or k == len(stamps) - 1:
                log.draw("/markers/moving", drawn.moving(k), stamp, at)
                due["moving"] = at + NANO // PICTURES


class _Log:
    """A log being written; counts the messages of every topic."""

    def __init__(self, writer: Any) -> None:
        self._writer, self._schemas, self._counts = writer, dict[str, Any](), dict[str, int]()

    def write(self, topic: str, kind: str, message: dict[str, Any], at: int) -> None:
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_msgdef(kind.replace("/", "/msg/"), definition(kind))
        count = self._counts.get(topic, 0)
        self._writer.write_message(topic, self._schemas[kind], message, at, at, count)
        self._counts[topic] = count + 1

    def draw(self, topic: str, markers: list[dict[str, Any]], stamp: dict[str, int], at: int) -> None:
        if markers:
            self.write(topic, "visualization_msgs/MarkerArray", {"markers": stamped(markers, stamp)}, at)


def _stamps(motion: Motion, start: float | None) -> list[int]:
    """Nanoseconds of every sample, from ``start`` s on where given."""
    stamps = nanoseconds(motion.t)
    if start is not None:
        stamps = stamps - stamps[0] + nanoseconds(np.array([number(start, "start", at_least=0.0)]))[0]
    if stamps[-1] >= MOST_SECONDS * NANO:
        raise InputError(f"start: ROS 2 counts to {MOST_SECONDS - 1} s, the log would go past that.")
    if stamps[0] < 0:
        raise InputError(f"Motion.t: an MCAP log has no times before 0, got {motion.t[0]!r}; give a start.")
    out: list[int] = stamps.tolist()
    return out


def tree(robot: Robot) -> list[int]:
    """Index in ``robot.frames`` of the frame before each frame; -1, the fixed frame, before the base."""
    out = [-1]
    for chain in robot.chains:
        before = robot.frame_index(chain.parent)
        for _ in chain.elements:
            out.append(before)
            before = len(out) - 1
    return out


def transforms(motion: Motion, parents: list[int]) -> Array:
    """(T, F, 7) pose of every frame seen from the frame before it: the base in the world first."""
    poses = motion.poses().array
    out = np.array(poses)
    out[:, 1:] = relative(poses[:, parents[1:]], poses[:, 1:])
    return out


def _header(stamp: dict[str, int], frame: str) -> dict[str, Any]:
    return {"stamp": stamp, "frame_id": frame}


def _transform(stamp: dict[str, int], parent: str, child: str, pose: list[float]) -> dict[str, Any]:
    x, y, z, qw, qx, qy, qz = pose
    return {
        "header": _header(stamp, parent),
        "child_frame_id": child,
        "transform": {"translation": {"x": x, "y": y, "z": z}, "rotation": {"x": qx, "y": qy, "z": qz, "w": qw}},
    }
