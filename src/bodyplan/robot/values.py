"""First stage of the kinematic kernels: joint coordinates of a block of lanes -> variables of the elements."""

from __future__ import annotations

import math

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import DRIVE_F, DRIVE_I, ELEMENT_F, ELEMENT_I, ROW_ANGLE, WHEEL
from bodyplan.spatial.lanes import inlined, lane_count, matrix, sines

# columns of a drive in the table D (V, 4 L): value, d(value)/dq, sine and cosine of an angle
VALUE, SLOPE, SINE, COSINE = 0, 1, 2, 3


@inlined
def unpack(ints: IntArray, floats: Array) -> tuple[IntArray, Array, IntArray, Array]:
    """element_i, element_f, drive_i, drive_f as tables."""
    F, V = ints[0], ints[1]
    return (
        matrix(ints, 3, F, ELEMENT_I),
        matrix(floats, 0, F, ELEMENT_F),
        matrix(ints, 3 + F * ELEMENT_I, V, DRIVE_I),
        matrix(floats, F * ELEMENT_F, V, DRIVE_F),
    )


@inlined
def drive_values(
    q: Array, n: int, first: int, last: int, drive_i: IntArray, drive_f: Array, half: float, D: Array, wide: bool
) -> bool:
    """Fill D for configurations ``first``... of ``q`` (B n,), the ``last`` one repeated; sines and cosines are those
    of ``half`` times an angle. False where a coordinate is not finite."""
    L = lane_count(wide)
    finite = True
    for v in range(drive_i.shape[0]):
        joint, f0, f1 = drive_i[v, 0], drive_f[v, 0], drive_f[v, 1]
        for l in range(L):
            x = q[min(first + l, last) * n + joint]
            finite &= math.isfinite(x)
            D[v, l] = x
        if drive_i[v, 1] == WHEEL:
            sines(D, v, 0, SINE * L, COSINE * L, 0.5, wide)
            for l in range(L):
                D[v, SLOPE * L + l] = -0.5 * f1 * D[v, SINE * L + l]
                D[v, l] = f0 + f1 * D[v, COSINE * L + l]
        else:
            for l in range(L):
                D[v, l] = f0 + f1 * D[v, l]
                D[v, SLOPE * L + l] = f1
        if drive_i[v, 2] == ROW_ANGLE:
            sines(D, v, 0, SINE * L, COSINE * L, half, wide)
    return finite


@inlined
def bend(element_i: IntArray, element_f: Array, D: Array, e: int, H: Array, wide: bool) -> None:
    """Half-angle functions of arc ``e`` into H (1, 6 L): pitch, yaw, x/2, sin(x/2), cos(x/2), sin(x/2)/(x/2)."""
    L = lane_count(wide)
    p, y = element_i[e, 2], element_i[e, 3]
    for l in range(L):
        pitch = D[p, l] if p >= 0 else element_f[e, 0]
        yaw = D[y, l] if y >= 0 else element_f[e, 1]
        H[0, l], H[0, L + l] = pitch, yaw
        H[0, 2 * L + l] = 0.5 * math.sqrt(pitch * pitch + yaw * yaw)
    sines(H, 0, 2 * L, 3 * L, 4 * L, 1.0, wide)
    for l in range(L):
        h = H[0, 2 * L + l]
        # below 1e-150 squares underflow; there sin(h)/h is 1 to the last digit
        H[0, 5 * L + l] = H[0, 3 * L + l] / h if h > 1e-150 else 1.0
