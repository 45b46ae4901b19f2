"""The kernels of :mod:`bodyplan.gaits.carry.search` for height maps and formulas: the same proof, wheel by wheel.

Planes, the ground and sections are those of :mod:`bodyplan.gaits.carry.section_kernel`.
"""

from __future__ import annotations

import math

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.carry.section_kernel import (
    COLUMNS,
    CUTS,
    FIRST,
    FOUND,
    NOTES,
    SECOND,
    STEEP,
    Room,
    W,
    bounds_at,
    farthest,
    foot_at,
    highest_at,
    section_at,
    steepest_at,
    upright,
)  # fmt: skip
from bodyplan.ground.field_kernel import GX, GY, HXX, THIRD, XX, XY, YY, Z_HIGH, Z_LOW, FieldArrays, jet_at
from bodyplan.kernels import lean

#: half the width of the first cell about a contact, as a share of its distance; the least one of those beside it, how
#: much wider the next ones are, and the widest
_ABOUT, _LEAST, _WIDER, _WIDEST = 0.06, 0.02, 1.6, 0.25
#: how often the cell about a contact is halved until Phi is convex on it
_HALVINGS = 12
#: share of a distance whose square is nothing: a slope of Phi as small as that is a contact's
_FLAT = 1e-8
#: m, as a share of how far from the origin: W of a cell's middle is found to that
_CLOSE = 1e-13


@lean
def _beyond(land: FieldArrays, plane: Array, middle: float, half: float, reach: float, room: Room) -> bool:
    """Whether the height of the ground alone says that the cell ``middle`` +- ``half`` is farther than ``reach``; for
    that only points with abs(w) <= reach count. It says nothing beyond the edge."""
    aside = max(abs(middle) - half, 0.0)
    x, y = plane[0] + middle * plane[3], plane[1] + middle * plane[4]
    size_x = abs(plane[3]) * half + abs(plane[6]) * reach
    size_y = abs(plane[4]) * half + abs(plane[7]) * reach
    # the plane's own height is that of w up: ahead is level
    below = (plane[2] - highest_at(land, x, y, size_x, size_y, room)) / plane[8]
    return aside > reach or (below > 0.0 and aside * aside + below * below > reach * reach)


@lean
def bent(
    land: FieldArrays, plane: Array, at: Array, middle: float, half: float, room: Room
) -> tuple[float, float, float]:
    """Bounds of W'' over the cell ``middle`` +- ``half``, and how far W may be from its middle there: infinite where
    nothing is known. ``at`` is the section in the middle. The steps are those of ``_known`` in
    :mod:`bodyplan.gaits.carry.search`; ``room.bounds`` are those of the cell."""
    w, first, vertical = at[W], at[FIRST], upright(plane)
    # W stays within this of its middle, or nothing is said
    span = 0.0 if vertical else 2.0 * (1.0 + abs(first)) * half
    size_x = abs(plane[3]) * half + abs(plane[6]) * span
    size_y = abs(plane[4]) * half + abs(plane[7]) * span
    lift = 0.0 if vertical else w
    x = plane[0] + middle * plane[3] + lift * plane[6]
    y = plane[1] + middle * plane[4] + lift * plane[7]
    bounds_at(land, x, y, size_x, size_y, room)
    bounds = room.bounds
    reach = math.sqrt(size_x * size_x + size_y * size_y)
    spread = bounds[THIRD] * reach
    if not math.isfinite(spread):
        spread = np.inf
    a, b = plane[3], plane[4]
    e_low = e_high = straight = mixed = 0.0
    for k in range(3):
        low = max(bounds[XX + 2 * k], at[HXX + k] - spread)
        high = min(bounds[XX + 1 + 2 * k], at[HXX + k] + spread)
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
    low, high, n_low = e_low, e_high, at[STEEP]
    if not vertical:
        norm = straight + mixed
        drift = norm * reach
        slant = math.sqrt(plane[6] ** 2 + plane[7] ** 2)
        n_low = at[STEEP] - drift * slant
        n_high = at[STEEP] + drift * slant
        slope = slant * (abs(at[GX] * a + at[GY] * b) + drift) / n_low
        extra = norm * slope * (2.0 + slope)
        low = min((e_low - extra) / n_low, (e_low - extra) / n_high)
        high = max((e_high + extra) / n_low, (e_high + extra) / n_high)
    rise = abs(first) * half + 0.5 * max(abs(low), abs(high)) * half * half
    if math.isfinite(low) and math.isfinite(high) and (vertical or (n_low > 0.0 and rise <= span)):
        return low, high, rise
    return -np.inf, np.inf, np.inf


