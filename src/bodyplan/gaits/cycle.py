"""A repeating cycle of extension sweeps in time: several waves, a time warp, and the anchored end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.gaits.sweep import Sweep, Window

#: even nodes of the table behind the time warp, per sweep
TABLE = 1200
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
    """``waves`` sweeps in flight, each 1/waves of a sweep behind the next; the cycle repeats after ``period`` s.

    Until the rearmost wave lands the tail end is anchored, from then on the head end. ``lengths`` (n,) of the links
    in curve units. ``warp``: run through the sweep so that the largest joint rate is constant; else evenly.
    ``duration`` s of a whole sweep, or ``max_joint_rate`` rad/s, which then sets it.
    ``blend`` says how smooth the sweep is itself.
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
        self.sweep, self.lengths, self.waves = sweep, lengths, waves
        self.span = 2.0 * sweep.total / waves
        landing = sweep.total - sweep.landing_start
        launching = sweep.launch_end + sweep.total
        if waves > 1 and landing + launching > self.span * (1.0 + 1e-12):
            raise InputError(
                f"waves: {waves} waves of this extension would launch before the last has landed; use a smaller "
                "extension or fewer waves."
            )
        #: the head is anchored from here on
        self.switch = self.span - landing
        self.nodes = self._nodes()
        speeds = np.abs(np.diff(self._shape(self.nodes)[1], axis=1)).max(axis=1)
        peak = float(speeds.max())
        if warp:
            mean = float(np.trapezoid(speeds, self.nodes) / self.span)
            softened = np.hypot(speeds, SOFTENING[blend] * mean)
            clock = np.concatenate([[0.0], np.cumsum(0.5 * (softened[1:] + softened[:-1]) * np.diff(self.nodes))])
            # largest of (joint speed by u) * (du/dt), in units where the clock is unscaled
            peak = float((speeds / softened).max())
        else:
            clock = self.nodes.copy()
        natural = clock[-1]
        self.period = natural * peak / max_joint_rate if max_joint_rate is not None else duration / waves
        self._clock = clock * (self.period / natural)
        self._warped = warp
        self._position = self._interpolant() if warp else None
        if warp and max_joint_rate is not None:
            self._rescale(max_joint_rate)
        ends = self._shape(np.array([0.0, self.switch, self.span]))[0]
        reach = np.stack([(lengths * np.cos(ends)).sum(axis=1), (lengths * np.sin(ends)).sum(axis=1)], axis=1)
        self._head_at_switch = reach[1]
        self.advance = reach[1] - reach[2]

    def _nodes(self) -> Array:
        """Even nodes, and a pair around every u at which a stage of some wave begins or ends."""
        edges = np.array([edge for w in self.sweep.windows for edge in (w.start, w.end)])
        edges = np.concatenate([edges, [self.sweep.launch_end, self.sweep.landing_start]]) + self.sweep.total
        folded = np.concatenate([edges - k * self.span for k in range(self.waves)])
        folded = folded[(folded > 0.0) & (folded < self.span)]
        tiny = 1e-9 * self.span
        even = np.linspace(0.0, self.span, max(TABLE // self.waves, 200))
        nodes = np.unique(np.concatenate([even, folded - tiny, folded, folded + tiny]))
        keep = np.concatenate([[True], np.diff(nodes) > 0.5 * tiny])
        nodes = nodes[keep]
        nodes[-1] = self.span
        return np.asarray(nodes)

    def _shape(self, position: Array) -> tuple[Array, Array, Array]:
        """Angles and derivatives by position in [0, span], ascending: waves add as differences from the contracted
        body."""
        total = self.sweep.total
        contracted = self.sweep.at(np.array([-total]))[0]
        angles = np.broadcast_to(contracted, (len(position), len(self.lengths))).copy()
        first, second = np.zeros_like(angles), np.zeros_like(angles)
        for k in range(self.waves):
            a, b, c = self.sweep.at(np.minimum(position + (k * self.span - total), total))
            angles += a - contracted
            first += b
            second += c
        return angles, first, second

    def _interpolant(self) -> Callable[..., Any]:
        from scipy.interpolate import PchipInterpolator

        # some nodes of the neighbouring cycles, so that the speed is continuous across the seam
        clock, nodes = self._clock, self.nodes
        ends = slice(-12, -1), slice(1, 12)
        around = np.concatenate([clock[ends[0]] - self.period, clock, clock[ends[1]] + self.period])
        values = np.concatenate([nodes[ends[0]] - self.span, nodes, nodes[ends[1]] + self.span])
        return PchipInterpolator(around, values)  # type: ignore[no-any-return]

    def _rescale(self, max_joint_rate: float) -> None:
        """Make the largest joint rate of the interpolated warp the wanted one."""
        fine = np.linspace(0.0, self.period, 4 * TABLE + 1)
        at = np.concatenate([fine, self._clock])
        at.sort()
        rates = self.state(at[at < self.period], advance=False).rates
        factor = float(np.abs(np.diff(rates, axis=1)).max()) / max_joint_rate
        self.period *= factor
        self._clock = self._clock * factor
        self._position = self._interpolant()

    def time_of(self, position: float) -> float:
        """Time in [0, period] at which the cycle is at a position in [0, span]."""
        return float(np.interp(position, self.nodes, self._clock))

    def state(self, t: Array, advance: bool = True) -> CycleState:
        """The body at times t (S,) s, ascending, t >= 0."""
        number = np.floor(t / self.period * (1.0 + 1e-15) + 1e-12)
        local = np.clip(t - number * self.period, 0.0, self.period)
        if self._position is None:
            speed = self.span / self.period
            position, p1, p2 = local * speed, np.full(len(t), speed), np.zeros(len(t))
        else:
            position = np.clip(self._position(local), 0.0, self.span)
            p1, p2 = self._position(local, 1), self._position(local, 2)
        order = np.argsort(position, kind="stable")
        angles, first, second = (np.empty((len(t), len(self.lengths))) for _ in range(3))
        angles[order], first[order], second[order] = self._shape(position[order])
        rates = first * p1[:, None]
        accelerations = second * (p1**2)[:, None] + first * p2[:, None]
        tail = np.zeros((len(t), 2))
        if advance:
            reach = np.stack([(self.lengths * np.cos(angles)).sum(axis=1),
                              (self.lengths * np.sin(angles)).sum(axis=1)], axis=1)
            tail = number[:, None] * self.advance + np.where(
                (position > self.switch)[:, None], self._head_at_switch - reach, 0.0
            )
        return CycleState(angles, rates, accelerations, tail, number, position - self.sweep.total)

    def windows(self) -> list[tuple[Window, int, float, float]]:
        """Every stage of every wave inside one cycle: (window, wave counted from the front, start, end) in s."""
        out = []
        for k in range(self.waves):
            shift = k * self.span - self.sweep.total  # u of wave k at position 0
            for w in self.sweep.windows:
                a, b = max(w.start - shift, 0.0), min(w.end - shift, self.span)
                if b > a:
                    out.append((w, k, self.time_of(a), self.time_of(b)))
        return sorted(out, key=lambda item: (item[2], item[1]))
