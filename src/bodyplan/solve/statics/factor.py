"""The least friction with which forces balance, and what it says of the forces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.solve.statics.cones import CONE, NOTHING, RAY, Cones, Family
from bodyplan.solve.statics.conic import least_excess
from bodyplan.solve.statics.equilibrium import RANK, ROUNDING, balance
from bodyplan.solve.statics.polish import WARM, PolishedRatio, polish_ratio

#: forces up to this many times the load are looked at first
MODERATE = 1e2
#: forces beyond this many times the load: squeezing that the least friction needs without bound
SQUEEZED = 1e5
#: how near forces of that size come to the least friction
NEAR = 5e-3
#: shares of the largest force below which a contact may carry nothing
FAINT = (1e-6, 1e-4, 1e-2)
#: coefficients beyond this are no friction
MOST = 1e8
#: the least factor that a search starts from, and how many of its first steps Newton's method tries to finish
LEAST_GUESS, EARLY = 1e-2, 4
#: residual of the conditions of optimality up to which a solution is one
PROVED = 1e-11
#: and up to which a few steps of Newton's method have been enough
EXACT = 1e-14


#: x, y and s of a similar problem
Start = tuple[Array, Array, float]


class Factor(NamedTuple):
    """The least factor ``s`` (inf: none does), forces ``x`` (k, 3) of it, ``y`` (r,) that proves it (0: none needed),
    by the contacts ``kept`` (k,), the only ones that can carry something with this friction. ``attained``: False where
    s itself needs forces without bound and any more does not; ``exact``: if the conditions of optimality hold to
    rounding."""

    s: float
    x: Array
    y: Array
    kept: BoolArray
    attained: bool = True
    exact: bool = True

    def resumable(self, touching: BoolArray) -> bool:
        """Whether a similar item can start from here."""
        return 0.0 < self.s < np.inf and self.attained and np.array_equal(self.kept, touching)


def holds_with_any_friction(A: Array, b: Array, free: BoolArray) -> bool:
    """Whether contacts that push, and slide nowhere where ``free`` (k,), can balance the load."""
    from scipy.optimize import nnls

    normal = A[:, 0::3]
    tangent = np.concatenate([A[:, 1::3][:, free], A[:, 2::3][:, free]], axis=1)
    U, s, _ = np.linalg.svd(tangent, full_matrices=True)
    rank = int(np.sum(s > 1e-10))
    rest = U[:, rank:].T
    if not len(rest):
        return True
    _, left = nnls(rest @ normal, rest @ b)
    return bool(left <= ROUNDING * max(1.0, float(np.linalg.norm(b))))


def along_normals(A: Array, b: Array) -> Array | None:
    """Normal forces (k,) that balance the load by themselves, or None."""
    from scipy.optimize import nnls

    normal, left = nnls(A[:, 0::3], b)
    return np.asarray(normal) if left <= ROUNDING * max(1.0, float(np.linalg.norm(b))) else None


def least_factor(A: Array, b: Array, family: Family, start: Start | None = None) -> Factor:
    """The least s with forces in the cones of ``family`` that balance: A x = b.

    The ratio of a fraction's worst case is quasi-convex: s goes to the worst ratio of the forces that exceed the cones
    of the last s by the least (Crouzeix, Ferland and Schaible 1985), each a second-order cone program, and Newton's
    method finishes. ``start``: x, y and s of a similar item, tried first.
    """
    k, nothing = len(family.slope), np.zeros(len(b))
    if start is not None:
        done = polish_ratio(A, b, family, *start, WARM)
        if done.residual <= EXACT and _proved(A, family, done):
            return Factor(done.s, done.x, done.y, family.touching)
    normal = along_normals(A, b)
    if normal is not None:
        return Factor(0.0, normal[:, None] * np.array([1.0, 0.0, 0.0]), nothing, family.touching)
    if not holds_with_any_friction(A, b, family.kind == CONE):
        return Factor(np.inf, np.zeros((k, 3)), nothing, family.touching)
    return _searched(A, b, family, 1.0 if start is None else start[2])


def _searched(A: Array, b: Array, family: Family, guess: float) -> Factor:
    """With forces of moderate size, and only if these reach for more, with large ones; from a ``guess`` of the least
    factor on."""
    k, size = len(family.slope), max(1.0, float(np.linalg.norm(b)))
    s, high = min(max(guess, LEAST_GUESS), 1.0), np.inf
    for bound in (MODERATE * size, SQUEEZED * size):
        found = _descended(A, b, family, bound, s, high)
        if found.exact:
            return found
        idle = _idle(A, family.at(found.s), found) if np.isfinite(found.s) else np.zeros(k, dtype=bool)
        if idle.any():
            fewer = _without(A, b, family, idle)
            if fewer.s <= found.s:
                return fewer
        s = high = found.s
        if not np.isfinite(s):
            s = 1.0
    if not np.isfinite(found.s):
        return Factor(np.inf, np.zeros((k, 3)), np.zeros(len(b)), family.touching)
    if np.abs(found.x).max() > 0.1 * SQUEEZED * size:
        return _squeezed(A, family, found)
    return found


def _descended(A: Array, b: Array, family: Family, bound: float, s: float, high: float) -> Factor:
    """The least factor with forces up to ``bound``, from ``s`` on; at most ``high``."""
    k, floor = len(family.slope), 0.0
    weight = np.ones(k)
    best = np.zeros((k, 3)), np.zeros(len(b))
    for attempt in range(60):
        found = least_excess(A, b, family.kind, s * family.slope, family.cap, weight, bound)
        x = found.x + (A.T @ (b - A @ found.x.ravel())).reshape(k, 3)
        reached = family.needs(np.where(np.abs(x) < 1e-9 * np.abs(x).max(initial=0.0), 0.0, x))
        if found.slack > 1e-9:
            floor = max(floor, s)
        else:
            # forces at rounding's distance from the cones of s
            reached = min(reached, s)
        if reached <= high:
            high, best = reached, (x, found.y)
        if np.isfinite(high) and attempt < EARLY:
            # what is proved is the least, however far away the search still is
            near = polish_ratio(A, b, family, x, found.y, min(max(s, floor), high), WARM)
            if (
                near.residual <= EXACT
                and _proved(A, family, near)
                and floor * (1.0 - 1e-4) <= near.s <= high * (1.0 + 1e-4)
            ):
                return Factor(near.s, near.x, near.y, family.touching)
        if np.isfinite(high) and (abs(found.slack) < 1e-5 or high - floor <= 1e-5 * high):
            done = _finished(A, b, family, x, found.y, min(max(s, floor), high))
            if done.residual <= PROVED and floor * (1.0 - 1e-4) <= done.s <= high * (1.0 + 1e-4):
                return Factor(done.s, done.x, done.y, family.touching)
            if high - floor <= 1e-10 * high or abs(found.slack) < 1e-10:
                break
        if not np.isfinite(high):
            s *= 4.0
            if s > MOST:
                break
        else:
            # the worst ratio of the last forces, unless that hardly moves
            s = high if high < 0.9 * s or high - floor < 0.1 * high else 0.5 * (floor + high)
            weight = np.clip(x[:, 0], 1e-3, np.inf)
    y = best[1] / max(float(np.linalg.norm(best[1])), 1e-300)
    return Factor(high, best[0], y, family.touching, exact=False)


def _finished(A: Array, b: Array, family: Family, x: Array, y: Array, s: float) -> PolishedRatio:
    """The exact solution near (x, y, s); its residual is inf where it proves nothing. Where contacts carry next to
    nothing it may not show at once which of them carry nothing: then from the solution without them."""
    size = np.linalg.norm(x, axis=1)
    done = polish_ratio(A, b, family, x, y, s)
    for share in FAINT:
        if _proved(A, family, done):
            return done
        loaded = size > share * size.max()
        if loaded.all():
            continue
        some = Family(family.slope, family.cap, family.touching & loaded)
        first = polish_ratio(A, b, some, np.where(loaded[:, None], x, 0.0), y, s)
        if first.residual <= PROVED:
            done = polish_ratio(A, b, family, first.x, first.y, first.s, WARM)
    return done if _proved(A, family, done) else done._replace(residual=np.inf)


def _idle(A: Array, cones: Cones, found: Factor) -> BoolArray:
    """Contacts that cannot carry anything with this friction or less: all of A^T y points against forces in the cones,
    of theirs strictly, and yet the work of the load is none."""
    z = (A.T @ found.y).reshape(-1, 3)
    size = max(float(np.linalg.norm(z, axis=1).max()), 1e-300)
    along = (z[:, 0] + cones.mu * np.hypot(z[:, 1], z[:, 2])) / size
    against = bool(np.all(along[cones.kind != NOTHING] < 1e-7))
    none = np.linalg.norm(found.x, axis=1) < 1e-7 * np.abs(found.x).max()
    return np.asarray((cones.kind != NOTHING) & (along < -1e-4) & none & against)


def _without(A: Array, b: Array, family: Family, idle: BoolArray) -> Factor:
    """The least factor of the other contacts."""
    kept = family.touching & ~idle
    rest = np.where(np.repeat(kept, 3), A, 0.0)
    held = balance(rest, -b)
    if held.left > ROUNDING * max(1.0, float(np.linalg.norm(b))):
        return Factor(np.inf, np.zeros((len(kept), 3)), np.zeros(len(b)), kept)
    found = least_factor(held.A, held.b, Family(family.slope, family.cap, kept))
    return found._replace(y=_multipliers(rest, held.A.T @ found.y))


def _multipliers(A: Array, push: Array) -> Array:
    """y with A^T y = push."""
    return np.asarray(np.linalg.lstsq(A.T, push, rcond=RANK)[0], dtype=np.float64)


def _squeezed(A: Array, family: Family, found: Factor) -> Factor:
    """The factor from which on contacts can squeeze without bound: that of forces in balance with each other, here with
    normal forces that add up to the number of contacts."""
    k = len(family.slope)
    held = balance(np.vstack([A, np.tile([1.0, 0.0, 0.0], k)]), np.append(np.zeros(len(A)), -float(k)))
    none = np.zeros_like(found.x)
    if along_normals(held.A, held.b) is not None and found.s < 1e-2:
        return Factor(0.0, none, found.y, found.kept, attained=False)
    x = found.x * k / found.x[:, 0].sum()
    y = _multipliers(held.A, A.T @ found.y)
    done = polish_ratio(held.A, held.b, family, x, y, found.s)
    s, exact = done.s, _proved(held.A, family, done)
    if not exact or abs(s - found.s) > NEAR * (1.0 + found.s):
        stress = _descended(held.A, held.b, family, MODERATE * k, found.s, np.inf)
        s, exact = stress.s, stress.exact
    exact = exact and abs(s - found.s) <= NEAR * (1.0 + found.s)
    return Factor(s if exact else found.s, none, found.y, found.kept, False, exact)


def _proved(A: Array, family: Family, done: PolishedRatio) -> bool:
    """Whether the conditions hold and the friction that y counts on is of contacts that carry something."""
    if done.residual > PROVED or done.s <= 0.0:
        return False
    z = (A.T @ done.y).reshape(-1, 3)
    paid = np.hypot(z[:, 1], z[:, 2]) * family.slope * done.x[:, 0] * (done.s * family.slope < family.cap)
    return bool(paid.sum() > 1e-9)


def faces(A: Array, cones: Cones, y: Array) -> Cones:
    """The part of the cones of the least factor that forces in balance can have: where A^T y holds back, only the ray
    that it touches, or nothing."""
    z = (A.T @ y).reshape(-1, 3)
    size = np.linalg.norm(z, axis=1)
    tiny = 1e-8 * max(float(size.max(initial=0.0)), 1e-300)
    r = np.hypot(z[:, 1], z[:, 2])
    inner = z[:, 0] + cones.mu * r < -tiny
    on_ray = (cones.kind == RAY) & (z[:, 0] < -tiny)
    kind = np.where((size > tiny) & (cones.kind == CONE), np.where(inner, NOTHING, RAY), cones.kind)
    kind = np.where(on_ray, NOTHING, kind)
    edge = np.concatenate([np.ones((len(r), 1)), (cones.mu / np.where(r > 0.0, r, 1.0))[:, None] * z[:, 1:]], axis=1)
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    turned = (kind == RAY) & (cones.kind == CONE)
    return Cones(kind, cones.mu, np.where(turned[:, None], edge, cones.ray))
