"""The kernels of the bicubic spline: value, gradient and Hessian at places, bounds over boxes."""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray


@njit(cache=True, nogil=True)
def spline_jet(nodes: Array, dx: float, dy: float, x: Array, y: Array, f: Array, g: Array, h: Array) -> None:
    """Fill ``f`` (n,), ``g`` (n, 2), ``h`` (n, 2, 2) at ``x``, ``y`` (n,) for the Hermite data ``nodes``
    (ny, nx, 2, 2); edge cells continue outwards; nan where a place is not finite."""
    basis, out = np.empty((2, 3, 4)), np.empty(6)
    for k in range(len(x)):
        spline_at(nodes, dx, dy, x[k], y[k], basis, out)
        f[k], g[k, 0], g[k, 1] = out[0], out[1], out[2]
        h[k, 0, 0], h[k, 1, 1] = out[3], out[5]
        h[k, 0, 1] = h[k, 1, 0] = out[4]


@njit(cache=True, nogil=True, error_model="numpy")
def spline_values(nodes: Array, dx: float, dy: float, level: float, x: Array, y: Array, f: Array) -> None:
    """Fill ``f`` (n,) with values above ``level`` as :func:`spline_jet`."""
    ny, nx = nodes.shape[0], nodes.shape[1]
    for k in range(len(x)):
        u, v = x[k] / dx, y[k] / dy
        if not (np.isfinite(u) and np.isfinite(v)):
            f[k] = np.nan
            continue
        i = int(min(max(np.floor(u), 0.0), nx - 2.0))
        j = int(min(max(np.floor(v), 0.0), ny - 2.0))
        u -= i
        v -= j
        r, s = 1.0 - u, 1.0 - v
        a0, a1, b0, b1 = (1.0 + 2.0 * u) * r * r, u * r * r, u * u * (3.0 - 2.0 * u), -u * u * r
        c0, c1, d0, d1 = (1.0 + 2.0 * v) * s * s, v * s * s, v * v * (3.0 - 2.0 * v), -v * v * s
        value = 0.0
        for b in range(2):
            p, q = nodes[j + b, i], nodes[j + b, i + 1]
            at = p[0, 0] * a0 + p[0, 1] * a1 + q[0, 0] * b0 + q[0, 1] * b1
            slope = p[1, 0] * a0 + p[1, 1] * a1 + q[1, 0] * b0 + q[1, 1] * b1
            value += c0 * at + c1 * slope if b == 0 else d0 * at + d1 * slope
        f[k] = value + level


@njit(cache=True, nogil=True)
def spline_at(nodes: Array, dx: float, dy: float, x: float, y: float, basis: Array, out: Array) -> None:
    """Value, slopes along x and y, second derivatives xx, xy, yy at one place into ``out`` (6+,), nan where it is not
    finite; ``basis`` (2, 3, 4) is room to work in."""
    ny, nx = nodes.shape[0], nodes.shape[1]
    u, v = x / dx, y / dy
    if not (np.isfinite(u) and np.isfinite(v)):
        out[:6] = np.nan
        return
    # compare before converting: a place far outside has no integer
    i = int(min(max(np.floor(u), 0.0), nx - 2.0))
    j = int(min(max(np.floor(v), 0.0), ny - 2.0))
    wx, wy = basis[0], basis[1]
    _basis(u - i, wx)
    _basis(v - j, wy)
    value = along = across = xx = xy = yy = 0.0
    for b in range(2):
        for q in range(2):
            row = 2 * b + q
            d0 = d1 = d2 = 0.0
            for a in range(2):
                for p in range(2):
                    node = nodes[j + b, i + a, q, p]
                    column = 2 * a + p
                    d0 += node * wx[0, column]
                    d1 += node * wx[1, column]
                    d2 += node * wx[2, column]
            value += wy[0, row] * d0
            along += wy[0, row] * d1
            xx += wy[0, row] * d2
            across += wy[1, row] * d0
            xy += wy[1, row] * d1
            yy += wy[2, row] * d0
    out[0], out[1], out[2] = value, along / dx, across / dy
    out[3], out[4], out[5] = xx / dx**2, xy / (dx * dy), yy / dy**2


@njit(cache=True, nogil=True)
def blocks_over(
    shape: tuple[int, int],
    dx: float,
    dy: float,
    offsets: IntArray,
    widths: IntArray,
    low_x: float,
    low_y: float,
    high_x: float,
    high_y: float,
) -> tuple[int, int, int, int]:
    """Columns of a spline's tables of bounds that together cover a box: four blocks, of which some may be one.
    ``shape``: how many nodes there are in y and x."""
    last_x, last_y = shape[1] - 2.0, shape[0] - 2.0
    ax = int(min(max(np.floor(low_x / dx - 1e-9), 0.0), last_x))
    ay = int(min(max(np.floor(low_y / dy - 1e-9), 0.0), last_y))
    bx = int(min(max(np.floor(high_x / dx + 1e-9), 0.0), last_x))
    by = int(min(max(np.floor(high_y / dy + 1e-9), 0.0), last_y))
    # the level on which the box meets at most two blocks along each axis
    span, level = max(bx - ax, by - ay), 0
    while (1 << level) < span:
        level += 1
    ax, ay, bx, by = ax >> level, ay >> level, bx >> level, by >> level
    lower, upper = offsets[level] + ay * widths[level], offsets[level] + by * widths[level]
    return lower + ax, lower + bx, upper + ax, upper + bx


@njit(cache=True, nogil=True)
def spline_bounds(
    shape: tuple[int, int],
    dx: float,
    dy: float,
    offsets: IntArray,
    widths: IntArray,
    tables: Array,
    low_x: float,
    low_y: float,
    high_x: float,
    high_y: float,
    out: Array,
) -> None:
    """Of one box, as :meth:`bodyplan.ground.spline.BicubicSpline.bounds`: lowest and highest value, second derivatives
    xx, xy, yy, and a bound of the third ones, into ``out`` (9,). ``shape``: how many nodes there are in y and x."""
    one, two, three, four = blocks_over(shape, dx, dy, offsets, widths, low_x, low_y, high_x, high_y)
    for k in range(9):
        lowest = min(min(tables[k, one], tables[k, two]), min(tables[k, three], tables[k, four]))
        out[k] = lowest if k % 2 == 0 and k < 8 else -lowest


@njit(cache=True, nogil=True)
def _basis(t: float, out: Array) -> None:
    """Hermite basis (value, slope at 0; value, slope at 1) with two derivatives at t: ``out`` (3, 4)."""
    r = 1.0 - t
    out[0, 0], out[0, 1] = (1.0 + 2.0 * t) * r * r, t * r * r
    out[0, 2], out[0, 3] = t * t * (3.0 - 2.0 * t), -t * t * r
    out[1, 0], out[1, 1] = -6.0 * t * r, r * (1.0 - 3.0 * t)
    out[1, 2], out[1, 3] = 6.0 * t * r, t * (3.0 * t - 2.0)
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = 12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0
