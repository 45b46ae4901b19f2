"""A steering snake on the way from one stance to the next: every joint, exact in time, while anchors swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.rectilinear.bent import Chain, newton
from bodyplan.gaits.rectilinear.swing import cycloid, swing
from bodyplan.gaits.rectilinear.turning import Bends, Stance, closure, flat, rise_of, turned


@dataclass(frozen=True, eq=False)
class Bowed:
    """S samples of a move. ``joints`` (3, S, 2 N - 1): nose-up angles of the pitch joints, rates and accelerations by
    tau; ``yaws`` (3, S, 2 N - 2): of the yaw joints, to the left. ``anchors`` (S, N, 3) m above their level, ``tail``
    (S,) rad: heading of the tail link; ``highest`` and ``lowest`` (S,) m: of the elbows that move; ``solved`` (S,)."""

    joints: Array
    yaws: Array
    anchors: Array
    tail: Array
    highest: Array
    lowest: Array
    solved: BoolArray


def bowed(bends: Bends, before: Stance, after: Stance, group: IntArray, lift: float, tau: Array) -> Bowed:
    """The snake at ``tau`` (S,) of the move of the anchors in ``group`` from one stance to the next (V = 1 each)."""
    size, count = len(tau), before.at.shape[1]
    legs = np.zeros((3, size, count - 1, 4))
    legs[0] = before.legs[0]
    # joints at the anchors, filled in from both sides: rear[j] is the rise of the link before, front[j] of that after
    rear, front = np.zeros((3, size, count)), np.zeros((3, size, count))
    for i in range(count - 1):
        made = Chain.of("yzyz", bends.pieces[i], flat(before.at[:, i]), turned(before.heading[:, i]), before.legs[:, i])
        rear[0, :, i + 1] = rise_of(made.turns[0, 3])
        front[0, :, i] = before.legs[0, i, 0]
    anchors = np.repeat(flat(before.at[0])[None], size, axis=0)
    tail = np.full(size, before.heading[0, 0])
    solved, highest, lowest = np.ones(size, dtype=bool), np.zeros(size), np.full(size, np.inf)
    for i in map(int, group):
        swung = _Swung.of(before.at[0, i], after.at[0, i], lift, tau)
        anchors[:, i] = swung.place
        part = _Part(bends, before, after, i, swung, tau)
        good, elbows = part.fill(legs, rear, front, tail)
        solved &= good
        highest, lowest = np.maximum(highest, elbows.max(axis=1)), np.minimum(lowest, elbows.min(axis=1))
    joints = np.zeros((3, size, 2 * count - 1))
    joints[:, :, 0::2] = front - rear
    joints[:, :, 1::2] = legs[..., 2]
    yaws = legs[..., [1, 3]].reshape(3, size, 2 * (count - 1))
    return Bowed(joints, yaws, anchors, tail, highest, lowest, solved)


@dataclass(frozen=True, eq=False)
class _Swung:
    """An anchor on its way: place, velocity and acceleration (S, 3) by tau; ``part`` (S,) of the way along."""

    place: Array
    velocity: Array
    acceleration: Array
    part: Array

    @classmethod
    def of(cls, start: Array, end: Array, lift: float, tau: Array) -> _Swung:
        way = end - start
        length = float(np.hypot(*way))
        direction = way / length if length > 0.0 else np.array([1.0, 0.0])
        found = swing(tau, np.broadcast_to([length, 0.0], (len(tau), 2)), np.asarray(lift), np.asarray(1.0))
        place, velocity, acceleration = (
            np.concatenate([v[:, :1] * direction, v[:, 1:]], axis=1)
            for v in (found.risen, found.velocity, found.acceleration)
        )
        place[:, :2] += start
        return cls(place, velocity, acceleration, cycloid(tau * tau * (3.0 - 2.0 * tau)))


@dataclass(frozen=True, eq=False)
class _Part:
    """The chain between the standing neighbours of anchor ``i``, or from one of them to its free end."""

    bends: Bends
    before: Stance
    after: Stance
    i: int
    swung: _Swung
    tau: Array

    def fill(self, legs: Array, rear: Array, front: Array, tail: Array) -> tuple[BoolArray, Array]:
        """Write what the chain tells into the arrays of :func:`bowed`; which samples are solved, and the heights
        (S, e) m of its elbows."""
        count = self.before.at.shape[1]
        if self.i == 0:
            return self._tail(legs, rear, front, tail)
        if self.i == count - 1:
            return self._head(legs, rear, front)
        return self._middle(legs, rear, front)

    def _guess(self, leg: int, chord: Array, rise: Array) -> Array:
        """(S, 4): the planar leg with yaw joints between those of both stances."""
        out = self.bends.planar(leg, chord, rise)
        part = self.swung.part[:, None]
        ends = [stance.legs[0, leg][[1, 3]] for stance in (self.before, self.after)]
        out[:, [1, 3]] = (1.0 - part) * ends[0] + part * ends[1]
        return out

    def _tail(self, legs: Array, rear: Array, front: Array, tail: Array) -> tuple[BoolArray, Array]:
        size = len(self.tau)
        target = np.repeat(flat(self.before.at[:, 1]), size, axis=0)
        wanted = np.repeat(turned(self.before.heading[:, 1]), size, axis=0)
        lengths = np.concatenate([[0.0], self.bends.pieces[0]])
        level = np.repeat(np.eye(3)[None], size, axis=0)

        def chain(x: Array) -> Chain:
            return Chain.of("zyzyz", lengths, self.swung.place, level, x)

        way = target - self.swung.place
        part = self.swung.part
        heading = (1.0 - part) * self.before.heading[0, 0] + part * self.after.heading[0, 0]
        guess = self._guess(0, np.hypot(way[:, 0], way[:, 1]), way[:, 2])
        x, good = newton(
            lambda x: closure(chain(x), 4, target, wanted), np.concatenate([heading[:, None], guess], axis=1),
            float(lengths.sum()),
        )  # fmt: skip
        made = chain(x)
        _, slope = closure(made, 4, target, wanted)
        none = np.zeros((size, 2))
        first = np.concatenate([-self.swung.velocity, none], axis=1)
        rates = _solve(slope, first)
        place, side = made.drift(4, rates)
        across = (side * wanted[:, :, 0]).sum(axis=1)
        second = -np.concatenate([self.swung.acceleration + place, across[:, None], side[:, 2:]], axis=1)
        seconds = _solve(slope, second)
        tail[:] = x[:, 0]
        legs[:, :, 0] = x[:, 1:], rates[:, 1:], seconds[:, 1:]
        front[:, :, 0] = x[:, 1], rates[:, 1], seconds[:, 1]
        rear[:, :, 1] = _rise(made, 4, rates, seconds)
        return good, made.ends[:, 2:3, 2]

    def _head(self, legs: Array, rear: Array, front: Array) -> tuple[BoolArray, Array]:
        size, last = len(self.tau), self.i - 1
        start = np.repeat(flat(self.before.at[:, last]), size, axis=0)
        frame = np.repeat(turned(self.before.heading[:, last]), size, axis=0)

        def residual(x: Array) -> tuple[Array, Array]:
            made = Chain.of("yzyz", self.bends.pieces[last], start, frame, x)
            value = np.concatenate([made.ends[:, 3] - self.swung.place, made.turns[:, 3, 2:, 1]], axis=1)
            return value, np.concatenate([made.place(3), made.side(3)[:, 2:]], axis=1)

        way = self.swung.place - start
        guess = self._guess(last, np.hypot(way[:, 0], way[:, 1]), way[:, 2])
        x, good = newton(residual, guess, float(self.bends.pieces[last].sum()))
        made = Chain.of("yzyz", self.bends.pieces[last], start, frame, x)
        _, slope = residual(x)
        rates = _solve(slope, np.concatenate([self.swung.velocity, np.zeros((size, 1))], axis=1))
        place, side = made.drift(3, rates)
        seconds = _solve(slope, np.concatenate([self.swung.acceleration - place, -side[:, 2:]], axis=1))
        legs[:, :, last] = x, rates, seconds
        front[:, :, last] = x[:, 0], rates[:, 0], seconds[:, 0]
        rear[:, :, self.i] = _rise(made, 3, rates, seconds)
        return good, made.ends[:, 1:2, 2]

    def _middle(self, legs: Array, rear: Array, front: Array) -> tuple[BoolArray, Array]:
        size, i = len(self.tau), self.i
        start = np.repeat(flat(self.before.at[:, i - 1]), size, axis=0)
        frame = np.repeat(turned(self.before.heading[:, i - 1]), size, axis=0)
        target = np.repeat(flat(self.before.at[:, i + 1]), size, axis=0)
        wanted = np.repeat(turned(self.before.heading[:, i + 1]), size, axis=0)
        lengths = np.concatenate([self.bends.pieces[i - 1], self.bends.pieces[i]])

        def residual(x: Array) -> tuple[Array, Array]:
            made = Chain.of("yzyzyzyz", lengths, start, frame, x)
            value, slope = closure(made, 7, target, wanted)
            return (
                np.concatenate([made.ends[:, 3] - self.swung.place, value], axis=1),
                np.concatenate([made.place(3), slope], axis=1),
            )

        ways = self.swung.place - start, target - self.swung.place
        behind, ahead = (
            self._guess(leg, np.hypot(way[:, 0], way[:, 1]), way[:, 2])
            for leg, way in zip((i - 1, i), ways, strict=True)
        )
        ahead[:, 0] -= behind[:, 0] + behind[:, 2]
        x, good = newton(residual, np.concatenate([behind, ahead], axis=1), float(lengths.sum()))
        made = Chain.of("yzyzyzyz", lengths, start, frame, x)
        _, slope = residual(x)
        none = np.zeros((size, 5))
        rates = _solve(slope, np.concatenate([self.swung.velocity, none], axis=1))
        middle, _ = made.drift(3, rates)
        place, side = made.drift(7, rates)
        across = (side * wanted[:, :, 0]).sum(axis=1)
        bias = np.concatenate([self.swung.acceleration - middle, -place, -across[:, None], -side[:, 2:]], axis=1)
        seconds = _solve(slope, bias)
        legs[:, :, i - 1] = x[:, :4], rates[:, :4], seconds[:, :4]
        legs[:, :, i] = x[:, 4:], rates[:, 4:], seconds[:, 4:]
        front[:, :, i - 1] = x[:, 0], rates[:, 0], seconds[:, 0]
        # in the air the joint itself is an unknown
        rear[:, :, i], front[:, :, i] = 0.0, np.stack([x[:, 4], rates[:, 4], seconds[:, 4]])
        rear[:, :, i + 1] = _rise(made, 7, rates, seconds)
        return good, made.ends[:, [1, 5], 2]


def _rise(made: Chain, k: int, rates: Array, seconds: Array) -> Array:
    """(3, S): pitch of link ``k``, whose y axis stays level, and its derivatives."""
    spin, gain = made.spin(k, rates, seconds)
    y = made.turns[:, k, :, 1]
    return np.stack([rise_of(made.turns[:, k]), -(spin * y).sum(axis=1), -(gain * y).sum(axis=1)])


def _solve(slope: Array, wanted: Array) -> Array:
    return np.asarray(np.linalg.solve(slope, wanted[..., None])[..., 0])
