"""Where the anchors of a phase can land, from the farthest spot on, each found when it is asked for: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.rectilinear.bounds import Bounds
from bodyplan.gaits.rectilinear.landing import Trial, swing_to, trial_of
from bodyplan.gaits.rectilinear.terrain import Keeps, Places, Steps, highest
from bodyplan.kernels import lean

#: what is not known of a spot before it is tried
UNKNOWN = -3
#: spots are those beside an edge from so near on, m
AT_EDGE = 1e-12


class Ranges(NamedTuple):
    """Where anchors may land: legs are at most ``straight`` (N - 1,) m, and neighbouring anchors ``nearest`` m from
    each other; no leg need be shorter than ``short`` (N - 1,) m. ``edges`` (E,) m: places that matter beside the edges
    of steps, those of anchor i ascending from ``first[i]`` to ``first[i + 1]`` (N + 1,), at most ``crowd`` of them in
    reach at once."""

    straight: Array
    nearest: float
    short: Array
    edges: Array
    first: IntArray
    crowd: int


class Choice(NamedTuple):
    """What spots and swings are tried: ``spots`` at equal steps from standing to reach, then in how many ``rounds``
    ``closer`` more beyond the farthest that goes; the next ones that go at ``shares`` (m,) of the way to it. ``shapes``
    (k, 2) of swings; ``places`` along the way, those first at which something in the way shows early."""

    spots: int
    closer: int
    rounds: int
    shares: Array
    shapes: Array
    places: Places


class Offers(NamedTuple):
    """What is known of the landing spots of the anchors of a phase, G of them, for S stances ``here`` (S, N, 2):
    ``spots`` (S, G, K, 4), ascending, with s and height m, lift m and how early the swing rises; ``known`` (S, G, K)
    :data:`UNKNOWN`, negative for those where nothing goes; ``last`` (S, G) the farthest that goes and ``at`` (S, G) the
    one that is offered, -1 where there is none; ``order`` (S, G, p) of places, those first at which swings failed
    last."""

    here: Array
    spots: Array
    known: IntArray
    last: IntArray
    at: IntArray
    order: IntArray


def offers_for(ranges: Ranges, choice: Choice, here: Array, size: int) -> Offers:
    """Room for what is offered to a phase of ``size`` anchors of stances ``here`` (S, N, 2)."""
    most = choice.spots + ranges.crowd + choice.closer * choice.rounds
    shape = (len(here), size)
    known, last, at = (np.empty(some, dtype=np.int64) for some in ((*shape, most), shape, shape))
    order = np.empty((*shape, len(choice.places.order)), dtype=np.int64)
    return Offers(here, np.empty((*shape, most, 4)), known, last, at, order)


@lean
def reach(ranges: Ranges, here: Array, i: int) -> float:
    """m: what anchor ``i`` of ``here`` (N, 2) cannot pass: the reach of the leg behind it, and the anchor ahead."""
    far = np.inf
    if i > 0:
        far = min(far, here[i - 1, 0] + ranges.straight[i - 1])
    if i < len(here) - 1:
        far = min(far, here[i + 1, 0] - ranges.nearest)
    return float(max(far, here[i, 0]))


@lean
def places_of(ranges: Ranges, count: int, here: Array, i: int, out: Array) -> int:
    """Places where anchor ``i`` of ``here`` (N, 2) might land, ascending, into ``out``: ``count`` at equal steps up to
    its reach, and those at edges; how many they are (no more than there is room for)."""
    start, far = here[i, 0], reach(ranges, here, i)
    k = 1 if far > start else count + 1
    e, last, n = ranges.first[i], ranges.first[i + 1], 0
    while e < last and ranges.edges[e] <= start:
        e += 1
    while n < len(out) and (k <= count or (e < last and ranges.edges[e] < far)):
        even = start + (far - start) * k / count if k <= count else np.inf
        if e < last and ranges.edges[e] < min(even, far):
            out[n] = ranges.edges[e]
            e += 1
        else:
            out[n] = even
            k += 1
        n += 1
    return n


@njit(cache=True)
def places(ranges: Ranges, count: int, here: Array, i: int) -> Array:
    """:func:`places_of` in an array of its own."""
    out = np.empty(count + ranges.first[i + 1] - ranges.first[i])
    return out[: places_of(ranges, count, here, i, out)]


@lean
def _room(ranges: Ranges, here: Array, i: int) -> tuple[float, float]:
    """m from where and up to where anchor ``i`` makes no leg of ``here`` too short for the next move."""
    low, high = -np.inf, np.inf
    if i > 0:
        low = here[i - 1, 0] + ranges.short[i - 1] * (1.0 - 1e-9)
    if i < len(here) - 1:
        high = here[i + 1, 0] - ranges.short[i] * (1.0 - 1e-9)
    return low, high


@lean
def _goes(
    bounds: Bounds, steps: Steps, keeps: Keeps, choice: Choice, met: float, offers: Offers, trial: Trial, b: int,
    g: int, i: int, k: int,
) -> bool:  # fmt: skip
    """Whether anchor ``i``, at ``g`` in its group, of stance ``b`` gets to spot ``k``; found out where that is not
    known."""
    spot, known = offers.spots[b, g, k], offers.known[b, g]
    if known[k] == UNKNOWN:
        spot[1] = highest(steps.floor_x, steps.floor_z, spot[0], spot[0]) + keeps.rest
        known[k], spot[2], spot[3] = swing_to(bounds, steps, keeps, trial, offers.here[b], i, spot, choice.shapes, met)
    return bool(known[k] >= 0)


@lean
def _farthest(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers,
    trial: Trial, b: int, g: int, i: int, count: int,
) -> None:  # fmt: skip
    """Offer the farthest of the first ``count`` spots that goes, or one beyond it that is closer to where nothing goes
    any more. What lies behind is not tried."""
    here, spots, known = offers.here[b], offers.spots[b, g], offers.known[b, g]
    last = -1
    for k in range(count - 1, -1, -1):
        if _goes(bounds, steps, keeps, choice, met, offers, trial, b, g, i, k):
            last = k
            break
    offers.last[b, g] = offers.at[b, g] = last
    if last < 0:
        return
    (low, high), far = _room(ranges, here, i), reach(ranges, here, i)
    step = (far - here[i, 0]) / choice.spots
    for _ in range(choice.rounds):
        begin = spots[last, 0]
        for k in range(choice.closer, 0, -1):
            x = begin + step * k / (choice.closer + 1)
            if x >= far or not low <= x <= high:
                continue
            spots[last + k, 0], known[last + k] = x, UNKNOWN
            if _goes(bounds, steps, keeps, choice, met, offers, trial, b, g, i, last + k):
                for j in range(1, k):
                    spots[last + j, 0], known[last + j] = begin + step * j / (choice.closer + 1), UNKNOWN
                last += k
                break
        step /= choice.closer + 1
    offers.last[b, g] = offers.at[b, g] = last


@lean
def _next(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers,
    trial: Trial, b: int, g: int, i: int,
) -> bool:  # fmt: skip
    """Offer the next spot behind, if there is one: beside an edge, or the first that goes from a share of the way to
    the farthest one on."""
    wanted, last = False, offers.last[b, g]
    for k in range(offers.at[b, g] - 1, -1, -1):
        for s in range(len(choice.shares)):
            wanted = wanted or int(np.round(choice.shares[s] * last)) == k
        asked = wanted
        for e in range(ranges.first[i], ranges.first[i + 1]):
            asked = asked or abs(ranges.edges[e] - offers.spots[b, g, k, 0]) < AT_EDGE
        if asked and _goes(bounds, steps, keeps, choice, met, offers, trial, b, g, i, k):
            offers.at[b, g] = k
            return True
    return False


@lean
def _begin(trial: Trial, here: Array, order: IntArray) -> None:
    """Another anchor, or one of another stance ``here`` (N, 2)."""
    trial.pose.fresh[0] = trial.pose.fresh[1] = True
    for i in range(len(here)):
        for c in range(2):
            trial.before[0, i, c] = trial.after[0, i, c] = here[i, c]
    for p in range(len(order)):
        trial.places.order[p] = order[p]


@lean
def _nearer(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers,
    trial: Trial, group: IntArray, b: int,
) -> bool:  # fmt: skip
    """Offer the next landing spot behind for every anchor of stance ``b`` that has one; False where none has."""
    some = False
    for g in range(len(group)):
        _begin(trial, offers.here[b], offers.order[b, g])
        if _next(bounds, steps, keeps, ranges, choice, met, offers, trial, b, g, group[g]):
            some = True
        for p in range(len(trial.places.order)):
            offers.order[b, g, p] = trial.places.order[p]
    return some


@lean
def _tell(offers: Offers, group: IntArray, b: int, out: Array) -> None:
    """The move that is offered to stance ``b`` into ``out`` (N, 4): where the anchors are then, m along and up, lift m
    and how early they rise."""
    for i in range(len(out)):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = offers.here[b, i, 0], offers.here[b, i, 1], 0.0, 1.0
    for g in range(len(group)):
        if offers.at[b, g] >= 0:
            for c in range(4):
                out[group[g], c] = offers.spots[b, g, offers.at[b, g], c]


@njit(cache=True)
def farthest(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, group: IntArray,
    offers: Offers, out: Array, told: IntArray,
) -> None:  # fmt: skip
    """Offer the farthest landing spots of the anchors ``group`` (G,) of every stance; among those that make no leg too
    short where one of these goes. Into ``out`` (S, A, N, 4) that move and the next ones behind it, ``told`` (S,) of
    them."""
    trial = trial_of(bounds, offers.here[0], choice.places)
    at = np.empty(offers.spots.shape[2] - choice.closer * choice.rounds)
    for b in range(len(offers.here)):
        here, some = offers.here[b], False
        for g in range(len(group)):
            i = group[g]
            _begin(trial, here, choice.places.order)
            count, (low, high) = places_of(ranges, choice.spots, here, i, at), _room(ranges, here, i)
            for roomy in (True, False):
                n = 0
                for k in range(count):
                    if (low <= at[k] <= high) == roomy:
                        offers.spots[b, g, n, 0], offers.known[b, g, n] = at[k], UNKNOWN
                        n += 1
                _farthest(bounds, steps, keeps, ranges, choice, met, offers, trial, b, g, i, n)
                if offers.at[b, g] >= 0:
                    some = True
                    break
            for p in range(len(trial.places.order)):
                offers.order[b, g, p] = trial.places.order[p]
        told[b] = 0
        while some and told[b] < out.shape[1]:
            _tell(offers, group, b, out[b, told[b]])
            told[b] += 1
            if told[b] < out.shape[1]:
                some = _nearer(bounds, steps, keeps, ranges, choice, met, offers, trial, group, b)


@njit(cache=True)
def nearer(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, group: IntArray,
    offers: Offers, b: int, out: Array,
) -> int:  # fmt: skip
    """Offer stance ``b`` what lies behind, one after the other, into ``out`` (A, N, 4); how many there are of it."""
    trial = trial_of(bounds, offers.here[b], choice.places)
    told = 0
    while told < len(out) and _nearer(bounds, steps, keeps, ranges, choice, met, offers, trial, group, b):
        _tell(offers, group, b, out[told])
        told += 1
    return told
