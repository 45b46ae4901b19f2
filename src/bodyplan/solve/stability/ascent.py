"""From the gradient of an objective to the free vector rho of resolved rates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.masses import mass_points
from bodyplan.robot.model import Robot
from bodyplan.solve.components import Component
from bodyplan.solve.configuration import Model
from bodyplan.solve.partitions import Partition
from bodyplan.solve.rates import Rates
from bodyplan.spatial import hat


class Psi(NamedTuple):
    """An objective and its exact gradient: ``value`` (...), by the centre of mass ``com`` (..., 3) and the ``feet``
    (..., m, 3), 1/m, each with the others at rest, and by ``attitude`` (..., 2), roll and pitch, 1/rad."""

    value: Any
    com: Array
    feet: Array
    attitude: Array


class Ascent:
    """An objective psi of a standing robot, and its gradient by whatever moves; ``...`` is the model's batch shape.

    psi is a function of where the body is, where the feet are, and of the joints as far as they move the centre of
    mass; each with the others at rest. ``value`` (...); ``com`` (..., 3) m in the world; ``by_com`` (..., 3); ``feet``
    (..., s, 3) by the stance feet in the world; ``coordinates`` (..., 6) by x, y, z, roll, pitch, yaw; ``joints``
    (..., n). :meth:`rho` picks from them what each unknown of a partition moves.
    """

    def __init__(
        self, model: Model, stance: tuple[int, ...], center: Array, slope: Array, com: Array, psi: Psi
    ) -> None:
        self.model, self.stance = model, stance
        self.value, self.com, self.by_com, self.feet = psi.value, com, psi.com, psi.feet
        self._attitude, self._center = psi.attitude, center
        # in base axes
        self._pull = _times(np.swapaxes(model.body_rotation, -1, -2), psi.com)
        self.joints: Array = _times(np.swapaxes(slope, -1, -2), self._pull)

    @cached_property
    def twist(self) -> Array:
        """(..., 6): by a body-fixed displacement and rotation of the base; feet at rest in the world."""
        return self._along(np.eye(6), coordinates=False)

    @cached_property
    def coordinates(self) -> Array:
        """(..., 6): by x, y, z (1/m), roll, pitch, yaw (1/rad) of the base; feet at rest in the world."""
        return self._along(self.model.coordinate_jacobian, coordinates=True)

    def _along(self, jacobian: Array, coordinates: bool) -> Array:
        """By the body's components whose rates give the base's twist through ``jacobian`` (..., 6, 6)."""
        carried = np.concatenate([self._pull, np.cross(self._center, self._pull)], axis=-1)
        out = _times(np.swapaxes(jacobian, -1, -2), carried)
        if not np.any(self._attitude):
            return out
        if coordinates:
            nothing = np.zeros((*self.value.shape, 3))
            return np.asarray(out + np.concatenate([nothing, self._attitude, nothing[..., :1]], axis=-1))
        roll, pitch = self.model.coordinates[..., 3], self.model.coordinates[..., 4]
        by_roll, by_pitch = self._attitude[..., 0], self._attitude[..., 1]
        # roll and pitch turn by wx + tan(pitch) (sin(roll) wy + cos(roll) wz) and cos(roll) wy - sin(roll) wz
        level = by_roll * np.tan(pitch)
        by_w = [by_roll, level * np.sin(roll) + by_pitch * np.cos(roll), level * np.cos(roll) - by_pitch * np.sin(roll)]
        turned = np.concatenate([np.zeros_like(self._pull), np.stack(by_w, axis=-1)], axis=-1)
        return out + _times(np.swapaxes(jacobian, -1, -2), turned)

    def rho(self, partition: Partition) -> Array:
        """(..., x): the derivative of psi by the coordinate that each unknown of the partition moves, for ``gradient``
        or ``rho`` of :func:`bodyplan.solve.resolve`.

        The paper's rho = d psi / d X is zero, X being rates: this is what it means. InputError for a partition of
        another model.
        """
        return self.by(partition)(partition.X)

    def rate(self, rates: Rates) -> Array:
        """(...): d psi / dt at these rates, known and unknown: what they buy, in the unit of psi a second."""
        by = self.by(rates.partition)
        return np.asarray(
            (by(rates.partition.X) * rates.X).sum(axis=-1) + (by(rates.partition.Y) * rates.Y).sum(axis=-1)
        )

    def by(self, partition: Partition) -> Callable[[tuple[Component, ...]], Array]:
        other = partition.model
        same = other.robot is self.model.robot and other.q is self.model.q and other.base is self.model.base
        if not same:
            raise InputError("partition: it is of another model than this objective.")
        m = len(other.targets)
        feet = np.zeros((*self.value.shape, m, 2, 3))
        places = {(foot.frame, foot.start): i for i, foot in enumerate(other.targets)}
        for k, i in enumerate(self.stance):
            foot = self.model.targets[i]
            at, by = places[foot.frame, foot.start], self.feet[..., k, :]
            own = partition.axes == "own"
            feet[..., at, 0, :] = _times(np.swapaxes(other.rotations[..., at, :, :], -1, -2), by) if own else by
        parts = {
            "foot": feet.reshape(*self.value.shape, 6 * m),
            "body": self._along(partition.body_jacobian, partition.body == "coordinates"),
            "joint": np.broadcast_to(self.joints, (*self.value.shape, self.model.robot.n)),
        }

        def by_components(components: tuple[Component, ...]) -> Array:
            out = np.empty((*self.value.shape, len(components)))
            for i, c in enumerate(components):
                out[..., i] = parts[c.kind][..., c.number]
            return out

        return by_components


def ascent(
    objective: Callable[..., Psi], model: Model, stance: Sequence[str] | None, com: Any, gravity: ArrayLike
) -> Ascent:
    """See :meth:`Objective.at`."""
    if not isinstance(model, Model):
        raise InputError(f"model: expected a Model, got {type(model).__name__}.")
    at = standing(model, stance, com)
    psi = objective(at.points, at.com, model.coordinates[..., 3:5], gravity)
    return Ascent(model, at.feet, at.center, at.slope, at.com, psi)


class Standing(NamedTuple):
    """Indices of the ``feet``, their places ``points`` (..., s, 3), the centre of mass ``com`` (..., 3) in the world;
    ``center``, ``slope``: see :func:`center_and_slope`."""

    feet: tuple[int, ...]
    points: Array
    com: Array
    center: Array
    slope: Array


def standing(model: Model, stance: Sequence[str] | None, com: Any) -> Standing:
    feet = _stance(model, stance)
    center, slope = _center(model, com)
    position = model.base[..., :3] + _times(model.body_rotation, center)
    points = np.broadcast_to(model.positions[..., list(feet), :], (*model.shape, len(feet), 3))
    return Standing(feet, points, np.broadcast_to(position, (*model.shape, 3)), center, slope)


def center_and_slope(robot: Robot, q: ArrayLike) -> tuple[Array, Array]:
    """(centre of mass (..., 3) m seen from the base, its derivative (..., 3, n) by the joints) at ``q`` (..., n).

    InputError for a robot without mass.
    """
    frames, masses, centres = mass_points(robot)
    if not len(frames):
        raise InputError(f"robot {robot.name!r}: has no mass; give its rows or its base a Body.")
    at = robot.ends_and_jacobians(q, frames=tuple(robot.frames[i] for i in frames))
    J = at.stacked()
    J = J.reshape(*J.shape[:-2], len(frames), 6, robot.n)
    moved = at.rotations @ (J[..., :3, :] - hat(centres) @ J[..., 3:, :])
    places = at.positions + _times(at.rotations, centres)
    share = masses / masses.sum()
    return np.einsum("b,...bi->...i", share, places), np.einsum("b,...bij->...ij", share, moved)


def _center(model: Model, com: Any) -> tuple[Array, Array]:
    if com is None:
        com = "mass" if model.robot.mass > 0.0 else "base"
    if isinstance(com, str):
        if com == "mass":
            return center_and_slope(model.robot, model.q)
        if com != "base":
            raise InputError(f"com: must be 'mass', 'base' or a point (3,), got {com!r}.")
        com = np.zeros(3)
    point = finite(com, "com", (3,))
    return point, np.zeros((3, model.robot.n))


def _stance(model: Model, stance: Sequence[str] | None) -> tuple[int, ...]:
    if stance is None:
        return tuple(range(len(model.targets)))
    if isinstance(stance, str) or not isinstance(stance, Sequence):
        raise InputError(f"stance: expected a sequence of names, got {stance!r}.")
    places = {(foot.frame, foot.start): i for i, foot in enumerate(model.targets)}
    out = []
    for name in stance:
        foot = model.aliases.get(name)
        if foot is None or (foot.frame, foot.start) not in places:
            raise UnknownNameError("foot", name, model.feet, where="stance")
        out.append(places[foot.frame, foot.start])
    if len(set(out)) != len(out):
        raise InputError(f"stance: the same foot twice in {', '.join(stance)}.")
    return tuple(out)


def _times(M: Array, v: Array) -> Array:
    return np.asarray((M @ v[..., None])[..., 0])
