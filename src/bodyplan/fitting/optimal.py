"""The joint angles, within their limits, and the kink that minimise E_nm (paper *acm*, eq. (6))."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.fitting.following import Following
from bodyplan.fitting.objective import Objective

#: an optimiser that begins again at its result must not find more than this share
CONVERGED = 1e-9
RESTARTS = 8
#: the gradient, where the Hessian is about 1: its square is what is left of E
BFGS: dict[str, Any] = {"maxiter": 500, "gtol": 1e-5}
SLSQP: dict[str, Any] = {"maxiter": 500, "ftol": 1e-13}
LBFGS: dict[str, Any] = {"maxiter": 3000, "maxcor": 50, "ftol": 1e-14, "gtol": 1e-12}
#: of the trace: what keeps the metric regular
FLOOR = 1e-9
FREE = (-np.inf, np.inf)
#: unknowns up to which SLSQP, with a dense Hessian, is the faster one
DENSE_UP_TO = 250
#: E_nm below which nothing is left but rounding
EXACT = 1e-13


def optimal(
    groups: Sequence[Sequence[tuple[IntArray, Following]]], q: Array, kink: Array, axes: Sequence[int]
) -> tuple[Array, Array, BoolArray]:
    """(q (C, T, n), kink (C, T, 2), whether the optimiser converged (C, T)) from those of the paper's rule on.

    ``groups``: for every curve the fits that share a dense curve; ``axes`` the kink may use. The rule's angles are
    clipped to the joint limits first; the result is never worse than that.
    """
    out, turn = q.copy(), kink.copy()
    fine = np.ones(q.shape[:2], dtype=bool)
    for c, parts in enumerate(groups):
        for members, following in parts:
            for index, t in enumerate(members):
                goal = Objective(following, index, tuple(axes))
                x, fine[c, t] = _minimised(goal, q[c, t], kink[c, t, list(axes)], following.robot.limits)
                out[c, t], turn[c, t] = x[: goal.n], goal.full_kink(x)
    return out, turn, fine


def _minimised(goal: Objective, q: Array, kink: Array, limits: Array) -> tuple[Array, bool]:
    low, high = (np.concatenate([side, np.full(len(kink), free)]) for side, free in zip(limits.T, FREE, strict=True))
    best = np.clip(np.concatenate([q, kink]), low, high)
    lowest = goal(best)[0]
    for _ in range(RESTARTS):
        before = lowest
        if before <= EXACT:
            return best, True
        x = _search(goal, best, before, low, high)
        value = goal(x)[0]
        if value < lowest:
            best, lowest = x, value
        if before - lowest <= CONVERGED * before:
            return best, True
    return best, False


def _search(goal: Objective, begin: Array, unit: float, low: Array, high: Array) -> Array:
    """One run of an optimiser on ``E / unit`` from ``begin`` on, within the limits.

    The unknowns are changed so that the Hessian there is about the identity: with joint angles its condition grows
    with the fourth power of the number of links. Limits then are linear constraints, met only where they matter.
    """
    from scipy import optimize  # half a second to load

    minimize: Any = optimize.minimize  # its overloads do not know options by name

    metric = goal.metric(begin)
    metric += FLOOR * np.trace(metric) * np.eye(len(metric))
    change = unit * np.linalg.inv(np.linalg.cholesky(metric)).T

    def scaled(z: Array) -> tuple[float, Array]:
        value, gradient = goal(begin + change @ z)
        return value / unit, change.T @ gradient / unit

    zero = np.zeros(len(begin))
    small = len(begin) <= DENSE_UP_TO
    if np.all((low < begin) & (begin < high)):
        # in plain NumPy, and a batch of small fits pays dearly for threads inside LAPACK
        free: Any = {"method": "BFGS", "options": BFGS} if small else {"method": "L-BFGS-B", "options": LBFGS}
        x = begin + change @ minimize(scaled, zero, jac=True, **free).x
        if np.array_equal(x, np.clip(x, low, high)):
            return np.asarray(x)
    if small:
        bound = np.isfinite(low) | np.isfinite(high)
        within = optimize.LinearConstraint(change[bound], (low - begin)[bound], (high - begin)[bound])
        x = begin + change @ minimize(scaled, zero, jac=True, method="SLSQP", constraints=within, options=SLSQP).x
        return np.asarray(np.clip(x, low, high))
    scale = unit / np.sqrt(np.diag(metric))

    def bounded(z: Array) -> tuple[float, Array]:
        value, gradient = goal(np.clip(begin + scale * z, low, high))
        return value / unit, scale * gradient / unit

    limits = optimize.Bounds((low - begin) / scale, (high - begin) / scale)
    found = minimize(bounded, zero, jac=True, method="L-BFGS-B", bounds=limits, options=LBFGS)
    return np.asarray(np.clip(begin + scale * found.x, low, high))
