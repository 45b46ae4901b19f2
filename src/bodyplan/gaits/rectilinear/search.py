"""Landing spots over steps: a search over the moves of an inching snake.

State by state the anchors of the next phase are offered landing spots: the farthest that the demands, floor and ceiling
allow, shares of it, the places next to the edges of steps, and staying where they are. Moves are tried along their
whole way, links, tail and head included. How an anchor stands before a step decides whether the next can go over it, so
that the search goes back where it has no way on.
"""

from __future__ import annotations

import heapq
from collections import Counter
from dataclasses import dataclass
from itertools import count

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.demands import MET, Demands, move_names, phases
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.track import Track

#: states tried at once, those as good as the best to this many moves, and the most in all
BATCH, NEAR, MOST_STATES = 16, 0.5, 3000
#: states tried without coming farther after which there is no way on
STUCK = 900
#: what a move counts in units of the pace over level ground: less than 1, so that slow places are gone through
WEIGHT = 0.05
#: what a phase counts in which nothing can move: it comes from what stands beside it, which is to be tried otherwise
#: before all that stands elsewhere
HELD = 1.0
#: landing spots tried between standing and reach, and rounds that close in on the farthest good one with a few more
SPOTS, CLOSER, ROUNDS = 20, 4, 2
#: where among the spots that go those lie that are offered beside the farthest
SHARES = (0.8, 0.55, 0.3, 0.0)
#: places along a move at which it is tried, and those at which one that is kept is tried again
PLACES, CLOSE = 25, 121
#: shapes of a swing: what is added to its lift, in units of how far the ground on its way stands above its ends, and
#: how early it rises
SHAPES = ((0.0, 1.0), (0.0, 0.7), (0.0, 0.5), (0.0, 0.3), (1.0, 1.0), (1.0, 0.6), (1.6, 1.0), (1.6, 0.4))
#: share of its height over a tread that a tail or head link keeps from the tread's edge
OVER_EDGES = 0.9
#: shares of a straight leg by which an anchor may be behind the place beyond an edge where the next one lands
BRIDGES = (0.985, 0.95, 0.9)
#: share of the mean link within which two stances count as alike
ALIKE = 0.1
#: share of it by which one of two alike must be ahead of the other to be tried as well: strides may be small
STEP = 0.005


