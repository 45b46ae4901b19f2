"""Poses of all frames, from the base outwards, as positions and unit quaternions.

Row: T = Rz(theta) Tz(d) Tx(a) Rx(epsilon). Arc: the rotation vector (0, pitch, yaw) and the end point
length (A, B yaw, -B pitch), see :mod:`bodyplan.spatial.coefficients`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import ARC
from bodyplan.robot.values import COSINE, SINE, bend, drive_values, unpack
from bodyplan.spatial.lanes import inlined, lane_count


@njit(cache=True, nogil=True)
def forward_kernel(batch: int, q: Array, base: Array, ints: IntArray, floats: Array, out: Array) -> int:
    """Poses ``out`` (B F, 7) of every frame for ``batch`` configurations ``q`` (B n,); ``base`` (B, 7) or (1, 7).

    Returns the index of a block with a non-finite coordinate, or -1.
    """
    L = lane_count(batch)
    F, V, n = ints[0], ints[1], ints[2]
    element_i, element_f, drive_i, drive_f = unpack(ints, floats)
    D, H, S = np.empty((max(V, 1), 4 * L)), np.empty((1, 6 * L)), np.empty((F, 7 * L))
    for first in range(0, batch, L):
        if not drive_values(q, n, first, batch - 1, drive_i, drive_f, 0.5, D, batch):
            return first
        for l in range(L):
            b = min(first + l, base.shape[0] - 1)
            for k in range(7):
                S[0, k * L + l] = base[b, k]
        for e in range(1, F):
            if element_i[e, 0] == ARC:
                bend(element_i, element_f, D, e, H, batch)
                _arc(S, e, element_i[e, 1], H, element_f[e, 2], batch)
            else:
                _row(S, e, element_i, element_f, D, batch)
        for l in range(min(L, batch - first)):
            for e in range(F):
                _store(S, e, l, out, (first + l) * F + e, batch)
    return -1


@inlined
def _row(S: Array, e: int, element_i: IntArray, element_f: Array, D: Array, wide: bool) -> None:
    L = lane_count(wide)
    parent = element_i[e, 1]
    theta, d, a, epsilon = element_i[e, 2], element_i[e, 3], element_i[e, 4], element_i[e, 5]
    # Rz(theta)
    for l in range(L):
        c = D[theta, COSINE * L + l] if theta >= 0 else element_f[e, 8]
        s = D[theta, SINE * L + l] if theta >= 0 else element_f[e, 9]
        w, x, y, z = S[parent, 3 * L + l], S[parent, 4 * L + l], S[parent, 5 * L + l], S[parent, 6 * L + l]
        S[e, 3 * L + l], S[e, 4 * L + l] = w * c - z * s, x * c + y * s
        S[e, 5 * L + l], S[e, 6 * L + l] = y * c - x * s, z * c + w * s
    # Tz(d) Tx(a), along the third and first column of the rotation
    for l in range(L):
        u = D[d, l] if d >= 0 else element_f[e, 1]
        v = D[a, l] if a >= 0 else element_f[e, 2]
        w, x, y, z = S[e, 3 * L + l], S[e, 4 * L + l], S[e, 5 * L + l], S[e, 6 * L + l]
        S[e, l] = S[parent, l] + 2.0 * u * (x * z + w * y) + v * (1.0 - 2.0 * (y * y + z * z))
        S[e, L + l] = S[parent, L + l] + 2.0 * u * (y * z - w * x) + 2.0 * v * (x * y + w * z)
        S[e, 2 * L + l] = S[parent, 2 * L + l] + u * (1.0 - 2.0 * (x * x + y * y)) + 2.0 * v * (x * z - w * y)
    # Rx(epsilon)
    for l in range(L):
        c = D[epsilon, COSINE * L + l] if epsilon >= 0 else element_f[e, 10]
        s = D[epsilon, SINE * L + l] if epsilon >= 0 else element_f[e, 11]
        w, x, y, z = S[e, 3 * L + l], S[e, 4 * L + l], S[e, 5 * L + l], S[e, 6 * L + l]
        _set_unit(S, e, l, w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s, L)


@inlined
def _arc(S: Array, e: int, parent: int, H: Array, length: float, wide: bool) -> None:
    L = lane_count(wide)
    for l in range(L):
        w, x, y, z = S[parent, 3 * L + l], S[parent, 4 * L + l], S[parent, 5 * L + l], S[parent, 6 * L + l]
        pitch, yaw, c, ratio = H[0, l], H[0, L + l], H[0, 4 * L + l], H[0, 5 * L + l]
        b = 0.5 * ratio * ratio
        u, v, r = length * ratio * c, length * b * yaw, -length * b * pitch
        S[e, l] = (
            S[parent, l] + u * (1.0 - 2.0 * (y * y + z * z)) + 2.0 * v * (x * y - w * z) + 2.0 * r * (x * z + w * y)
        )
        S[e, L + l] = (
            S[parent, L + l] + 2.0 * u * (x * y + w * z) + v * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * r * (y * z - w * x)
        )
        S[e, 2 * L + l] = (
            S[parent, 2 * L + l] + 2.0 * u * (x * z - w * y) + 2.0 * v * (y * z + w * x) + r * (1.0 - 2.0 * (x * x + y * y))
        )
        # times (c, 0, p, t)
        p, t = 0.5 * ratio * pitch, 0.5 * ratio * yaw
        _set_unit(S, e, l, w * c - y * p - z * t, x * c + y * t - z * p, y * c + w * p - x * t, z * c + w * t + x * p, L)


@inlined
def _set_unit(S: Array, e: int, l: int, w: float, x: float, y: float, z: float, L: int) -> None:
    # one Newton step towards length 1: rounding does not pile up along a chain
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    S[e, 3 * L + l], S[e, 4 * L + l], S[e, 5 * L + l], S[e, 6 * L + l] = scale * w, scale * x, scale * y, scale * z


@inlined
def _store(S: Array, e: int, l: int, out: Array, row: int, wide: bool) -> None:
    """Lane ``l`` of frame ``e`` -> ``out[row]``; of q and -q the one whose first non-zero entry is positive."""
    L = lane_count(wide)
    sign = 0.0
    for k in range(3, 7):
        value = S[e, k * L + l]
        if sign == 0.0 and value != 0.0:
            sign = 1.0 if value > 0.0 else -1.0
    for k in range(3):
        out[row, k] = S[e, k * L + l]
    for k in range(3, 7):
        out[row, k] = sign * S[e, k * L + l] + 0.0
