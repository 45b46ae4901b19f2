"""From a rectilinear gait, a snake and a ground to moves in time."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.demands import Demands, move_names, phases
from bodyplan.gaits.rectilinear.landings import Landings
from bodyplan.gaits.rectilinear.moves import Moves
from bodyplan.gaits.rectilinear.search import NARROW, WIDE, Way, search
from bodyplan.gaits.rectilinear.sequence import Sequence
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.strides import (
    Stride,
    fastest,
    largest_stride,
    paper_drive,
    start_spacings,
    stride_of,
)
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.gaits.rectilinear.walker import Walker
from bodyplan.robot.model import Robot

if TYPE_CHECKING:
    from bodyplan.gaits.rectilinear.gait import Rectilinear

#: s of a move where neither the gait nor a rate limit says
MOVE_TIME = 1.0
#: s: no move counts as shorter
SHORT = 1e-2
#: share of the pace over level ground at which a way over steps that is found quickly is good enough
BRISK = 0.65
#: share at which it is where no wide search finds another; slower ones may be small steps on the spot before what
#: cannot be passed
SLOW = 0.5
#: most cycles of a gait that does not repeat
MOST_CYCLES = 400


def course_of(gait: Rectilinear, snake: InchingSnake, track: Track, until: float) -> Sequence:
    """The moves of ``gait``, the first anchor at s = the tail's length; those that do not repeat last for ``until`` s
    at least, or as long as they can."""
    room = room_above(gait, snake, track)
    demands = snake.demands(room, gait.least_margin)
    least = least_time(gait, demands)
    if not track.level and gait.drive == "fastest":
        return _over_steps(gait, snake, track, demands, until, least)
    found = _stride(_standard(gait), snake.robot, room)
    if track.level:
        if found is not None and found.status == Status.OK:
            return _repeated(found, snake, track, gait)
        if found is not None or gait.drive in ("fastest", "periodic"):
            return _refused(gait, snake, track, demands, found)
    return _by_rule(gait, snake, track, demands, found, until, least)


def least_time(gait: Rectilinear, demands: Demands) -> float:
    """s of a move that no rate limit makes longer."""
    if gait.move_time is not None:
        return gait.move_time
    return 1e-3 if len(demands.rates) and np.isfinite(demands.rates).all() else MOVE_TIME


def _standard(gait: Rectilinear) -> Rectilinear:
    """The gait without what does not matter to its stride on level ground."""
    options = gait.to_dict() | {"heading": 0.0, "start": (0.0, 0.0), "cycles": None, "clearance": None}
    if gait.drive == "fastest":
        del options["share"]
    del options["kind"]
    return type(gait)(**options)


@lru_cache(maxsize=16)
def _stride(gait: Rectilinear, robot: Robot, room: float) -> Stride | None:
    """:func:`stride_on_level`, searched once for plans of any length."""
    demands = InchingSnake.of(robot, gait.anchors, gait.joints).demands(room, gait.least_margin)
    return stride_on_level(gait, demands, least_time(gait, demands))


def stride_on_level(gait: Rectilinear, demands: Demands, least: float) -> Stride | None:
    """The gait over level ground where it repeats: the stride, whether it goes or not; None for a drive that does not
    repeat, or where no stride goes."""
    long = gait.spacings(demands)
    if gait.drive == "fastest":
        return fastest(demands, long, gait.schedule, gait.lift_of(demands), least, gait.dwell)
    if gait.drive == "periodic":
        # the paper's share keeps neighbouring links apart where no ceiling does
        stride = largest_stride(demands, long, gait.schedule, gait.lift_of(demands), gait.share * float(long.min()))
        return stride_of(demands, long, stride, gait.schedule, gait.lift_of(demands), least) if stride > 0.0 else None
    drives = paper_drive(long, gait.share) if gait.drive == "paper" else np.array(gait.drive)
    if np.ptp(drives) > 1e-12 * float(drives.max()):
        return None
    return stride_of(demands, long, float(drives[0]), gait.schedule, gait.lift_of(demands), least)


def room_above(gait: Rectilinear, snake: InchingSnake, track: Track) -> float:
    """Height m of an elbow's axis above the line of the anchors' axes that gait and ground allow."""
    given = np.inf if gait.ceiling is None else gait.ceiling
    return float(min(given, track.ceiling - track.floor - snake.rest - snake.top if track.level else np.inf))


def _placed(moves: Moves, snake: InchingSnake, track: Track) -> Moves:
    """Moves from s = 0 and height 0 on their place on level ground."""
    shift = np.array([snake.tail, track.floor + snake.rest])
    return Moves(moves.before + shift, moves.after + shift, moves.lift, moves.early, moves.names)


def _repeated(found: Stride, snake: InchingSnake, track: Track, gait: Rectilinear) -> Sequence:
    moves = _placed(found.moves, snake, track)
    cycle = np.zeros(len(moves), dtype=np.int64)
    return Sequence(moves, found.durations, gait.dwell, cycle, found.stride, repeats=gait.cycles)


def _refused(gait: Rectilinear, snake: InchingSnake, track: Track, demands: Demands, found: Stride | None) -> Sequence:
    """The snake stands still from the beginning, with the reason."""
    if found is None:
        # the smallest steps say what is in the way
        long = gait.spacings(demands)
        found = stride_of(demands, long, 1e-3 * float(long.min()), gait.schedule, gait.lift_of(demands), 1.0)
        for scale in (0.98, 0.9, 0.7):
            if found.status == Status.OUT_OF_REACH:
                found = stride_of(demands, long * scale, found.stride, gait.schedule, gait.lift_of(demands), 1.0)
    status = found.status if found.status != Status.OK else Status.OUT_OF_REACH
    still = _standing(snake, track, demands, found.spacings)
    return Sequence(still, np.ones(1), 0.0, np.zeros(1, dtype=np.int64), None, status, f"{found.failing}: {status}")


def _standing(snake: InchingSnake, track: Track, demands: Demands, spacings: Array) -> Moves:
    """One move in which nothing moves."""
    gaps = np.clip(spacings, np.abs(demands.links[0::2] - demands.links[1::2]) * 1.001, demands.straight)
    at = np.zeros((1, snake.anchors, 2))
    at[0, 1:, 0] = np.cumsum(gaps)
    shape = (1, snake.anchors)
    return _placed(Moves(at, at, np.zeros(shape), np.ones(shape), ("stands",)), snake, track)


def _by_rule(
    gait: Rectilinear,
    snake: InchingSnake,
    track: Track,
    demands: Demands,
    found: Stride | None,
    until: float,
    least: float,
) -> Sequence:
    """Drives that a rule gives, cycle by cycle, until one cannot be made."""
    lift = gait.lift_of(demands)
    walker = Walker(snake, track, demands, lift, gait.clearance_of(demands))
    long = gait.spacings(demands)
    first = found.stride if found is not None else 0.0
    if gait.drive == "fastest":
        first = 0.0
    spacings = start_spacings(long, first, gait.schedule)
    s = snake.tail + np.concatenate([[0.0], np.cumsum(spacings)])
    here = walker.stand(s) if not track.level else np.stack([s, np.full(len(s), track.floor + snake.rest)], axis=-1)
    parts: list[Moves] = []
    cycle_numbers: list[int] = []
    times: list[float] = []
    status, reason = Status.OK, ""
    groups, names = phases(snake.anchors, gait.schedule), move_names(snake.anchors, gait.schedule)
    cycle = 0
    most = MOST_CYCLES if gait.cycles is None else min(MOST_CYCLES, gait.cycles)
    while status == Status.OK and sum(times) + gait.dwell * len(times) < until and cycle < most:
        gaps = np.diff(here[:, 0])
        if gait.drive == "paper":
            drives = paper_drive(gaps, gait.share)
        elif gait.drive == "periodic":
            drives = np.full(len(here), first)
        else:
            drives = np.array(gait.drive)
        for group, name in zip(groups, names, strict=True):
            move, status = _move(walker, here, group, drives, name)
            if status != Status.OK:
                reason = f"{name} in cycle {cycle + 1}: {status}"
                break
            parts.append(move)
            cycle_numbers.append(cycle)
            times.append(float(demands.durations(move, least)[0]))
            here = move.after[0]
        cycle += 1
    if not parts:
        flat = Moves(here[None], here[None], np.zeros((1, len(here))), np.ones((1, len(here))), ("stands",))
        if np.isnan(flat.state(snake.links, np.zeros(1, dtype=np.int64), np.zeros(1)).angles).any():
            flat = _standing(snake, track, demands, spacings)
        return Sequence(flat, np.ones(1), 0.0, np.zeros(1, dtype=np.int64), None, status, reason)
    return Sequence(Moves.joined(parts), np.array(times), gait.dwell, np.array(cycle_numbers), None, status, reason)


def _move(walker: Walker, here: Array, group: IntArray, drives: Array, name: str) -> tuple[Moves, Status]:
    """One move of the anchors of a group by their drives, in a shape that goes, and its status."""
    after = here.copy()
    after[group, 0] += drives[group]
    if not walker.track.level:
        after[group] = walker.stand(after[group, 0])
    count = len(here)
    lift, early = np.zeros(count), np.ones(count)
    lift[group] = walker.lift
    if walker.track.level:
        move = Moves(here[None], after[None], lift[None], early[None], (name,))
        return move, walker.demands.met(move)[0]
    status = Status.OK
    for i in group:
        (_, lift[i], early[i]), found = walker.shaped(here, int(i), after[i])
        status = found if status == Status.OK else status
    return Moves(here[None], after[None], lift[None], early[None], (name,)), status


def _over_steps(
    gait: Rectilinear,
    snake: InchingSnake,
    track: Track,
    demands: Demands,
    until: float,
    least: float,
) -> Sequence:
    """The fastest way over steps that the search finds."""
    walker = Walker(snake, track, demands, gait.lift_of(demands), gait.clearance_of(demands))
    local = _local(gait, snake, track)
    spacings = gait.spacings(demands) if local is None else local.spacings
    start = walker.stand(snake.tail + np.concatenate([[0.0], np.cumsum(spacings)]))
    still = Moves(start[None], start[None], np.zeros((1, len(start))), np.ones((1, len(start))), ("stands",))
    stands = walker.tried(still, np.zeros(1))[0]
    if local is None or stands != Status.OK:
        status = stands if stands != Status.OK else Status.ABOVE_CEILING
        if np.isnan(still.state(snake.links, np.zeros(1, dtype=np.int64), np.zeros(1)).angles).any():
            still = _standing(snake, track, demands, spacings)
        where = "where it begins the snake cannot stand"
        return Sequence(still, np.ones(1), 0.0, np.zeros(1, dtype=np.int64), None, status, f"{where}: {status}")
    a_move = max(least, SHORT) + gait.dwell
    size = len(phases(snake.anchors, gait.schedule))
    most = MOST_CYCLES * size if gait.cycles is None else gait.cycles * size
    pace = local.stride / size
    wanted = int(min(most, np.ceil(until / a_move - 1e-9)))
    walker = replace(walker, short=np.diff(local.moves.after[..., 0], axis=-1).min(axis=0))
    way, tried = _way_on(walker, start, gait.schedule, wanted, pace)
    reason = way.reason and f"{way.reason} ({tried} stances tried)"
    if not way.moves:
        return Sequence(still, np.ones(1), 0.0, np.zeros(1, dtype=np.int64), None, way.status, reason)
    moves = Moves.joined(way.moves)
    return Sequence(moves, demands.durations(moves, least), gait.dwell, way.cycle, None, way.status, reason)


def _way_on(walker: Walker, start: Array, schedule: str, wanted: int, pace: float) -> tuple[Way, int]:
    """The first way at a good pace that searches find, narrow ones first, or else the farthest; and how many stances
    were tried. Where narrow ones find none under a ceiling the snake comes to low places stretched."""
    walkers = [Landings(walker)]
    if np.isfinite(walker.track.steps.roof_z).any():
        crouching = replace(walker, crouch=float(walker.demands.straight.max()))
        walkers = [Landings(replace(crouching, upright=True)), Landings(crouching)]
    tried, far = 0, wanted * pace
    ways: list[Way] = []
    for each, breadth in [*product(walkers, NARROW), *product(walkers, [WIDE])]:
        if each is not walkers[0] and not walkers[0].walker.noted[0]:
            continue  # crouching has made no difference: it would find the same
        way = search(each, start, schedule, wanted, pace, breadth, partly=breadth is WIDE)
        tried += way.tried
        share = (way.far - float(start[:, 0].mean())) / far if far > 0.0 else 1.0
        if way.status == Status.OK and share >= BRISK:
            return way, tried
        if breadth is WIDE or (way.status == Status.OK and share >= SLOW):
            ways.append(way)
    return max(ways, key=lambda w: (w.status == Status.OK, w.far)), tried


def _local(gait: Rectilinear, snake: InchingSnake, track: Track) -> Stride | None:
    """The fastest gait under the lowest ceiling over the body where it begins."""
    reach = snake.tail + float(snake.links.sum()) + snake.head
    under = [track.ceiling]
    ground = track.ground
    at = [x for x in track.breaks if 0.0 <= x <= reach]
    under += [float(ground.ceiling_height(track.origin[0] + x)) for x in at]  # type: ignore[attr-defined]
    room = min(under) - track.floor - snake.rest - snake.top - gait.clearance_of(snake.demands(np.inf))
    if gait.ceiling is not None:
        room = min(room, gait.ceiling)
    return _stride(_standard(gait), snake.robot, room)
