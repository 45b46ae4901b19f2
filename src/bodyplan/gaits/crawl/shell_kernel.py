"""Kernels of a robot's shapes: where they are, and which two of them come nearest to each other."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.spatial.segments import apart, from_box


@njit(cache=True, nogil=True)
def placed(poses: Array, frames: IntArray, local: Array, out: Array) -> None:
    """World points ``out`` (S, c, p, 3) of points ``local`` (c, p, 3) in ``frames`` (c,) with ``poses`` (S, F, 7)."""
    for s in range(len(out)):
        for c in range(len(frames)):
            at = poses[s, frames[c]]
            for p in range(local.shape[1]):
                _moved(at, local[c, p], out[s, c, p])


@njit(cache=True, nogil=True)
def _moved(at: Array, v: Array, out: Array) -> None:
    """The point ``v`` (3,) of a frame with pose ``at`` (7,), in the world."""
    w, x, y, z = at[3], at[4], at[5], at[6]
    a, b, c = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    out[0] = at[0] + v[0] + w * a + y * c - z * b
    out[1] = at[1] + v[1] + w * b + z * a - x * c
    out[2] = at[2] + v[2] + w * c + x * b - y * a


@njit(cache=True, nogil=True)
def nearest_slim(ends: Array, radii: Array, pairs: IntArray, most: float) -> tuple[float, int, int]:
    """The smallest gap m below ``most`` m of ``pairs`` (n, 2) of capsules with ``ends`` (S, c, 2, 3) and ``radii``
    (c,), which pair that is and in which sample; ``most`` where no gap is smaller."""
    best, which, when = most, 0, 0
    for k in range(len(pairs)):
        i, j = pairs[k]
        for s in range(len(ends)):
            p, q = ends[s, i], ends[s, j]
            touch = radii[i] + radii[j]
            # balls around them are nearer than they are
            if _between(p, q) - _reach(p) - _reach(q) - touch >= best:
                continue
            gap = apart(p, q) - touch
            if gap < best:
                best, which, when = gap, k, s
    return best, which, when


@njit(cache=True, nogil=True)
def nearest_to_box(
    poses: Array, middle: Array, half: Array, ends: Array, radii: Array, slim: IntArray, most: float
) -> tuple[float, int, int]:
    """The smallest gap m below ``most`` m of a box, with ``half`` sizes (3,) around ``middle`` (3,) in a frame with
    ``poses`` (S, 7), to the ``slim`` (k,) among capsules as in :func:`nearest_slim`, which of these that is and in
    which sample."""
    best, which, when = most, 0, 0
    local = np.empty((2, 3))
    back = np.empty(7)
    back[:3] = 0.0
    corner = math.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2)
    centre, away = np.empty((2, 3)), np.empty(3)
    for k in range(len(slim)):
        c = slim[k]
        for s in range(len(ends)):
            _moved(poses[s], middle, centre[0])
            centre[1] = centre[0]
            if _between(ends[s, c], centre) - _reach(ends[s, c]) - corner - radii[c] >= best:
                continue
            back[3] = poses[s, 3]
            back[4:] = -poses[s, 4:]
            for p in range(2):
                for i in range(3):
                    away[i] = ends[s, c, p, i] - poses[s, i]
                _moved(back, away, local[p])
                for i in range(3):
                    local[p, i] -= middle[i]
            gap = from_box(local, half) - radii[c]
            if gap < best:
                best, which, when = gap, k, s
    return best, which, when


@njit(cache=True, nogil=True)
def last_moved(points: Array, out: IntArray) -> None:
    """Of parts with ``points`` (S, c, d): since which sample ``out`` (S, c) each has been where it is."""
    for s in range(len(points)):
        for c in range(points.shape[1]):
            out[s, c] = s
            if s > 0:
                for i in range(points.shape[2]):
                    if points[s, c, i] != points[s - 1, c, i]:
                        break
                else:
                    out[s, c] = out[s - 1, c]


@njit(cache=True, nogil=True)
def _between(p: Array, q: Array) -> float:
    """Distance of the middles of segments (2, 3)."""
    x, y = p[0, 0] + p[1, 0] - q[0, 0] - q[1, 0], p[0, 1] + p[1, 1] - q[0, 1] - q[1, 1]
    z = p[0, 2] + p[1, 2] - q[0, 2] - q[1, 2]
    return 0.5 * math.sqrt(x * x + y * y + z * z)


@njit(cache=True, nogil=True)
def _reach(p: Array) -> float:
    """Half the length of a segment (2, 3)."""
    x, y, z = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    return 0.5 * math.sqrt(x * x + y * y + z * z)
