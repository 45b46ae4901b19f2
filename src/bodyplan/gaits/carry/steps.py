"""The nearest place of a floor in steps to a wheel's centre, in the wheel's plane: exact, piece by piece.

In the plane of a wheel (:mod:`planes`) a tread z = z_i is the line w = (z_i - c_z)/up_z between two steps, and a face
at x_i the line s ahead_x + w up_x = x_i - c_x between two levels. The nearest point of each piece has a closed form;
the nearest of all pieces is the contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.terrain import Steps

#: m: two contacts whose places are nearer to each other are one
APART = 1e-9
#: relative difference of two distances that count as the same
TWICE = 1e-9
#: pairs of wheels and pieces looked at in one go
CHUNK = 1_000_000


class Nearest(NamedTuple):
    """Of n wheels: the contact ``s``, ``w`` (n,) m, the ground's ``normal`` there (n, 3), whether it is an ``edge``
    (n,), and ``other_s``, ``other_w`` (n,) of another contact as near, nan where there is none."""

    s: Array
    w: Array
    normal: Array
    edge: BoolArray
    other_s: Array
    other_w: Array


def nearest(ground: Steps, planes: Planes) -> Nearest:
    """The nearest places of the floor, for wheels whose centres are above it."""
    pieces = 2 * len(ground.xs) + 1
    share = max(1, CHUNK // pieces)
    parts = [
        _nearest(ground, planes.take(np.arange(k, min(k + share, len(planes))))) for k in range(0, len(planes), share)
    ]
    return Nearest(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _nearest(ground: Steps, planes: Planes) -> Nearest:
    treads, faces = _treads(ground, planes), _faces(ground, planes)
    s, w, edge = (np.concatenate([a, b], axis=1) for a, b in zip(treads, faces, strict=True))
    distance = np.hypot(s, w)
    rows, best = np.arange(len(planes)), distance.argmin(axis=1)
    k = len(ground.zs)
    normal = np.where((best < k)[:, None], [0.0, 0.0, 1.0], _outward(ground, np.maximum(best - k, 0)))
    at_s, at_w = s[rows, best], w[rows, best]
    same = distance <= distance[rows, best][:, None] * (1.0 + TWICE)
    other = same & (np.hypot(s - at_s[:, None], w - at_w[:, None]) > APART)
    twin = other.argmax(axis=1)
    twice = other.any(axis=1)
    return Nearest(
        at_s,
        at_w,
        normal,
        edge[rows, best],
        np.where(twice, s[rows, twin], np.nan),
        np.where(twice, w[rows, twin], np.nan),
    )


def _treads(ground: Steps, planes: Planes) -> tuple[Array, Array, BoolArray]:
    """s, w (n, k + 1) of the nearest points of the treads and whether they are at a step; inf where a wheel's plane has
    none of a tread."""
    w = (ground.zs - planes.centre[:, 2:]) / planes.up[:, 2:]
    ends = np.concatenate([[-np.inf], ground.xs, [np.inf]])
    here = planes.centre[:, :1] + w * planes.up[:, :1]
    along = planes.ahead[:, :1]
    with np.errstate(all="ignore"):
        ways = np.sort([(ends[:-1] - here) / along, (ends[1:] - here) / along], axis=0)
        s = np.clip(0.0, ways[0], ways[1])
    # a plane along y sees a tread all the way, or not at all
    beside = np.broadcast_to(along == 0.0, w.shape)
    seen = (here >= ends[:-1]) & (here <= ends[1:])
    s = np.where(beside, np.where(seen, 0.0, np.inf), s)
    return s, np.where(np.isfinite(s), w, np.inf), np.asarray((s != 0.0) & np.isfinite(s))


def _faces(ground: Steps, planes: Planes) -> tuple[Array, Array, BoolArray]:
    """s, w (n, k) of the nearest points of the faces and whether they are at an edge; inf where a plane has none."""
    low, high = (f(ground.zs[:-1], ground.zs[1:]) for f in (np.minimum, np.maximum))
    x = ground.xs - planes.centre[:, :1]
    a, b = planes.ahead[:, :1], planes.up[:, :1]
    square = a * a + b * b
    with np.errstate(all="ignore"):
        w = b * x / square
        bottom, top = ((z - planes.centre[:, 2:]) / planes.up[:, 2:] for z in (low, high))
        clipped = np.clip(w, bottom, top)
        # across a plane that leans only, a face is a level line, and s is free
        s = np.where(a != 0.0, (x - b * clipped) / a, np.where((w >= bottom) & (w <= top), 0.0, np.inf))
    s = np.where(np.isfinite(s), s, np.inf)
    return s, np.where(np.isfinite(s), clipped, np.inf), np.asarray((clipped != w) & np.isfinite(s))


def _outward(ground: Steps, face: IntArray) -> Array:
    """Unit normals (n, 3) of faces, towards their lower side."""
    if not len(ground.xs):
        return np.zeros((len(face), 3))
    out = np.zeros((len(face), 3))
    out[:, 0] = np.where(ground.zs[:-1] < ground.zs[1:], -1.0, 1.0)[face]
    return out
