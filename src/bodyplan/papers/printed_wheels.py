"""What paper *wheels* prints of contacts: its chain of transforms, and its normal with the contacts that follow."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.spatial import matrix_from_quaternion

LX, LY = 0.6, 0.6
CENTRES = {"fr": (LX, -LY, 0.0), "fl": (LX, LY, 0.0), "r": (-LX, 0.0, 0.0)}
LINK, RUBBER, COS_30 = 0.3, 0.02, np.cos(np.pi / 6.0)


def normal_as_printed(gradient: Array) -> Array:
    """(3): (..., 3), not yet a unit vector; nan where the gradient (..., 2) vanishes."""
    with np.errstate(invalid="ignore"):
        flat = gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
    return np.concatenate([-flat, np.ones((*flat.shape[:-1], 1))], axis=-1)


def contact_by_transforms(name: str, base: Array, phi: Array, radius: Array) -> Array:
    """(7)-(11): contacts (T, 3) of a wheel from poses (T, 7), contact angles and radii (T,)."""
    left = name == "fl"
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) if left else np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    angle = -phi if left else phi
    c, s, zero, one = np.cos(angle), np.sin(angle), 0.0 * phi, 1.0 + 0.0 * phi
    Tb = np.stack([np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.stack([zero, zero, one], -1)], -2)
    arm = np.stack([zero, radius if left else -radius, zero], -1)
    in_body = np.array(CENTRES[name]) + np.einsum("ij,njk,nk->ni", turn, Tb, arm)
    R = matrix_from_quaternion(base[:, 3:])
    return np.asarray(base[:, :3] + np.einsum("nij,nj->ni", R, in_body))


def with_the_printed_normal(motion: Motion, ground: Ground) -> dict[str, float]:
    """(12), (14) solved with the normal of (3) along a motion, from our contacts on: the ``smallest`` and ``largest``
    adjusting angle (rad), and how deep (``depth`` m) those rims are in the ground."""
    base = motion.base[::2]
    R = matrix_from_quaternion(base[:, 3:])
    angles, depth = [], 0.0
    for place in CENTRES.values():
        centre = base[:, :3] + np.einsum("nij,j->ni", R, np.array(place))
        x = np.stack([np.zeros(len(base)), centre[:, 2] - ground.height(centre[:, :2])], axis=-1)
        for _ in range(60):
            step = _newton(x, centre, R, ground)
            x = x + np.clip(step, -0.1, 0.1)
        off = np.abs(_system(x, centre, R, ground)).max(axis=-1)
        radius = x[off < 1e-8, 1]
        cosine = (radius - RUBBER) / (LINK * COS_30)
        angles.append(2.0 * np.arccos(cosine[(cosine >= 0.0) & (cosine <= 1.0)]))
        turn = np.linspace(-np.pi, np.pi, 181)
        for k in np.flatnonzero(off < 1e-8)[::10]:
            rim = centre[k] + x[k, 1] * (np.sin(turn)[:, None] * R[k, :, 0] - np.cos(turn)[:, None] * R[k, :, 2])
            depth = max(depth, float((ground.height(rim[:, :2]) - rim[:, 2]).max()))
    every = np.concatenate(angles)
    return {"smallest": float(every.min()), "largest": float(every.max()), "depth": depth}


def _system(x: Array, centre: Array, R: Array, ground: Ground) -> Array:
    """(n, 2): height of the contact above the ground, and the normal's component along the rim."""
    sine, cosine = np.sin(x[:, :1]), np.cos(x[:, :1])
    point = centre + x[:, 1:] * (sine * R[:, :, 0] - cosine * R[:, :, 2])
    ahead = cosine * R[:, :, 0] + sine * R[:, :, 2]
    normal = normal_as_printed(ground.gradient(point[:, :2]))
    return np.stack([point[:, 2] - ground.height(point[:, :2]), np.sum(normal * ahead, axis=-1)], axis=-1)


def _newton(x: Array, centre: Array, R: Array, ground: Ground) -> Array:
    h = 1e-7
    f = _system(x, centre, R, ground)
    columns = [(_system(x + h * e, centre, R, ground) - f) / h for e in np.eye(2)]
    J = np.stack(columns, axis=-1)
    return np.asarray(-np.einsum("nij,nj->ni", np.linalg.pinv(J), f))
