"""Coulomb friction towards the floor: one number, or scales that grip one way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array, IntArray, number
from bodyplan.errors import InputError
from bodyplan.ground.base import Solid
from bodyplan.robot.elements import Contact

#: coefficient where neither the ground, nor the contact, nor the caller names one
DEFAULT = 0.5


@dataclass(frozen=True)
class Friction:
    """Friction of a skin with scales: coefficients for sliding ``forward`` and ``backward`` along a capsule
    (forward is from its ``start`` to its ``end``) and ``sideways`` across it. Raises InputError below 0."""

    forward: float
    backward: float
    sideways: float

    def __post_init__(self) -> None:
        for field in ("forward", "backward", "sideways"):
            object.__setattr__(self, field, number(getattr(self, field), f"Friction.{field}", at_least=0.0))

    def to_dict(self) -> dict[str, float]:
        """The three coefficients by name."""
        return asdict(self)


FloorFriction = float | Friction | Sequence[float] | None


def as_friction(value: Any) -> float | Friction | None:
    """None, a coefficient, or a :class:`Friction` (also from a triple forward, backward, sideways)."""
    if value is None or isinstance(value, Friction):
        return value
    if isinstance(value, (tuple, list, np.ndarray)):
        if len(value) != 3:
            raise InputError(f"friction: a triple is (forward, backward, sideways), got {value!r}.")
        return Friction(*(float(number(v, "friction")) for v in value))
    return number(value, "friction", at_least=0.0)


def pair_friction(solid: Solid, contact: Contact, floor: float | Friction | None) -> tuple[float, float]:
    """Coefficients (along, across) of a contact on a solid: that of the caller on the floor, or else of the
    solid, or else of the contact, or else :data:`DEFAULT`."""
    if solid.role == "floor" and floor is not None:
        return (floor.backward, floor.sideways) if isinstance(floor, Friction) else (floor, floor)
    plain = next((mu for mu in (solid.friction, contact.friction) if mu is not None), DEFAULT)
    return plain, plain


class Scales:
    """Sets the friction along every capsule on the floor from the way that it slides, before each step.

    MuJoCo has no friction that depends on the direction of sliding. A capsule on a plane has its contact
    frame along its axis, so the first coefficient of the pair is that of sliding along; it is set to
    ``backward`` while the lowest point of the capsule's middle moves against the axis, and to ``forward``
    while it moves with it. The velocity is that at the beginning of the previous step.
    """

    def __init__(
        self,
        friction: Friction,
        pairs: IntArray,
        geoms: IntArray,
        bodies: IntArray,
        radii: Array,
        normals: Array,
    ) -> None:
        """``pairs`` (c,) pair index, ``geoms`` (c,) the capsule, with its axis along z, ``bodies`` (c,) its
        body, ``radii`` (c,) m, ``normals`` (c, 3) of the floor."""
        self.friction, self.pairs, self.geoms, self.bodies = friction, pairs, geoms, bodies
        self.down = -radii[:, None] * normals

    def update(self, model: Any, data: Any) -> None:
        """Set ``model.pair_friction`` for the next step."""
        # spatial velocity (omega, v) at the robot's centre of mass, and the way from there to the lowest
        # points
        wx, wy, wz, vx, vy, vz = data.cvel.take(self.bodies, 0).T
        rx, ry, rz = (data.geom_xpos.take(self.geoms, 0) + self.down - data.subtree_com[1]).T
        _, _, ax, _, _, ay, _, _, az = data.geom_xmat.take(self.geoms, 0).T
        along = ax * (vx + wy * rz - wz * ry) + ay * (vy + wz * rx - wx * rz) + az * (vz + wx * ry - wy * rx)
        model.pair_friction[self.pairs, 0] = np.where(along < 0.0, self.friction.backward, self.friction.forward)