@dataclass(frozen=True, eq=False)
class Walker:
    """A snake on steps: what its moves must keep to. ``lift`` m at least; ``margin`` m that the body keeps from the
    edges of steps and from the ceiling. ``crouch`` m: a snake that is nearer than this to a low place moves as if it
    were under it with its whole body (None: it may stand tall up to the edge). ``short`` (N - 1,) m: no leg is made
    shorter where it need not be, so that the next anchor has room to rise."""

    snake: InchingSnake
    track: Track
    demands: Demands
    lift: float
    margin: float
    crouch: float | None = None
    short: Array | None = None

    def stand(self, s: Array) -> Array:
        """Anchors (..., N, 2) along and up, standing at s (..., N) m."""
        return np.stack([s, self.track.height(s) + self.snake.rest], axis=-1)

    def tried(self, moves: Moves, places: Array, only: int | None = None) -> list[Status]:
        """The first demand, floor or ceiling that each move runs into at ``places`` (p,) of tau, or ok. ``only``: the
        one anchor that moves in all of them; what does not move with it has been tried before."""
        count, snake, size = len(moves), self.snake, float(self.snake.links.max())
        tau = np.broadcast_to(places, (count, len(places)))
        state = moves.state(snake.links, np.broadcast_to(np.arange(count)[:, None], tau.shape), tau)
        found: dict[Status, Array] = {
            status: np.where(np.isnan(values), -np.inf, values).max(axis=(1, 2), initial=-np.inf)
            for status, values in self.demands.excess(state, moves.swinging[:, None]).items()
        }
        floor, ceiling = np.full(count, -np.inf), np.full(count, -np.inf)
        # only what the demands let pass is worth a look at the ground
        rows = np.flatnonzero(np.max(list(found.values()), axis=0) <= MET)
        if len(rows):
            floor[rows], ceiling[rows] = self._reaches(state.points(snake.links)[rows], only)
        found[Status.BELOW_FLOOR] = floor / size
        if self.crouch is not None:
            high = state.elbows(snake.links)[..., 1].max(axis=-1) - state.anchors[..., 1].min(axis=-1)
            ceiling = np.maximum(ceiling, (high - self._room(moves.before)[:, None]).max(axis=1))
            ceiling = np.maximum(ceiling, high[:, -1] - self._room(moves.after))
        found[Status.ABOVE_CEILING] = np.maximum(found.get(Status.ABOVE_CEILING, -np.inf), ceiling / size)
        return [next((s for s, most in found.items() if most[m] > MET), Status.OK) for m in range(count)]

    def _reaches(self, points: Array, only: int | None) -> tuple[Array, Array]:
        """How far (M,) m joints ``points`` (M, p, 2 N - 1, 2) and the links between them reach into the floor and its
        edges, and into the ceiling, at any place."""
        snake, joints = self.snake, points.shape[2]
        first, last = (0, joints) if only is None else (max(0, 2 * only - 2), min(joints, 2 * only + 3))
        body = [points[:, :, first:last]]
        keep = np.full(last - first - 1, self.margin)
        # tail and head links lie as low as the feet and may hang over an edge
        low_link = min(self.margin, OVER_EDGES * max(snake.rest - snake.body, 0.0))
        if first == 0 and (only is None or only == 0):
            body.insert(0, points[:, :, :1] - [snake.tail, 0.0])
            keep = np.append(low_link, keep)
        if last == joints and (only is None or 2 * only == joints - 1):
            body.append(points[:, :, -1:] + [snake.head, 0.0])
            keep = np.append(keep, low_link)
        whole = np.concatenate(body, axis=2)
        feet = points[:, :, 0::2] if only is None else points[:, :, 2 * only : 2 * only + 1]
        low, high = whole[..., 0].min(axis=(1, 2)), whole[..., 0].max(axis=(1, 2))
        far = 2.0 * (snake.rest + snake.top + self.margin)
        near = np.any((self.track.breaks >= low[:, None] - far) & (self.track.breaks <= high[:, None] + far), axis=1)
        # where no step is near the floor is level under feet that rise, and the ceiling level over the highest joint
        floor, ceiling = np.full(len(points), -np.inf), np.full(len(points), -np.inf)
        top = whole[..., 1].max(axis=(1, 2)) + snake.top + self.margin
        ceiling[~near] = top[~near] - self.track.ceiling_at(low[~near])
        if near.any():
            some = whole[near]
            below, above, corner = self.track.gaps(np.stack([some[:, :, :-1], some[:, :, 1:]], axis=3))
            standing = self.track.floor_gap(np.stack([feet[near], feet[near]], axis=3))
            slack = 1e-12 * float(snake.links.max())
            into = np.maximum(snake.body - below.min(axis=2), snake.rest - standing.min(axis=2)) - slack
            floor[near] = np.maximum(into, (snake.body + keep - corner).max(axis=2)).max(axis=1)
            # links keep from the ceiling what the joints must: those are where it is nearest
            ceiling[near] = (snake.top + self.margin - above.min(axis=2)).max(axis=1)
        return floor, ceiling

    def _room(self, anchors: Array) -> Array:
        """(M,) m: what the lowest place near anchors (M, N, 2) leaves above their line."""
        reach = self.crouch or 0.0
        low = self.track.lowest(anchors[:, 0, 0] - reach, anchors[:, -1, 0] + reach)
        return np.asarray(low - self.snake.rest - self.snake.top - self.margin)

    def rise(self, before: Array, after: Array, moving: IntArray) -> Array:
        """(M,) m: how far the floor under the way of the anchor ``moving`` (M,), its tail or head link included, stands
        above the higher of its ends."""
        rows = np.arange(len(before))
        start, end = before[rows, moving], after[rows, moving]
        low = np.minimum(start[:, 0], end[:, 0]) - np.where(moving == 0, self.snake.tail, 0.0)
        high = np.maximum(start[:, 0], end[:, 0]) + np.where(moving == before.shape[1] - 1, self.snake.head, 0.0)
        top = np.maximum(start[:, 1], end[:, 1]) - self.snake.rest
        out = np.zeros(len(before))
        for at in self.track.breaks:
            inside = (at >= low) & (at <= high)
            out = np.maximum(out, np.where(inside, float(self.track.height(np.array(at))) - top, 0.0))
        return out

    def moves(self, before: Array, after: Array, moving: IntArray, shape: tuple[float, float]) -> Moves:
        """One move a row with the anchor ``moving`` (M,) swung in ``shape``."""
        count, anchors = before.shape[:2]
        rows = np.arange(count)
        lift = np.zeros((count, anchors))
        lift[rows, moving] = self.lift + shape[0] * (self.rise(before, after, moving) + self.margin)
        return Moves(before, after, lift, np.full((count, anchors), shape[1]), ("",) * count)

    def shaped(self, before: Array, after: Array, moving: IntArray) -> tuple[Moves, list[Status]]:
        """Moves of one and the same anchor in the first shape that goes, with the first reason against the plainest
        where none does."""
        best = self.moves(before, after, moving, SHAPES[0])
        only = int(moving[0])
        status = self.tried(best, np.linspace(0.0, 1.0, PLACES), only)
        level = (before[np.arange(len(before)), moving, 1] == after[np.arange(len(before)), moving, 1]) & (
            self.rise(before, after, moving) <= 0.0
        )
        for shape in SHAPES[1:]:
            # over level ground no other shape can help against reach or limits, and none is lower
            left = np.array([m for m, s in enumerate(status) if s != Status.OK and not level[m]], dtype=np.int64)
            if not len(left):
                break
            other = self.moves(before[left], after[left], moving[left], shape)
            found = self.tried(other, np.linspace(0.0, 1.0, PLACES), only)
            for row in np.flatnonzero([s == Status.OK for s in found]):
                m = left[row]
                best.lift[m], best.early[m], status[m] = other.lift[row], other.early[row], Status.OK
        return best, status


