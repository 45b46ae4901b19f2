"""Friction cones: the nearest force within them, and how it follows what is asked for."""

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

    def nearest(self, z: Array) -> tuple[Array, Array, Array]:
        """The nearest x (k, 3) to z (k, 3), its derivative D (k, 3, 3), and its derivative (k, 3) by mu."""
        mu, r = self.mu, np.hypot(z[:, 1], z[:, 2])
        way = z[:, 1:] / np.where(r > 0.0, r, 1.0)[:, None]
        along = (z[:, 0] + mu * r) / (1.0 + mu**2)
        slope = r / (1.0 + mu**2) - 2.0 * mu * along / (1.0 + mu**2)
        edge = np.concatenate([np.ones((len(mu), 1)), mu[:, None] * way], axis=1)
        D = edge[:, :, None] * edge[:, None, :] / (1.0 + mu**2)[:, None, None]
        turns = mu * along / np.where(r > 0.0, r, 1.0)
        D[:, 1:, 1:] += turns[:, None, None] * (np.eye(2) - way[:, :, None] * way[:, None, :])
        x = along[:, None] * edge
        by_mu = slope[:, None] * edge
        by_mu[:, 1:] += along[:, None] * way

        inside, outside = r <= mu * z[:, 0], mu * r <= -z[:, 0]
        x, D = np.where(inside[:, None], z, x), np.where(inside[:, None, None], np.eye(3), D)
        push = np.sum(z * self.ray, axis=1)
        is_ray = self.kind == RAY
        x = np.where(is_ray[:, None], np.maximum(push, 0.0)[:, None] * self.ray, x)
        D = np.where(is_ray[:, None, None], self.ray[:, :, None] * self.ray[:, None, :], D)
        none = (self.kind == NOTHING) | np.where(is_ray, push <= 0.0, outside)
        x, D = np.where(none[:, None], 0.0, x), np.where(none[:, None, None], 0.0, D)
        return x, D, np.where((none | inside | is_ray)[:, None], 0.0, by_mu)

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
