"""Whether one pose of the snake, or one move, keeps clear of a floor and a ceiling in steps: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.bounds import DEMANDS, Bounds, Pose, excess, lay, room_for
from bodyplan.gaits.rectilinear.swing import even_at
from bodyplan.kernels import inlined, lean

#: relative slack of a foot that stands
STANDS = 1e-12
#: what a move can run into, in the order of :data:`DEMANDS`, then what the ground adds
TRIED = (*DEMANDS, Status.BELOW_FLOOR, Status.ABOVE_CEILING)
FLOOR, CEILING = len(DEMANDS), len(DEMANDS) + 1


class Steps(NamedTuple):
    """A ground in steps along the way, for kernels: ``floor_x`` (k,) and levels ``floor_z`` (k + 1,) m; ``roof_x``,
    ``roof_z`` the ceiling upside down (-inf where it is open); ``breaks`` (e,) m of all steps and the ``height``
    (e + 1,) m between floor and ceiling before, between and beyond them."""

    floor_x: Array
    floor_z: Array
    roof_x: Array
    roof_z: Array
    breaks: Array
    height: Array


class Keeps(NamedTuple):
    """What the body keeps from the ground, m: axes of feet above the floor ``rest``, links ``body`` and their
    ``margin`` more from edges, tail and head links ``low`` more; joints ``top`` from the ceiling; lengths ``tail`` and
    ``head``; ``crouch`` as in ``Walker``, NaN for none; ``lift`` at least; ``size`` of the longest link. ``upright``:
    it need not crouch, and ``noted`` (1,) becomes True where it would have had to for a move that is tried."""

    rest: float
    body: float
    margin: float
    low: float
    top: float
    tail: float
    head: float
    crouch: float
    lift: float
    size: float
    upright: bool
    noted: BoolArray


class Places(NamedTuple):
    """Places along a move at which it is tried: ``tau`` (p,), what swings share there ``even`` (p, 3), and in which
    ``order`` (p,) they are looked at."""

    tau: Array
    even: Array
    order: IntArray


@lean
def left_of(xs: Array, x: float) -> int:
    """How many of ``xs`` (k,), ascending, are less than ``x``."""
    low, high = 0, len(xs)
    while low < high:
        middle = (low + high) // 2
        if xs[middle] < x:
            low = middle + 1
        else:
            high = middle
    return low


@lean
def up_to(xs: Array, x: float) -> int:
    """How many of ``xs`` (k,), ascending, are not more than ``x``."""
    low, high = 0, len(xs)
    while low < high:
        middle = (low + high) // 2
        if xs[middle] <= x:
            low = middle + 1
        else:
            high = middle
    return low


@lean
def onward(xs: Array, x: float, at: int) -> int:
    """:func:`left_of`, looked for from ``at`` on."""
    while at > 0 and xs[at - 1] >= x:
        at -= 1
    while at < len(xs) and xs[at] < x:
        at += 1
    return at


@lean
def highest(xs: Array, zs: Array, low: float, high: float) -> float:
    """Highest level of a floor from ``low`` to ``high`` m, both ends included."""
    first, last = left_of(xs, low), up_to(xs, high)
    out = zs[first]
    for k in range(first + 1, last + 1):
        out = max(out, zs[k])
    return float(out)


@lean
def room_above(steps: Steps, low: float, high: float) -> float:
    """The least height m between floor and ceiling from ``low`` to ``high``."""
    out = np.inf
    for k in range(len(steps.height)):
        starts = steps.breaks[k - 1] if k > 0 else -np.inf
        ends = steps.breaks[k] if k < len(steps.breaks) else np.inf
        if low < ends and high > starts:
            out = min(out, steps.height[k])
    return out


@lean
def nearer(xs: Array, zs: Array, x0: float, z0: float, x1: float, z1: float, least: float) -> bool:
    """Whether a segment, along and up, is nearer than ``least`` m to a floor with steps at ``xs`` (k,) and levels
    ``zs`` (k + 1,), or below it: straight down to a tread, straight across to a face, or to an edge."""
    if x0 > x1:
        x0, z0, x1, z1 = x1, z1, x0, z0
    low, high, reach = min(z0, z1), max(z0, z1), max(least, 0.0)
    first, last = left_of(xs, x0 - reach), up_to(xs, x1 + reach)
    for i in range(first, last + 1):
        a = max(x0, xs[i - 1]) if i > 0 else x0
        b = min(x1, xs[i]) if i < len(xs) else x1
        if a <= b and low - zs[i] < least:
            za, zb = z0, z1
            if x1 > x0:
                za, zb = z0 + (a - x0) / (x1 - x0) * (z1 - z0), z0 + (b - x0) / (x1 - x0) * (z1 - z0)
            if min(za, zb) - zs[i] < least:
                return True
    for i in range(first, last):
        foot, edge = min(zs[i], zs[i + 1]), max(zs[i], zs[i + 1])
        a, b = max(low, foot), min(high, edge)
        if a <= b:
            xa, xb = x0 - xs[i], x1 - xs[i]
            if high > low:
                xa, xb = x0 + (a - z0) / (z1 - z0) * (x1 - x0) - xs[i], x0 + (b - z0) / (z1 - z0) * (x1 - x0) - xs[i]
            if (0.0 if xa * xb <= 0.0 else min(abs(xa), abs(xb))) < least:
                return True
        if low - edge < least and _distance(x0, z0, x1, z1, xs[i], edge) < least:
            return True
    return False


@lean
def _distance(x0: float, z0: float, x1: float, z1: float, x: float, z: float) -> float:
    """Of a point (x, z) from a segment, m."""
    dx, dz = x1 - x0, z1 - z0
    square = dx * dx + dz * dz
    share = ((x - x0) * dx + (z - z0) * dz) / square if square > 0.0 else 0.0
    share = min(max(share, 0.0), 1.0)
    return float(np.hypot(x - x0 - share * dx, z - z0 - share * dz))


@lean
def _at_corner(xs: Array, zs: Array, x0: float, z0: float, x1: float, z1: float, need: float, slack: float) -> bool:
    """Whether a segment is nearer to an edge of a floor than ``need`` m by more than ``slack``."""
    for k in range(left_of(xs, min(x0, x1) - need), len(xs)):
        if xs[k] > max(x0, x1) + need:
            break
        edge = max(zs[k], zs[k + 1])
        if edge >= min(z0, z1) - need and need - _distance(x0, z0, x1, z1, xs[k], edge) > slack:
            return True
    return False


@inlined
def into_ground(steps: Steps, keeps: Keeps, pose: Pose, only: int, met: float) -> tuple[bool, bool]:
    """Whether a pose reaches into the floor or its edges, and into the ceiling. ``only``: the one anchor with whose
    legs, tail or head link that may be (-1: all)."""
    count = len(pose.anchors)
    slack, none = STANDS * keeps.size + met * keeps.size, met * keeps.size
    first, last = (0, 2 * count) if only < 0 else (max(0, 2 * only - 1), min(2 * count, 2 * only + 3))
    if only > 0 and first == 0:
        first = 1
    if 0 <= only < count - 1:
        last = min(last, 2 * count - 1)
    left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
    origins, floor_x, floor_z = pose.origins, steps.floor_x, steps.floor_z
    for k in range(first, min(last + 1, 2 * count)):
        x, z = origins[k, 0], origins[k, 1]
        left, right, low, high = min(left, x), max(right, x), min(low, z), max(high, z)
    if last == 2 * count:
        right = max(right, origins[last - 1, 0] + keeps.head)
    reach, above = keeps.body + max(keeps.margin, keeps.low), keeps.top + keeps.margin
    at, end = left_of(floor_x, left - reach), up_to(floor_x, right + reach)
    ground = floor_z[at]
    for k in range(at + 1, end + 1):
        ground = max(ground, floor_z[k])
    floor = ceiling = False
    # where no step is near the floor is level under all of the body
    clear = at == end and low - ground >= max(keeps.rest, keeps.body) - slack
    if not clear:
        stands, near = keeps.rest - slack, max(keeps.rest - slack, 0.0)
        for i in range(count):
            if not floor and (only < 0 or i == only):
                x, z = pose.anchors[i, 0], pose.anchors[i, 1]
                at = onward(floor_x, x - near, at)
                if at == len(floor_x) or floor_x[at] > x + near:
                    floor = z - floor_z[at] < stands
                else:
                    floor = nearer(floor_x, floor_z, x, z, x, z, stands)
    roof_x, roof_z, under = steps.roof_x, steps.roof_z, left_of(steps.roof_x, left - above)
    roof = roof_z[under]
    for k in range(under + 1, up_to(roof_x, right + above) + 1):
        roof = max(roof, roof_z[k])
    for k in range(first, last):
        if not pose.moved[k]:
            continue
        x0, z0 = origins[k, 0], origins[k, 1]
        x1, z1 = (origins[k + 1, 0], origins[k + 1, 1]) if k < 2 * count - 1 else (x0 + keeps.head, z0)
        low, high = min(x0, x1), max(x0, x1)
        if not (clear or floor) and min(z0, z1) - ground < reach:
            at = onward(floor_x, low - reach, at)
            if at == len(floor_x) or floor_x[at] > high + reach:  # level all along
                floor = min(z0, z1) - floor_z[at] < keeps.body - slack
            else:
                more = keeps.low if k == 0 or k == 2 * count - 1 else keeps.margin
                floor = nearer(floor_x, floor_z, x0, z0, x1, z1, keeps.body - slack)
                floor = floor or _at_corner(floor_x, floor_z, x0, z0, x1, z1, keeps.body + more, none)
        # links keep from the ceiling what the joints must: those are where it is nearest
        if not ceiling and max(z0, z1) + roof > -above:
            under = onward(roof_x, low - above, under)
            if under == len(roof_x) or roof_x[under] > high + above:
                ceiling = -max(z0, z1) - roof_z[under] < above - none
            else:
                ceiling = nearer(roof_x, roof_z, x0, -z0, x1, -z1, above - none)
    return floor, ceiling


@lean
def _room_near(steps: Steps, keeps: Keeps, at: Array) -> float:
    """How high m a body may be that the lowest place near anchors ``at`` (N, 2) leaves room for."""
    room = room_above(steps, at[0, 0] - keeps.crouch, at[len(at) - 1, 0] + keeps.crouch)
    return room - keeps.rest - keeps.top - keeps.margin


@lean
def _tall(pose: Pose) -> float:
    """m from the lowest anchor to the highest elbow."""
    low, high = pose.anchors[0, 1], -np.inf
    for i in range(len(pose.anchors)):
        low = min(low, pose.anchors[i, 1])
        if i < len(pose.anchors) - 1:
            high = max(high, pose.origins[2 * i + 2, 1])
    return float(high - low)


@njit(cache=True)
def places_at(tau: Array) -> Places:
    """The places ``tau`` (p,) in the order in which they are given."""
    even = np.empty((len(tau), 3))
    for p in range(len(tau)):
        even[p, 0], even[p, 1], even[p, 2] = even_at(tau[p])
    return Places(tau, even, np.arange(len(tau)))


@inlined
def try_move(
    bounds: Bounds,
    steps: Steps,
    keeps: Keeps,
    before: Array,
    after: Array,
    lift: Array,
    early: Array,
    swinging: BoolArray,
    m: int,
    places: Places,
    count: int,
    only: int,
    met: float,
    every: bool,
    pose: Pose,
    found: Array,
    out: BoolArray,
) -> int:
    """What of :data:`TRIED` move ``m`` runs into at the first ``count`` places, into ``out`` (9,), and the number of
    the one where the first was found, -1 where none is. ``every``: all of it, the ground only where the demands are
    met; or else the first thing that is found. ``pose`` and ``found`` (7,) are room; of a ``pose`` that is not fresh
    what neither stands nor moves with anchor ``only`` has been found good before."""
    enough = np.inf if every else met
    first, met_all, floor, ceiling = -1, True, False, False
    for d in range(len(out)):
        out[d] = False
    even, room = places.even, np.nan
    near_low = not np.isnan(keeps.crouch)
    crouches, watched = near_low and not keeps.upright, near_low and keeps.upright and not (every or keeps.noted[0])
    for p in range(count):
        at, new, parts = places.order[p], pose.fresh[0], pose.fresh[1]
        tau = places.tau[at]
        lay(bounds, before, after, lift, early, m, tau, (even[at, 0], even[at, 1], even[at, 2]), only, pose)
        bad = excess(bounds, swinging, pose, enough, found)
        if bad or every:
            for d in range(len(DEMANDS)):
                if found[d] > met:
                    out[d] = bad = True
        met_all = met_all and not bad
        if met_all:
            floor_here, ceiling_here = into_ground(steps, keeps, pose, only, met)
            floor, ceiling = floor or floor_here, ceiling or ceiling_here
            bad = not every and (floor_here or ceiling_here)
        if crouches or (watched and not bad):
            if np.isnan(room):
                room = _room_near(steps, keeps, before[m])
            tall = _tall(pose)
            low = tall - room > 0.0 or (tau == 1.0 and tall - _room_near(steps, keeps, after[m]) > 0.0)
            if crouches:
                out[CEILING] = out[CEILING] or low
                bad = bad or low
            elif low:
                keeps.noted[0], watched = True, False
        if bad and first < 0:
            first = p
            if not every:
                pose.fresh[0], pose.fresh[1] = new, parts
                break
    if met_all:
        out[FLOOR], out[CEILING] = floor, out[CEILING] or ceiling
    return first


@njit(cache=True)
def try_moves(
    bounds: Bounds, steps: Steps, keeps: Keeps, stances: Array, rows: Array, places: Places, only: int, met: float,
    every: bool, out: BoolArray,
) -> None:  # fmt: skip
    """:func:`try_move` for every move, into ``out`` (M, 9): from ``stances`` (M, N, 2 or more) to ``rows`` (M, N, 4)
    with places, lift and how early anchors rise."""
    count = rows.shape[1]
    pose, found, swinging = room_for(bounds), np.empty(len(DEMANDS)), np.empty(count, dtype=np.bool_)
    before, after = np.empty((1, count, 2)), np.empty((1, count, 2))
    lift, early = np.empty((1, count)), np.empty((1, count))
    for m in range(len(rows)):
        pose.fresh[:] = True
        for i in range(count):
            moves = False
            for c in range(2):
                before[0, i, c], after[0, i, c] = stances[m, i, c], rows[m, i, c]
                moves = moves or before[0, i, c] != after[0, i, c]
            lift[0, i], early[0, i] = rows[m, i, 2], rows[m, i, 3]
            swinging[i] = moves and lift[0, i] > 0.0
        try_move(
            bounds, steps, keeps, before, after, lift, early, swinging, 0, places, len(places.order), only, met, every,
            pose, found, out[m],
        )  # fmt: skip
