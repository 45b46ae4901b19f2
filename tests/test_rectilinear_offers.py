"""Landing spots over steps against brute force: which are offered, in which order, with which swing; what searches know
from each other; and which of the ways that they find is taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear import course
from bodyplan.gaits.rectilinear import walker as module
from bodyplan.gaits.rectilinear.demands import phases
from bodyplan.gaits.rectilinear.landings import CLOSE, Landings
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.offers import places, reach
from bodyplan.gaits.rectilinear.search import NARROW, WIDE, Breadth, Way, search
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.terrain import highest
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.gaits.rectilinear.walker import Walker
from rectilinear_cases import OPTIONS

THREE = bp.snake(10, 0.1, **OPTIONS, radius=0.008, foot_radius=0.01, foot_spread=0.06)
FIVE = bp.snake(18, 0.1, **OPTIONS, radius=0.008, foot_radius=0.01, foot_spread=0.06)
THIN = bp.snake(18, 0.1, axes="alternating", first="pitch", foot_radius=0.003, foot_spread=0.06, mass=0.125)


def walker_of(seed: int) -> tuple[Walker, str, Callable[[], np.ndarray]]:
    """Stairs by chance with a snake on them, its schedule, and stances (N, 2) of it, most of them good."""
    rng = np.random.default_rng(seed)
    robot, anchors, schedule = [(THREE, 3, "wave"), (FIVE, 5, "two-phase"), (THIN, 5, "two-phase"), (FIVE, 5, "wave")][
        seed % 4
    ]
    x, z, floor = float(rng.uniform(0.3, 0.6)), 0.0, [(-1e3, 0.0)]
    for _ in range(5):
        z += float(rng.uniform(-0.05, 0.05))
        floor.append((x, z))
        x += float(rng.uniform(0.15, 0.4))
    roof = [(-1e3, max(level for _, level in floor) + 0.35), (0.9, max(level for _, level in floor) + 0.21)]
    snake = InchingSnake.of(robot, anchors, None)
    track = Track.of(bp.Profile(floor, roof if seed % 2 else None), (0.0, 0.0), 0.0)
    demands = snake.demands(np.inf, None if anchors == 3 else 0.0)
    short = rng.uniform(0.5, 0.7, anchors - 1) * demands.straight if seed % 3 else None
    crouch = float(demands.straight.max()) if seed % 5 == 4 else None
    walker = Walker(snake, track, demands, 0.03 if seed % 7 else 0.0, 0.006, crouch, short)

    def stance() -> np.ndarray:
        while True:
            gaps = rng.uniform(0.45, 1.0, anchors - 1) * demands.straight
            here = walker.stand(rng.uniform(-0.3, 0.8) + np.concatenate([[0.0], np.cumsum(gaps)]))
            if not goes(walker, here, here, np.zeros(anchors), np.ones(anchors), 1) and rng.uniform() < 0.9:
                continue
            return here

    return walker, schedule, stance


def goes(walker: Walker, here: np.ndarray, after: np.ndarray, lift: np.ndarray, early: np.ndarray, count: int) -> bool:
    """Tried with everything that is demanded, each move by itself."""
    moving = np.flatnonzero((here != after).any(axis=1))
    only = int(moving[0]) if len(moving) else None
    moves = Moves(here[None], after[None], lift[None], early[None], ("",))
    return bool(walker.tried(moves, np.linspace(0.0, 1.0, count), only)[0] == Status.OK)


def swing(walker: Walker, here: np.ndarray, i: int, s: float) -> tuple[float, float] | None:
    """Lift and early of the first shape in which anchor ``i`` gets to ``s``; None where it cannot."""
    after, lift, early = here.copy(), np.zeros(len(here)), np.ones(len(here))
    after[i] = walker.stand(np.array(s))
    none = np.zeros(1)
    still = Moves(after[None], after[None], lift[None], early[None], ("",))
    if walker.tried(still, none, i)[0] != Status.OK:
        return None
    ends = [here[i, 0], s]
    low, high = (
        min(ends) - (walker.snake.tail if i == 0 else 0.0),
        max(ends) + (walker.snake.head if i == len(here) - 1 else 0.0),
    )
    steps, top = walker.track.steps, max(here[i, 1], after[i, 1]) - walker.snake.rest
    over = [highest(steps.floor_x, steps.floor_z, x, x) - top for x in steps.breaks if low <= x <= high]
    above = max([0.0, *over])
    level = after[i, 1] == here[i, 1] and above <= 0.0
    for more, share in module.SHAPES[: 1 if level else None]:
        lift[i], early[i] = walker.lift + more * (above + walker.margin), share
        if goes(walker, here, after, lift, early, module.PLACES):
            return float(lift[i]), share
    return None


def offered(walker: Walker, here: np.ndarray, i: int) -> list[tuple[float, float, float]]:
    """All that is offered to one anchor, by the words of the docstrings."""
    at = places(walker.ranges, module.SPOTS, here, i)
    straight, short = walker.demands.straight, walker.short
    low, high = -np.inf, np.inf
    if short is not None and i > 0:
        low = here[i - 1, 0] + short[i - 1] * (1.0 - 1e-9)
    if short is not None and i < len(here) - 1:
        high = here[i + 1, 0] - short[i] * (1.0 - 1e-9)
    far = min(
        here[i - 1, 0] + straight[i - 1] if i else np.inf,
        here[i + 1, 0] - walker.demands.nearest if i < len(here) - 1 else np.inf,
    )
    far = max(far, here[i, 0])
    assert far == reach(walker.ranges, here, i)
    for roomy in (True, False):
        spots = [float(s) for s in at if (low <= s <= high) == roomy]
        good = [k for k, s in enumerate(spots) if swing(walker, here, i, s) is not None]
        if good:
            break
    else:
        return []
    spots = spots[: good[-1] + 1]
    step = (far - here[i, 0]) / module.SPOTS
    for _ in range(module.ROUNDS):
        fine = step / (module.CLOSER + 1)
        closer = [spots[-1] + step * k / (module.CLOSER + 1) for k in range(1, module.CLOSER + 1)]
        some = [k for k, s in enumerate(closer) if s < far and low <= s <= high and swing(walker, here, i, s)]
        spots += closer[: some[-1] + 1] if some else []
        step = fine
    last = len(spots) - 1
    edges = walker.ranges.edges[walker.ranges.first[i] : walker.ranges.first[i + 1]]
    out, wanted = [last], False
    for k in range(last - 1, -1, -1):
        wanted = wanted or k in [round(share * last) for share in module.SHARES]
        beside = bool((np.abs(edges - spots[k]) < 1e-12).any())
        if (wanted or beside) and swing(walker, here, i, spots[k]) is not None:
            out.append(k)
            wanted = False
    return [(spots[k], *(swing(walker, here, i, spots[k]) or ())) for k in out]  # type: ignore[misc]


def all_of(landings: Landings, here: np.ndarray, group: np.ndarray) -> list[np.ndarray]:
    """Rows of all landings, asked for one after the other."""
    ahead = landings.ahead([row_of(here)], group)[0]
    out = []
    while (landing := landings.landing(ahead, len(out))) is not None:
        out.append(landing.row)
    assert landings.landing(ahead, len(out) + 1) is None and not ahead.more
    return out


def row_of(here: np.ndarray) -> np.ndarray:
    return np.column_stack([here, np.zeros(len(here)), np.ones(len(here))])


def test_what_is_offered_is_what_brute_force_finds() -> None:
    """Of good stances and of some that are not, by their rows: spots, lifts and how early swings rise."""
    some = plain = none = 0
    for seed in range(12):
        walker, schedule, stance = walker_of(seed)
        groups = phases(walker.snake.anchors, schedule)
        for turn in range(20):
            here, group = stance(), groups[turn % len(groups)]
            rows = all_of(Landings(walker), here, group)
            each = [offered(walker, here, int(i)) for i in group]
            assert len(rows) == max(len(spots) for spots in each)
            for k, row in enumerate(rows):
                wanted = row_of(here)
                for i, spots in zip(group, each, strict=True):
                    if spots:
                        s, lift, early = spots[min(k, len(spots) - 1)]
                        wanted[i] = s, float(walker.stand(np.array(s))[1]), lift, early
                np.testing.assert_allclose(row, wanted, rtol=0.0, atol=1e-12)
                plain += bool((row[:, 3] == 1.0).all() and (row[:, 2] <= walker.lift).all())
            some, none = some + len(rows), none + (not rows)
    assert some > 1000 and 10 < none < 100
    assert some - plain > 30, "swings over edges are among them"


def test_no_more_edges_are_in_reach_than_there_is_room_for() -> None:
    """Of stances in a long flight of stairs: all places are among the spots."""
    floor = [(-1e3, 0.0), *((0.3 + 0.037 * k, 0.001 * (k % 2)) for k in range(200))]
    snake = InchingSnake.of(FIVE, 5, None)
    walker = Walker(snake, Track.of(bp.Profile(floor), (0.0, 0.0), 0.0), snake.demands(np.inf, 0.0), 0.03, 0.0)
    ranges, rng, most = walker.ranges, np.random.default_rng(3), 0
    for _ in range(200):
        gaps = rng.uniform(0.2, 1.0, 4) ** rng.uniform(0.0, 1.0) * walker.demands.straight
        here = walker.stand(rng.uniform(0.0, 5.0) + np.concatenate([[0.0], np.cumsum(gaps)]))
        for i in range(5):
            most = max(most, len(places(ranges, module.SPOTS, here, i)) - module.SPOTS)
    assert 0.8 * ranges.crowd < most <= ranges.crowd < 0.2 * np.diff(ranges.first).max()


@pytest.mark.parametrize("seed", range(8))
def test_what_stands_is_looked_at_once_and_nothing_is_missed(seed: int) -> None:
    """Moves of any anchors, most of which run into something: whether the first thing is looked for, where what does
    not move has been tried at the first place, or everything at all places."""
    walker, _, stance = walker_of(seed)
    rng, count = np.random.default_rng(seed), walker.snake.anchors
    stances = np.array([stance() for _ in range(60)])
    moving = rng.uniform(size=(60, count)) < 0.4
    after = stances.copy()
    after[..., 0] += moving * rng.uniform(-0.1, 0.1, moving.shape)
    after[..., 1] = walker.stand(after[..., 0])[..., 1] + moving * rng.choice([0.0, 0.0, -1e-3], moving.shape)
    lift = moving * rng.choice([0.0, 0.03, 0.06], moving.shape)
    early = np.where(rng.uniform(size=moving.shape) < 0.6, 1.0, rng.uniform(0.3, 1.0, moving.shape))
    rows = np.concatenate([after, lift[..., None], early[..., None]], axis=-1)
    for size in (25, 121):
        tau = module._halved(size).tau
        told = walker.tried(Moves(stances, after, lift, early, ("",) * 60), tau)
        np.testing.assert_array_equal(walker.sound(stances, rows, size), np.array(told) == Status.OK)
    assert 3 < sum(status == Status.OK for status in told) < 57


@pytest.mark.parametrize("seed", range(6))
def test_all_searches_know_the_same_of_a_stance(seed: int) -> None:
    """Whatever else was asked before, in batches or one by one, and by whom; and each is found once."""
    walker, schedule, stance = walker_of(seed)
    group, stances = phases(walker.snake.anchors, schedule)[0], [stance() for _ in range(9)]
    alone = [all_of(Landings(walker), here, group) for here in stances]
    together = Landings(walker)
    batch = together.ahead([row_of(here) for here in [*stances, stances[3]]], group)
    assert batch[3] is batch[-1] and len(together.known) == 9
    rng, done = np.random.default_rng(seed), [0] * 9
    while any(count <= len(rows) for count, rows in zip(done, alone, strict=True)):
        k = int(rng.integers(9))
        if done[k] <= len(alone[k]):
            landing = together.landing(batch[k], done[k])
            assert (landing is None) == (done[k] == len(alone[k]))
            if landing is not None:
                np.testing.assert_array_equal(landing.row, alone[k][done[k]])
                assert landing.far == pytest.approx(landing.row[:, 0].mean(), abs=1e-15)
            done[k] += 1
    for here, ahead in zip(stances, batch, strict=False):
        moves = [(row_of(here), landing) for landing in ahead.told]
        together.try_all(moves[::2])
        together.try_all(moves)
        for before, landing in moves:
            assert landing.sound == bool(walker.sound(before[None], landing.row[None], CLOSE)[0])


@pytest.mark.parametrize("seed", [0, 1, 3, 5])
def test_a_search_finds_the_same_after_others(seed: int) -> None:
    walker, schedule, stance = walker_of(seed)
    start, pace = stance(), 0.1
    used = Landings(walker)
    for breadth in (*NARROW, Breadth(4, 0.2, 60)):
        one, other = (search(some, start, schedule, 14, pace, breadth) for some in (used, Landings(walker)))
        assert (one.status, one.reason, one.tried) == (other.status, other.reason, other.tried)
        assert len(one.moves) == len(other.moves)
        for a, b in zip(one.moves, other.moves, strict=True):
            for name in ("before", "after", "lift", "early"):
                np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


# --- which way is taken ---


def way_to(share: float, status: Status, far: float) -> Way:
    """One move that goes so far."""
    before, none = np.zeros((1, 3, 2)), np.zeros((1, 3))
    move = Moves(before, before + np.array([share * far, 0.0]), none, none + 1.0, ("tail moves",))
    return Way([move], np.zeros(1, dtype=np.int64), status, "")


@pytest.mark.parametrize("seed", range(40))
def test_the_first_brisk_way_is_taken_or_else_the_farthest_that_is_not_slow(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ways of searches by chance. Those of narrow ones that are slow count for nothing: they may be steps on the spot
    before what cannot be passed. Crouching is tried where it makes a difference."""
    rng = np.random.default_rng(seed)
    walker = replace(walker_of(seed)[0], crouch=None)
    crouches = bool(np.isfinite(walker.track.steps.roof_z).any()) and seed % 4 == 1
    wanted, pace, made = 10, 0.1, []

    def by_chance(landings: Landings, start: Any, *args: Any, partly: bool) -> Way:
        breadth = args[-1]
        assert partly == (breadth is WIDE)
        landings.walker.noted[0] |= crouches
        status = Status.OK if rng.uniform() < 0.6 else Status.BELOW_FLOOR
        share = float(rng.uniform(0.2, 0.7 if seed % 2 else course.BRISK))
        way = way_to(share, status, wanted * pace)
        if status != Status.OK and not partly:
            way = Way([], np.zeros(0, dtype=np.int64), status, "")
        made.append((landings.walker.crouch is not None and not landings.walker.upright, breadth, share, way))
        return way

    monkeypatch.setattr(course, "search", by_chance)
    way, _ = course._way_on(walker, np.zeros((3, 2)), "wave", wanted, pace)
    brisk = [k for k, (_, _, share, way) in enumerate(made) if way.status == Status.OK and share >= course.BRISK]
    if brisk:
        assert brisk == [len(made) - 1] and way is made[-1][3]
        return
    order = [(crouching, some) for crouching in ((False, True) if crouches else (False,)) for some in NARROW]
    order += [(crouching, WIDE) for crouching in ((False, True) if crouches else (False,))]
    assert [(crouching, breadth) for crouching, breadth, _, _ in made] == order
    ways = [
        (way.status == Status.OK, share, way)
        for _, breadth, share, way in made
        if breadth is WIDE or (way.status == Status.OK and share >= course.SLOW)
    ]
    assert way is max(ways, key=lambda some: some[:2])[2]


