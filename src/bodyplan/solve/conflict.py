"""Which commanded rates contradict each other: the smallest set of equations that no rates fulfil together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.solve.inverse import ZERO

#: share of what an equation adds up that its residual may be
TOLERANCE = 1e-9


class Conflict(NamedTuple):
    """``rows``: equations that contradict each other, none of which can be left out; ``known``: the columns of H that
    they involve; ``gap``: what the only combination of them that has no unknown adds up to instead of 0, in the unit of
    column ``leader``, which has the largest coefficient, 1."""

    rows: tuple[int, ...]
    known: tuple[int, ...]
    gap: float
    leader: int


def conflict(G: Array, H: Array, Y: Array) -> Conflict | None:
    """Rows of G X = H Y, G (m, x), H (m, y), that contradict each other at Y (y,); None where there are none.

    Rows are left out one after the other as long as the rest is contradictory: what remains is irreducible, and has
    exactly one combination (the left null vector of its G) without unknowns.
    """
    b = H @ Y
    size = TOLERANCE * float((np.abs(H) @ np.abs(Y)).max(initial=0.0))
    rows = list(range(len(G)))
    if _gap(G, b, rows) <= size:
        return None
    for row in range(len(G)):
        fewer = [r for r in rows if r != row]
        if _gap(G, b, fewer) > size:
            rows = fewer
    combination = np.linalg.svd(G[rows])[0][:, -1] if G.shape[1] else np.ones(len(rows))
    share = combination @ H[rows]
    largest = float(np.abs(share).max(initial=0.0))
    known = np.flatnonzero(np.abs(share) > 1e-9 * largest)
    leader = int(np.argmax(np.abs(share)))
    return Conflict(tuple(rows), tuple(int(i) for i in known), abs(float(share @ Y)) / largest, leader)


def described(found: Conflict, rows: Sequence[str], known: Sequence[str], units: Sequence[str]) -> str:
    """The conflict in words."""
    several = len(found.rows) > 1
    equations, involved = ", ".join(rows[i] for i in found.rows), ", ".join(known[i] for i in found.known)
    return (
        f"the equation{'s' * several} of {equations} cannot hold{' together' * several}: the known {involved} leave "
        f"{found.gap:.3g} {units[found.leader]} where it must be 0"
    )


def _gap(G: Array, b: Array, rows: list[int]) -> float:
    """Distance of b from what the rows of G can reach."""
    if not rows:
        return 0.0
    if not G.shape[1]:
        return float(np.abs(b[rows]).max())
    U, s, _ = np.linalg.svd(G[rows], full_matrices=False)
    U = U[:, s > ZERO * s.max()]
    return float(np.abs(b[rows] - U @ (U.T @ b[rows])).max())
