"""``bp.solve.torque_interval``: what a torque may be, over all forces that the ground may exert."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, Status
from bodyplan.solve.statics.cones import Cones
from bodyplan.solve.statics.conic import least
from bodyplan.solve.statics.equilibrium import Balance, Loads, friction
from bodyplan.solve.statics.item import on_faces, solve_item
from bodyplan.solve.statics.outcome import Outcome, shaped
from bodyplan.solve.statics.polish import polish_gain

#: residual of the conditions of optimality up to which an end of an interval counts
CLOSE = 1e-9


@dataclass(frozen=True, kw_only=True)
class TorqueInterval(Outcome):
    """``low`` and ``high`` (..., m): the least and the largest value of each of m torques over all admissible contact
    forces; -inf and inf where squeezing has no limit, nan where the status is not "ok". ``low_forces`` and
    ``high_forces`` (..., m, k, 3) N make them (nan where there is no limit). ``low, high = torque_interval(...)``."""

    low: Array
    high: Array
    low_forces: Array
    high_forces: Array

    def __iter__(self) -> Iterator[Array]:
        return iter((self.low, self.high))


def torque_interval(
    points: ArrayLike,
    normals: ArrayLike,
    com: ArrayLike,
    weight: ArrayLike,
    mu: ArrayLike,
    levers: ArrayLike,
    *,
    wrench: ArrayLike | None = None,
    touching: ArrayLike | None = None,
) -> TorqueInterval:
    """The interval of each torque sum_i lever_i . F_i over all contact forces F in equilibrium and within their cones.

    More contacts than needed leave forces, and so torques of motors, undetermined: this says by how much. ``levers``
    (..., m, k, 3): m torques, each with a lever in m (N m per N) for each of the k contacts, as the transposed
    Jacobian of the contacts has them. The other arguments are those of :func:`contact_forces`.

    Each end is a second-order cone program (Clarabel, the extra "solve"), finished by Newton's method. Raises
    InputError as :func:`contact_forces` does.
    """
    arms = finite(levers, "levers")
    if arms.ndim < 3 or arms.shape[-1] != 3:
        raise InputError(f"levers: expected shape (..., m, k, 3), got {arms.shape}.")
    m, k = arms.shape[-3], arms.shape[-2]
    if np.ndim(points) >= 2 and np.shape(points)[-2] != k:
        raise InputError(f"levers: {np.shape(points)[-2]} contacts have levers for {k}.")
    given = friction(mu, k)
    loads = Loads.of(
        points, normals, com, weight, wrench, touching, ("mu", given.shape[:-1]), ("levers", arms.shape[:-3])
    )
    n = loads.count
    flat = np.broadcast_to(given, (*loads.shape, k)).reshape(-1, k)
    arms = np.broadcast_to(arms, (*loads.shape, m, k, 3)).reshape(n, m, k, 3)
    ends = np.full((2, n, m), np.nan)
    x = np.full((2, n, m, k, 3), np.nan)
    status = np.full(n, Status.OK.value, dtype="<U16")
    reasons = np.full(n, "", dtype=object)
    for i in range(n):
        held = loads.balance(i)
        solved = solve_item(held, flat[i], loads.touching[i])
        status[i], reasons[i] = solved.status.value, solved.reason
        if solved.status is not Status.OK:
            continue
        equal = solved.held if solved.held is not held else on_faces(held.A, held.b, solved.cones)
        for j in range(m):
            gain = np.einsum("kij,ki->kj", loads.frames[i], arms[i, j])
            for side, sign in enumerate((-1.0, 1.0)):
                value, forces, fine = _end(equal, solved.cones, sign * gain, solved.x)
                x[side, i, j] = forces
                ends[side, i, j] = sign * (value * loads.force[i] if np.isfinite(value) else value)
                if not fine:
                    status[i] = Status.NOT_CONVERGED.value
                    reasons[i] = f"the interval of torque {j} could not be proved"
    newtons = np.einsum("nkij,snmkj->snmki", loads.frames, x) * loads.force[None, :, None, None, None]
    bad = status != Status.OK.value
    ends[:, bad], newtons[:, bad] = np.nan, np.nan
    return TorqueInterval(
        low=shaped(ends[0], loads.shape),
        high=shaped(ends[1], loads.shape),
        low_forces=shaped(newtons[0], loads.shape),
        high_forces=shaped(newtons[1], loads.shape),
        status=shaped(status, loads.shape),
        reasons=shaped(reasons, loads.shape),
    )


def _end(held: Balance, cones: Cones, gain: Array, x: Array) -> tuple[float, Array, bool]:
    """(largest gain . x, its x, proved)."""
    A, b = held.A, held.b
    k = len(cones.kind)
    push = gain.ravel()
    # the part that the equations determine, and the part that is free
    known = A.T @ (A @ push)
    free = push - known
    size, whole = float(np.linalg.norm(free)), float(np.linalg.norm(push))
    if size <= 1e-13 * whole or whole == 0.0:
        return float(known @ x.ravel()), x, True
    aim = (free / size).reshape(k, 3)
    found = least(A, b, cones, 0.0, aim)
    if found.status == "unbounded":
        return np.inf, np.full((k, 3), np.nan), True
    if found.status == "infeasible":
        return np.nan, x, False
    done = polish_gain(A, b, cones, aim, found.x, found.y)
    return float(push @ done.x.ravel()), done.x, done.residual <= CLOSE
