"""Landing spots over steps: a search over the moves of an inching snake.

State by state the anchors of the next phase are offered landing spots: the farthest that the demands, floor and ceiling
allow, shares of it, the places next to the edges of steps, and staying where they are. Moves are tried along their
whole way, links, tail and head included. How an anchor stands before a step decides whether the next can go over it, so
that the search goes back where it has no way on.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import count, pairwise

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.demands import move_names, phases
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.offers import Offers
from bodyplan.gaits.rectilinear.walker import Walker, Why

#: places along a move at which it is tried when its turn comes, and those of the way that is found
CLOSE, FINAL = 121, 361
#: states as good as the best to this many moves are tried with it; the most in all, or for every move that is wanted
NEAR, MOST_STATES, A_MOVE = 0.5, 3000, 40
#: what a move counts in units of the pace over level ground: less than 1, so that slow places are gone through
WEIGHT = 0.05
#: what a phase counts in which nothing can move: it comes from what stands beside it, which is to be tried otherwise
#: before all that stands elsewhere
HELD = 1.0
#: share of the mean link by which one of two alike stances must be ahead to be tried as well: strides may be small
STEP = 0.005


@dataclass(frozen=True)
class Breadth:
    """How widely is searched: ``batch`` states at once; ``alike``: share of the mean link within which two stances
    count as one; ``stuck``: states tried without coming farther after which there is no way on."""

    batch: int
    alike: float
    stuck: int


#: a few stances that differ much find most ways, one such choice of them where another does not; where none does, many
#: that differ little decide. Of the searches that find a way at a good pace nine of ten come farther with every batch,
#: so that the first gives up with the second batch that does not, and others have their turn
NARROW = (Breadth(8, 0.4, 16), Breadth(8, 0.6, 50), Breadth(8, 0.5, 200), Breadth(12, 0.3, 300))
WIDE = Breadth(16, 0.1, 500)
#: how much higher a swing is made that comes too near to something between the places at which moves are tried
HIGHER = (1.02, 1.05, 1.1, 1.2)


@dataclass(frozen=True, eq=False)
class _State:
    """Anchors (N, 2) before phase ``phase`` of cycle ``cycle``, how they came there (the state before and the move,
    None where they stayed), in how many moves, and how often nothing could move."""

    anchors: Array
    phase: int = 0
    cycle: int = 0
    made: int = 0
    held: int = 0
    before: _State | None = None
    move: Moves | None = None

    @cached_property
    def far(self) -> float:
        """m: mean of the anchors."""
        return float(np.add.reduce(self.anchors[:, 0])) / len(self.anchors)

    def then(self, phases: int) -> tuple[int, int]:
        """Phase and cycle after this one's."""
        after = (self.phase + 1) % phases
        return after, self.cycle + (after == 0)


@dataclass(frozen=True, eq=False)
class Way:
    """``moves`` with the number of their ``cycle`` (M,); ``status`` with the ``reason`` where it does not go on;
    ``tried``: how many states were."""

    moves: list[Moves]
    cycle: IntArray
    status: Status
    reason: str
    tried: int = 0

    @property
    def far(self) -> float:
        """m: where the anchors are at the end, in the mean."""
        return float(self.moves[-1].after[0, :, 0].mean()) if self.moves else -np.inf


