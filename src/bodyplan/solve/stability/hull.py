"""Convex hulls of feet seen along gravity."""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.threads import shared

#: hulls from which on a batch is shared between threads
SHARED_FROM = 16384


def support_hull(u: Array, v: Array) -> tuple[IntArray, IntArray]:
    """Convex hulls of points (u, v), each (..., m), u to the right and v up: indices (..., m) of the corners in
    **clockwise** order, -1 behind the last one, and their number (...). Points on an edge are no corners; of points at
    one place the first is."""
    shape, m = u.shape[:-1], u.shape[-1]
    flat = (np.ascontiguousarray(u).reshape(-1, m), np.ascontiguousarray(v).reshape(-1, m))
    corners = np.full((len(flat[0]), m), -1, dtype=np.int64)
    count = np.empty(len(flat[0]), dtype=np.int64)

    def kernel(first: int, last: int) -> int:
        return int(hull_kernel(flat[0][first:last], flat[1][first:last], corners[first:last], count[first:last]))

    shared(kernel, len(count), threaded_from=SHARED_FROM)
    return corners.reshape(*shape, m), count.reshape(shape)


@njit(cache=True, nogil=True, error_model="numpy")
def hull_kernel(u: Array, v: Array, corners: IntArray, count: IntArray) -> int:
    """Monotone chains (Andrew 1979): the upper hull from left to right, then the lower one back: clockwise."""
    size, m = u.shape
    order = np.empty(m, np.int64)
    chain = np.empty(2 * m, np.int64)
    for b in range(size):
        # insertion sort by u, then v, then index: a robot has few feet
        for i in range(m):
            k = i
            while k > 0 and (
                u[b, order[k - 1]] > u[b, i] or (u[b, order[k - 1]] == u[b, i] and v[b, order[k - 1]] > v[b, i])
            ):
                order[k] = order[k - 1]
                k -= 1
            order[k] = i
        apart = 1
        for i in range(1, m):
            if u[b, order[i]] != u[b, order[apart - 1]] or v[b, order[i]] != v[b, order[apart - 1]]:
                order[apart] = order[i]
                apart += 1
        n = 0
        for i in range(apart):
            while n >= 2 and _left(u, v, b, chain[n - 2], chain[n - 1], order[i]) >= 0.0:
                n -= 1
            chain[n] = order[i]
            n += 1
        upper = n
        for i in range(apart - 2, -1, -1):
            while n > upper and _left(u, v, b, chain[n - 2], chain[n - 1], order[i]) >= 0.0:
                n -= 1
            chain[n] = order[i]
            n += 1
        if apart > 1:
            # the way back ends where the way there began
            n -= 1
        for i in range(m):
            corners[b, i] = chain[i] if i < n else -1
        count[b] = n
    return 0


@njit(nogil=True, forceinline=True, error_model="numpy")
def _left(u: Array, v: Array, b: int, i: int, j: int, k: int) -> float:
    """> 0 where the way i, j, k turns left."""
    return float((u[b, j] - u[b, i]) * (v[b, k] - v[b, i]) - (v[b, j] - v[b, i]) * (u[b, k] - u[b, i]))
