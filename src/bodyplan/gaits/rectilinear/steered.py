"""Inching that turns to other headings between cycles: straight cycles and turning ones, in time, as a Motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError, Status
from bodyplan.gaits.rectilinear.bowed import Bowed, bowed
from bodyplan.gaits.rectilinear.course import least_time, room_above, stride_on_level
from bodyplan.gaits.rectilinear.demands import MET, RATE_SLACK, Demands, move_names, phases
from bodyplan.gaits.rectilinear.motion import BETWEEN, EXACT, carrying
from bodyplan.gaits.rectilinear.sequence import settled
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.gaits.rectilinear.turning import Bends, Stance, turn
from bodyplan.motion import Claim, Motion

if TYPE_CHECKING:
    from bodyplan.gaits.rectilinear.gait import Rectilinear

#: legs of a steering snake are at most this share of straight: a straight leg cannot bend sideways
NOT_STRAIGHT = 0.97
#: and at least this share of it apart: one that is folded up cannot either
FOLDED = 0.25
#: places along a move at which it is tried
PLACES = 129
#: rad: how far the end of a move may be from the stance it leads to
LANDED = 1e-8
#: most cycles of a steered gait
MOST_CYCLES = 1000


@dataclass(frozen=True, eq=False)
class SteeredMove:
    """One move: the stances around it, who moves, its ``name``, the number of its ``cycle``, ``start`` and
    ``duration`` s."""

    before: Stance
    after: Stance
    group: IntArray
    name: str
    cycle: int
    start: float
    duration: float


@dataclass(frozen=True, eq=False)
class SteeredCourse:
    """All moves; ``end`` s; ``status`` with the ``reason`` where they end before their time; ``long`` (N - 1,) m of the
    legs, ``stride`` m of a straight cycle."""

    moves: tuple[SteeredMove, ...]
    standing: Stance
    end: float
    status: Status
    reason: str
    long: Array
    stride: float


def steered_course(gait: Rectilinear, snake: InchingSnake, track: Track, until: float) -> SteeredCourse:
    """The moves for ``until`` s at least, or as long as they can be made. InputError where the snake or the ground does
    not let it steer."""
    if not track.level:
        raise InputError("Rectilinear: steer needs a level floor; this profile has steps.")
    bends = Bends(snake)
    demands = snake.demands(room_above(gait, snake, track), gait.least_margin)
    demands = replace(demands, nearest=max(demands.nearest, FOLDED * float(demands.straight.max())))
    least = least_time(gait, demands)
    long = gait.spacings(demands)
    found = stride_on_level(gait, demands, least)
    start = np.array(gait.start) + snake.tail * np.array([np.cos(gait.heading), np.sin(gait.heading)])
    if found is None or found.status != Status.OK:
        status = Status.ABOVE_CEILING if found is None else found.status
        here = bends.straight(long, start, gait.heading)
        return SteeredCourse((), here, 0.0, status, f"the gait does not go: {status}", long, 0.0)
    # the longest that each leg is in this gait
    long = np.diff(found.moves.after[-1, :, 0]) + 0.0
    if gait.schedule == "two-phase":
        long = np.maximum(long, np.diff(found.moves.after[0, :, 0]))
    here = bends.straight(found.spacings, start, gait.heading)
    plan = _Plan(gait, snake, bends, demands, least, long, found.stride)
    return plan.made(here, until)


@dataclass(frozen=True, eq=False)
class _Plan:
    gait: Rectilinear
    snake: InchingSnake
    bends: Bends
    demands: Demands
    least: float
    long: Array
    stride: float

    def made(self, here: Stance, until: float) -> SteeredCourse:
        groups, names = (
            phases(self.snake.anchors, self.gait.schedule),
            move_names(self.snake.anchors, self.gait.schedule),
        )
        turns = dict(self.gait.steer)
        moves: list[SteeredMove] = []
        time, cycle = 0.0, 0
        status, reason = Status.OK, ""
        most = MOST_CYCLES if self.gait.cycles is None else self.gait.cycles
        while time < until and cycle < most and status == Status.OK:
            if cycle in turns:
                heading = _nearest(turns[cycle], float(here.heading[0, 0]))
                stances, moving, status = self._turn(here, heading, len(groups))
                if status != Status.OK:
                    reason = f"no way to turn from {here.heading[0, 0]:.4g} to {turns[cycle]:.4g} rad: {status}"
                    break
            else:
                stances, moving = self._straight_on(here), groups
            for k, group in enumerate(moving):
                duration, status = self._tried(stances[k], stances[k + 1], group)
                name, number = names[k % len(names)], cycle + k // len(names)
                if status != Status.OK:
                    reason = f"{name} in cycle {number + 1}: {status}"
                    break
                moves.append(SteeredMove(stances[k], stances[k + 1], group, name, number, time, duration))
                here = stances[k + 1]
                time += duration + self.gait.dwell
            cycle += max(1, len(moving) // len(groups))
        return SteeredCourse(tuple(moves), here, time, status, reason, self.long, self.stride)

    def _turn(self, here: Stance, heading: float, size: int) -> tuple[list[Stance], list[IntArray], Status]:
        """Stances and groups of a turn all of whose moves can be made, in as few cycles (of ``size`` moves) as that
        takes; else the first reason against it."""
        fewest, first = 2, Status.OK
        while True:
            found = turn(self.bends, here, heading, self.long, self.stride, self.gait.schedule, fewest)
            if found.status != Status.OK:
                return [here], [], first if first != Status.OK else found.status
            tried = (
                self._tried(a, b, g)[1]
                for a, b, g in zip(found.stances[:-1], found.stances[1:], found.groups, strict=True)
            )
            bad = next((status for status in tried if status != Status.OK), Status.OK)
            if bad == Status.OK:
                return found.stances, found.groups, bad
            first = bad if first == Status.OK else first
            fewest = len(found.groups) // size + 1

    def _straight_on(self, here: Stance) -> list[Stance]:
        """The stances of a cycle without turning: every anchor goes on by a stride, legs are planar."""
        out = [here]
        heading = float(here.heading[0, 0])
        ahead = self.stride * np.array([np.cos(heading), np.sin(heading)])
        for group in phases(self.snake.anchors, self.gait.schedule):
            at = out[-1].at.copy()
            at[:, group] += ahead
            chords = np.linalg.norm(np.diff(at[0], axis=0), axis=1)
            none = np.zeros(1)
            legs = np.stack([self.bends.planar(i, chord[None], none)[0] for i, chord in enumerate(chords)])
            out.append(Stance(at, out[-1].heading, legs[None]))
        return out

    def _tried(self, before: Stance, after: Stance, group: IntArray) -> tuple[float, Status]:
        """Time of a move, s, and the first demand that it breaks."""
        lift = self.gait.lift_of(self.demands)
        made = bowed(self.bends, before, after, group, lift, np.linspace(0.0, 1.0, PLACES))
        # the chain must lead where the stances say, with its elbows up
        apart = np.abs(made.yaws[0, -1] - after.legs[0][:, [1, 3]].ravel()).max()
        if not made.solved.all() or apart > LANDED or made.lowest.min() < 0.0:
            return self.least, Status.OUT_OF_REACH
        if made.highest.max() > self.demands.ceiling + 1e-9:
            return self.least, Status.ABOVE_CEILING
        q, rate, _ = coordinates(self.snake, made)
        limits = self.snake.robot.limits
        if np.any(q < limits[:, 0] - MET * np.pi) or np.any(q > limits[:, 1] + MET * np.pi):
            return self.least, Status.LIMIT
        slow = float((np.abs(rate) / self.snake.robot.rates).max()) * (1.0 + 60.0 * RATE_SLACK)
        return max(self.least, slow), Status.OK


def coordinates(snake: InchingSnake, made: Bowed) -> tuple[Array, Array, Array]:
    """Joint coordinates (S, n) of the robot, and their first and second derivatives by tau."""
    columns, gain, _ = snake.sideways()
    out = []
    for joints, yaws in zip(made.joints, made.yaws, strict=True):
        q = snake.q(joints)
        q[:, columns] = yaws / gain
        out.append(q)
    return out[0], out[1], out[2]


def _nearest(heading: float, now: float) -> float:
    """The heading, give or take whole turns, that is nearest to the present one."""
    return now + float(np.angle(np.exp(1j * (heading - now))))


def steered_motion(gait: Rectilinear, snake: InchingSnake, track: Track, course: SteeredCourse, t: Array) -> Motion:
    """The motion of a steering snake at times ``t`` (T,) s."""
    robot, size = snake.robot, len(t)
    q, qd, qdd = (np.zeros((size, robot.n)) for _ in range(3))
    base, anchors = np.zeros((size, 7)), np.zeros((size, snake.anchors, 3))
    standing = np.ones((size, snake.anchors), dtype=bool)
    solved = np.ones(size, dtype=bool)
    bends, lift = Bends(snake), gait.lift_of(snake.demands(np.inf))
    starts = np.array([move.start for move in course.moves])
    which = np.searchsorted(starts, t, side="right") - 1 if len(starts) else np.full(size, -1)
    for m in np.unique(which):
        rows = np.flatnonzero(which == m)
        if m < 0:
            move, here, tau = None, course.standing, np.zeros(len(rows))
            made = bowed(bends, here, here, np.zeros(0, dtype=np.int64), 0.0, tau)
            duration = 1.0
        else:
            move = course.moves[m]
            tau = np.clip((t[rows] - move.start) / move.duration, 0.0, 1.0)
            tau = settled(tau)
            made = bowed(bends, move.before, move.after, move.group, lift, tau)
            duration = move.duration
        solved[rows] = made.solved
        values = coordinates(snake, made)
        q[rows], qd[rows], qdd[rows] = values[0], values[1] / duration, values[2] / duration**2
        anchors[rows] = made.anchors + np.array([0.0, 0.0, track.floor + snake.rest])
        base[rows, 0] = anchors[rows, 0, 0] - snake.tail * np.cos(made.tail)
        base[rows, 1] = anchors[rows, 0, 1] - snake.tail * np.sin(made.tail)
        base[rows, 2] = anchors[rows, 0, 2]
        base[rows, 3], base[rows, 6] = np.cos(0.5 * made.tail), np.sin(0.5 * made.tail)
        if move is not None and lift > 0.0:
            under_way = (tau > 0.0) & (tau < 1.0)
            standing[np.ix_(rows[under_way], move.group)] = False
    poses = robot.forward(q, base)
    frames = [robot.frame_index(name) for name in snake.frames[0::2]]
    status = np.full(size, Status.OK.value, dtype="U24")
    status[~solved] = Status.OUT_OF_REACH.value
    if course.status != Status.OK:
        status[t >= course.end - 1e-12] = course.status.value
    contacts, _ = carrying(snake, standing, None)
    return Motion(
        robot=robot,
        ground=track.ground,
        gait=gait.to_dict(),
        t=t,
        base=base,
        q=q,
        qd=qd,
        qdd=qdd,
        residual=np.linalg.norm(poses.positions[:, frames] - anchors, axis=-1).max(axis=1),
        status=status,
        claims=tuple(_claims(gait, snake, course, lift, t)),
        contacts=contacts,
        facts=_facts(gait, snake, course, qd),
        stages=tuple((_stage(move), move.start, move.start + move.duration) for move in course.moves),
        notes=tuple(_notes(course)),
    )


def _stage(move: SteeredMove) -> str:
    return f"{move.name}, cycle {move.cycle + 1}"


def _claims(gait: Rectilinear, snake: InchingSnake, course: SteeredCourse, lift: float, t: Array) -> list[Claim]:
    names = snake.frames[0::2]
    out = []
    for move in course.moves:
        if move.start >= t[-1]:
            break
        end = min(move.start + move.duration, float(t[-1]))
        window: dict[str, Any] = {"start": move.start, "end": end, "every": None, "stage": _stage(move)}
        still = [name for i, name in enumerate(names) if i not in move.group]
        data = {"frames": still, **window, "tolerance": EXACT}
        out.append(Claim("at_rest", f"standing anchors at rest: {_stage(move)}", data))
        if lift > 0.0 and move.start + move.duration <= t[-1] + 1e-9:
            data = {"frames": [names[i] for i in move.group], **window, "height": lift, "tolerance": BETWEEN * lift}
            out.append(Claim("lifted", f"swinging anchors clear of the floor: {_stage(move)}", data))
        if any(snake.contacts[0::2]) and snake.robot.mass > 0.0:
            way = move.before.at[0, -1] - move.before.at[0, 0]
            along = [*(float(x) for x in way / np.hypot(*way)), 0.0]
            data = {"along": along, "required": 0.0, "start": move.start, "end": end}
            out.append(Claim("supported", f"the centre of mass is over the standing anchors: {_stage(move)}", data))
    return out


def _facts(gait: Rectilinear, snake: InchingSnake, course: SteeredCourse, qd: Array) -> dict[str, float]:
    out = {"anchors": float(snake.anchors), "lift": gait.lift_of(snake.demands(np.inf))}
    if not course.moves:
        return out
    first, last = course.moves[0].before, course.moves[-1].after
    gone = last.at[0].mean(axis=0) - first.at[0].mean(axis=0)
    cycles = course.moves[-1].cycle + 1
    path = sum(float(np.hypot(*(m.after.at[0].mean(axis=0) - m.before.at[0].mean(axis=0)))) for m in course.moves)
    return out | {
        "advance": float(np.hypot(*gone)),
        "advance_per_cycle": path / cycles,
        "cycle_time": course.end / cycles,
        "speed": path / course.end,
        "turn_angle": float(last.heading[0, 0] - first.heading[0, 0]),
        "peak_joint_rate": float(np.abs(qd).max(initial=0.0)),
        "stride_length": course.stride,
    }


def _notes(course: SteeredCourse) -> list[str]:
    notes = [
        "Steering: two feet of an anchor stand level side by side, so that a leg between two standing anchors bends "
        "symmetrically and its chord has the mean of their headings. Tail and head land turned, what is between takes "
        "the heading that its neighbours leave it, and the last cycle of a turn sets all straight.",
    ]
    if course.status != Status.OK:
        notes.append(f"Stops at {course.end:.4g} s. {course.reason[0].upper()}{course.reason[1:]}.")
    return notes
