"""A robot and its ground as drawable shapes, for the replay and for flat figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.ground.base import Ground, Solid
from bodyplan.robot.elements import Arc, Contact
from bodyplan.robot.model import Robot
from bodyplan.spatial.rotations import conjugate, multiply, quaternion_log, rotate

#: corners of a unit box, and its six faces by corner with their outward axis and sign
CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
FACES = (
    ((0, 1, 3, 2), 0, -1.0),
    ((4, 6, 7, 5), 0, 1.0),
    ((0, 4, 5, 1), 1, -1.0),
    ((2, 3, 7, 6), 1, 1.0),
    ((0, 2, 6, 4), 2, -1.0),
    ((1, 5, 7, 3), 2, 1.0),
)
#: most samples along a side of a height field in a picture
MOST_SIDE = 56
#: thickness of a ceiling in a picture, of the height of what is under it
SLAB = 0.35


def bones(robot: Robot) -> list[tuple[int, int]]:
    """Pairs of frames (before, after) to join by a line: arcs, and those whose later frame carries no capsule, which
    would hide a straight line."""
    capsules = {contact.frame for contact in robot.contacts if contact.shape == "capsule"}
    out = []
    for chain in robot.chains:
        before = robot.frame_index(chain.parent)
        for i, element in enumerate(chain.elements):
            name = chain.frame_name(i)
            after = robot.frame_index(name)
            if isinstance(element, Arc) or name not in capsules:
                out.append((before, after))
            before = after
    return out


def arc_bones(robot: Robot) -> dict[tuple[int, int], tuple[float, float]]:
    """Of the :func:`bones` those that are arcs of constant curvature: length and radius m; the radius is that of the
    round shape on the frame, 0 where there is none."""
    thick = {contact.frame: contact.radius for contact in robot.contacts if contact.shape in ("capsule", "sphere")}
    joined = set(bones(robot))
    out = {}
    for chain in robot.chains:
        before = robot.frame_index(chain.parent)
        for i, element in enumerate(chain.elements):
            name = chain.frame_name(i)
            after = robot.frame_index(name)
            if isinstance(element, Arc) and (before, after) in joined:
                out[before, after] = (element.length, thick.get(name, 0.0))
            before = after
    return out


def arc_points(start: Array, end: Array, length: float, count: int = 13) -> Array:
    """Points (count, 3) m of an arc of constant curvature and ``length`` m between two poses (7,), which leaves along x
    of the first; its bend is what turns the first into the second (less than a full turn)."""
    turn = quaternion_log(multiply(conjugate(start[3:]), end[3:]))
    bend = float(np.hypot(turn[1], turn[2]))
    u = np.linspace(0.0, 1.0, count)
    # x = L sin(u b) / b and the sagitta L (1 - cos(u b)) / b, both regular at b = 0
    ahead = length * u * np.sinc(u * bend / np.pi)
    aside = length * u * np.sin(0.5 * u * bend) * np.sinc(0.5 * u * bend / np.pi)
    toward = np.array([0.0, turn[2], -turn[1]]) / bend if bend > 1e-12 else np.zeros(3)
    local = ahead[:, None] * np.array([1.0, 0.0, 0.0]) + aside[:, None] * toward
    return np.asarray(start[:3] + rotate(start[3:], local))


def ribbon(points: Array, radius: float) -> Array:
    """Polygon (2k, 2) m around a line of points (k, 2), ``radius`` m to either side."""
    along = np.gradient(points, axis=0)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    along = along / np.where(size > 0.0, size, 1.0)
    aside = radius * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    return np.concatenate([points + aside, (points - aside)[::-1]])


def thickness(robot: Robot, poses: Array) -> float:
    """Radius in m for the bones: a share of the robot's size, and of the contacts' radii where there are
    any."""
    size = float(np.linalg.norm(np.ptp(poses[..., :3].reshape(-1, poses.shape[-2], 3)[0], axis=0)))
    radii = [contact.radius for contact in robot.contacts if contact.radius > 0.0]
    return min([0.015 * size, *(0.6 * r for r in radii)]) if size > 0.0 else 0.01


def extent(poses: Sequence[Array], robot: Robot) -> tuple[Array, Array]:
    """Corners (3,), (3,) m of a box around robots whose frames have poses (..., f, 7), contacts included."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for track in poses:
        reached = [(track[..., :3], 0.0)]
        for c in robot.contacts:
            pose = track[..., robot.frame_index(c.frame), :]
            for end in {c.start, c.end if c.shape == "capsule" else c.start}:
                at = pose[..., :3] + rotate(pose[..., 3:], np.array(end))
                reached.append((at, c.radius + float(np.linalg.norm(c.half))))
        for points, reach in reached:
            flat = points.reshape(-1, 3)
            low = np.minimum(low, flat.min(axis=0) - reach)
            high = np.maximum(high, flat.max(axis=0) + reach)
    margin = 0.01 * float(np.linalg.norm(high - low)) + 1e-3
    return low - margin, high + margin


