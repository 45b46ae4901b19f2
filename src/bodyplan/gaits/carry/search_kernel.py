"""The kernel of :mod:`bodyplan.gaits.carry.search` for height maps: the same branch and bound, wheel by wheel.

``land`` is a :class:`Land`. What is known of a section or
of a cell is a row of numbers; their names are columns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.ground.heightmap import HeightMap
from bodyplan.ground.spline_kernel import spline_at, spline_bounds


class Land(NamedTuple):
    """A height map: the Hermite data ``nodes`` of its spline, the ``offsets``, ``widths`` and ``tables`` of its bounds,
    and ``place`` (5,): sides of a cell dx, dy, x and y of the first sample, and the level that heights count from."""

    nodes: Array
    offsets: IntArray
    widths: IntArray
    tables: Array
    place: Array

    @staticmethod
    def of(ground: HeightMap) -> Land:
        """The tables of a height map."""
        spline = ground.spline
        return Land(
            np.ascontiguousarray(spline.nodes),
            *spline.pyramid,
            np.array([*spline.step, *ground.origin, spline.level], dtype=np.float64),
        )


#: columns of a section (:class:`bodyplan.gaits.carry.planes.Section`): first those of the spline's jet
F, GX, GY, HXX, HXY, HYY, W, FIRST, SECOND, STEEP, FOUND, COLUMNS = range(12)
#: notes of minima kept for one wheel
_NOTES = 64
#: cells to begin with: what is wider than these hardly ever decides
_FIRST = 8


@njit(cache=True, nogil=True, error_model="numpy")
def section_at(
    land: Land, centre: Array, ahead: Array, up: Array, upright: bool, s: float, basis: Array, out: Array
) -> None:
    """The ground curve of one plane at ``s`` into ``out``; see :func:`bodyplan.gaits.carry.planes.section`."""
    scale = 1e-15 * (1.0 + max(abs(centre[0]), abs(centre[1]), abs(centre[2])))
    w = n = step = 0.0
    for _ in range(40):
        x = centre[0] + s * ahead[0] + w * up[0]
        y = centre[1] + s * ahead[1] + w * up[1]
        spline_at(land.nodes, land.place[0], land.place[1], x - land.place[2], y - land.place[3], basis, out)
        out[F] += land.place[4]
        n = up[2] - (out[GX] * up[0] + out[GY] * up[1])
        step = (out[F] - (centre[2] + s * ahead[2] + w * up[2])) / n
        w += step
        if upright or not abs(step) > scale:
            break
    first = (out[GX] * ahead[0] + out[GY] * ahead[1]) / n
    ax, ay = ahead[0] + first * up[0], ahead[1] + first * up[1]
    out[W], out[FIRST], out[STEEP] = w, first, n
    out[SECOND] = (ax * ax * out[HXX] + 2.0 * ax * ay * out[HXY] + ay * ay * out[HYY]) / n
    found = upright or (n > 0.0 and abs(step) <= 1e3 * scale + 1e-9 * abs(w))
    out[FOUND] = 1.0 if found and math.isfinite(w) else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _judged(
    land: Land,
    centre: Array,
    ahead: Array,
    up: Array,
    upright: bool,
    at: Array,
    middle: float,
    half: float,
    bounds: Array,
) -> tuple[float, bool]:
    """A lower bound of D over the cell ``middle`` +- ``half``, and whether Phi is convex on it; ``at`` is the section
    in the middle. The steps are those of ``_known`` and ``judge`` in :mod:`bodyplan.gaits.carry.search`."""
    aside = max(abs(middle) - half, 0.0)
    if at[FOUND] == 0.0:
        return aside, False
    w, first = at[W], at[FIRST]
    room = 0.0 if upright else 2.0 * (1.0 + abs(first)) * half
    size_x = abs(ahead[0]) * half + abs(up[0]) * room
    size_y = abs(ahead[1]) * half + abs(up[1]) * room
    lift = 0.0 if upright else w
    x, y = centre[0] + middle * ahead[0] + lift * up[0], centre[1] + middle * ahead[1] + lift * up[1]
    dx, dy, shape = land.place[0], land.place[1], land.nodes.shape[:2]
    x, y = x - land.place[2], y - land.place[3]
    corners = x - size_x, y - size_y, x + size_x, y + size_y
    spline_bounds(shape, dx, dy, land.offsets, land.widths, land.tables, *corners, bounds)
    bounds[0] += land.place[4]
    bounds[1] += land.place[4]
    reach = math.hypot(size_x, size_y)
    spread = bounds[8] * reach
    if not math.isfinite(spread):
        spread = np.inf
    a, b = ahead[0], ahead[1]
    e_low = e_high = straight = mixed = 0.0
    for k in range(3):
        low = max(bounds[2 + 2 * k], at[HXX + k] - spread)
        high = min(bounds[3 + 2 * k], at[HXX + k] + spread)
        largest = max(abs(low), abs(high))
        if k == 1:
            mixed = largest
        else:
            straight = max(straight, largest)
        weight = a * a if k == 0 else b * b if k == 2 else 2.0 * a * b
        if weight != 0.0:
            one, two = weight * low, weight * high
            e_low += min(one, two)
            e_high += max(one, two)
    norm = straight + mixed
    b_low, b_high, n_low = e_low, e_high, at[STEEP]
    if not upright:
        drift = norm * reach
        lean = math.hypot(up[0], up[1])
        n_low = at[STEEP] - drift * lean
        n_high = at[STEEP] + drift * lean
        slope = lean * (abs(at[GX] * a + at[GY] * b) + drift) / n_low
        extra = norm * slope * (2.0 + slope)
        b_low = min((e_low - extra) / n_low, (e_low - extra) / n_high)
        b_high = max((e_high + extra) / n_low, (e_high + extra) / n_high)
    bend = max(abs(b_low), abs(b_high))
    rise = abs(first) * half + 0.5 * bend * half * half
    valid = math.isfinite(b_low) and math.isfinite(b_high) and (upright or (n_low > 0.0 and rise <= room))
    w_low, w_high = (w - rise, w + rise) if valid else (-np.inf, np.inf)
    if upright:
        w_low, w_high = max(w_low, bounds[0] - centre[2]), min(w_high, bounds[1] - centre[2])
    least = math.hypot(aside, max(w_low, -w_high, 0.0))
    if not valid:
        return least, False
    steepness = max(abs(first) - bend * half, 0.0)
    mu = 1.0 + steepness**2 + min(w_low * b_low, w_low * b_high, w_high * b_low, w_high * b_high)
    # Phi >= Phi(m) + Phi'(m) d + mu/2 d^2 over |d| <= half
    pull = abs(middle + w * first)
    way = min(pull / mu, half) if mu > 0.0 else half
    lowered = middle * middle + w * w - 2.0 * pull * way + mu * way * way
    if lowered > 0.0:
        least = max(least, math.sqrt(lowered))
    return least, mu > 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _minimum(
    land: Land,
    centre: Array,
    ahead: Array,
    up: Array,
    upright: bool,
    a: float,
    b: float,
    basis: Array,
    at: Array,
) -> tuple[float, bool]:
    """The one minimum of Phi between a and b, and whether there is one inside: Newton on Phi', kept by bisection."""
    section_at(land, centre, ahead, up, upright, a, basis, at)
    slope = a + at[W] * at[FIRST]
    if slope >= 0.0:
        return a, slope == 0.0
    section_at(land, centre, ahead, up, upright, b, basis, at)
    slope = b + at[W] * at[FIRST]
    if slope <= 0.0:
        return b, slope == 0.0
    s = 0.5 * (a + b)
    for _ in range(60):
        section_at(land, centre, ahead, up, upright, s, basis, at)
        slope, bend = s + at[W] * at[FIRST], 1.0 + at[FIRST] ** 2 + at[W] * at[SECOND]
        if slope < 0.0:
            a = s
        elif slope > 0.0:
            b = s
        following = s - slope / bend
        if not (bend > 0.0 and a <= following <= b):
            following = 0.5 * (a + b)
        moved = abs(following - s)
        s = following
        if not moved > 1e-10 * math.hypot(s, at[W]):
            break
    section_at(land, centre, ahead, up, upright, s, basis, at)
    return s, True


