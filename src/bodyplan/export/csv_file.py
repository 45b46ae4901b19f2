"""Motion as CSV: one row a sample, names and units in the header."""

from __future__ import annotations

import csv
import os

import numpy as np

from bodyplan.files import replacing
from bodyplan.motion import Motion

_BASE = ("x [m]", "y [m]", "z [m]", "qw", "qx", "qy", "qz")


def columns(motion: Motion) -> list[str]:
    """The header: time, base pose (quaternion wxyz), then q, qd, qdd of every joint, then the status."""
    unit = {"angle": "rad", "length": "m"}
    names = ["t [s]", *(f"base.{c}" for c in _BASE)]
    for suffix, per in (("", ""), (".rate", "/s"), (".acceleration", "/s^2")):
        names += [f"{j}{suffix} [{unit[k]}{per}]" for j, k in zip(motion.joints, motion.robot.kinds, strict=True)]
    return [*names, "status"]


def write(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write ``motion`` to ``path``; numbers are written so that they read back equal."""
    table = np.column_stack([motion.t, motion.base, motion.q, motion.qd, motion.qdd])
    with replacing(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns(motion))
        for row, status in zip(table.tolist(), motion.status, strict=True):
            writer.writerow([*map(repr, row), status])
