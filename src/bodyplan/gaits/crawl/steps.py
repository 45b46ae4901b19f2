"""Steps of a crawl: who swings when, where the body is meant to be, and the way of a swinging foot over the ground."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.ground.near import clearance_up_to

#: places along a swing at which it is tried against the ground
PLACES = 49
#: share of the lift of a swing that it must keep from the ground in its middle
KEEP = 0.4
#: how a swing is raised where the ground is in its way, and how often; and how early it may rise before a step
RAISE, TRIES, EARLY = 1.3, 14, (1.0, 0.6, 0.35)
#: how long a step up that rises early waits before it goes along, as a share of what it is early by
WAIT = 0.6
#: m of distances that rounding may change
EXACT = 1e-9


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
        turn = self.yaw_rate * t
        # integral of the rotation by yaw_rate: t sinc and its partner, regular at no turn
        half = 0.5 * turn
        size = t * float(np.sinc(half / np.pi))
        way = self.heading + half
        c, s = np.cos(way), np.sin(way)
        vx, vy = self.velocity
        return np.array(self.start) + size * np.array([c * vx - s * vy, s * vx + c * vy]), self.heading + turn


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


def swing_path(start: Array, end: Array, lift: float, early: float, tau: Array) -> tuple[Array, Array, Array]:
    """Place, velocity and acceleration (S, 3) by tau (S,) in [0, 1] of a foot on its way from ``start`` to ``end``.

    With Q of :func:`blend` the path is Q(tau) along and in height, and ``lift`` 64 tau^3 (1 - tau)^3 above that: rates
    and accelerations are 0 at both ends. With ``early`` < 1 a foot that steps up rises within that share of tau, and
    goes along in what is left of it from WAIT (1 - early) on; a step down is its mirror image.
    """
    way = end - start
    wait = WAIT * (1.0 - early)
    windows = ((wait, 1.0), (0.0, early)) if way[2] >= 0.0 else ((0.0, 1.0 - wait), (1.0 - early, 1.0))
    (along, left, *along_rates), (climb, fall, *climb_rates) = (_within(tau, *window) for window in windows)
    hump, *hump_rates = (lift * v for v in _hump(tau))
    # told from the nearer end, so that feet are exactly there
    risen = np.stack([way[0] * along, way[1] * along, way[2] * climb + hump], axis=1)
    landing = np.stack([way[0] * left, way[1] * left, way[2] * fall - hump], axis=1)
    velocity, acceleration = (
        np.stack([way[0] * a, way[1] * a, way[2] * c + h], axis=1)
        for a, c, h in zip(along_rates, climb_rates, hump_rates, strict=True)
    )
    return np.where((tau > 0.5)[:, None], end - landing, start + risen), velocity, acceleration


def clear_swings(ground: Ground, start: Array, end: Array, lift: float, radius: float) -> Iterator[tuple[float, float]]:
    """(lift, early) of swings that take a ball of ``radius`` m over the ground, the least raised first.

    They keep off the ground by KEEP of ``lift``, but no farther than their ends have room at their sides."""
    tau = np.linspace(0.0, 1.0, PLACES)[1:-1]
    up = 2.0 * radius * np.array([0.0, 0.0, 1.0])
    try:
        room = min(radius, float((ground.clearance(np.stack([start + up, end + up])) - radius).min()))
        wanted = np.minimum(KEEP * lift * _hump(tau)[0], max(room, 0.0)) - EXACT
        enough, height = radius + np.maximum(wanted, 0.0) + EXACT, lift
        for _ in range(TRIES):
            for early in EARLY:
                place, _, _ = swing_path(start, end, height, early, tau)
                if np.all(clearance_up_to(ground, place, enough) - radius >= wanted):
                    yield height, early
            height *= RAISE
    except InputError:  # beyond the edge of the ground
        return


def clear_swing(ground: Ground, start: Array, end: Array, lift: float, radius: float) -> tuple[float, float] | None:
    """The first of :func:`clear_swings`, or None."""
    return next(clear_swings(ground, start, end, lift, radius), None)


def _within(tau: Array, first: float, last: float) -> tuple[Array, Array, Array, Array]:
    """:func:`blend` from ``first`` to ``last``, 1 less it, and its derivatives by tau."""
    span = last - first
    done, rest = np.clip((tau - first) / span, 0.0, 1.0), np.clip((last - tau) / span, 0.0, 1.0)
    value, rate, gain = blend(done)
    return value, blend(rest)[0], rate / span, gain / span**2


def _hump(tau: Array) -> tuple[Array, Array, Array]:
    """64 tau^3 (1 - tau)^3, 1 in the middle, and its derivatives."""
    part = tau * (1.0 - tau)
    slope = 1.0 - 2.0 * tau
    return 64.0 * part**3, 192.0 * part**2 * slope, 384.0 * part * (slope**2 - part)


def blend(tau: Array) -> tuple[Array, Array, Array]:
    """The quintic from 0 to 1 that begins and ends at rest without acceleration, and its derivatives."""
    t = tau
    return (
        t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
        30.0 * t**2 * (1.0 - t) ** 2,
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    )
