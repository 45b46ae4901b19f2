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
#: points of a rim's lower half that are looked at first; steps and rad a step of what follows
_ANGLES, _REFINED, _TURN = 65, 12, 0.1


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
    # both ends in one go: the smallest radius of every wheel, then the largest
    wanted = np.repeat([wheel.range[which] for which in (0, 1) for wheel in wheels], len(xy))
    twice = np.tile(np.arange(len(planes)), 2)
    found = _height_of(land, planes.take(twice), direction[twice], wanted).reshape(2, len(wheels), len(xy))
    return found[0], found[1]


def _height_of(land: Terrain, planes: Planes, direction: Array, radius: Array) -> Array:
    """The height (n,) along ``direction`` (n, 3) at which wheels, at ``planes`` for height 0, touch with ``radius``
    (n,): Newton with dR/dh = -N . d / N . u, kept between bounds that only come nearer."""
    h, chi = _guess(land, planes, direction, radius)
    low, high = np.full(len(h), -np.inf), np.full(len(h), np.inf)
    active = np.flatnonzero(np.isfinite(h))
    step = np.zeros_like(h)
    for _ in range(_STEPS):
        if not len(active):
            break
        d = direction[active]
        some = planes.take(active)
        here = Planes(some.centre + h[active, None] * d, some.ahead, some.up, some.lean, some.flat)
        found = contact.find(land, here, chi[active] - some.lean)
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
        with np.errstate(invalid="ignore"):
            both = 0.5 * (low[active] + high[active])
        outside = (trial <= low[active]) | (trial >= high[active])
        trial = np.where(outside & np.isfinite(both), both, trial)
        step[active] = trial - h[active]
        h[active] = np.where(touches | sunk, trial, np.nan)
        chi[active] = np.where(touches, found.phi + some.lean, chi[active])
        done = (np.abs(step[active]) <= CLOSE) & touches
        active = active[~done & np.isfinite(h[active])]
    h[active] = np.nan
    return h


def _guess(land: Terrain, planes: Planes, direction: Array, radius: Array) -> tuple[Array, Array]:
    """Where to start: the height (n,) and the contact angle chi (n,) at which the rim, lowered from above, meets the
    ground first. Of a few points of its lower half the one that meets it highest, then Newton on the two equations of
    the contact with the radius given. Nothing relies on it."""
    count = len(planes)
    with np.errstate(all="ignore"):
        floor = land.field_height(planes.centre[:, 0], planes.centre[:, 1])
        # from where the axle would be in the ground, and about the radius higher
        plain = np.where(np.isfinite(floor), floor - planes.centre[:, 2] + radius, np.nan)
        rise = np.sum(direction * [0.0, 0.0, 1.0], axis=1)
        angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _ANGLES + 2)[1:-1]
        rim = np.sin(angles)[:, None, None] * planes.ahead - np.cos(angles)[:, None, None] * planes.up
        at = (planes.centre + plain[:, None] * direction + radius[:, None] * rim).reshape(-1, 3)
        gap = (land.field_height(at[:, 0], at[:, 1]) - at[:, 2]).reshape(_ANGLES, count) / rise
        gap = np.where(np.isfinite(gap), gap, -np.inf)
        best = gap.argmax(axis=0)
        chi, h = angles[best], plain + gap[best, np.arange(count)]
        for _ in range(_REFINED):
            sine, cosine = np.sin(chi)[:, None], np.cos(chi)[:, None]
            u, t = sine * planes.ahead - cosine * planes.up, cosine * planes.ahead + sine * planes.up
            at = planes.centre + h[:, None] * direction + radius[:, None] * u
            f, g, H = land.field_jet(at[:, 0], at[:, 1])
            N = np.concatenate([-g, np.ones((count, 1))], axis=1)
            off, tangent = at[:, 2] - f, np.sum(N * t, axis=1)
            Ht = np.einsum("nij,nj->ni", H, t[:, :2])
            a, b = np.sum(N * direction, axis=1), radius * tangent
            c, d = (
                -np.sum(Ht * direction[:, :2], axis=1),
                -np.sum(N * u, axis=1) - radius * np.sum(Ht * t[:, :2], axis=1),
            )
            determinant = a * d - b * c
            turn = np.clip(-(a * tangent - c * off) / determinant, -_TURN, _TURN)
            # the height follows the turn, so that the point stays on the ground
            climb = -(off + b * turn) / a
            good = np.isfinite(turn) & np.isfinite(climb)
            chi, h = np.where(good, chi + turn, chi), np.where(good, h + climb, h)
            if not np.any(good & (np.abs(climb) + radius * np.abs(turn) > CLOSE)):
                break
    sane = np.isfinite(h) & (np.abs(chi) < 0.5 * np.pi)
    return np.where(sane, h, plain), np.where(sane, chi, 0.0)
