"""Inching over steps and under steps of a ceiling: every link of every move against floor and ceiling, densely and with
geometry of its own; what stands, stands on treads; what cannot be passed is a status."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import course
from bodyplan.gaits.rectilinear.search import Way, search
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.track import Track
from rectilinear_cases import OPTIONS, TIPS, failures, unit_ends

BODY, FOOT = 0.008, 0.01
ROBOT = bp.snake(10, 0.1, **OPTIONS, radius=BODY, foot_radius=FOOT, foot_spread=0.06)
FIVE = bp.snake(18, 0.1, **OPTIONS, radius=BODY, foot_radius=FOOT, foot_spread=0.06)
THIN_FIVE = bp.snake(18, 0.1, axes="alternating", first="pitch", foot_radius=0.003, foot_spread=0.06, mass=0.125)
Steps = list[tuple[float, float]]
#: m that a clearance may fall short of between the places at which a move is tried
BETWEEN = 2e-4


def outline(steps: Steps) -> list[tuple[np.ndarray, np.ndarray]]:
    """Treads and faces of steps [(x_start, z), ...] as segments."""
    ends = [-1e3, *(x for x, _ in steps[1:]), 1e3]
    treads = [((a, z), (b, z)) for (a, b), (_, z) in zip(pairwise(ends), steps, strict=True)]
    faces = [((x, before), (x, after)) for (_, before), (x, after) in pairwise(steps)]
    return [(np.array(p), np.array(q)) for p, q in treads + faces]


def to_segment(point: Any, a: Any, b: Any) -> Any:
    way = b - a
    share = np.clip(((point - a) * way).sum(-1) / np.maximum((way * way).sum(-1), 1e-300), 0.0, 1.0)
    off = point - a - share[..., None] * way
    return np.hypot(off[..., 0], off[..., 1])


def side(a: Any, b: Any, c: Any) -> Any:
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def distance(a: Any, b: Any, p: Any, q: Any) -> Any:
    """Of segments a, b (..., 2) from one segment p, q (2,)."""
    ends = [to_segment(a, p, q), to_segment(b, p, q), to_segment(p, a, b), to_segment(q, a, b)]
    meet = (side(a, b, p) * side(a, b, q) < 0.0) & (side(p, q, a) * side(p, q, b) < 0.0)
    return np.where(meet, 0.0, np.minimum.reduce(ends))


def level(steps: Steps, x: Any) -> Any:
    return np.array([z for _, z in steps])[np.searchsorted([s for s, _ in steps[1:]], x, side="right")]


def whole_body(snake: InchingSnake, sequence: Any, places: int) -> list[np.ndarray]:
    """Joints and both ends of the body (places, 2 N + 1, 2) along every move."""
    out = []
    for m in range(len(sequence.moves)):
        state = sequence.moves.state(snake.links, np.full(places, m), np.linspace(0.0, 1.0, places))
        points = state.points(snake.links)
        tail, head = points[:, :1] - [snake.tail, 0.0], points[:, -1:] + [snake.head, 0.0]
        out.append(np.concatenate([tail, points, head], axis=1))
    return out


def clearances(bodies: list[np.ndarray], floor: Steps, ceiling: Steps | None) -> tuple[float, float]:
    """Smallest distance of the body's centre line from floor and ceiling, negative inside."""
    points = np.concatenate(bodies)
    a, b = points[:, :-1], points[:, 1:]
    below = min(float(distance(a, b, *edge).min()) for edge in outline(floor))
    along = a + (b - a) * np.linspace(0.0, 1.0, 15)[:, None, None, None]
    if np.any(along[..., 1] < level(floor, along[..., 0]) - 1e-12):
        below = -1.0
    if ceiling is None:
        return below, np.inf
    above = min(float(distance(a, b, *edge).min()) for edge in outline(ceiling))
    return below, -1.0 if np.any(along[..., 1] > level(ceiling, along[..., 0]) + 1e-12) else above


