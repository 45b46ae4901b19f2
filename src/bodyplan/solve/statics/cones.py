"""Friction cones: what contacts may do, and how far forces are from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray

#: share of the largest force that is none
ROUNDING = 1e-12
#: what a contact may do: nothing, push along one direction, push within a cone
NOTHING, RAY, CONE = 0, 1, 2


@dataclass(frozen=True)
class Cones:
    """What the forces of k contacts may be, in components (normal, two tangents).

    ``kind`` (k,) is :data:`NOTHING`, :data:`RAY` (along ``ray`` (k, 3), unit vectors) or :data:`CONE`, |tangential| <=
    ``mu`` (k,) times normal.
    """

    kind: IntArray
    mu: Array
    ray: Array

    @staticmethod
    def of(mu: Array, touching: BoolArray | None = None) -> Cones:
        """Cones of coefficients mu (k,); without friction a cone is the ray along the normal."""
        kind = np.where(mu > 0.0, CONE, RAY)
        if touching is not None:
            kind = np.where(touching, kind, NOTHING)
        return Cones(kind, mu, np.tile([1.0, 0.0, 0.0], (len(mu), 1)))

    def outside(self, x: Array) -> Array:
        """(..., k): how far x (..., k, 3) is outside of its cone or off its ray, 0 where within."""
        excess = np.maximum(np.hypot(x[..., 1], x[..., 2]) - self.mu * x[..., 0], -x[..., 0])
        along = np.maximum(np.sum(x * self.ray, axis=-1), 0.0)
        off = np.linalg.norm(x - along[..., None] * self.ray, axis=-1)
        out = np.where(self.kind == RAY, off, np.where(self.kind == CONE, excess, np.linalg.norm(x, axis=-1)))
        return np.maximum(out, 0.0)


def ratios(x: Array) -> Array:
    """(..., k): tangential over normal force of components x (..., k, 3); 0 where a force is rounding of the largest
    one, inf without or against a normal force."""
    r, n = np.hypot(x[..., 1], x[..., 2]), x[..., 0]
    size = np.hypot(r, n)
    some = size > ROUNDING * size.max(axis=-1, keepdims=True, initial=0.0)
    pushes = some & (n > 0.0)
    return np.where(pushes, r / np.where(pushes, n, 1.0), np.where(some, np.inf, 0.0))


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

    def at(self, s: float) -> Cones:
        """The cones of factor s."""
        return Cones(self.kind, np.minimum(self.cap, s * self.slope), self._along)

    @property
    def widest(self) -> Cones:
        """The cones of all contacts at their caps."""
        return Cones(self.kind, self.cap, self._along)

    @property
    def _along(self) -> Array:
        return np.tile([1.0, 0.0, 0.0], (len(self.slope), 1))

    def needs(self, x: Array) -> float:
        """The least s whose cones have x in them, inf where none has."""
        r = ratios(x)
        loaded = r > 0.0
        free = loaded & (self.kind == CONE) & (r <= self.cap * (1.0 + 1e-9))
        if np.any(loaded & ~free):
            return np.inf
        return float((r[free] / self.slope[free]).max(initial=0.0))
