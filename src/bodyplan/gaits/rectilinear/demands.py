"""What a snake allows of a gait: links, room for joints, limits and rates; and how far moves stay within it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.apart import apart_of
from bodyplan.gaits.rectilinear.bounds import DEMANDS, Bounds, worst
from bodyplan.gaits.rectilinear.moves import Moves, bends
from bodyplan.gaits.rectilinear.parts import Parts

#: places along a move that are tried at first, and in each of the rounds that close in on the worst of them
COARSE, FINE, ROUNDS = 65, 17, 3
#: relative slack of a demand that is met exactly
MET = 1e-13
#: places along a move at which rates are taken, and what their largest may be above those (the square of a step)
RATE_PLACES, RATE_SLACK = 1001, 2e-5


@dataclass(frozen=True, eq=False)
class Balance:
    """Where the centre of mass is along the way: ``weights`` (2 N - 1,) of the joints, tail first, sum 1, and a
    ``shift`` m by what lies beyond them."""

    weights: Array
    shift: float

    def center(self, anchors: Array, elbows: Array) -> Array:
        """(...,) m for anchors (..., N) and elbows (..., N - 1) m along the way."""
        return np.asarray(anchors @ self.weights[0::2] + elbows @ self.weights[1::2] + self.shift)


@dataclass(frozen=True, eq=False)
class Demands:
    """``links`` (2 N - 2,) m; ``ceiling`` m above the lower anchor of its leg for every joint; ``limits`` (2 N - 1, 2)
    rad and ``rates`` (2 N - 1,) rad/s of the joints, nose-up, closing one last; ``nearest`` m between two neighbouring
    anchors; ``parts`` that must be clear of each other behind and ahead of joints, the first of them ``tail`` m from
    the tail end (None: they are thin); ``balance`` with the least support ``margin`` m along the way (None: not asked
    for)."""

    links: Array
    ceiling: float = np.inf
    limits: Array = field(default_factory=lambda: np.zeros((0, 2)))
    rates: Array = field(default_factory=lambda: np.zeros(0))
    nearest: float = 0.0
    parts: Parts | None = None
    tail: float = 0.0
    balance: Balance | None = None
    margin: float | None = None

    @property
    def anchors(self) -> int:
        """N."""
        return len(self.links) // 2 + 1

    @property
    def straight(self) -> Array:
        """(N - 1,) m: reach of every leg."""
        return np.asarray(self.links[0::2] + self.links[1::2])

    @property
    def least(self) -> Array:
        """(N - 1,) m: smallest spacing of standing anchors, from links, ``nearest`` and the ceiling:
        sqrt(a^2 - c^2) + sqrt(b^2 - c^2) under a ceiling c below both links."""
        a, b = self.links[0::2], self.links[1::2]
        c = np.minimum(self.ceiling, np.minimum(a, b))
        under = np.sqrt((a - c) * (a + c)) + np.sqrt((b - c) * (b + c))
        folded = np.where(self.ceiling < np.minimum(a, b), under, np.abs(a - b))
        return np.asarray(np.maximum(folded, self.nearest))

    @cached_property
    def bounds(self) -> Bounds:
        """All of this for kernels."""
        limits = np.tile([-np.inf, np.inf], (len(self.links) + 1, 1))
        if len(self.limits):
            limits = np.array(self.limits, dtype=np.float64)
        none = np.zeros(0, dtype=np.int64), np.zeros((0, 2, 2)), np.zeros((0, 0)), np.zeros((0, 0), dtype=bool)
        parts = None if self.parts is None else self.parts.merged()
        link, ends, need, leg = none if parts is None else (parts.link, parts.ends, parts.need, parts.leg)
        lengths = np.concatenate([[self.tail], self.links, [0.0]])
        asked = self.margin is not None and self.balance is not None
        return Bounds(
            np.array(self.links, dtype=np.float64),
            float(self.ceiling),
            limits,
            bool(np.isfinite(limits).any()),
            float(self.nearest),
            np.asarray(link, dtype=np.int64),
            np.ascontiguousarray(ends),
            np.ascontiguousarray(need),
            np.ascontiguousarray(leg),
            float(need.max(initial=0.0)),
            apart_of(Parts(link, ends, need, leg), lengths),
            float(self.tail),
            np.zeros(len(limits)) if self.balance is None else np.array(self.balance.weights, dtype=np.float64),
            0.0 if self.balance is None else float(self.balance.shift),
            float(self.margin) if asked and self.margin is not None else np.nan,
            float(self.links.max()),
        )

    def met(self, moves: Moves) -> list[Status]:
        """The first demand that each move breaks, or ok."""
        found = self._worst(moves, False) > MET
        return [next((DEMANDS[d] for d in np.flatnonzero(row)), Status.OK) for row in found]

    def worst(self, moves: Moves) -> tuple[Array, Array]:
        """The largest excess (M,) of every move over all demands but reach, and over reach, relative to links or as a
        share of pi; not positive where they are met. Between the places tried, too, by closing in on the worst of them.
        Of reach only the sign tells where it is met."""
        found = self._worst(moves, True)
        return found[:, 1:].max(axis=1), found[:, 0]

    def _worst(self, moves: Moves, largest: bool) -> Array:
        out = np.empty((len(moves), len(DEMANDS)))
        worst(self.bounds, *moves.tables, moves.swinging, MET, COARSE, FINE, ROUNDS, largest, out)
        return out

    def durations(self, moves: Moves, least: float, places: int = RATE_PLACES) -> Array:
        """(M,) s: ``least``, or longer where a joint would turn faster than its rate, taken at ``places`` of a move."""
        if not len(self.rates) or not np.isfinite(self.rates).any():
            return np.full(len(moves), least)
        tau = np.linspace(0.0, 1.0, places)
        which = np.broadcast_to(np.arange(len(moves))[:, None], (len(moves), places))
        fastest = np.abs(bends(moves.state(self.links, which, np.broadcast_to(tau, which.shape)).first)) / self.rates
        return np.asarray(np.maximum(least, fastest.max(axis=(1, 2)) * (1.0 + RATE_SLACK)))


def phases(anchors: int, schedule: str) -> list[IntArray]:
    """Which anchors move at once, move after move of a cycle."""
    if schedule == "wave":
        return [np.array([i]) for i in range(anchors)]
    return [np.arange(0, anchors, 2), np.arange(1, anchors, 2)]


def move_names(anchors: int, schedule: str) -> list[str]:
    """What the moves of a cycle are called."""
    if schedule == "two-phase":
        return ["odd anchors move", "even anchors move"]
    if anchors == 3:
        return ["tail moves", "middle moves", "head moves"]
    return [f"anchor {i + 1} moves" for i in range(anchors)]