def outline(contact: Contact, pose: Array, axes: tuple[int, int]) -> list[Array]:
    """Polygons (k, 2) m whose union is a contact's shape seen along the third axis; ``pose`` (7,) of its
    frame."""
    flat = list(axes)
    place = pose[:3] + rotate(pose[3:], np.array(contact.start))
    if contact.shape == "box":
        corners = (place + rotate(pose[3:], CORNERS * np.array(contact.half)))[:, flat]
        return [corners[list(face)] for face, _, _ in FACES]
    angle = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    if contact.shape == "rim":
        ring = np.concatenate([circle, np.zeros((len(circle), 1))], axis=1)
        return [(place + rotate(pose[3:], contact.radius * ring))[:, flat]]
    last = contact.end if contact.shape == "capsule" else contact.start
    a, b = place[flat], (pose[:3] + rotate(pose[3:], np.array(last)))[flat]
    along = b - a
    length = float(np.hypot(*along))
    if length < 1e-12:
        return [a + contact.radius * circle]
    turn = np.arctan2(along[1], along[0]) + 0.5 * np.pi + np.linspace(0.0, np.pi, 13)
    cap = contact.radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return [np.concatenate([a + cap, b - cap])]


@dataclass(frozen=True, eq=False)
class Face:
    """A flat piece of ground: corners (k, 3) m, outward normal (3,), the number of its box."""

    corners: Array
    normal: Array
    box: int
    role: str


@dataclass(frozen=True, eq=False)
class Scenery:
    """The ground in a box for drawing: planes as quadrilaterals, boxes face by face, fields as grids
    (x (n,), y (m,), z (m, n))."""

    planes: tuple[Array, ...]
    faces: tuple[Face, ...]
    fields: tuple[tuple[Array, Array, Array], ...]


def scenery(ground: Ground, low: Array, high: Array) -> Scenery:
    """The ground around a robot that stays between the corners ``low`` and ``high`` (3,) m: planes reach out
    widely, boxes are cut off near the robot."""
    size = float(np.linalg.norm(high - low))
    wide, near = (np.array([share, share, 0.0]) * size for share in (0.2, 0.03))
    up = np.array([0.0, 0.0, 0.25 * size])
    solids = ground.solids(low - wide - 0.1 * up, high + wide + up)
    planes = [plane for s in solids if s.kind == "plane" for plane in _quadrilateral(s, low - wide, high + wide)]
    below, above = low - near - 0.1 * up, high + near + up
    # what of a wall is under a plane floor would only be drawn over it
    foot = np.maximum(below, [-np.inf, -np.inf, min((float(p[:, 2].min()) for p in planes), default=-np.inf)])
    boxes = [solid for solid in solids if solid.kind == "box"]
    undersides = [s.position[2] - s.half[2] for s in boxes if s.role == "ceiling"]
    # a thick ceiling would be most of the picture
    lid = np.array([*above[:2], max([float(high[2]), *undersides]) + SLAB * float(high[2] - low[2])])
    faces = [
        face
        for number, solid in enumerate(boxes)
        for face in _box(
            solid, number, foot if solid.role == "wall" else below, lid if solid.role == "ceiling" else above
        )
    ]
    fields = [_grid(s) for s in solids if s.kind == "field" and s.z is not None]
    return Scenery(tuple(planes), tuple(faces), tuple(fields))


def _quadrilateral(solid: Solid, low: Array, high: Array) -> list[Array]:
    normal = rotate(np.array(solid.quaternion), np.array([0.0, 0.0, 1.0]))
    if abs(normal[2]) < 1e-6:
        return []
    corners = np.array([[low[0], low[1], 0.0], [high[0], low[1], 0.0], [high[0], high[1], 0.0], [low[0], high[1], 0.0]])
    at = np.array(solid.position)
    corners[:, 2] = at[2] - ((corners[:, :2] - at[:2]) @ normal[:2]) / normal[2]
    return [corners]


def _box(solid: Solid, number: int, low: Array, high: Array) -> list[Face]:
    at, half, turn = (np.array(v) for v in (solid.position, solid.half, solid.quaternion))
    if np.allclose(turn, (1.0, 0.0, 0.0, 0.0)):
        a, b = np.maximum(at - half, low), np.minimum(at + half, high)
        if np.any(a >= b):
            return []
        at, half = 0.5 * (a + b), 0.5 * (b - a)
    corners = at + rotate(turn, CORNERS * half)
    axes = rotate(turn, np.eye(3))
    return [Face(corners[list(face)], sign * axes[axis], number, solid.role) for face, axis, sign in FACES]


def _grid(solid: Solid) -> tuple[Array, Array, Array]:
    assert solid.z is not None
    rows, columns = (np.unique(np.linspace(0, n - 1, min(n, MOST_SIDE)).round().astype(int)) for n in solid.z.shape)
    x, y = solid.position[0] + columns * solid.cell[0], solid.position[1] + rows * solid.cell[1]
    return x, y, np.asarray(solid.z[np.ix_(rows, columns)])
