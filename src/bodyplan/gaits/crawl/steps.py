"""Steps of a crawl: who swings when, where the body is meant to be, and the way of a swinging foot over the ground."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError
from bodyplan.gaits.crawl import swing_kernel
from bodyplan.ground.base import Ground
from bodyplan.ground.near import clearance_up_to

#: places along a swing at which it is tried against the ground
PLACES = 49
#: share of the lift of a swing that it must keep from the ground in its middle
KEEP = 0.4
#: how a swing is raised where the ground is in its way, and how often; and how early it may rise before a step
RAISE, TRIES, EARLY = 1.3, 14, (1.0, 0.6, 0.35)
#: m of distances that rounding may change
EXACT = 1e-9
#: where a swing is tried, and a hump of height 1 there
INSIDE = np.linspace(0.0, 1.0, PLACES)[1:-1]
_HUMP = 64.0 * (INSIDE * (1.0 - INSIDE)) ** 3


@dataclass(frozen=True)
class Course:
    """Steady motion over ground: ``velocity`` (2,) m/s ahead and to the left in the body's heading, ``yaw_rate`` rad/s;
    at time 0 at ``start`` (2,) m with ``heading`` rad."""

    velocity: tuple[float, float]
    yaw_rate: float
    start: tuple[float, float]
    heading: float

    def at(self, t: float) -> tuple[Array, float]:
        """(position (2,) m, heading rad) at time t s, also before 0."""
        place, heading = self.along(np.array(t))
        return place, float(heading)

    def along(self, t: Array) -> tuple[Array, Array]:
        """Positions (..., 2) m and headings (...,) rad at times t (...,) s."""
        turn = self.yaw_rate * t
        # integral of the rotation by yaw_rate: t sinc and its partner, regular at no turn
        half = 0.5 * turn
        size = t * np.sinc(half / np.pi)
        way = self.heading + half
        c, s = np.cos(way), np.sin(way)
        (vx, vy), (x, y) = self.velocity, self.start
        return np.stack([x + size * (c * vx - s * vy), y + size * (s * vx + c * vy)], axis=-1), self.heading + turn


@dataclass(frozen=True, eq=False)
class Step:
    """Leg ``leg`` swings from ``lift_off`` to ``touch_down`` s while the body rests at ``pose`` (6,): x, y, z m, roll,
    pitch, yaw rad, which it reaches from that of the step before between ``begin`` and ``lift_off``. ``before`` and
    ``after`` (m, 3) m: centres of the feet; ``lift`` m and ``early`` of the swing. ``margin`` m: of support, the least
    of the swing; ``share``: of the sway."""

    leg: int
    begin: float
    lift_off: float
    touch_down: float
    pose: Array
    before: Array
    after: Array
    lift: float
    early: float
    margin: float
    share: float

    def foot(self, tau: Array) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration (S, 3) by tau of the swinging foot at ``tau`` (S,) in [0, 1]."""
        return swing_path(self.before[self.leg], self.after[self.leg], self.lift, self.early, tau)


