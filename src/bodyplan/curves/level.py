"""The constant pitch that keeps a sinus-lifting curve level (paper *acm*, eq. (37), made exact).

With x = 2 pi s / wavelength the frame turns by p = c1 - c0 cos 2x about e_p and y = alpha sin x about e_y per rad.
Half a wavelength from x = 0 turns it by H, and, p being even and y odd about x = 0 and both even about pi / 2, H has
its axis in (e_p, e_y): quaternion (w, 0, g, z). The other half turns it by H with z reversed, so that the whole
wavelength is no turn where g = 0 (then H is pure yaw): one equation for c1.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.spatial.frames import GAUSS_NODES, frames_from_nodes

#: smallest step of the lift, as a part of it, with which the root is followed
SMALLEST = 1e-4
#: step of c0 and c1 for slopes of g
STEP = 1e-5


@lru_cache(maxsize=256)
def level_pitch(alpha: float, lift: float) -> float:
    """c1 that keeps the curve level, to rounding: the root of g that starts at 0 for no lift and moves with it.

    Raises InputError where the root ends, moves off, or meets another one on the way.
    """
    steps = _steps(alpha, lift)
    done, c1, part = 0.0, 0.0, 0.125
    slope = _slopes(alpha, 0.0, 0.0, steps)[1]
    if slope == 0.0:
        raise _none(alpha, lift)
    while done < 1.0:
        if part < SMALLEST:
            raise _none(alpha, lift)
        part = min(part, 1.0 - done)
        _, by_pitch, by_lift = _slopes(alpha, done * lift, c1, steps)
        guess = c1 - by_lift / by_pitch * part * lift
        found = _corrected(alpha, (done + part) * lift, guess, steps) if abs(guess - c1) < 0.5 else None
        # another root, or a turning point, would show as a far correction or as a slope that changes its sign
        if found is None or found[1] * slope <= 0.0 or abs(found[0] - guess) > 0.1 * abs(guess - c1) + 1e-9:
            part *= 0.5
            continue
        done, c1 = done + part, found[0]
        part *= 2.0
    return c1


def _corrected(alpha: float, lift: float, c1: float, steps: int) -> tuple[float, float] | None:
    """Root (c1, slope of g there) by Newton's method from a guess; None where it does not settle."""
    size = np.inf
    for _ in range(12):
        g, by_pitch, _ = _slopes(alpha, lift, c1, steps)
        if by_pitch == 0.0:
            return None
        change = g / by_pitch
        if abs(change) > 0.5:
            return None
        c1 -= change
        if abs(change) < 4e-16 * (1.0 + abs(c1)) or (size < 1e-12 and abs(change) >= size):
            return c1, by_pitch
        size = abs(change)
    return (c1, by_pitch) if size < 1e-12 else None


def _slopes(alpha: float, lift: float, c1: float, steps: int) -> tuple[float, float, float]:
    """g and its derivatives with respect to c1 and c0."""
    lifts = lift + np.array([0.0, 0.0, 0.0, STEP, -STEP])
    pitches = c1 + np.array([0.0, STEP, -STEP, 0.0, 0.0])
    g = half_wave_pitch(alpha, lifts, pitches, steps)
    return float(g[0]), float(g[1] - g[2]) / (2.0 * STEP), float(g[3] - g[4]) / (2.0 * STEP)


def half_wave_pitch(alpha: float, lift: Array, c1: Array, steps: int) -> Array:
    """g (B,): the e_p component of the quaternion of half a wavelength, for B curves; 0 where the curve is level."""
    x = (np.arange(steps)[:, None] + np.array(GAUSS_NODES)) * (np.pi / steps)
    u = np.zeros((len(lift), steps, 3, 3))
    u[..., 1] = c1[:, None, None] - lift[:, None, None] * np.cos(2.0 * x)
    u[..., 2] = alpha * np.sin(x)
    return np.asarray(frames_from_nodes(u, np.full(steps, np.pi / steps))[:, -1, 5])


def _steps(alpha: float, lift: float) -> int:
    """Steps of order 6 over half a wavelength: rounding is all that is left."""
    rate = 2.0 + abs(alpha) + 3.0 * abs(lift)
    if rate > 100.0:
        raise InputError(f"c1: alpha {alpha!r} rad and lift {lift!r} are too large to keep the curve level; give c1.")
    return 64 + int(64.0 * rate)


def _none(alpha: float, lift: float) -> InputError:
    return InputError(
        f"c1: no value that keeps the curve level with alpha {alpha!r} rad and lift {lift!r} is connected with "
        "c1 = 0 at lift = 0 (alpha near 2.405 rad, a zero of J0, or the lift too large); give c1 as a number or "
        '"paper", or change alpha or lift.'
    )
