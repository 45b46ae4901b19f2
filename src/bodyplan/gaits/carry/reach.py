"""At which heights a body is in reach of its wheels: every radius grows with the height, so that each is one
interval."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.carry import contact, orientation
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.pose import MODES, planes_of, stands
from bodyplan.gaits.carry.terrain import Terrain, terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground
from bodyplan.robot.model import Robot

#: m to which a height is found
CLOSE = 1e-12
_STEPS = 80


@dataclass(frozen=True)
class Reach:
    """Heights (...,) m at which a body keeps its roll, pitch and heading over a place: wheel by wheel from
    ``low[name]`` to ``high[name]``; of all of them from ``lowest`` to ``highest``, an empty interval (lowest >
    highest) where there is none. nan where there is no ground."""

    low: Mapping[str, Array]
    high: Mapping[str, Array]

    @property
    def lowest(self) -> Array:
        """(...,) m: above it no wheel is too large."""
        return np.asarray(np.max(list(self.low.values()), axis=0))

    @property
    def highest(self) -> Array:
        """(...,) m: below it no wheel is too small."""
        return np.asarray(np.min(list(self.high.values()), axis=0))

    @property
    def possible(self) -> BoolArray:
        """(...,) True where there is a height at which every wheel reaches the ground."""
        return np.asarray(self.lowest <= self.highest)

    @property
    def best(self) -> Array:
        """(...,) m: the height in the middle, farthest from both ends."""
        return 0.5 * (self.lowest + self.highest)


def reach(
    robot: Robot,
    ground: Ground,
    position: ArrayLike,
    height_mode: str = "absolute",
    roll: ArrayLike = 0.0,
    pitch: ArrayLike = 0.0,
    heading: ArrayLike = 0.0,
) -> Reach:
    """The heights that are in reach at ``position`` (..., 2) m, with ``roll``, ``pitch``, ``heading`` (...,) rad, as
    heights of ``height_mode``; see :func:`bodyplan.gaits.carry.pose`. All broadcast. Raises InputError."""
    wheels, land = Wheels.of(robot), terrain(ground)
    if height_mode not in MODES:
        raise UnknownNameError("height_mode", height_mode, MODES)
    place = finite(position, "position")
    if place.ndim == 0 or place.shape[-1] != 2:
        raise InputError(f"position: expected shape (..., 2), x and y, got {place.shape}.")
    angles = [finite(v, name) for v, name in ((roll, "roll"), (pitch, "pitch"), (heading, "heading"))]
    try:
        shape = np.broadcast_shapes(place.shape[:-1], *(v.shape for v in angles))
    except ValueError as error:
        raise InputError(f"position, roll, pitch, heading: shapes do not broadcast: {error}.") from error
    xy = np.broadcast_to(place, (*shape, 2)).reshape(-1, 2)
    a, b, c = (np.broadcast_to(v, shape).reshape(-1) for v in angles)
    rotation = orientation.matrix(orientation.yaw(c, a, b), a, b)
    low, high = heights(wheels, ground, land, xy, height_mode, rotation)
    return Reach(
        {wheel.name: low[k].reshape(shape) for k, wheel in enumerate(wheels)},
        {wheel.name: high[k].reshape(shape) for k, wheel in enumerate(wheels)},
    )


def heights(
    wheels: Wheels, ground: Ground, land: Terrain, xy: Array, mode: str, rotation: Array
) -> tuple[Array, Array]:
    """(lowest, highest) height (k, n) m of every wheel over x, y (n, 2) with orientations (n, 3, 3)."""
    origin = stands(ground, xy, np.zeros(len(xy)), mode)
    up = stands(ground, xy, np.ones(len(xy)), mode) - origin
    planes = planes_of(wheels, origin, rotation)
    direction = np.tile(up, (len(wheels), 1))
    ends = []
    for which in (0, 1):
        wanted = np.repeat([wheel.range[which] for wheel in wheels], len(xy))
        ends.append(_height_of(land, planes, direction, wanted).reshape(len(wheels), len(xy)))
    return ends[0], ends[1]


def _height_of(land: Terrain, planes: Planes, direction: Array, radius: Array) -> Array:
    """The height (n,) along ``direction`` (n, 3) at which wheels, at ``planes`` for height 0, touch with ``radius``
    (n,): Newton with dR/dh = -N . d / N . u, kept between bounds that only come nearer."""
    with np.errstate(all="ignore"):
        floor = land.field_jet(planes.centre[:, 0], planes.centre[:, 1])[0]
    # from where the axle would be in the ground, and about the radius higher
    h = np.where(np.isfinite(floor), floor - planes.centre[:, 2] + radius, np.nan)
    low, high = np.full(len(h), -np.inf), np.full(len(h), np.inf)
    active = np.flatnonzero(np.isfinite(h))
    step = np.zeros_like(h)
    for _ in range(_STEPS):
        if not len(active):
            break
        d = direction[active]
        some = planes.take(active)
        here = Planes(some.centre + h[active, None] * d, some.ahead, some.up, some.lean, some.flat)
        found = contact.find(land, here)
        touches = found.outcome == contact.TOUCHES
        sunk = found.outcome == contact.AXLE_BELOW
        miss = np.where(touches, found.radius - radius[active], -radius[active])
        low[active] = np.where((touches | sunk) & (miss < 0.0), np.fmax(low[active], h[active]), low[active])
        high[active] = np.where(touches & (miss >= 0.0), np.fmin(high[active], h[active]), high[active])
        u = (found.point - here.centre) / np.where(touches, found.radius, 1.0)[:, None]
        with np.errstate(all="ignore"):
            slope = -np.sum(found.normal * d, axis=1) / np.sum(found.normal * u, axis=1)
            newton = -miss / slope
        # along an upright face the radius does not change
        way = np.where(touches & np.isfinite(newton), newton, np.copysign(radius[active], -miss))
        trial = h[active] + way
        both = 0.5 * (low[active] + high[active])
        outside = (trial <= low[active]) | (trial >= high[active])
        trial = np.where(outside & np.isfinite(both), both, trial)
        step[active] = trial - h[active]
        h[active] = np.where(touches | sunk, trial, np.nan)
        done = (np.abs(step[active]) <= CLOSE) & touches
        active = active[~done & np.isfinite(h[active])]
    h[active] = np.nan
    return h