@dataclass(frozen=True, eq=False)
class _State:
    """Anchors (N, 2) before phase ``phase`` of cycle ``cycle``, how they came there (the state before and the move), in
    how many moves, and how often nothing could move."""

    anchors: Array
    phase: int = 0
    cycle: int = 0
    made: int = 0
    held: int = 0
    before: _State | None = None
    move: Moves | None = None

    @property
    def far(self) -> float:
        """m: mean of the anchors."""
        return float(self.anchors[:, 0].mean())


@dataclass(frozen=True, eq=False)
class Way:
    """``moves`` with the number of their ``cycle`` (M,); ``status`` with the ``reason`` where it does not go on."""

    moves: list[Moves]
    cycle: IntArray
    status: Status
    reason: str

    @property
    def far(self) -> float:
        """m: where the anchors are at the end, in the mean."""
        return float(self.moves[-1].after[0, :, 0].mean()) if self.moves else -np.inf


def search(walker: Walker, start: Array, schedule: str, most: int, pace: float) -> Way:
    """The way over the steps from anchors ``start`` (N, 2) in ``most`` moves; ``pace`` m a move is that over level
    ground.

    Best first: the state that has come farthest for its number of moves, which counts little, is tried next. Where it
    has no way on, those behind it get their turn.
    """
    groups, names = phases(len(start), schedule), move_names(len(start), schedule)
    link = float(walker.snake.links.mean())
    heaps: list[list[tuple[float, int, _State]]] = [[] for _ in groups]
    seen: dict[tuple[int, ...], tuple[int, float]] = {}
    counter = count()
    best = _State(start)
    heapq.heappush(heaps[0], (0.0, next(counter), best))
    expanded, last = 0, 0
    while expanded < MOST_STATES and expanded - last < STUCK and any(heaps):
        phase = min((k for k, heap in enumerate(heaps) if heap), key=lambda k: heaps[k][0][0])
        first = heaps[phase][0][0]
        batch: list[_State] = []
        while heaps[phase] and len(batch) < BATCH and heaps[phase][0][0] <= first + NEAR:
            batch.append(heapq.heappop(heaps[phase])[2])
        batch = _sound(walker, batch)
        if not batch:
            continue
        expanded += len(batch)
        ahead = max([best, *batch], key=lambda s: (round(s.far / (1e-6 * link)), -s.made))
        if ahead.far > best.far + STEP * link:
            last = expanded
        best = ahead
        done = [s for s in batch if s.made >= most]
        if done:
            return _way(max(done, key=lambda s: s.far), Status.OK, "")
        for state in _next(walker, batch, groups[phase], names[phase], len(groups)):
            stance = (state.phase, *np.round(state.anchors[:, 0] / (ALIKE * link)).astype(int).tolist())
            made, far = seen.get(stance, (most + 1, -np.inf))
            if state.made < made or state.far > far + STEP * link:
                seen[stance] = min(made, state.made), max(far, state.far)
                gone = (state.far - float(start[:, 0].mean())) / pace
                heapq.heappush(
                    heaps[state.phase], (WEIGHT * state.made + HELD * state.held - gone, next(counter), state)
                )
    why = Counter[tuple[str, Status]]()
    for group, name in zip(groups, names, strict=True):
        for i in group:
            _options(walker, best.anchors[None], int(i), name, why)
    # what the ground forbids is told before what the body cannot do there
    ground, reach = (Status.BELOW_FLOOR, Status.ABOVE_CEILING), Status.OUT_OF_REACH
    told = sorted(why.most_common(), key=lambda item: (item[0][1] not in ground, item[0][1] == reach))
    name, status = told[0][0] if told else (names[0], Status.OUT_OF_REACH)
    at = f"with its anchors at {', '.join(f'{x:.4g}' for x in best.anchors[:, 0])} m"
    return _way(best, status, f"No landing spot leads on {at}: {name}: {status}")


