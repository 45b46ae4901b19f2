"""Moves of anchors, one after another, and the snake at any time in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.rectilinear.legs import REACH, Leg, leg_angles, leg_rates
from bodyplan.gaits.rectilinear.swing import Even, even_at, swing_rates, swung
from bodyplan.kernels import inlined, lean


@dataclass(frozen=True, eq=False)
class Moves:
    """M moves of N anchors: ``before`` and ``after`` (M, N, 2) m along and up, ``lift`` (M, N) m and ``early`` (M, N)
    of :func:`swing`. Anchors that do not move have equal places before and after and no lift. ``names`` (M,)."""

    before: Array
    after: Array
    lift: Array
    early: Array
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)

    @property
    def moving(self) -> BoolArray:
        """(M, N) True for the anchors that move."""
        return np.asarray(np.any(self.after != self.before, axis=-1))

    @property
    def swinging(self) -> BoolArray:
        """(M, N) True for those that are lifted on their way and carry nothing."""
        return np.asarray(self.moving & (self.lift > 0.0))

    @property
    def tables(self) -> tuple[Array, Array, Array, Array]:
        """``before``, ``after``, ``lift`` and ``early`` for kernels."""
        return tuple(
            np.ascontiguousarray(v, dtype=np.float64) for v in (self.before, self.after, self.lift, self.early)
        )  # type: ignore[return-value]

    @classmethod
    def joined(cls, parts: Sequence[Moves]) -> Moves:
        """Moves of several tables, in order."""
        before, after, lift, early = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("before", "after", "lift", "early")
        )
        return cls(before, after, lift, early, tuple(name for part in parts for name in part.names))

    def state(self, links: Array, which: IntArray, tau: Array) -> State:
        """The snake with ``links`` (2 N - 2,) m at ``tau`` (...,) in [0, 1] of the moves ``which`` (...,)."""
        which, tau = (np.array(v) for v in np.broadcast_arrays(which, tau))
        shape, size, count = tau.shape, tau.size, self.before.shape[1]
        anchors, angles = np.empty((size, count, 2)), np.empty((3, size, 2 * count - 2))
        legs = np.empty((3, size, count - 1))
        _states(*self.tables, np.ascontiguousarray(links), which.ravel(), tau.ravel(), anchors, angles, legs)
        angles, (bend, short, folded) = angles.reshape(3, *shape, -1), legs.reshape(3, *shape, -1)
        found = Leg(angles[0, ..., 0::2], angles[0, ..., 1::2], bend, short, folded)
        return State(anchors.reshape(*shape, count, 2), angles[0], angles[1], angles[2], found)


@inlined
def swing_of(
    before: Array, after: Array, lift: Array, early: Array, m: int, tau: float, even: Even, start: Array, offset: Array
) -> None:
    """Anchors of move ``m`` at ``tau``: ``start`` (N, 2) m, where they are at the nearer end of the move, and their
    ``offset`` (N, 2) m from there; ``even`` as :func:`even_at` has it there."""
    for i in range(before.shape[1]):
        swing_one(before, after, lift, early, m, i, tau, even, start, offset)


@inlined
def swing_one(
    before: Array, after: Array, lift: Array, early: Array, m: int, i: int, tau: float, even: Even, start: Array,
    offset: Array,
) -> None:  # fmt: skip
    """:func:`swing_of` for anchor ``i``."""
    dx, dz = after[m, i, 0] - before[m, i, 0], after[m, i, 1] - before[m, i, 1]
    start[i, 0] = before[m, i, 0] if tau < 0.5 else after[m, i, 0]
    start[i, 1] = before[m, i, 1] if tau < 0.5 else after[m, i, 1]
    offset[i, 0] = offset[i, 1] = 0.0
    if dx != 0.0 or dz != 0.0 or lift[m, i] != 0.0:
        risen_x, risen_z, left_x, left_z = swung(tau, even, dx, dz, lift[m, i], early[m, i])
        offset[i, 0] = risen_x if tau < 0.5 else left_x
        offset[i, 1] = risen_z if tau < 0.5 else left_z


@lean
def chord_of(start: Array, offset: Array, i: int, full: float) -> tuple[float, float, float]:
    """Chord of leg ``i`` along and up, m, and its S = ``full`` - L^2: from the nearer end of the move, so that a leg
    that is straight there bends without loss of digits."""
    fx, fz = start[i + 1, 0] - start[i, 0], start[i + 1, 1] - start[i, 1]
    ox, oz = offset[i + 1, 0] - offset[i, 0], offset[i + 1, 1] - offset[i, 1]
    at_end = full - (fx * fx + fz * fz)
    if abs(at_end) <= REACH * full:
        at_end = 0.0
    return fx + ox, fz + oz, at_end - (ox * (2.0 * fx + ox) + oz * (2.0 * fz + oz))


@njit(cache=True)
def _states(
    before: Array,
    after: Array,
    lift: Array,
    early: Array,
    links: Array,
    which: IntArray,
    tau: Array,
    anchors: Array,
    angles: Array,
    legs: Array,
) -> None:
    """``anchors`` (S, N, 2), ``angles`` and their derivatives (3, S, 2 N - 2), bend, S and C of the ``legs``
    (3, S, N - 1) at ``tau`` (S,) of the moves ``which`` (S,)."""
    count = before.shape[1]
    start, offset, rates = np.empty((count, 2)), np.empty((count, 2)), np.zeros((count, 4))
    for s in range(len(tau)):
        m = which[s]
        swing_of(before, after, lift, early, m, tau[s], even_at(tau[s]), start, offset)
        for i in range(count):
            anchors[s, i] = start[i] + offset[i]
            dx, dz = after[m, i, 0] - before[m, i, 0], after[m, i, 1] - before[m, i, 1]
            rates[i] = 0.0
            if dx != 0.0 or dz != 0.0 or lift[m, i] != 0.0:
                rates[i, 0], rates[i, 1], rates[i, 2], rates[i, 3] = swing_rates(
                    tau[s], dx, dz, lift[m, i], early[m, i]
                )
        for i in range(count - 1):
            a, b = links[2 * i], links[2 * i + 1]
            x, z, short = chord_of(start, offset, i, (a + b) ** 2)
            rear, front, bend, folded = leg_angles(a, b, x, z, short)
            change = rates[i + 1] - rates[i]
            rear1, front1, rear2, front2 = leg_rates(
                a, b, short, folded, (x, z), (change[0], change[1]), (change[2], change[3])
            )
            angles[0, s, 2 * i], angles[0, s, 2 * i + 1] = rear, front
            angles[1, s, 2 * i], angles[1, s, 2 * i + 1] = rear1, front1
            angles[2, s, 2 * i], angles[2, s, 2 * i + 1] = rear2, front2
            legs[0, s, i], legs[1, s, i], legs[2, s, i] = bend, short, folded


class State(NamedTuple):
    """``anchors`` (..., N, 2) m along and up; absolute ``angles`` (..., 2 N - 2) rad of the links, nose-up, and their
    first and second derivatives by tau; the ``legs``."""

    anchors: Array
    angles: Array
    first: Array
    second: Array
    legs: Leg

    def elbows(self, links: Array) -> Array:
        """(..., N - 1, 2) m."""
        rear = self.angles[..., 0::2]
        step = links[0::2, None] * np.stack([np.cos(rear), np.sin(rear)], axis=-1)
        return np.asarray(self.anchors[..., :-1, :] + step)

    def points(self, links: Array) -> Array:
        """(..., 2 N - 1, 2) m: all pitch joints."""
        elbows = self.elbows(links)
        out = np.empty((*elbows.shape[:-2], 2 * elbows.shape[-2] + 1, 2))
        out[..., 0::2, :], out[..., 1::2, :] = self.anchors, elbows
        return out


def bends(angles: Array) -> Array:
    """Joints (..., 2 N - 1), nose-up, between a level tail link, links of absolute ``angles`` (..., 2 N - 2) and a
    level head link; the same for their derivatives."""
    level = np.zeros((*angles.shape[:-1], 1))
    return np.diff(np.concatenate([level, angles, level], axis=-1), axis=-1)