def edge_gaps(bodies: list[np.ndarray], floor: Steps) -> tuple[float, float]:
    """Smallest distance of the surface of the links, and of tail and head link, from the edges of steps."""
    points, gaps = np.concatenate(bodies), [np.full(2, np.inf)]
    for (_, before), (x, after) in pairwise(floor):
        away = to_segment(np.array([x, max(before, after)]), points[:, :-1], points[:, 1:]).min(axis=0) - BODY
        gaps.append(np.array([away[1:-1].min(), away[[0, -1]].min()]))
    inner, ends = np.min(gaps, axis=0)
    return float(inner), float(ends)


GROUNDS: dict[str, tuple[Any, dict[str, Any], Steps, Steps | None, float]] = {
    # robot, options, floor, ceiling, s
    "up and down": (ROBOT, {}, [(-np.inf, 0.0), (1.1, 0.05), (1.42, 0.02), (1.8, -0.03)], None, 13.0),
    "a narrow pillar": (ROBOT, {}, [(-np.inf, 0.0), (1.25, 0.05), (1.27, 0.0)], None, 11.0),
    "a hole": (ROBOT, {}, [(-np.inf, 0.0), (1.15, -0.4), (1.25, 0.0)], None, 11.0),
    "under a beam": (ROBOT, {}, [(-np.inf, 0.0)], [(-np.inf, 0.5), (1.15, 0.14), (1.2, 0.5)], 14.0),
    "up under a roof": (ROBOT, {}, [(-np.inf, 0.0), (1.2, 0.03)], [(-np.inf, 0.6), (1.3, 0.22)], 11.0),
    "sliding": (ROBOT, {"lift": 0.0}, [(-np.inf, 0.0), (1.15, 0.03)], None, 9.0),
    "from elsewhere": (ROBOT, {"start": (4.0, 0.7)}, [(-np.inf, 0.1), (5.1, 0.14), (5.5, 0.1)], None, 9.0),
    "a given ceiling": (ROBOT, {"ceiling": 0.17}, [(-np.inf, 0.0), (1.15, 0.02)], None, 12.0),
    "five anchors": (FIVE, {"anchors": 5, "schedule": "two-phase"}, [(-np.inf, 0.0), (2.0, 0.03)], None, 8.0),
}


def random_stairs(seed: int) -> tuple[Any, dict[str, Any], Steps, Steps | None, float]:
    rng = np.random.default_rng(seed)
    x, z, floor = float(rng.uniform(1.05, 1.3)), 0.0, [(-np.inf, 0.0)]
    for _ in range(3):
        z += float(rng.uniform(-0.05, 0.05))
        floor.append((x, z))
        x += float(rng.uniform(0.1, 0.5))
    roof = [(-np.inf, 0.7), (1.3, max(level for _, level in floor) + float(rng.uniform(0.15, 0.3)))]
    return ROBOT, {}, floor, roof if seed % 2 else None, 12.0


GROUNDS |= {f"stairs {seed}": random_stairs(seed) for seed in (1, 3)}


@pytest.fixture(scope="module", params=list(GROUNDS), ids=list(GROUNDS))
def crossing(request: Any) -> Any:
    robot, options, floor, ceiling, until = GROUNDS[request.param]
    gait, ground = bp.Rectilinear(**options), bp.Profile(floor, ceiling)
    motion = bp.plan(robot, gait, ground, bp.times(0.0, until, dt=0.05))
    x = gait.start[0]
    shifted = [[(s - x, z) for s, z in steps] if steps else None for steps in (floor, ceiling)]
    return motion, InchingSnake.of(robot, gait.anchors, None), gait.sequence(robot, ground, until), *shifted


def test_no_link_touches_floor_or_ceiling_at_any_time(crossing: Any) -> None:
    """Between the samples of the motion, too: 241 places along every move, whole links, tail and head."""
    motion, snake, sequence, floor, ceiling = crossing
    assert set(motion.status) == {"ok"} and np.isfinite(motion.q).all()
    bodies = whole_body(snake, sequence, 241)
    below, above = clearances(bodies, floor, ceiling)
    assert below >= BODY - 1e-12 and above >= FOOT - 1e-12
    inner, ends = edge_gaps(bodies, floor)
    assert inner >= 0.03 * 0.2 - BETWEEN, "links keep the clearance from edges"
    assert ends >= 0.9 * (FOOT - BODY) - BETWEEN, "tail and head link, which lie as low as the feet, what that leaves"
    assert failures(motion) <= {TIPS}


