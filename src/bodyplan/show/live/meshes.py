"""Triangles of unit shapes, of the ground, and where instances of the shapes are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bodyplan.arrays import Array

Faces = NDArray[np.uint32]
Mesh = tuple[Array, Faces]

#: corners around round shapes
ROUND = 20
#: of a unit rim: radius of its tread, and of its three spokes, of the rim's
TREAD, SPOKE = 0.07, 0.045
#: half width of a rim along its axis, of its radius
WIDTH = 0.14


def sphere() -> Mesh:
    """A ball of radius 1."""
    rings = ROUND // 2
    polar, around = np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, ROUND + 1)[:-1]
    p, a = np.meshgrid(polar, around, indexing="ij")
    points = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    return points.reshape(-1, 3), _grid_faces(rings + 1, ROUND, wrapped=True)


def cylinder() -> Mesh:
    """A cylinder of radius 1 about z, from z = -1/2 to 1/2, with ends."""
    around = np.linspace(0.0, 2.0 * np.pi, ROUND + 1)[:-1]
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(ROUND)], axis=-1)
    half = np.array([0.0, 0.0, 0.5])
    down, up = ring - half, ring + half
    # rings of the ends have corners of their own: edges stay sharp
    points = np.concatenate([up, down, up, down, [half, -half]])
    faces = list(_grid_faces(2, ROUND, wrapped=True))
    for i in range(ROUND):
        j = (i + 1) % ROUND
        faces += [(4 * ROUND, 2 * ROUND + i, 2 * ROUND + j), (4 * ROUND + 1, 3 * ROUND + j, 3 * ROUND + i)]
    return points, np.array(faces, dtype=np.uint32)


def box() -> Mesh:
    """A box from -1 to 1 along each axis, with sharp edges."""
    parts = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = sign
            corners[:, (axis + 1) % 3] = np.array([-1.0, 1.0, 1.0, -1.0]) * sign
            corners[:, (axis + 2) % 3] = [-1.0, -1.0, 1.0, 1.0]
            parts.append((corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)))
    return joined(parts)


def rim() -> Mesh:
    """A wheel of radius 1 about z: a tread and three spokes."""
    around, across = np.linspace(0.0, 2.0 * np.pi, 4 * ROUND + 1)[:-1], np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    a, c = np.meshgrid(around, across, indexing="ij")
    reach = 1.0 - TREAD + TREAD * np.cos(c)
    points = np.stack([reach * np.cos(a), reach * np.sin(a), WIDTH * np.sin(c)], axis=-1).reshape(-1, 3)
    faces = _grid_faces(4 * ROUND, 8, wrapped=True, closed=True)
    parts = [(points, faces)]
    for angle in 2.0 * np.pi * np.arange(3) / 3.0:
        bar, sides = box()
        bar = bar * [0.5 * (1.0 - TREAD), SPOKE, 0.5 * WIDTH] + [0.5 * (1.0 - TREAD), 0.0, 0.0]
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        parts.append((bar @ turn.T, sides))
    return joined(parts)


def joined(parts: Sequence[Mesh]) -> Mesh:
    """Several meshes as one."""
    points, faces, count = [], [], 0
    for corners, sides in parts:
        points.append(corners)
        faces.append(sides + count)
        count += len(corners)
    return np.concatenate(points), np.concatenate(faces).astype(np.uint32)


def polygon(corners: Array) -> Mesh:
    """A flat convex polygon."""
    fan = [(0, i, i + 1) for i in range(1, len(corners) - 1)]
    return np.asarray(corners, dtype=np.float64), np.array(fan, dtype=np.uint32)


def field(x: Array, y: Array, z: Array) -> Mesh:
    """A height field z (m, n) over x (n,), y (m,), facing up."""
    gx, gy = np.meshgrid(x, y)
    points = np.stack([gx, gy, z], axis=-1).reshape(-1, 3)
    return points, _grid_faces(len(y), len(x), wrapped=False)[:, ::-1]


def lines(points: Array) -> Array:
    """Segments (k - 1, 2, 3) of a line through points (k, 3)."""
    return np.stack([points[:-1], points[1:]], axis=1)


def field_lines(x: Array, y: Array, z: Array, spacing: float, lift: float) -> Array:
    """Segments (k, 2, 3) of lines on a height field, ``spacing`` m apart and ``lift`` m above it."""
    out = []
    for axis, values in ((0, y), (1, x)):
        wanted = np.arange(np.ceil(values[0] / spacing), np.floor(values[-1] / spacing) + 1.0) * spacing
        for value in wanted:
            upper = int(np.clip(np.searchsorted(values, value), 1, len(values) - 1))
            s = (value - values[upper - 1]) / (values[upper] - values[upper - 1])
            if axis == 0:
                height = (1.0 - s) * z[upper - 1] + s * z[upper]
                out.append(lines(np.stack([x, np.full(len(x), value), height + lift], axis=-1)))
            else:
                height = (1.0 - s) * z[:, upper - 1] + s * z[:, upper]
                out.append(lines(np.stack([np.full(len(y), value), y, height + lift], axis=-1)))
    return np.concatenate(out) if out else np.zeros((0, 2, 3))


def plane_lines(corners: Array, spacing: float, lift: float) -> Array:
    """Segments (k, 2, 3) of lines on an upright-seen rectangle (4, 3) of a plane."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = np.array([low[0], high[0]]), np.array([low[1], high[1]])
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    gx, gy = np.meshgrid(x, y)
    z = corners[0, 2] - ((gx - corners[0, 0]) * normal[0] + (gy - corners[0, 1]) * normal[1]) / normal[2]
    return field_lines(x, y, z, spacing, lift)


def from_z(direction: Array) -> Array:
    """Quaternions (..., 4) wxyz that turn z into ``direction`` (..., 3), of any length above 0."""
    d = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    out = np.stack([1.0 + d[..., 2], -d[..., 1], d[..., 0], np.zeros(d.shape[:-1])], axis=-1)
    down = out[..., 0] < 1e-9
    out[down] = [0.0, 1.0, 0.0, 0.0]
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


def _grid_faces(rows: int, columns: int, *, wrapped: bool, closed: bool = False) -> Faces:
    """Triangles between neighbours of a grid of corners; ``wrapped`` along columns, ``closed`` along rows."""
    i, j = np.meshgrid(
        np.arange(rows if closed else rows - 1), np.arange(columns if wrapped else columns - 1), indexing="ij"
    )
    k, m = (i + 1) % rows, (j + 1) % columns
    a, b, c, d = i * columns + j, i * columns + m, k * columns + m, k * columns + j
    return np.concatenate([np.stack([a, d, c], axis=-1), np.stack([a, c, b], axis=-1)]).reshape(-1, 3).astype(np.uint32)
