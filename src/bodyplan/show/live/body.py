"""A robot as instances of four unit shapes, and where they are in a snapshot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.elements import Contact
from bodyplan.robot.model import Robot
from bodyplan.show.live.meshes import from_z
from bodyplan.show.live.tracks import Snapshot
from bodyplan.show.scene import AXLE
from bodyplan.show.shapes import arc_bones, arc_points, bones, thickness
from bodyplan.spatial.rotations import multiply, rotate

#: least radius of a bone, of the robot's size
THICK = 0.011
#: pieces of an arc; a bone shorter than this, m, is not drawn
ARC_PIECES, POINT = 8, 1e-6


@dataclass(frozen=True, eq=False)
class Instances:
    """Where instances of one unit shape are: ``positions`` (k, 3) m, ``turns`` (k, 4) wxyz, ``scales`` (k, 3) m."""

    positions: Array
    turns: Array
    scales: Array


class Body:
    """The unit shapes that make a robot: balls, cylinders (also of capsules), boxes and rims."""

    SHAPES = ("sphere", "cylinder", "box", "rim")

    def __init__(self, robot: Robot, poses: Array) -> None:
        """``poses`` (f, 7): the robot anywhere, to know its size."""
        self.robot = robot
        size = float(np.linalg.norm(np.ptp(poses[:, :3], axis=0)))
        self._thin = max(thickness(robot, poses[None]), THICK * size)
        self._fixed = {shape: _Fixed.of(list(self._parts(shape))) for shape in self.SHAPES}
        arcs = arc_bones(robot)
        self._straight = np.array([pair for pair in bones(robot) if pair not in arcs], dtype=np.int64).reshape(-1, 2)
        self._arcs = arcs

    def _parts(self, shape: str) -> Iterator[tuple[int, Array, Array, Array, int]]:
        """Frame, place, turn, scale and contact (-1 unless its radius changes) of every part that is such a shape."""
        level = np.array([1.0, 0.0, 0.0, 0.0])
        for number, contact in enumerate(self.robot.contacts):
            frame = self.robot.frame_index(contact.frame)
            start, end = np.array(contact.start), np.array(contact.end)
            if shape == "sphere" and contact.shape in ("sphere", "capsule"):
                for place in (start, end) if contact.shape == "capsule" else (start,):
                    yield frame, place, level, np.full(3, contact.radius), -1
            if shape == "cylinder" and (bar := _bar(contact, start, end)) is not None:
                a, b, radius = bar
                length = float(np.linalg.norm(b - a))
                yield frame, 0.5 * (a + b), from_z(b - a), np.array([radius, radius, length]), -1
            if shape == "box" and contact.shape == "box":
                yield frame, start, level, np.array(contact.half), -1
            if shape == "rim" and contact.shape == "rim":
                yield frame, start, level, np.full(3, contact.radius), number

    def at(self, now: Snapshot) -> dict[str, Instances]:
        """Instances of every shape that there are."""
        out = {shape: fixed.at(now) for shape, fixed in self._fixed.items() if fixed is not None}
        starts, ends, radii = self._bones(now)
        if len(starts):
            size = np.linalg.norm(ends - starts, axis=-1)
            # all instances are kept, those of no length without thickness: their number must not change
            there = size > POINT
            along = np.where(there[:, None], ends - starts, [0.0, 0.0, 1.0])
            r = np.where(there, radii, 0.0)
            bars = Instances(0.5 * (starts + ends), from_z(along), np.stack([r, r, size], axis=-1))
            out["cylinder"] = _both(out.get("cylinder"), bars)
            # round joints hide the corners between bars
            level = np.tile([1.0, 0.0, 0.0, 0.0], (2 * len(starts), 1))
            knobs = Instances(np.concatenate([starts, ends]), level, np.repeat(np.tile(r, 2)[:, None], 3, axis=1))
            out["sphere"] = _both(out.get("sphere"), knobs)
        return out

    def _bones(self, now: Snapshot) -> tuple[Array, Array, Array]:
        places = now.poses[:, :3]
        starts, ends = [places[self._straight[:, 0]]], [places[self._straight[:, 1]]]
        radii = [np.full(len(self._straight), self._thin)]
        for (a, b), (length, radius) in self._arcs.items():
            points = arc_points(now.poses[a], now.poses[b], length, ARC_PIECES + 1)
            starts.append(points[:-1])
            ends.append(points[1:])
            radii.append(np.full(ARC_PIECES, radius or self._thin))
        return np.concatenate(starts), np.concatenate(ends), np.concatenate(radii)


@dataclass(frozen=True, eq=False)
class _Fixed:
    """Parts of one shape that are fixed on frames."""

    frames: IntArray
    places: Array
    turns: Array
    scales: Array
    contacts: IntArray

    @classmethod
    def of(cls, parts: list[tuple[int, Array, Array, Array, int]]) -> _Fixed | None:
        if not parts:
            return None
        frames, places, turns, scales, contacts = zip(*parts, strict=True)
        return cls(np.array(frames), np.array(places), np.array(turns), np.array(scales), np.array(contacts))

    def at(self, now: Snapshot) -> Instances:
        poses = now.poses[self.frames]
        scales = self.scales
        if (self.contacts >= 0).any():
            scales = np.where(self.contacts[:, None] >= 0, now.radii[self.contacts][:, None], scales)
        return Instances(poses[:, :3] + rotate(poses[:, 3:], self.places), multiply(poses[:, 3:], self.turns), scales)


def _bar(contact: Contact, start: Array, end: Array) -> tuple[Array, Array, float] | None:
    """Ends and radius of the bar that is part of a contact: of a capsule, or what holds a ball beside its frame."""
    if contact.shape == "capsule" and np.linalg.norm(end - start) > POINT:
        return start, end, contact.radius
    if contact.shape == "sphere" and np.linalg.norm(start) > 2.0 * contact.radius:
        return start, np.zeros(3), AXLE * contact.radius
    return None


def _both(a: Instances | None, b: Instances) -> Instances:
    if a is None:
        return b
    return Instances(*(np.concatenate([getattr(a, n), getattr(b, n)]) for n in ("positions", "turns", "scales")))
