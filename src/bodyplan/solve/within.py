"""Resolved rates moved as little as possible to keep within limits, configuration by configuration."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, TextArray
from bodyplan.errors import Status
from bodyplan.solve.core import Core
from bodyplan.solve.inverse import Inverse
from bodyplan.solve.limits import Inequalities
from bodyplan.solve.quadratic import ROUNDING, nearest


class Within(NamedTuple):
    """``X`` (..., x), ``status`` (...), ``excess`` and ``pushing`` (..., L), ``reason`` of a sample (flat index)."""

    X: Array
    status: TextArray
    excess: Array
    pushing: BoolArray
    reason: Callable[[int], str]


def keep_within(X: Array, Y: Array, core: Core, found: Inverse, limits: Inequalities, status: TextArray) -> Within:
    """The X + B z with the smallest cost of the change z that keep C X + D Y <= h; B spans what the equations leave
    free, so that they hold as before. A conflict of the equations themselves is left as it is."""
    shape = X.shape[:-1]
    C, D = (np.broadcast_to(a, (*shape, *a.shape[-2:])) for a in (limits.C, limits.D))
    h = np.broadcast_to(limits.h, (*shape, len(limits.labels)))
    over = _excess(C, X, D, Y, h)
    directions = core.directions(found.basis)
    pushing = np.zeros(over.shape, dtype=bool)
    for index in np.ndindex(shape):
        if status[index] == Status.CONFLICT.value or np.all(over[index] <= 0.0):
            continue
        B = directions[index][:, found.rank[index] :]
        result = nearest(C[index] @ B, -over[index])
        X[index] += B @ result.z
        pushing[index] = result.pushing
        if not result.solved:
            status[index] = Status.NOT_CONVERGED.value
        elif not result.feasible:
            status[index] = Status.INFEASIBLE.value
    excess = _excess(C, X, D, Y, h)
    excess = np.where(excess > ROUNDING, excess, 0.0)

    def reason(flat: int) -> str:
        at = np.unravel_index(flat, shape)
        names = [label for label, takes_part in zip(limits.labels, pushing[at], strict=True) if takes_part]
        worst = int(np.argmax(excess[at]))
        return (
            f"no rates keep within all of: {', '.join(names)}; those that exceed them by the least exceed "
            f"{limits.labels[worst]} by {excess[at][worst]:.3g}"
        )

    return Within(X, status, excess, pushing, reason)


def _excess(C: Array, X: Array, D: Array, Y: Array, h: Array) -> Array:
    return np.asarray((C @ X[..., None])[..., 0] + (D @ Y[..., None])[..., 0] - h)
