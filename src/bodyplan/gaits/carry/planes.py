"""The upright section of the ground by the plane of a wheel.

In the plane of a wheel let s count along its horizontal direction ``ahead`` and w along its steepest one, ``up``; both
are 0 at the wheel's centre c. The ground z = f(x, y) cuts it in the curve w = W(s) with

    h(s, w) = c_z + w up_z - f(c + s ahead + w up) = 0,
    W'  = (grad f . ahead) / n,      n = up_z - grad f . up,
    W'' = (a' Hess f a) / n,         a = ahead + W' up,

(x and y parts only). The plane of a wheel that does not lean is upright: then up = (0, 0, 1) and W is f along a line.
A point at a distance R from the centre in the direction chi from straight down is s = R sin(chi), w = -R cos(chi).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry.terrain import Terrain

#: a plane whose ``up`` leans less counts as upright
UPRIGHT = 1e-15
_STEPS = 40


@dataclass(frozen=True)
class Planes:
    """Planes of n wheels: ``centre`` (n, 3) m, unit vectors ``ahead`` (n, 3) (horizontal) and ``up`` (n, 3), and
    ``lean`` (n,) rad: the contact angle phi is chi - lean. ``flat`` (n,) True where the wheel lies on its side."""

    centre: Array
    ahead: Array
    up: Array
    lean: Array
    flat: BoolArray

    @staticmethod
    def of(centre: Array, ahead: Array, axle: Array) -> Planes:
        """Planes through ``centre`` (n, 3) across ``axle`` (n, 3); phi counts from the wheel's own down, at right
        angles to ``ahead`` (n, 3)."""
        up = -axle[:, 2:] * axle
        up[:, 2] += 1.0
        size = np.linalg.norm(up, axis=1)
        flat = size < 1e-9
        up = np.where(flat[:, None], [0.0, 0.0, 1.0], up) / np.where(flat, 1.0, size)[:, None]
        # upright to rounding: exactly upright, so that a section is a line on the map
        up[np.abs(up[:, :2]).max(axis=1, initial=0.0) < UPRIGHT] = (0.0, 0.0, 1.0)
        level = np.cross(axle, up)
        level[:, 2] = 0.0
        lean = np.arctan2(np.sum(ahead * up, axis=1), np.sum(ahead * level, axis=1))
        return Planes(centre, level, up, lean, flat)

    def __len__(self) -> int:
        return len(self.centre)

    @property
    def upright(self) -> BoolArray:
        """(n,) True where the plane is upright."""
        return np.asarray(~np.any(self.up[:, :2], axis=1))

    @property
    def rows(self) -> Array:
        """(n, 9): centre, ahead and up, as kernels take them."""
        return np.concatenate([self.centre, self.ahead, self.up], axis=1)

    def take(self, index: IntArray) -> Planes:
        """Some of the planes, (k,)."""
        return Planes(self.centre[index], self.ahead[index], self.up[index], self.lean[index], self.flat[index])

    def points(self, s: Array, w: Array) -> Array:
        """Points (n, 3) m of the planes at s, w (n,)."""
        return self.centre + s[:, None] * self.ahead + w[:, None] * self.up


@dataclass(frozen=True)
class Section:
    """The ground curve of n planes at one s each: W, W', W'' (n,), the ground's Hessian (n, 2, 2) and gradient (n, 2)
    there, n of the module's text (n,), and whether the curve was found."""

    w: Array
    first: Array
    second: Array
    gradient: Array
    hessian: Array
    steep: Array
    found: BoolArray


def section(ground: Terrain, planes: Planes, s: Array, guess: Array | None = None) -> Section:
    """The ground curve at ``s`` (n,) m, by Newton in w from ``guess`` (n,); exact at once where the plane is
    upright."""
    w = np.zeros(len(s)) if guess is None else np.array(guess)
    scale = 1e-15 * (1.0 + np.abs(planes.centre).max(axis=1, initial=0.0))
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            at = planes.points(s, w)
            f, g, hessian = ground.field_jet(at[:, 0], at[:, 1])
            n = planes.up[:, 2] - np.sum(g * planes.up[:, :2], axis=1)
            step = (f - at[:, 2]) / n
            w = w + step
            if not np.any(np.abs(step) > scale) or planes.upright.all():
                break
        first = np.sum(g * planes.ahead[:, :2], axis=1) / n
        along = planes.ahead[:, :2] + first[:, None] * planes.up[:, :2]
        second = np.einsum("ni,nij,nj->n", along, hessian, along) / n
        found = np.isfinite(w) & (n > 0.0) & (np.abs(step) <= 1e3 * scale + 1e-9 * np.abs(w))
        found |= np.isfinite(w) & planes.upright
    return Section(w, first, second, g, hessian, n, found)
