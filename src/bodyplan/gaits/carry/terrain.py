"""Grounds as wheels see them: heights with derivatives and bounds, or steps."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Protocol

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.ground.field import Field
from bodyplan.ground.nearest import Bounds, JetFunction
from bodyplan.ground.plane import Plane
from bodyplan.ground.profile import Profile


class Terrain(Protocol):
    """What contacts ask of a ground; see :class:`bodyplan.ground.field.Field`."""

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Height (n,), gradient (n, 2) and Hessian (n, 2, 2)."""

    def field_height(self, x: Array, y: Array) -> Array:
        """The height (n,) alone."""

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        """Bounds over boxes with corners (n, 2)."""

    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        """Rate (n, 2, 2) of the Hessian for points that move by dx, dy (n,)."""

    def region_bounds(self, low: Array, high: Array) -> tuple[float, float]:
        """(highest ground, largest norm of its Hessian) over a box with corners (2,), loosely."""

    def field_creases(self) -> Sequence[JetFunction]:
        """Functions whose zeros are the lines where the ground has no derivative."""

    @property
    def field_box(self) -> Array:
        """Corners (2, 2) of the rectangle on which the ground is given."""


class Slope:
    """A plane as terrain."""

    def __init__(self, plane: Plane) -> None:
        self.level, self.slope = plane.level, np.array(plane.slope)

    @property
    def field_box(self) -> Array:
        return np.array([[-np.inf, -np.inf], [np.inf, np.inf]])

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        g = np.empty((len(x), 2))
        g[:] = self.slope
        return self.field_height(x, y), g, np.zeros((len(x), 2, 2))

    def field_height(self, x: Array, y: Array) -> Array:
        return np.asarray(self.level + self.slope[0] * x + self.slope[1] * y)

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        ends = np.sort([low * self.slope, high * self.slope], axis=0).sum(axis=-1) + self.level
        return Bounds(ends, np.zeros((2, len(low), 2, 2)), np.zeros(len(low)))

    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        return np.zeros((len(x), 2, 2))

    def region_bounds(self, low: Array, high: Array) -> tuple[float, float]:
        return float(self.field_bounds(low[None], high[None]).z[1, 0]), 0.0

    def field_creases(self) -> Sequence[JetFunction]:
        return ()


class Steps:
    """The floor of a profile as terrain: level treads between ``xs`` (k,) at ``zs`` (k + 1,) m, upright faces. At a
    step the higher level counts; contacts with treads, faces and edges are found by
    :mod:`bodyplan.gaits.carry.steps`."""

    def __init__(self, profile: Profile) -> None:
        self.xs, self.zs = profile.floor_levels

    @property
    def field_box(self) -> Array:
        return np.array([[-np.inf, -np.inf], [np.inf, np.inf]])

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        return self.field_height(x, y), np.zeros((len(x), 2)), np.zeros((len(x), 2, 2))

    def field_height(self, x: Array, y: Array) -> Array:
        before, after = (self.zs[np.searchsorted(self.xs, x, side=side)] for side in ("left", "right"))
        return np.maximum(before, after)

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        first = np.searchsorted(self.xs, low[:, 0], side="left")
        last = np.searchsorted(self.xs, high[:, 0], side="right")
        ends = [[f(self.zs[a : b + 1]) for a, b in zip(first, last, strict=True)] for f in (np.min, np.max)]
        # nothing is known of derivatives where there is a step
        edge = np.where(last > first, np.inf, 0.0)[:, None, None] * np.ones((2, 2))
        return Bounds(np.array(ends), np.stack([-edge, edge]), np.where(last > first, np.inf, 0.0))

    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        return np.zeros((len(x), 2, 2))

    def region_bounds(self, low: Array, high: Array) -> tuple[float, float]:
        bounds = self.field_bounds(low[None], high[None])
        return float(bounds.z[1, 0]), float(bounds.hessian[1, 0, 0, 0])

    def field_creases(self) -> Sequence[JetFunction]:
        return (partial(_from_step, self.xs),) if len(self.xs) else ()


def _from_step(xs: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """x less that of the nearest step, with its derivatives."""
    nearest = xs[np.abs(x[:, None] - xs).argmin(axis=1)]
    return x - nearest, np.tile([1.0, 0.0], (len(x), 1)), np.zeros((len(x), 2, 2))


def terrain(ground: Ground) -> Terrain:
    """A ground that wheels can roll on: a plane, a surface, a height map, or a profile under an open sky. InputError
    for others."""
    if isinstance(ground, Plane):
        return Slope(ground)
    if isinstance(ground, Field):
        return ground
    if isinstance(ground, Profile):
        if np.isfinite(ground.ceiling_height(np.append(ground.breaks, 0.0))).any():
            raise InputError("ground: wheels roll under an open sky; this profile has a ceiling.")
        return Steps(ground)
    raise InputError(f"ground: wheels roll on plane, surface, height_map and profile, got {ground.kind!r}.")
