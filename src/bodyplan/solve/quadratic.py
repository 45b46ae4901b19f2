"""The smallest z with A z <= h, by active rows or Clarabel; which rows contradict each other where there is none."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import MissingExtraError

#: how much a row may be exceeded by rounding, rows of length 1
ROUNDING = 1e-10
#: cost of |z|^2 beside that of exceeding rows: enough to make the least excess one point
SMALL = 1e-8
#: multiplier from which on a row takes part in a conflict; a row that is exceeded has 1
TAKES_PART = 1e-5
#: corrections of the guess of active rows
CORRECTIONS = 10


class Nearest(NamedTuple):
    """``z`` (k,); ``feasible``: whether A z <= h; ``pushing`` (L,): rows that hold z back or contradict each other;
    ``solved``: False where the solver gave up."""

    z: Array
    feasible: bool
    pushing: BoolArray
    solved: bool = True


def nearest(A: Array, h: Array) -> Nearest:
    """Minimise |z|^2 with A z <= h, A (L, k), h (L,). Where no z does, the one that exceeds the rows by the least sum,
    each row of A scaled to length 1. Raises MissingExtraError without Clarabel."""
    length = np.linalg.norm(A, axis=-1)
    # a row in which nothing can move only says whether it holds
    moves = length > 1e-12 * length.max(initial=0.0)
    scaled = np.where(moves, length, 1.0)
    unit, bound = np.where(moves[:, None], A, 0.0) / scaled[:, None], h / scaled
    stuck = ~moves & (bound < -ROUNDING)
    L, k = A.shape
    clarabel = library()
    if not stuck.any():
        pushing = np.zeros(L, dtype=bool)
        guess = _by_active_rows(unit[moves], bound[moves], bound[moves] < 0.0)
        if guess is not None:
            pushing[moves] = guess[1]
            return Nearest(guess[0], True, pushing)
        status, z, multipliers = _clarabel(clarabel, np.eye(k), np.zeros(k), unit[moves], bound[moves])
        if status == "Solved":
            # of a row that pushes the slack vanishes, of any other the multiplier
            active = multipliers > bound[moves] - unit[moves] @ z
            exact = _by_active_rows(unit[moves], bound[moves], active)
            pushing[moves] = active if exact is None else exact[1]
            return Nearest(z if exact is None else exact[0], True, pushing)
    weight = np.concatenate([np.full(k, SMALL), np.zeros(L)])
    rows = np.block([[unit, -np.eye(L)], [np.zeros((L, k)), -np.eye(L)]])
    cost, limit = np.concatenate([np.zeros(k), np.ones(L)]), np.concatenate([bound, np.zeros(L)])
    status, both, multipliers = _clarabel(clarabel, np.diag(weight), cost, rows, limit)
    return Nearest(both[:k], False, multipliers[:L] > TAKES_PART, status == "Solved")


def _by_active_rows(A: Array, h: Array, active: BoolArray) -> tuple[Array, BoolArray] | None:
    """(z, rows that push), exact, from a guess of which rows do; None where a few corrections of it do not get there.

    Rows that pull are dropped and rows that are exceeded are taken in (the primal-dual active set method of
    Hintermueller, Ito and Kunisch 2002). Where that settles, z is the solution: it meets the conditions of optimality.
    An interior point method stops a little inside or outside of its rows, so this also finishes its work.
    """
    for _ in range(CORRECTIONS):
        some, target = A[active], h[active]
        z = np.asarray(np.linalg.lstsq(some, target, rcond=None)[0])
        # z = -some^T multipliers
        multipliers = np.asarray(np.linalg.lstsq(some.T, -z, rcond=None)[0])
        if np.abs(some @ z - target).max(initial=0.0) > ROUNDING:
            return None
        after = A @ z > h + ROUNDING
        after[active] |= multipliers > 0.0
        if np.array_equal(after, active):
            return z, active
        active = after
    return None


def _clarabel(clarabel: Any, P: Array, q: Array, A: Array, h: Array) -> tuple[str, Array, Array]:
    """(status, z, multipliers) of: minimise z P z / 2 + q z with A z <= h."""
    from scipy.sparse import csc_array

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    cones = [clarabel.NonnegativeConeT(len(h))]
    solution = clarabel.DefaultSolver(csc_array(P), q, csc_array(A), h, cones, settings).solve()
    status = "Solved" if str(solution.status) in ("Solved", "AlmostSolved") else str(solution.status)
    return status, np.array(solution.x), np.array(solution.z)


def library() -> Any:
    """The ``clarabel`` module, or MissingExtraError saying how to install it."""
    try:
        import clarabel
    except ImportError as error:
        raise MissingExtraError("clarabel", "solve", "resolving rates within limits") from error
    return clarabel
