"""``bp.solve.required_friction``: the least coefficient with which a body stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.errors import Status
from bodyplan.solve.statics.equilibrium import ROUNDING, Loads, Memory, balance
from bodyplan.solve.statics.factor import Factor, Family, least_factor
from bodyplan.solve.statics.item import at_least_factor
from bodyplan.solve.statics.outcome import Outcome, shaped


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
) -> RequiredFriction:
    """The least friction coefficient, the same at all contacts, with which a body is in equilibrium.

    Arguments as of :func:`contact_forces`; without a ``wrench`` the size of the weight does not matter. On a plane it
    is the slope (the tangent of its angle) as long as the weight passes between the contacts.
    Needs the extra "solve" unless forces along the normals balance. Raises InputError as :func:`contact_forces` does.
    """
    loads = Loads.of(points, normals, com, weight, wrench, touching)
    n, k = loads.count, loads.contacts
    mu, x = np.zeros(n), np.zeros((n, k, 3))
    attained = np.ones(n, dtype=bool)
    status = np.full(n, Status.OK.value, dtype="<U16")
    reasons = np.full(n, "", dtype=object)
    equations = loads.equations()
    memory: tuple[Memory, float] | None = None
    for i in range(n):
        if loads.force[i] == 0.0:
            continue
        held = balance(equations[i], loads.load[i])
        family = Family(np.ones(k), np.full(k, np.inf), loads.touching[i])
        found = Factor(np.inf, np.full((k, 3), np.nan), np.zeros(len(held.b)), loads.touching[i])
        if held.left <= ROUNDING:
            start = None if memory is None else (*loads.recall(i, held, memory[0]), memory[1])
            found = least_factor(held.A, held.b, family, start)
        resumable = found.resumable(loads.touching[i])
        memory = (loads.remember(i, held, found.x, found.y), found.s) if resumable else None
        mu[i], attained[i], x[i] = found.s, found.attained, np.nan
        if not np.isfinite(found.s):
            status[i] = Status.TIPS_OVER.value
            reasons[i] = "no contacts that only push hold it, whatever their friction"
            attained[i] = False
        elif found.attained:
            solved = at_least_factor(held, family, found)
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
