"""Where the anchors of a steering snake land: from one heading to another within a few cycles.

An anchor's two feet stand level side by side, so that a leg between two standing anchors bends symmetrically: its chord
has the mean of their headings. Tail and head land with any heading; a middle anchor takes the one that its neighbours
leave it: each cycle it turns by stride / (distance of its neighbours) times the difference of their headings. So the
head turns in, the tail turns out, what is between follows, and the last cycle sets both ends straight.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.bent import Chain, newton
from bodyplan.gaits.rectilinear.demands import phases
from bodyplan.gaits.rectilinear.legs import leg
from bodyplan.gaits.rectilinear.snake import InchingSnake

#: rad: most that a leg bends on the way, and cycles within which a turn must be made
MOST_BEND, MOST_CYCLES = 0.7, 24
#: rounds of Newton on the headings, step of its slopes (rad) and the error (rad) of the headings in the end
ROUNDS, SLOPE, AIM = 12, 1e-6, 1e-12
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Stance:
    """V snakes on level ground: anchors at ``at`` (V, N, 2) m with ``heading`` (V, N) rad, and their ``legs``
    (V, N - 1, 4) rad: pitch of the rear link, its yaw joint, elbow, yaw joint of the front link."""

    at: Array
    heading: Array
    legs: Array

    def row(self, v: int) -> Stance:
        """One of the snakes, as V = 1."""
        return Stance(self.at[v : v + 1], self.heading[v : v + 1], self.legs[v : v + 1])


@dataclass(frozen=True, eq=False)
class Bends:
    """The links of a snake cut at its yaw joints: ``pieces`` (N - 1, 4) m of every leg."""

    snake: InchingSnake
    pieces: Array = field(init=False)

    def __post_init__(self) -> None:
        _, _, offsets = self.snake.sideways()
        pieces = np.stack([offsets, self.snake.links - offsets], axis=-1).reshape(-1, 4)
        object.__setattr__(self, "pieces", pieces)

    def planar(self, i: int, chord: Array, rise: Array) -> Array:
        """Guess (V, 4) of leg ``i`` with a chord of ``chord`` (V,) m that rises by ``rise`` (V,) m: not bent."""
        found = leg(self.snake.links[2 * i], self.snake.links[2 * i + 1], chord, rise)
        none = np.zeros_like(chord)
        return np.stack([found.rear, none, found.front - found.rear, none], axis=-1)

    def straight(self, spacings: Array, at: Array, heading: float) -> Stance:
        """A snake (V = 1) that stands straight with the first anchor ``at`` (2,)."""
        s = np.concatenate([[0.0], np.cumsum(spacings)])
        points = at + s[:, None] * [np.cos(heading), np.sin(heading)]
        legs = np.stack([self.planar(i, d[None], np.zeros(1))[0] for i, d in enumerate(spacings)])
        return Stance(points[None], np.full((1, len(s)), heading), legs[None])


def turned(heading: Array) -> Array:
    """Rotations (V, 3, 3) about z."""
    cos, sin, none = np.cos(heading), np.sin(heading), np.zeros_like(heading)
    x, y = np.stack([cos, sin, none], axis=-1), np.stack([-sin, cos, none], axis=-1)
    return np.stack([x, y, np.broadcast_to(UP, x.shape)], axis=-1)


def rise_of(turn: Array) -> Array:
    """Pitch (...,) rad, nose-up, of links whose y axis is level."""
    return np.asarray(np.arctan2(turn[..., 2, 0], np.hypot(turn[..., 0, 0], turn[..., 1, 0])))


def lands(bends: Bends, stance: Stance, i: int, chord: float, heading: Array) -> tuple[Stance, BoolArray]:
    """The stance after anchor ``i`` has landed ``chord`` m from its neighbour: the tail's ahead, the others' behind.
    ``heading`` (V,) rad is that of a tail or a head. Also which (V,) could."""
    count = stance.at.shape[1]
    if i == 0:
        at, way, legs, good = _tail(bends, stance, chord, heading)
    elif i == count - 1:
        at, way, legs, good = _head(bends, stance, chord, heading)
    else:
        at, way, legs, good = _middle(bends, stance, i, chord)
    out = Stance(stance.at.copy(), stance.heading.copy(), stance.legs.copy())
    out.at[:, i], out.heading[:, i] = at, way
    for k, values in legs.items():
        out.legs[:, k] = values
        good = good & (values[:, 2] < 0.0)  # elbows up
    return out, good


def flat(points: Array) -> Array:
    """Points (..., 2) on the level of the anchors, (..., 3)."""
    return np.concatenate([points, np.zeros((*points.shape[:-1], 1))], axis=-1)


def _tail(
    bends: Bends, stance: Stance, chord: float, heading: Array
) -> tuple[Array, Array, dict[int, Array], BoolArray]:
    """From a place on the circle about the second anchor, forward to it."""
    target, wanted = flat(stance.at[:, 1]), turned(stance.heading[:, 1])
    start = turned(heading)

    def origin(angle: Array) -> Array:
        return target - chord * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)

    def residual(x: Array) -> tuple[Array, Array]:
        made = Chain.of("yzyz", bends.pieces[0], origin(x[:, 0]), start, x[:, 1:])
        value, slope = closure(made, 3, target, wanted)
        moved = np.zeros((len(x), 5, 1))
        moved[:, 0, 0], moved[:, 1, 0] = chord * np.sin(x[:, 0]), -chord * np.cos(x[:, 0])
        return value, np.concatenate([moved, slope], axis=2)

    size = len(heading)
    guess = bends.planar(0, np.full(size, chord), np.zeros(size))
    guess[:, [1, 3]] = 0.5 * (stance.heading[:, 1] - heading)[:, None]
    first = 0.5 * (heading + stance.heading[:, 1])
    x, good = newton(residual, np.concatenate([first[:, None], guess], axis=1), chord)
    return origin(x[:, 0])[:, :2], heading, {0: x[:, 1:]}, good


def _head(
    bends: Bends, stance: Stance, chord: float, heading: Array
) -> tuple[Array, Array, dict[int, Array], BoolArray]:
    """Forward from the last but one anchor, to a place at that distance with the wanted heading."""
    last = stance.at.shape[1] - 2
    start, frame = flat(stance.at[:, last]), turned(stance.heading[:, last])
    ahead = turned(heading)[:, :, 0]

    def residual(x: Array) -> tuple[Array, Array]:
        made = Chain.of("yzyz", bends.pieces[last], start, frame, x)
        way, place, side = made.ends[:, 3] - start, made.place(3), made.side(3)
        y = made.turns[:, 3, :, 1]
        value = np.stack([0.5 * ((way**2).sum(1) / chord - chord), way[:, 2], y[:, 2], (y * ahead).sum(1)], axis=1)
        rows = [np.einsum("si,sij->sj", way / chord, place), place[:, 2], side[:, 2],
                np.einsum("si,sij->sj", ahead, side)]  # fmt: skip
        return value, np.stack(rows, axis=1)

    size = len(heading)
    guess = bends.planar(last, np.full(size, chord), np.zeros(size))
    guess[:, [1, 3]] = 0.5 * (heading - stance.heading[:, last])[:, None]
    x, good = newton(residual, guess, chord)
    made = Chain.of("yzyz", bends.pieces[last], start, frame, x)
    return made.ends[:, 3, :2], heading, {last: x}, good


def _middle(bends: Bends, stance: Stance, i: int, chord: float) -> tuple[Array, Array, dict[int, Array], BoolArray]:
    """A closed chain from the anchor behind over this one, level and at that distance, to the one ahead."""
    start, frame = flat(stance.at[:, i - 1]), turned(stance.heading[:, i - 1])
    target, wanted = flat(stance.at[:, i + 1]), turned(stance.heading[:, i + 1])
    lengths = np.concatenate([bends.pieces[i - 1], bends.pieces[i]])

    def residual(x: Array) -> tuple[Array, Array]:
        made = Chain.of("yzyzyzyz", lengths, start, frame, x)
        value, slope = closure(made, 7, target, wanted)
        way, place, side = made.ends[:, 3] - start, made.place(3), made.side(3)
        more = np.stack([0.5 * ((way**2).sum(1) / chord - chord), way[:, 2], made.turns[:, 3, 2, 1]], axis=1)
        rows = np.stack([np.einsum("si,sij->sj", way / chord, place), place[:, 2], side[:, 2]], axis=1)
        return np.concatenate([value, more], axis=1), np.concatenate([slope, rows], axis=1)

    size = len(start)
    between = np.linalg.norm(target - start, axis=1)
    rear = bends.planar(i - 1, np.full(size, chord), np.zeros(size))
    front = bends.planar(i, np.maximum(between - chord, 0.1 * chord), np.zeros(size))
    rear[:, [1, 3]] = 0.5 * (stance.heading[:, i] - stance.heading[:, i - 1])[:, None]
    front[:, [1, 3]] = 0.5 * (stance.heading[:, i + 1] - stance.heading[:, i])[:, None]
    front[:, 0] -= rear[:, 0] + rear[:, 2]  # a joint between links
    x, good = newton(residual, np.concatenate([rear, front], axis=1), chord)
    made = Chain.of("yzyzyzyz", lengths, start, frame, x)
    y = made.turns[:, 3, :, 1]
    after = x[:, 4:].copy()
    after[:, 0] += rise_of(made.turns[:, 3])
    # counted on from the heading before: angles do not stop at pi
    before = stance.heading[:, i]
    way = before + np.arctan2(-y[:, 0] * np.cos(before) - y[:, 1] * np.sin(before),
                              y[:, 1] * np.cos(before) - y[:, 0] * np.sin(before))  # fmt: skip
    return made.ends[:, 3, :2], way, {i - 1: x[:, :4], i: after}, good


def closure(made: Chain, k: int, target: Array, wanted: Array) -> tuple[Array, Array]:
    """How far link ``k`` ends from ``target`` (S, 3) with the y axis of ``wanted``: (S, 5), and (S, 5, joints)."""
    y, side = made.turns[:, k, :, 1], made.side(k)
    value = np.concatenate([made.ends[:, k] - target, (y * wanted[:, :, 0]).sum(1)[:, None], y[:, 2:]], axis=1)
    rows = np.stack([np.einsum("si,sij->sj", wanted[:, :, 0], side), side[:, 2]], axis=1)
    return value, np.concatenate([made.place(k), rows], axis=1)


@dataclass(frozen=True, eq=False)
class Turn:
    """``stances`` before every move and after the last; ``groups`` of anchors that move; ``status``."""

    stances: list[Stance]
    groups: list[IntArray]
    status: Status


def turn(
    bends: Bends, start: Stance, heading: float, long: Array, stride: float, schedule: str, fewest: int = 2
) -> Turn:
    """Landing spots that bring a straight snake to ``heading`` rad, straight again, in as few cycles, at least
    ``fewest``, as bend no leg by more than :data:`MOST_BEND`. Legs are ``long`` (N - 1,) m at their longest, as in the
    gait that goes straight."""
    count = start.at.shape[1]
    for cycles in range(fewest, MOST_CYCLES + 1):
        free = 2 * (cycles - 1)
        if free < count - 2:
            continue
        found = _solved(bends, start, heading, long, stride, schedule, cycles)
        if found is not None:
            return Turn(found, phases(count, schedule) * cycles, Status.OK)
    return Turn([start], [], Status.NOT_CONVERGED)


def _solved(
    bends: Bends, start: Stance, heading: float, long: Array, stride: float, schedule: str, cycles: int
) -> list[Stance] | None:
    first = float(start.heading[0, 0])
    ramp = first + (heading - first) * np.arange(1, cycles) / cycles
    u = np.concatenate([ramp, ramp])  # tail and head in every cycle but the last
    for _ in range(ROUNDS):
        tried = u + np.concatenate([np.zeros((1, len(u))), SLOPE * np.eye(len(u))])
        stances, good = _walked(bends, start, tried, heading, long, stride, schedule, cycles)
        if not good[0]:
            return None
        left = stances[-1].heading[:, 1:-1] - heading
        if np.abs(left[0]).max() <= AIM:
            chosen = [stance.row(0) for stance in stances]
            most = max(float(np.abs(np.diff(stance.heading[0])).max()) for stance in chosen)
            return chosen if most <= MOST_BEND else None
        if not good.all():
            return None
        slope = (left[1:] - left[0]).T / SLOPE
        u = u - np.linalg.pinv(slope) @ left[0]
        if np.abs(u - first).max() > np.pi:
            return None
    return None


def _walked(
    bends: Bends, start: Stance, u: Array, heading: float, long: Array, stride: float, schedule: str, cycles: int
) -> tuple[list[Stance], BoolArray]:
    """The stances of V walks whose tail and head land with the headings ``u`` (V, 2 cycles - 2)."""
    size, count = len(u), start.at.shape[1]
    here = Stance(*(np.repeat(values, size, axis=0) for values in (start.at, start.heading, start.legs)))
    good = np.ones(size, dtype=bool)
    out = [here]
    final = np.full(size, heading)
    for cycle in range(cycles):
        last = cycle == cycles - 1
        tail, head = (final, final) if last else (u[:, cycle], u[:, cycles - 1 + cycle])
        for group in phases(count, schedule):
            for i in group:
                chord = float(long[0] - stride) if i == 0 else float(long[i - 1])
                here, could = lands(bends, here, int(i), chord, tail if i == 0 else head)
                good &= could
            out.append(here)
    return out, good