@njit(cache=True, nogil=True, error_model="numpy")
def search(
    land: Land,
    centre: Array,
    ahead: Array,
    up: Array,
    guess: Array,
    limits: Array,
    best: Array,
    value: Array,
    second: Array,
    certified: BoolArray,
) -> None:
    """Branch and bound for n planes, from s = 0 and ``guess`` (n,), into ``best``, ``value``, ``second`` and
    ``certified`` (n,), as of :class:`bodyplan.gaits.carry.search.Found`. ``limits``: relative errors of distances that
    are proved and that count as the same, how far two contacts are apart, cells of a wheel, levels."""
    proved, twice, apart = limits[0], limits[1], limits[2]
    most, levels = int(limits[3]), int(limits[4])
    basis, at, bounds = np.empty((2, 3, 4)), np.empty(COLUMNS), np.empty(9)
    cells, following = np.empty((2 * most, 2)), np.empty((2 * most, 2))
    middles = np.empty((2 * most, COLUMNS))
    notes = np.empty((_NOTES, 2))
    for k in range(len(guess)):
        c, e, v = centre[k], ahead[k], up[k]
        upright = v[0] == 0.0 and v[1] == 0.0
        place, nearest, noted = 0.0, np.inf, 0
        for start in (0.0, guess[k]):
            section_at(land, c, e, v, upright, start, basis, at)
            distance = math.hypot(start, at[W])
            if at[FOUND] != 0.0 and distance < nearest:
                place, nearest = start, distance
        size = max(abs(c[0]), abs(c[1]), abs(c[2]))
        count, done = _FIRST, math.isfinite(nearest)
        reach = nearest * (1.0 + twice)
        for i in range(_FIRST):
            cells[i, 0] = (2.0 * i / _FIRST - 1.0) * reach
            cells[i, 1] = (2.0 * (i + 1) / _FIRST - 1.0) * reach
        for _ in range(levels):
            if count == 0 or not done:
                break
            for i in range(count):
                s = 0.5 * (cells[i, 0] + cells[i, 1])
                section_at(land, c, e, v, upright, s, basis, middles[i])
                distance = math.hypot(s, middles[i, W])
                if middles[i, FOUND] != 0.0 and distance < nearest:
                    place, nearest = s, distance
            left = 0
            for i in range(count):
                low, high = cells[i, 0], cells[i, 1]
                middle, half = 0.5 * (low + high), 0.5 * (high - low)
                least, convex = _judged(land, c, e, v, upright, middles[i], middle, half, bounds)
                if not least < nearest * (1.0 + twice):
                    continue
                s, found = middle, False
                if convex:
                    s, found = _minimum(land, c, e, v, upright, low, high, basis, at)
                    distance = math.hypot(s, at[W])
                elif least < nearest * (1.0 - proved):
                    # a cell this small holds an edge of the ground, and its middle is it
                    if half > 1e-14 * (size + nearest):
                        if left + 2 > 2 * most:
                            done = False
                            break
                        following[left, 0], following[left, 1] = low, middle
                        following[left + 1, 0], following[left + 1, 1] = middle, high
                        left += 2
                        continue
                    found, distance = True, math.hypot(middle, middles[i, W])
                if found and distance <= nearest * (1.0 + twice):
                    if distance < nearest:
                        place, nearest = s, distance
                    if noted < _NOTES:
                        notes[noted, 0], notes[noted, 1] = s, distance
                        noted += 1
            cells, following = following, cells
            count = left
        best[k], value[k], second[k] = place, nearest, np.nan
        certified[k] = done and count == 0
        for i in range(noted):
            if notes[i, 1] <= nearest * (1.0 + twice) and abs(notes[i, 0] - place) > apart * nearest:
                second[k] = notes[i, 0]
