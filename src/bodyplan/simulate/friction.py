"""Coulomb friction towards the floor: one number, or scales that grip one way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray, number
from bodyplan.errors import InputError
from bodyplan.ground.base import Solid
from bodyplan.robot.elements import Contact
from bodyplan.robot.friction import DEFAULT

#: horizontal part of a unit axis below which it is upright
UPRIGHT = 1e-6


@dataclass(frozen=True)
class Friction:
    """Friction of a skin with scales: coefficients for sliding ``forward``, ``backward`` and ``sideways``.

    Forward is along a capsule from its ``start`` to its ``end``, and for a sphere the x axis of its frame, seen from
    above. Raises InputError below 0."""

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
    solid, or else of the contact, or else 0.5."""
    if solid.role == "floor" and floor is not None:
        return (floor.backward, floor.sideways) if isinstance(floor, Friction) else (floor, floor)
    plain = next((mu for mu in (solid.friction, contact.friction) if mu is not None), DEFAULT)
    return plain, plain


class Scales:
    """Sets the friction of every contact on the floor from the way that it slides, before each step: MuJoCo has no
    friction that depends on the direction of sliding."""

    def __init__(self, friction: Friction, parts: Sequence[Runners | Balls]) -> None:
        self.friction, self.parts = friction, tuple(parts)

    def update(self, model: Any, data: Any) -> None:
        """Set ``model.pair_friction`` for the next step."""
        for part in self.parts:
            part.update(self.friction, model, data)


class Runners:
    """Capsules on planes.

    A capsule on a plane has its contact frame along its axis, so the first coefficient of the pair is that of
    sliding along; it is set to ``backward`` while the lowest point of the capsule's middle moves against the axis,
    and to ``forward`` while it moves with it. The velocity is that at the beginning of the previous step.
    """

    def __init__(self, pairs: IntArray, geoms: IntArray, bodies: IntArray, radii: Array, normals: Array) -> None:
        """``pairs`` (c,) pair index, ``geoms`` (c,) the capsule, with its axis along z, ``bodies`` (c,) its
        body, ``radii`` (c,) m, ``normals`` (c, 3) of the floor."""
        self.pairs, self.geoms, self.bodies = pairs, geoms, bodies
        self.down = -radii[:, None] * normals

    def update(self, friction: Friction, model: Any, data: Any) -> None:
        """Set the first coefficient of every pair."""
        # spatial velocity (omega, v) at the robot's centre of mass, and the way from there to the lowest
        # points
        wx, wy, wz, vx, vy, vz = data.cvel.take(self.bodies, 0).T
        rx, ry, rz = (data.geom_xpos.take(self.geoms, 0) + self.down - data.subtree_com[1]).T
        _, _, ax, _, _, ay, _, _, az = data.geom_xmat.take(self.geoms, 0).T
        along = ax * (vx + wy * rz - wz * ry) + ay * (vy + wz * rx - wx * rz) + az * (vz + wx * ry - wy * rx)
        model.pair_friction[self.pairs, 0] = np.where(along < 0.0, friction.backward, friction.forward)


class Balls:
    """Spheres on planes and on the level tops of boxes, and capsules on the latter.

    Their contact frames are turned anyhow about the normal, so both coefficients of a pair are set to one value, that
    of an elliptic law for the direction in which the lowest point of the middle slides: mu = speed /
    hypot(v_along / mu_along, v_across / mu_across), with mu_along ``forward`` or ``backward``. The velocity is that at
    the beginning of the previous step. Where nothing moves mu is ``forward``; where a forward axis is upright all
    sliding is sideways.
    """

    def __init__(
        self, pairs: IntArray, geoms: IntArray, bodies: IntArray, radii: Array, normals: Array, capsules: BoolArray
    ) -> None:
        """As of :class:`Runners`; ``capsules`` (c,) True where forward is the axis of the shape."""
        self.pairs, self.geoms, self.bodies, self.normals, self.capsules = pairs, geoms, bodies, normals.T, capsules
        self.down = -radii[:, None] * normals

    def update(self, friction: Friction, model: Any, data: Any) -> None:
        """Set both coefficients of every pair."""
        wx, wy, wz, vx, vy, vz = data.cvel.take(self.bodies, 0).T
        rx, ry, rz = (data.geom_xpos.take(self.geoms, 0) + self.down - data.subtree_com[1]).T
        velocity = np.stack([vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx])
        axes = np.where(
            self.capsules,
            data.geom_xmat.take(self.geoms, 0).T[2::3],
            data.xmat.take(self.bodies, 0).T[::3],
        )
        mu = directed(friction, velocity, axes, self.normals)
        model.pair_friction[self.pairs, :2] = mu[:, None]


def directed(friction: Friction, velocity: Array, axes: Array, normals: Array) -> Array:
    """Coefficients (c,) of the elliptic law of :class:`Balls` for velocities (3, c) m/s of points on floors with unit
    ``normals`` (3, c), forward being ``axes`` (3, c)."""
    ahead = axes - (axes * normals).sum(axis=0) * normals
    size = np.sqrt((ahead * ahead).sum(axis=0))
    ahead /= np.maximum(size, UPRIGHT)
    along = np.where(size > UPRIGHT, (velocity * ahead).sum(axis=0), 0.0)
    across = velocity - (velocity * normals).sum(axis=0) * normals - along * ahead
    across = np.sqrt((across * across).sum(axis=0))
    mu_along = np.where(along < 0.0, friction.backward, friction.forward)
    with np.errstate(divide="ignore", invalid="ignore"):
        # a part that does not move asks for nothing, also where its coefficient is 0
        a = np.where(along == 0.0, 0.0, along / mu_along)
        c = np.where(across == 0.0, 0.0, across / friction.sideways)
        mu = np.hypot(along, across) / np.hypot(a, c)
    return np.where(np.isfinite(mu), mu, mu_along)
