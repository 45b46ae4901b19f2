"""How far along a curve a body is, and how fast: constant speed with a smooth start and stop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError


@dataclass(frozen=True)
class Pace:
    """Arc length ``sigma(t)`` m of the tail end: ``start`` at t = 0, then ``direction`` (1 or -1) times ``speed`` m/s.

    ``ramp`` s: the speed rises from 0 by the quintic smoothstep, so that sigma is C3; 0 starts at full speed.
    ``stop`` s: the body is at rest again from then on (the speed falls during the last ``ramp`` s); None goes on.
    """

    speed: float
    direction: int
    start: float
    ramp: float
    stop: float | None

    @classmethod
    def of(cls, speed: float, direction: int, start: float, ramp: float, stop: float | None) -> Pace:
        """A pace from options of a gait, InputError naming the one that is wrong."""
        if isinstance(direction, bool) or direction not in (1, -1):
            raise InputError(f"direction: must be 1 (head first) or -1 (tail first), got {direction!r}.")
        pace = cls(
            number(speed, "speed", above=0.0),
            int(direction),
            number(start, "start"),
            number(ramp, "ramp", at_least=0.0),
            None if stop is None else number(stop, "stop", above=0.0),
        )
        if pace.stop is not None and (pace.ramp == 0.0 or pace.stop < 2.0 * pace.ramp):
            raise InputError(
                f"stop: a smooth stop needs ramp > 0 and stop >= 2 ramp, got stop={stop!r} with ramp={ramp!r}."
            )
        return pace

    @property
    def steady(self) -> bool:
        """True where the speed never changes."""
        return self.ramp == 0.0

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """sigma (m) and its first and second derivatives by time, at t (...,) s."""
        distance, speed, acceleration = _rise(np.asarray(t, dtype=np.float64), self.ramp)
        if self.stop is not None:
            fall = _rise(np.asarray(t, dtype=np.float64) - (self.stop - self.ramp), self.ramp)
            distance, speed, acceleration = distance - fall[0], speed - fall[1], acceleration - fall[2]
        scale = self.direction * self.speed
        return self.start + scale * distance, scale * speed, scale * acceleration


def _rise(t: Array, ramp: float) -> tuple[Array, Array, Array]:
    """Time at full speed that makes the same distance (s), share of the speed, and its rate (1/s)."""
    if ramp == 0.0:
        return t, np.ones_like(t), np.zeros_like(t)
    x = np.clip(t, 0.0, ramp) / ramp
    distance = ramp * x**4 * (2.5 + x * (x - 3.0)) + np.maximum(t - ramp, 0.0)
    return distance, x**3 * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x**2 * (1.0 - x) ** 2 / ramp
