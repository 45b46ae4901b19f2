"""One item of a batch: the forces of the smallest norm, or why there are none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import Status
from bodyplan.solve.statics.cones import CONE, RAY, Cones, Family
from bodyplan.solve.statics.conic import least
from bodyplan.solve.statics.equilibrium import RANK, ROUNDING, Balance, balance
from bodyplan.solve.statics.factor import PROVED, Factor, faces, holds_with_any_friction, least_factor
from bodyplan.solve.statics.polish import WARM, polish_norm

#: share by which friction may be short of what is needed, or more than it
SHORT = 1e-12
#: share of more friction with which forces cannot be told from those with what is needed
JUST = 1e-9
#: size of multipliers, beside that of forces, from which on friction may be just enough
STEEP = 300.0
#: what equations on faces of cones may leave of the load
CONSISTENT = 1e-9


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
    A, b = held.A, held.b
    if start is not None:
        done = polish_norm(A, b, cones, start, WARM)
        if done.residual <= PROVED:
            return _settled(held, done.x), done.y
    found = least(A, b, cones, 1.0, np.zeros((len(cones.kind), 3)))
    if found.status == "infeasible" or not np.all(np.isfinite(found.x)):
        return None
    done = polish_norm(A, b, cones, found.y)
    return (_settled(held, done.x), done.y) if done.residual <= PROVED else None


def _settled(held: Balance, x: Array) -> Array:
    """x with what rounding leaves of the equations made up by the contacts that carry something: large forces that
    squeeze would leave a share of their size, and equilibrium comes before the edge of a cone."""
    rest = held.b - held.A @ x.ravel()
    if np.abs(rest).max(initial=0.0) <= 1e-14:
        return x
    size = np.linalg.norm(x, axis=1)
    loaded = np.repeat(size > 1e-6 * size.max(), 3)
    step = np.zeros(x.size)
    step[loaded] = np.linalg.lstsq(held.A[:, loaded], rest, rcond=RANK)[0]
    return x + step.reshape(x.shape)


def on_faces(A: Array, b: Array, cones: Cones) -> Balance:
    """The equations of forces that some cones hold to rays or to nothing."""
    k = len(cones.kind)
    allowed = np.zeros((k, 3, 3))
    allowed[cones.kind == CONE] = np.eye(3)
    rays = cones.kind == RAY
    allowed[rays] = cones.ray[rays][:, :, None] * cones.ray[rays][:, None, :]
    narrow = np.einsum("rki,kij->rkj", A.reshape(-1, k, 3), allowed).reshape(len(b), 3 * k)
    return balance(narrow, -b)


def solve_item(held: Balance, mu: Array, touching: BoolArray, start: Array | None = None) -> Solved:
    """The forces of the smallest norm in cones of coefficients mu (k,)."""
    A, b, left = held.A, held.b, held.left
    cones = Cones.of(mu, touching)
    k = len(mu)
    none, nothing = np.full((k, 3), np.nan), np.zeros(len(b))
    if left > ROUNDING:
        why = "the contacts cannot hold it whatever they do" if touching.any() else "nothing touches"
        return Solved(Status.TIPS_OVER, none, cones, held, nothing, np.inf, f"{why}, pushing or pulling")
    found = smallest(held, cones, start)
    # multipliers grow without bound where friction is just enough, and forces are then hard to tell from each other
    if found is not None and np.linalg.norm(found[1]) < STEEP * max(1.0, float(np.linalg.norm(found[0]))):
        return Solved(Status.OK, found[0], cones, held, found[1])
    common = least_factor(A, b, Family(np.ones(k), np.full(k, np.inf), touching))
    on = mu[touching]
    if np.all(on == on[0]):
        family, factor = Family(np.ones(k), np.full(k, np.inf), touching), common
        share = on[0] / common.s if common.s > 0.0 else np.inf if on[0] > 0.0 else 1.0
    else:
        family = Family(mu, np.full(k, np.inf), touching)
        factor = least_factor(A, b, family)
        share = 1.0 / factor.s if factor.s > 0.0 else np.inf
    if share < 1.0 - SHORT or (share <= 1.0 + SHORT and not factor.attained):
        return _failed(held, cones, common, on)
    just = at_least_factor(held, family, factor) if share <= 1.0 + (SHORT if found is not None else JUST) else None
    if just is not None:
        return just
    if found is not None:
        return Solved(Status.OK, found[0], cones, held, found[1])
    # contacts that can carry nothing are in the way of a proof
    narrow = Cones.of(mu, factor.kept)
    equations = on_faces(A, b, narrow)
    best = smallest(equations, narrow) if equations.left <= CONSISTENT else None
    if best is not None:
        return Solved(Status.OK, best[0], narrow, equations, best[1])
    why = "the smallest forces could not be proved to be so"
    return Solved(Status.NOT_CONVERGED, none, cones, held, nothing, common.s, why)


def at_least_factor(held: Balance, family: Family, found: Factor) -> Solved | None:
    """The smallest forces with the least factor of friction; None where they cannot be proved so."""
    cones = Family(family.slope, family.cap, found.kept).at(found.s)
    narrow = faces(held.A, cones, found.y) if found.s > 0.0 else Cones.of(np.zeros(len(cones.mu)), found.kept)
    equations = on_faces(held.A, held.b, narrow)
    best = smallest(equations, narrow) if equations.left <= CONSISTENT else None
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