def test_standing_anchors_are_on_treads_and_land_where_the_next_move_begins(crossing: Any) -> None:
    _, _, sequence, floor, _ = crossing
    moves = sequence.moves
    np.testing.assert_array_equal(moves.before[1:], moves.after[:-1])
    for stance in (*moves.before, moves.after[-1]):
        np.testing.assert_allclose(stance[:, 1], level(floor, stance[:, 0]) + FOOT, atol=1e-15)
        # no foot hangs over an edge that it does not clear
        for x in [s for s, _ in floor[1:]]:
            near = np.abs(stance[:, 0] - x) < FOOT
            heights = [float(level(floor, x - 1e-9)), float(level(floor, x + 1e-9))]
            assert np.all(stance[near, 1] >= max(heights) + FOOT - 1e-12)
    assert np.all(np.diff(moves.after[..., 0], axis=1) > 0.0)
    assert np.all(moves.after[..., 0] >= moves.before[..., 0]), "no anchor goes back"


def test_the_snake_gets_over(crossing: Any) -> None:
    """The last step lies behind the anchor at its head."""
    motion, _, sequence, floor, ceiling = crossing
    last = max([x for x, _ in floor[1:]] + [x for x, _ in (ceiling or [])[1:]])
    assert sequence.moves.after[-1, -1, 0] > last
    assert motion.facts["advance"] > 0.2
    assert bp.check(motion)["standing anchors at rest"].passed


def test_a_ceiling_that_leaves_no_stride_over_the_edge_stops_it() -> None:
    """Under 0.13 m legs are 0.304 to 0.4 m, and the head, whose link reaches 0.1 m ahead, must come over an edge from
    0.108 m before it to 0.01 m beyond: 0.118 m at once, where it has 0.096 m. Under 0.17 m it has 0.189 m."""
    floor = bp.Profile([(None, 0.0), (1.15, 0.02)])
    motion = bp.plan(ROBOT, bp.Rectilinear(ceiling=0.13), floor, bp.times(0.0, 30.0, dt=0.1))
    assert motion.status[-1] == "above_ceiling" and motion.status[0] == "ok"
    assert unit_ends(motion, np.full(10, 0.1))[-1, 9, 0] <= 1.15 - 0.1 - BODY + 1e-9


# --- what cannot be passed ---


@pytest.mark.parametrize(("ground", "statuses"), [
    (bp.Profile([(None, 0.0), (1.2, 0.5)]), {"below_floor"}),
    (bp.Profile(0.0, [(None, 0.5), (1.2, 0.015)]), {"above_ceiling"}),
    (bp.Profile([(None, 0.0), (1.2, -0.5)]), {"below_floor", "out_of_reach", "links_crossing", "collapsed"}),
], ids=["wall", "low roof", "pit"])  # fmt: skip
def test_impossible_ground_is_a_status_with_a_reason(ground: Any, statuses: set[str]) -> None:
    motion = bp.plan(ROBOT, bp.Rectilinear(), ground, bp.times(0.0, 16.0, dt=0.1))
    stops = np.flatnonzero(motion.status != "ok")[0]
    assert set(motion.status[stops:]) <= statuses and len(set(motion.status[stops:])) == 1
    assert stops > 0, "it comes as near as it can"
    assert np.isfinite(motion.q).all() and np.ptp(motion.q[stops + 1 :], axis=0).max() == 0.0
    note = next(n for n in motion.notes if n.startswith("Stops at"))
    assert str(motion.status[stops]) in note and "No landing spot leads on" in note
    assert failures(motion) - {TIPS} == {"every sample solved"}, "and touches nothing"
    at = unit_ends(motion, np.full(10, 0.1))
    assert 1.0 < at[-1, 9, 0] < 1.2, "the head stands before the obstacle"


