"""Convex hulls of a few points in a plane, feet seen along gravity, and how far inside of one a point is."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.threads import shared

#: hulls from which on a batch is shared between threads
SHARED_FROM = 16384
#: width of a hull that is none but for rounding: as a part of its length, and of the size of coordinates
FLAT, ROUNDING = 1e-12, 4e-15
#: numbers of an edge: where it starts, its direction, what it is, and its length
EDGE = 6
#: what a row of a table of edges is: no edge, an edge, one of feet in a line, all feet in one place
_NONE, _SIDE, _LINE, _POINT = 0.0, 1.0, 2.0, 3.0


def support_hull(u: Array, v: Array, size: Array | None = None) -> tuple[IntArray, IntArray]:
    """Convex hulls of points (u, v), each (..., m), u to the right and v up: indices (..., m) of the corners in
    **clockwise** order, -1 behind the last one, and their number (...). Points on an edge are no corners; of points at
    one place the first is. But for rounding, points in one line have two corners, and points in one place one; ``size``
    (...): that of the coordinates which u and v were made of, where it is more than theirs."""
    shape, m = u.shape[:-1], u.shape[-1]
    flat = (np.ascontiguousarray(u).reshape(-1, m), np.ascontiguousarray(v).reshape(-1, m))
    sizes = np.ascontiguousarray(np.broadcast_to(0.0 if size is None else size, shape)).reshape(-1)
    corners = np.full((len(flat[0]), m), -1, dtype=np.int64)
    count = np.empty(len(flat[0]), dtype=np.int64)

    def kernel(first: int, last: int) -> int:
        mine = slice(first, last)
        return int(_hulls(flat[0][mine], flat[1][mine], sizes[mine], corners[mine], count[mine]))

    shared(kernel, len(count), threaded_from=SHARED_FROM)
    return corners.reshape(*shape, m), count.reshape(shape)


def edge_distances(feet: Array, center: Array) -> Array:
    """Distances (..., m) m of ``center`` (..., 2) from the edges of the hull of ``feet`` (..., m, 2), positive inside;
    inf behind the last edge.

    Feet in one line have an edge there and one back, with nothing inside: beyond an end of the line the body tips over
    that foot, and the edge that it has left, or both, count the way to the foot. So the smallest distance is 0 on the
    line between the feet, and minus the distance from it elsewhere. Feet in one place have one edge: that place.
    """
    count = feet.shape[-2]
    shape = np.broadcast_shapes(feet.shape[:-2], center.shape[:-1])
    points = np.broadcast_to(feet, (*shape, count, 2)).reshape(-1, count, 2)
    places = np.broadcast_to(center, (*shape, 2)).reshape(-1, 2)
    out = np.empty((len(points), count))
    _all_distances(np.ascontiguousarray(points, np.float64), np.ascontiguousarray(places, np.float64), out)
    return out.reshape(*shape, count)


def margin(feet: Array, center: Array) -> Array:
    """(...,) m: the smallest of :func:`edge_distances`."""
    return np.asarray(edge_distances(feet, center).min(axis=-1))


@njit(cache=True, nogil=True, error_model="numpy")
def edges_of(feet: Array, out: Array) -> None:
    """The edges of the hull of ``feet`` (k, 2), as the first rows of ``out`` (k or more, EDGE), for
    :func:`edge_distance`."""
    m = len(feet)
    u, v = feet[:, 0], feet[:, 1]
    chain = np.empty(2 * m, np.int64)
    n = _hull(u, v, 0.0, np.empty(m, np.int64), chain)
    out[:] = 0.0
    for k in range(n):
        # counter-clockwise
        i, j = chain[k + 1 if k + 1 < n else 0], chain[k]
        edge = out[k]
        edge[0], edge[1] = u[i], v[i]
        x, y = u[j] - u[i], v[j] - v[i]
        length = math.hypot(x, y)
        edge[4], edge[5] = _POINT if n == 1 else _LINE if n == 2 else _SIDE, length
        if n > 1:
            edge[2], edge[3] = x / length, y / length


@njit(cache=True, nogil=True, error_model="numpy")
def edge_distance(edge: Array, x: float, y: float) -> float:
    """Distance m of a point from one of :func:`edges_of`, positive inside; inf where it is no edge."""
    u, v = x - edge[0], y - edge[1]
    if edge[4] == _NONE:
        return np.inf
    if edge[4] == _POINT:
        return -math.hypot(u, v)
    inside = edge[2] * v - edge[3] * u
    # on the line itself, but for rounding, both edges are left
    if edge[4] == _LINE and inside <= ROUNDING * (abs(edge[0]) + abs(edge[1]) + abs(x) + abs(y)):
        along = edge[2] * u + edge[3] * v
        beyond = max(-along, along - edge[5])
        if beyond > 0.0:
            return -math.hypot(beyond, inside)
    return float(inside)


@njit(cache=True, nogil=True, error_model="numpy")
def _all_distances(feet: Array, center: Array, out: Array) -> None:
    edges = np.empty((out.shape[1], EDGE))
    for k in range(len(feet)):
        if k == 0 or not np.array_equal(feet[k], feet[k - 1]):
            edges_of(feet[k], edges)
        for p in range(len(edges)):
            out[k, p] = edge_distance(edges[p], center[k, 0], center[k, 1])


@njit(cache=True, nogil=True, error_model="numpy")
def _hulls(u: Array, v: Array, size: Array, corners: IntArray, count: IntArray) -> int:
    batch, m = u.shape
    order, chain = np.empty(m, np.int64), np.empty(2 * m, np.int64)
    for b in range(batch):
        n = _hull(u[b], v[b], size[b], order, chain)
        for i in range(m):
            corners[b, i] = chain[i] if i < n else -1
        count[b] = n
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def _hull(u: Array, v: Array, size: float, order: IntArray, chain: IntArray) -> int:
    """Number of corners of the hull of points u, v (m), which come first in ``chain`` (2 m), clockwise. ``size``: of
    the coordinates whose rounding is in u and v, if larger than theirs.

    Monotone chains (Andrew 1979): the upper hull from left to right, then the lower one back.
    """
    m = len(u)
    # insertion sort by u, then v, then index: a robot has few feet
    for i in range(m):
        k = i
        while k > 0 and (u[order[k - 1]] > u[i] or (u[order[k - 1]] == u[i] and v[order[k - 1]] > v[i])):
            order[k] = order[k - 1]
            k -= 1
        order[k] = i
    apart = 1
    for i in range(1, m):
        if u[order[i]] != u[order[apart - 1]] or v[order[i]] != v[order[apart - 1]]:
            order[apart] = order[i]
            apart += 1
    n = 0
    for i in range(apart):
        while n >= 2 and _left(u, v, chain[n - 2], chain[n - 1], order[i]) >= 0.0:
            n -= 1
        chain[n] = order[i]
        n += 1
    upper = n
    for i in range(apart - 2, -1, -1):
        while n > upper and _left(u, v, chain[n - 2], chain[n - 1], order[i]) >= 0.0:
            n -= 1
        chain[n] = order[i]
        n += 1
    if apart > 1:
        # the way back ends where the way there began
        n -= 1
    return _flattened(u, v, size, chain, n) if n > 1 else n


@njit(cache=True, nogil=True, error_model="numpy")
def _flattened(u: Array, v: Array, size: float, chain: IntArray, n: int) -> int:
    """Number of corners of a hull of two or more, once one that is flat but for rounding is cut down to its ends, and
    one without length to a point."""
    last = _farthest(u, v, chain, n, chain[0])
    first = _farthest(u, v, chain, n, last)
    length = math.hypot(u[last] - u[first], v[last] - v[first])
    width = 0.0
    for k in range(n):
        size = max(size, abs(u[chain[k]]), abs(v[chain[k]]))
        width = max(width, abs(_left(u, v, first, last, chain[k])) / length)
    if length <= ROUNDING * size:
        return 1
    if n == 2 or width > FLAT * length + ROUNDING * size:
        return n
    if u[first] > u[last] or (u[first] == u[last] and v[first] > v[last]):
        first, last = last, first
    chain[0], chain[1] = first, last
    return 2


@njit(cache=True, nogil=True, error_model="numpy")
def _farthest(u: Array, v: Array, chain: IntArray, n: int, i: int) -> int:
    """The corner farthest from point i."""
    far, out = -1.0, i
    for k in range(n):
        distance = math.hypot(u[chain[k]] - u[i], v[chain[k]] - v[i])
        if distance > far:
            far, out = distance, chain[k]
    return int(out)


@njit(nogil=True, forceinline=True, error_model="numpy")
def _left(u: Array, v: Array, i: int, j: int, k: int) -> float:
    """> 0 where the way i, j, k turns left."""
    return float((u[j] - u[i]) * (v[k] - v[i]) - (v[j] - v[i]) * (u[k] - u[i]))