def test_searches_that_are_left_out_would_have_found_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no way is good enough for a snake that stands upright, one that crouches is asked only where some moves go
    upright alone: under a high ceiling before a wall none does."""
    wall, stairs = [(-1e3, 0.0), (1.2, 0.5)], [(-1e3, 0.0), (1.2235, 0.0141), (1.375, -0.0245), (1.7362, 0.0109)]
    under = [(-1e3, 0.7), (1.3, 0.19685)]
    low = [(-1e3, 0.25), (1.3, 0.1), (1.5, 0.015)]
    counts = []
    for floor, roof in ((wall, [(-1e3, 2.0)]), (wall, [(-1e3, 0.9), (0.9, 0.8)]), (wall[:1], low), (stairs, under)):
        snake = InchingSnake.of(THREE, 3, None)
        track = Track.of(bp.Profile(floor, roof), (0.0, 0.0), 0.0)
        walker = Walker(snake, track, snake.demands(np.inf), 0.02, 0.006)
        start = walker.stand(snake.tail + np.array([0.0, 0.4, 0.8]))
        found, searches = [], []
        for every in (False, True):
            made: list[Way] = []

            def counted(*args: Any, made: list[Way] = made, **options: Any) -> Way:
                made.append(search(*args, **options))
                return made[-1]

            with monkeypatch.context() as patch:
                patch.setattr(course, "search", counted)
                if every:
                    patch.setattr(Walker, "noted", property(lambda _: np.ones(1, dtype=bool)))
                found.append(course._way_on(walker, start, "wave", 12, 0.126)[0])
            searches.append(len(made))
        one, other = found
        assert (one.status, one.reason, len(one.moves)) == (other.status, other.reason, len(other.moves))
        for a, b in zip(one.moves, other.moves, strict=True):
            for name in ("before", "after", "lift", "early"):
                np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        counts.append(searches)
    assert counts == [[5, 10], [5, 10], [10, 10], [10, 10]]
