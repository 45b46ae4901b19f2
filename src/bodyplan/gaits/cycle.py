"""A repeating cycle of extension sweeps in time: several waves, a time warp, and the anchored end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.gaits.clock import Clock, constant_rate_pace
from bodyplan.gaits.rate_table import RateTable, rate_table
from bodyplan.gaits.sweep import Sweep, Window

#: even nodes of the table behind the time warp, per sweep
TABLE = 1200
#: cells of it that are narrower, as a share of the cycle, are none
NARROWEST = 1e-11
#: share of a sweep by which its warp is slow before and after a place that asks for it
AHEAD = 1.0 / 4800.0
#: what the largest joint rate may be above the largest one found
PEAK_MARGIN = 1.008
#: knots per unit of progress of the rounded angles of a smooth blend
ROUNDING = 24
#: share of the mean joint speed that softens the warp where the body stands still for an instant
SOFTENING = {"linear": 1e-3, "smooth": 0.3}


@dataclass(frozen=True)
class CycleState:
    """Angles (S, n) absolute with rates and accelerations in time; ``tail`` (S, 2) place of the tail end, curve
    units; ``number`` (S,) of the cycle; ``u`` (S,) position of the front wave in its sweep."""

    angles: Array
    rates: Array
    accelerations: Array
    tail: Array
    number: Array
    u: Array


class ExtensionCycle:
    """``waves`` sweeps in flight, each 1/waves of a sweep's time behind the next; the cycle repeats after ``period`` s.

    Until the rearmost wave lands the tail end is anchored, from then on the head end. ``lengths`` (n,) of the links
    in curve units. ``warp``: run so that the largest joint rate is constant (a single sweep first, which sets how waves
    are spaced; then their sum); else evenly through u. ``duration`` s of a whole sweep, or ``max_joint_rate`` rad/s,
    which then sets it. ``blend`` "smooth" rounds the angles to a C2 spline, so that accelerations are finite.

    Position p in [0, span] of the cycle: the front wave is at p of its sweep's own clock, which runs to 2 T.
    """

    def __init__(
        self,
        sweep: Sweep,
        lengths: Array,
        waves: int,
        duration: float,
        max_joint_rate: float | None,
        warp: bool,
        blend: str,
    ) -> None:
        self.sweep, self.lengths, self.waves, self.blend = sweep, lengths, waves, blend
        self.whole = 2.0 * sweep.total
        self._contracted = sweep.at(np.array([-sweep.total]))[0][0]
        self.span = self.whole / waves
        plain = Clock(np.array([0.0, self.whole]), np.ones(2), self.whole)
        self._sweep_clock = plain
        self._rounded: Callable[..., Any] | None = None
        if warp and waves > 1:
            self._sweep_clock = self._warped(1, self.whole)
        landing = self.whole - float(self._place(sweep.landing_start))
        launching = float(self._place(sweep.launch_end))
        if waves > 1 and landing + launching > self.span * (1.0 + 1e-12):
            raise InputError(
                f"waves: {waves} waves of this extension would launch before the last has landed; use a smaller "
                "extension or fewer waves."
            )
        if blend == "smooth":
            self._rounded = self._round()
        #: the head is anchored from here on
        self.switch = self.span - landing
        self.clock = Clock(np.array([0.0, self.span]), np.ones(2), duration / waves)
        if warp:
            self.clock = self._warped(waves, duration / waves)
        #: largest joint rate found in looking for it, rad/s; None where no limit asks for it
        self.peak_rate: float | None = None
        if max_joint_rate is not None:
            found, before = self._peak_rate(), self.clock.period
            self.clock = self.clock.scaled(before * found * PEAK_MARGIN / max_joint_rate)
            self.peak_rate = found * before / self.clock.period
        self.period = self.clock.period
        ends = self._shape(np.array([0.0, self.switch, self.span]))[0]
        reach = np.stack([(lengths * np.cos(ends)).sum(axis=1), (lengths * np.sin(ends)).sum(axis=1)], axis=1)
        self._head_at_switch = reach[1]
        self.advance = reach[1] - reach[2]

    def _place(self, u: ArrayLike) -> Array:
        """Positions of any u on the sweep's own clock, in [0, 2 T]."""
        return self._sweep_clock.time(np.asarray(u) + self.sweep.total)

    @cached_property
    def _table(self) -> RateTable:
        return rate_table(self.sweep)

    def _nodes(self, waves: int) -> Array:
        """Even positions of a cycle of some waves, and the places between which its rates are smooth: the nodes of the
        sweep's table, for a smooth blend the bounds of stages, of every wave."""
        span = self.whole / waves
        if self.blend == "linear":
            marks = self._table.nodes
        else:
            edges = [edge for w in self.sweep.windows for edge in (w.start, w.end)]
            marks = np.array([*edges, self.sweep.launch_end, self.sweep.landing_start])
        places = self._place(marks)
        if waves > 1:  # between the nodes of their clock, waves run smoothly
            places = np.concatenate([places, self._sweep_clock.times])
        folded = np.concatenate([places - k * span for k in range(waves)])
        folded = folded[(folded > 0.0) & (folded < span)]
        nodes = np.unique(np.concatenate([np.linspace(0.0, span, max(TABLE // waves, 200)), folded]))
        nodes = nodes[np.concatenate([[True], np.diff(nodes) > NARROWEST * span])]
        nodes[-1] = span
        return np.asarray(nodes)

    def _of_waves(self, position: Array, waves: int) -> tuple[Array, Array]:
        """u (W, S) of some waves at positions (S,), and its derivative."""
        of_waves = position + self.whole / waves * np.arange(waves)[:, None]
        u, speed, _ = self._sweep_clock.position(np.minimum(of_waves, self.whole))
        return u - self.sweep.total, speed

    def _speeds(self, position: Array, waves: int, sides: bool = False) -> Array:
        """Largest joint speed by position (S,), ascending, of a cycle of some waves; ``sides`` as in the table."""
        if self._rounded is not None:
            return np.asarray(np.abs(np.diff(self._rounded(position, 1), axis=1)).max(axis=1))
        return self._table.largest(*self._of_waves(position, waves), sides)

    def _warped(self, waves: int, period: float) -> Clock:
        nodes, jumps = self._nodes(waves), None
        if self.blend == "linear":
            u = self._of_waves(0.5 * (nodes[1:] + nodes[:-1]), waves)[0]
            jumps = np.asarray(self._table.jumps(u).any(axis=0))
        speeds = self._speeds(nodes, waves)
        return Clock(nodes, constant_rate_pace(nodes, speeds, SOFTENING[self.blend], jumps, AHEAD * self.whole), period)

    def _one(self, position: Array) -> tuple[Array, Array, Array]:
        """Angles of one wave and their derivatives by position on the sweep's clock."""
        u, p1, p2 = self._sweep_clock.position(position)
        angles, first, second = self.sweep.at(u - self.sweep.total)
        p1, p2 = p1[:, None], p2[:, None]
        return angles, first * p1, second * p1**2 + first * p2

    def _sum(self, position: Array) -> tuple[Array, Array, Array]:
        """Angles on the curves themselves: waves add as differences from the contracted body."""
        if self.waves == 1:
            return self._one(position)
        # one ascending run through all waves: each place of a sweep is found from the one before
        of_waves = position + self.span * np.arange(self.waves)[:, None]
        shape = self._one(np.minimum(of_waves, self.whole).ravel())
        angles, first, second = (x.reshape(self.waves, len(position), -1).sum(axis=0) for x in shape)
        return angles - (self.waves - 1) * self._contracted, first, second

    def _shape(self, position: Array) -> tuple[Array, Array, Array]:
        """Angles and derivatives by position in [0, span], ascending."""
        if self._rounded is None:
            return self._sum(position)
        return self._rounded(position), self._rounded(position, 1), self._rounded(position, 2)

    def _round(self) -> Callable[..., Any]:
        """The C2 periodic spline through the exact angles at ROUNDING knots a unit of progress: joints that pass a kink
        of the curve (where its modules and its flat part meet) would jump in rate however smoothly gamma changes."""
        from scipy.interpolate import CubicSpline

        knots = np.linspace(0.0, self.span, max(16, round(ROUNDING * self.span)) + 1)
        angles = self._sum(knots)[0]
        angles[-1] = angles[0]
        return CubicSpline(knots, angles, bc_type="periodic")

    def _peak_rate(self) -> float:
        """Largest joint rate at the nodes of the cycle and between them, and once more in the cells where it is
        largest; PEAK_MARGIN is for what this may be off."""

        def largest(begin: Array, width: Array, parts: Array) -> Array:
            position = (begin[:, None] + width[:, None] * parts).ravel()
            speeds = self._speeds(position, self.waves, sides=True)
            return np.asarray((speeds * self.clock.speed(position)).reshape(-1, parts.size).max(axis=1))

        nodes = self._nodes(self.waves)
        begin, width = nodes[:-1], np.diff(nodes)
        found = largest(begin, width, np.array([1e-3, 0.5, 1.0 - 1e-3]))
        cells = np.sort(np.argsort(found)[-8:])
        return float(max(found.max(), largest(begin[cells], width[cells], np.linspace(0.0, 1.0, 41)).max()))

    def time_of(self, position: float) -> float:
        """Time in [0, period] at which the cycle is at a position in [0, span]."""
        return float(self.clock.time(position))

    def state(self, t: Array) -> CycleState:
        """The body at times t (S,) s, ascending, t >= 0."""
        number = np.floor(t / self.period * (1.0 + 1e-15) + 1e-12)
        local = np.clip(t - number * self.period, 0.0, self.period)
        position, p1, p2 = self.clock.position(local)
        order = np.argsort(position, kind="stable")
        angles, first, second = (np.empty((len(t), len(self.lengths))) for _ in range(3))
        angles[order], first[order], second[order] = self._shape(position[order])
        rates = first * p1[:, None]
        accelerations = second * (p1**2)[:, None] + first * p2[:, None]
        reach = np.stack(
            [(self.lengths * np.cos(angles)).sum(axis=1), (self.lengths * np.sin(angles)).sum(axis=1)], axis=1
        )
        headed = (position > self.switch)[:, None]
        tail = number[:, None] * self.advance + np.where(headed, self._head_at_switch - reach, 0.0)
        u = self._sweep_clock.position(position)[0] - self.sweep.total
        return CycleState(angles, rates, accelerations, tail, number, u)

    def windows(self, stages: Sequence[Window] | None = None) -> list[tuple[Window, int, float, float]]:
        """Every stage of every wave inside one cycle: (window, wave counted from the front, start, end) in s;
        ``stages`` of the sweep (default: all)."""
        listed = self.sweep.windows if stages is None else stages
        bounds = self._place([(w.start, w.end) for w in listed]).reshape(len(listed), 2)
        out = []
        for k in range(self.waves):
            inside = np.clip(bounds - k * self.span, 0.0, self.span)
            for w, (a, b) in zip(listed, self.clock.time(inside).tolist(), strict=True):
                if b > a:
                    out.append((w, k, a, b))
        return sorted(out, key=lambda item: (item[2], item[1]))
