"""Poses and joint twists of target frames, from each target back to the base.

Everything is carried in the axes of the target: M holds the axes x, y, z of the current frame and its origin
r, seen from the target. A joint's column of paper *legs* eq. (6) then needs no rotation: a turn about an axis
w through r gives (r x w, w), a slide along u gives (u, 0). At the base, M is the target's pose inverted.
"""

# ruff: noqa: E741 - l is the lane, everywhere
from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import BEND, DRIVE_F, DRIVE_I, ELEMENT_F, ELEMENT_I, HEAD, REVOLUTE, STEP
from bodyplan.robot.values import (
    COSINE,
    COSINE_HALF,
    PITCH,
    RATIO,
    SINE,
    SLOPE,
    YAW,
    bend,
    drive_values,
)
from bodyplan.spatial.coefficients import c_coefficient
from bodyplan.spatial.lanes import fma, inlined, lane_count, load, strip, table, unload

# rows of the flat table W: M, the axes x, y, z and the origin r; an arc's rotation (9), end point (3), E of
# pitch (6) and of yaw (6)
X, Y, Z, R, ARC_TURN, ARC_END, E_PITCH, E_YAW, WORK = 0, 3, 6, 9, 12, 21, 24, 30, 36


@njit(cache=True, nogil=True, error_model="numpy")
def jacobian_kernel(
    batch: int,
    q: Array,
    base: Array,
    ints: IntArray,
    floats: Array,
    position: Array,
    rotation: Array,
    twist: Array,
) -> int:
    """Poses and joint twists of C targets for ``batch`` configurations ``q`` (B n,); ``base`` (B, 7), (1, 7)
    or, for the identity, (0, 7).

    Fills ``position`` (B C 3) and ``rotation`` (B C 9) in the world of the base, ``twist`` (B K 6) body-fixed
    (v, omega) per unit joint rate; any shape of that size. Returns the index of a block with a non-finite
    coordinate, or -1. ``batch = True`` stands for one configuration, compiled without lanes.
    """
    L = lane_count(batch)
    B, V, n, C, K, most = int(batch), ints[1], ints[2], ints[3], ints[5], ints[6]
    starts = HEAD + ints[0] * ELEMENT_I + V * DRIVE_I
    offsets = starts + C + 1
    steps = offsets + C + 1
    all_q, positions = strip(q, 0, B * n), strip(position, 0, B * C * 3)
    rotations, twists = strip(rotation, 0, B * C * 9), strip(twist, 0, B * K * 6)
    # drives D, columns T of one target, rotations and positions of all, the rows W listed above, a sum, q
    scratch = np.empty((6 * (V + 1 + most) + 12 * C + WORK + 1 + n) * L)
    at_T, at_turn = 6 * (V + 1) * L, 6 * (V + 1 + most) * L
    at_place, at_W = at_turn + 9 * C * L, at_turn + 12 * C * L
    D, T = table(scratch, 0, V + 1, 6 * L), table(scratch, at_T, most, 6 * L)
    turn, place = table(scratch, at_turn, C, 9 * L), table(scratch, at_place, C, 3 * L)
    W, total = strip(scratch, at_W, WORK * L), strip(scratch, at_W + WORK * L, L)
    values = table(scratch, at_W + (WORK + 1) * L, n, L)
    for first in range(0, B, L):
        lanes = min(L, B - first)
        load(all_q, n * first, n, n, lanes, values, batch)
        if not drive_values(values, ints, floats, 1.0, D, total, batch):
            return first
        for c in range(C):
            for k in range(12):
                for l in range(L):
                    W[k * L + l] = 1.0 if k == X or k == Y + 1 or k == Z + 2 else 0.0
            # undo one element after the other: M from the frame at its end to the frame at its start
            for step in range(ints[starts + c], ints[starts + c + 1]):
                i = steps + STEP * step
                f = ELEMENT_F * ints[i + 1]
                theta, d, a, epsilon = ints[i + 2], ints[i + 3], ints[i + 4], ints[i + 5]
                if ints[i] == BEND:
                    bend(theta, d, floats[f], floats[f + 1], D, batch)
                    _arc_rows(D, floats[f + 2], W, batch)
                    if d >= 0:
                        _arc_column(W, E_YAW, D, d, T, ints[i + 7], ints[i + 11], batch)
                    if theta >= 0:
                        _arc_column(W, E_PITCH, D, theta, T, ints[i + 6], ints[i + 10], batch)
                    _arc_back(W, batch)
                    continue
                if epsilon >= 0:
                    _turn_column(W, X, D, epsilon, T, ints[i + 9], ints[i + 13], batch)
                    _turn_driven(W, Y, Z, D, epsilon, batch)
                elif floats[f + 7] != 0.0:
                    _turn_fixed(W, Y, Z, floats[f + 6], floats[f + 7], batch)
                if ints[i] == REVOLUTE:
                    g = ints[0] * ELEMENT_F + theta * DRIVE_F + 1
                    _revolute(W, D, theta, floats[g], floats[f + 1], floats[f + 2], T, ints[i + 6], batch)
                    continue
                if a >= 0:
                    _slide_column(W, X, D, a, T, ints[i + 8], ints[i + 12], batch)
                    _slide_driven(W, X, D, a, batch)
                elif floats[f + 2] != 0.0:
                    _slide_fixed(W, X, floats[f + 2], batch)
                if d >= 0:
                    _slide_column(W, Z, D, d, T, ints[i + 7], ints[i + 11], batch)
                    _slide_driven(W, Z, D, d, batch)
                elif floats[f + 1] != 0.0:
                    _slide_fixed(W, Z, floats[f + 1], batch)
                if theta >= 0:
                    _turn_column(W, Z, D, theta, T, ints[i + 6], ints[i + 10], batch)
                    _turn_driven(W, X, Y, D, theta, batch)
                elif floats[f + 5] != 0.0:
                    _turn_fixed(W, X, Y, floats[f + 4], floats[f + 5], batch)
            _invert(W, turn, place, c, batch)
            if base.shape[0] > 0:
                _to_world(turn, place, c, base, first, batch)
            column, width = first * K + ints[offsets + c], ints[offsets + c + 1] - ints[offsets + c]
            unload(scratch, at_T, 6 * width, lanes, twists, 6 * column, 6 * K, batch)
        unload(scratch, at_turn, 9 * C, lanes, rotations, 9 * C * first, 9 * C, batch)
        unload(scratch, at_place, 3 * C, lanes, positions, 3 * C * first, 3 * C, batch)
    scratch[0] = 0.0
    return -1


