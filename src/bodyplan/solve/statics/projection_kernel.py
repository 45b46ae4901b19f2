"""Forces within friction cones by alternating projections: cheap, and only as good as they happen to be.

Forces go in turn to the nearest ones within the cones and to the nearest ones that balance (Bregman 1965), the first by
more than all the way, which gets them inside sooner (Agmon 1954, Motzkin and Schoenberg 1954). What balances bounds the
friction that is needed; whether it is anywhere near says nobody.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray
from bodyplan.kernels import lean
from bodyplan.solve.statics.cones import ROUNDING

#: how far forces go to the nearest ones of the cones: 1 there, below 2 still nearer to all that are within
_RELAXED = 1.9


@lean
def _toward_cones(mu: float, touching: BoolArray, x: Array) -> None:
    """Forces ``x`` (3k,) toward the nearest ones within cones of coefficient ``mu``."""
    for c in range(len(touching)):
        n, a, b = x[3 * c], x[3 * c + 1], x[3 * c + 2]
        r = math.hypot(a, b)
        if touching[c] and r <= mu * n:
            continue
        near, share = 0.0, 0.0
        if touching[c] and mu * r > -n:
            near = (n + mu * r) / (1.0 + mu * mu)
            share = near * mu / r
        x[3 * c] += _RELAXED * (near - n)
        x[3 * c + 1] += _RELAXED * (share - 1.0) * a
        x[3 * c + 2] += _RELAXED * (share - 1.0) * b


@lean
def _balanced(equations: Array, inverse: Array, load: Array, x: Array, rest: Array) -> None:
    """Forces ``x`` (3k,) to the nearest ones that balance; ``rest`` (6,) is room."""
    for e in range(len(load)):
        rest[e] = load[e]
        for j in range(len(x)):
            rest[e] += equations[e, j] * x[j]
    for j in range(len(x)):
        for e in range(len(load)):
            x[j] -= inverse[e, j] * rest[e]


@lean
def _worst(x: Array) -> float:
    """The largest of :func:`bodyplan.solve.statics.cones.ratios` of forces ``x`` (3k,); inf where one is not finite."""
    largest, worst = 0.0, 0.0
    for c in range(len(x) // 3):
        largest = max(largest, x[3 * c] ** 2 + x[3 * c + 1] ** 2 + x[3 * c + 2] ** 2)
    if not math.isfinite(largest):
        return np.inf
    for c in range(len(x) // 3):
        square = x[3 * c + 1] ** 2 + x[3 * c + 2] ** 2
        if square + x[3 * c] ** 2 > ROUNDING * ROUNDING * largest:
            if not x[3 * c] > 0.0:
                return np.inf
            worst = max(worst, math.sqrt(square) / x[3 * c])
    return worst


@njit(cache=True, nogil=True, error_model="numpy")
def project(
    equations: Array,
    inverse: Array,
    load: Array,
    touching: BoolArray,
    mu: float,
    rounds: int,
    x: Array,
    bound: Array,
) -> None:
    """Lowers ``bound`` (n,), coefficients with which n items balance, by forces ``x`` (n, 3k) that go toward cones of
    coefficient ``mu``, at most ``rounds`` times; items that need no more than mu for certain are left alone.

    ``equations`` (n, 6, 3k), their transposed pseudo-inverses ``inverse`` (n, 6, 3k), ``load`` (n, 6) and ``touching``
    (n, k) are those of :class:`bodyplan.solve.statics.equilibrium.Loads` and ``Parts``.
    """
    rest = np.empty(load.shape[1])
    for i in range(len(load)):
        for _ in range(rounds):
            if not bound[i] > mu:
                break
            _toward_cones(mu, touching[i], x[i])
            _balanced(equations[i], inverse[i], load[i], x[i], rest)
            bound[i] = min(bound[i], _worst(x[i]))
