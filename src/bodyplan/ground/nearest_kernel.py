"""The search of :mod:`bodyplan.ground.nearest`, point by point, and clearances up to a cap.

What is farther than the cap need not be found: the search begins as if ground as near as the cap were known already.
"""

from __future__ import annotations

import math

import numpy as np

from bodyplan.arrays import Array
from bodyplan.ground.descent_kernel import descend, descend_crease, half_square
from bodyplan.ground.field_kernel import (
    CONVEX,
    GX,
    GY,
    HIGH_X,
    HIGH_Y,
    HXX,
    HXY,
    HYY,
    LEAST,
    LOW_X,
    LOW_Y,
    THIRD,
    XX,
    XY,
    YY,
    Z_HIGH,
    Z_LOW,
    F,
    FieldArrays,
    Room,
    bounds_at,
    jet_at,
    top_over,
)
from bodyplan.kernels import lean

#: relative error of the distance up to which the search proves that nothing is nearer
TOLERANCE = 1e-11
#: boxes of one point that the search keeps at a time; beyond, those that promise least are left out
MAX_BOXES = 1024
_LEVELS = 60
#: points that are looked at together, first
_TOGETHER = 256
_CERTAIN = math.sqrt(3.0) - 1.0


@lean
def clearances(field: FieldArrays, points: Array, group: int, room: Room, found: Array, out: Array) -> int:
    """Of groups of so many of the ``points`` (k, 3) each, the smallest signed distance to the ground into ``out`` (n,),
    if it is less than what is there, and its place into ``found`` (n, 2).

    Returns -1, or the first point without ground, and leaves the rest undone.
    """
    at, together = 0, _TOGETHER
    while at < len(points):
        end = min(at + together, len(points))
        if together == 1:
            n = at // group
            out[n] = _clearance(field, points[at], out[n], room, found[n])
            if math.isnan(out[n]):
                return at
        else:
            reach = 0.0
            for n in range(at // group, (end - 1) // group + 1):
                reach = max(reach, out[n])
            if not _are_far(field, points[at:end], reach, room):
                together //= 2
                continue
        at = end
        while together < _TOGETHER and at % (2 * together) == 0:
            together *= 2
    return -1


@lean
def _are_far(field: FieldArrays, points: Array, reach: float, room: Room) -> bool:
    """Whether bounds show that ``points`` (k, 3) are all above the ground and farther from it than ``reach``."""
    if not math.isfinite(reach):
        return False
    low_x = low_y = lowest = np.inf
    high_x = high_y = -np.inf
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        lowest = min(lowest, points[k, 2])
    box = field.box
    if low_x < box[0, 0] or low_y < box[0, 1] or high_x > box[1, 0] or high_y > box[1, 1]:
        return False
    low_x, high_x = max(low_x - reach, box[0, 0]), min(high_x + reach, box[1, 0])
    low_y, high_y = max(low_y - reach, box[0, 1]), min(high_y + reach, box[1, 1])
    return lowest - top_over(field, low_x, low_y, high_x, high_y, room) > reach


@lean
def _clearance(field: FieldArrays, p: Array, cap: float, room: Room, best: Array) -> float:
    """min(signed distance of one point, ``cap``), nan without ground below it."""
    for axis in range(2):
        low, high = field.box[0, axis], field.box[1, axis]
        slack = 1e-12 * (high - low) if math.isfinite(high - low) else 0.0  # the rounding of the edge itself
        if not low - slack <= p[axis] <= high + slack:
            return math.nan
    jet_at(field, p[0], p[1], room, room.here)
    gap = p[2] - room.here[F]
    if math.isnan(gap):
        return math.nan
    if gap >= 0.0:
        return _nearest(field, p, gap, cap, room, best) if cap > 0.0 else cap
    if gap >= cap:  # below the ground: the distance is at most the gap
        return cap
    depth = _nearest(field, p, -gap, np.inf, room, room.place)
    if not -depth < cap:
        return cap
    best[0], best[1] = room.place[0], room.place[1]
    return -depth


@lean
def _nearest(field: FieldArrays, p: Array, gap: float, cap: float, room: Room, best: Array) -> float:
    """min(distance, ``cap``) of one point with the ground ``gap`` >= 0 above or below it; ``best`` (2,) as ``found``
    of :func:`clearances`."""
    x, y, box = p[0], p[1], field.box
    value = cap
    if gap < value:
        value, best[0], best[1] = gap, x, y
    low_x, high_x = max(x - value, box[0, 0]), min(x + value, box[1, 0])
    low_y, high_y = max(y - value, box[0, 1]), min(y + value, box[1, 1])
    least, convex, _ = _judge(field, p, low_x, low_y, high_x, high_y, room)
    if not least < value:
        return value
    if convex:
        u, v, d, settled = descend(field, p, x, y, low_x, low_y, high_x, high_y, room)
        if d < value:
            value, best[0], best[1] = d, u, v
        if settled:
            return value
    u, v, d, settled = descend(field, p, x, y, box[0, 0], box[0, 1], box[1, 0], box[1, 1], room)
    nearest = min(d, gap) if d == d else gap
    if d < value:
        value, best[0], best[1] = d, u, v
    if settled and math.isfinite(nearest):
        reach = nearest * (1.0 + 1e-9)
        bounds_at(
            field,
            max(x - reach, box[0, 0]),
            max(y - reach, box[0, 1]),
            min(x + reach, box[1, 0]),
            min(y + reach, box[1, 1]),
            room,
        )
        known = room.bounds
        bend = max(_size(known, XX), _size(known, YY)) + _size(known, XY)
        if bend * nearest < _CERTAIN:
            return value
    if d <= gap:
        value = _follow_creases(field, p, u, v, value, room, best)
    else:
        value = _follow_creases(field, p, x, y, value, room, best)
    return _search(field, p, value, room, best)


@lean
def _follow_creases(field: FieldArrays, p: Array, u: float, v: float, value: float, room: Room, best: Array) -> float:
    """Try the creases of the ground, each from the nearest place known so far, or (u, v)."""
    for k in range(len(field.creases.outputs)):
        x, y, d = descend_crease(field, k, p, u, v, room)
        if d < value:
            value, best[0], best[1], u, v = d, x, y, x, y
    return value


@lean
def _search(field: FieldArrays, p: Array, value: float, room: Room, best: Array) -> float:
    """Branch and bound, level by level: min(distance, ``value``); if it is the distance, ``best`` is its place."""
    box = field.box
    now, then = 0, 1
    boxes = room.boxes
    first = boxes[now, 0]
    first[LOW_X], first[LOW_Y] = max(p[0] - value, box[0, 0]), max(p[1] - value, box[0, 1])
    first[HIGH_X], first[HIGH_Y] = min(p[0] + value, box[1, 0]), min(p[1] + value, box[1, 1])
    size, count = max(abs(p[0]), abs(p[1]), abs(p[2])), 1
    for _ in range(_LEVELS):
        # the best centre of all boxes, and Newton from there
        u, v, tried = 0.0, 0.0, value
        for k in range(count):
            it = boxes[now, k]
            it[LEAST], convex, d = _judge(field, p, it[LOW_X], it[LOW_Y], it[HIGH_X], it[HIGH_Y], room)
            it[CONVEX] = 1.0 if convex else 0.0
            if d < tried:
                u, v, tried = 0.5 * (it[LOW_X] + it[HIGH_X]), 0.5 * (it[LOW_Y] + it[HIGH_Y]), d
        if tried < value:
            value, best[0], best[1] = tried, u, v
            u, v, d, _ = descend(field, p, u, v, box[0, 0], box[0, 1], box[1, 0], box[1, 1], room)
            if d < value:
                value, best[0], best[1] = d, u, v
            value = _follow_creases(field, p, best[0], best[1], value, room, best)
        # a box on which phi is convex has one minimum: Newton finds it, and the box is done
        for k in range(count):
            it = boxes[now, k]
            if it[CONVEX] and it[LEAST] < value * (1.0 - TOLERANCE):
                u, v = 0.5 * (it[LOW_X] + it[HIGH_X]), 0.5 * (it[LOW_Y] + it[HIGH_Y])
                u, v, d, _ = descend(field, p, u, v, it[LOW_X], it[LOW_Y], it[HIGH_X], it[HIGH_Y], room)
                if d < value:
                    value, best[0], best[1] = d, u, v
        # the others are cut into four where they may hold something nearer
        enough, narrow, kept = value * (1.0 - TOLERANCE), 1e-14 * (size + value), 0
        for k in range(count):
            it = boxes[now, k]
            wide = max(it[HIGH_X] - it[LOW_X], it[HIGH_Y] - it[LOW_Y]) > narrow
            if wide and not it[CONVEX] and it[LEAST] < enough:
                room.sizes[kept] = it[LEAST]
                kept += 1
            else:
                it[LEAST] = np.inf
        if not kept:
            break
        last, ties = np.inf, 0
        if kept > MAX_BOXES:
            last, ties = _smallest(room.sizes[:kept], MAX_BOXES)
        cut = 0
        for k in range(count):
            it = boxes[now, k]
            if it[LEAST] < last or (it[LEAST] == last and ties > 0):
                ties -= 1 if it[LEAST] == last else 0
                _quarter(it, boxes[then, cut : cut + 4])
                cut += 4
        now, then, count = then, now, cut
    return value


@lean
def _quarter(it: Array, into: Array) -> None:
    """The four quarters of a box into the rows of ``into`` (4, BOX)."""
    x, y = 0.5 * (it[LOW_X] + it[HIGH_X]), 0.5 * (it[LOW_Y] + it[HIGH_Y])
    for k in range(4):
        part = into[k]
        part[LOW_X], part[HIGH_X] = (it[LOW_X], x) if k < 2 else (x, it[HIGH_X])
        part[LOW_Y], part[HIGH_Y] = (it[LOW_Y], y) if k % 2 == 0 else (y, it[HIGH_Y])


@lean
def _smallest(values: Array, k: int) -> tuple[float, int]:
    """The k-th smallest of ``values``, which are put in another order, and how many of the k smallest equal it."""
    low, high = 0, len(values) - 1
    while low < high:
        pivot, i, j = values[(low + high) // 2], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k - 1 <= j:
            high = j
        elif k - 1 >= i:
            low = i
        else:
            break
    ties = 0
    for i in range(k):
        ties += values[i] == values[k - 1]
    return values[k - 1], ties


@lean
def _judge(
    field: FieldArrays, p: Array, low_x: float, low_y: float, high_x: float, high_y: float, room: Room
) -> tuple[float, bool, float]:
    """Of a box: a lower bound of the distance D, whether phi = D^2/2 is convex, and D at the centre."""
    u, v, half_x, half_y = (
        0.5 * (low_x + high_x),
        0.5 * (low_y + high_y),
        0.5 * (high_x - low_x),
        0.5 * (high_y - low_y),
    )
    radius = math.sqrt(half_x * half_x + half_y * half_y)
    jet_at(field, u, v, room, room.here)
    bounds_at(field, low_x, low_y, high_x, high_y, room)
    known = room.bounds
    f, gx, gy, hxx, hxy, hyy = (
        room.here[F],
        room.here[GX],
        room.here[GY],
        room.here[HXX],
        room.here[HXY],
        room.here[HYY],
    )
    # how far Hess f may be from its value at the centre, and how large it may be (Gershgorin's bounds of norms)
    change = _larger(_off(known, XX, hxx), _off(known, YY, hyy)) + _off(known, XY, hxy)
    change = _least(change, known[THIRD] * radius)
    bend = _larger(abs(hxx), abs(hyy)) + abs(hxy) + change
    # f by its own bounds and by its Taylor series
    spread = abs(gx) * half_x + abs(gy) * half_y + 0.5 * bend * radius * radius
    e_low, e_high = -_least(-known[Z_LOW], spread - f) - p[2], _least(known[Z_HIGH], f + spread) - p[2]
    aside_x = max(low_x - p[0], p[0] - high_x, 0.0)
    aside_y = max(low_y - p[1], p[1] - high_y, 0.0)
    above = _larger(_larger(e_low, -e_high), 0.0)
    least = math.sqrt(aside_x * aside_x + aside_y * aside_y + above * above)
    # the smallest eigenvalue of Hess phi = I + grad f grad f' + e Hess f: from the range of e and of the
    # eigenvalues of Hess f, or from its value at the centre and how far each part may be from that
    e = f - p[2]
    middle, turned = 0.5 * (hxx + hyy), math.hypot(0.5 * (hxx - hyy), hxy)
    lowest, highest = middle - turned - change, middle + turned + change
    smallest = -_larger(_larger(-e_low * lowest, -e_low * highest), _larger(-e_high * lowest, -e_high * highest))
    size, turn = math.sqrt(gx * gx + gy * gy), bend * radius
    drift = (2.0 * size + turn) * turn + abs(e) * change + (size + 0.5 * turn) * radius * bend
    a, b, c = 1.0 + gx * gx + e * hxx, gx * gy + e * hxy, 1.0 + gy * gy + e * hyy
    mu = -_least(-1.0 - smallest, drift - 0.5 * (a + c) + math.hypot(0.5 * (a - c), b))
    # phi >= phi(c) + grad phi . d + mu/2 |d|^2 over the box, least where |d_i| = t_i
    pull_x, pull_y = abs(u - p[0] + e * gx), abs(v - p[1] + e * gy)
    t_x, t_y = half_x, half_y
    if mu > 0.0:
        t_x, t_y = min(pull_x / mu, half_x), min(pull_y / mu, half_y)
    square = 2.0 * half_square(p, u, v, f)
    lowered = square - 2.0 * (pull_x * t_x + pull_y * t_y) + mu * (t_x * t_x + t_y * t_y)
    if lowered > 0.0 and math.sqrt(lowered) > least:
        least = math.sqrt(lowered)
    return least, mu > 0.0 and math.isfinite(f), math.sqrt(square)


@lean
def _size(known: Array, entry: int) -> float:
    """The largest size of an entry of the Hessian."""
    return float(max(abs(known[entry]), abs(known[entry + 1])))


@lean
def _off(known: Array, entry: int, h: float) -> float:
    """How far an entry of the Hessian may be from ``h``."""
    return _larger(abs(known[entry] - h), abs(known[entry + 1] - h))


@lean
def _larger(a: float, b: float) -> float:
    """The larger one, nan if there is one."""
    return a if a > b or a != a else b


@lean
def _least(a: float, b: float) -> float:
    """The smaller one that is a number."""
    return a if a <= b or b != b else b
