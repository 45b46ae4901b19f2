"""Moves of anchors, one after another, and the snake at any time in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.rectilinear.legs import REACH, Leg, leg, leg_rates
from bodyplan.gaits.rectilinear.swing import swing


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

    @classmethod
    def joined(cls, parts: Sequence[Moves]) -> Moves:
        """Moves of several tables, in order."""
        before, after, lift, early = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("before", "after", "lift", "early")
        )
        return cls(before, after, lift, early, tuple(name for part in parts for name in part.names))

    def state(self, links: Array, which: IntArray, tau: Array) -> State:
        """The snake with ``links`` (2 N - 2,) m at ``tau`` (...,) in [0, 1] of the moves ``which`` (...,)."""
        before, after = self.before[which], self.after[which]
        moved = swing(tau[..., None], after - before, self.lift[which], self.early[which])
        early = (tau < 0.5)[..., None]
        start, offset = (
            np.where(early[..., None], before, after),
            np.where(early[..., None], moved.risen, moved.landing),
        )
        anchors = start + offset
        a, b = links[0::2], links[1::2]
        from_chord, off = np.diff(start, axis=-2), np.diff(offset, axis=-2)
        chord = from_chord + off
        # S from the nearer end of the move: a leg that is straight there bends without loss of digits
        full = (a + b) ** 2
        at_end = full - np.sum(from_chord**2, axis=-1)
        at_end = np.where(np.abs(at_end) <= REACH * full, 0.0, at_end)
        short = at_end - np.sum(off * (2.0 * from_chord + off), axis=-1)
        legs = leg(a, b, chord[..., 0], chord[..., 1], short)
        speed, change = np.diff(moved.velocity, axis=-2), np.diff(moved.acceleration, axis=-2)
        rates = leg_rates(a, b, legs, _pair(chord), _pair(speed), _pair(change))
        return State(
            anchors,
            _serial(legs.rear, legs.front),
            _serial(rates.rear, rates.front),
            _serial(rates.rear_second, rates.front_second),
            legs,
        )


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


def _serial(rear: Array, front: Array) -> Array:
    return np.stack([rear, front], axis=-1).reshape(*rear.shape[:-1], -1)


def _pair(points: Array) -> tuple[Array, Array]:
    return points[..., 0], points[..., 1]
