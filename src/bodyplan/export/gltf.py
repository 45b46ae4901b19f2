"""Motion as an animated glTF 2.0 file (.glb): the robot's shapes and its ground, for Blender, browsers, slides.

glTF's world has y up: one node above everything turns the house's z-up world into it. Below it every frame of the
robot is a node of that name, moved by its pose in the world; shapes hang on the frames.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cached_property, partial
from importlib.metadata import version

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.export import meshes
from bodyplan.export.glb import Glb
from bodyplan.files import replacing
from bodyplan.ground.base import Ground, Solid
from bodyplan.motion import Motion
from bodyplan.robot.batch import variable
from bodyplan.robot.elements import Arc, Contact
from bodyplan.show.scene import AXLE
from bodyplan.show.shapes import arc_bones, bones, extent, scenery, thickness
from bodyplan.spatial.poses import relative
from bodyplan.spatial.rotations import left_jacobian, multiply, quaternion_exp, rotate

#: z up -> y up: a quarter turn about x, wxyz
Y_UP = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)
#: stiff pieces that an arc is drawn with
PIECES = 8
#: ground around the robot's way, of the size of both
MARGIN = 0.2
#: most samples along a side of a height field
MOST_SIDE = 200
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


def write(motion: Motion, path: str | os.PathLike[str], *, ground: str = "yes") -> None:
    """Write the motion to ``path`` as one animation, "motion", that starts at 0 s and has all its samples.

    ``ground``: "no" leaves out the ground. Raises InputError where samples are too close to each other for single
    precision, MissingExtraError without the extra "gltf".
    """
    if ground not in ("yes", "no"):
        raise InputError(f"ground: must be yes or no, got {ground!r}.")
    with replacing(path, "wb") as file:
        file.write(_Scene(motion, ground == "yes").pack())


class _Scene:
    """A motion being drawn."""

    def __init__(self, motion: Motion, ground: bool) -> None:
        t = np.asarray(motion.t - motion.t[0], dtype=np.float32)
        if np.any(np.diff(t) <= 0.0):
            raise InputError("Motion.t: samples are too close to each other for glTF, which has single precision.")
        self.motion, self.robot = motion, motion.robot
        self.poses = motion.poses().array
        gait = str(motion.gait.get("kind", ""))
        self.glb = Glb(
            f"bodyplan {version('bodyplan')}", {"robot": self.robot.name, "gait": gait, "units": "m, s, rad"}
        )
        self.times = self.glb.times(t)
        self.world = self.glb.node("world", rotation=Y_UP)
        self._materials: dict[str, int] = {}
        self._meshes: dict[tuple[object, ...], int] = {}
        self.frames = [
            self._moving(name, self.world, self.poses[:, i, :3], self.poses[:, i, 3:])
            for i, name in enumerate(self.robot.frames)
        ]
        for contact in self.robot.contacts:
            self._contact(contact)
        self._links()
        if ground:
            self._ground(motion.ground)

    def pack(self) -> bytes:
        return self.glb.pack()

    # --- robot ----------------------------------------------------------------------------------------------

    def _contact(self, contact: Contact) -> None:
        frame = self.frames[self.robot.frame_index(contact.frame)]
        name = f"{contact.name} ({contact.shape})"
        key = (contact.shape, contact.radius, contact.start, contact.end, contact.half)
        mesh = self._mesh(key, contact.shape, partial(meshes.of_contact, contact))
        if contact.drive is not None:
            q = self.motion.q[:, self.robot.joint_index(contact.drive.joint.name)]
            share = contact.drive.radius(q) / contact.radius
            scale = np.stack([share, share, np.ones_like(share)], axis=-1)
            node = self.glb.node(name, frame, mesh=mesh, translation=contact.start, scale=scale[0])
            self.glb.move(node, self.times, scale=scale)
        elif contact.shape == "rim":
            self.glb.node(name, frame, mesh=mesh, translation=contact.start)
        else:
            self.glb.node(name, frame, mesh=mesh)
        away = float(np.linalg.norm(contact.start))
        if contact.shape == "sphere" and away > 2.0 * contact.radius:
            # a ball beside its frame, as a foot is, would hang in the air
            radius = AXLE * contact.radius
            made = partial(meshes.capsule, (0.0, 0.0, 0.0), contact.start, radius)
            bar = self._mesh(("bar", radius, contact.start), "link", made)
            self.glb.node(f"{contact.name} (bar)", frame, mesh=bar)

    def _links(self) -> None:
        """Lines between frames that no capsule hides, and arcs."""
        arcs = arc_bones(self.robot)
        for before, after in bones(self.robot):
            if (before, after) in arcs:
                element = self.robot.elements[after - 1]
                assert isinstance(element, Arc)
                self._arc(element, before, after, arcs[before, after][1] or self.thin)
                continue
            name = f"{self.robot.frames[after]} (link)"
            seen = relative(self.poses[:, after], self.poses[:, before])[:, :3]
            longest = float(np.linalg.norm(seen, axis=1).max())
            if longest <= 1e-6 * self.size:
                continue
            if np.ptp(seen, axis=0).max() <= 1e-9 * self.size:
                made = partial(meshes.capsule, seen[0], np.zeros(3), self.thin)
                mesh = self._mesh(("bone", *np.round(seen[0], 12)), "link", made)
                self.glb.node(name, self.frames[after], mesh=mesh)
                continue
            # one that grows, or turns against the frame it ends in
            length = np.linalg.norm(seen, axis=1)
            scale = np.stack([length, np.ones_like(length), np.ones_like(length)], axis=-1)
            mesh = self._mesh(("rod",), "link", partial(meshes.rod, self.thin))
            turn = meshes.turning(np.array([1.0, 0.0, 0.0]), seen)
            self._moving(name, self.frames[after], np.zeros_like(seen), turn, scale, mesh)

    def _arc(self, arc: Arc, before: int, after: int, radius: float) -> None:
        """Short capsules along an arc, each where the middle of its piece is."""
        column = {name: i for i, name in enumerate(self.robot.joints)}
        pitch, yaw = (variable(v, self.motion.q, column) for v in (arc.pitch, arc.yaw))
        bend = np.stack([np.zeros_like(pitch), pitch, yaw], axis=-1)
        start, half = self.poses[:, before], 0.5 * arc.length / PIECES
        made = partial(meshes.capsule, (-half, 0.0, 0.0), (half, 0.0, 0.0), radius)
        mesh = self._mesh(("arc", half, radius), "capsule", made)
        for k in range(PIECES):
            turned = (k + 0.5) / PIECES * bend
            ahead = (k + 0.5) / PIECES * arc.length * left_jacobian(turned)[..., 0]
            position = start[:, :3] + rotate(start[:, 3:], ahead)
            name = f"{self.robot.frames[after]} (arc {k + 1})"
            self._moving(name, self.world, position, multiply(start[:, 3:], quaternion_exp(turned)), mesh=mesh)

    @cached_property
    def size(self) -> float:
        """Of the robot, m."""
        return float(np.linalg.norm(np.ptp(self.poses[0, :, :3], axis=0))) or 0.1

    @cached_property
    def thin(self) -> float:
        """Radius of links that have none, m."""
        return thickness(self.robot, self.poses)

    # --- ground ---------------------------------------------------------------------------------------------

    def _ground(self, ground: Ground) -> None:
        low, high = extent([self.poses], self.robot)
        margin = MARGIN * float(np.linalg.norm(high - low)) * np.array([1.0, 1.0, 0.0])
        low, high = low - margin, high + margin
        found = scenery(ground, low, high)
        # scenery's fields are for small pictures
        fields = [solid for solid in ground.solids(low, high) if solid.kind == "field"]
        parts: dict[str, list[meshes.Mesh]] = {}
        for corners in found.planes:
            up = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            parts.setdefault("floor", []).append(meshes.polygon(corners, up / np.linalg.norm(up)))
        for face in found.faces:
            parts.setdefault(face.role, []).append(meshes.polygon(face.corners, face.normal))
        for solid in fields:
            parts.setdefault(solid.role, []).append(_field(solid))
        for role, pieces in parts.items():
            mesh = self._mesh(("ground", role), role, partial(meshes.joined, pieces))
            self.glb.node(f"ground ({role})", self.world, mesh=mesh)

    # --- pieces ---------------------------------------------------------------------------------------------

    def _moving(
        self,
        name: str,
        parent: int,
        position: Array,
        quaternion: Array,
        scale: Array | None = None,
        mesh: int | None = None,
    ) -> int:
        node = self.glb.node(
            name,
            parent,
            mesh=mesh,
            translation=position[0],
            rotation=quaternion[0],
            scale=None if scale is None else scale[0],
        )
        self.glb.move(node, self.times, translation=position, rotation=quaternion, scale=scale)
        return node

    def _mesh(self, key: tuple[object, ...], color: str, make: Callable[[], meshes.Mesh]) -> int:
        """A mesh, made once for all that look the same."""
        if key not in self._meshes:
            if color not in self._materials:
                self._materials[color] = self.glb.material(color, COLORS[color])
            made = make()
            self._meshes[key] = self.glb.mesh(
                str(key[0]), made.vertices, made.normals, made.faces, self._materials[color]
            )
        return self._meshes[key]


def _field(solid: Solid) -> meshes.Mesh:
    """A height field, thinned out where it is finer than a picture needs."""
    assert solid.z is not None
    rows, columns = (np.unique(np.linspace(0, n - 1, min(n, MOST_SIDE)).round().astype(int)) for n in solid.z.shape)
    x, y = solid.position[0] + columns * solid.cell[0], solid.position[1] + rows * solid.cell[1]
    return meshes.field(x, y, np.asarray(solid.z[np.ix_(rows, columns)]))
