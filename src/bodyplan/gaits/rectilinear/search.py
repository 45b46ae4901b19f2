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
from itertools import count, pairwise

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.demands import move_names, phases
from bodyplan.gaits.rectilinear.landings import Ahead, Landing, Landings, far_of
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.walker import Walker, Why

#: places along a move at which those of the way that is found are tried
FINAL = 361
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


@dataclass(eq=False, slots=True)
class _State:
    """Anchors ``at`` (N, 4) as in :class:`Landing`, their mean ``far`` m, before phase ``phase`` of cycle ``cycle``; in
    how many moves they came there, and how often nothing could move; the state ``before`` and where they landed, None
    where they stayed."""

    at: Array
    far: float
    phase: int = 0
    cycle: int = 0
    made: int = 0
    held: int = 0
    before: _State | None = None
    landing: Landing | None = None

    def then(self, phases: int) -> tuple[int, int]:
        """Phase and cycle after this one's."""
        after = (self.phase + 1) % phases
        return after, self.cycle + (after == 0)

    def staying(self, phases: int, stuck: bool) -> _State:
        """The state after a phase in which nothing moves."""
        return _State(self.at, self.far, *self.then(phases), self.made, self.held + stuck, self)

    def moved(self, phases: int, landing: Landing) -> _State:
        """The state after the anchors have landed."""
        return _State(landing.row, landing.far, *self.then(phases), self.made + 1, self.held, self, landing)


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
    landings: Landings, start: Array, schedule: str, most: int, pace: float, breadth: Breadth = WIDE,
    partly: bool = True,
) -> Way:  # fmt: skip
    """The way over the steps from anchors ``start`` (N, 2) in ``most`` moves; ``pace`` m a move is that over level
    ground.

    Best first: the state that has come farthest for its number of moves, which counts little, is tried next. Where it
    has no way on, those behind it get their turn. Of where a move can land the farthest is found at once, what lies
    behind it only when its turn comes: few of those are ever tried. Of a way that does not go on all its moves are told
    with the reason; without ``partly`` none.
    """
    walker, groups, names = landings.walker, phases(len(start), schedule), move_names(len(start), schedule)
    size, link = len(groups), float(landings.walker.snake.links.mean())
    heaps: list[list[tuple[float, int, _State, Ahead | None, int]]] = [[] for _ in groups]
    seen: dict[tuple[int, ...], tuple[int, float]] = {}
    counter = count()
    first_row = np.concatenate([start, np.zeros((len(start), 1)), np.ones((len(start), 1))], axis=1)
    best, none = _State(first_row, float(far_of(first_row))), (most + 1, -np.inf)

    def push(state: _State, ahead: Ahead | None = None, k: int = 0) -> None:
        gone = (state.far - best_start) / pace
        cost = WEIGHT * state.made + HELD * state.held - gone
        heapq.heappush(heaps[state.phase], (cost, next(counter), state, ahead, k))

    def pop(phase: int) -> _State:
        """The most promising state; the next landing behind it is pushed instead."""
        state, ahead, k = heapq.heappop(heaps[phase])[2:]
        if ahead is not None:
            landing, before = landings.landing(ahead, k + 1), state.before
            if landing is not None and before is not None:
                push(before.moved(size, landing), ahead, k + 1)
        return state

    cell = breadth.alike * link

    def stance(state: _State) -> tuple[int, ...]:
        return state.phase, *[round(x / cell) for x in state.at[:, 0].tolist()]

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
        batch = _sound(landings, [s for s in batch if not wrong or not wrong.intersection(_line(s))])
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
                return _way(line, names, Status.OK, "", expanded)
            wrong.add(_line(state)[len(line)])
        on = [s for s in batch if s.made < most]
        for state, spots in zip(on, landings.ahead([s.at for s in on], groups[phase]), strict=True):
            landing = landings.landing(spots, 0)
            push(state.staying(size, landing is None))
            if landing is not None:
                push(state.moved(size, landing), spots)
    if not partly:
        return _way([], names, Status.OUT_OF_REACH, "", expanded)
    line = _mended(walker, best)
    best = line[-1]
    why: Why = Counter()
    for group, name in zip(groups, names, strict=True):
        for i in group:
            why.update(walker.why(best.at[:, :2], int(i), name))
    # what the ground forbids is told before what the body cannot do there
    ground, reach = (Status.BELOW_FLOOR, Status.ABOVE_CEILING), Status.OUT_OF_REACH
    told = sorted(why.most_common(), key=lambda item: (item[0][1] not in ground, item[0][1] == reach))
    name, status = told[0][0] if told else (names[0], Status.OUT_OF_REACH)
    where = f"with its anchors at {', '.join(f'{x:.4g}' for x in best.at[:, 0])} m"
    return _way(line, names, status, f"No landing spot leads on {where}: {name}: {status}", expanded)


def _way(line: list[_State], names: list[str], status: Status, reason: str, tried: int) -> Way:
    moves = [(a, b) for a, b in pairwise(line) if b.landing is not None]
    cycles = np.array([before.cycle for before, _ in moves], dtype=np.int64)
    return Way([_move(a, b, names[a.phase]) for a, b in moves], cycles, status, reason, tried)


def _move(before: _State, after: _State, name: str) -> Moves:
    places, rest = after.at[None, :, :2], after.at[None, :, 2:]
    return Moves(before.at[None, :, :2], places, rest[..., 0], rest[..., 1], (name,))


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
    moving = [k for k, s in enumerate(line) if s.landing is not None]
    if not moving:
        return line
    before, after = np.array([line[k - 1].at for k in moving]), np.array([line[k].at for k in moving])
    sound = walker.sound(before, after, FINAL, True)
    for k in (k for k, good in zip(moving, sound, strict=True) if not good):
        higher = np.array([line[k].at * [1.0, 1.0, share, 1.0] for share in HIGHER])
        good = np.flatnonzero(walker.sound(np.array([line[k - 1].at] * len(higher)), higher, FINAL, True))
        if not len(good):
            return line[:k]
        line[k] = replace(line[k], at=higher[good[0]])
    return line


def _sound(landings: Landings, states: list[_State]) -> list[_State]:
    """The states whose last move goes with the whole body, and at more places, too."""
    landings.try_all([(s.before.at, s.landing) for s in states if s.before is not None and s.landing is not None])
    return [s for s in states if s.landing is None or s.landing.sound]
