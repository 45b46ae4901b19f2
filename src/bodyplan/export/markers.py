"""Robot and ground as visualization_msgs/msg/Marker: what RViz and Foxglove draw on the frames of /tf."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.export.drawing import COLORS, along, arcs_of, bar_radius, bend_of, ground_meshes, links
from bodyplan.export.meshes import SPOKE, TYRE, turning
from bodyplan.motion import Motion
from bodyplan.robot.elements import Contact
from bodyplan.robot.rims import contact_radii
from bodyplan.show.shapes import MOST_SIDE, thickness

CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, TRIANGLE_LIST = 1, 2, 3, 4, 5, 11
#: corners of a wheel, points of an arc
AROUND, ARC_POINTS = 36, 13

Marker = dict[str, Any]


class Markers:
    """Markers of a motion without a stamp (:func:`stamped` gives them one), each in the frame that it moves with.

    ``still``: shapes that do not change; :meth:`moving` those that do, at a sample: arcs, wheels that change their
    radius, links that grow. ``ground``: that of the motion, in ``fixed_frame``.
    """

    def __init__(self, motion: Motion, fixed_frame: str) -> None:
        self.motion, self.robot, self.fixed_frame = motion, motion.robot, fixed_frame
        self.poses = motion.poses().array
        self.thin = thickness(self.robot, self.poses)
        self._links = list(links(self.robot, self.poses))
        shares = np.linspace(0.0, 1.0, ARC_POINTS)
        self._arcs = []
        for arc, before, after, radius in arcs_of(self.robot):
            bend = bend_of(arc, motion)
            points = np.stack([along(arc, bend, share) for share in shares], axis=1)
            self._arcs.append((points, self.robot.frames[before], self.robot.frames[after], radius or self.thin))

    @cached_property
    def still(self) -> list[Marker]:
        out: list[Marker] = []
        for contact in self.robot.contacts:
            if contact.drive is None:
                out += _shape(contact)
            radius = bar_radius(contact)
            if radius is not None:
                out += _capsule(contact.name + " bar", contact.frame, np.zeros(3), contact.start, radius, "link")
        for link in self._links:
            if link.stiff:
                frame = self.robot.frames[link.after]
                out += _capsule(frame + " link", frame, np.zeros(3), link.seen[0], self.thin, "link")
        return _numbered(out)

    @cached_property
    def ground(self) -> list[Marker]:
        out = []
        for role, mesh in ground_meshes(self.motion, self.poses, MOST_SIDE).items():
            corners = mesh.vertices[mesh.faces].reshape(-1, 3)
            out.append(_marker(role, self.fixed_frame, TRIANGLE_LIST, role, (1.0, 1.0, 1.0), points=corners))
        return _numbered(out)

    def moving(self, k: int) -> list[Marker]:
        """Those that change, at sample ``k``."""
        out: list[Marker] = []
        for c, contact in enumerate(self.robot.contacts):
            if contact.drive is not None:
                out.append(_wheel(contact, float(self._radii[k, c])))
        for points, before, after, radius in self._arcs:
            wide = (2.0 * radius, 0.0, 0.0)
            out.append(_marker(after + " arc", before, LINE_STRIP, "capsule", wide, points=points[k]))
        for link in self._links:
            if not link.stiff:
                frame, points = self.robot.frames[link.after], np.stack([np.zeros(3), link.seen[k]])
                out.append(
                    _marker(frame + " link", frame, LINE_LIST, "link", (2.0 * self.thin, 0.0, 0.0), points=points)
                )
        return _numbered(out)

    @cached_property
    def _radii(self) -> Array:
        return contact_radii(self.robot, self.motion.q)


def stamped(markers: list[Marker], stamp: dict[str, int]) -> list[Marker]:
    """The same markers at a time."""
    return [marker | {"header": marker["header"] | {"stamp": stamp}} for marker in markers]


def _shape(contact: Contact) -> list[Marker]:
    if contact.shape == "box":
        size = 2.0 * np.array(contact.half)
        return [_marker(contact.name, contact.frame, CUBE, "box", size, contact.start)]
    if contact.shape == "rim":
        return [_wheel(contact, contact.radius)]
    end = contact.end if contact.shape == "capsule" else contact.start
    return _capsule(contact.name, contact.frame, contact.start, end, contact.radius, contact.shape)


def _capsule(name: str, frame: str, start: ArrayLike, end: ArrayLike, radius: float, color: str) -> list[Marker]:
    """Two balls and what is between them."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    wide, length = 2.0 * radius, float(np.linalg.norm(b - a))
    out = [_marker(name, frame, SPHERE, color, (wide, wide, wide), a)]
    if length > 0.0:
        turn = turning(np.array([0.0, 0.0, 1.0]), b - a)
        out.append(_marker(name, frame, SPHERE, color, (wide, wide, wide), b))
        out.append(_marker(name, frame, CYLINDER, color, (wide, wide, length), 0.5 * (a + b), turn))
    return out


def _wheel(contact: Contact, radius: float) -> Marker:
    """A ring with three spokes, as lines: one sees it turn."""
    wide = 2.0 * TYRE * radius
    angle = 2.0 * np.pi * np.arange(AROUND + 1) / AROUND
    ring = (radius - 0.5 * wide) * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    lines = [np.stack([ring[:-1], ring[1:]], axis=1).reshape(-1, 3)]
    lines += [np.stack([np.zeros(3), ring[k]]) for k in range(0, AROUND, AROUND // 3)]
    scale = (max(wide, SPOKE * radius), 0.0, 0.0)
    return _marker(contact.name, contact.frame, LINE_LIST, "rim", scale, contact.start, points=np.concatenate(lines))


def _marker(
    name: str,
    frame: str,
    kind: int,
    color: str,
    scale: ArrayLike,
    position: ArrayLike = (0.0, 0.0, 0.0),
    quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    points: Array | None = None,
) -> Marker:
    qw, qx, qy, qz = np.asarray(quaternion, dtype=np.float64).tolist()
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": frame},
        "ns": name,
        "id": 0,
        "type": kind,
        "action": 0,
        "pose": {"position": _xyz(position), "orientation": {"x": qx, "y": qy, "z": qz, "w": qw}},
        "scale": _xyz(scale),
        "color": dict(zip("rgba", COLORS[color], strict=True)),
        # it follows its frame at every time, not only at its stamp
        "frame_locked": True,
        "points": [] if points is None else [{"x": x, "y": y, "z": z} for x, y, z in points.tolist()],
    }


def _xyz(values: ArrayLike) -> dict[str, float]:
    return dict(zip("xyz", np.asarray(values, dtype=np.float64).tolist(), strict=True))


def _numbered(markers: list[Marker]) -> list[Marker]:
    """Markers of one name (ns) with numbers that tell them apart."""
    counts: dict[str, int] = {}
    for marker in markers:
        marker["id"] = counts.get(marker["ns"], 0)
        counts[marker["ns"]] = marker["id"] + 1
    return markers
