"""Motion as an MCAP log of ROS 2 messages: what Foxglove and RViz play, ``ros2 bag`` and other tools read.

/joint_states has a sensor_msgs/msg/JointState a sample; /tf a tf2_msgs/msg/TFMessage with the tree of frames: the
fixed frame, the base in it, every chain's frames one in the other, as robot_state_publisher would.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.export.ros import MOST_SECONDS, NANO, nanoseconds, split
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot
from bodyplan.spatial.poses import relative

_LINE = "=" * 80
_HEADER = f"""\
{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
JOINT_STATE = f"""\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER}"""
TF_MESSAGE = f"""\
geometry_msgs/TransformStamped[] transforms
{_LINE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_LINE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_LINE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_LINE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
{_HEADER}"""


def write(
    motion: Motion, path: str | os.PathLike[str], *, fixed_frame: str = "world", start: float | None = None
) -> None:
    """Write the motion to ``path``; efforts are its torques where it has any.

    ``fixed_frame``: name of the world's frame. ``start``: stamp of the first sample in s (Unix time where the log is
    to look like one of today); the motion's own times where None. Raises InputError, MissingExtraError without the
    extra "ros".
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError as error:
        raise MissingExtraError("mcap-ros2-support", "ros", "an MCAP log") from error

    robot = motion.robot
    if not isinstance(fixed_frame, str) or not fixed_frame or fixed_frame in robot.frames:
        raise InputError(f"fixed_frame: must be a name that is no frame of the robot, got {fixed_frame!r}.")
    stamps = nanoseconds(motion.t)
    if start is not None:
        first = nanoseconds(np.array([number(start, "start", at_least=0.0)]))[0]
        stamps = stamps - stamps[0] + first
    if stamps[-1] >= MOST_SECONDS * NANO:
        raise InputError(f"start: ROS 2 counts to {MOST_SECONDS - 1} s, the log would go past that.")
    if stamps[0] < 0:
        raise InputError(f"Motion.t: an MCAP log has no times before 0, got {motion.t[0]!r}; give a start.")
    parents = tree(robot)
    names = [fixed_frame, *robot.frames]
    arms = transforms(motion, parents).tolist()
    efforts = [[]] * len(motion.t) if motion.torques is None else motion.torques.tolist()
    with replacing(path, "wb") as file, Writer(file) as log:
        states = log.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        tf = log.register_msgdef("tf2_msgs/msg/TFMessage", TF_MESSAGE)
        log.add_metadata("bodyplan", {"robot": robot.name, "gait": str(motion.gait.get("kind", ""))})
        rows = zip(stamps.tolist(), motion.q.tolist(), motion.qd.tolist(), efforts, arms, strict=True)
        for k, (stamp, q, qd, effort, poses) in enumerate(rows):
            sec, nanosec = split(stamp)
            header = {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": ""}
            state = {"header": header, "name": robot.joints, "position": q, "velocity": qd, "effort": effort}
            log.write_message("/joint_states", states, state, stamp, stamp, k)
            arm = [
                _transform(header | {"frame_id": names[parents[i] + 1]}, names[i + 1], pose)
                for i, pose in enumerate(poses)
            ]
            log.write_message("/tf", tf, {"transforms": arm}, stamp, stamp, k)


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


def _transform(header: dict[str, Any], child: str, pose: list[float]) -> dict[str, Any]:
    x, y, z, qw, qx, qy, qz = pose
    return {
        "header": header,
        "child_frame_id": child,
        "transform": {"translation": {"x": x, "y": y, "z": z}, "rotation": {"x": qx, "y": qy, "z": qz, "w": qw}},
    }
