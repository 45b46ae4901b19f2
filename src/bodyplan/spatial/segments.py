"""Distances between the skeletons of capsules, and of capsules from boxes: exact, for any leading batch shape."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array

#: share of the size of coordinates by which a segment is outside of a box beyond what rounding may do
CLEAR = 1e-12


def segment_distance(p: Array, q: Array) -> Array:
    """Smallest distance (...,) between segments p and q (..., 2, 3), exact also where they cross or degenerate."""
    first, second = np.broadcast_arrays(np.asarray(p, dtype=np.float64), np.asarray(q, dtype=np.float64))
    out = np.empty(first.shape[:-2])
    _distances(_flat(first, 2), _flat(second, 2), out.reshape(-1))
    return out


def segment_box_clearance(ends: Array, half: Array) -> Array:
    """Signed distance (...,) m of segments with ends (..., 2, 3), in the axes and from the centre of a box with
    ``half`` sizes (..., 3), from that box: outside to the nearest point of the segment, inside minus the depth of its
    deepest one."""
    e, h = np.asarray(ends, dtype=np.float64), np.asarray(half, dtype=np.float64)
    shape = np.broadcast_shapes(e.shape[:-2], h.shape[:-1])
    out = np.empty(shape)
    e, h = np.broadcast_to(e, (*shape, 2, 3)), np.broadcast_to(h, (*shape, 3))
    _clearances(_flat(e, 2), _flat(h, 1), out.reshape(-1))
    return out


def _flat(array: Array, kept: int) -> Array:
    return np.ascontiguousarray(array).reshape(-1, *array.shape[array.ndim - kept :])


@njit(cache=True, nogil=True)
def _distances(p: Array, q: Array, out: Array) -> None:
    for k in range(len(out)):
        out[k] = apart(p[k], q[k])


@njit(cache=True, nogil=True)
def _clearances(ends: Array, half: Array, out: Array) -> None:
    for k in range(len(out)):
        out[k] = from_box(ends[k], half[k])


@njit(cache=True, nogil=True)
def apart(p: Array, q: Array) -> float:
    """Smallest distance between the segments ``p`` and ``q`` (2, 3)."""
    a = e = b = c = f = 0.0
    for i in range(3):
        u, v, w = p[1, i] - p[0, i], q[1, i] - q[0, i], p[0, i] - q[0, i]
        a, e, b, c, f = a + u * u, e + v * v, b + u * v, c + u * w, f + v * w
    best = np.inf
    # the closest pair of two segments is at their crossing (if any) or has an end point in it
    det = a * e - b * b
    if det > 1e-14 * max(a * e, 1e-300):
        s, u = (b * f - c * e) / det, (a * f - b * c) / det
        if 0.0 <= s <= 1.0 and 0.0 <= u <= 1.0:
            best = 0.0
            for i in range(3):
                gap = p[0, i] - q[0, i] + s * (p[1, i] - p[0, i]) - u * (q[1, i] - q[0, i])
                best += gap * gap
    for k in range(2):
        best = min(best, _from_point(p[k], q), _from_point(q[k], p))
    return math.sqrt(best)


@njit(cache=True, nogil=True)
def _from_point(point: Array, segment: Array) -> float:
    """Squared distance of a point (3,) from a segment (2, 3)."""
    square = dot = 0.0
    for i in range(3):
        along = segment[1, i] - segment[0, i]
        square += along * along
        dot += (point[i] - segment[0, i]) * along
    x = min(max(dot / square, 0.0), 1.0) if square > 0.0 else 0.0
    out = 0.0
    for i in range(3):
        off = point[i] - segment[0, i] - x * (segment[1, i] - segment[0, i])
        out += off * off
    return out


@njit(cache=True, nogil=True)
def from_box(ends: Array, half: Array) -> float:
    """Signed distance of one segment (2, 3) from a box with ``half`` sizes (3,) around the origin."""
    out, size = _outside(ends, half), 0.0
    for i in range(3):
        size = max(size, half[i], abs(ends[0, i]), abs(ends[1, i]))
    if out > CLEAR * size:
        return out
    depth = _depth(ends, half)
    return -depth if depth >= 0.0 else out


@njit(cache=True, nogil=True)
def _outside(ends: Array, half: Array) -> float:
    """Smallest distance of the points a + s d, 0 <= s <= 1, from the box. Its square is a parabola between the places
    where the segment crosses a plane of a face, so that each piece is least at its own vertex, or an end."""
    cuts = np.empty(8)
    cuts[0], cuts[1], count = 0.0, 1.0, 2
    for i in range(3):
        a, d = ends[0, i], ends[1, i] - ends[0, i]
        if d != 0.0:
            for plane in (-half[i], half[i]):
                s = (plane - a) / d
                if 0.0 < s < 1.0:
                    cuts[count] = s
                    count += 1
    pieces = np.sort(cuts[:count])
    best = np.inf
    for k in range(count - 1):
        first, last = pieces[k], pieces[k + 1]
        square = dot = 0.0
        for i in range(3):
            a, d = ends[0, i], ends[1, i] - ends[0, i]
            middle = a + 0.5 * (first + last) * d
            if abs(middle) > half[i]:
                square += d * d
                dot += (a - math.copysign(half[i], middle)) * d
        s = min(max(-dot / square, first), last) if square > 0.0 else first
        away = 0.0
        for i in range(3):
            beyond = abs(ends[0, i] + s * (ends[1, i] - ends[0, i])) - half[i]
            away += max(beyond, 0.0) ** 2
        best = min(best, away)
    return math.sqrt(best)


@njit(cache=True, nogil=True)
def _depth(ends: Array, half: Array) -> float:
    """Largest over 0 <= s <= 1 of the smallest distance of a + s d from the planes of the faces, negative where it is
    outside of one: a concave function of straight pieces, greatest at an end or where two of them cross."""
    start, slope = np.empty(6), np.empty(6)
    for i in range(3):
        a, d = ends[0, i], ends[1, i] - ends[0, i]
        start[i], slope[i], start[3 + i], slope[3 + i] = half[i] - a, -d, half[i] + a, d
    best = max(start.min(), (start + slope).min())
    for i in range(6):
        for j in range(i + 1, 6):
            bend = slope[i] - slope[j]
            if bend != 0.0:
                s = (start[j] - start[i]) / bend
                if 0.0 < s < 1.0:
                    best = max(best, (start + s * slope).min())
    return float(best)