@lean
def _judged(land: FieldArrays, plane: Array, at: Array, middle: float, half: float, room: Room) -> tuple[float, float]:
    """A lower bound of D over the cell ``middle`` +- ``half``, and one of Phi'' there, 0 where Phi is not known to be
    convex; ``at`` is the section in the middle. The steps are those of ``judge`` in
    :mod:`bodyplan.gaits.carry.search`."""
    aside = max(abs(middle) - half, 0.0)
    if at[FOUND] == 0.0:
        return aside, 0.0
    low, high, rise = bent(land, plane, at, middle, half, room)
    w, first = at[W], at[FIRST]
    w_low, w_high = w - rise, w + rise
    if upright(plane):
        w_low, w_high = max(w_low, room.bounds[Z_LOW] - plane[2]), min(w_high, room.bounds[Z_HIGH] - plane[2])
    away = max(w_low, -w_high, 0.0)
    least = math.sqrt(aside * aside + away * away)
    if not math.isfinite(rise):
        return least, 0.0
    steepness = max(abs(first) - max(abs(low), abs(high)) * half, 0.0)
    mu = 1.0 + steepness**2 + min(w_low * low, w_low * high, w_high * low, w_high * high)
    # Phi >= Phi(m) + Phi'(m) d + mu/2 d^2 over |d| <= half
    pull = abs(middle + w * first)
    way = min(pull / mu, half) if mu > 0.0 else half
    lowered = middle * middle + w * w - 2.0 * pull * way + mu * way * way
    if lowered > 0.0:
        least = max(least, math.sqrt(lowered))
    return least, max(mu, 0.0)


@lean
def _minimum(
    land: FieldArrays, plane: Array, a: float, b: float, guess: float, close: float, room: Room, at: Array
) -> tuple[float, bool, bool]:
    """The one minimum of Phi between a and b, whether there is one inside, and whether that is known: Newton on Phi',
    kept by bisection; ``at`` is the section there. It is not known where the section has not been found on the way."""
    section_at(land, plane, a, guess, close, room, at)
    slope = a + at[W] * at[FIRST]
    if at[FOUND] == 0.0 or slope >= 0.0:
        return a, slope == 0.0, at[FOUND] != 0.0
    section_at(land, plane, b, guess, close, room, at)
    slope = b + at[W] * at[FIRST]
    if at[FOUND] == 0.0 or slope <= 0.0:
        return b, slope == 0.0, at[FOUND] != 0.0
    s = 0.5 * (a + b)
    for _ in range(60):
        section_at(land, plane, s, guess, close, room, at)
        if at[FOUND] == 0.0:
            return s, False, False
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
    foot_at(land, plane, s, room, at)
    return s, True, at[FOUND] != 0.0


@lean
def one_curve(land: FieldArrays, plane: Array, half: float, room: Room) -> bool:
    """Whether the ground cuts the plane in one curve within +- ``half`` of its centre; see
    :func:`bodyplan.gaits.carry.search.one_curve`."""
    if upright(plane):
        return True
    slant, up = math.sqrt(plane[6] ** 2 + plane[7] ** 2), plane[8]
    waiting, at, bounds = room.waiting, room.here, room.bounds
    waiting[0, 0], waiting[0, 1], waiting[0, 2], waiting[0, 3] = plane[0], plane[1], half, 0.0
    count = 1
    while count:
        count -= 1
        x, y, size, depth = waiting[count, 0], waiting[count, 1], waiting[count, 2], waiting[count, 3]
        bounds_at(land, x, y, size, size, room)
        jet_at(land, x, y, room, at)
        across = at[GX] * plane[6] + at[GY] * plane[7]
        if not across < up:
            return False
        straight = max(abs(bounds[XX]), abs(bounds[XX + 1]), abs(bounds[YY]), abs(bounds[YY + 1]))
        norm = straight + max(abs(bounds[XY]), abs(bounds[XY + 1]))
        most = across + slant * norm * math.sqrt(2.0) * size
        if most < up or steepest_at(land, plane[6], plane[7], room) < up:
            continue
        if depth >= CUTS - 1:
            return False
        for k in range(4):
            waiting[count, 0] = x + (0.5 * size if k < 2 else -0.5 * size)
            waiting[count, 1] = y + (0.5 * size if k % 2 else -0.5 * size)
            waiting[count, 2], waiting[count, 3] = 0.5 * size, depth + 1.0
            count += 1
    return True


