"""Motion as YAML of a ROS 2 trajectory_msgs/msg/JointTrajectory: what a joint trajectory controller takes."""

from __future__ import annotations

import os

from bodyplan.arrays import Array
from bodyplan.export.ros import nanoseconds, split
from bodyplan.export.sampled import sampled
from bodyplan.files import replacing
from bodyplan.motion import Motion


def write(motion: Motion, path: str | os.PathLike[str], *, rate: float | None = None, joints: str = "actuated") -> None:
    """Write the joints' trajectory to ``path``: positions rad or m, velocities, accelerations at times from the start.

    ``rate``: samples a second, the motion's own where None. ``joints``: "actuated", since a controller refuses
    joints that it does not have, or "all". Numbers read back equal; times are the nearest nanosecond. InputError.
    """
    track = sampled(motion, rate, joints)
    stamps = nanoseconds(track.t if rate is not None else motion.t)
    with replacing(path) as file:
        file.write("# trajectory_msgs/msg/JointTrajectory; SI units and radians\n")
        file.write('header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: ""\n')
        file.write("joint_names:\n" + "".join(f"- {_text(name)}\n" for name in track.names))
        file.write("points:\n")
        for stamp, q, qd, qdd in zip(stamps - stamps[0], track.q, track.qd, track.qdd, strict=True):
            sec, nanosec = split(stamp)
            file.write(
                f"- positions: {_row(q)}\n  velocities: {_row(qd)}\n  accelerations: {_row(qdd)}\n"
                f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}\n"
            )


def _row(values: Array) -> str:
    return f"[{', '.join(map(_float, values.tolist()))}]"


def _float(value: float) -> str:
    """The shortest text that reads back equal; YAML takes 1e-05 for a text, 1.0e-05 for a number."""
    out = repr(value)
    return out if "e" not in out or "." in out else out.replace("e", ".0e")


def _text(name: str) -> str:
    """A quoted text of YAML, whatever is in it."""
    return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in name) + '"'
