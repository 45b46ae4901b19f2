"""Whether one pose of the snake, or one move, keeps clear of a floor and a ceiling in steps: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray
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
    if only > 0 and first == 0:
        first = 1
    if 0 <= only < count - 1:
        last = min(last, 2 * count - 1)
    left, right, low, high = np.inf, -np.inf, np.inf, -np.inf
    for k in range(first, min(last + 1, 2 * count)):
        x, z = pose.origins[k, 0], pose.origins[k, 1]
        left, right, low, high = min(left, x), max(right, x), min(low, z), max(high, z)
    if last == 2 * count:
        right = max(right, pose.origins[last - 1, 0] + keeps.head)
    reach = keeps.body + max(keeps.margin, keeps.low)
    ground = highest(steps.floor_x, steps.floor_z, left - reach, right + reach)
    edge = np.searchsorted(steps.corners[:, 0], left - reach, side="left")
    edges = edge < len(steps.corners) and steps.corners[edge, 0] <= right + reach
    floor = ceiling = False
    # where no step is near the floor is level under all of the body
    clear = not edges and low - ground >= max(keeps.rest, keeps.body) - slack
    if not clear:
        for i in range(count):
            if not floor and (only < 0 or i == only):
                segment[0, 0], segment[0, 1] = pose.anchors[i], pose.anchors[i]
                floor = _near(steps.floor_x, steps.floor_z, segment, keeps.rest, slack, gap)
    above = keeps.top + keeps.margin
    roof = highest(steps.roof_x, steps.roof_z, left - above, right + above)
    for k in range(first, last):
        if clear or floor:
            break
        _link(keeps, pose, k, segment)
        if min(segment[0, 0, 1], segment[0, 1, 1]) - ground >= reach:
            continue
        more = keeps.low if k == 0 or k == 2 * count - 1 else keeps.margin
        floor = _near(steps.floor_x, steps.floor_z, segment, keeps.body, slack, gap)
        floor = floor or _at_corner(steps, segment, keeps.body + more, none)
    for k in range(first, last):
        if ceiling or high + roof <= -above:
            break
        # links keep from the ceiling what the joints must: those are where it is nearest
        _link(keeps, pose, k, segment)
        segment[0, 0, 1], segment[0, 1, 1] = -segment[0, 0, 1], -segment[0, 1, 1]
        if min(segment[0, 0, 1], segment[0, 1, 1]) - roof < above:
            ceiling = _near(steps.roof_x, steps.roof_z, segment, above, none, gap)
    return floor, ceiling


@njit(cache=True)
def _link(keeps: Keeps, pose: Pose, k: int, segment: Array) -> None:
    """Both ends of link ``k`` into ``segment`` (1, 2, 2); 0 is the tail link, the last the head link."""
    segment[0, 0] = pose.origins[k]
    if k < len(pose.origins) - 1:
        segment[0, 1] = pose.origins[k + 1]
    else:
        segment[0, 1, 0], segment[0, 1, 1] = pose.origins[k, 0] + keeps.head, pose.origins[k, 1]


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
    pose.fresh[:] = True
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
