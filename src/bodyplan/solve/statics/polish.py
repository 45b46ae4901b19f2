"""Newton's method on the conditions of optimality, from the nearly exact result of an interior point method."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.solve.statics.cones import Cones, Family
from bodyplan.solve.statics.polish_kernel import GAIN, NORM, RATIO, newton

#: steps of Newton's method, at most; and from the solution of a similar problem
STEPS, WARM = 40, 8
_NONE = np.zeros(0)


class Polished(NamedTuple):
    """``x`` (k, 3) in its cones; ``y`` (r,); ``residual`` of the conditions over the size of the forces."""

    x: Array
    y: Array
    residual: float


class PolishedRatio(NamedTuple):
    """As :class:`Polished`, with the factor ``s`` of the cones; ``residual`` is that of forces over the load."""

    x: Array
    y: Array
    s: float
    residual: float


def polish_norm(A: Array, b: Array, cones: Cones, y: Array, steps: int = STEPS) -> Polished:
    """The x of the smallest norm in its cones with A x = b: the nearest in them to A^T y, for the y with which it meets
    the equations (a concave problem in y, smooth but for kinks of its second derivative)."""
    u, near, residual = _newton(NORM, A, b, cones, _NONE, _NONE, y, steps)
    near = near if np.isfinite(residual) else np.zeros_like(near)
    return Polished(near, u, residual / max(1.0, float(np.abs(near).max(initial=0.0))))


def polish_gain(A: Array, b: Array, cones: Cones, gain: Array, x: Array, y: Array) -> Polished:
    """The x in its cones with A x = b and the largest gain . x: the nearest in them to x + gain + A^T y with some y."""
    u, near, residual = _newton(GAIN, A, b, cones, gain.ravel(), _NONE, np.concatenate([x.ravel(), y]), STEPS)
    near = near if np.isfinite(residual) else x
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    return Polished(near, u[x.size :], max(residual, missed) / max(1.0, float(np.abs(near).max(initial=0.0))))


def polish_ratio(A: Array, b: Array, family: Family, x: Array, y: Array, s: float, steps: int = STEPS) -> PolishedRatio:
    """The least factor s of the cones of a family with A x = b: x is then the nearest in its cones to x + A^T y with a
    y of length 1, which proves that less is not enough."""
    length = float(np.linalg.norm(y))
    start = np.concatenate([x.ravel(), y / (length if length > 0.0 else 1.0), [s]])
    u, near, residual = _newton(RATIO, A, b, family.widest, _NONE, family.slope, start, steps)
    near = near if np.isfinite(residual) else x
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    return PolishedRatio(near, u[x.size : -1], float(u[-1]), max(residual, missed))


def _newton(
    which: int, A: Array, b: Array, cones: Cones, gain: Array, slope: Array, start: Array, steps: int
) -> tuple[Array, Array, float]:
    """(u, forces (k, 3), largest residual): the best that Newton's method gets to from ``start``."""
    u = np.array(start, dtype=np.float64)
    near = np.zeros((len(cones.kind), 3))
    a, right, mu, ray, up, rate = (
        np.ascontiguousarray(v, dtype=np.float64) for v in (A, b, cones.mu, cones.ray, gain, slope)
    )
    kind = np.ascontiguousarray(cones.kind, dtype=np.int64)
    return u, near, float(newton(which, a, right, kind, mu, ray, up, rate, u, steps, near))
