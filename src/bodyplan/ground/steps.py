"""Signed distance of segments to a floor in steps, exact: a Numba kernel.

A floor of k steps has the treads z = zs[i] from xs[i - 1] to xs[i] (the first and the last without end) and the faces
between them. Its edges are numbered along x: 2 i is tread i, 2 i + 1 the face at xs[i]. A level of -inf is no floor.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array

#: relative error of a depth
CLOSE = 1e-13
#: splits of one stretch of a segment; each second one halves it
MOST_SPLITS = 4000


@njit(cache=True)
def steps_clearance(segments: Array, xs: Array, zs: Array, out: Array) -> None:
    """The smaller of ``out`` (n,) and the smallest signed distance m, negative inside, of any point of each segment
    (n, 2, 2), ends (x, z), to the floor with steps at ``xs`` (k,) and levels ``zs`` (k + 1,), into ``out``."""
    for i in range(len(out)):
        (x0, z0), (x1, z1) = segments[i]
        found = _signed(x0, z0, x1, z1, xs, zs) if x0 <= x1 else _signed(x1, z1, x0, z0, xs, zs)
        out[i] = min(out[i], found)


@njit(cache=True)
def _signed(x0: float, z0: float, x1: float, z1: float, xs: Array, zs: Array) -> float:
    """Of one segment, x0 <= x1."""
    k = len(xs)
    first, last = int(np.searchsorted(xs, x0, side="right")), int(np.searchsorted(xs, x1, side="left"))
    if first > last:  # upright, in the plane of a face
        first, last = last, first
    depth = 0.0
    for i in range(first, last + 1):
        level, a, b = zs[i], 0.0, 1.0
        if x1 > x0:
            a = (xs[i - 1] - x0) / (x1 - x0) if i > first else 0.0
            b = (xs[i] - x0) / (x1 - x0) if i < last else 1.0
        za, zb = z0 + a * (z1 - z0), z0 + b * (z1 - z0)
        if min(za, zb) >= level:
            continue
        # the stretch below the tread
        if za > level:
            a = min(max((level - z0) / (z1 - z0), a), b)
        elif zb > level:
            b = min(max((level - z0) / (z1 - z0), a), b)
        depth = max(depth, _deepest(x0, z0, x1, z1, a, b, i, xs, zs))
    if depth > 0.0:
        return -depth
    best = min(_nearest(x0, z0, first, xs, zs)[0], _nearest(x1, z1, last, xs, zs)[0])
    for i in range(first, k):
        if xs[i] - x1 >= best:
            break
        best = min(best, _corners(i, x0, z0, x1, z1, xs, zs))
    for i in range(first - 1, -1, -1):
        if x0 - xs[i] >= best:
            break
        best = min(best, _corners(i, x0, z0, x1, z1, xs, zs))
    return best


@njit(cache=True)
def _corners(i: int, x0: float, z0: float, x1: float, z1: float, xs: Array, zs: Array) -> float:
    """Distance of the two ends of face i to a segment."""
    best, square = np.inf, (x1 - x0) ** 2 + (z1 - z0) ** 2
    for z in (zs[i], zs[i + 1]):
        if z > -np.inf:
            s = ((xs[i] - x0) * (x1 - x0) + (z - z0) * (z1 - z0)) / square if square > 0.0 else 0.0
            s = min(max(s, 0.0), 1.0)
            best = min(best, np.hypot(xs[i] - x0 - s * (x1 - x0), z - z0 - s * (z1 - z0)))
    return best


@njit(cache=True)
def _edge(x: float, z: float, e: int, xs: Array, zs: Array) -> float:
    """Distance of a point to edge e; inf to a tread that is none."""
    i = e // 2
    if e % 2:
        low, high = min(zs[i], zs[i + 1]), max(zs[i], zs[i + 1])
        return float(np.hypot(x - xs[i], z - min(max(z, low), high)))
    left = xs[i - 1] if i > 0 else -np.inf
    right = xs[i] if i < len(xs) else np.inf
    return float(np.hypot(x - min(max(x, left), right), z - zs[i]))


@njit(cache=True)
def _nearest(x: float, z: float, i: int, xs: Array, zs: Array) -> tuple[float, int]:
    """Distance of a point above or below tread i to the nearest edge, and which one that is."""
    best, which = _edge(x, z, 2 * i, xs, zs), 2 * i
    for e in range(2 * i + 1, 2 * len(xs) + 1):
        if xs[(e - 1) // 2] - x >= best:
            break
        d = _edge(x, z, e, xs, zs)
        if d < best:
            best, which = d, e
    for e in range(2 * i - 1, -1, -1):
        if x - xs[e // 2] >= best:
            break
        d = _edge(x, z, e, xs, zs)
        if d < best:
            best, which = d, e
    return best, which


@njit(cache=True)
def _deepest(x0: float, z0: float, x1: float, z1: float, a: float, b: float, i: int, xs: Array, zs: Array) -> float:
    """Largest distance to the edges of the points from a to b (shares of the segment), all below tread i.

    The distance to one edge is convex along the segment, so that between two places it is at most that of the farther
    one; the depth is at most that for the edge nearest to either place. Stretches that this does not rule out are cut
    where their two nearest edges are about equally far, or in halves by turns.
    """
    da, ea = _nearest(x0 + a * (x1 - x0), z0 + a * (z1 - z0), i, xs, zs)
    db, eb = _nearest(x0 + b * (x1 - x0), z0 + b * (z1 - z0), i, xs, zs)
    best = max(da, db)
    stretches = [(a, b, ea, eb)]
    for turn in range(MOST_SPLITS):
        if len(stretches) == 0:
            break
        a, b, ea, eb = stretches.pop()
        xa, za, xb, zb = x0 + a * (x1 - x0), z0 + a * (z1 - z0), x0 + b * (x1 - x0), z0 + b * (z1 - z0)
        da, far_b = _edge(xa, za, ea, xs, zs), _edge(xb, zb, ea, xs, zs)
        far_a, db = _edge(xa, za, eb, xs, zs), _edge(xb, zb, eb, xs, zs)
        if min(max(da, far_b), max(far_a, db)) <= best * (1.0 + CLOSE):
            continue
        # da <= far_a and db <= far_b: the chords of both distances cross in between
        share = 0.5 if turn % 2 else (far_a - da) / ((far_a - da) + (far_b - db))
        c = a + share * (b - a)
        if not a < c < b:
            c = 0.5 * (a + b)
            if not a < c < b:
                continue
        dc, ec = _nearest(x0 + c * (x1 - x0), z0 + c * (z1 - z0), i, xs, zs)
        best = max(best, dc)
        stretches.append((a, c, ea, ec))
        stretches.append((c, b, ec, eb))
    return best
