"""``bp.solve.required_friction``: the least coefficient with which a body stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.errors import Status
from bodyplan.solve.statics.cones import Family, ratios
from bodyplan.solve.statics.equilibrium import ROUNDING, Loads, Memory
from bodyplan.solve.statics.factor import Factor, Start, least_factor
from bodyplan.solve.statics.item import at_least_factor
from bodyplan.solve.statics.outcome import Outcome, shaped
from bodyplan.solve.statics.projection_kernel import project

#: rounding of a coefficient
CLOSE = 1e-12
#: how often forces are projected: most that hold with a given friction are found by then
ROUNDS = 100


@dataclass(frozen=True, kw_only=True)
class RequiredFriction(Outcome):
    """The least coefficient ``mu`` (...,), common to all contacts, with which contact forces balance; inf where none
    does (status "tips_over"). ``float(...)`` of a single item is its ``mu``.

    ``forces`` (..., k, 3) N: those of the smallest sum of squares with that coefficient; nan where there are none.
    ``attained`` (...): False where forces grow without bound towards ``mu``, as of a body held between two walls: any
    coefficient above ``mu`` is enough, ``mu`` itself is not.
    """

    mu: Any
    forces: Array
    attained: Any

    def __float__(self) -> float:
        return float(self.mu)


def required_friction(
    points: ArrayLike,
    normals: ArrayLike,
    com: ArrayLike,
    weight: ArrayLike = 1.0,
    *,
    wrench: ArrayLike | None = None,
    touching: ArrayLike | None = None,
    forces: bool = True,
) -> RequiredFriction:
    """The least friction coefficient, the same at all contacts, with which a body is in equilibrium.

    Arguments as of :func:`contact_forces`; without a ``wrench`` the size of the weight does not matter. On a plane it
    is the slope (the tangent of its angle) as long as the weight passes between the contacts. ``forces``: False leaves
    them out (nan), for a third of the work.
    Needs the extra "solve" unless forces along the normals balance. Raises InputError as :func:`contact_forces` does.
    """
    loads = Loads.of(points, normals, com, weight, wrench, touching)
    least = LeastFriction(loads)
    n, k = loads.count, loads.contacts
    mu, x = np.zeros(n), np.zeros((n, k, 3))
    attained = np.ones(n, dtype=bool)
    status = np.full(n, Status.OK.value, dtype="<U16")
    reasons = np.full(n, "", dtype=object)
    for i in range(n):
        if loads.force[i] == 0.0:
            continue
        found = least.at(i)
        mu[i], attained[i], x[i] = found.s, found.attained, np.nan
        if not np.isfinite(found.s):
            status[i] = Status.TIPS_OVER.value
            reasons[i] = "no contacts that only push hold it, whatever their friction"
            attained[i] = False
        elif found.attained and forces:
            solved = at_least_factor(loads.balance(i), least.family(i), found)
            x[i] = found.x if solved is None else solved.x
        if np.isfinite(found.s) and not found.exact:
            status[i] = Status.NOT_CONVERGED.value
            reasons[i] = "the least coefficient could not be proved to be the least"
    return RequiredFriction(
        mu=shaped(mu, loads.shape),
        forces=shaped(loads.newtons(x), loads.shape),
        attained=shaped(attained, loads.shape),
        status=shaped(status, loads.shape),
        reasons=shaped(reasons, loads.shape),
    )


class LeastFriction:
    """The least common coefficient of the items of ``loads``, in any order; each starts from the item nearest in number
    that is known, which saves work and decides nothing."""

    def __init__(self, loads: Loads) -> None:
        self.loads = loads
        self._memories: dict[int, tuple[Memory, float]] = {}

    def family(self, i: int) -> Family:
        """The cones of item i: one coefficient for all contacts."""
        k = self.loads.contacts
        return Family(np.ones(k), np.full(k, np.inf), self.loads.touching[i])

    def at(self, i: int) -> Factor:
        """The least coefficient of item i, whose load is not zero."""
        loads, held = self.loads, self.loads.balance(i)
        if held.left > ROUNDING:
            return Factor(np.inf, np.full((loads.contacts, 3), np.nan), np.zeros(len(held.b)), loads.touching[i])
        start: Start | None = None
        if self._memories:
            memory, s = self._memories[min(self._memories, key=lambda j: abs(j - i))]
            start = (*loads.recall(i, held, memory), s)
        found = least_factor(held.A, held.b, self.family(i), start)
        if found.resumable(loads.touching[i]):
            self._memories[i] = loads.remember(i, held, found.x, found.y), found.s
        return found

    def largest(self, bound: Array) -> Array:
        """(n,): the least coefficients of the items that decide which is the largest, nan of those that need no more
        for certain. ``bound`` (n,): coefficients with which the items balance, as those of any forces that do.

        The item of the largest bound is solved, until no bound is larger than what is known. Forces that bound other
        items are those of one that was solved, mended, and such as alternating projections find.
        """
        bound, most, known = np.array(bound), -1.0, np.full(self.loads.count, np.nan)
        unheld = (self.loads.left_over(self.loads.smallest) > ROUNDING) & (bound > -np.inf)
        if unheld.any():
            known[unheld] = np.inf
            return known
        x = np.zeros((self.loads.count, 3 * self.loads.contacts))
        while bound.max(initial=-np.inf) > most + CLOSE * max(1.0, most):
            i = int(bound.argmax())
            found = self.at(i)
            known[i], bound[i] = found.s, -np.inf
            if found.attained:
                bound = np.fmin(bound, self.bounds(i, found.x))
            if found.s > most:
                most = found.s
                args = self.loads.equations, self.loads.inverse, self.loads.load, self.loads.touching
                project(*args, most, ROUNDS, x, bound)
        return known

    def bounds(self, i: int, x: Array) -> Array:
        """(n,): coefficients with which the items balance for certain, by forces x (k, 3) of item i and the smallest
        ones that mend what these leave over; inf where that pulls."""
        world = self.loads.frames[i] @ x[..., None] * self.loads.force[i]
        with np.errstate(all="ignore"):
            here = (np.swapaxes(self.loads.frames, -1, -2) @ world)[..., 0] / self.loads.force[:, None, None]
            flat = here.reshape(len(here), -1)
            rest = np.einsum("nij,nj->ni", self.loads.equations, flat) + self.loads.load
            mended = (flat - np.einsum("nij,ni->nj", self.loads.inverse, rest)).reshape(here.shape)
        return np.where(np.isfinite(mended).all(axis=(1, 2)), ratios(mended).max(axis=1), np.inf)
