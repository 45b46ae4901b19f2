"""``bp.solve.contact_forces``: what the ground does to each contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError, Status, UnknownNameError
from bodyplan.solve.statics.cones import CONE, RAY, Cones, Family, ratios
from bodyplan.solve.statics.equilibrium import ROUNDING, Balance, Loads, Memory, friction
from bodyplan.solve.statics.factor import Factor, Start, least_factor
from bodyplan.solve.statics.item import SHORT, Solved, at_least_factor, solve_item
from bodyplan.solve.statics.outcome import Outcome, shaped

OBJECTIVES = ("min_norm", "min_ratio")


@dataclass(frozen=True, kw_only=True)
class ContactForces(Outcome):
    """Forces of the ground on k contacts, over a batch (...,); single numbers and texts for a single item.

    ``forces`` (..., k, 3) N in the world, nan where the status is not "ok". ``ratio`` (..., k): tangential over normal
    force, 0 where a contact carries nothing; ``worst`` (...) the largest. ``residual`` (...): what they leave of force
    and moment, as a share of the load. ``needed`` (...): the least friction coefficient, at every contact, with which
    it would stand: where it slips; inf where it tips over whatever the friction, nan where it stands.

    ``status`` (...): "slips" where more friction would do, "tips_over" where none would.
    """

    forces: Array
    ratio: Array
    worst: Any
    residual: Any
    needed: Any


def contact_forces(
    points: ArrayLike,
    normals: ArrayLike,
    com: ArrayLike,
    weight: ArrayLike,
    mu: ArrayLike,
    objective: str = "min_norm",
    *,
    wrench: ArrayLike | None = None,
    touching: ArrayLike | None = None,
) -> ContactForces:
    """Forces F of the ground on point contacts that hold a body in equilibrium, within Coulomb's cones.

        sum F + weight + force = 0,   sum (p - com) x F + moment = 0,   |F_t| <= mu F . n   at every contact

    ``points`` (..., k, 3) m; ``normals`` (..., k, 3) out of the ground, of any length; ``com`` (..., 3) m. ``weight``:
    newtons downwards, along -z, as one number, or the force (..., 3) N that acts at ``com``. ``mu``: one number, or
    (..., k). ``wrench`` (..., 6): a further force N and moment N m about ``com`` on the body; with - m a and minus the
    rate of the angular momentum the motion is accounted for. ``touching`` (..., k) of True and False: contacts that do
    not touch carry nothing, whatever their points and normals say. All broadcast over the batch.

    ``objective``: "min_norm" takes the forces with the smallest sum of squares, which are unique; "min_ratio" those
    whose worst ratio of tangential to normal force is the smallest, and of these again the smallest sum of squares.

    Forces meet the conditions of optimality to rounding: a second-order cone program (Clarabel, the extra "solve")
    shows which cones hold forces back, Newton's method does the rest. Where none does they are the pseudo-inverse's.
    Paper *wheels* section 5, with sum F_z = + m g and F . n >= 0 in place of (25), (27), (28).

    Raises InputError for shapes that do not go together, a normal of length zero, a negative weight or friction.
    """
    given = friction(mu, _count(points))
    loads = Loads.of(points, normals, com, weight, wrench, touching, ("mu", given.shape[:-1]))
    return forces_of(loads, given, objective)


def forces_of(loads: Loads, mu: Array, objective: str = "min_norm") -> ContactForces:
    """:func:`contact_forces` of loads with coefficients ``mu`` (..., k), whose shape is part of theirs."""
    if objective not in OBJECTIVES:
        raise UnknownNameError("objective", objective, OBJECTIVES)
    k = loads.contacts
    flat = np.broadcast_to(mu, (*loads.shape, k)).reshape(-1, k)
    x = smallest_free(loads, flat)
    n = loads.count
    status = np.full(n, Status.OK.value, dtype="<U16")
    reasons, needed = np.full(n, "", dtype=object), np.full(n, np.nan)
    memory: tuple[Memory, float] | None = None
    for i in range(n):
        if loads.force[i] == 0.0 or (objective == "min_norm" and np.isfinite(x[i, 0, 0])):
            continue
        held, on = loads.balance(i), loads.touching[i]
        start = None if memory is None else (*loads.recall(i, held, memory[0]), memory[1])
        memory = None
        if objective == "min_ratio" and held.left <= ROUNDING:
            solved, found = _least_ratio(held, flat[i], on, start)
            if found.resumable(on):
                memory = loads.remember(i, held, found.x, found.y), found.s
        else:
            solved = solve_item(held, flat[i], on, None if start is None else start[1])
            if solved.status is Status.OK and solved.held is held:
                memory = loads.remember(i, held, solved.x, solved.y), 0.0
        x[i], status[i], reasons[i] = solved.x, solved.status.value, solved.reason
        if solved.status is not Status.OK:
            needed[i] = solved.needed
    ratio = np.where(loads.touching, ratios(x), 0.0)
    ratio[status != Status.OK.value] = np.nan
    return ContactForces(
        forces=shaped(loads.newtons(x), loads.shape),
        ratio=shaped(ratio, loads.shape),
        worst=shaped(ratio.max(axis=1), loads.shape),
        residual=shaped(loads.left_over(x), loads.shape),
        needed=shaped(needed, loads.shape),
        status=shaped(status, loads.shape),
        reasons=shaped(reasons, loads.shape),
    )


def smallest_free(loads: Loads, mu: Array) -> Array:
    """(n, k, 3) components of the smallest forces where these are within all cones mu (n, k), else nan."""
    x = loads.smallest
    kind = np.where(loads.touching, np.where(mu > 0.0, CONE, RAY), 0)
    ray = np.broadcast_to([1.0, 0.0, 0.0], x.shape)
    rounding = 1e-14 * np.abs(x).max(axis=(1, 2))
    x[np.abs(x).max(axis=2) <= rounding[:, None]] = 0.0
    inside = Cones(kind, mu, ray).outside(x).max(axis=1) <= rounding
    inside &= loads.left_over(x) <= ROUNDING
    x[~loads.touching] = 0.0
    x[kind == RAY, 1:] = 0.0
    x[~inside] = np.nan
    x[loads.force == 0.0] = 0.0
    return np.asarray(x)


def _least_ratio(held: Balance, mu: Array, touching: BoolArray, start: Start | None) -> tuple[Solved, Factor]:
    """The forces of the least worst ratio and of these the smallest; the factor is a start for the next item."""
    alike = bool(np.all(mu[touching] == mu[touching][0]))
    family = Family(np.ones(len(mu)), np.full(len(mu), np.inf) if alike else mu, touching)
    found = least_factor(held.A, held.b, family, start)
    if not found.s <= mu[touching].max() * (1.0 + SHORT):
        return solve_item(held, mu, touching), found
    none, why = np.full((len(mu), 3), np.nan), "the forces of the least ratio could not be proved the smallest"
    if found.attained:
        solved = at_least_factor(held, family, found) if found.exact else None
        if solved is not None:
            return solved, found
    else:
        why = f"the worst ratio has no smallest value: it tends to {found.s:.4g} as forces grow without bound"
    return Solved(Status.NOT_CONVERGED, none, Cones.of(mu, touching), held, found.y, found.s, why), found


def _count(points: ArrayLike) -> int:
    shape = np.shape(points)
    if len(shape) < 2 or shape[-1] != 3:
        raise InputError(f"points: expected shape (..., k, 3), got {shape}.")
    return int(shape[-2])
