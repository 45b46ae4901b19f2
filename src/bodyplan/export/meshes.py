"""Triangles of what a robot and its ground look like: capsules, balls, boxes, wheels, faces, height fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import MissingExtraError
from bodyplan.robot.elements import Contact
from bodyplan.spatial.rotations import quaternion_exp, rotate

#: corners around a round shape, and from pole to equator
AROUND, ARCH = 20, 6
#: thickness of a wheel's tyre and of its spokes, of its radius
TYRE, SPOKE = 0.06, 0.05


@dataclass(frozen=True, eq=False)
class Mesh:
    """``vertices`` (v, 3) m, their unit ``normals`` (v, 3), ``faces`` (f, 3), counterclockwise from outside."""

    vertices: Array
    normals: Array
    faces: IntArray


def trimesh() -> Any:
    """The ``trimesh`` module, or MissingExtraError saying how to install it."""
    try:
        import trimesh
    except ImportError as error:
        raise MissingExtraError("trimesh", "gltf", "an animated glTF") from error
    return trimesh


def of_contact(contact: Contact) -> Mesh:
    """The shape of a contact in its frame; a rim about its own centre."""
    if contact.shape == "box":
        return box(contact.start, contact.half)
    if contact.shape == "rim":
        return wheel(contact.radius)
    return capsule(contact.start, contact.end if contact.shape == "capsule" else contact.start, contact.radius)


def capsule(start: ArrayLike, end: ArrayLike, radius: float) -> Mesh:
    """A capsule around the segment between two points (3,) m; a ball where they are one."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    length = float(np.linalg.norm(b - a))
    angle = np.linspace(0.0, 0.5 * np.pi, ARCH + 1)
    cap = radius * np.column_stack([np.sin(angle), np.cos(angle)])
    cap[0, 0] = 0.0
    top = cap + np.array([0.0, length])
    bottom = cap * np.array([1.0, -1.0])
    middle = bottom if length > 0.0 else bottom[:-1]
    found = _turned(np.concatenate([middle, top[::-1]]))
    # exact normals: away from the nearest point of the segment
    foot = np.clip(found.vertices[:, 2:], 0.0, length) * [0.0, 0.0, 1.0]
    out = Mesh(found.vertices, (found.vertices - foot) / radius, found.faces)
    return _placed(out, a, _from_z(b - a))


def box(centre: ArrayLike, half: ArrayLike) -> Mesh:
    """A box of ``half`` sizes (3,) m around a point."""
    made = trimesh().creation.box(extents=2.0 * np.asarray(half, dtype=np.float64))
    return _placed(_faceted(made), np.asarray(centre, dtype=np.float64))


def rod(radius: float) -> Mesh:
    """A round rod of ``radius`` m along x, from 0 to 1: to be scaled to its length."""
    line = np.array([[0.0, 0.0], [radius, 0.0], [radius, 1.0], [0.0, 1.0]])
    made = trimesh().creation.revolve(line, sections=AROUND)
    return _placed(_faceted(made), np.zeros(3), _from_z(np.array([1.0, 0.0, 0.0])))


def wheel(radius: float) -> Mesh:
    """A wheel about z with three spokes, whose tyre is ``radius`` m large at the outside."""
    tyre = TYRE * radius
    angle = np.linspace(0.0, 2.0 * np.pi, 2 * ARCH + 1)
    line = tyre * np.column_stack([np.cos(angle), np.sin(angle)]) + [radius - tyre, 0.0]
    line[-1] = line[0]
    ring = _turned(line, 4 * AROUND)
    centres = ring.vertices * [1.0, 1.0, 0.0]
    centres *= (radius - tyre) / np.linalg.norm(centres, axis=1, keepdims=True)
    parts = [Mesh(ring.vertices, (ring.vertices - centres) / tyre, ring.faces)]
    reach, thin = 0.5 * (radius - tyre), 0.5 * SPOKE * radius
    for k in range(3):
        spoke = box((reach, 0.0, 0.0), (reach, thin, thin))
        parts.append(_placed(spoke, np.zeros(3), quaternion_exp([0.0, 0.0, 2.0 * np.pi * k / 3.0])))
    return joined(parts)


def polygon(corners: Array, normal: ArrayLike) -> Mesh:
    """A flat convex face with ``corners`` (k, 3) m, seen from where its ``normal`` (3,) points to."""
    outward = np.asarray(normal, dtype=np.float64)
    turn = np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ outward
    ring = corners if turn >= 0.0 else corners[::-1]
    fan = np.array([[0, k, k + 1] for k in range(1, len(corners) - 1)])
    return Mesh(ring, np.tile(outward, (len(corners), 1)), fan)


def field(x: Array, y: Array, z: Array) -> Mesh:
    """Heights ``z`` (m, n) m over the grid of ``x`` (n,) and ``y`` (m,), seen from above."""
    slope_y, slope_x = np.gradient(z, y, x)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(z)], axis=-1).reshape(-1, 3)
    xs, ys = np.meshgrid(x, y)
    corner = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    right, above = corner + 1, corner + len(x)
    faces = np.concatenate([np.stack([corner, right, above], -1), np.stack([right, above + 1, above], -1)])
    vertices = np.stack([xs, ys, z], axis=-1).reshape(-1, 3)
    return Mesh(vertices, normals / np.linalg.norm(normals, axis=1, keepdims=True), faces)


def joined(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, first[:-1], strict=True)]),
    )


def _turned(line: Array, around: int = AROUND) -> Mesh:
    """A line of points (radius, height) turned about z."""
    made = trimesh().creation.revolve(line, sections=around)
    return Mesh(np.array(made.vertices), np.array(made.vertex_normals), np.array(made.faces, dtype=np.int64))


def _faceted(made: Any) -> Mesh:
    """Flat faces: every triangle with corners of its own."""
    corners = np.array(made.triangles).reshape(-1, 3)
    return Mesh(corners, np.repeat(made.face_normals, 3, axis=0), np.arange(len(corners)).reshape(-1, 3))


def _placed(mesh: Mesh, position: Array, quaternion: ArrayLike = (1.0, 0.0, 0.0, 0.0)) -> Mesh:
    return Mesh(position + rotate(quaternion, mesh.vertices), rotate(quaternion, mesh.normals), mesh.faces)


def _from_z(direction: Array) -> Array:
    """The shortest rotation (4,) that turns z towards ``direction`` (3,)."""
    return turning(np.array([0.0, 0.0, 1.0]), direction)


def turning(start: Array, direction: Array) -> Array:
    """The shortest rotations (..., 4) that turn the unit vector ``start`` (3,) towards ``direction`` (..., 3); none
    where it has no length."""
    size = np.linalg.norm(direction, axis=-1, keepdims=True)
    to = np.where(size > 0.0, direction / np.where(size > 0.0, size, 1.0), start)
    cosine = np.sum(start * to, axis=-1, keepdims=True)
    axis = np.cross(start, to)
    # opposite: half a turn about any axis across
    across = np.cross(start, np.roll(start, 1))
    half = np.concatenate([1.0 + cosine, axis], axis=-1)
    back = np.concatenate([np.zeros_like(cosine), np.broadcast_to(across, axis.shape)], axis=-1)
    out = np.where(1.0 + cosine > 1e-12, half, back)
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))
