"""A body at rest on its wheels: where they touch, what they carry, and what their motors hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.carry.loads import GRAVITY, Arm
from bodyplan.gaits.carry.pose import WheelContact
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground
from bodyplan.robot.friction import floor_friction
from bodyplan.robot.masses import center_of_mass
from bodyplan.spatial import matrix_from_quaternion

#: fewer wheels than this hold nothing up at rest
LEAST_WHEELS = 3


@dataclass(frozen=True)
class Stance:
    """k wheels at n poses: ``points``, ``normals`` (n, k, 3) of their contacts, ``center`` (n, 3) of mass, ``weight``
    N, ``friction`` (k,), and ``arms`` of the forces about axles, wheel by wheel."""

    points: Array
    normals: Array
    center: Array
    weight: float
    friction: Array
    arms: tuple[Arm, ...]

    @classmethod
    def of(cls, wheels: Wheels, found: tuple[WheelContact, ...], base: Array, q: Array, friction: Array) -> Stance:
        """The stance at bases (n, 7) and joints (n, n), with contacts (n,) by wheel."""
        rotation = matrix_from_quaternion(base[:, 3:])
        return cls(
            np.stack([one.point for one in found], axis=1),
            np.stack([one.normal for one in found], axis=1),
            center_of_mass(wheels.robot, q, base),
            wheels.robot.mass * GRAVITY,
            friction,
            tuple(
                Arm.of(wheel, rotation, one.angle, one.radius, one.q) for wheel, one in zip(wheels, found, strict=True)
            ),
        )

    def take(self, rows: Any) -> Stance:
        """Some of the poses."""
        arms = tuple(Arm(*(getattr(arm, f.name)[rows] for f in fields(arm))) for arm in self.arms)
        return Stance(self.points[rows], self.normals[rows], self.center[rows], self.weight, self.friction, arms)

    @property
    def levers(self) -> Array:
        """(n, k, k, 3): torques of adjusting motors are these times the forces."""
        n, k = self.points.shape[:2]
        out = np.zeros((n, k, k, 3))
        for i, arm in enumerate(self.arms):
            out[:, i, i] = arm.adjust_gradient
        return out

    def adjust(self, forces: Array) -> Array:
        """Torques (n, k) of the adjusting motors under forces (n, k, 3): eq. (34)."""
        return np.stack([arm.adjust(forces[:, k]) for k, arm in enumerate(self.arms)], axis=1)

    def hub(self, forces: Array) -> Array:
        """Torques (n, k) of the motors of the hubs."""
        return np.stack([arm.hub(forces[:, k]) for k, arm in enumerate(self.arms)], axis=1)

    def joints(self, wheels: Wheels, forces: Array) -> Array:
        """Torques (n, robot.n) of all joints."""
        out = np.zeros((len(forces), wheels.robot.n))
        adjust, hub = self.adjust(forces), self.hub(forces)
        for k, wheel in enumerate(wheels):
            if wheel.adjust is not None:
                # several wheels may share a motor
                out[:, wheel.adjust] += adjust[:, k]
            out[:, wheel.spin] += wheel.turn * hub[:, k]
        return out


def stands(wheels: Wheels) -> bool:
    """Whether statics say anything of a robot: it weighs something and has wheels enough."""
    return wheels.robot.mass > 0.0 and len(wheels) >= LEAST_WHEELS


def ready(stance: Stance) -> BoolArray:
    """(n,) True where all contacts are known."""
    return np.asarray(np.isfinite(stance.points).all(axis=(1, 2)) & np.isfinite(stance.normals).all(axis=(1, 2)))


def friction_of(wheels: Wheels, ground: Ground, mu: float | Mapping[str, float] | ArrayLike | None = None) -> Array:
    """Coefficients (k,) of the wheels: those given (one number, or a mapping for those that it names), or else of the
    ground, or else of the rims, or else 0.5."""
    out = floor_friction(ground, [wheels.robot.contacts[wheel.rim] for wheel in wheels])
    if mu is None:
        return out
    if isinstance(mu, Mapping):
        for name, value in mu.items():
            if name not in wheels.names:
                raise UnknownNameError("wheel", name, wheels.names, where="mu")
            out[wheels.names.index(name)] = number(value, f"mu[{name!r}]", at_least=0.0)
        return out
    given = finite(mu, "mu")
    if given.shape not in ((), out.shape) or np.any(given < 0.0):
        raise InputError(f"mu: expected a coefficient >= 0, one a wheel, or wheel names with theirs, got {mu!r}.")
    return np.array(np.broadcast_to(given, out.shape))
