"""The kinematic recursion on lanes: blocks of LANES configurations, the lane as the innermost loop.

:func:`forward_kernel` goes from the base out and leaves the pose of every frame. :func:`jacobian_kernel` goes
from each target frame back to the base and leaves its pose and its body-fixed joint twists, that is the
columns of Q in paper *legs* eq. (6): carried in the axes of the target, a column needs no rotation.

Row: T = Rz(theta) Tz(d) Tx(a) Rx(epsilon). Arc: the rotation vector (0, pitch, yaw) and the end point
length * (A, B yaw, -B pitch), see :mod:`bodyplan.spatial.coefficients`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.robot.tables import ARC, WHEEL
from bodyplan.spatial.coefficients import SERIES_BELOW, b_slope_series, c_series

LANES = 8
# Rows of the value table of one element. Row: cos theta, sin theta, d, a, cos epsilon, sin epsilon.
# Arc: pitch, yaw, length.
VALUES = 6
# Rows of one arc: rotation (9), end point (3), E columns of pitch and yaw: v, omega, v, omega (12).
ARC_ROWS = 24


@njit(cache=True, nogil=True)
def constant_values(element_i, element_f, half, U):
    """Fill the value table U (F, 6, L) with the constant variables; angles times ``half``."""
    for e in range(1, element_i.shape[0]):
        theta, d, a, epsilon = element_f[e, 0], element_f[e, 1], element_f[e, 2], element_f[e, 3]
        for l in range(LANES):
            if element_i[e, 0] == ARC:
                U[e, 0, l], U[e, 1, l], U[e, 2, l] = theta, d, a
            else:
                U[e, 0, l], U[e, 1, l] = math.cos(half * theta), math.sin(half * theta)
                U[e, 2, l], U[e, 3, l] = d, a
                U[e, 4, l], U[e, 5, l] = math.cos(half * epsilon), math.sin(half * epsilon)


@njit(cache=True, nogil=True)
def driven_values(Q, element_i, drive_i, drive_f, half, U, W):
    """Fill U with the driven variables of one block Q (n, L), and W (V, L) with d(variable)/dq."""
    for v in range(drive_i.shape[0]):
        j, e, k = drive_i[v, 0], drive_i[v, 2], drive_i[v, 3]
        f0, f1 = drive_f[v, 0], drive_f[v, 1]
        for l in range(LANES):
            q = Q[j, l]
            if drive_i[v, 1] == WHEEL:
                value, slope = f0 + f1 * math.cos(0.5 * q), -0.5 * f1 * math.sin(0.5 * q)
            else:
                value, slope = f0 + f1 * q, f1
            W[v, l] = slope
            if element_i[e, 0] == ARC:
                U[e, k, l] = value
            elif k == 0:
                U[e, 0, l], U[e, 1, l] = math.cos(half * value), math.sin(half * value)
            elif k == 3:
                U[e, 4, l], U[e, 5, l] = math.cos(half * value), math.sin(half * value)
            else:
                U[e, 1 + k, l] = value


@njit(cache=True, nogil=True)
def load_block(q, first, Q):
    """Copy configurations ``first``... into Q (n, L), the last one repeated; index of a non-finite one or -1."""
    bad = -1
    last = q.shape[0] - 1
    for l in range(LANES):
        b = min(first + l, last)
        for j in range(q.shape[1]):
            value = q[b, j]
            Q[j, l] = value
            if not math.isfinite(value) and bad < 0:
                bad = b
    return bad


@njit(cache=True, nogil=True)
def arc_coefficients(pitch, yaw):
    """A, B, C and the slopes dA/dx / x, dB/dx / x at x = |(pitch, yaw)|."""
    z = pitch * pitch + yaw * yaw
    x = math.sqrt(z)
    h = 0.5 * x
    safe = x if x > 0.0 else 1.0
    a = math.sin(x) / safe if x > 0.0 else 1.0
    s = math.sin(h) / (0.5 * safe) if x > 0.0 else 1.0
    b = 0.5 * s * s
    if z < SERIES_BELOW:
        c, b1 = c_series(z), b_slope_series(z)
    else:
        c, b1 = (1.0 - a) / z, (a - 2.0 * b) / z
    return a, b, c, c - b, b1


@njit(cache=True, nogil=True)
def arc_rows(U, e, A):
    """Rotation, end point and E of arc ``e`` for one block, into A (24, L)."""
    for l in range(LANES):
        p, y, length = U[e, 0, l], U[e, 1, l], U[e, 2, l]
        a, b, c, a1, b1 = arc_coefficients(p, y)
        # exp([phi]) with phi = (0, p, y)
        r00, r01, r02 = 1.0 - b * (p * p + y * y), -a * y, a * p
        r10, r11, r12 = a * y, 1.0 - b * y * y, b * p * y
        r20, r21, r22 = -a * p, b * p * y, 1.0 - b * p * p
        A[0, l], A[1, l], A[2, l] = r00, r01, r02
        A[3, l], A[4, l], A[5, l] = r10, r11, r12
        A[6, l], A[7, l], A[8, l] = r20, r21, r22
        A[9, l], A[10, l], A[11, l] = length * a, length * b * y, -length * b * p
        # d(end point)/d(pitch), d/d(yaw), turned into the end frame
        x0, x1, x2 = length * p * a1, length * p * y * b1, -length * (b + p * p * b1)
        A[12, l] = r00 * x0 + r10 * x1 + r20 * x2
        A[13, l] = r01 * x0 + r11 * x1 + r21 * x2
        A[14, l] = r02 * x0 + r12 * x1 + r22 * x2
        A[15, l], A[16, l], A[17, l] = b * y, 1.0 - c * y * y, c * p * y
        x0, x1, x2 = length * y * a1, length * (b + y * y * b1), -length * p * y * b1
        A[18, l] = r00 * x0 + r10 * x1 + r20 * x2
        A[19, l] = r01 * x0 + r11 * x1 + r21 * x2
        A[20, l] = r02 * x0 + r12 * x1 + r22 * x2
        A[21, l], A[22, l], A[23, l] = -b * p, c * p * y, 1.0 - c * p * p


@njit(cache=True, nogil=True)
def forward_kernel(q, base, element_i, element_f, drive_i, drive_f, out):
    """Poses ``out`` (B, F, 7) of every frame at ``q`` (B, n), base (B, 7) or (1, 7); index of a bad q or -1."""
    B, n = q.shape
    F = element_i.shape[0]
    U = np.empty((F, VALUES, LANES))
    W = np.empty((max(drive_i.shape[0], 1), LANES))
    Q = np.empty((max(n, 1), LANES))
    S = np.empty((F, 7, LANES))
    constant_values(element_i, element_f, 0.5, U)
    for first in range(0, B, LANES):
        bad = load_block(q, first, Q)
        if bad >= 0:
            return bad
        driven_values(Q, element_i, drive_i, drive_f, 0.5, U, W)
        for l in range(LANES):
            b = min(first + l, base.shape[0] - 1)
            for k in range(7):
                S[0, k, l] = base[b, k]
        for e in range(1, F):
            if element_i[e, 0] == ARC:
                _arc_out(S, e, element_i[e, 1], U)
            else:
                _row_out(S, e, element_i[e, 1], U)
        for l in range(min(LANES, B - first)):
            for e in range(F):
                sign = 1.0
                for k in range(3, 7):
                    if S[e, k, l] != 0.0:
                        sign = 1.0 if S[e, k, l] > 0.0 else -1.0
                        break
                for k in range(3):
                    out[first + l, e, k] = S[e, k, l]
                for k in range(3, 7):
                    out[first + l, e, k] = sign * S[e, k, l] + 0.0
    return -1


@njit(cache=True, nogil=True)
def _row_out(S, e, parent, U):
    for l in range(LANES):
        w, x, y, z = S[parent, 3, l], S[parent, 4, l], S[parent, 5, l], S[parent, 6, l]
        c, s, d, a = U[e, 0, l], U[e, 1, l], U[e, 2, l], U[e, 3, l]
        w, x, y, z = w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s
        S[e, 0, l] = S[parent, 0, l] + d * 2.0 * (x * z + w * y) + a * (1.0 - 2.0 * (y * y + z * z))
        S[e, 1, l] = S[parent, 1, l] + d * 2.0 * (y * z - w * x) + a * 2.0 * (x * y + w * z)
        S[e, 2, l] = S[parent, 2, l] + d * (1.0 - 2.0 * (x * x + y * y)) + a * 2.0 * (x * z - w * y)
        c, s = U[e, 4, l], U[e, 5, l]
        w, x, y, z = w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s
        _store_unit(S, e, l, w, x, y, z)


@njit(cache=True, nogil=True)
def _arc_out(S, e, parent, U):
    for l in range(LANES):
        w, x, y, z = S[parent, 3, l], S[parent, 4, l], S[parent, 5, l], S[parent, 6, l]
        p, t, length = U[e, 0, l], U[e, 1, l], U[e, 2, l]
        a, b, _, _, _ = arc_coefficients(p, t)
        u, v, r = length * a, length * b * t, -length * b * p
        S[e, 0, l] = (
            S[parent, 0, l]
            + u * (1 - 2 * (y * y + z * z))
            + 2 * v * (x * y - w * z)
            + 2 * r * (x * z + w * y)
        )
        S[e, 1, l] = (
            S[parent, 1, l]
            + 2 * u * (x * y + w * z)
            + v * (1 - 2 * (x * x + z * z))
            + 2 * r * (y * z - w * x)
        )
        S[e, 2, l] = (
            S[parent, 2, l]
            + 2 * u * (x * z - w * y)
            + 2 * v * (y * z + w * x)
            + r * (1 - 2 * (x * x + y * y))
        )
        h = 0.5 * math.sqrt(p * p + t * t)
        c = math.cos(h)
        s = 0.5 * (math.sin(h) / h) if h > 0.0 else 0.5
        p, t = s * p, s * t
        # (w, x, y, z) times (c, 0, p, t)
        _store_unit(
            S,
            e,
            l,
            w * c - y * p - z * t,
            x * c + y * t - z * p,
            y * c + w * p - x * t,
            z * c + w * t + x * p,
        )


@njit(cache=True, nogil=True)
def _store_unit(S, e, l, w, x, y, z):
    # one Newton step towards length 1: rounding does not pile up along the chain
    scale = 1.5 - 0.5 * (w * w + x * x + y * y + z * z)
    S[e, 3, l], S[e, 4, l], S[e, 5, l], S[e, 6, l] = scale * w, scale * x, scale * y, scale * z


@njit(cache=True, nogil=True)
def jacobian_kernel(
    q, base, element_i, element_f, drive_i, drive_f, starts, steps, offsets, position, rotation, twist
):
    """Pose and joint twists of C target frames at ``q`` (B, n): ``position`` (B, C, 3) and ``rotation``
    (B, C, 3, 3) in the world of ``base`` (B or 1, 7), ``twist`` (B, K, 6) body-fixed (v, omega) per unit joint
    rate. Returns the index of a non-finite configuration or -1.
    """
    B, n = q.shape
    F, C = element_i.shape[0], starts.shape[0] - 1
    U = np.empty((F, VALUES, LANES))
    W = np.empty((max(drive_i.shape[0], 1), LANES))
    Q = np.empty((max(n, 1), LANES))
    A = np.empty((ARC_ROWS, LANES))
    # axes of the current frame seen from the target, x 0..2, y 3..5, z 6..8, and its origin 9..11
    M = np.empty((12, LANES))
    T = np.empty((max(offsets[C], 1), 6, LANES))
    constant_values(element_i, element_f, 1.0, U)
    for first in range(0, B, LANES):
        bad = load_block(q, first, Q)
        if bad >= 0:
            return bad
        driven_values(Q, element_i, drive_i, drive_f, 1.0, U, W)
        lanes = min(LANES, B - first)
        for c in range(C):
            M[:] = 0.0
            for l in range(LANES):
                M[0, l] = M[4, l] = M[8, l] = 1.0
            for i in range(starts[c], starts[c + 1]):
                if element_i[steps[i, 0], 0] == ARC:
                    arc_rows(U, steps[i, 0], A)
                    _arc_back(M, A, W, T, element_i, steps, i)
                else:
                    _row_back(M, U, W, T, element_i, steps, i)
            for l in range(lanes):
                b = first + l
                _store_pose(M, l, base, min(b, base.shape[0] - 1), position[b, c], rotation[b, c])
                for k in range(offsets[c], offsets[c + 1]):
                    for r in range(6):
                        twist[b, k, r] = T[k, r, l]
    return -1


@njit(cache=True, nogil=True)
def _row_back(M, U, W, T, element_i, steps, i):
    e = steps[i, 0]
    if steps[i, 4] >= 0:
        _turning(M, 0, W, element_i[e, 5], T, steps[i, 4], steps[i, 8])
    _turn(M, 3, 6, U, e, 4)
    if steps[i, 3] >= 0:
        _sliding(M, 0, W, element_i[e, 4], T, steps[i, 3], steps[i, 7])
    if steps[i, 2] >= 0:
        _sliding(M, 6, W, element_i[e, 3], T, steps[i, 2], steps[i, 6])
    for l in range(LANES):
        d, a = U[e, 2, l], U[e, 3, l]
        for k in range(3):
            M[9 + k, l] -= a * M[k, l] + d * M[6 + k, l]
    if steps[i, 1] >= 0:
        _turning(M, 6, W, element_i[e, 2], T, steps[i, 1], steps[i, 5])
    _turn(M, 0, 3, U, e, 0)


@njit(cache=True, nogil=True)
def _turn(M, i, j, U, e, k):
    """Axes i and j turned back by the angle whose cosine and sine are rows k, k + 1 of U[e]."""
    for l in range(LANES):
        c, s = U[e, k, l], U[e, k + 1, l]
        for r in range(3):
            x, y = M[i + r, l], M[j + r, l]
            M[i + r, l] = c * x - s * y
            M[j + r, l] = s * x + c * y


@njit(cache=True, nogil=True)
def _turning(M, axis, W, v, T, column, first):
    """Column of a rotation about an axis through the current origin: omega = axis, v = origin x omega."""
    for l in range(LANES):
        x, y, z = M[axis, l] * W[v, l], M[axis + 1, l] * W[v, l], M[axis + 2, l] * W[v, l]
        _put(
            T,
            column,
            first,
            l,
            M[10, l] * z - M[11, l] * y,
            M[11, l] * x - M[9, l] * z,
            M[9, l] * y - M[10, l] * x,
            x,
            y,
            z,
        )


@njit(cache=True, nogil=True)
def _sliding(M, axis, W, v, T, column, first):
    """Column of a translation along an axis."""
    for l in range(LANES):
        _put(
            T,
            column,
            first,
            l,
            M[axis, l] * W[v, l],
            M[axis + 1, l] * W[v, l],
            M[axis + 2, l] * W[v, l],
            0.0,
            0.0,
            0.0,
        )


@njit(cache=True, nogil=True)
def _put(T, column, first, l, a, b, c, x, y, z):
    if first:
        T[column, 0, l], T[column, 1, l], T[column, 2, l] = a, b, c
        T[column, 3, l], T[column, 4, l], T[column, 5, l] = x, y, z
    else:
        T[column, 0, l] += a
        T[column, 1, l] += b
        T[column, 2, l] += c
        T[column, 3, l] += x
        T[column, 4, l] += y
        T[column, 5, l] += z


@njit(cache=True, nogil=True)
def _arc_back(M, A, W, T, element_i, steps, i):
    e = steps[i, 0]
    # yaw is variable 1, pitch is variable 0 (last first, as build_paths marks first uses); six rows of E each
    for k in (1, 0):
        if steps[i, 1 + k] >= 0:
            g = 12 + 6 * k
            v = element_i[e, 2 + k]
            for l in range(LANES):
                s = W[v, l]
                vx, vy, vz = s * A[g, l], s * A[g + 1, l], s * A[g + 2, l]
                wx, wy, wz = s * A[g + 3, l], s * A[g + 4, l], s * A[g + 5, l]
                x = M[0, l] * wx + M[3, l] * wy + M[6, l] * wz
                y = M[1, l] * wx + M[4, l] * wy + M[7, l] * wz
                z = M[2, l] * wx + M[5, l] * wy + M[8, l] * wz
                _put(
                    T,
                    steps[i, 1 + k],
                    steps[i, 5 + k],
                    l,
                    M[0, l] * vx + M[3, l] * vy + M[6, l] * vz + M[10, l] * z - M[11, l] * y,
                    M[1, l] * vx + M[4, l] * vy + M[7, l] * vz + M[11, l] * x - M[9, l] * z,
                    M[2, l] * vx + M[5, l] * vy + M[8, l] * vz + M[9, l] * y - M[10, l] * x,
                    x,
                    y,
                    z,
                )
    for l in range(LANES):
        tx, ty, tz = A[9, l], A[10, l], A[11, l]
        for k in range(3):
            x, y, z = M[k, l], M[3 + k, l], M[6 + k, l]
            px = A[0, l] * x + A[1, l] * y + A[2, l] * z
            py = A[3, l] * x + A[4, l] * y + A[5, l] * z
            pz = A[6, l] * x + A[7, l] * y + A[8, l] * z
            M[k, l], M[3 + k, l], M[6 + k, l] = px, py, pz
            M[9 + k, l] -= tx * px + ty * py + tz * pz


@njit(cache=True, nogil=True)
def _store_pose(M, l, base, b, position, rotation):
    """Axes and origin of the base seen from the target -> pose of the target in the world of the base."""
    w, x, y, z = base[b, 3], base[b, 4], base[b, 5], base[b, 6]
    px = -(M[0, l] * M[9, l] + M[1, l] * M[10, l] + M[2, l] * M[11, l])
    py = -(M[3, l] * M[9, l] + M[4, l] * M[10, l] + M[5, l] * M[11, l])
    pz = -(M[6, l] * M[9, l] + M[7, l] * M[10, l] + M[8, l] * M[11, l])
    for i in range(3):
        if i == 0:
            r0, r1, r2 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        elif i == 1:
            r0, r1, r2 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        else:
            r0, r1, r2 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        position[i] = base[b, i] + r0 * px + r1 * py + r2 * pz
        for j in range(3):
            rotation[i, j] = r0 * M[j, l] + r1 * M[3 + j, l] + r2 * M[6 + j, l]
