"""Second-order cone programs of contact forces, by Clarabel."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import MissingExtraError
from bodyplan.solve.statics.cones import CONE, RAY, Cones


class Found(NamedTuple):
    """``status``: "solved", "infeasible", "unbounded" or "other"; ``x`` (k, 3); ``y`` (r,) multipliers of A x = b such
    that A^T y is the part of the gradient that the equations hold."""

    status: str
    x: Array
    y: Array


class Slack(NamedTuple):
    """``status`` as of :class:`Found`; ``slack``: how far ratios are from what was asked, negative where within."""

    status: str
    x: Array
    y: Array
    slack: float


def least(A: Array, b: Array, cones: Cones, square: float, gain: Array) -> Found:
    """Minimise square |x|^2 / 2 - gain . x with A x = b and x in the cones."""
    k = len(cones.kind)
    columns, rows, kinds = [], [], []
    clarabel = library()
    at = 0
    for i in range(k):
        if cones.kind[i] == RAY:
            column = np.zeros((3 * k, 1))
            column[3 * i : 3 * i + 3, 0] = cones.ray[i]
            columns.append(column)
            rows.append((at, np.array([[1.0]])))
            kinds.append(clarabel.NonnegativeConeT(1))
            at += 1
        elif cones.kind[i] == CONE:
            columns.append(np.eye(3 * k)[:, 3 * i : 3 * i + 3])
            rows.append((at, np.diag([cones.mu[i], 1.0, 1.0])))
            kinds.append(clarabel.SecondOrderConeT(3))
            at += 3
    if at == 0:
        return Found("solved" if np.abs(b).max(initial=0.0) < 1e-12 else "infeasible", np.zeros((k, 3)), -b)
    E = np.concatenate(columns, axis=1)
    G = np.zeros((at, at))
    for where, block in rows:
        G[where : where + len(block), where : where + len(block)] = -block
    equal = A @ E
    status, v, z = _solve(
        clarabel,
        square * np.eye(at),
        -(E.T @ gain.ravel()),
        np.vstack([equal, G]),
        np.concatenate([b, np.zeros(at)]),
        [clarabel.ZeroConeT(len(b)), *kinds] if len(b) else kinds,
    )
    return Found(status, (E @ v).reshape(k, 3), -z[: len(b)])


def least_excess(A: Array, b: Array, kind: IntArray, aim: Array, cap: Array, weight: Array, bound: float) -> Slack:
    """The smallest slack with A x = b, |tangential_i| <= aim_i normal_i + slack weight_i, and <= cap_i normal_i.

    Always has a solution, also where ``aim`` is out of reach; y then proves it. |x| <= bound.
    """
    clarabel = library()
    k = len(kind)
    rows, limit, kinds = [], [], []

    def add(block: Array, right: Array, cone: Any) -> None:
        rows.append(block)
        limit.append(right)
        kinds.append(cone)

    if len(b):
        add(np.concatenate([A, np.zeros((len(b), 1))], axis=1), b, clarabel.ZeroConeT(len(b)))
    for i in range(k):
        unit = np.zeros((3, 3 * k + 1))
        unit[:, 3 * i : 3 * i + 3] = np.eye(3)
        if kind[i] != CONE:
            first = 1 if kind[i] == RAY else 0
            add(unit[first:], np.zeros(3 - first), clarabel.ZeroConeT(3 - first))
        if kind[i] == CONE:
            near = -unit.copy()
            near[0] *= aim[i]
            near[0, -1] = -weight[i]
            add(near, np.zeros(3), clarabel.SecondOrderConeT(3))
            if np.isfinite(cap[i]):
                within = -unit.copy()
                within[0] *= cap[i]
                add(within, np.zeros(3), clarabel.SecondOrderConeT(3))
        if kind[i] in (CONE, RAY):
            add(-unit[:1], np.zeros(1), clarabel.NonnegativeConeT(1))
    size = np.concatenate([np.zeros((1, 3 * k + 1)), -np.eye(3 * k, 3 * k + 1)])
    add(size, np.concatenate([[bound], np.zeros(3 * k)]), clarabel.SecondOrderConeT(3 * k + 1))
    cost = np.zeros(3 * k + 1)
    cost[-1] = 1.0
    status, v, z = _solve(
        clarabel, np.zeros((3 * k + 1, 3 * k + 1)), cost, np.vstack(rows), np.concatenate(limit), kinds
    )
    return Slack(status, v[:-1].reshape(k, 3), -z[: len(b)], float(v[-1]))


def _solve(clarabel: Any, P: Array, q: Array, A: Array, b: Array, cones: list[Any]) -> tuple[str, Array, Array]:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    settings.reduced_tol_gap_abs = settings.reduced_tol_gap_rel = settings.reduced_tol_feas = 1e-7
    solution = clarabel.DefaultSolver(_sparse(P), q, _sparse(A), b, cones, settings).solve()
    return _STATUS.get(str(solution.status), "other"), np.array(solution.x), np.array(solution.z)


def _sparse(matrix: Array) -> Any:
    """By columns; sooner than SciPy, which looks at the matrix several times, finds what is not zero."""
    from scipy.sparse import csc_array

    columns, rows = np.nonzero(matrix.T)
    ends = np.searchsorted(columns, np.arange(matrix.shape[1] + 1))
    return csc_array((matrix[rows, columns], rows, ends), shape=matrix.shape)


_STATUS = {
    "Solved": "solved",
    "AlmostSolved": "solved",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible",
    "DualInfeasible": "unbounded",
    "AlmostDualInfeasible": "unbounded",
}


def library() -> Any:
    """The ``clarabel`` module, or MissingExtraError saying how to install it."""
    try:
        import clarabel
    except ImportError as error:
        raise MissingExtraError("clarabel", "solve", "contact forces within friction cones") from error
    return clarabel