@lean
def nearest_on(
    land: FieldArrays, plane: Array, foot: Array, guess: float, limits: Array, room: Room
) -> tuple[float, float, float, float, bool]:
    """(s, W there, distance, s of another contact as near or nan, certified) of one plane: branch and bound from s = 0,
    where the section is ``foot``, and from ``guess``. ``limits``: relative errors of distances that are proved and that
    count as the same, how far two contacts are apart, cells, levels.

    At first the cell about what is known: where it is a minimum and Phi is convex there is no other in it. The cells
    beside it are wider the farther away they are, as the curve may rise there before it is as near.
    """
    proved, twice, apart = limits[0], limits[1], limits[2]
    most, levels = int(limits[3]), int(limits[4])
    at, middle_at, noted = room.here, room.middle, room.noted
    size = farthest(plane)
    close = _CLOSE * (1.0 + size)
    for k in range(COLUMNS):
        middle_at[k] = foot[k]
    place, depth, nearest = 0.0, foot[W], abs(foot[W]) if foot[FOUND] != 0.0 else np.inf
    if guess != 0.0:
        foot_at(land, plane, guess, room, at)
        distance = math.hypot(guess, at[W])
        if at[FOUND] != 0.0 and distance <= nearest:
            place, depth, nearest = guess, at[W], distance
            for k in range(COLUMNS):
                middle_at[k] = at[k]
    if not math.isfinite(nearest) or not one_curve(land, plane, abs(foot[W]), room):
        return place, depth, nearest, np.nan, False
    reach, low, high, notes = nearest * (1.0 + twice), place, place, 0
    pull = abs(place + depth * middle_at[FIRST])
    if pull <= _FLAT * nearest:
        half = _ABOUT * reach
        for _ in range(_HALVINGS):
            least, mu = _judged(land, plane, middle_at, place, half, room)
            if pull <= _FLAT * nearest * math.sqrt(mu) and mu > 0.0:
                low, high, notes = place - half, place + half, 1
                noted[0, 0], noted[0, 1] = place, nearest
                break
            half *= 0.5
    cells, following, count = room.cells[0], room.cells[1], 0
    for side in range(2):
        # the farther away, the wider
        begin, step = low if side == 0 else high, max(high - place, _LEAST * reach)
        while -reach < begin < reach:
            end = max(begin - step, -reach) if side == 0 else min(begin + step, reach)
            cells[count, 0], cells[count, 1], cells[count, 2] = min(begin, end), max(begin, end), depth
            count += 1
            begin, step = end, min(_WIDER * step, _WIDEST * reach)
    done = True
    for _ in range(levels):
        if count == 0 or not done:
            break
        left = 0
        for i in range(count):
            a, b, w = cells[i, 0], cells[i, 1], cells[i, 2]
            middle, half = 0.5 * (a + b), 0.5 * (b - a)
            if _beyond(land, plane, middle, half, nearest * (1.0 + twice), room):
                continue
            section_at(land, plane, middle, w, close, room, middle_at)
            if middle_at[FOUND] == 0.0 and w != 0.0:
                section_at(land, plane, middle, 0.0, close, room, middle_at)
            w, distance = middle_at[W], math.hypot(middle, middle_at[W])
            if middle_at[FOUND] != 0.0 and distance < nearest:
                place, depth, nearest = middle, w, distance
            least, mu = _judged(land, plane, middle_at, middle, half, room)
            if not least < nearest * (1.0 + twice):
                continue
            s, found, known = middle, False, False
            if mu > 0.0:
                s, found, known = _minimum(land, plane, a, b, w, close, room, at)
            if known:
                w, distance = at[W], math.hypot(s, at[W])
            elif least < nearest * (1.0 - proved):
                # a cell this small holds an edge of the ground, and its middle is it
                if half > 1e-14 * (size + nearest):
                    if left + 2 > 2 * most:
                        done = False
                        break
                    w = w if middle_at[FOUND] != 0.0 else 0.0
                    following[left, 0], following[left, 1], following[left, 2] = a, middle, w
                    following[left + 1, 0], following[left + 1, 1], following[left + 1, 2] = middle, b, w
                    left += 2
                    continue
                s, found = middle, True
            if found and distance <= nearest * (1.0 + twice):
                if distance < nearest:
                    place, depth, nearest = s, w, distance
                if notes < NOTES:
                    noted[notes, 0], noted[notes, 1] = s, distance
                    notes += 1
        cells, following, count = following, cells, left
    second = np.nan
    for i in range(notes):
        if noted[i, 1] <= nearest * (1.0 + twice) and abs(noted[i, 0] - place) > apart * nearest:
            second = noted[i, 0]
    return place, depth, nearest, second, done and count == 0
