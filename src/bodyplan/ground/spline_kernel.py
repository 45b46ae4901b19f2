"""The kernel of the bicubic spline: value, gradient and Hessian at many places."""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array


@njit(cache=True, nogil=True)
def spline_jet(nodes: Array, dx: float, dy: float, x: Array, y: Array, f: Array, g: Array, h: Array) -> None:
    """Fill ``f`` (n,), ``g`` (n, 2), ``h`` (n, 2, 2) at ``x``, ``y`` (n,) for the Hermite data ``nodes``
    (ny, nx, 2, 2); edge cells continue outwards; nan where a place is not finite."""
    ny, nx = nodes.shape[0], nodes.shape[1]
    wx, wy = np.empty((3, 4)), np.empty((3, 4))
    for k in range(len(x)):
        u, v = x[k] / dx, y[k] / dy
        if not (np.isfinite(u) and np.isfinite(v)):
            f[k] = np.nan
            g[k, :] = np.nan
            h[k, :, :] = np.nan
            continue
        # compare before converting: a place far outside has no integer
        i = int(min(max(np.floor(u), 0.0), nx - 2.0))
        j = int(min(max(np.floor(v), 0.0), ny - 2.0))
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
        f[k] = value
        g[k, 0], g[k, 1] = along / dx, across / dy
        h[k, 0, 0], h[k, 1, 1] = xx / dx**2, yy / dy**2
        h[k, 0, 1] = h[k, 1, 0] = xy / (dx * dy)


@njit(cache=True, nogil=True)
def _basis(t: float, out: Array) -> None:
    """Hermite basis (value, slope at 0; value, slope at 1) with two derivatives at t: ``out`` (3, 4)."""
    r = 1.0 - t
    out[0, 0], out[0, 1] = (1.0 + 2.0 * t) * r * r, t * r * r
    out[0, 2], out[0, 3] = t * t * (3.0 - 2.0 * t), -t * t * r
    out[1, 0], out[1, 1] = -6.0 * t * r, r * (1.0 - 3.0 * t)
    out[1, 2], out[1, 3] = 6.0 * t * r, t * (3.0 * t - 2.0)
    out[2, 0], out[2, 1], out[2, 2], out[2, 3] = 12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0
