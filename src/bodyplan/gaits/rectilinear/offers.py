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
    of steps, those of anchor i ascending from ``first[i]`` to ``first[i + 1]`` (N + 1,)."""

    straight: Array
    nearest: float
    short: Array
    edges: Array
    first: IntArray


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
    """What is known of the landing spots of the anchors ``group`` (G,) of a stance ``here`` (N, 2): ``spots``
    (G, K, 4), ascending, with s and height m, lift m and how early the swing rises; ``known`` (G, K) :data:`UNKNOWN`,
    negative for those where nothing goes; ``last`` (G,) the farthest that goes and ``at`` (G,) the one that is offered,
    -1 where there is none; ``after`` (N, 2), ``lift`` and ``early`` (N,): the move to the spots ``at``; ``order``
    (G, p) of places, those first at which swings failed last."""

    here: Array
    group: IntArray
    spots: Array
    known: IntArray
    last: IntArray
    at: IntArray
    after: Array
    lift: Array
    early: Array
    order: IntArray


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
    its reach, and those at edges; how many they are."""
    start, far = here[i, 0], reach(ranges, here, i)
    k = 1 if far > start else count + 1
    e, last, n = ranges.first[i], ranges.first[i + 1], 0
    while e < last and ranges.edges[e] <= start:
        e += 1
    while k <= count or (e < last and ranges.edges[e] < far):
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
    bounds: Bounds, steps: Steps, keeps: Keeps, choice: Choice, met: float, offers: Offers, trial: Trial, g: int, k: int
) -> bool:  # fmt: skip
    """Whether the anchor at ``g`` in its group gets to spot ``k``; found out where that is not known."""
    spot, known = offers.spots[g, k], offers.known[g]
    if known[k] == UNKNOWN:
        spot[1] = highest(steps.floor_x, steps.floor_z, spot[0], spot[0]) + keeps.rest
        known[k], spot[2], spot[3] = swing_to(
            bounds, steps, keeps, trial, offers.here, offers.group[g], spot, choice.shapes, met
        )
    return bool(known[k] >= 0)


@lean
def _farthest(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers,
    trial: Trial, g: int, count: int,
) -> None:  # fmt: skip
    """Offer the farthest of the first ``count`` spots that goes, or one beyond it that is closer to where nothing goes
    any more. What lies behind is not tried."""
    spots, known, i = offers.spots[g], offers.known[g], offers.group[g]
    last = -1
    for k in range(count - 1, -1, -1):
        if _goes(bounds, steps, keeps, choice, met, offers, trial, g, k):
            last = k
            break
    offers.last[g] = offers.at[g] = last
    if last < 0:
        return
    (low, high), far = _room(ranges, offers.here, i), reach(ranges, offers.here, i)
    step = (far - offers.here[i, 0]) / choice.spots
    for _ in range(choice.rounds):
        begin = spots[last, 0]
        for k in range(choice.closer, 0, -1):
            x = begin + step * k / (choice.closer + 1)
            if x >= far or not low <= x <= high:
                continue
            spots[last + k, 0], known[last + k] = x, UNKNOWN
            if _goes(bounds, steps, keeps, choice, met, offers, trial, g, last + k):
                for j in range(1, k):
                    spots[last + j, 0], known[last + j] = begin + step * j / (choice.closer + 1), UNKNOWN
                last += k
                break
        step /= choice.closer + 1
    offers.last[g] = offers.at[g] = last


@lean
def _nearer(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers,
    trial: Trial, g: int,
) -> bool:  # fmt: skip
    """Offer the next spot behind, if there is one: beside an edge, or the first that goes from a share of the way to
    the farthest one on."""
    i, wanted = offers.group[g], False
    for k in range(offers.at[g] - 1, -1, -1):
        for s in range(len(choice.shares)):
            wanted = wanted or int(np.round(choice.shares[s] * offers.last[g])) == k
        asked = wanted
        for e in range(ranges.first[i], ranges.first[i + 1]):
            asked = asked or abs(ranges.edges[e] - offers.spots[g, k, 0]) < AT_EDGE
        if asked and _goes(bounds, steps, keeps, choice, met, offers, trial, g, k):
            offers.at[g] = k
            return True
    return False


@lean
def _tell(offers: Offers, g: int) -> None:
    k, i = offers.at[g], offers.group[g]
    offers.after[i, 0], offers.after[i, 1] = offers.spots[g, k, 0], offers.spots[g, k, 1]
    offers.lift[i], offers.early[i] = offers.spots[g, k, 2], offers.spots[g, k, 3]


@njit(cache=True)
def farthest(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, here: Array, group: IntArray
) -> Offers:  # fmt: skip
    """Offers of the farthest landing spots of anchors ``group`` (G,) of ``here`` (N, 2); among those that make no leg
    too short where one of these goes."""
    size, edges = len(group), ranges.first[1:] - ranges.first[:-1]
    most = choice.spots + edges.max() + choice.closer * choice.rounds
    offers = Offers(
        here.copy(),
        group,
        np.empty((size, most, 4)),
        np.empty((size, most), dtype=np.int64),
        np.empty(size, dtype=np.int64),
        np.empty(size, dtype=np.int64),
        here.copy(),
        np.zeros(len(here)),
        np.ones(len(here)),
        np.empty((size, len(choice.places.order)), dtype=np.int64),
    )
    trial, at = trial_of(bounds, here, choice.places), np.empty(most)
    for g in range(size):
        i = group[g]
        trial.places.order[:] = choice.places.order
        trial.pose.fresh[:] = True
        count, (low, high) = places_of(ranges, choice.spots, here, i, at), _room(ranges, here, i)
        for roomy in (True, False):
            n = 0
            for k in range(count):
                if (low <= at[k] <= high) == roomy:
                    offers.spots[g, n, 0] = at[k]
                    n += 1
            offers.known[g] = UNKNOWN
            _farthest(bounds, steps, keeps, ranges, choice, met, offers, trial, g, n)
            if offers.at[g] >= 0:
                _tell(offers, g)
                break
        offers.order[g] = trial.places.order
    return offers


@njit(cache=True)
def nearer(
    bounds: Bounds, steps: Steps, keeps: Keeps, ranges: Ranges, choice: Choice, met: float, offers: Offers
) -> bool:  # fmt: skip
    """Offer the next landing spot behind for every anchor that has one; False where none has."""
    trial, some = trial_of(bounds, offers.here, choice.places), False
    for g in range(len(offers.group)):
        trial.places.order[:] = offers.order[g]
        trial.pose.fresh[:] = True
        if _nearer(bounds, steps, keeps, ranges, choice, met, offers, trial, g):
            some = True
            _tell(offers, g)
        offers.order[g] = trial.places.order
    return some