@inlined
def _revolute(W: Array, D: Array, v: int, scale: float, d: float, a: float, T: Array, column: int, wide: int) -> None:
    """The usual row in one sweep: slide by constant d and a, the column of theta, turn by theta."""
    L = lane_count(wide)
    for l in range(L):
        s, c = D[v, SINE * L + l], D[v, COSINE * L + l]
        x0, x1, x2 = W[l], W[L + l], W[2 * L + l]
        y0, y1, y2 = W[3 * L + l], W[4 * L + l], W[5 * L + l]
        z0, z1, z2 = W[6 * L + l], W[7 * L + l], W[8 * L + l]
        r0 = fma(-a, x0, fma(-d, z0, W[9 * L + l]))
        r1 = fma(-a, x1, fma(-d, z1, W[10 * L + l]))
        r2 = fma(-a, x2, fma(-d, z2, W[11 * L + l]))
        W[9 * L + l], W[10 * L + l], W[11 * L + l] = r0, r1, r2
        W[l], W[L + l], W[2 * L + l] = fma(c, x0, -(s * y0)), fma(c, x1, -(s * y1)), fma(c, x2, -(s * y2))
        W[3 * L + l], W[4 * L + l], W[5 * L + l] = fma(s, x0, c * y0), fma(s, x1, c * y1), fma(s, x2, c * y2)
        z0, z1, z2 = scale * z0, scale * z1, scale * z2
        T[column, l] = fma(r1, z2, -(r2 * z1))
        T[column, L + l] = fma(r2, z0, -(r0 * z2))
        T[column, 2 * L + l] = fma(r0, z1, -(r1 * z0))
        T[column, 3 * L + l], T[column, 4 * L + l], T[column, 5 * L + l] = z0, z1, z2


@inlined
def _turn_fixed(W: Array, i: int, j: int, c: float, s: float, wide: int) -> None:
    """Axes i and j turned back by a constant angle."""
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            x, y = W[(i + r) * L + l], W[(j + r) * L + l]
            W[(i + r) * L + l], W[(j + r) * L + l] = fma(c, x, -(s * y)), fma(s, x, c * y)


@inlined
def _turn_driven(W: Array, i: int, j: int, D: Array, v: int, wide: int) -> None:
    """Axes i and j turned back by the angle of drive v."""
    L = lane_count(wide)
    for l in range(L):
        s, c = D[v, SINE * L + l], D[v, COSINE * L + l]
        for r in range(3):
            x, y = W[(i + r) * L + l], W[(j + r) * L + l]
            W[(i + r) * L + l], W[(j + r) * L + l] = fma(c, x, -(s * y)), fma(s, x, c * y)


