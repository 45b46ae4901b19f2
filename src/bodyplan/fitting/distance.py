"""Kernels: the distance between a curve and the mechanism that follows it, its integral (paper *acm*, eq. (6)) and
its maximum.

The distance dips to 0 with a corner where a planar mechanism crosses the curve, so cells are halved until a Gauss rule
on the cell and on its halves agree; they never straddle ends of units or breaks of the curve.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.spatial.coefficients import c_series
from bodyplan.spatial.lanes import inlined

ORDER = 10
_X, _W = np.polynomial.legendre.leggauss(ORDER)
NODES, WEIGHTS = 0.5 * (1.0 + _X), 0.5 * _W
#: of length^2: how far a cell's integral may be from that of its halves
CELL_TOLERANCE = 2e-15
DEPTH = 50
Vector = tuple[float, float, float]


@inlined
def _curve_point(s: float, ends: Array, cells: Array, hint: int) -> tuple[float, float, float, int]:
    """Point of the dense curve at s, and its cell; the search starts at cell ``hint``."""
    last = len(ends) - 2
    k = hint
    if s < ends[k] or s >= ends[k + 1]:
        if k < last and ends[k + 1] <= s < ends[k + 2]:
            k += 1
        else:
            k = min(max(int(np.searchsorted(ends, s, side="right")) - 1, 0), last)
    u = (s - ends[k]) / (ends[k + 1] - ends[k])
    c = cells[k]
    x = c[0] + u * (c[3] + u * (c[6] + u * (c[9] + u * (c[12] + u * c[15]))))
    y = c[1] + u * (c[4] + u * (c[7] + u * (c[10] + u * (c[13] + u * c[16]))))
    z = c[2] + u * (c[5] + u * (c[8] + u * (c[11] + u * (c[14] + u * c[17]))))
    return x, y, z, k


@njit(cache=True, nogil=True, error_model="numpy")
def arc_coefficients(x: float) -> tuple[float, float, float]:
    """A = sin(x)/x, B = (1 - cos(x))/x^2, C = (x - sin(x))/x^3."""
    if x < 1e-150:
        return 1.0, 0.5, 1.0 / 6.0
    a = math.sin(x) / x
    half = math.sin(0.5 * x) / (0.5 * x)
    z = x * x
    return a, 0.5 * half * half, c_series(z) if z < 1.0 else (1.0 - a) / z


@inlined
def _body_point(s: float, seg: Array, data: Array) -> Vector:
    """Point of the mechanism at s on one segment: ``seg`` (3,) start, end, 1 for an arc; ``data`` (17,): origins of
    the frames at its ends (6), axes x, y, z of the first (9), pitch and yaw of an arc (2)."""
    u = (s - seg[0]) / (seg[1] - seg[0])
    if seg[2] == 0.0:
        return (
            data[0] + u * (data[3] - data[0]),
            data[1] + u * (data[4] - data[1]),
            data[2] + u * (data[5] - data[2]),
        )
    pitch, yaw = u * data[15], u * data[16]
    a, b, _ = arc_coefficients(math.hypot(pitch, yaw))
    h = s - seg[0]
    x, y, z = h * a, h * b * yaw, -h * b * pitch
    return (
        data[0] + x * data[6] + y * data[9] + z * data[12],
        data[1] + x * data[7] + y * data[10] + z * data[13],
        data[2] + x * data[8] + y * data[11] + z * data[14],
    )


@inlined
def _gauss(
    low: float, high: float, start: float, seg: Array, data: Array, ends: Array, cells: Array, hint: int
) -> tuple[float, int]:
    total = 0.0
    k = hint
    for i in range(ORDER):
        s = low + (high - low) * NODES[i]
        p = _body_point(s, seg, data)
        x, y, z, k = _curve_point(start + s, ends, cells, k)
        x, y, z = x - p[0], y - p[1], z - p[2]
        total += WEIGHTS[i] * math.sqrt(x * x + y * y + z * z)
    return total * (high - low), k


@njit(cache=True, nogil=True, error_model="numpy")
def integrate(
    start: float,
    stops: Array,
    owner: IntArray,
    segments: Array,
    data: Array,
    ends: Array,
    cells: Array,
    tolerance: float,
    wrenches: Array,
) -> tuple[float, float]:
    """(integral of the distance over the body m^2, sum of what cells differ from their halves).

    ``start`` m: arc length of the tail. Cells begin at ``stops`` (C + 1,), cell i lies on segment ``owner[i]`` of
    ``segments`` (S, 3), ``data`` (S, 17); ``ends``, ``cells``: the dense curve. ``wrenches`` (S, 8), if it has rows, is
    overwritten by what the integral of the unit vectors e from the curve to the body does on each segment: for a line
    the forces (6) on the frames at its ends; for an arc force and moment (6) on its first frame and the generalised
    forces on pitch and yaw (2), all in the axes of the world.
    """
    total = off = 0.0
    k = 0
    low_of, high_of, value_of = np.empty(2 * DEPTH), np.empty(2 * DEPTH), np.empty(2 * DEPTH)
    gradient = wrenches.shape[0] > 0
    wrenches[:] = 0.0
    for c in range(len(owner)):
        seg, part = segments[owner[c]], data[owner[c]]
        low_of[0], high_of[0] = stops[c], stops[c + 1]
        value_of[0], k = _gauss(stops[c], stops[c + 1], start, seg, part, ends, cells, k)
        top = 0
        while top >= 0:
            low, high, value = low_of[top], high_of[top], value_of[top]
            top -= 1
            middle = 0.5 * (low + high)
            left, k = _gauss(low, middle, start, seg, part, ends, cells, k)
            right, k = _gauss(middle, high, start, seg, part, ends, cells, k)
            difference = abs(left + right - value)
            if difference <= tolerance or top + 2 >= 2 * DEPTH or middle <= low or middle >= high:
                total += left + right
                off += difference
                if gradient:
                    k = _add_wrench(low, high, start, seg, part, ends, cells, k, wrenches[owner[c]])
            else:
                top += 1
                low_of[top], high_of[top], value_of[top] = middle, high, right
                top += 1
                low_of[top], high_of[top], value_of[top] = low, middle, left
    return total, off


@njit(cache=True, nogil=True, error_model="numpy")
def _add_wrench(
    low: float, high: float, start: float, seg: Array, data: Array, ends: Array, cells: Array, k: int, out: Array
) -> int:
    """Add the effect of one cell to the ``out`` (8,) of its segment; see :func:`integrate`."""
    h = high - low
    length = seg[1] - seg[0]
    for i in range(ORDER):
        s = low + h * NODES[i]
        p = _body_point(s, seg, data)
        x, y, z, k = _curve_point(start + s, ends, cells, k)
        x, y, z = p[0] - x, p[1] - y, p[2] - z
        distance = math.sqrt(x * x + y * y + z * z)
        if distance == 0.0:
            continue
        scale = WEIGHTS[i] * h / distance
        x, y, z = scale * x, scale * y, scale * z
        u = (s - seg[0]) / length
        if seg[2] == 0.0:
            out[0] += (1.0 - u) * x
            out[1] += (1.0 - u) * y
            out[2] += (1.0 - u) * z
            out[3] += u * x
            out[4] += u * y
            out[5] += u * z
            continue
        a, b, c = p[0] - data[0], p[1] - data[1], p[2] - data[2]
        out[0] += x
        out[1] += y
        out[2] += z
        out[3] += b * z - c * y
        out[4] += c * x - a * z
        out[5] += a * y - b * x
        # the point is length u (A, B u yaw, -B u pitch) at the angle u hypot(pitch, yaw)
        pitch, yaw = u * data[15], u * data[16]
        angle = math.hypot(pitch, yaw)
        A, B, C = arc_coefficients(angle)
        z2 = angle * angle
        A1 = C - B
        B1 = b_slope(z2, A, B)
        fx = x * data[6] + y * data[7] + z * data[8]
        fy = x * data[9] + y * data[10] + z * data[11]
        fz = x * data[12] + y * data[13] + z * data[14]
        reach = length * u * u
        out[6] += reach * (fx * pitch * A1 + fy * pitch * yaw * B1 - fz * (B + pitch * pitch * B1))
        out[7] += reach * (fx * yaw * A1 + fy * (B + yaw * yaw * B1) - fz * pitch * yaw * B1)
    return k


@njit(cache=True, nogil=True, error_model="numpy")
def b_slope(z: float, a: float, b: float) -> float:
    """dB/dx / x at x = sqrt(z), given A and B."""
    if z < 1.0:
        p = 1.0 - z * (7.0 / 1440.0) * (1.0 - z * (4.0 / 1071.0))
        p = 1.0 - z * (2.0 / 135.0) * (1.0 - z * (5.0 / 528.0) * (1.0 - z * (3.0 / 455.0) * p))
        return (-1.0 / 12.0) * (1.0 - z * (1.0 / 15.0) * (1.0 - z * (3.0 / 112.0) * p))
    return (a - 2.0 * b) / z


@njit(cache=True, nogil=True, error_model="numpy")
def errors(
    starts: Array,
    stops: Array,
    counts: IntArray,
    owners: IntArray,
    segments: Array,
    data: Array,
    ends: Array,
    cells: Array,
    tolerance: float,
    out: Array,
) -> None:
    """:func:`integrate` for B fits to one dense curve: ``stops`` (B, C + 1) with ``counts`` (B,) cells, ``owners``
    (B, C), ``data`` (B, S, 17); fills ``out`` (B, 2)."""
    none = np.empty((0, 8))
    for b in range(len(starts)):
        n = counts[b]
        out[b, 0], out[b, 1] = integrate(
            starts[b], stops[b, : n + 1], owners[b, :n], segments, data[b], ends, cells, tolerance, none
        )


@njit(cache=True, nogil=True, error_model="numpy")
def _distance(s: float, start: float, seg: Array, data: Array, ends: Array, cells: Array, k: int) -> tuple[float, int]:
    p = _body_point(s, seg, data)
    x, y, z, k = _curve_point(start + s, ends, cells, k)
    return math.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + (z - p[2]) ** 2), k


SAMPLES = 12
#: local maxima of the samples that may yet be the largest
NEAR = 0.7


@njit(cache=True, nogil=True, error_model="numpy")
def farthest(
    starts: Array,
    stops: Array,
    counts: IntArray,
    owners: IntArray,
    segments: Array,
    data: Array,
    ends: Array,
    cells: Array,
    out: Array,
) -> None:
    """Largest distance, (B,) m, of B fits to one dense curve: every local maximum of samples that comes near the
    largest is closed in on by golden sections."""
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    values = np.empty((stops.shape[1], SAMPLES + 1))
    for b in range(len(starts)):
        k, best = 0, 0.0
        for c in range(counts[b]):
            seg, part = segments[owners[b, c]], data[b, owners[b, c]]
            low, high = stops[b, c], stops[b, c + 1]
            for i in range(SAMPLES + 1):
                s = low + (high - low) * i / SAMPLES
                values[c, i], k = _distance(s, starts[b], seg, part, ends, cells, k)
                best = max(best, values[c, i])
        floor = NEAR * best
        for c in range(counts[b]):
            seg, part = segments[owners[b, c]], data[b, owners[b, c]]
            low, high = stops[b, c], stops[b, c + 1]
            step = (high - low) / SAMPLES
            for i in range(SAMPLES + 1):
                before = values[c, max(i - 1, 0)]
                after = values[c, min(i + 1, SAMPLES)]
                if values[c, i] < floor or values[c, i] < before or values[c, i] < after:
                    continue
                left, right = low + step * max(i - 1, 0), low + step * min(i + 1, SAMPLES)
                x, y = right - golden * (right - left), left + golden * (right - left)
                fx, k = _distance(x, starts[b], seg, part, ends, cells, k)
                fy, k = _distance(y, starts[b], seg, part, ends, cells, k)
                for _ in range(40):
                    best = max(best, max(fx, fy))
                    if fx > fy:
                        right, y, fy = y, x, fx
                        x = right - golden * (right - left)
                        fx, k = _distance(x, starts[b], seg, part, ends, cells, k)
                    else:
                        left, x, fx = x, y, fy
                        y = left + golden * (right - left)
                        fy, k = _distance(y, starts[b], seg, part, ends, cells, k)
        out[b] = best
