"""How far anchors go in a cycle over level ground: the 60 % rule, the drive that repeats, and the fastest one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, finite, number
from bodyplan.errors import InputError, Status
from bodyplan.gaits.rectilinear.demands import MET, RATE_PLACES, Demands, move_names, phases
from bodyplan.gaits.rectilinear.moves import Moves

#: the paper's share of a spacing that a drive may take up ("restricted to 60 % ... to avoid adjacent link collision")
SHARE = 0.6
#: candidates in each round that closes in on the largest stride, and rounds (17^-13 is below rounding)
CANDIDATES, ROUNDS = 16, 13
#: share of the largest stride that spacings allow below which no stride is looked for
SMALLEST = 1e-4
#: spacings and strides tried for the fastest gait under rate limits, then the golden sections of each
TRIED, SHARES, GOLDEN = 17, 6, 10
#: a stride so small that time and way are in proportion: without lift the fastest may be the smallest
LEAST_SHARE = 0.01
#: sizes of the first steps of the searches for the spacing of each kind of leg, and the most strides each tries
SIMPLEXES, MOST_TRIED = (0.2, 0.1, 0.05, 0.03), 200
#: places along a move at which rates are taken in the search
FEW = 65
#: shares of straight legs tried where straight ones cannot be lifted or a lift costs stride
NEARLY_STRAIGHT = (0.995, 0.98, 0.95, 0.9, 0.8)


def paper_drive(spacings: ArrayLike, share: float = SHARE) -> Array:
    """The 60 % rule of the paper for a cycle in which the anchors move one after another: (N,) m from N - 1 spacings.

    Every anchor goes ``share`` of the way to the next one ahead, the head as far as the middle: 720, 1680, 1680 mm from
    1200 and 2800 (Fig. 8). It does not repeat unless the spacings are equal: L_TM becomes 0.4 L_TM + 0.6 L_MH.
    """
    gaps = finite(spacings, "spacings", (None,))
    if not len(gaps) or np.any(gaps <= 0.0):
        raise InputError(f"spacings: at least one, all > 0, got {gaps}.")
    share = number(share, "share", above=0.0, below=1.0)
    return np.asarray(share * np.append(gaps, gaps[-1]))


@dataclass(frozen=True, eq=False)
class Stride:
    """A gait over level ground that repeats: ``spacings`` (N - 1,) m at the beginning of a cycle, ``stride`` m of every
    anchor, ``moves`` of one cycle, their ``durations`` (M,) s; ``status`` and, where it fails, the move that does."""

    spacings: Array
    stride: float
    moves: Moves
    durations: Array
    status: Status = Status.OK
    failing: str = ""

    def speed(self, dwell: float) -> float:
        """m/s, with ``dwell`` s after every move."""
        return self.stride / float(self.durations.sum() + dwell * len(self.durations))


def cycle_of(spacings: Array, strides: Array, schedule: str, lift: float) -> Moves:
    """The moves of one cycle over level ground from anchors at ``spacings`` (N - 1,), the first at 0: anchor i goes
    ``strides`` (N,) m."""
    count = len(spacings) + 1
    at = np.zeros((count, 2))
    at[1:, 0] = np.cumsum(spacings)
    groups = phases(count, schedule)
    before, after, lifts = [], [], []
    for group in groups:
        before.append(at.copy())
        at[group, 0] += strides[group]
        after.append(at.copy())
        up = np.zeros(count)
        up[group] = lift
        lifts.append(up)
    shape = (len(groups), count)
    return Moves(np.array(before), np.array(after), np.array(lifts), np.ones(shape), tuple(move_names(count, schedule)))


def start_spacings(long: Array, stride: float, schedule: str) -> Array:
    """(N - 1,) m at the beginning of a cycle: a wave starts with every leg ``long``, two phases with every second one
    short by the stride."""
    short = np.zeros(len(long))
    if schedule == "two-phase":
        short[1::2] = stride
    return np.asarray(long - short)


def repeating(demands: Demands, long: Array, stride: float, schedule: str, lift: float) -> Moves:
    """One cycle of equal ``stride`` m in which leg i is ``long[i]`` m at its longest."""
    return cycle_of(start_spacings(long, stride, schedule), np.full(demands.anchors, stride), schedule, lift)


def largest_stride(demands: Demands, long: Array, schedule: str, lift: float, most: float = np.inf) -> float:
    """The largest stride (m) with legs ``long`` (N - 1,) m at their longest that meets the demands, not above ``most``;
    0 where none does."""
    from scipy.optimize import brentq  # half a second to load

    top = min(most, float(np.min(long - demands.least)))
    if top <= 0.0:
        return 0.0
    known: dict[float, Array] = {}

    def beyond(*strides: float) -> Array:
        new = [stride for stride in strides if stride not in known]
        if new:
            cycles = [repeating(demands, long, stride, schedule, lift) for stride in new]
            known.update(zip(new, _excess(demands, cycles), strict=True))
        return np.array([known[stride] for stride in strides])

    if beyond(top).max() <= MET:
        return top
    # reach apart: the excess over it is 0 at a straight leg and tells nothing of how near the edge is
    low = 1e-6 * top
    if beyond(low)[0, 0] < 0.0 < beyond(top)[0, 0]:
        root = float(brentq(lambda stride: beyond(stride)[0, 0], low, top, xtol=1e-16 * top, rtol=1e-15))
        root *= 1.0 if beyond(root).max() <= MET else 1.0 - 1e-14
        if beyond(root).max() <= MET:
            return root
        top = root
    # a lifted anchor that pulls a straight leg must go forward while it rises: small strides may fail where larger
    # ones pass, so many are tried at once
    low, high = 0.0, top
    for _ in range(ROUNDS):
        tried = low + (high - low) * np.arange(1, CANDIDATES + 1) / (CANDIDATES + 1)
        passed = beyond(*map(float, tried)).max(axis=1) <= MET
        k = int(np.flatnonzero(passed)[-1]) if passed.any() else -1
        low, high = (float(tried[k]) if k >= 0 else low), (float(tried[k + 1]) if k + 1 < len(tried) else high)
        if high - low <= 1e-16 * top or high <= SMALLEST * top:
            break
    return low


def _excess(demands: Demands, cycles: list[Moves]) -> Array:
    """(C, 2): the largest excess of every cycle over all demands but reach, and over reach."""
    found = demands.worst(Moves.joined(cycles))
    return np.stack([most.reshape(len(cycles), -1).max(axis=1) for most in found], axis=-1)


def stride_of(
    demands: Demands, long: Array, stride: float, schedule: str, lift: float, least: float, *, places: int = RATE_PLACES
) -> Stride:
    """The gait with that ``stride``, checked and timed; ``least`` s a move, rates taken at ``places`` of each."""
    moves = repeating(demands, long, stride, schedule, lift)
    statuses = demands.met(moves)
    bad = next((i for i, s in enumerate(statuses) if s != Status.OK), None)
    durations = np.full(len(moves), least) if bad is not None else demands.durations(moves, least, places)
    return Stride(
        start_spacings(long, stride, schedule),
        stride,
        moves,
        durations,
        Status.OK if bad is None else statuses[bad],
        "" if bad is None else moves.names[bad],
    )


def fastest(demands: Demands, longest: Array, schedule: str, lift: float, least: float, dwell: float) -> Stride | None:
    """The fastest gait with legs at most ``longest`` (N - 1,) m; None where no stride meets the demands.

    Without rate limits it is the largest stride. With them a straight leg is slow to start, so that spacing and stride
    are searched: the best stride of each spacing on a grid and by golden sections, and so the best spacing; where legs
    are not alike, then the spacing of each kind.
    """
    top = cache(lambda scale: largest_stride(demands, longest * scale, schedule, lift))

    @cache
    def at(scale: float, share: float) -> Stride | None:
        if top(scale) <= 0.0:
            return None
        found = stride_of(demands, longest * scale, top(scale) * share, schedule, lift, least, places=FEW)
        return found if found.status == Status.OK else None

    def speed(scale: float, share: float) -> float:
        return _speed(at(scale, share), dwell)

    shares = np.append(np.linspace(1.0, 0.0, SHARES, endpoint=False), LEAST_SHARE)

    @cache
    def best_share(scale: float) -> float:
        return _largest(partial(speed, scale), shares) if top(scale) > 0.0 else 1.0

    straight = at(1.0, 1.0)
    if straight is None or np.all(straight.durations <= least):
        # no joint is too fast: the largest stride, from straight legs unless the lift forbids it
        best = straight
        for scale in NEARLY_STRAIGHT:
            # no stride is larger than what the shortest leg leaves, no move faster than the least time
            most = float(np.min(longest * scale - demands.least)) / (
                len(phases(demands.anchors, schedule)) * (least + dwell)
            )
            if most > _speed(best, dwell):
                best = max(best, at(scale, 1.0), key=lambda f: _speed(f, dwell))
        if best is None or np.all(best.durations <= least):
            return best if best is None else replace(best, durations=demands.durations(best.moves, least))
    scale = _largest(lambda scale: speed(scale, best_share(scale)), np.linspace(1.0, 0.2, TRIED))
    best = at(scale, best_share(scale))
    if best is not None and len(_kinds(demands, longest)[1]) > 1:
        best = _leg_by_leg(demands, longest, schedule, lift, least, dwell, best)
    # the search takes rates at few places, the gait at many
    return None if best is None else replace(best, durations=demands.durations(best.moves, least))


def _kinds(demands: Demands, longest: Array) -> tuple[IntArray, IntArray]:
    """Which kind of leg each (N - 1,) is, and the first of every kind."""
    legs = np.stack([demands.links[0::2], demands.links[1::2], longest], axis=-1) / demands.links.max()
    _, first, which = np.unique(np.round(legs, 9), axis=0, return_index=True, return_inverse=True)
    return np.asarray(which.ravel(), dtype=np.int64), np.asarray(first, dtype=np.int64)


def _leg_by_leg(
    demands: Demands, longest: Array, schedule: str, lift: float, least: float, dwell: float, found: Stride
) -> Stride:
    """The fastest gait near ``found`` in which every kind of leg has a spacing of its own: the search of Nelder and
    Mead, again and again from where it ended."""
    from scipy.optimize import minimize

    which, first = _kinds(demands, longest)

    def stride(x: Array) -> Stride | None:
        long, far = longest * x[which], float(x[-1])
        if x[:-1].max() > 1.0 or not 0.0 < far <= float(np.min(long - demands.least)):
            return None
        tried = stride_of(demands, long, far, schedule, lift, least, places=FEW)
        return tried if tried.status == Status.OK else None

    def slowness(x: Array) -> float:
        return -_speed(stride(x), dwell)

    long = found.spacings - start_spacings(np.zeros(len(longest)), found.stride, schedule)
    best = np.append(long[first] / longest[first], found.stride)
    free: dict[str, Any] = {"maxfev": min(60 * len(best), MOST_TRIED), "xatol": 1e-4, "fatol": 1e-7}
    for step in SIMPLEXES:
        corners = np.array([best, *(best - step * np.diag(best))])
        options: Any = {"initial_simplex": corners, **free}
        best = np.asarray(minimize(slowness, best, method="Nelder-Mead", options=options).x)
    return max((found, stride(best)), key=lambda s: _speed(s, dwell)) or found


def _speed(found: Stride | None, dwell: float) -> float:
    return 0.0 if found is None else found.speed(dwell)


def _largest(f: Callable[[float], float], grid: Array) -> float:
    """Where f is largest: on a descending ``grid``, then by golden sections between the neighbours of its best."""
    tried = {float(x): f(float(x)) for x in grid}
    k = int(np.argmax(list(tried.values())))
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    a, b = float(grid[min(k + 1, len(grid) - 1)]), float(grid[max(k - 1, 0)])
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    for _ in range(GOLDEN):
        for x in (c, d):
            if x not in tried:
                tried[x] = f(x)
        if tried[c] >= tried[d]:
            b, d = d, c
            c = b - ratio * (b - a)
        else:
            a, c = c, d
            d = a + ratio * (b - a)
    return max(tried, key=lambda x: tried[x])
