"""What moves come to on their way: how high anchors and elbows rise, and how fast joints turn: a Numba kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array
from bodyplan.gaits.rectilinear.legs import elbow, leg_rates
from bodyplan.gaits.rectilinear.moves import Moves, chord_of, swing_of
from bodyplan.gaits.rectilinear.swing import even_at, swing_rates


class Extremes(NamedTuple):
    """The largest along each of M moves: ``height`` (M, N) m of anchors, ``bend`` (M, N) m of the second differences of
    that height from place to place; ``elbow`` (M,) m, the height of the highest one; ``rate`` (M,) rad, derivative of
    a joint by tau. NaN where a leg is not known."""

    height: Array
    bend: Array
    elbow: Array
    rate: Array


def extremes(moves: Moves, links: Array, places: int) -> Extremes:
    """Those of a snake with ``links`` (2 N - 2,) m at so many equal ``places`` of every move."""
    shape = moves.before.shape[:2]
    out = Extremes(np.full(shape, -np.inf), np.zeros(shape), np.full(shape[0], -np.inf), np.zeros(shape[0]))
    _extremes(*moves.tables, np.ascontiguousarray(links), np.linspace(0.0, 1.0, places), out)
    return out


@njit(cache=True)
def _extremes(
    before: Array, after: Array, lift: Array, early: Array, links: Array, tau: Array, out: Extremes
) -> None:  # fmt: skip
    size, count = before.shape[:2]
    start, offset, rates = np.empty((count, 2)), np.empty((count, 2)), np.zeros((count, 2))
    last = np.zeros((2, size, count))  # heights at the two places before
    for p in range(len(tau)):
        even = even_at(tau[p])
        for m in range(size):
            swing_of(before, after, lift, early, m, tau[p], even, start, offset)
            for i in range(count):
                height = start[i, 1] + offset[i, 1]
                out.height[m, i] = max(out.height[m, i], height)
                if p > 1:
                    bend = (height - last[1, m, i]) - (last[1, m, i] - last[0, m, i])
                    out.bend[m, i] = max(out.bend[m, i], abs(bend))
                last[0, m, i], last[1, m, i] = last[1, m, i], height
                rates[i, 0] = rates[i, 1] = 0.0
                dx, dz = after[m, i, 0] - before[m, i, 0], after[m, i, 1] - before[m, i, 1]
                if dx != 0.0 or dz != 0.0 or lift[m, i] != 0.0:
                    rates[i, 0], rates[i, 1], _, _ = swing_rates(tau[p], dx, dz, lift[m, i], early[m, i])
            behind = 0.0
            for i in range(count - 1):
                a, b = links[2 * i], links[2 * i + 1]
                x, z, short = chord_of(start, offset, i, (a + b) ** 2)
                top = start[i, 1] + offset[i, 1] + elbow(a, b, x, z, short)[1]
                out.elbow[m] = _larger(out.elbow[m], top)
                change = rates[i + 1, 0] - rates[i, 0], rates[i + 1, 1] - rates[i, 1]
                folded = x * x + z * z - (a - b) ** 2
                rear, front, _, _ = leg_rates(a, b, short, folded, (x, z), change, (0.0, 0.0))
                out.rate[m] = _larger(_larger(out.rate[m], abs(rear - behind)), abs(front - rear))
                behind = front
            out.rate[m] = _larger(out.rate[m], abs(behind))


@njit(cache=True)
def _larger(most: float, value: float) -> float:
    """NaN once one is."""
    return value if value > most or np.isnan(value) else most
