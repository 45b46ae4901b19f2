"""One item of a batch: the forces of the smallest norm, or why there are none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import Status
from bodyplan.solve.statics.cones import CONE, RAY, Cones
from bodyplan.solve.statics.conic import least
from bodyplan.solve.statics.equilibrium import ROUNDING, Balance, balance
from bodyplan.solve.statics.factor import PROVED, Factor, Family, faces, holds_with_any_friction, least_factor
from bodyplan.solve.statics.polish import polish

#: share by which friction may be short of what is needed
SHORT = 1e-11


class Solved(NamedTuple):
    """Forces ``x`` (k, 3) in ``cones`` with the equations ``held``; ``y`` their multipliers. Or why not: ``status``,
    ``reason`` and the least common coefficient ``needed``."""

    status: Status
    x: Array
    cones: Cones
    held: Balance
    y: Array
    needed: float = np.nan
    reason: str = ""


def smallest(held: Balance, cones: Cones, start: Array | None = None) -> tuple[Array, Array] | None:
    """(x, y) of the smallest norm, exact; None where there is none or it cannot be proved."""
    A, b, _ = held
    k = len(cones.kind)
    gain = np.zeros((k, 3))
    if start is not None and len(start) == len(b):
        done = polish(A, b, cones, 1.0, gain, cones.nearest((A.T @ start).reshape(k, 3))[0], start)
        if done.residual <= PROVED:
            return done.x, done.y
    found = least(A, b, cones, 1.0, gain)
    if found.status == "infeasible" or not np.all(np.isfinite(found.x)):
        return None
    done = polish(A, b, cones, 1.0, gain, found.x, found.y)
    return (done.x, done.y) if done.residual <= PROVED else None


def on_faces(A: Array, b: Array, cones: Cones) -> Balance:
    """The equations of forces that some cones hold to rays or to nothing."""
    k = len(cones.kind)
    allowed = np.zeros((k, 3, 3))
    allowed[cones.kind == CONE] = np.eye(3)
    rays = cones.kind == RAY
    allowed[rays] = cones.ray[rays][:, :, None] * cones.ray[rays][:, None, :]
    narrow = np.einsum("rki,kij->rkj", A.reshape(-1, k, 3), allowed).reshape(len(b), 3 * k)
    return balance(narrow, -b) if len(b) else Balance(A, b, 0.0)


def solve_item(held: Balance, mu: Array, touching: BoolArray, start: Array | None = None) -> Solved:
    """The forces of the smallest norm in cones of coefficients mu (k,)."""
    A, b, left = held
    cones = Cones.of(mu, touching)
    k = len(mu)
    none, nothing = np.full((k, 3), np.nan), np.zeros(len(b))
    if left > ROUNDING:
        why = "the contacts cannot hold it whatever they do" if touching.any() else "nothing touches"
        return Solved(Status.TIPS_OVER, none, cones, held, nothing, np.inf, f"{why}, pushing or pulling")
    found = smallest(held, cones, start)
    if found is not None:
        return Solved(Status.OK, found[0], cones, held, found[1])
    common = least_factor(A, b, Family(np.ones(k), np.full(k, np.inf), touching))
    alike = bool(np.all(mu[touching] == mu[touching][0]))
    if alike:
        family, least_of = Family(np.ones(k), np.full(k, np.inf), touching), common
        within = common.s <= mu[touching][0] * (1.0 + SHORT)
    else:
        family = Family(mu, np.full(k, np.inf), touching)
        least_of = least_factor(A, b, family)
        within = least_of.s <= 1.0 + SHORT
    if not within or not least_of.attained:
        return _failed(held, cones, common, mu[touching])
    at_least = at_least_factor(held, family, least_of)
    return at_least if at_least is not None else Solved(
        Status.NOT_CONVERGED, none, cones, held, nothing, common.s, "the forces could not be proved the smallest"
    )  # fmt: skip


def at_least_factor(held: Balance, family: Family, found: Factor) -> Solved | None:
    """The smallest forces with the least factor of friction; None where they cannot be proved so."""
    cones, _ = family.at(found.s)
    narrow = faces(held.A, cones, found.y) if found.s > 0.0 else Cones.of(np.zeros(len(cones.mu)), family.touching)
    equations = on_faces(held.A, held.b, narrow)
    best = smallest(equations, narrow) if equations.left <= 1e-9 else None
    if best is None:
        return None
    return Solved(Status.OK, best[0], narrow, equations, best[1], found.s)


def _failed(held: Balance, cones: Cones, common: Factor, mu: Array) -> Solved:
    none, nothing = np.full((len(cones.mu), 3), np.nan), np.zeros(len(held.b))
    if np.isfinite(common.s):
        has = f"{mu.min():.4g}" if mu.min() == mu.max() else f"{mu.min():.4g} to {mu.max():.4g}"
        more = "" if common.attained else " more than"
        why = f"needs{more} a friction coefficient of {common.s:.4g} at every contact, has {has}"
        return Solved(Status.SLIPS, none, cones, held, nothing, common.s, why)
    pushing = holds_with_any_friction(held.A, held.b, cones.kind != 0)
    why = "no friction is enough" if pushing else "no contacts that only push hold it, whatever their friction"
    return Solved(Status.TIPS_OVER, none, cones, held, nothing, np.inf, why)
