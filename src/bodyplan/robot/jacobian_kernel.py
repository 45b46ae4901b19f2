"""Poses and joint twists of target frames, from each target back to the base.

Everything is carried in the axes of the target: M holds the axes x, y, z of the current frame and its origin r,
seen from the target. A joint's column of paper *legs* eq. (6) then needs no rotation: a turn about an axis w
through r gives (r x w, w), a slide along u gives (u, 0). At the base, M is the inverse of the target's pose.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import BEND, REVOLUTE, STEP
from bodyplan.robot.values import COSINE, SINE, SLOPE, bend, drive_values, unpack
from bodyplan.spatial.coefficients import slope_coefficients
from bodyplan.spatial.lanes import fma, inlined, lane_count, matrix

# rows of M, and of the arc table A: rotation (9), end point (3), E of pitch (6), E of yaw (6)
X, Y, Z, R = 0, 3, 6, 9
END, E_PITCH, E_YAW, ARC_ROWS = 9, 12, 18, 24


@njit(cache=True, nogil=True)
def jacobian_kernel(
    batch: int,
    q: Array,
    base: Array,
    ints: IntArray,
    floats: Array,
    path: IntArray,
    position: Array,
    rotation: Array,
    twist: Array,
) -> int:
    """Poses and joint twists of C targets for ``batch`` configurations ``q`` (B n,); ``base`` (B, 7) or (1, 7).

    Fills ``position`` (B C 3) and ``rotation`` (B C 9) in the world of the base, ``twist`` (B K 6) body-fixed
    (v, omega) per unit joint rate; any shape of that size. Returns the index of a block with a non-finite
    coordinate, or -1. ``batch = True`` stands for one configuration, compiled without lanes.
    """
    L = lane_count(batch)
    V, n, C, S, K, most = ints[1], ints[2], path[0], path[1], path[2], path[3]
    element_i, element_f, drive_i, drive_f = unpack(ints, floats)
    starts, offsets, steps = path[4 : 5 + C], path[5 + C : 6 + 2 * C], matrix(path, 6 + 2 * C, S, STEP)
    position, rotation, twist = position.reshape(-1, 3), rotation.reshape(-1, 9), twist.reshape(-1, 6)
    D, H, A = np.empty((max(V, 1), 4 * L)), np.empty((1, 6 * L)), np.empty(ARC_ROWS * L)
    M, T = np.empty(12 * L), np.empty((max(most, 1), 6 * L))
    for first in range(0, batch, L):
        if not drive_values(q, n, first, batch - 1, drive_i, drive_f, 1.0, D, batch):
            return first
        lanes = min(L, batch - first)
        for c in range(C):
            for l in range(12 * L):
                M[l] = 0.0
            for l in range(L):
                M[X * L + l] = M[(Y + 1) * L + l] = M[(Z + 2) * L + l] = 1.0
            for i in range(starts[c], starts[c + 1]):
                _step(steps, i, element_i, element_f, drive_f, D, H, A, M, T, batch)
            for l in range(lanes):
                b = first + l
                for k in range(offsets[c + 1] - offsets[c]):
                    for r in range(6):
                        twist[b * K + offsets[c] + k, r] = T[k, r * L + l]
                _store_pose(M, l, base, min(b, base.shape[0] - 1), position, rotation, b * C + c, L)
    return -1


@inlined
def _step(
    steps: IntArray,
    i: int,
    element_i: IntArray,
    element_f: Array,
    drive_f: Array,
    D: Array,
    H: Array,
    A: Array,
    M: Array,
    T: Array,
    wide: bool,
) -> None:
    """Undo one element: M from the frame at its end to the frame at its start, writing its columns."""
    what, e = steps[i, 0], steps[i, 1]
    theta, d, a, epsilon = element_i[e, 2], element_i[e, 3], element_i[e, 4], element_i[e, 5]
    if what == BEND:
        bend(element_i, element_f, D, e, H, wide)
        _arc_rows(H, element_f[e, 2], A, wide)
        if steps[i, 3] >= 0:
            _arc_column(M, A, E_YAW, D, d, T, steps[i, 3], steps[i, 7], wide)
        if steps[i, 2] >= 0:
            _arc_column(M, A, E_PITCH, D, theta, T, steps[i, 2], steps[i, 6], wide)
        _arc_back(M, A, wide)
        return
    if steps[i, 5] >= 0:
        _turn_column(M, X, D, epsilon, T, steps[i, 5], steps[i, 9], wide)
        _turn_driven(M, Y, Z, D, epsilon, wide)
    elif element_f[e, 7] != 0.0:
        _turn_fixed(M, Y, Z, element_f[e, 6], element_f[e, 7], wide)
    if what == REVOLUTE:
        _revolute(M, D, theta, drive_f[theta, 1], element_f[e, 1], element_f[e, 2], T, steps[i, 2], wide)
        return
    if steps[i, 4] >= 0:
        _slide_column(M, X, D, a, T, steps[i, 4], steps[i, 8], wide)
        _slide_driven(M, X, D, a, wide)
    elif element_f[e, 2] != 0.0:
        _slide_fixed(M, X, element_f[e, 2], wide)
    if steps[i, 3] >= 0:
        _slide_column(M, Z, D, d, T, steps[i, 3], steps[i, 7], wide)
        _slide_driven(M, Z, D, d, wide)
    elif element_f[e, 1] != 0.0:
        _slide_fixed(M, Z, element_f[e, 1], wide)
    if steps[i, 2] >= 0:
        _turn_column(M, Z, D, theta, T, steps[i, 2], steps[i, 6], wide)
        _turn_driven(M, X, Y, D, theta, wide)
    elif element_f[e, 5] != 0.0:
        _turn_fixed(M, X, Y, element_f[e, 4], element_f[e, 5], wide)


@inlined
def _revolute(
    M: Array, D: Array, v: int, scale: float, d: float, a: float, T: Array, column: int, wide: bool
) -> None:
    """The usual row in one sweep: slide by constant d and a, the column of theta, turn by theta."""
    L = lane_count(wide)
    for l in range(L):
        s, c = D[v, SINE * L + l], D[v, COSINE * L + l]
        x0, x1, x2 = M[l], M[L + l], M[2 * L + l]
        y0, y1, y2 = M[3 * L + l], M[4 * L + l], M[5 * L + l]
        z0, z1, z2 = M[6 * L + l], M[7 * L + l], M[8 * L + l]
        r0 = fma(-a, x0, fma(-d, z0, M[9 * L + l]))
        r1 = fma(-a, x1, fma(-d, z1, M[10 * L + l]))
        r2 = fma(-a, x2, fma(-d, z2, M[11 * L + l]))
        M[9 * L + l], M[10 * L + l], M[11 * L + l] = r0, r1, r2
        M[l], M[L + l], M[2 * L + l] = fma(c, x0, -(s * y0)), fma(c, x1, -(s * y1)), fma(c, x2, -(s * y2))
        M[3 * L + l], M[4 * L + l], M[5 * L + l] = fma(s, x0, c * y0), fma(s, x1, c * y1), fma(s, x2, c * y2)
        z0, z1, z2 = scale * z0, scale * z1, scale * z2
        T[column, l] = fma(r1, z2, -(r2 * z1))
        T[column, L + l] = fma(r2, z0, -(r0 * z2))
        T[column, 2 * L + l] = fma(r0, z1, -(r1 * z0))
        T[column, 3 * L + l], T[column, 4 * L + l], T[column, 5 * L + l] = z0, z1, z2


@inlined
def _turn_fixed(M: Array, i: int, j: int, c: float, s: float, wide: bool) -> None:
    """Axes i and j turned back by a constant angle."""
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            x, y = M[(i + r) * L + l], M[(j + r) * L + l]
            M[(i + r) * L + l], M[(j + r) * L + l] = fma(c, x, -(s * y)), fma(s, x, c * y)


@inlined
def _turn_driven(M: Array, i: int, j: int, D: Array, v: int, wide: bool) -> None:
    """Axes i and j turned back by the angle of drive v."""
    L = lane_count(wide)
    for l in range(L):
        s, c = D[v, SINE * L + l], D[v, COSINE * L + l]
        for r in range(3):
            x, y = M[(i + r) * L + l], M[(j + r) * L + l]
            M[(i + r) * L + l], M[(j + r) * L + l] = fma(c, x, -(s * y)), fma(s, x, c * y)


@inlined
def _slide_fixed(M: Array, axis: int, length: float, wide: bool) -> None:
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            M[(R + r) * L + l] = fma(-length, M[(axis + r) * L + l], M[(R + r) * L + l])


@inlined
def _slide_driven(M: Array, axis: int, D: Array, v: int, wide: bool) -> None:
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            M[(R + r) * L + l] = fma(-D[v, l], M[(axis + r) * L + l], M[(R + r) * L + l])


@inlined
def _turn_column(M: Array, axis: int, D: Array, v: int, T: Array, column: int, first: int, wide: bool) -> None:
    """A turn about an axis through r: (r x w, w), times the slope of its drive."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        g = D[v, SLOPE * L + l]
        x, y, z = g * M[axis * L + l], g * M[(axis + 1) * L + l], g * M[(axis + 2) * L + l]
        r0, r1, r2 = M[R * L + l], M[(R + 1) * L + l], M[(R + 2) * L + l]
        T[column, l] += fma(r1, z, -(r2 * y))
        T[column, L + l] += fma(r2, x, -(r0 * z))
        T[column, 2 * L + l] += fma(r0, y, -(r1 * x))
        T[column, 3 * L + l] += x
        T[column, 4 * L + l] += y
        T[column, 5 * L + l] += z


