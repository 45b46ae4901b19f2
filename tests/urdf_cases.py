"""Robots of others and what their libraries make of them: files in packages from PyPI, kinematics by Pinocchio."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bodyplan.robot import Robot, WheelRadius
from bodyplan.spatial import matrix_from_quaternion


def data_folder() -> Path | None:
    """The robots of the package example-robot-data, without importing it."""
    found = importlib.util.find_spec("cmeel")
    if found is None or found.origin is None:
        return None
    folder = Path(found.origin).parents[1] / "cmeel.prefix/share/example-robot-data/robots"
    return folder if folder.is_dir() else None


def data_file(name: str) -> Path:
    folder = data_folder()
    if folder is None:
        pytest.skip("the package example-robot-data is not installed")
    return next(folder.glob(f"*/*/{name}"))


def pinocchio() -> Any:
    return pytest.importorskip("pinocchio", reason="Pinocchio (package pin) is not installed")


@cache
def mimics(path: Path) -> dict[str, tuple[str, float, float]]:
    """joint -> (the joint that it mimics, multiplier, offset), read from the file."""
    out = {}
    for joint in ET.parse(path).getroot().iterfind("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            numbers = (float(mimic.get(field, default)) for field, default in (("multiplier", "1"), ("offset", "0")))
            out[joint.get("name", "")] = (mimic.get("joint", ""), *numbers)
    return out  # type: ignore[return-value]


class Reference:
    """A URDF file as Pinocchio sees it, with a floating base at the origin; mimics are followed by hand."""

    def __init__(self, path: Path) -> None:
        self.pin, self.path = pinocchio(), path
        self.model = self.pin.buildModelFromUrdf(str(path), self.pin.JointModelFreeFlyer())
        self.data = self.model.createData()

    def line(self, name: str) -> tuple[str, float, float]:
        """(leader, factor, offset) of a joint's coordinate."""
        leader, factor, offset = name, 1.0, 0.0
        while leader in mimics(self.path):
            leader, more, added = mimics(self.path)[leader]
            offset, factor = offset + factor * added, factor * more
        return leader, factor, offset

    def set(self, q: dict[str, float]) -> None:
        """Kinematics at the joint coordinates ``q``; followers follow."""
        pin, model = self.pin, self.model
        at = pin.neutral(model)
        for name in model.names[2:]:
            leader, factor, offset = self.line(name)
            joint, value = model.joints[model.getJointId(name)], offset + factor * q[leader]
            at[joint.idx_q : joint.idx_q + joint.nq] = value if joint.nq == 1 else (np.cos(value), np.sin(value))
        pin.forwardKinematics(model, self.data, at)
        pin.computeJointJacobians(model, self.data, at)
        pin.updateFramePlacements(model, self.data)
        self.at = at

    def links(self) -> list[str]:
        return [f.name for f in self.model.frames if f.type == self.pin.FrameType.BODY and f.name != "universe"]

    def pose(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """(position, rotation matrix)."""
        placed = self.data.oMf[self.model.getFrameId(link, self.pin.FrameType.BODY)]
        return placed.translation, placed.rotation

    def jacobian(self, link: str, joints: tuple[str, ...]) -> np.ndarray:
        """(6, n) body-fixed."""
        pin, model = self.pin, self.model
        frame = model.getFrameId(link, pin.FrameType.BODY)
        columns = pin.getFrameJacobian(model, self.data, frame, pin.ReferenceFrame.LOCAL)
        out = np.zeros((6, len(joints)))
        for name in model.names[2:]:
            leader, factor, _ = self.line(name)
            out[:, joints.index(leader)] += factor * columns[:, model.joints[model.getJointId(name)].idx_v]
        return out


def random_q(robot: Robot, rng: np.random.Generator) -> np.ndarray:
    """Joint coordinates within limits that are near, and within a radian or a metre of 0 else."""
    low, high = np.clip(robot.limits, -1.0, 1.0).T
    return rng.uniform(low, np.maximum(high, low + 1e-3))


def laws(robot: Robot) -> dict[str, WheelRadius]:
    """The first radius law that each joint drives."""
    out: dict[str, WheelRadius] = {}
    for element in robot.elements:
        for field in element.VARIABLES:
            value = getattr(element, field)
            if isinstance(value, WheelRadius):
                out.setdefault(value.joint.name, value)
    return out


def off(pose: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> float:
    """Largest difference of a pose (7,) and a position and rotation matrix."""
    turn = np.abs(matrix_from_quaternion(pose[3:]) - rotation).max()
    return float(max(turn, np.abs(pose[:3] - position).max()))
