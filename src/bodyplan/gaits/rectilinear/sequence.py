"""Moves in time: when each begins, whether they repeat, and where they end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.moves import Moves


@dataclass(frozen=True, eq=False)
class Sequence:
    """``moves`` with ``durations`` (M,) s, each followed by ``dwell`` s at rest.

    ``advance`` m: how far the anchors are when the moves begin again, ``repeats`` times in all (None: without end);
    None where they do not repeat. ``cycle`` (M,): the number of the cycle that a move belongs to. ``status``: why a
    sequence that does not go on ends, with the ``reason``; "ok" where it simply has come to its end.
    """

    moves: Moves
    durations: Array
    dwell: float
    cycle: IntArray
    advance: float | None = None
    status: Status = Status.OK
    reason: str = ""
    repeats: int | None = None

    @property
    def starts(self) -> Array:
        """(M + 1,) s: when each move begins, and when the last has ended."""
        return np.concatenate([[0.0], np.cumsum(self.durations + self.dwell)])

    @property
    def length(self) -> float:
        """s: of all moves once; the period where they repeat."""
        return float(self.starts[-1])

    def at(self, t: Array) -> Moment:
        """Where the moves are at times t (T,) >= 0 s."""
        starts, size = self.starts, len(self.moves)
        turns, local = np.zeros(len(t)), t
        over = np.zeros(len(t), dtype=bool)
        if self.advance is not None:
            turns = np.floor(t / self.length * (1.0 + 1e-14))
            if self.repeats is not None:
                over = turns >= self.repeats
                turns = np.minimum(turns, self.repeats - 1)
            local = np.clip(t - turns * self.length, 0.0, self.length)
        else:
            over = t >= starts[-1]
        which = np.clip(np.searchsorted(starts, local, side="right") - 1, 0, size - 1)
        duration = self.durations[which]
        tau = np.clip((local - starts[which]) / duration, 0.0, 1.0)
        tau = settled(tau)
        return Moment(which, tau, duration, turns, over)


def settled(tau: Array) -> Array:
    """``tau`` with what is rounding at 0 and 1 taken for them: an anchor must not stay a hair above the ground."""
    return np.asarray(np.where(tau < 1e-13, 0.0, np.where(tau > 1.0 - 1e-13, 1.0, tau)))


@dataclass(frozen=True, eq=False)
class Moment:
    """Sample by sample (T,): the move, tau in it, its duration s, how often all moves have been made before, and
    whether everything is over."""

    which: IntArray
    tau: Array
    duration: Array
    turns: Array
    over: Array
