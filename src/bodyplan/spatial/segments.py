"""Distances between the skeletons of capsules, and of capsules from boxes: exact, for any leading batch shape."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from bodyplan.arrays import Array

#: pairs of the six faces of a box: between two of them the depth along a segment is greatest, or at its ends
_PAIRS = np.array(list(combinations(range(6), 2)))


def segment_distance(p: Array, q: Array) -> Array:
    """Smallest distance (...,) between segments p and q (..., 2, 3), exact also where they cross or degenerate."""
    d1, d2, r = p[..., 1, :] - p[..., 0, :], q[..., 1, :] - q[..., 0, :], p[..., 0, :] - q[..., 0, :]
    a, e, b = (d1 * d1).sum(-1), (d2 * d2).sum(-1), (d1 * d2).sum(-1)
    c, f = (d1 * r).sum(-1), (d2 * r).sum(-1)
    # the closest pair of two segments is at their crossing (if any) or has an end point in it
    det = a * e - b * b
    crossing = det > 1e-14 * np.maximum(a * e, 1e-300)
    safe = np.where(crossing, det, 1.0)
    s, u = (b * f - c * e) / safe, (a * f - b * c) / safe
    inside = crossing & (s >= 0) & (s <= 1) & (u >= 0) & (u <= 1)
    gap = r + s[..., None] * d1 - u[..., None] * d2
    best = np.where(inside, (gap * gap).sum(-1), np.inf)
    for point, seg in ((p[..., 0, :], q), (p[..., 1, :], q), (q[..., 0, :], p), (q[..., 1, :], p)):
        along = seg[..., 1, :] - seg[..., 0, :]
        square = (along * along).sum(-1)
        x = ((point - seg[..., 0, :]) * along).sum(-1) / np.where(square > 0, square, 1.0)
        off = point - seg[..., 0, :] - np.clip(x, 0.0, 1.0)[..., None] * along
        best = np.minimum(best, (off * off).sum(-1))
    return np.asarray(np.sqrt(best))


def segment_box_clearance(ends: Array, half: Array) -> Array:
    """Signed distance (...,) m of segments with ends (..., 2, 3), in the axes and from the centre of a box with
    ``half`` sizes (..., 3), from that box: outside to the nearest point of the segment, inside minus the depth of its
    deepest one."""
    a, d = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
    half = np.asarray(half, dtype=np.float64)
    outside = _outside(a, d, half)
    depth = _depth(a, d, half)
    return np.asarray(np.where(depth >= 0.0, -depth, outside))


def _outside(a: Array, d: Array, half: Array) -> Array:
    """Smallest distance (...,) of the points a + s d, 0 <= s <= 1, from the box. Its square is a parabola between the
    places where the segment crosses a plane of a face, so that each piece is least at its own vertex, or an end."""
    moves = np.abs(d) > 0.0
    safe = np.where(moves, d, 1.0)
    cuts = np.concatenate([np.where(moves, (sign * half - a) / safe, 0.0) for sign in (-1.0, 1.0)], axis=-1)
    ends = np.broadcast_to([0.0, 1.0], (*cuts.shape[:-1], 2))
    s = np.sort(np.concatenate([np.clip(cuts, 0.0, 1.0), ends], axis=-1), axis=-1)
    first, last = s[..., :-1], s[..., 1:]
    middle = a[..., None, :] + 0.5 * (first + last)[..., None] * d[..., None, :]
    side = np.where(np.abs(middle) > half[..., None, :], np.sign(middle), 0.0)
    over = (a[..., None, :] - side * half[..., None, :]) * np.abs(side)
    way = d[..., None, :] * np.abs(side)
    square = np.sum(way * way, axis=-1)
    vertex = -np.sum(over * way, axis=-1) / np.where(square > 0.0, square, 1.0)
    at = np.clip(vertex, first, last)
    beyond = np.abs(a[..., None, :] + at[..., None] * d[..., None, :]) - half[..., None, :]
    return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=-1).min(axis=-1))


def _depth(a: Array, d: Array, half: Array) -> Array:
    """Largest (...,) over 0 <= s <= 1 of the smallest distance of a + s d from the planes of the faces, negative where
    it is outside of one: a concave function of straight pieces, greatest at an end or where two of them cross."""
    start = np.concatenate([half - a, half + a], axis=-1)
    slope = np.concatenate([-d, d], axis=-1)
    i, j = _PAIRS.T
    bend = slope[..., i] - slope[..., j]
    safe = np.where(bend != 0.0, bend, 1.0)
    cross = np.where(bend != 0.0, (start[..., j] - start[..., i]) / safe, 0.0)
    ends = np.broadcast_to([0.0, 1.0], (*cross.shape[:-1], 2))
    s = np.concatenate([np.clip(cross, 0.0, 1.0), ends], axis=-1)
    return np.asarray((start[..., None, :] + s[..., None] * slope[..., None, :]).min(axis=-1).max(axis=-1))