def search(
    walker: Walker, start: Array, schedule: str, most: int, pace: float, breadth: Breadth = WIDE, partly: bool = True
) -> Way:
    """The way over the steps from anchors ``start`` (N, 2) in ``most`` moves; ``pace`` m a move is that over level
    ground.

    Best first: the state that has come farthest for its number of moves, which counts little, is tried next. Where it
    has no way on, those behind it get their turn. Of where a move can land the farthest is found at once, what lies
    behind it only when its turn comes: few of those are ever tried. Of a way that does not go on all its moves are told
    with the reason; without ``partly`` none.
    """
    groups, names = phases(len(start), schedule), move_names(len(start), schedule)
    link = float(walker.snake.links.mean())
    heaps: list[list[tuple[float, int, _State, Offers | None]]] = [[] for _ in groups]
    seen: dict[tuple[int, ...], tuple[int, float]] = {}
    counter = count()
    best, none = _State(start), (most + 1, -np.inf)

    def push(state: _State, offers: Offers | None = None) -> None:
        gone = (state.far - best_start) / pace
        heapq.heappush(
            heaps[state.phase], (WEIGHT * state.made + HELD * state.held - gone, next(counter), state, offers)
        )

    def pop(phase: int) -> _State:
        """The most promising state; what is offered next after it is pushed instead."""
        state, offers = heapq.heappop(heaps[phase])[2:]
        if offers is not None and walker.nearer(offers):
            before = state.before
            assert before is not None
            push(_moved(before, offers, names[before.phase], len(groups)), offers)
        return state

    cell = breadth.alike * link

    def stance(state: _State) -> tuple[int, ...]:
        return state.phase, *[round(x / cell) for x in state.anchors[:, 0].tolist()]

    best_start = best.far
    push(best)
    expanded, last = 0, 0
    wrong: set[_State] = set()
    while expanded < max(MOST_STATES, A_MOVE * most) and expanded - last < breadth.stuck and any(heaps):
        phase = min((k for k, heap in enumerate(heaps) if heap), key=lambda k: heaps[k][0][0])
        first = heaps[phase][0][0]
        batch: list[_State] = []
        alike: list[tuple[_State, tuple[int, ...]]] = []
        taken: dict[_State, tuple[tuple[int, ...], tuple[int, float]]] = {}
        while heaps[phase] and len(batch) < breadth.batch and heaps[phase][0][0] <= first + NEAR:
            state = pop(phase)
            at = stance(state)
            made, far = known = seen.get(at, none)
            if state.made >= made and state.far <= far + STEP * link:
                alike.append((state, at))
                continue
            seen[at], taken[state] = (min(made, state.made), max(far, state.far)), (at, known)
            batch.append(state)
        expanded += len(batch)
        batch = _sound(walker, [s for s in batch if not wrong or not wrong.intersection(_line(s))])
        # those alike get their turn where the one that stood for them does not go
        left = set(taken).difference(batch)
        for state in reversed([s for s in taken if s in left]):
            at, known = taken[state]
            seen[at] = known
        free = {taken[s][0] for s in left}
        for state, at in alike:
            if at in free:
                push(state)
        if not batch:
            continue
        ahead = max([best, *batch], key=lambda s: (round(s.far / (1e-6 * link)), -s.made))
        if ahead.far > best.far + STEP * link:
            last = expanded
        best = ahead
        done = sorted((s for s in batch if s.made >= most), key=lambda s: -s.far)
        for state in done:
            line = _mended(walker, state)
            if line[-1].made >= most:
                return _way(line, Status.OK, "", expanded)
            wrong.add(_line(state)[len(line)])
        for state in (s for s in batch if s.made < most):
            offers = walker.offers(state.anchors, groups[phase])
            stuck = bool((offers.at < 0).all())
            push(_State(state.anchors, *state.then(len(groups)), state.made, state.held + stuck, state))
            if not stuck:
                push(_moved(state, offers, names[phase], len(groups)), offers)
    if not partly:
        return _way([], Status.OUT_OF_REACH, "", expanded)
    line = _mended(walker, best)
    best = line[-1]
    why: Why = Counter()
    for group, name in zip(groups, names, strict=True):
        for i in group:
            why.update(walker.why(best.anchors, int(i), name))
    # what the ground forbids is told before what the body cannot do there
    ground, reach = (Status.BELOW_FLOOR, Status.ABOVE_CEILING), Status.OUT_OF_REACH
    told = sorted(why.most_common(), key=lambda item: (item[0][1] not in ground, item[0][1] == reach))
    name, status = told[0][0] if told else (names[0], Status.OUT_OF_REACH)
    where = f"with its anchors at {', '.join(f'{x:.4g}' for x in best.anchors[:, 0])} m"
    return _way(line, status, f"No landing spot leads on {where}: {name}: {status}", expanded)


def _way(line: list[_State], status: Status, reason: str, tried: int) -> Way:
    moves = [s.move for s in line if s.move is not None]
    cycles = [before.cycle for before, s in pairwise(line) if s.move is not None]
    return Way(moves, np.array(cycles, dtype=np.int64), status, reason, tried)


def _line(state: _State) -> list[_State]:
    """The states that lead to this one, it last."""
    out = [state]
    while out[-1].before is not None:
        out.append(out[-1].before)
    return out[::-1]


def _mended(walker: Walker, state: _State) -> list[_State]:
    """The states that lead to this one, as far as their moves run into nothing between the places at which moves are
    tried at first either; swings that do are made higher where that helps."""
    line = _line(state)
    moving = [k for k, s in enumerate(line) if s.move is not None]
    if not moving:
        return line
    sound = walker.sound(Moves.joined([m for s in line if (m := s.move) is not None]), FINAL, True)
    for k in (k for k, good in zip(moving, sound, strict=True) if not good):
        move = line[k].move
        assert move is not None
        more = Moves.joined([replace(move, lift=move.lift * share) for share in HIGHER])
        good = np.flatnonzero(walker.sound(more, FINAL, True))
        if not len(good):
            return line[:k]
        line[k] = replace(line[k], move=replace(move, lift=move.lift * HIGHER[good[0]]))
    return line


def _sound(walker: Walker, states: list[_State]) -> list[_State]:
    """The states whose last move goes with the whole body, and at more places, too."""
    some = [s.move for s in states if s.move is not None]
    if not some:
        return states
    found = iter(walker.sound(Moves.joined(some), CLOSE))
    return [s for s in states if s.move is None or next(found)]


def _moved(state: _State, offers: Offers, name: str, phases: int) -> _State:
    """The state after the anchors have moved to what is offered."""
    after, lift, early = offers.after.copy(), offers.lift[None].copy(), offers.early[None].copy()
    move = Moves(state.anchors[None], after[None], lift, early, (name,))
    return _State(after, *state.then(phases), state.made + 1, state.held, state, move)
