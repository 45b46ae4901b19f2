"""Steps of a crawl: who swings when, where the body is meant to be, and the way of a swinging foot over the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.rectilinear.swing import swing
from bodyplan.ground.base import Ground

#: places along a swing at which it is tried against the ground
PLACES = 49
#: share of the lift of a swing that it must keep from the ground in its middle
KEEP = 0.4
#: how a swing is raised where the ground is in its way, and how often; and how early it may rise before a step
RAISE, TRIES, EARLY = 1.3, 14, (1.0, 0.6, 0.35)


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
    """Place, velocity and acceleration (S, 3) by tau of a foot on its way: a cycloid over the straight line."""
    way = end - start
    length = float(np.hypot(way[0], way[1]))
    ahead = way[:2] / length if length > 0.0 else np.array([1.0, 0.0])
    found = swing(tau, np.broadcast_to([length, float(way[2])], (len(tau), 2)), np.asarray(lift), np.asarray(early))
    place, velocity, acceleration = (
        np.concatenate([v[:, :1] * ahead, v[:, 1:]], axis=1) for v in (found.risen, found.velocity, found.acceleration)
    )
    late = (tau > 0.5)[:, None]
    landing = np.concatenate([found.landing[:, :1] * ahead, found.landing[:, 1:]], axis=1)
    return np.where(late, end + landing, start + place), velocity, acceleration


def clear_swing(ground: Ground, start: Array, end: Array, lift: float, radius: float) -> tuple[float, float] | None:
    """The least raised (lift, early) of a swing that takes a ball of ``radius`` m over the ground, or None."""
    tau = np.linspace(0.0, 1.0, PLACES)[1:-1]
    u = tau * tau * (3.0 - 2.0 * tau)
    wanted = KEEP * lift * np.sin(np.pi * u) ** 2
    # the ends touch the ground themselves
    wanted = np.where((u < 0.02) | (u > 0.98), -1e-9, wanted)
    height = lift
    for _ in range(TRIES):
        for early in EARLY:
            place, _, _ = swing_path(start, end, height, early, tau)
            if np.all(ground.clearance(place) - radius >= wanted):
                return height, early
        height *= RAISE
    return None


def blend(tau: Array) -> tuple[Array, Array, Array]:
    """The quintic from 0 to 1 that begins and ends at rest without acceleration, and its derivatives."""
    t = tau
    return (
        t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
        30.0 * t**2 * (1.0 - t) ** 2,
        60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
    )
