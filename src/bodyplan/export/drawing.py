"""What of a motion is drawn, whatever draws it: colours, links between frames, arcs, the ground around the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.export.meshes import Mesh, field, joined, polygon
from bodyplan.ground.base import Solid
from bodyplan.motion import Motion
from bodyplan.robot.batch import variable
from bodyplan.robot.elements import Arc, Contact
from bodyplan.robot.model import Robot
from bodyplan.show.scene import AXLE
from bodyplan.show.shapes import arc_bones, bones, extent, scenery
from bodyplan.spatial.poses import relative
from bodyplan.spatial.rotations import left_jacobian

#: red, green, blue (linear), opacity
COLORS = {
    "capsule": (0.05, 0.24, 0.36, 1.0),
    "box": (0.05, 0.24, 0.36, 1.0),
    "sphere": (0.72, 0.24, 0.06, 1.0),
    "rim": (0.03, 0.03, 0.035, 1.0),
    "link": (0.33, 0.36, 0.4, 1.0),
    "floor": (0.5, 0.47, 0.42, 1.0),
    "wall": (0.55, 0.55, 0.58, 1.0),
    "ceiling": (0.6, 0.66, 0.75, 0.35),
}
#: ground around the robot's way, of the size of both
MARGIN = 0.2


@dataclass(frozen=True, eq=False)
class Link:
    """A line between frames: ``after`` is the index of the later one, ``seen`` (T, 3) m where the earlier one's origin
    is seen from it, ``stiff`` whether that stays."""

    after: int
    seen: Array
    stiff: bool


def size_of(poses: Array) -> float:
    """Of a robot whose frames have ``poses`` (T, F, 7), m."""
    return float(np.linalg.norm(np.ptp(poses[0, :, :3], axis=0))) or 0.1


def links(robot: Robot, poses: Array) -> Iterator[Link]:
    """Links that no capsule hides, of a robot whose frames have ``poses`` (T, F, 7); none that has no length."""
    arcs, size = arc_bones(robot), size_of(poses)
    for before, after in bones(robot):
        seen = relative(poses[:, after], poses[:, before])[:, :3]
        if (before, after) not in arcs and float(np.linalg.norm(seen, axis=1).max()) > 1e-6 * size:
            yield Link(after, seen, bool(np.ptp(seen, axis=0).max() <= 1e-9 * size))


def arcs_of(robot: Robot) -> Iterator[tuple[Arc, int, int, float]]:
    """(arc, frame before, frame after, radius m or 0) of every arc."""
    for (before, after), (_, radius) in arc_bones(robot).items():
        element = robot.elements[after - 1]
        assert isinstance(element, Arc)
        yield element, before, after, radius


def bend_of(arc: Arc, motion: Motion) -> Array:
    """(T, 3) rad: the rotation vector that an arc turns by, from its start to its end."""
    column = {name: i for i, name in enumerate(motion.joints)}
    pitch, yaw = (variable(v, motion.q, column) for v in (arc.pitch, arc.yaw))
    return np.stack([np.zeros_like(pitch), pitch, yaw], axis=-1)


def along(arc: Arc, bend: Array, share: float) -> Array:
    """(T, 3) m: the point of an arc at a ``share`` of its length, seen from its start."""
    return np.asarray(share * arc.length * left_jacobian(share * bend)[..., 0])


def bar_radius(contact: Contact) -> float | None:
    """Radius m of the bar that joins a ball beside its frame to it: a foot would hang in the air; None for others."""
    away = float(np.linalg.norm(contact.start))
    return AXLE * contact.radius if contact.shape == "sphere" and away > 2.0 * contact.radius else None


def ground_meshes(motion: Motion, poses: Array, most_side: int) -> dict[str, Mesh]:
    """Floor, walls and ceiling around the way of the robot, by role; at most ``most_side`` samples along a side of a
    height field."""
    low, high = extent([poses], motion.robot)
    margin = MARGIN * float(np.linalg.norm(high - low)) * np.array([1.0, 1.0, 0.0])
    low, high = low - margin, high + margin
    found = scenery(motion.ground, low, high)
    # scenery's fields are for small pictures
    fields = [solid for solid in motion.ground.solids(low, high) if solid.kind == "field"]
    parts: dict[str, list[Mesh]] = {}
    for corners in found.planes:
        up = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        parts.setdefault("floor", []).append(polygon(corners, up / np.linalg.norm(up)))
    for face in found.faces:
        parts.setdefault(face.role, []).append(polygon(face.corners, face.normal))
    for solid in fields:
        parts.setdefault(solid.role, []).append(_field(solid, most_side))
    return {role: joined(pieces) for role, pieces in parts.items()}


def _field(solid: Solid, most_side: int) -> Mesh:
    """A height field, thinned out where it is finer than a picture needs."""
    assert solid.z is not None
    rows, columns = (np.unique(np.linspace(0, n - 1, min(n, most_side)).round().astype(int)) for n in solid.z.shape)
    x, y = solid.position[0] + columns * solid.cell[0], solid.position[1] + rows * solid.cell[1]
    return field(x, y, np.asarray(solid.z[np.ix_(rows, columns)]))
