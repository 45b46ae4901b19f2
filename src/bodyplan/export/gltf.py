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
from bodyplan.export.drawing import COLORS, along, arcs_of, bar_radius, bend_of, ground_meshes, links
from bodyplan.export.glb import Glb
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.robot.elements import Arc, Contact
from bodyplan.show.shapes import thickness
from bodyplan.spatial.rotations import multiply, quaternion_exp, rotate

#: z up -> y up: a quarter turn about x, wxyz
Y_UP = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)
#: stiff pieces that an arc is drawn with
PIECES = 8
#: most samples along a side of a height field
MOST_SIDE = 200


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
        for arc, before, after, radius in arcs_of(self.robot):
            self._arc(arc, before, after, radius or self.thin)
        if ground:
            for role, mesh in ground_meshes(motion, self.poses, MOST_SIDE).items():
                self.glb.node(f"ground ({role})", self.world, mesh=self._stored("ground", role, mesh))

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
        radius = bar_radius(contact)
        if radius is not None:
            made = partial(meshes.capsule, (0.0, 0.0, 0.0), contact.start, radius)
            bar = self._mesh(("bar", radius, contact.start), "link", made)
            self.glb.node(f"{contact.name} (bar)", frame, mesh=bar)

    def _links(self) -> None:
        for link in links(self.robot, self.poses):
            name, frame = f"{self.robot.frames[link.after]} (link)", self.frames[link.after]
            if link.stiff:
                at = link.seen[0]
                made = partial(meshes.capsule, at, np.zeros(3), self.thin)
                self.glb.node(name, frame, mesh=self._mesh(("bone", *np.round(at, 12)), "link", made))
                continue
            # one that grows, or turns against the frame it ends in
            length = np.linalg.norm(link.seen, axis=1)
            scale = np.stack([length, np.ones_like(length), np.ones_like(length)], axis=-1)
            mesh = self._mesh(("rod",), "link", partial(meshes.rod, self.thin))
            turn = meshes.turning(np.array([1.0, 0.0, 0.0]), link.seen)
            self._moving(name, frame, np.zeros_like(link.seen), turn, scale, mesh)

    def _arc(self, arc: Arc, before: int, after: int, radius: float) -> None:
        """Short capsules along an arc, each where the middle of its piece is."""
        bend = bend_of(arc, self.motion)
        start, half = self.poses[:, before], 0.5 * arc.length / PIECES
        made = partial(meshes.capsule, (-half, 0.0, 0.0), (half, 0.0, 0.0), radius)
        mesh = self._mesh(("arc", half, radius), "capsule", made)
        for k in range(PIECES):
            share = (k + 0.5) / PIECES
            position = start[:, :3] + rotate(start[:, 3:], along(arc, bend, share))
            turned = multiply(start[:, 3:], quaternion_exp(share * bend))
            name = f"{self.robot.frames[after]} (arc {k + 1})"
            self._moving(name, self.world, position, turned, mesh=mesh)

    @cached_property
    def thin(self) -> float:
        """Radius of links that have none, m."""
        return thickness(self.robot, self.poses)

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
            self._meshes[key] = self._stored(str(key[0]), color, make())
        return self._meshes[key]

    def _stored(self, name: str, color: str, mesh: meshes.Mesh) -> int:
        if color not in self._materials:
            self._materials[color] = self.glb.material(color, COLORS[color])
        return self.glb.mesh(name, mesh.vertices, mesh.normals, mesh.faces, self._materials[color])
