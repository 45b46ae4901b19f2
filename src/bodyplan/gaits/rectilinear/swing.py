"""The path of a lifted anchor: a cycloid over the ground, from rest to rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.kernels import lean

PATHS = ("cycloid",)
#: how long a step up that rises early waits before it goes along, as a share of what it is early by
WAIT = 0.6

#: X(u), X(1 - u) and sin^2(pi u), of which all swings that do not rise early are made
Even = tuple[float, float, float]


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
    given = np.broadcast_arrays(tau, step[..., 0], step[..., 1], lift, early)
    when, dx, dz, high, share = (np.array(v, dtype=np.float64) for v in given)
    out = np.empty((when.size, 8))
    _swings(when.ravel(), dx.ravel(), dz.ravel(), high.ravel(), share.ravel(), out)
    return Swing(*(out[:, k : k + 2].reshape(*when.shape, 2) for k in range(0, 8, 2)))


def cycloid(u: Array) -> Array:
    """X(u) = u - sin(2 pi u) / (2 pi) with full relative precision also where it is small."""
    at = np.array(u, dtype=np.float64)
    out = np.empty(at.size)
    _cycloids(at.ravel(), out)
    return out.reshape(at.shape)


@lean
def _swings(tau: Array, dx: Array, dz: Array, lift: Array, early: Array, out: Array) -> None:
    for k in range(len(tau)):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = swung(tau[k], even_at(tau[k]), dx[k], dz[k], lift[k], early[k])
        out[k, 4], out[k, 5], out[k, 6], out[k, 7] = swing_rates(tau[k], dx[k], dz[k], lift[k], early[k])


@lean
def _cycloids(u: Array, out: Array) -> None:
    for k in range(len(u)):
        out[k] = _cycloid(u[k])


@lean
def even_at(tau: float) -> Even:
    """What swings that rise evenly share at ``tau``."""
    u, rest = _smooth(tau), _smooth(1.0 - tau)  # rest = 1 - u, exact where it is small
    return _cycloid(u), _cycloid(rest), np.sin(np.pi * min(u, rest)) ** 2


@lean
def swung(tau: float, even: Even, dx: float, dz: float, lift: float, early: float) -> tuple[float, float, float, float]:
    """One anchor of :func:`swing`: ``risen`` and ``landing``, each along and up; ``even``: what swings share there."""
    rise, fall, hump = even
    along, left = rise, fall
    if early < 1.0:
        u, rest = _smooth(tau), _smooth(1.0 - tau)
        up, down = _parts(u, rest, 1.0 - early, dz >= 0.0)
        behind, ahead = _parts(u, rest, WAIT * (1.0 - early), dz < 0.0)
        rise, fall, along, left = _cycloid(up), _cycloid(down), _cycloid(behind), _cycloid(ahead)
    return dx * along, dz * rise + lift * hump, -dx * left, lift * hump - dz * fall


@lean
def swing_rates(tau: float, dx: float, dz: float, lift: float, early: float) -> tuple[float, float, float, float]:
    """One anchor of :func:`swing`: ``velocity`` and ``acceleration``, each along and up."""
    u, rest = _smooth(tau), _smooth(1.0 - tau)
    first, second = 6.0 * tau * (1.0 - tau), 6.0 - 12.0 * tau
    rise, rise2 = _part_rates(u, rest, 1.0 - early, dz >= 0.0)
    along, along2 = rise, rise2
    if early < 1.0:
        along, along2 = _part_rates(u, rest, WAIT * (1.0 - early), dz < 0.0)
    # sin^2(pi u) = X'(u) / 2
    hump, hump2 = 0.5 * _cycloid_rates(u, rest)[1], 2.0 * np.pi**2 * np.cos(2.0 * np.pi * u)
    up, up2 = dz * rise + lift * hump, dz * rise2 + lift * hump2
    return dx * along * first, up * first, dx * (along2 * first**2 + along * second), up2 * first**2 + up * second


@lean
def _smooth(tau: float) -> float:
    return tau * tau * (3.0 - 2.0 * tau)


@lean
def _cycloid(u: float) -> float:
    v = 2.0 * np.pi * u
    if v >= 1.0:
        return float((v - np.sin(v)) / (2.0 * np.pi))
    # Taylor series of v - sin v: the last term kept is below 1e-17 of the first for v < 1
    w, series = v * v, 1.0
    for k in (16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0):
        series = 1.0 - w / (k * (k + 1.0)) * series
    return v * w / 6.0 * series / (2.0 * np.pi)


@lean
def _cycloid_rates(u: float, rest: float) -> tuple[float, float]:
    """X'(u) = 1 - cos(2 pi u) and X''(u), with full relative precision at both ends; ``rest`` = 1 - u."""
    near = min(u, rest)
    turn = 2.0 * np.pi * np.sin(2.0 * np.pi * near)
    return 2.0 * np.sin(np.pi * near) ** 2, turn if u <= rest else -turn


@lean
def _parts(u: float, rest: float, idle: float, first: bool) -> tuple[float, float]:
    """How much of a cycloid is over, and how much is left, that takes all of u but an ``idle`` share at its end
    (``first``) or else at its beginning."""
    share = 1.0 - idle
    if first:
        return min(u / share, 1.0), min(max(rest - idle, 0.0) / share, 1.0)
    return min(max(u - idle, 0.0) / share, 1.0), min(rest / share, 1.0)


@lean
def _part_rates(u: float, rest: float, idle: float, first: bool) -> tuple[float, float]:
    """First two derivatives by u of the cycloid of :func:`_parts`."""
    over, left = _parts(u, rest, idle, first)
    slope, curve = _cycloid_rates(over, left)
    return slope / (1.0 - idle), curve / (1.0 - idle) ** 2
