"""The path of a lifted anchor: a cycloid over the ground, from rest to rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray

PATHS = ("cycloid",)
#: how long a step up that rises early waits before it goes along, as a share of what it is early by
WAIT = 0.6


class Swing(NamedTuple):
    """Anchors on their way: displacement from where they rose (``risen``) and from where they land (``landing``), and
    first and second derivatives by tau, all (..., 2) m along and up."""

    risen: Array
    landing: Array
    velocity: Array
    acceleration: Array


def swing(tau: Array, step: Array, lift: Array, early: Array) -> Swing:
    """Where anchors are at ``tau`` (...,) in [0, 1] of their move, for ``step`` (..., 2) m along and up.

    With u = 3 tau^2 - 2 tau^3 and X(u) = u - sin(2 pi u) / (2 pi) the path is step_x X(u) along and
    step_z B(u) + ``lift`` sin^2(pi u) up: a cycloid over level ground. With ``early`` < 1 a step up rises within that
    share of u and goes along in what is left of it, B = X(u / early) up to 1 and X((u - w) / (1 - w)) from w on, with
    w = WAIT (1 - early); a step down is its mirror image. Near its ends the path goes as tau^6 along and as tau^4 up,
    so that neither an anchor nor a level leg that begins straight jumps in rate or acceleration (a sloping one, which
    the lift bends as tau^2, jumps in acceleration).
    """
    tau, lift, early = (np.asarray(v, dtype=np.float64) for v in (tau, lift, early))
    u, rest = _smooth(tau), _smooth(1.0 - tau)  # rest = 1 - u, exact where it is small
    first, second = 6.0 * tau * (1.0 - tau), 6.0 - 12.0 * tau
    rising = np.asarray(step[..., 1] >= 0.0)
    rise, fall, rise1, rise2 = climb = _part(u, rest, 1.0 - early, rising)
    along, left, slope, curve = _part(u, rest, WAIT * (1.0 - early), ~rising) if np.any(early < 1.0) else climb
    # sin^2(pi u) = X'(u) / 2
    hump, hump1 = (0.5 * rate for rate in _cycloid_rates(u, rest))
    hump2 = 2.0 * np.pi**2 * np.cos(2.0 * np.pi * u)
    dx, dz = step[..., 0], step[..., 1]

    def by_tau(by_u: Array, by_u2: Array) -> tuple[Array, Array]:
        return by_u * first, by_u2 * first**2 + by_u * second

    vx, ax = by_tau(dx * slope, dx * curve)
    vz, az = by_tau(dz * rise1 + lift * hump1, dz * rise2 + lift * hump2)
    return Swing(
        np.stack([dx * along, dz * rise + lift * hump], axis=-1),
        np.stack([-dx * left, lift * hump - dz * fall], axis=-1),
        np.stack([vx, vz], axis=-1),
        np.stack([ax, az], axis=-1),
    )


def cycloid(u: Array) -> Array:
    """X(u) = u - sin(2 pi u) / (2 pi) with full relative precision also where it is small."""
    v = 2.0 * np.pi * u
    w = v * v
    # Taylor series of v - sin v: the last term kept is below 1e-17 of the first for v < 1
    series = np.ones_like(w)
    for k in (16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0):
        series = 1.0 - w / (k * (k + 1.0)) * series
    small = v * w / 6.0 * series
    return np.asarray(np.where(v < 1.0, small, v - np.sin(v)) / (2.0 * np.pi))


def _cycloid_rates(u: Array, rest: Array) -> tuple[Array, Array]:
    """X'(u) = 1 - cos(2 pi u) and X''(u), with full relative precision at both ends; ``rest`` = 1 - u."""
    near = np.minimum(u, rest)
    slope = 2.0 * np.sin(np.pi * near) ** 2
    return np.asarray(slope), np.asarray(np.where(u <= rest, 2.0, -2.0) * np.pi * np.sin(2.0 * np.pi * near))


def _smooth(tau: Array) -> Array:
    return np.asarray(tau * tau * (3.0 - 2.0 * tau))


def _part(u: Array, rest: Array, idle: Array, first: BoolArray) -> tuple[Array, Array, Array, Array]:
    """A cycloid over all of u but an ``idle`` share at its end (``first``) or else at its beginning, 1 less it, and its
    first two derivatives by u."""
    share = 1.0 - idle
    from_start = np.where(first, u, np.maximum(u - idle, 0.0)) / share
    to_end = np.where(first, np.maximum(rest - idle, 0.0), rest) / share
    from_start, to_end = np.minimum(from_start, 1.0), np.minimum(to_end, 1.0)
    slope, curve = _cycloid_rates(from_start, to_end)
    return cycloid(from_start), cycloid(to_end), slope / share, curve / share**2
