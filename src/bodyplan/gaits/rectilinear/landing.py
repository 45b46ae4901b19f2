"""Where one anchor can land, and with which swing: Numba kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.rectilinear.bounds import DEMANDS, Bounds, Pose, room_for
from bodyplan.gaits.rectilinear.terrain import TRIED, Keeps, Places, Steps, highest, try_move
from bodyplan.kernels import lean

#: what is told of a spot where the anchor cannot stand, or where no swing leads to
NO_STANCE, NO_SWING = -1, -2


class Trial(NamedTuple):
    """Room for one move (1, N, ...) of one anchor, its pose, what it runs into (9,), and the ``places`` at which it is
    tried, those first at which the last one failed."""

    before: Array
    after: Array
    lift: Array
    early: Array
    swinging: BoolArray
    pose: Pose
    excess: Array
    found: BoolArray
    places: Places


@njit(cache=True)
def trial_of(bounds: Bounds, here: Array, places: Places) -> Trial:
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
        Places(places.tau, places.even, places.order.copy()),
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
    before, after, lift, early, order = trial.before, trial.after, trial.lift, trial.early, trial.places.order
    for c in range(2):
        after[0, i, c] = before[0, i, c] = spot[c]
    lift[0, i], early[0, i], trial.swinging[i] = 0.0, 1.0, False
    out, above, level = NO_STANCE, 0.0, False
    for s in range(-1, len(shapes)):
        if s == 0:  # it can stand there
            out = NO_SWING
            for c in range(2):
                before[0, i, c] = here[i, c]
            above = rise(steps, keeps, here[i], spot, i == 0, i == len(here) - 1)
            level = spot[1] == here[i, 1] and above <= 0.0
        if s >= 0:
            lift[0, i], early[0, i] = keeps.lift + shapes[s, 0] * (above + keeps.margin), shapes[s, 1]
            trial.swinging[i] = lift[0, i] > 0.0
        bad = try_move(
            bounds, steps, keeps, before, after, lift, early, trial.swinging, 0, trial.places,
            1 if s < 0 else len(order), i, met, False, trial.pose, trial.excess, trial.found,
        )  # fmt: skip
        if bad < 0 <= s:
            out = s
            break
        if bad >= 0 > s:
            break
        if bad >= 0:
            # what was in the way here is likely to be in the way of the next
            worst = order[bad]
            for p in range(bad, 0, -1):
                order[p] = order[p - 1]
            order[0] = worst
            if level:
                break
    for c in range(2):
        before[0, i, c] = here[i, c]
    high, soon = lift[0, i], early[0, i]
    for c in range(2):
        after[0, i, c] = here[i, c]
    lift[0, i], early[0, i], trial.swinging[i] = 0.0, 1.0, False
    return out, high, soon


@njit(cache=True)
def land(
    bounds: Bounds, steps: Steps, keeps: Keeps, here: Array, i: int, spots: Array, shapes: Array, places: Places,
    met: float, out: Array, which: IntArray,
) -> None:  # fmt: skip
    """:func:`swing_to` for each of ``spots`` (K, 2), tried at ``places``, into ``which`` (K,) and ``out``
    (K, 2)."""
    trial = trial_of(bounds, here, places)
    for k in range(len(spots)):
        which[k], out[k, 0], out[k, 1] = swing_to(bounds, steps, keeps, trial, here, i, spots[k], shapes, met)
