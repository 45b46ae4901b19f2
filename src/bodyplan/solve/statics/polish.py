"""Newton's method on the conditions of optimality, from the nearly exact result of an interior point method."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.solve.statics.cones import Cones

#: steps of Newton's method, at most; and from the solution of a similar problem
STEPS, WARM = 40, 8
#: residual that is rounding
NOTHING_LEFT = 3e-16
#: forces and multipliers beyond this are those of a solver that went astray
ENDLESS = 1e12


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


def polish(
    A: Array, b: Array, cones: Cones, square: float, gain: Array, x: Array, y: Array, steps: int = STEPS
) -> Polished:
    """x with A x = b, x the nearest in its cones to x - (square x - gain - A^T y): then it minimises square |x|^2 / 2 -
    gain . x, since the cones are convex. The nearest point is piecewise smooth, so that Newton's method converges at
    once from near the solution (Qi and Sun 1993)."""
    k, r = len(cones.kind), len(b)
    size = 3 * k

    def system(u: Array) -> tuple[Array, Array, Array]:
        z = (1.0 - square) * u[:size] + gain.ravel() + A.T @ u[size:]
        near, D, _ = cones.nearest(z.reshape(k, 3))
        full = _blocks(D)
        jacobian = np.zeros((size + r, size + r))
        jacobian[:size, :size] = np.eye(size) - (1.0 - square) * full
        jacobian[:size, size:] = -full @ A.T
        jacobian[size:, :size] = A
        return np.concatenate([u[:size] - near.ravel(), A @ u[:size] - b]), jacobian, near

    u, residual = _newton(system, np.concatenate([x.ravel(), y]), steps)
    near = system(u)[2]
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    scale = max(1.0, float(np.abs(near).max(initial=0.0)))
    return Polished(near, u[size:], max(residual, missed) / scale)


def polish_ratio(
    A: Array,
    b: Array,
    cones: Callable[[float], tuple[Cones, Array]],
    x: Array,
    y: Array,
    s: float,
    steps: int = STEPS,
) -> PolishedRatio:
    """The least factor s of cones, ``cones(s)`` with d mu/ds (k,), with A x = b: x is then the nearest in its cones to
    x + A^T y with a y of length 1, which proves that less is not enough."""
    k, r = len(x), len(b)
    size = 3 * k

    def system(u: Array) -> tuple[Array, Array, Array]:
        now, rate = cones(max(float(u[-1]), 0.0))
        z = u[:size] + A.T @ u[size:-1]
        near, D, by_mu = now.nearest(z.reshape(k, 3))
        full = _blocks(D)
        jacobian = np.zeros((size + r + 1, size + r + 1))
        jacobian[:size, :size] = np.eye(size) - full
        jacobian[:size, size:-1] = -full @ A.T
        jacobian[:size, -1] = -(by_mu * rate[:, None]).ravel()
        jacobian[size:-1, :size] = A
        jacobian[-1, size:-1] = u[size:-1]
        y = u[size:-1]
        rest = [u[:size] - near.ravel(), A @ u[:size] - b, np.array([0.5 * (y @ y - 1.0)])]
        return np.concatenate(rest), jacobian, near

    length = float(np.linalg.norm(y))
    u, residual = _newton(system, np.concatenate([x.ravel(), y / (length if length > 0.0 else 1.0), [s]]), steps)
    near = system(u)[2]
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    return PolishedRatio(near, u[size:-1], float(u[-1]), max(residual, missed))


def _newton(system: Callable[[Array], tuple[Array, Array, Array]], u: Array, steps: int) -> tuple[Array, float]:
    """(u, largest residual): the best that Newton's method gets to. Where solutions are not single points directions
    in which nearly nothing changes are held back, by as much as serves best (Levenberg 1944, Marquardt 1963)."""
    if not np.abs(u).max(initial=0.0) < ENDLESS:
        return u, np.inf
    rest, jacobian, _ = system(u)
    best = float(np.linalg.norm(rest))
    for _ in range(steps):
        if best <= NOTHING_LEFT or not np.all(np.isfinite(jacobian)):
            break
        U, s, V = np.linalg.svd(jacobian)
        turned = U.T @ -rest
        before = best
        for damping in (0.0, best, best**0.5, best**0.25):
            safe = np.where(s > 1e-13 * s[0], s, np.inf) if damping == 0.0 else s + damping**2 / np.maximum(s, 1e-300)
            after = u + V.T @ (turned / safe)
            if not np.abs(after).max(initial=0.0) < ENDLESS:
                continue
            new_rest, new_jacobian, _ = system(after)
            new = float(np.linalg.norm(new_rest))
            if new < best:
                next_u, rest, jacobian, best = after, new_rest, new_jacobian, new
            if best < 0.1 * before:
                break
        if not best < before:
            break
        u = next_u
    return u, float(np.abs(rest).max(initial=0.0))


def _blocks(D: Array) -> Array:
    """(3k, 3k) with the blocks D (k, 3, 3) on its diagonal."""
    k = len(D)
    out = np.zeros((k, 3, k, 3))
    out[np.arange(k), :, np.arange(k), :] = D
    return out.reshape(3 * k, 3 * k)