@inlined
def _slide_column(M: Array, axis: int, D: Array, v: int, T: Array, column: int, first: int, wide: bool) -> None:
    """A slide along an axis u: (u, 0), times the slope of its drive."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        for r in range(3):
            T[column, r * L + l] += D[v, SLOPE * L + l] * M[(axis + r) * L + l]


@inlined
def _arc_rows(H: Array, length: float, A: Array, wide: bool) -> None:
    """Rotation, end point and E of an arc (see :func:`bodyplan.robot.rows.arc_matrices`) into A (24 L,)."""
    L = lane_count(wide)
    for l in range(L):
        p, y, ratio = H[0, l], H[0, L + l], H[0, 5 * L + l]
        a, b = ratio * H[0, 4 * L + l], 0.5 * ratio * ratio
        c, a1, b1 = slope_coefficients(p * p + y * y, a, b)
        r00, r01, r02 = 1.0 - b * (p * p + y * y), -a * y, a * p
        r10, r11, r12 = a * y, 1.0 - b * y * y, b * p * y
        r20, r21, r22 = -a * p, b * p * y, 1.0 - b * p * p
        A[l], A[L + l], A[2 * L + l] = r00, r01, r02
        A[3 * L + l], A[4 * L + l], A[5 * L + l] = r10, r11, r12
        A[6 * L + l], A[7 * L + l], A[8 * L + l] = r20, r21, r22
        A[9 * L + l], A[10 * L + l], A[11 * L + l] = length * a, length * b * y, -length * b * p
        # v: the slope of the end point, turned into the end frame; omega: columns of V(phi)^T
        x0, x1, x2 = length * p * a1, length * p * y * b1, -length * (b + p * p * b1)
        A[12 * L + l] = r00 * x0 + r10 * x1 + r20 * x2
        A[13 * L + l] = r01 * x0 + r11 * x1 + r21 * x2
        A[14 * L + l] = r02 * x0 + r12 * x1 + r22 * x2
        A[15 * L + l], A[16 * L + l], A[17 * L + l] = b * y, 1.0 - c * y * y, c * p * y
        x0, x1, x2 = length * y * a1, length * (b + y * y * b1), -length * p * y * b1
        A[18 * L + l] = r00 * x0 + r10 * x1 + r20 * x2
        A[19 * L + l] = r01 * x0 + r11 * x1 + r21 * x2
        A[20 * L + l] = r02 * x0 + r12 * x1 + r22 * x2
        A[21 * L + l], A[22 * L + l], A[23 * L + l] = -b * p, c * p * y, 1.0 - c * p * p


@inlined
def _arc_column(
    M: Array, A: Array, row: int, D: Array, v: int, T: Array, column: int, first: int, wide: bool
) -> None:
    """E of one variable of an arc, carried to the target: (M v + r x M omega, M omega)."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        g = D[v, SLOPE * L + l]
        vx, vy, vz = g * A[row * L + l], g * A[(row + 1) * L + l], g * A[(row + 2) * L + l]
        wx, wy, wz = g * A[(row + 3) * L + l], g * A[(row + 4) * L + l], g * A[(row + 5) * L + l]
        x = M[l] * wx + M[3 * L + l] * wy + M[6 * L + l] * wz
        y = M[L + l] * wx + M[4 * L + l] * wy + M[7 * L + l] * wz
        z = M[2 * L + l] * wx + M[5 * L + l] * wy + M[8 * L + l] * wz
        r0, r1, r2 = M[9 * L + l], M[10 * L + l], M[11 * L + l]
        T[column, l] += M[l] * vx + M[3 * L + l] * vy + M[6 * L + l] * vz + r1 * z - r2 * y
        T[column, L + l] += M[L + l] * vx + M[4 * L + l] * vy + M[7 * L + l] * vz + r2 * x - r0 * z
        T[column, 2 * L + l] += M[2 * L + l] * vx + M[5 * L + l] * vy + M[8 * L + l] * vz + r0 * y - r1 * x
        T[column, 3 * L + l] += x
        T[column, 4 * L + l] += y
        T[column, 5 * L + l] += z


