"""A time warp: how fast to run through a path so that its fastest joint keeps a constant rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray


class Clock:
    """Monotone map between time in [0, period] and position in [0, nodes[-1]], exact both ways.

    ``pace`` > 0 (K,) is time per unit of position at the ``nodes`` (K,) (up to scale, which ``period`` sets) and linear
    in between: time is quadratic in position there, and its inverse has a closed form with continuous speed.
    """

    def __init__(self, nodes: Array, pace: Array, period: float) -> None:
        steps = 0.5 * (pace[1:] + pace[:-1]) * np.diff(nodes)
        self.nodes, self.period = nodes, period
        self.pace = pace * (period / steps.sum())
        self.times = np.concatenate([[0.0], np.cumsum(steps * (period / steps.sum()))])

    def scaled(self, period: float) -> Clock:
        """The same warp over another period."""
        return Clock(self.nodes, self.pace, period)

    def position(self, time: Array) -> tuple[Array, Array, Array]:
        """Position at times in [0, period], with its first and second derivative."""
        cell = np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.nodes) - 2)
        begin, pace = time - self.times[cell], self.pace[cell]
        change = (self.pace[cell + 1] - pace) / (self.nodes[cell + 1] - self.nodes[cell])
        step = 2.0 * begin / (pace + np.sqrt(np.maximum(pace * pace + 2.0 * change * begin, 0.0)))
        speed = 1.0 / (pace + change * step)
        return np.clip(self.nodes[cell] + step, 0.0, self.nodes[-1]), speed, -change * speed**3

    def time(self, position: ArrayLike) -> Array:
        """Time in [0, period] at positions, any shape."""
        at = np.asarray(position, dtype=np.float64)
        cell = np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, len(self.nodes) - 2)
        step = at - self.nodes[cell]
        change = (self.pace[cell + 1] - self.pace[cell]) / (self.nodes[cell + 1] - self.nodes[cell])
        return np.asarray(self.times[cell] + step * (self.pace[cell] + 0.5 * change * step))

    def speed(self, position: Array) -> Array:
        """Position's first derivative by time, at positions (S,)."""
        return np.asarray(1.0 / np.interp(position, self.nodes, self.pace))


def constant_rate_pace(
    nodes: Array, speeds: Array, softening: float, jumps: BoolArray | None = None, ahead: float = 0.0
) -> Array:
    """Pace at which the largest speed by position, ``speeds`` (K,) at the ``nodes``, becomes a constant rate.

    ``softening``: share of the mean speed that keeps the pace above 0 where the path stands still for an instant. The
    path is periodic. ``jumps`` (K - 1,): the cells inside of which speeds may jump anywhere, all others being smooth;
    the pace is the same all along them, and otherwise slow by ``ahead`` (position) before and after what asks for it.
    Where jumps are not known (None), it is already slow at the node before and still slow at the one after, so that
    nothing overshoots between two nodes.
    """
    if jumps is None:
        around = np.concatenate([speeds[-2:-1], speeds, speeds[1:2]])
        slow = np.maximum(np.maximum(around[:-2], around[1:-1]), around[2:])
    else:
        before, after = (np.interp((nodes + h) % nodes[-1], nodes, speeds) for h in (-ahead, ahead))
        slow = np.maximum(np.maximum(before, after), speeds)
        begins = np.flatnonzero(np.concatenate([[True], ~jumps]))
        slow = np.repeat(np.maximum.reduceat(slow, begins), np.diff(np.append(begins, len(nodes))))
    mean = float(np.trapezoid(speeds, nodes) / (nodes[-1] - nodes[0]))
    return np.asarray(np.hypot(slow, softening * mean))
