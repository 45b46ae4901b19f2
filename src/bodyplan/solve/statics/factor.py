"""The least friction with which forces balance, and what it says of the forces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.solve.statics.cones import CONE, NOTHING, RAY, Cones, ratios
from bodyplan.solve.statics.conic import least_excess
from bodyplan.solve.statics.equilibrium import ROUNDING
from bodyplan.solve.statics.polish import PolishedRatio, polish_ratio

#: forces beyond this many times the load: squeezing that the least friction needs without bound
SQUEEZED = 1e5
#: coefficients beyond this are no friction
MOST = 1e8
#: residual of the conditions of optimality up to which a solution is one
PROVED = 1e-11


@dataclass(frozen=True)
class Family:
    """Cones of coefficient min(``cap`` (k,), s ``slope`` (k,)) for every s >= 0; ``touching`` (k,)."""

    slope: Array
    cap: Array
    touching: BoolArray

    @property
    def kind(self) -> IntArray:
        free = (self.slope > 0.0) & (self.cap > 0.0)
        return np.where(self.touching, np.where(free, CONE, RAY), NOTHING)

    def at(self, s: float) -> tuple[Cones, Array]:
        """The cones of factor s, and the rate of their coefficients by s."""
        mu = np.minimum(self.cap, s * self.slope)
        along = np.tile([1.0, 0.0, 0.0], (len(mu), 1))
        return Cones(self.kind, mu, along), np.where(s * self.slope < self.cap, self.slope, 0.0)

    def needs(self, x: Array) -> float:
        """The least s whose cones have x in them, inf where none has."""
        r = ratios(x)
        loaded = r > 0.0
        free = loaded & (self.kind == CONE) & (r <= self.cap * (1.0 + 1e-9))
        if np.any(loaded & ~free):
            return np.inf
        return float((r[free] / self.slope[free]).max(initial=0.0))


class Factor(NamedTuple):
    """The least factor ``s`` (inf: none does), forces ``x`` (k, 3) of it, ``y`` (r,) of length 1 that proves it (0:
    none needed), ``attained``: False where s itself needs forces without bound and any more does not; ``exact``: if
    the conditions of optimality hold to rounding."""

    s: float
    x: Array
    y: Array
    attained: bool = True
    exact: bool = True


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


def least_factor(A: Array, b: Array, family: Family, start: Factor | None = None) -> Factor:
    """The least s with forces in the cones of ``family`` that balance: A x = b.

    The ratio of a fraction's worst case is quasi-convex: s goes to the worst ratio of the forces that exceed the cones
    of the last s by the least (Crouzeix, Ferland and Schaible 1985), each a second-order cone program, and Newton's
    method finishes. ``start``: the result for a similar item, tried first.
    """
    from scipy.optimize import nnls

    k, r = len(family.slope), len(b)
    nothing = np.zeros(r)
    normal, left = nnls(A[:, 0::3], b)
    if left <= ROUNDING * max(1.0, float(np.linalg.norm(b))):
        x = np.zeros((k, 3))
        x[:, 0] = normal
        return Factor(0.0, x, nothing)
    if not holds_with_any_friction(A, b, family.kind == CONE):
        return Factor(np.inf, np.zeros((k, 3)), nothing)
    if start is not None and np.isfinite(start.s) and start.s > 0.0 and start.attained and len(start.y) == r:
        done = polish_ratio(A, b, family.at, start.x, start.y, start.s)
        if _proved(A, family, done):
            return Factor(done.s, done.x, done.y)
    return _searched(A, b, family)


def _searched(A: Array, b: Array, family: Family) -> Factor:
    k = len(family.slope)
    bound = SQUEEZED * max(1.0, float(np.linalg.norm(b)))
    low, high, s = 0.0, np.inf, 1.0
    best: tuple[Array, Array] | None = None
    weight = np.ones(k)
    for _ in range(60):
        found = least_excess(A, b, family.kind, s * family.slope, family.cap, weight, bound)
        x = found.x + (A.T @ (b - A @ found.x.ravel())).reshape(k, 3)
        reached = family.needs(np.where(np.abs(x) < 1e-9 * np.abs(x).max(initial=0.0), 0.0, x))
        if found.slack > 1e-9:
            low = max(low, s)
        else:
            # forces at rounding's distance from the cones of s
            reached = min(reached, s)
        if reached < high:
            high = reached
        best = x, found.y
        if np.isfinite(high) and (abs(found.slack) < 1e-6 or high - low <= 1e-6 * high):
            done = polish_ratio(A, b, family.at, x, found.y, min(max(s, low), high))
            if _proved(A, family, done) and low * (1.0 - 1e-5) <= done.s <= high * (1.0 + 1e-5):
                return Factor(done.s, done.x, done.y)
            if high - low <= 1e-9 * high or abs(found.slack) < 1e-9:
                break
        if not np.isfinite(high):
            s *= 4.0
            if s > MOST:
                return Factor(np.inf, np.zeros((k, 3)), np.zeros(len(b)))
        else:
            # the worst ratio of the last forces, unless that hardly moves
            s = high if high < 0.9 * s or high - low < 0.1 * high else 0.5 * (low + high)
            weight = np.clip(x[:, 0], 1e-3, 1.0)
    assert best is not None
    x, y = best
    if np.abs(x).max() > 0.1 * bound:
        return _squeezed(A, b, family, x, y, low, high)
    return Factor(high, x, y / max(float(np.linalg.norm(y)), 1e-300), exact=False)


def _squeezed(A: Array, b: Array, family: Family, x: Array, y: Array, low: float, high: float) -> Factor:
    """The factor from which on contacts can squeeze without bound: that of forces in balance with each other."""
    size = float(np.abs(x).max())
    done = polish_ratio(A, np.zeros(len(b)), family.at, x / size, y, high)
    near = low * (1.0 - 1e-2) <= done.s <= high
    exact = done.residual <= PROVED and bool(near) and float(np.abs(done.x).max()) > 0.1
    return Factor(max(done.s, 0.0) if exact else high, np.zeros_like(x), done.y, attained=False, exact=exact)


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
