"""A snake on steps: what its moves run into, and where an anchor can land."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.bounds import Bounds
from bodyplan.gaits.rectilinear.demands import MET, Demands
from bodyplan.gaits.rectilinear.landing import land
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.offers import Choice, Offers, Ranges, farthest, nearer, offers_for, places
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.terrain import TRIED, Keeps, Places, Steps, places_at, try_moves
from bodyplan.gaits.rectilinear.track import Track

#: landing spots tried between standing and reach, and rounds that close in on the farthest good one with a few more
SPOTS, CLOSER, ROUNDS = 20, 4, 2
#: where among the spots that go those lie that are offered beside the farthest
SHARES = (0.8, 0.55, 0.3, 0.0)
#: how many landings of a stance are found at once: a call takes longer than some of them that nobody asks for
AT_ONCE = 3
#: places along a move at which it is tried
PLACES = 25
#: shapes of a swing: what is added to its lift, in units of how far the ground on its way stands above its ends, and
#: how early it rises
SHAPES = ((0.0, 1.0), (0.0, 0.7), (0.0, 0.5), (0.0, 0.3), (1.0, 1.0), (1.0, 0.6), (1.6, 1.0), (1.6, 0.4))
#: share of its height over a tread that a tail or head link keeps from the tread's edge
OVER_EDGES = 0.9
#: shares of a straight leg by which an anchor may be behind the place beyond an edge where the next one lands
BRIDGES = (0.985, 0.95, 0.9)

#: share of its margin by which the body may come nearer to edges between the places at which a move is tried
NEARER = 0.02

#: a place to land: where (2,) m, lift m and how early the swing rises
Spot = tuple[Array, float, float]
#: how often a demand or the ground was in the way of a move by name
Why = Counter[tuple[str, Status]]


@dataclass(frozen=True, eq=False)
class Walker:
    """A snake on steps: what its moves must keep to. ``lift`` m at least; ``margin`` m that the body keeps from the
    edges of steps and from the ceiling. ``crouch`` m: a snake that is nearer than this to a low place moves as if it
    were under it with its whole body (None: it may stand tall up to the edge); with ``upright`` it need not, but what
    is ``noted`` tells whether that has made a difference. ``short`` (N - 1,) m: no leg is made shorter where it need
    not be, so that the next anchor has room to rise."""

    snake: InchingSnake
    track: Track
    demands: Demands
    lift: float
    margin: float
    crouch: float | None = None
    short: Array | None = None
    upright: bool = False

    @cached_property
    def noted(self) -> BoolArray:
        """(1,) whether a move that goes upright would not have gone crouching."""
        return np.zeros(1, dtype=bool)

    @cached_property
    def keeps(self) -> Keeps:
        """What the body keeps from the ground at the places at which moves are tried."""
        return self._keeps(self.margin)

    @cached_property
    def least(self) -> Keeps:
        """What it keeps between them."""
        return self._keeps(self.margin * (1.0 - NEARER))

    def _keeps(self, margin: float) -> Keeps:
        snake = self.snake
        return Keeps(
            float(snake.rest),
            float(snake.body),
            float(margin),
            # tail and head links lie as low as the feet and may hang over an edge
            min(float(margin), OVER_EDGES * max(float(snake.rest - snake.body), 0.0)),
            float(snake.top),
            float(snake.tail),
            float(snake.head),
            np.nan if self.crouch is None else float(self.crouch),
            float(self.lift),
            float(snake.links.max()),
            bool(self.upright),
            self.noted,
        )

    def stand(self, s: Array) -> Array:
        """Anchors (..., N, 2) along and up, standing at s (..., N) m."""
        return np.stack([s, self.track.height(s) + self.snake.rest], axis=-1)

    def tried(self, moves: Moves, tau: Array, only: int | None = None) -> list[Status]:
        """The first demand, floor or ceiling that each move runs into at ``tau`` (p,), or ok. ``only``: the one
        anchor that moves in all of them; what does not move with it has been tried before."""
        found, who = np.empty((len(moves), len(TRIED)), dtype=bool), -1 if only is None else int(only)
        rows = np.concatenate([moves.after, moves.lift[..., None], moves.early[..., None]], axis=-1)
        try_moves(
            self.demands.bounds, self.track.steps, self.keeps, np.ascontiguousarray(moves.before), rows, _places(tau),
            who, MET, True, found,
        )  # fmt: skip
        told = np.arange(len(TRIED))
        if np.isfinite(self.demands.ceiling):  # a ceiling of its own is told in its place among the demands
            found[:, TRIED.index(Status.ABOVE_CEILING)] |= found[:, told[-1]]
        return [next((TRIED[k] for k in np.flatnonzero(row)), Status.OK) for row in found]

    def sound(self, stances: Array, rows: Array, places: int, between: bool = False) -> BoolArray:
        """(M,) True for the moves that run into nothing at so many ``places``, with the whole body: from ``stances``
        (M, N, 2 or more) to ``rows`` (M, N, 4), s and height m, lift m and how early anchors rise. ``between``: where
        most of the places lie between those at which the moves have been tried."""
        out, keeps = np.empty((len(rows), len(TRIED)), dtype=bool), self.least if between else self.keeps
        try_moves(
            self.demands.bounds, self.track.steps, keeps, stances, rows, _halved(places), -1, MET, False, out
        )  # fmt: skip
        return np.asarray(~out.any(axis=1))

    def shaped(self, here: Array, i: int, spot: Array) -> tuple[Spot, Status]:
        """The swing of anchor ``i`` of ``here`` (N, 2) to ``spot`` (2,) in the first shape that goes; with the first
        reason against the plainest where none does."""
        which, made = self._land(here, i, spot[None])
        if which[0] >= 0:
            return (spot, float(made[0, 0]), float(made[0, 1])), Status.OK
        return (spot, self.lift, 1.0), self._plainest(here, i, spot[None])[0]

    def _land(self, here: Array, i: int, spots: Array) -> tuple[IntArray, Array]:
        which, made = np.empty(len(spots), dtype=np.int64), np.zeros((len(spots), 2))
        land(
            self.demands.bounds, self.track.steps, self.keeps, np.ascontiguousarray(here), i, spots, _choice().shapes,
            _choice().places, MET, made, which,
        )  # fmt: skip
        return which, made

    def _plainest(self, here: Array, i: int, spots: Array) -> list[Status]:
        """What is against the plainest swings of anchor ``i`` to ``spots`` (K, 2)."""
        before = np.repeat(here[None], len(spots), axis=0)
        after, lift = before.copy(), np.zeros(before.shape[:2])
        after[:, i], lift[:, i] = spots, self.lift
        moves = Moves(before, after, lift, np.ones(lift.shape), ("",) * len(spots))
        return self.tried(moves, np.linspace(0.0, 1.0, PLACES), i)

    def why(self, here: Array, i: int, name: str) -> Why:
        """What is against the landing spots of anchor ``i`` of ``here`` (N, 2)."""
        out: Why = Counter()
        spots = self.stand(places(self.ranges, SPOTS, np.ascontiguousarray(here), i))
        if not len(spots):
            out[name, Status.OUT_OF_REACH] += 1
            return out
        after = np.repeat(here[None], len(spots), axis=0)
        after[:, i] = spots
        none = np.zeros(after.shape[:2])
        stands = self.tried(Moves(after, after, none, none + 1.0, ("",) * len(spots)), np.zeros(1), i)
        out.update((name, status) for status in stands if status != Status.OK)
        good = spots[np.flatnonzero([status == Status.OK for status in stands])]
        if len(good):
            which, _ = self._land(here, i, good)
            left = good[which < 0]
            out.update((name, status) for status in (self._plainest(here, i, left) if len(left) else []))
        return out

    def offers(self, here: Array, group: IntArray) -> tuple[Offers, Array, IntArray]:
        """The farthest landing spots of the anchors ``group`` (G,) of stances ``here`` (S, N, 2), with lift and shape
        of swings, those first that make no leg too short for the next move; and the next ones behind. With what is
        offered the first moves as (S, A, N, 4), s and height m, lift m and how early they rise, and how many (S,)."""
        offers = offers_for(self.ranges, _choice(), here, len(group))
        rows, told = np.zeros((len(here), AT_ONCE, here.shape[1], 4)), np.empty(len(here), dtype=np.int64)
        farthest(*self._known, _choice(), MET, group, offers, rows, told)
        return offers, rows, told

    def nearer(self, offers: Offers, number: int, group: IntArray) -> Array:
        """Offer stance ``number`` what lies next behind: the moves (A, N, 4), fewer than AT_ONCE where they end."""
        rows = np.empty((AT_ONCE, offers.here.shape[1], 4))
        return rows[: nearer(*self._known, _choice(), MET, group, offers, number, rows)]

    @cached_property
    def _known(self) -> tuple[Bounds, Steps, Keeps, Ranges]:
        return self.demands.bounds, self.track.steps, self.keeps, self.ranges

    @cached_property
    def ranges(self) -> Ranges:
        """Where anchors may land, for kernels."""
        edges = self._beside_edges
        first = np.concatenate([[0], np.cumsum([len(some) for some in edges])]).astype(np.int64)
        straight = np.array(self.demands.straight)
        short = np.full(len(straight), -np.inf) if self.short is None else np.array(self.short)
        # no anchor lands farther from where it stands than a straight leg
        far = float(straight.max()) * (1.0 + 1e-9)
        crowds = [np.searchsorted(some, some + far, side="right") - np.arange(len(some)) for some in edges]
        crowd = max((int(some.max()) for some in crowds if len(some)), default=0)
        return Ranges(straight, float(self.demands.nearest), short, np.concatenate(edges), first, crowd)

    @cached_property
    def _beside_edges(self) -> list[Array]:
        """For every anchor the places that matter at the edges of steps: feet beside them, tail and head links clear of
        them, and those from which the next anchor reaches beyond them."""
        snake, keep = self.snake, self.snake.rest + self.margin
        out = []
        for i in range(snake.anchors):
            offsets = [keep, -keep]
            if i == snake.anchors - 1:
                offsets.append(-snake.head - snake.body - self.margin)
            if i == 0:
                offsets.append(snake.tail + snake.body + self.margin)
            if i < snake.anchors - 1:
                offsets += [keep - share * float(self.demands.straight[i]) for share in BRIDGES]
            out.append(np.unique([edge + offset for edge in self.track.breaks for offset in offsets]))
        return out


@cache
def _halved(count: int) -> Places:
    """``count`` places from 0 to 1, coarse ones first and 0 last: what a move runs into shows early."""
    turned = [int(f"{k:032b}"[::-1], 2) if k else 1 << 32 for k in range(count)]
    return _places(np.linspace(0.0, 1.0, count)[np.argsort(turned, kind="stable")])


def _places(tau: Array) -> Places:
    """Places ``tau`` (p,) in this order."""
    found: Places = places_at(tau)
    return found


@cache
def _choice() -> Choice:
    """What is tried of every stance."""
    return Choice(SPOTS, CLOSER, ROUNDS, np.array(SHARES), np.array(SHAPES), _halved(PLACES))
