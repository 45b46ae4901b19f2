"""The joints of a motion as commands for motors: which joints, at which times, counted from the start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError
from bodyplan.motion import MOST_TIMES, Motion

#: which joints a file holds: those with an actuator, or all
CHOICES = ("actuated", "all")


@dataclass(frozen=True, eq=False)
class Sampled:
    """``t`` (K,) s from 0 on; ``q``, ``qd``, ``qdd`` (K, m) of the joints ``names``; their ``units``, "rad" or "m"."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    t: Array
    q: Array
    qd: Array
    qdd: Array

    @property
    def step(self) -> float | None:
        """The time in s between samples where it is the same everywhere but for rounding, or None."""
        step = float(self.t[-1]) / (len(self.t) - 1)
        even = np.abs(self.t - step * np.arange(len(self.t))).max() <= 1e-9 * step
        return step if even else None


def sampled(motion: Motion, rate: float | None = None, joints: str = "actuated") -> Sampled:
    """The motion's own samples, or, with a ``rate`` in 1/s, evenly spaced ones: both ends included, the step is the
    largest that is <= 1/rate and divides the duration.

    Between samples of the motion joints follow the polynomials of degree 5 that have its q, qd and qdd at both ends.
    ``joints``: "actuated" leaves out joints without an actuator, "all" does not. Raises InputError.
    """
    if joints not in CHOICES:
        raise InputError(f"joints: must be {' or '.join(CHOICES)}, got {joints!r}.")
    robot = motion.robot
    columns = np.flatnonzero(robot.actuated) if joints == "actuated" else np.arange(robot.n)
    if not len(columns):
        kind = "actuated joints" if robot.n else "joints"
        raise InputError(f"robot {robot.name!r}: has no {kind} to write a trajectory of.")
    t = motion.t - motion.t[0]
    q, qd, qdd = (getattr(motion, name)[:, columns] for name in ("q", "qd", "qdd"))
    if rate is not None:
        steps = float(t[-1]) * number(rate, "rate", above=0.0)
        if steps > MOST_TIMES:
            raise InputError(f"rate: {steps:.3g} samples are more than the {MOST_TIMES} allowed.")
        at = np.linspace(0.0, t[-1], max(1, int(np.ceil(steps * (1.0 - 1e-12)))) + 1)
        q, qd, qdd = between(t, q, qd, qdd, at)
        t = at
    names, units = zip(*((robot.joints[k], "rad" if robot.kinds[k] == "angle" else "m") for k in columns), strict=True)
    return Sampled(names, units, t, q, qd, qdd)


def between(t: Array, q: Array, qd: Array, qdd: Array, at: Array) -> tuple[Array, Array, Array]:
    """Values, rates and accelerations (K, m) at times ``at`` (K,) within ``t`` (T,) of the polynomials of degree 5
    between samples (T, m) that have their values, rates and accelerations."""
    i = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    h = (t[i + 1] - t[i])[:, None]
    u = (at - t[i])[:, None] / h
    # q = q0 + u h v0 + u^2 h^2 a0 / 2 + u^3 (c3 + c4 u + c5 u^2); the c's meet the other end
    v0, a0 = h * qd[i], h**2 * qdd[i]
    position = q[i + 1] - q[i] - v0 - 0.5 * a0
    speed = h * qd[i + 1] - v0 - a0
    bend = h**2 * qdd[i + 1] - a0
    c3 = 10.0 * position - 4.0 * speed + 0.5 * bend
    c4 = -15.0 * position + 7.0 * speed - bend
    c5 = 6.0 * position - 3.0 * speed + 0.5 * bend
    value = q[i] + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))))
    first = v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))
    second = a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))
    return value, first / h, second / h**2
