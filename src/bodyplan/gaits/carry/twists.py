"""How fast wheels must turn and change while the body moves at a given velocity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.carry import contact
from bodyplan.gaits.carry.pose import Pose, planes_of
from bodyplan.gaits.carry.rates import Carried, rates
from bodyplan.gaits.carry.terrain import terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.robot.elements import WheelRadius
from bodyplan.spatial import matrix_from_quaternion


@dataclass(frozen=True)
class WheelRate:
    """Rates of one wheel over a batch of poses (...,): ``radius`` m/s, ``q`` rad/s of the adjusting joint (infinite at
    q = 0, where the radius has no slope), ``angle`` rad/s of the contact, ``spin`` rad/s that rolls without slip ahead,
    ``slip`` m/s sideways, positive to the left. nan where there is no contact, or it jumps."""

    name: str
    radius: Array
    q: Array
    angle: Array
    spin: Array
    slip: Array


@dataclass(frozen=True)
class WheelRates:
    """``rates["fl"]`` is the :class:`WheelRate` of a wheel; ``joints`` (..., n) are the rates of the robot's joints."""

    wheels: Mapping[str, WheelRate]
    joints: Array

    def __getitem__(self, name: str) -> WheelRate:
        if name not in self.wheels:
            raise UnknownNameError("wheel", name, self.wheels)
        return self.wheels[name]

    def __iter__(self) -> Iterator[WheelRate]:
        return iter(self.wheels.values())


def wheel_rates(pose: Pose, twist: ArrayLike) -> WheelRates:
    """What the wheels do at ``pose`` while the base moves with ``twist`` (..., 6): body-fixed (v m/s, omega rad/s).

    Exact (paper *wheels* has no rates). With the rates of the contact and the adjusting joints the model's velocity
    equation ``V = P twist + Q dq/dt`` gives the velocity of every contact point, along the ground; with the spins in
    place of the contact rates, that of the rims' material there: only ``slip`` sideways is left of it. Raises
    InputError.
    """
    given = finite(twist, "twist")
    if given.ndim == 0 or given.shape[-1] != 6:
        raise InputError(f"twist: expected shape (..., 6), body-fixed (v, omega), got {given.shape}.")
    shape = pose.status.shape
    try:
        flat = np.broadcast_to(given, (*shape, 6)).reshape(-1, 6)
    except ValueError as error:
        raise InputError(f"twist: shape {given.shape} does not broadcast to the poses {shape}.") from error
    wheels, land = Wheels.of(pose.robot), terrain(pose.ground)
    base = pose.base.reshape(-1, 7)
    rotation = matrix_from_quaternion(base[:, 3:])
    velocity, spin = (np.einsum("nij,nj->ni", rotation, part) for part in (flat[:, :3], flat[:, 3:]))
    count = len(wheels)
    arm = np.einsum("nij,kj->kni", rotation, wheels.centres)
    axes = [np.einsum("nij,kj->kni", rotation, wheels.axes[:, i]).reshape(-1, 3) for i in range(3)]
    found = contact.find(land, planes_of(wheels, base[:, :3], rotation))
    still = np.zeros((count * len(base), 3))
    moved = rates(
        land,
        found,
        Carried(
            (base[:, :3] + arm).reshape(-1, 3),
            (velocity + np.cross(spin[None], arm)).reshape(-1, 3),
            still,
            np.tile(spin, (count, 1)),
            still,
            *axes,
        ),
    )
    touching = found.outcome == contact.TOUCHES
    joints = np.zeros((len(base), pose.robot.n))
    made = {}
    for k, wheel in enumerate(wheels):
        part = slice(k * len(base), (k + 1) * len(base))
        radius, angle, rolling, slip = (
            np.where(touching[part], v[part], np.nan) for v in (moved.radius, moved.angle, moved.rolling, moved.slip)
        )
        q = np.zeros_like(radius)
        if isinstance(wheel.law, WheelRadius) and wheel.adjust is not None:
            with np.errstate(all="ignore"):
                q = radius / wheel.law.slope(pose[wheel.name].q.reshape(-1))
            joints[:, wheel.adjust] = q
        joints[:, wheel.angle], joints[:, wheel.spin] = -angle / wheel.scale, rolling / wheel.turn
        made[wheel.name] = WheelRate(wheel.name, *(v.reshape(shape) for v in (radius, q, angle, rolling, slip)))
    return WheelRates(made, joints.reshape(*shape, pose.robot.n))
