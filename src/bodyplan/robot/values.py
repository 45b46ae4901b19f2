"""First stage of the kinematic kernels: joint coordinates of a block -> variables of the elements."""

# ruff: noqa: E741 - l is the lane, everywhere
from __future__ import annotations

import math

from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.tables import DRIVE_F, DRIVE_I, ELEMENT_F, ELEMENT_I, HEAD, ROW_ANGLE, WHEEL
from bodyplan.spatial.lanes import SINCOS_LIMIT, inlined, lane_count, sincos, sines

# columns of a drive in the table D (V, 6 L): value, d(value)/dq, sine and cosine of an angle
VALUE, SLOPE, SINE, COSINE = 0, 1, 2, 3
# columns of D's last row, for the arc at hand: pitch, yaw, x/2, sin(x/2), cos(x/2), sin(x/2)/(x/2)
PITCH, YAW, HALF, SINE_HALF, COSINE_HALF, RATIO = 0, 1, 2, 3, 4, 5


@inlined
def drive_values(q: Array, ints: IntArray, floats: Array, half: float, D: Array, total: Array, wide: int) -> bool:
    """Fill D for a block ``q`` (n, L); sines and cosines are those of ``half`` times an angle. False where a
    coordinate is not finite.

    The polynomials of :func:`sincos` hold for moderate angles only. Whether all were is found out afterwards,
    from the sum of all magnitudes: one test for a block instead of one for each number.
    """
    L = lane_count(wide)
    i, f = HEAD + ints[0] * ELEMENT_I, ints[0] * ELEMENT_F
    for l in range(L):
        total[l] = 0.0
    for v in range(ints[1]):
        joint, law, kind = ints[i + DRIVE_I * v], ints[i + DRIVE_I * v + 1], ints[i + DRIVE_I * v + 2]
        f0, f1 = floats[f + DRIVE_F * v], floats[f + DRIVE_F * v + 1]
        if kind == ROW_ANGLE:
            for l in range(L):
                x = f0 + f1 * q[joint, l]
                total[l] += abs(x)
                D[v, l] = x
                D[v, SLOPE * L + l] = f1
                D[v, SINE * L + l], D[v, COSINE * L + l] = sincos(half * x)
        elif law == WHEEL:
            for l in range(L):
                total[l] += abs(q[joint, l])
                s, c = sincos(0.5 * q[joint, l])
                D[v, l], D[v, SLOPE * L + l] = f0 + f1 * c, -0.5 * f1 * s
        else:
            for l in range(L):
                x = f0 + f1 * q[joint, l]
                total[l] += abs(x)
                D[v, l], D[v, SLOPE * L + l] = x, f1
    everything = 0.0
    for l in range(L):
        everything += total[l]
    if not math.isfinite(everything):
        return False
    if everything > SINCOS_LIMIT:
        _large_values(q, ints, floats, half, D, L)
    return True


@njit(nogil=True)
def _large_values(q: Array, ints: IntArray, floats: Array, half: float, D: Array, L: int) -> None:
    """Sines and cosines once more, for angles of any size."""
    i, f = HEAD + ints[0] * ELEMENT_I, ints[0] * ELEMENT_F
    for v in range(ints[1]):
        joint, law, kind = ints[i + DRIVE_I * v], ints[i + DRIVE_I * v + 1], ints[i + DRIVE_I * v + 2]
        f0, f1 = floats[f + DRIVE_F * v], floats[f + DRIVE_F * v + 1]
        for l in range(L):
            if kind == ROW_ANGLE:
                x = half * D[v, l]
                D[v, SINE * L + l], D[v, COSINE * L + l] = math.sin(x), math.cos(x)
            elif law == WHEEL:
                x = 0.5 * q[joint, l]
                D[v, l], D[v, SLOPE * L + l] = f0 + f1 * math.cos(x), -0.5 * f1 * math.sin(x)


@inlined
def bend(p: int, y: int, pitch: float, yaw: float, D: Array, wide: int) -> None:
    """Half-angle functions of an arc with drives ``p``, ``y`` (or -1 and constants), into D's last row."""
    L = lane_count(wide)
    h = D.shape[0] - 1
    for l in range(L):
        a = D[p, l] if p >= 0 else pitch
        b = D[y, l] if y >= 0 else yaw
        D[h, PITCH * L + l], D[h, YAW * L + l] = a, b
        D[h, HALF * L + l] = 0.5 * math.sqrt(a * a + b * b)
    sines(D, h, HALF * L, SINE_HALF * L, COSINE_HALF * L, 1.0, wide)
    for l in range(L):
        x = D[h, HALF * L + l]
        # below 1e-150 squares underflow; there sin(x)/x is 1 to the last digit
        D[h, RATIO * L + l] = D[h, SINE_HALF * L + l] / x if x > 1e-150 else 1.0
