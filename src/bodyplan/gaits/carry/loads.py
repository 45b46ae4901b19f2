"""What the force of the ground on a wheel asks of its motors: paper *wheels*, eqs. (33) to (35), by virtual work.

A wheel's centre is c, u points from there to the contact at the radius R, t is the direction of rolling, e = ahead x
down the axle. Seen from the body, the rim's material at the contact moves with R'(q) dq/dt u - Omega R t while the
adjusting motor turns at dq/dt and the hub at Omega. A force F of the ground works on it, and wheels without mass hand
that on to their motors:

    tau dq/dt + M Omega + F . (R' dq/dt u - Omega R t) = 0    for all dq/dt, Omega,

    tau = -R'(q) F . u = 0.5 w sin(q/2) cos(30 deg) F . u,      M = R F . t.

So tau dq/dt and M Omega are the powers that the motors give: tau is negative under load, and lifting (dq/dt < 0) costs.
That is eq. (34) with its sign. Eq. (35) takes m g / 3 for -F . u of every wheel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.carry.wheels import Wheel
from bodyplan.robot.elements import WheelRadius

GRAVITY = 9.81


@dataclass(frozen=True)
class Arm:
    """Of one wheel at n poses: ``u``, ``t`` (n, 3) unit vectors from its centre to the contact and ahead, along which
    its material there moves back; ``radius`` (n,) m; ``slope`` (n,) m/rad of the radius by q, 0 where it is fixed."""

    u: Array
    t: Array
    radius: Array
    slope: Array

    @classmethod
    def of(cls, wheel: Wheel, rotation: Array, angle: Array, radius: Array, q: Array) -> Arm:
        """At orientations ``rotation`` (n, 3, 3) of the base, contact angles, radii and adjusting angles (n,)."""
        ahead, down = rotation @ wheel.ahead, rotation @ wheel.down
        sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
        slope = wheel.law.slope(q) if isinstance(wheel.law, WheelRadius) else np.zeros_like(radius)
        return cls(sine * ahead + cosine * down, cosine * ahead - sine * down, radius, slope)

    def adjust(self, force: Array) -> Array:
        """Torque (n,) N m of the adjusting motor under ``force`` (n, 3) N of the ground: eq. (34)."""
        return np.asarray(-self.slope * np.sum(force * self.u, axis=-1))

    def hub(self, force: Array) -> Array:
        """Torque (n,) N m of the motor that turns the wheel forward."""
        return np.asarray(self.radius * np.sum(force * self.t, axis=-1))

    @property
    def adjust_gradient(self) -> Array:
        """(n, 3): the torque of the adjusting motor is this times the force."""
        return np.asarray(-self.slope[:, None] * self.u)


def paper_torque(mass: float, wheel: Wheel, q: Array, count: int) -> Array:
    """Torque (...,) N m of an adjusting motor by the paper's estimate, eq. (35): each of ``count`` wheels carries an
    equal share of the weight, straight through its axle. It is not conservative: on level ground a rear wheel carries
    half of the weight, and its torque is 1.5 times that."""
    slope = wheel.law.slope(q) if isinstance(wheel.law, WheelRadius) else np.zeros_like(q)
    return np.asarray(mass * GRAVITY / count * slope)