def _way(state: _State, status: Status, reason: str) -> Way:
    moves, numbers = [], []
    while state.before is not None:
        if state.move is not None:
            moves.append(state.move)
            numbers.append(state.before.cycle)
        state = state.before
    return Way(moves[::-1], np.array(numbers[::-1], dtype=np.int64), status, reason)


def _sound(walker: Walker, states: list[_State]) -> list[_State]:
    """The states whose last move goes at many places, too."""
    some = [s.move for s in states if s.move is not None]
    if not some:
        return states
    found = iter(walker.tried(Moves.joined(some), np.linspace(0.0, 1.0, CLOSE)))
    return [s for s in states if s.move is None or next(found) == Status.OK]


def _next(walker: Walker, states: list[_State], group: IntArray, name: str, phases: int) -> list[_State]:
    """Every state after the anchors of ``group`` have moved, or stayed."""
    anchors = np.array([state.anchors for state in states])
    options = [_options(walker, anchors, int(i), name, Counter()) for i in group]
    out = []
    for k, state in enumerate(states):
        mine = [option[k] for option in options]
        then = (state.phase + 1) % phases
        after_that = then, state.cycle + (then == 0)
        stuck = int(not any(mine))
        out.append(_State(state.anchors, *after_that, state.made, state.held + stuck, state, None))
        for choice in range(max(len(m) for m in mine)):
            after, count = state.anchors.copy(), len(state.anchors)
            lift, early = np.zeros(count), np.ones(count)
            for i, spots in zip(group, mine, strict=True):
                if spots:
                    after[i], lift[i], early[i] = spots[min(choice, len(spots) - 1)]
            move = Moves(state.anchors[None], after[None], lift[None], early[None], (name,))
            if move.moving.any():
                out.append(_State(after, *after_that, state.made + 1, state.held, state, move))
    return out


def _options(
    walker: Walker, anchors: Array, i: int, name: str, why: Counter[tuple[str, Status]]
) -> list[list[tuple[Array, float, float]]]:
    """For every state (B, N, 2): where anchor i may land, with the lift and shape of its swing, the farthest first."""
    here, far = anchors[:, i, 0], _reach(walker, anchors, i)
    edges = _beside_edges(walker, i, anchors.shape[1])
    rows, at = [], []
    for k in range(len(anchors)):
        even = here[k] + (far[k] - here[k]) * np.arange(1, SPOTS + 1) / SPOTS if far[k] > here[k] else []
        mine = [*even, *(e for e in edges if here[k] < e < far[k])]
        rows += [k] * len(mine)
        at += mine
    out: list[list[tuple[Array, float, float]]] = [[] for _ in anchors]
    if not rows:
        why[name, Status.OUT_OF_REACH] += 1
        return out
    row, spots = np.array(rows), np.array(at)
    roomy = _roomy(walker, anchors[row], i, spots)
    found = _landings(walker, anchors, i, row[roomy], spots[roomy], name, why)
    none = ~roomy & np.array([not found[k] for k in rows])
    for k, more in enumerate(_landings(walker, anchors, i, row[none], spots[none], name, why)):
        found[k] += more
    # closer to the farthest that goes than the grid: what is lost here is lost in every cycle
    low = np.array([mine[-1][0][0] if mine else np.nan for mine in found])
    step = (far - here) / SPOTS
    for _ in range(ROUNDS):
        some = np.flatnonzero(np.isfinite(low))
        row = np.repeat(some, CLOSER)
        tried = (low[some, None] + step[some, None] * np.arange(1, CLOSER + 1) / (CLOSER + 1)).ravel()
        inside = (tried < far[row]) & _roomy(walker, anchors[row], i, tried)
        if not inside.any():
            break
        for k, more in enumerate(_landings(walker, anchors, i, row[inside], tried[inside], name, Counter())):
            found[k] += more
            low[k] = found[k][-1][0][0] if found[k] else np.nan
        step = step / (CLOSER + 1)
    for k, mine in enumerate(found):
        if mine:
            chosen = {len(mine) - 1, *(round(share * (len(mine) - 1)) for share in SHARES)}
            chosen |= {m for m, spot in enumerate(mine) if np.any(np.abs(edges - spot[0][0]) < 1e-12)}
            out[k] = [mine[m] for m in sorted(chosen, reverse=True)]
    return out


