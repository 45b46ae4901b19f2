"""Whether one pose of the snake, or one move, keeps clear of a floor and a ceiling in steps: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.bounds import DEMANDS, Bounds, Pose, excess, lay, room_for
from bodyplan.ground.steps import steps_clearance

#: relative slack of a foot that stands
STANDS = 1e-12
#: what a move can run into, in the order of :data:`DEMANDS`, then what the ground adds
TRIED = (*DEMANDS, Status.BELOW_FLOOR, Status.ABOVE_CEILING)
FLOOR, CEILING = len(DEMANDS), len(DEMANDS) + 1


class Steps(NamedTuple):
    """A ground in steps along the way, for kernels: ``floor_x`` (k,) and ``floor_z`` (k + 1,) m, its edges ``corners``
    (k, 2); ``roof_x``, ``roof_z`` the ceiling upside down (-inf where it is open); ``breaks`` (e,) m of all steps and
    the ``height`` (e + 1,) m between floor and ceiling before, between and beyond them."""

    floor_x: Array
    floor_z: Array
    corners: Array
    roof_x: Array
    roof_z: Array
    breaks: Array
    height: Array


class Keeps(NamedTuple):
    """What the body keeps from the ground, m: axes of feet above the floor ``rest``, links ``body`` and their
    ``margin`` more from edges, tail and head links ``low`` more; joints ``top`` from the ceiling; lengths ``tail`` and
    ``head``; ``crouch`` as in ``Walker``, NaN for none; ``lift`` at least; ``size`` of the longest link."""

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


@njit(cache=True)
def highest(xs: Array, zs: Array, low: float, high: float) -> float:
    """Highest level of a floor from ``low`` to ``high`` m, both ends included."""
    first, last = np.searchsorted(xs, low, side="left"), np.searchsorted(xs, high, side="right")
    out = zs[first]
    for k in range(first + 1, last + 1):
        out = max(out, zs[k])
    return float(out)


@njit(cache=True)
def room_above(steps: Steps, low: float, high: float) -> float:
    """The least height m between floor and ceiling from ``low`` to ``high``."""
    out = np.inf
    for k in range(len(steps.height)):
        starts = steps.breaks[k - 1] if k > 0 else -np.inf
        ends = steps.breaks[k] if k < len(steps.breaks) else np.inf
        if low < ends and high > starts:
            out = min(out, steps.height[k])
    return out


@njit(cache=True)
def _near(xs: Array, zs: Array, segment: Array, need: float, slack: float, gap: Array) -> bool:
    """Whether a ``segment`` (1, 2, 2) is nearer to a floor than ``need`` m by more than ``slack``."""
    x0, x1 = min(segment[0, 0, 0], segment[0, 1, 0]), max(segment[0, 0, 0], segment[0, 1, 0])
    reach = max(need, 0.0)
    if min(segment[0, 0, 1], segment[0, 1, 1]) - highest(xs, zs, x0 - reach, x1 + reach) >= need - slack:
        return False
    gap[0] = np.inf
    steps_clearance(segment, xs, zs, gap)
    return bool(need - gap[0] > slack)


@njit(cache=True)
def _at_corner(steps: Steps, segment: Array, need: float, slack: float) -> bool:
    """Whether a ``segment`` is nearer to an edge of the floor than ``need`` m by more than ``slack``."""
    (x0, z0), (x1, z1) = segment[0]
    low = np.searchsorted(steps.corners[:, 0], min(x0, x1) - need, side="left")
    for k in range(low, len(steps.corners)):
        x, z = steps.corners[k]
        if x > max(x0, x1) + need:
            break
        if z < min(z0, z1) - need:
            continue
        dx, dz = x1 - x0, z1 - z0
        square = dx * dx + dz * dz
        share = ((x - x0) * dx + (z - z0) * dz) / square if square > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        if need - np.hypot(x - x0 - share * dx, z - z0 - share * dz) > slack:
            return True
    return False


@njit(cache=True)
def into_ground(
    steps: Steps, keeps: Keeps, pose: Pose, only: int, met: float, segment: Array, gap: Array
) -> tuple[bool, bool]:
    """Whether a pose reaches into the floor or its edges, and into the ceiling. ``only``: the one anchor with whose
    legs, tail or head link that may be (-1: all)."""
    count = len(pose.anchors)
    slack, none = STANDS * keeps.size + met * keeps.size, met * keeps.size
    first, last = (0, 2 * count) if only < 0 else (max(0, 2 * only - 1), min(2 * count, 2 * only + 3))
    floor = ceiling = False
    for i in range(count):
        if only < 0 or i == only:
            segment[0, 0], segment[0, 1] = pose.anchors[i], pose.anchors[i]
            floor = floor or _near(steps.floor_x, steps.floor_z, segment, keeps.rest, slack, gap)
    for k in range(first, last):
        if (k == 0 and only > 0) or (k == 2 * count - 1 and 0 <= only < count - 1):
            continue
        segment[0, 0] = pose.origins[k]
        if k < 2 * count - 1:
            segment[0, 1] = pose.origins[k + 1]
        else:
            segment[0, 1, 0], segment[0, 1, 1] = pose.origins[k, 0] + keeps.head, pose.origins[k, 1]
        more = keeps.low if k == 0 or k == 2 * count - 1 else keeps.margin
        floor = floor or _near(steps.floor_x, steps.floor_z, segment, keeps.body, slack, gap)
        floor = floor or _at_corner(steps, segment, keeps.body + more, none)
        # links keep from the ceiling what the joints must: those are where it is nearest
        segment[:, :, 1] *= -1.0
        ceiling = ceiling or _near(steps.roof_x, steps.roof_z, segment, keeps.top + keeps.margin, none, gap)
        if floor and ceiling:
            break
    return floor, ceiling


@njit(cache=True)
def _crouched(steps: Steps, keeps: Keeps, pose: Pose, at: Array) -> bool:
    """Whether the body is higher than the lowest place near anchors ``at`` (N, 2) leaves room for."""
    low, high = pose.anchors[0, 1], -np.inf
    for i in range(len(pose.anchors)):
        low = min(low, pose.anchors[i, 1])
        if i < len(pose.anchors) - 1:
            high = max(high, pose.origins[2 * i + 2, 1])
    room = room_above(steps, at[0, 0] - keeps.crouch, at[len(at) - 1, 0] + keeps.crouch)
    return bool(high - low - (room - keeps.rest - keeps.top - keeps.margin) > 0.0)


@njit(cache=True)
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
    places: Array,
    only: int,
    met: float,
    every: bool,
    pose: Pose,
    out: BoolArray,
) -> int:
    """What of :data:`TRIED` move ``m`` runs into at ``places`` (p,) of tau, into ``out`` (9,), and the place where the
    first was found, -1 where none is. ``every``: all of it, the ground only where the demands are met; or else the
    first thing that is found."""
    found, segment, gap = np.empty(len(DEMANDS)), np.empty((1, 2, 2)), np.empty(1)
    enough = np.inf if every else met
    first = -1
    out[:] = False
    pose.fresh[0] = True
    for p in range(len(places)):
        lay(bounds, before, after, lift, early, m, places[p], pose)
        excess(bounds, swinging, pose, enough, found)
        bad = False
        for d in range(len(DEMANDS)):
            if found[d] > met:
                out[d] = bad = True
        if not bad and not every:
            out[FLOOR], out[CEILING] = into_ground(steps, keeps, pose, only, met, segment, gap)
            bad = out[FLOOR] or out[CEILING]
        if not np.isnan(keeps.crouch):
            low = _crouched(steps, keeps, pose, before[m])
            if places[p] == 1.0:
                low = low or _crouched(steps, keeps, pose, after[m])
            out[CEILING] = out[CEILING] or low
            bad = bad or low
        if bad and first < 0:
            first = p
            if not every:
                return first
    if every and not out[: len(DEMANDS)].any():
        for p in range(len(places)):
            lay(bounds, before, after, lift, early, m, places[p], pose)
            floor, ceiling = into_ground(steps, keeps, pose, only, met, segment, gap)
            out[FLOOR], out[CEILING] = out[FLOOR] or floor, out[CEILING] or ceiling
    return first


@njit(cache=True)
def try_moves(
    bounds: Bounds,
    steps: Steps,
    keeps: Keeps,
    before: Array,
    after: Array,
    lift: Array,
    early: Array,
    swinging: BoolArray,
    places: Array,
    only: int,
    met: float,
    every: bool,
    out: BoolArray,
) -> None:
    """:func:`try_move` for every move, into ``out`` (M, 9)."""
    pose = room_for(bounds)
    for m in range(len(before)):
        try_move(
            bounds, steps, keeps, before, after, lift, early, swinging[m], m, places, only, met, every, pose, out[m]
        )


@njit(cache=True)
def rise(steps: Steps, keeps: Keeps, start: Array, end: Array, tail: bool, head: bool) -> float:
    """How far m the floor under the way of an anchor from ``start`` (2,) to ``end``, its ``tail`` or ``head`` link
    included, stands above the higher of them."""
    low = min(start[0], end[0]) - (keeps.tail if tail else 0.0)
    high = max(start[0], end[0]) + (keeps.head if head else 0.0)
    top, out = max(start[1], end[1]) - keeps.rest, 0.0
    for at in steps.breaks:
        if low <= at <= high:
            out = max(out, highest(steps.floor_x, steps.floor_z, at, at) - top)
    return out


@njit(cache=True)
def land(
    bounds: Bounds,
    steps: Steps,
    keeps: Keeps,
    anchors: Array,
    i: int,
    spots: Array,
    shapes: Array,
    places: Array,
    met: float,
    out: Array,
    which: IntArray,
) -> None:
    """For anchor ``i`` of ``anchors`` (N, 2) and each of ``spots`` (K, 2): the first of ``shapes`` (k, 2) in which it
    gets there, as ``which`` (K,) and its lift and ``early`` in ``out`` (K, 2); -1 where it cannot stand there, -2 where
    no shape goes. Over level ground no other shape than the first can help, and none is lower."""
    count = len(anchors)
    before, after = anchors.copy().reshape(1, count, 2), anchors.copy().reshape(1, count, 2)
    lift, early, swinging = np.zeros((1, count)), np.ones((1, count)), np.zeros(count, dtype=np.bool_)
    pose, found, here = room_for(bounds), np.empty(len(TRIED), dtype=np.bool_), np.zeros(1)
    order = places.copy()
    for k in range(len(spots)):
        after[0, i], before[0, i] = spots[k], spots[k]
        lift[0, i], early[0, i], swinging[i] = 0.0, 1.0, False
        which[k] = -1
        if (
            try_move(bounds, steps, keeps, before, after, lift, early, swinging, 0, here, i, met, False, pose, found)
            >= 0
        ):
            continue
        before[0, i] = anchors[i]
        swinging[i] = True
        above = rise(steps, keeps, anchors[i], spots[k], i == 0, i == count - 1)
        level = spots[k, 1] == anchors[i, 1] and above <= 0.0
        which[k] = -2
        for s in range(1 if level else len(shapes)):
            lift[0, i], early[0, i] = keeps.lift + shapes[s, 0] * (above + keeps.margin), shapes[s, 1]
            swinging[i] = lift[0, i] > 0.0
            bad = try_move(
                bounds, steps, keeps, before, after, lift, early, swinging, 0, order, i, met, False, pose, found
            )
            if bad < 0:
                which[k], out[k, 0], out[k, 1] = s, lift[0, i], early[0, i]
                break
            # what was in the way here is likely to be in the way of the next
            worst = order[bad]
            for p in range(bad, 0, -1):
                order[p] = order[p - 1]
            order[0] = worst