@inlined
def _slide_fixed(W: Array, axis: int, length: float, wide: int) -> None:
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            W[(R + r) * L + l] = fma(-length, W[(axis + r) * L + l], W[(R + r) * L + l])


@inlined
def _slide_driven(W: Array, axis: int, D: Array, v: int, wide: int) -> None:
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            W[(R + r) * L + l] = fma(-D[v, l], W[(axis + r) * L + l], W[(R + r) * L + l])


@inlined
def _turn_column(W: Array, axis: int, D: Array, v: int, T: Array, column: int, first: int, wide: int) -> None:
    """A turn about an axis through r: (r x w, w), times the slope of its drive."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        g = D[v, SLOPE * L + l]
        x, y, z = g * W[axis * L + l], g * W[(axis + 1) * L + l], g * W[(axis + 2) * L + l]
        r0, r1, r2 = W[R * L + l], W[(R + 1) * L + l], W[(R + 2) * L + l]
        T[column, l] += fma(r1, z, -(r2 * y))
        T[column, L + l] += fma(r2, x, -(r0 * z))
        T[column, 2 * L + l] += fma(r0, y, -(r1 * x))
        T[column, 3 * L + l] += x
        T[column, 4 * L + l] += y
        T[column, 5 * L + l] += z


@inlined
def _slide_column(W: Array, axis: int, D: Array, v: int, T: Array, column: int, first: int, wide: int) -> None:
    """A slide along an axis u: (u, 0), times the slope of its drive."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        for r in range(3):
            T[column, r * L + l] += D[v, SLOPE * L + l] * W[(axis + r) * L + l]


@inlined
def _arc_rows(D: Array, length: float, W: Array, wide: int) -> None:
    """Rotation, end point and E of the arc in D's last row (see :func:`bodyplan.robot.rows.arc_matrices`)."""
    L = lane_count(wide)
    h = D.shape[0] - 1
    for l in range(L):
        p, y, ratio = D[h, PITCH * L + l], D[h, YAW * L + l], D[h, RATIO * L + l]
        a, b = ratio * D[h, COSINE_HALF * L + l], 0.5 * ratio * ratio
        c = c_coefficient(p * p + y * y, a)
        r00, r01, r02 = 1.0 - b * (p * p + y * y), -a * y, a * p
        r10, r11, r12 = a * y, 1.0 - b * y * y, b * p * y
        r20, r21, r22 = -a * p, b * p * y, 1.0 - b * p * p
        W[ARC_TURN * L + l], W[(ARC_TURN + 1) * L + l], W[(ARC_TURN + 2) * L + l] = r00, r01, r02
        W[(ARC_TURN + 3) * L + l], W[(ARC_TURN + 4) * L + l], W[(ARC_TURN + 5) * L + l] = r10, r11, r12
        W[(ARC_TURN + 6) * L + l], W[(ARC_TURN + 7) * L + l], W[(ARC_TURN + 8) * L + l] = r20, r21, r22
        W[ARC_END * L + l], W[(ARC_END + 1) * L + l], W[(ARC_END + 2) * L + l] = (
            length * a,
            length * b * y,
            -length * b * p,
        )
        # v: the slope of the end point, turned into the end frame; omega: columns of V(phi)^T
        W[E_PITCH * L + l], W[(E_PITCH + 1) * L + l], W[(E_PITCH + 2) * L + l] = length * c * p, 0.0, -length * b
        W[(E_PITCH + 3) * L + l], W[(E_PITCH + 4) * L + l], W[(E_PITCH + 5) * L + l] = (
            b * y,
            1.0 - c * y * y,
            c * p * y,
        )
        W[E_YAW * L + l], W[(E_YAW + 1) * L + l], W[(E_YAW + 2) * L + l] = length * c * y, length * b, 0.0
        W[(E_YAW + 3) * L + l], W[(E_YAW + 4) * L + l], W[(E_YAW + 5) * L + l] = (
            -b * p,
            c * p * y,
            1.0 - c * p * p,
        )