def _roomy(walker: Walker, anchors: Array, i: int, at: Array) -> BoolArray:
    """(K,) True where anchor i at ``at`` (K,) m makes no leg of ``anchors`` (K, N, 2) too short for the next move."""
    out = np.ones(len(at), dtype=bool)
    if walker.short is not None:
        if i > 0:
            out &= at - anchors[:, i - 1, 0] >= walker.short[i - 1] * (1.0 - 1e-9)
        if i < anchors.shape[1] - 1:
            out &= anchors[:, i + 1, 0] - at >= walker.short[i] * (1.0 - 1e-9)
    return out


def _reach(walker: Walker, anchors: Array, i: int) -> Array:
    """(B,) m: what anchor i cannot pass: the reach of the leg behind it, and the anchor ahead."""
    x = anchors[:, :, 0]
    ahead, behind = np.full(len(x), np.inf), np.full(len(x), np.inf)
    if i > 0:
        behind = x[:, i - 1] + walker.demands.straight[i - 1]
    if i < x.shape[1] - 1:
        ahead = x[:, i + 1] - walker.demands.nearest
    return np.asarray(np.maximum(np.minimum(ahead, behind), x[:, i]))


def _beside_edges(walker: Walker, i: int, count: int) -> Array:
    """Places that matter at the edges of steps: feet beside them, tail and head links clear of them, and those from
    which the next anchor reaches beyond them."""
    snake, keep = walker.snake, walker.snake.rest + walker.margin
    offsets = [keep, -keep]
    if i == count - 1:
        offsets.append(-snake.head - snake.body - walker.margin)
    if i == 0:
        offsets.append(snake.tail + snake.body + walker.margin)
    if i < count - 1:
        offsets += [keep - share * float(walker.demands.straight[i]) for share in BRIDGES]
    return np.unique([edge + offset for edge in walker.track.breaks for offset in offsets])


def _landings(
    walker: Walker, anchors: Array, i: int, row: IntArray, at: Array, name: str, why: Counter[tuple[str, Status]]
) -> list[list[tuple[Array, float, float]]]:
    """The spots ``at`` (K,) m of states ``row`` (K,) on which anchor i can land, with lift and shape, the farthest
    last."""
    out: list[list[tuple[Array, float, float]]] = [[] for _ in anchors]
    if not len(row):
        return out
    before = anchors[row]
    after = before.copy()
    after[:, i] = walker.stand(at)
    none = np.zeros(after.shape[:2])
    stands = walker.tried(Moves(after, after, none, none + 1.0, ("",) * len(row)), np.zeros(1), i)
    why.update((name, status) for status in stands if status != Status.OK)
    good = np.flatnonzero([status == Status.OK for status in stands])
    if not len(good):
        return out
    moves, status = walker.shaped(before[good], after[good], np.full(len(good), i))
    for m in np.argsort(at[good], kind="stable"):
        if status[m] == Status.OK:
            spot = after[good[m], i], float(moves.lift[m, i]), float(moves.early[m, i])
            out[row[good[m]]].append(spot)
        else:
            why[name, status[m]] += 1
    return out
