"""A leg: two links between neighbouring anchors with the elbow above their chord (paper *rectilinear*, (35)-(54)).

Everything follows from two numbers that vanish where a leg is straight and where it is folded:
S = (a + b)^2 - L^2 = 4 a b sin^2(bend / 2) and C = L^2 - (a - b)^2 = 4 a b cos^2(bend / 2), with which no angle comes
from an arc cosine (which loses half of the digits near a straight leg). (47)-(50) as printed have the wrong
denominators, (51) and (53) the links of the other side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array

#: relative slack of reach: a leg that is too short by less counts as straight
REACH = 1e-12


class Leg(NamedTuple):
    """Absolute angles (...,) rad of the rear and the front link, nose-up positive; ``bend`` (...,) rad between them, 0
    where the leg is straight; ``short`` (...,) = S and ``folded`` (...,) = C in m^2, negative where there is none."""

    rear: Array
    front: Array
    bend: Array
    short: Array
    folded: Array


class LegRates(NamedTuple):
    """First and second derivatives (...,) of the absolute angles."""

    rear: Array
    front: Array
    rear_second: Array
    front_second: Array


def leg(a: Array, b: Array, x: Array, z: Array, short: Array | None = None) -> Leg:
    """Angles of legs with links ``a`` (rear) and ``b`` (front) m and chords (``x``, ``z``) m, all broadcast.

    alpha = atan2(z, x) is signed (the printed (35)-(38) are not); beta and psi are the angles of the triangle at the
    rear and the front anchor: rear = alpha + beta, front = alpha - psi. ``short``: S, where it is known better than
    from the chord. Legs that do not reach, or fold beyond the difference of their links, have NaN angles.
    """
    square = x * x + z * z
    if short is None:
        length = np.sqrt(square)
        short = (a + b - length) * (a + b + length)
    folded = square - (a - b) ** 2
    slack = REACH * (a + b) ** 2
    s, c = (np.where(v >= 0.0, v, np.where(v >= -slack, 0.0, np.nan)) for v in (short, folded))
    alpha = np.arctan2(z, x)
    height = np.sqrt(s * c)  # 2 a b sin(bend)
    beta = np.arctan2(height, square + a * a - b * b)
    psi = np.arctan2(height, square + b * b - a * a)
    return Leg(alpha + beta, alpha - psi, 2.0 * np.arctan2(np.sqrt(s), np.sqrt(c)), short, folded)


def leg_rates(
    a: Array,
    b: Array,
    found: Leg,
    chord: tuple[Array, Array],
    velocity: tuple[Array, Array],
    acceleration: tuple[Array, Array],
) -> LegRates:
    """Exact derivatives of the angles of a :class:`Leg` whose chord moves with ``velocity`` and ``acceleration``.

    A straight leg has rates only where its chord is at rest (they are 0 then, as the swing paths come to rest faster
    than the leg straightens): on its way through it they would be infinite.
    """
    (x, z), (vx, vz), (ax, az) = chord, velocity, acceleration
    square = x * x + z * z
    square = np.where(square > 0.0, square, 1.0)  # a chord of no length has no direction and turns nowhere
    first = 2.0 * (x * vx + z * vz)
    second = 2.0 * (vx * vx + vz * vz + x * ax + z * az)
    s, c = np.maximum(found.short, 0.0), np.maximum(found.folded, 0.0)
    height = np.sqrt(s * c)
    bent = height > 0.0
    w = np.where(bent, height, 1.0)
    bend = np.where(bent, -first / w, 0.0)
    turn = 0.5 * first * (s - c) / w  # dw/dt
    bend2 = np.where(bent, -(second * w - first * turn) / (w * w), 0.0)
    out = []
    alpha = (x * vz - z * vx) / square
    alpha2 = (x * az - z * ax) / square - alpha * first / square
    for sign, own, other in ((1.0, a, b), (-1.0, b, a)):
        # d(beta)/d(bend) = (L^2 + b^2 - a^2) / (2 L^2), and the same for psi with the links exchanged
        part = 0.5 * (square + other * other - own * own) / square
        change = 0.5 * first / square - part * first / square
        out.append((alpha + sign * part * bend, alpha2 + sign * (part * bend2 + change * bend)))
    (rear, rear2), (front, front2) = out
    return LegRates(rear, front, rear2, front2)
