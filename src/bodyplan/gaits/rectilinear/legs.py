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
from bodyplan.kernels import lean

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


def leg(a: Array, b: Array, x: Array, z: Array) -> Leg:
    """Angles of legs with links ``a`` (rear) and ``b`` (front) m and chords (``x``, ``z``) m, all broadcast.

    alpha = atan2(z, x) is signed (the printed (35)-(38) are not); beta and psi are the angles of the triangle at the
    rear and the front anchor: rear = alpha + beta, front = alpha - psi. Legs that do not reach, or fold beyond the
    difference of their links, have NaN angles.
    """
    rear, front, along, up = (np.array(v, dtype=np.float64) for v in np.broadcast_arrays(a, b, x, z))
    out = np.empty((5, along.size))
    _legs(rear.ravel(), front.ravel(), along.ravel(), up.ravel(), out)
    return Leg(*out.reshape(5, *along.shape))


@lean
def _legs(a: Array, b: Array, x: Array, z: Array, out: Array) -> None:
    for k in range(len(a)):
        length = np.sqrt(x[k] * x[k] + z[k] * z[k])
        short = (a[k] + b[k] - length) * (a[k] + b[k] + length)
        out[0, k], out[1, k], out[2, k], out[4, k] = leg_angles(a[k], b[k], x[k], z[k], short)
        out[3, k] = short


@lean
def within(a: float, b: float, square: float, short: float) -> tuple[float, float]:
    """S and C of a leg whose chord has that ``square`` (m^2), 0 where they are below it by rounding, NaN where there is
    no such leg. ``short``: S, known better than from the chord."""
    folded = square - (a - b) ** 2
    slack = REACH * (a + b) ** 2
    s = short if short >= 0.0 else (0.0 if short >= -slack else np.nan)
    c = folded if folded >= 0.0 else (0.0 if folded >= -slack else np.nan)
    return s, c


@lean
def leg_angles(a: float, b: float, x: float, z: float, short: float) -> tuple[float, float, float, float]:
    """``rear``, ``front``, ``bend`` and ``folded`` of one :class:`Leg`."""
    square = x * x + z * z
    s, c = within(a, b, square, short)
    alpha = np.arctan2(z, x)
    height = np.sqrt(s * c)  # 2 a b sin(bend)
    beta = np.arctan2(height, square + a * a - b * b)
    psi = np.arctan2(height, square + b * b - a * a)
    return alpha + beta, alpha - psi, 2.0 * np.arctan2(np.sqrt(s), np.sqrt(c)), square - (a - b) ** 2


@lean
def elbow(a: float, b: float, x: float, z: float, short: float) -> tuple[float, float]:
    """The elbow from the rear anchor, m along and up, without angles; NaN where there is no such leg."""
    square = x * x + z * z
    s, c = within(a, b, square, short)
    if square == 0.0:  # a chord of no length has no direction: as if it were level
        return a + 0.0 * (s + c), 0.0
    share, height = 0.5 * (square + a * a - b * b) / square, 0.5 * np.sqrt(s * c) / square
    return share * x - height * z, share * z + height * x


@lean
def leg_rates(
    a: float,
    b: float,
    short: float,
    folded: float,
    chord: tuple[float, float],
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
) -> tuple[float, float, float, float]:
    """Exact first derivatives of the rear and the front angle, then second ones, of a leg whose chord moves with
    ``velocity`` and ``acceleration``.

    A straight leg has rates only where its chord is at rest (they are 0 then, as the swing paths come to rest faster
    than the leg straightens): on its way through it they would be infinite.
    """
    (x, z), (vx, vz), (ax, az) = chord, velocity, acceleration
    square = x * x + z * z
    if square <= 0.0:
        square = 1.0  # a chord of no length has no direction and turns nowhere
    first = 2.0 * (x * vx + z * vz)
    second = 2.0 * (vx * vx + vz * vz + x * ax + z * az)
    s, c = max(short, 0.0), max(folded, 0.0)
    height = np.sqrt(s * c)
    bend = bend2 = 0.0
    if height > 0.0:
        turn = 0.5 * first * (s - c) / height  # dw/dt
        bend = -first / height
        bend2 = -(second * height - first * turn) / (height * height)
    alpha = (x * vz - z * vx) / square
    alpha2 = (x * az - z * ax) / square - alpha * first / square
    # d(beta)/d(bend) = (L^2 + b^2 - a^2) / (2 L^2), and the same for psi with the links exchanged
    part = 0.5 * (square + b * b - a * a) / square
    other = 0.5 * (square + a * a - b * b) / square
    change, change_other = (0.5 - part) * first / square, (0.5 - other) * first / square
    return (
        alpha + part * bend,
        alpha - other * bend,
        alpha2 + (part * bend2 + change * bend),
        alpha2 - (other * bend2 + change_other * bend),
    )
