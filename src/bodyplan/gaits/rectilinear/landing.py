"""Where one anchor can land, and with which swing: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.rectilinear.bounds import DEMANDS, Bounds, Pose, room_for
from bodyplan.gaits.rectilinear.kernels import lean
from bodyplan.gaits.rectilinear.terrain import TRIED, Keeps, Steps, highest, try_move

#: what is known of a spot before it is tried; that the anchor cannot stand there, or that no swing leads there
UNKNOWN, NO_STANCE, NO_SWING = -3, -1, -2


class Offer(NamedTuple):
    """What swings and landing spots are tried: ``shapes`` (k, 2) of swings; ``places`` (p,) along the way, those first
    at which something in the way shows early; in how many ``rounds`` ``closer`` more spots are tried beyond the
    farthest that goes; ``shares`` (m,) of the way to it where others are offered."""

    shapes: Array
    places: Array
    closer: int
    rounds: int
    shares: Array


class Trial(NamedTuple):
    """Room for one move (1, N, ...) of one anchor, its pose, what it runs into (9,), and ``order`` (p,): the places at
    which it is tried, those first at which the last one failed."""

    before: Array
    after: Array
    lift: Array
    early: Array
    swinging: BoolArray
    pose: Pose
    excess: Array
    found: BoolArray
    order: Array
    still: Array


@njit(cache=True)
def trial_of(bounds: Bounds, here: Array, places: Array) -> Trial:
    """Room for moves from ``here`` (N, 2)."""
    count = len(here)
    return Trial(
        here.copy().reshape(1, count, 2),
        here.copy().reshape(1, count, 2),
        np.zeros((1, count)),
        np.ones((1, count)),
        np.zeros(count, dtype=np.bool_),
        room_for(bounds),
        np.empty(len(DEMANDS)),
        np.empty(len(TRIED), dtype=np.bool_),
        places.copy(),
        np.zeros(1),
    )


@lean
def rise(steps: Steps, keeps: Keeps, start: Array, end: Array, tail: bool, head: bool) -> float:
    """How far m the floor under the way of an anchor from ``start`` (2,) to ``end``, its ``tail`` or ``head`` link
    included, stands above the higher of them."""
    low = min(start[0], end[0]) - (keeps.tail if tail else 0.0)
    high = max(start[0], end[0]) + (keeps.head if head else 0.0)
    top, out = max(start[1], end[1]) - keeps.rest, 0.0
    for k in range(len(steps.breaks)):
        at = steps.breaks[k]
        if low <= at <= high:
            out = max(out, highest(steps.floor_x, steps.floor_z, at, at) - top)
    return out


@lean
def swing_to(
    bounds: Bounds,
    steps: Steps,
    keeps: Keeps,
    trial: Trial,
    here: Array,
    i: int,
    spot: Array,
    shapes: Array,
    met: float,
) -> tuple[int, float, float]:
    """The first of ``shapes`` in which anchor ``i`` of ``here`` (N, 2) gets to ``spot`` (2,), with its lift and how
    early it rises; or :data:`NO_STANCE`, :data:`NO_SWING`. Over level ground no other shape than the first can help
    against reach or limits, and none is lower."""
    before, after, lift, early = trial.before, trial.after, trial.lift, trial.early
    for c in range(2):
        after[0, i, c] = before[0, i, c] = spot[c]
    lift[0, i], early[0, i], trial.swinging[i] = 0.0, 1.0, False
    standing = try_move(
        bounds, steps, keeps, before, after, lift, early, trial.swinging, 0, trial.still, i, met, False, trial.pose,
        trial.excess, trial.found,
    )  # fmt: skip
    for c in range(2):
        before[0, i, c] = here[i, c]
    out = NO_STANCE if standing >= 0 else NO_SWING
    if standing < 0:
        above = rise(steps, keeps, here[i], spot, i == 0, i == len(here) - 1)
        level = spot[1] == here[i, 1] and above <= 0.0
        for s in range(1 if level else len(shapes)):
            lift[0, i], early[0, i] = keeps.lift + shapes[s, 0] * (above + keeps.margin), shapes[s, 1]
            trial.swinging[i] = lift[0, i] > 0.0
            bad = try_move(
                bounds, steps, keeps, before, after, lift, early, trial.swinging, 0, trial.order, i, met, False,
                trial.pose, trial.excess, trial.found,
            )  # fmt: skip
            if bad < 0:
                out = s
                break
            # what was in the way here is likely to be in the way of the next
            worst = trial.order[bad]
            for p in range(bad, 0, -1):
                trial.order[p] = trial.order[p - 1]
            trial.order[0] = worst
    high, soon = lift[0, i], early[0, i]
    for c in range(2):
        after[0, i, c] = here[i, c]
    lift[0, i], early[0, i], trial.swinging[i] = 0.0, 1.0, False
    return out, high, soon


@njit(cache=True)
def land(
    bounds: Bounds, steps: Steps, keeps: Keeps, here: Array, i: int, spots: Array, offer: Offer, met: float, out: Array,
    which: IntArray,
) -> None:  # fmt: skip
    """:func:`swing_to` for each of ``spots`` (K, 2), into ``which`` (K,) and ``out`` (K, 2)."""
    trial = trial_of(bounds, here, offer.places)
    for k in range(len(spots)):
        which[k], out[k, 0], out[k, 1] = swing_to(bounds, steps, keeps, trial, here, i, spots[k], offer.shapes, met)


@njit(cache=True)
def choose(
    bounds: Bounds, steps: Steps, keeps: Keeps, here: Array, i: int, at: Array, edges: Array, room: tuple[float, float],
    far: float, step: float, offer: Offer, met: float,
) -> Array:  # fmt: skip
    """Landing spots (k, 4) of anchor ``i``, the farthest first: s and height m, lift m and how early the swing rises.

    Of the places ``at`` (K,) m, ascending, the farthest that goes, or one beyond it that is closer to where nothing
    goes any more (not ``far`` m or farther, and within ``room``); those at ``edges``; and at shares of the way to it
    the next ones that go."""
    most = len(at) + offer.closer * offer.rounds
    spots, known, made = np.empty((most, 2)), np.full(most, UNKNOWN), np.empty((most, 2))
    trial = trial_of(bounds, here, offer.places)
    count = len(at)
    for k in range(count):
        spots[k, 0] = at[k]
    # what does not go beyond the farthest is not tried: from the far end on
    last = -1
    for k in range(count - 1, -1, -1):
        _try(bounds, steps, keeps, trial, here, i, k, spots, known, made, offer, met)
        if known[k] >= 0:
            last = k
            break
    if last < 0:
        return np.empty((0, 4))
    for _ in range(offer.rounds):
        begin = spots[last, 0]
        for k in range(offer.closer, 0, -1):
            x = begin + step * k / (offer.closer + 1)
            if x >= far or not room[0] <= x <= room[1]:
                continue
            spots[last + k, 0], known[last + k] = x, UNKNOWN
            _try(bounds, steps, keeps, trial, here, i, last + k, spots, known, made, offer, met)
            if known[last + k] >= 0:
                for j in range(1, k):
                    spots[last + j, 0], known[last + j] = begin + step * j / (offer.closer + 1), UNKNOWN
                last += k
                break
        step /= offer.closer + 1
    chosen = np.zeros(last + 1, dtype=np.bool_)
    chosen[last] = True
    for share in offer.shares:
        for k in range(int(np.round(share * last)), -1, -1):
            _try(bounds, steps, keeps, trial, here, i, k, spots, known, made, offer, met)
            if known[k] >= 0:
                chosen[k] = True
                break
    for k in range(last):
        for edge in edges:
            if not chosen[k] and abs(edge - spots[k, 0]) < 1e-12:
                _try(bounds, steps, keeps, trial, here, i, k, spots, known, made, offer, met)
                chosen[k] = known[k] >= 0
    out = np.empty((chosen.sum(), 4))
    row = 0
    for k in range(last, -1, -1):
        if chosen[k]:
            out[row, 0], out[row, 1], out[row, 2], out[row, 3] = spots[k, 0], spots[k, 1], made[k, 0], made[k, 1]
            row += 1
    return out


@lean
def _try(
    bounds: Bounds, steps: Steps, keeps: Keeps, trial: Trial, here: Array, i: int, k: int, spots: Array,
    known: IntArray, made: Array, offer: Offer, met: float,
) -> None:  # fmt: skip
    """Find out whether anchor ``i`` gets to spot ``k``, if that is not known."""
    if known[k] == UNKNOWN:
        x = spots[k, 0]
        spots[k, 1] = highest(steps.floor_x, steps.floor_z, x, x) + keeps.rest
        known[k], made[k, 0], made[k, 1] = swing_to(bounds, steps, keeps, trial, here, i, spots[k], offer.shapes, met)