@inlined
def _arc_column(W: Array, row: int, D: Array, v: int, T: Array, column: int, first: int, wide: int) -> None:
    """E of one variable of an arc, carried to the target: (M v + r x M omega, M omega)."""
    L = lane_count(wide)
    if first:
        T[column] = 0.0
    for l in range(L):
        g = D[v, SLOPE * L + l]
        vx, vy, vz = g * W[row * L + l], g * W[(row + 1) * L + l], g * W[(row + 2) * L + l]
        wx, wy, wz = g * W[(row + 3) * L + l], g * W[(row + 4) * L + l], g * W[(row + 5) * L + l]
        x = W[l] * wx + W[3 * L + l] * wy + W[6 * L + l] * wz
        y = W[L + l] * wx + W[4 * L + l] * wy + W[7 * L + l] * wz
        z = W[2 * L + l] * wx + W[5 * L + l] * wy + W[8 * L + l] * wz
        r0, r1, r2 = W[9 * L + l], W[10 * L + l], W[11 * L + l]
        T[column, l] += W[l] * vx + W[3 * L + l] * vy + W[6 * L + l] * vz + r1 * z - r2 * y
        T[column, L + l] += W[L + l] * vx + W[4 * L + l] * vy + W[7 * L + l] * vz + r2 * x - r0 * z
        T[column, 2 * L + l] += W[2 * L + l] * vx + W[5 * L + l] * vy + W[8 * L + l] * vz + r0 * y - r1 * x
        T[column, 3 * L + l] += x
        T[column, 4 * L + l] += y
        T[column, 5 * L + l] += z


@inlined
def _arc_back(W: Array, wide: int) -> None:
    """M from the end of an arc to its start."""
    L = lane_count(wide)
    for l in range(L):
        for r in range(3):
            x, y, z = W[r * L + l], W[(3 + r) * L + l], W[(6 + r) * L + l]
            px = W[ARC_TURN * L + l] * x + W[(ARC_TURN + 1) * L + l] * y + W[(ARC_TURN + 2) * L + l] * z
            py = W[(ARC_TURN + 3) * L + l] * x + W[(ARC_TURN + 4) * L + l] * y + W[(ARC_TURN + 5) * L + l] * z
            pz = W[(ARC_TURN + 6) * L + l] * x + W[(ARC_TURN + 7) * L + l] * y + W[(ARC_TURN + 8) * L + l] * z
            W[r * L + l], W[(3 + r) * L + l], W[(6 + r) * L + l] = px, py, pz
            W[(9 + r) * L + l] -= (
                W[ARC_END * L + l] * px + W[(ARC_END + 1) * L + l] * py + W[(ARC_END + 2) * L + l] * pz
            )


@inlined
def _invert(W: Array, turn: Array, place: Array, c: int, wide: int) -> None:
    """M, the base seen from the target, -> the target seen from the base: rotation by rows, and position."""
    L = lane_count(wide)
    for l in range(L):
        r0, r1, r2 = W[9 * L + l], W[10 * L + l], W[11 * L + l]
        for i in range(3):
            x, y, z = W[3 * i * L + l], W[(3 * i + 1) * L + l], W[(3 * i + 2) * L + l]
            turn[c, 3 * i * L + l], turn[c, (3 * i + 1) * L + l], turn[c, (3 * i + 2) * L + l] = x, y, z
            place[c, i * L + l] = -fma(x, r0, fma(y, r1, z * r2))


@inlined
def _to_world(turn: Array, place: Array, c: int, base: Array, first: int, wide: int) -> None:
    """A pose seen from the base -> seen from the world, for bases (B, 7) or (1, 7)."""
    L = lane_count(wide)
    for l in range(L):
        b = min(first + l, base.shape[0] - 1)
        w, n0, n1, n2 = base[b, 3], base[b, 4], base[b, 5], base[b, 6]
        for i in range(3):
            v0, v1, v2 = turn[c, i * L + l], turn[c, (3 + i) * L + l], turn[c, (6 + i) * L + l]
            v0, v1, v2 = _rotated(w, n0, n1, n2, v0, v1, v2)
            turn[c, i * L + l], turn[c, (3 + i) * L + l], turn[c, (6 + i) * L + l] = v0, v1, v2
        v0, v1, v2 = _rotated(w, n0, n1, n2, place[c, l], place[c, L + l], place[c, 2 * L + l])
        place[c, l], place[c, L + l], place[c, 2 * L + l] = base[b, 0] + v0, base[b, 1] + v1, base[b, 2] + v2


@inlined
def _rotated(w: float, x: float, y: float, z: float, v0: float, v1: float, v2: float) -> tuple[float, float, float]:
    """v turned by a unit quaternion: v + w t + n x t with t = 2 n x v."""
    t0, t1, t2 = 2.0 * (y * v2 - z * v1), 2.0 * (z * v0 - x * v2), 2.0 * (x * v1 - y * v0)
    return v0 + w * t0 + y * t2 - z * t1, v1 + w * t1 + z * t0 - x * t2, v2 + w * t2 + x * t1 - y * t0