@inlined
def _arc_back(M: Array, A: Array, wide: bool) -> None:
    """M from the end of an arc to its start."""
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            x, y, z = M[r * L + l], M[(3 + r) * L + l], M[(6 + r) * L + l]
            px = A[l] * x + A[L + l] * y + A[2 * L + l] * z
            py = A[3 * L + l] * x + A[4 * L + l] * y + A[5 * L + l] * z
            pz = A[6 * L + l] * x + A[7 * L + l] * y + A[8 * L + l] * z
            M[r * L + l], M[(3 + r) * L + l], M[(6 + r) * L + l] = px, py, pz
            M[(9 + r) * L + l] -= A[9 * L + l] * px + A[10 * L + l] * py + A[11 * L + l] * pz


@inlined
def _store_pose(
    M: Array, l: int, base: Array, b: int, position: Array, rotation: Array, row: int, L: int
) -> None:
    """Lane ``l``: base seen from the target -> target in the world of the base."""
    w, x, y, z = base[b, 3], base[b, 4], base[b, 5], base[b, 6]
    r0, r1, r2 = M[9 * L + l], M[10 * L + l], M[11 * L + l]
    p0 = -(M[l] * r0 + M[L + l] * r1 + M[2 * L + l] * r2)
    p1 = -(M[3 * L + l] * r0 + M[4 * L + l] * r1 + M[5 * L + l] * r2)
    p2 = -(M[6 * L + l] * r0 + M[7 * L + l] * r1 + M[8 * L + l] * r2)
    for i in range(3):
        if i == 0:
            c0, c1, c2 = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        elif i == 1:
            c0, c1, c2 = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        else:
            c0, c1, c2 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        position[row, i] = base[b, i] + c0 * p0 + c1 * p1 + c2 * p2
        for j in range(3):
            rotation[row, 3 * i + j] = c0 * M[j * L + l] + c1 * M[(3 + j) * L + l] + c2 * M[(6 + j) * L + l]
