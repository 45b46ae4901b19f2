"""Poses of all frames, from the base outwards, as positions and unit quaternions.

Row: T = Rz(theta) Tz(d) Tx(a) Rx(epsilon). Arc: the rotation vector (0, pitch, yaw) and the end point
length (A, B yaw, -B pitch), see :mod:`bodyplan.spatial.coefficients`.
"""

# ruff: noqa: E741 - l is the lane, everywhere
from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import ARC, ELEMENT_F, ELEMENT_I, HEAD
from bodyplan.robot.values import COSINE, COSINE_HALF, PITCH, RATIO, SINE, YAW, bend, drive_values
from bodyplan.spatial.lanes import inlined, lane_count, load, strip, table, unload


@njit(cache=True, nogil=True, error_model="numpy")
def forward_kernel(batch: int, q: Array, base: Array, ints: IntArray, floats: Array, out: Array) -> int:
    """Poses ``out`` (B F 7) of every frame for ``batch`` configurations ``q`` (B n,).

    ``base``: (B, 7) or (1, 7) poses of the base. Returns the index of a block with a number that is not
    finite, or -1.
    """
    L = lane_count(batch)
    B, F, V, n = int(batch), ints[0], ints[1], ints[2]
    scratch = np.empty((6 * (V + 1) + 7 * F + n + 1) * L)
    at_S = 6 * L * (V + 1)
    D, S, poses = table(scratch, 0, V + 1, 6 * L), table(scratch, at_S, F, 7 * L), strip(out, 0, 7 * F * B)
    all_q, values = strip(q, 0, B * n), table(scratch, at_S + 7 * F * L, n, L)
    total = strip(scratch, scratch.size - L, L)
    for first in range(0, B, L):
        lanes = min(L, B - first)
        load(all_q, n * first, n, n, lanes, values, batch)
        if not drive_values(values, ints, floats, 0.5, D, total, batch):
            return first
        for l in range(L):
            b = min(first + l, base.shape[0] - 1)
            for k in range(3):
                S[0, k * L + l] = base[b, k]
            _set_unit(S, 0, l, base[b, 3], base[b, 4], base[b, 5], base[b, 6], L)
        for e in range(1, F):
            i, f = HEAD + e * ELEMENT_I, e * ELEMENT_F
            if ints[i] == ARC:
                bend(ints[i + 2], ints[i + 3], floats[f], floats[f + 1], D, batch)
                _arc(S, e, ints[i + 1], D, floats[f + 2], batch)
            else:
                _row(S, e, ints, floats, D, batch)
        unload(scratch, at_S, 7 * F, lanes, poses, 7 * F * first, 7 * F, batch)
    scratch[0] = 0.0
    return -1


@inlined
def _row(S: Array, e: int, ints: IntArray, floats: Array, D: Array, wide: int) -> None:
    L = lane_count(wide)
    i, f = HEAD + e * ELEMENT_I, e * ELEMENT_F
    parent, theta, d, a, epsilon = ints[i + 1], ints[i + 2], ints[i + 3], ints[i + 4], ints[i + 5]
    # Rz(theta)
    for l in range(L):
        c = D[theta, COSINE * L + l] if theta >= 0 else floats[f + 8]
        s = D[theta, SINE * L + l] if theta >= 0 else floats[f + 9]
        w, x, y, z = S[parent, 3 * L + l], S[parent, 4 * L + l], S[parent, 5 * L + l], S[parent, 6 * L + l]
        S[e, 3 * L + l], S[e, 4 * L + l] = w * c - z * s, x * c + y * s
        S[e, 5 * L + l], S[e, 6 * L + l] = y * c - x * s, z * c + w * s
    # Tz(d) Tx(a), along the third and first column of the rotation
    for l in range(L):
        u = D[d, l] if d >= 0 else floats[f + 1]
        v = D[a, l] if a >= 0 else floats[f + 2]
        w, x, y, z = S[e, 3 * L + l], S[e, 4 * L + l], S[e, 5 * L + l], S[e, 6 * L + l]
        S[e, l] = S[parent, l] + 2.0 * u * (x * z + w * y) + v * (1.0 - 2.0 * (y * y + z * z))
        S[e, L + l] = S[parent, L + l] + 2.0 * u * (y * z - w * x) + 2.0 * v * (x * y + w * z)
        S[e, 2 * L + l] = S[parent, 2 * L + l] + u * (1.0 - 2.0 * (x * x + y * y)) + 2.0 * v * (x * z - w * y)
    # Rx(epsilon)
    for l in range(L):
        c = D[epsilon, COSINE * L + l] if epsilon >= 0 else floats[f + 10]
        s = D[epsilon, SINE * L + l] if epsilon >= 0 else floats[f + 11]
        w, x, y, z = S[e, 3 * L + l], S[e, 4 * L + l], S[e, 5 * L + l], S[e, 6 * L + l]
        _set_unit(S, e, l, w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s, L)


@inlined
def _arc(S: Array, e: int, parent: int, D: Array, length: float, wide: int) -> None:
    L = lane_count(wide)
    h = D.shape[0] - 1
    for l in range(L):
        w, x, y, z = S[parent, 3 * L + l], S[parent, 4 * L + l], S[parent, 5 * L + l], S[parent, 6 * L + l]
        pitch, yaw = D[h, PITCH * L + l], D[h, YAW * L + l]
        c, ratio = D[h, COSINE_HALF * L + l], D[h, RATIO * L + l]
        b = 0.5 * ratio * ratio
        u, v, r = length * ratio * c, length * b * yaw, -length * b * pitch
        S[e, l] = (
            S[parent, l] + u * (1.0 - 2.0 * (y * y + z * z)) + 2.0 * v * (x * y - w * z) + 2.0 * r * (x * z + w * y)
        )
        S[e, L + l] = (
            S[parent, L + l] + 2.0 * u * (x * y + w * z) + v * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * r * (y * z - w * x)
        )
        S[e, 2 * L + l] = (
            S[parent, 2 * L + l]
            + 2.0 * u * (x * z - w * y)
            + 2.0 * v * (y * z + w * x)
            + r * (1.0 - 2.0 * (x * x + y * y))
        )
        # times (c, 0, p, t)
        p, t = 0.5 * ratio * pitch, 0.5 * ratio * yaw
        _set_unit(
            S,
            e,
            l,
            w * c - y * p - z * t,
            x * c + y * t - z * p,
            y * c + w * p - x * t,
            z * c + w * t + x * p,
            L,
        )


@inlined
def _set_unit(S: Array, e: int, l: int, w: float, x: float, y: float, z: float, L: int) -> None:
    # one Newton step towards length 1: rounding does not pile up along a chain
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    # of q and -q the one whose first non-zero entry is positive; + 0.0 makes a zero of -0.0
    lead = w if w != 0.0 else (x if x != 0.0 else (y if y != 0.0 else z))
    scale = -scale if lead < 0.0 else scale
    S[e, 3 * L + l], S[e, 4 * L + l] = scale * w + 0.0, scale * x + 0.0
    S[e, 5 * L + l], S[e, 6 * L + l] = scale * y + 0.0, scale * z + 0.0