def swing_path(start: Array, end: Array, lift: Any, early: Any, tau: Array) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration (..., 3) by tau (...,) in [0, 1] of feet on their ways from ``start`` to ``end``
    (..., 3), ``lift`` and ``early`` (...,); all broadcast.

    With Q of :func:`blend` the path is Q(tau) along and in height, and ``lift`` 64 tau^3 (1 - tau)^3 above that: rates
    and accelerations are 0 at both ends. With ``early`` < 1 a foot that steps up rises within that share of tau, and
    goes along in what is left of it from ``swing_kernel.WAIT`` (1 - early) on; a step down is its mirror image.
    """
    shape = np.broadcast_shapes(start.shape[:-1], end.shape[:-1], np.shape(lift), np.shape(early), tau.shape)
    first, last = (np.ascontiguousarray(np.broadcast_to(v, (*shape, 3))).reshape(-1, 3) for v in (start, end))
    high, soon, at = (np.array(np.broadcast_to(v, shape), np.float64).reshape(-1) for v in (lift, early, tau))
    out = np.empty((math.prod(shape), 3, 3))
    swing_kernel.swing(first, last, high, soon, at, out)
    out = out.reshape(*shape, 3, 3)
    return out[..., 0, :], out[..., 1, :], out[..., 2, :]


def clear_swings(ground: Ground, start: Array, end: Array, lift: float, radius: float) -> Iterator[tuple[float, float]]:
    """(lift, early) of swings that take a ball of ``radius`` m over the ground, the least raised first.

    They keep off the ground by KEEP of ``lift``, but no farther than their ends have room at their sides."""
    try:
        wanted = _wanted(ground, start[None], end[None], lift, np.array([radius]))
        tried = [(lift * RAISE**k, early) for k in range(TRIES) for early in EARLY]
        # most often the first will do; then all ways of one height at once
        begins = [0, 1, *range(len(EARLY), len(tried) + 1, len(EARLY))]
        for first, last in pairwise(begins):
            for shape, good in zip(
                tried[first:last], _each_clear(ground, start, end, tried[first:last], radius, wanted), strict=True
            ):
                if good:
                    yield shape
    except InputError:  # beyond the edge of the ground
        return


def clear_swing(ground: Ground, start: Array, end: Array, lift: float, radius: float) -> tuple[float, float] | None:
    """The first of :func:`clear_swings`, or None."""
    return next(clear_swings(ground, start, end, lift, radius), None)


def first_swings(ground: Ground, starts: Array, ends: Array, lift: float, radii: Array) -> BoolArray:
    """Whether (``lift``, 1) is the first of :func:`clear_swings` of each of some swings from ``starts`` to ``ends``
    (k, 3), of balls with ``radii`` (k,) m. Raises InputError where any of them leaves the ground."""
    wanted = _wanted(ground, starts, ends, lift, radii)
    places, _, _ = swing_path(starts[:, None], ends[:, None], lift, EARLY[0], INSIDE)
    return _clear(ground, places, radii, wanted)


def _each_clear(
    ground: Ground, start: Array, end: Array, shapes: list[tuple[float, float]], radius: float, wanted: Array
) -> Iterator[bool]:
    """Which of swings of some ``shapes`` (lift, early) are clear of the ground."""
    lifts, earlies = np.array(shapes).T
    places, _, _ = swing_path(start, end, lifts[:, None], earlies[:, None], INSIDE)
    radii = np.full(len(shapes), radius)
    try:
        good = _clear(ground, places, radii, wanted)
    except InputError:
        # as far as they stay over the ground, one by one
        for k in range(len(shapes)):
            yield bool(_clear(ground, places[k : k + 1], radii[k : k + 1], wanted)[0])
    else:
        yield from good.tolist()


def _wanted(ground: Ground, starts: Array, ends: Array, lift: float, radii: Array) -> Array:
    """How far (k, INSIDE) m balls have to keep off the ground on their ways."""
    up = 2.0 * radii[:, None, None] * np.array([0.0, 0.0, 1.0])
    sides = np.stack([starts, ends], axis=1) + up
    room = clearance_up_to(ground, sides, 2.0 * radii[:, None]).min(axis=1) - radii
    return np.asarray(np.minimum(KEEP * lift * _HUMP, np.maximum(room, 0.0)[:, None]) - EXACT)


def _clear(ground: Ground, places: Array, radii: Array, wanted: Array) -> BoolArray:
    """Which of balls at ``places`` (k, INSIDE, 3) of their ways keep ``wanted`` m off the ground."""
    enough = radii[:, None] + np.maximum(wanted, 0.0) + EXACT
    return np.asarray(np.all(clearance_up_to(ground, places, enough) - radii[:, None] >= wanted, axis=1))


def blend(tau: Array) -> tuple[Array, Array, Array]:
    """The quintic from 0 to 1 that begins and ends at rest without acceleration, and its derivatives."""
    t = tau
    return (
        t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
        30.0 * t**2 * (1.0 - t) ** 2,
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    )
