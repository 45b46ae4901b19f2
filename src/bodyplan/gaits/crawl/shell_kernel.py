"""Kernels of a robot's shapes: where they are, and which two of them come nearest to each other."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.kernels import lean
from bodyplan.spatial.segments import apart, from_box


@njit(cache=True, nogil=True)
def placed(poses: Array, frames: IntArray, local: Array, out: Array) -> None:
    """World points ``out`` (S, c, p, 3) of points ``local`` (c, p, 3) in ``frames`` (c,) with ``poses`` (S, F, 7)."""
    for s in range(len(out)):
        for c in range(len(frames)):
            at = poses[s, frames[c]]
            for p in range(local.shape[1]):
                _moved(at, local[c, p], out[s, c, p])


@lean
def _moved(at: Array, v: Array, out: Array) -> None:
    """The point ``v`` (3,) of a frame with pose ``at`` (7,), in the world."""
    w, x, y, z = at[3], at[4], at[5], at[6]
    a, b, c = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    out[0] = at[0] + v[0] + w * a + y * c - z * b
    out[1] = at[1] + v[1] + w * b + z * a - x * c
    out[2] = at[2] + v[2] + w * c + x * b - y * a


@njit(cache=True, nogil=True)
def nearest_slim(ends: Array, radii: Array, balls: Array, pairs: IntArray, most: float) -> tuple[float, int, int]:
    """The smallest gap m below ``most`` m of ``pairs`` (n, 2) of capsules with ``ends`` (S, c, 2, 3) and ``radii``
    (c,) in their ``balls`` (S, c, 4), which pair that is and in which sample; ``most`` where no gap is smaller."""
    best, which, when = most, 0, 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        for s in range(len(ends)):
            # balls around them are nearer than they are
            if between(balls, s, i, j) >= best:
                continue
            gap = apart(ends[s, i], ends[s, j]) - (radii[i] + radii[j])
            if gap < best:
                best, which, when = gap, k, s
    return best, which, when


@njit(cache=True, nogil=True)
def nearest_to_box(
    poses: Array, middle: Array, half: Array, ends: Array, radii: Array, balls: Array, slim: IntArray, most: float
) -> tuple[float, int, int]:
    """The smallest gap m below ``most`` m of a box, with ``half`` sizes (3,) around ``middle`` (3,) in a frame with
    ``poses`` (S, 7), to the ``slim`` (k,) among capsules as in :func:`nearest_slim`, which of these that is and in
    which sample."""
    best, which, when = most, 0, 0
    local, back, away = np.empty((2, 3)), np.zeros(7), np.empty(3)
    corner = math.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2)
    centres = np.empty((len(poses), 3))
    for s in range(len(poses)):
        _moved(poses[s], middle, centres[s])
    for k in range(len(slim)):
        c = slim[k]
        for s in range(len(ends)):
            x, y = balls[s, c, 0] - centres[s, 0], balls[s, c, 1] - centres[s, 1]
            z = balls[s, c, 2] - centres[s, 2]
            if math.sqrt(x * x + y * y + z * z) - balls[s, c, 3] - corner >= best:
                continue
            back[3] = poses[s, 3]
            for i in range(3):
                back[4 + i] = -poses[s, 4 + i]
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
def around(ends: Array, radii: Array, balls: Array) -> None:
    """The ``balls`` (S, c, 4), middle and radius, around capsules with ``ends`` (S, c, 2, 3) and ``radii`` (c,)."""
    for s in range(len(ends)):
        for c in range(len(radii)):
            square = 0.0
            for i in range(3):
                a, b = ends[s, c, 0, i], ends[s, c, 1, i]
                balls[s, c, i] = 0.5 * (a + b)
                square += (b - a) * (b - a)
            balls[s, c, 3] = 0.5 * math.sqrt(square) + radii[c]


@lean
def between(balls: Array, s: int, i: int, j: int) -> float:
    """Gap of two of the ``balls`` (S, c, 4) in a sample."""
    x, y = balls[s, i, 0] - balls[s, j, 0], balls[s, i, 1] - balls[s, j, 1]
    z = balls[s, i, 2] - balls[s, j, 2]
    return float(math.sqrt(x * x + y * y + z * z) - balls[s, i, 3] - balls[s, j, 3])


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