@pytest.mark.parametrize("options", [
    {"drive": "periodic"}, {"drive": "paper", "spacing": (0.5, 0.7)}, {"drive": [0.1, 0.1, 0.1], "spacing": 0.8},
])  # fmt: skip
def test_rules_go_on_over_steps_until_they_cannot(options: dict[str, Any]) -> None:
    floor = [(-np.inf, 0.0), (1.2, 0.03)]
    gait, ground = bp.Rectilinear(**options), bp.Profile(floor)
    motion = bp.plan(ROBOT, gait, ground, bp.times(0.0, 12.0, dt=0.05))
    assert set(motion.status) <= {"ok", "below_floor", "out_of_reach"}
    assert failures(motion) - {TIPS, "every sample solved"} == set()
    snake = InchingSnake.of(ROBOT, 3, None)
    below, _ = clearances(whole_body(snake, gait.sequence(ROBOT, ground, 12.0), 301), floor, None)
    assert below >= BODY - 1e-12


def test_where_it_cannot_begin() -> None:
    for floor in ([(None, 0.0), (0.3, 0.02)], [(None, 0.0), (0.1, -0.5)]):
        motion = bp.plan(ROBOT, bp.Rectilinear(), bp.Profile(floor), bp.times(0.0, 2.0, dt=0.1))
        assert motion.status[0] != "ok" and len(set(motion.status)) == 1
        assert any("where it begins the snake cannot stand" in note for note in motion.notes)
        assert np.isfinite(motion.q).all() and np.all(motion.qd == 0.0)


def test_where_one_search_finds_no_way_another_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Up and down stairs under a roof: by chance some spacings miss all ways with the stances that are tried first.
    What searches without a way would have told of it changes nothing."""
    floor = [(-np.inf, 0.0), (2.2, 0.04), (3.0, 0.08), (3.8, 0.04)]
    ground = bp.Profile(floor, [(-np.inf, 0.22), (2.0, 0.26), (2.8, 0.3), (4.2, 0.26)])
    snake = InchingSnake.of(THIN_FIVE, 5, None)
    searches = []
    for spacing in ((1.0, 1.0, 1.0, 1.0), (0.998, 1.0, 1.0, 1.0), (1.0, 0.996, 1.0, 1.0)):
        gait = bp.Rectilinear(anchors=5, schedule="two-phase", lift=0.05, spacing=spacing, move_time=1.0)
        found = []
        for told in (False, True):
            ways: list[Way] = []

            def counted(*args: Any, partly: bool, told: bool = told, ways: list[Way] = ways) -> Way:
                ways.append(search(*args, partly=partly or told))
                return ways[-1]

            monkeypatch.setattr(course, "search", counted)
            found.append(course.course_of(gait, snake, Track.of(ground, gait.start, gait.heading), 24.0))
            searches.append(len(ways))
            assert all(bool(way.moves) == bool(told or way.status == "ok") for way in ways)
        one, other = (sequence.moves for sequence in found)
        assert found[0].status == "ok" and len(one) == 24
        assert float((one.after[-1] - one.before[0])[:, 0].mean()) > 3.5
        for name in ("before", "after", "lift", "early"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert searches[0::2] == searches[1::2] and max(searches) > 1


def test_cycles_end_and_clearance_is_the_user_s() -> None:
    ground = bp.Profile([(None, 0.0), (1.15, 0.03)])
    motion = bp.plan(ROBOT, bp.Rectilinear(cycles=2), ground, bp.times(0.0, 9.0, dt=0.1))
    assert set(motion.status) == {"ok"} and len(motion.stages) <= 6
    assert np.ptp(motion.q[motion.t > 6.0], axis=0).max() == 0.0
    snake, floor = InchingSnake.of(ROBOT, 3, None), [(-np.inf, 0.0), (1.15, 0.03)]
    for clearance in (0.0, 0.02):
        sequence = bp.Rectilinear(clearance=clearance).sequence(ROBOT, ground, 9.0)
        inner, _ = edge_gaps(whole_body(snake, sequence, 241), floor)
        assert clearance - BETWEEN <= inner and sequence.status == "ok"
