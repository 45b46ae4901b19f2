"""A robot at a configuration, as resolved rates see it: feet, body and joints whose motions are related by (9)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, frozen
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.batch import IDENTITY_POSE, base_array
from bodyplan.robot.elements import Arc
from bodyplan.robot.model import Robot
from bodyplan.robot.reach import Reach
from bodyplan.solve.coordinates import coordinate_jacobian, coordinates_from_pose
from bodyplan.spatial import adjoint_inverse, matrix_from_quaternion

#: a chain "fl" ends in "fl.foot", whatever its table calls that frame
FOOT = "foot"


class Foot(NamedTuple):
    """A point of a robot: ``frame`` (index in ``robot.frames``) and where in its axes, m."""

    name: str
    frame: int
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Model:
    """A robot at joint coordinates ``q`` (..., n) rad or m and base poses ``base`` (..., 7), with m ``feet``.

    Made by :func:`model`. ``targets``: the feet; ``aliases``: every name that a foot may be called by. ``shape``: the
    batch shape, of q and base broadcast. Everything is worked out when first asked for and read-only.
    """

    def __init__(
        self, robot: Robot, q: Array, base: Array, targets: tuple[Foot, ...], aliases: Mapping[str, Foot]
    ) -> None:
        self.robot, self.q, self.base = robot, q, base
        self.targets, self.aliases = targets, aliases
        self.shape = np.broadcast_shapes(q.shape[:-1], base.shape[:-1])

    @property
    def feet(self) -> tuple[str, ...]:
        """Names of the feet, in the order of the blocks of six rows of P and Q."""
        return tuple(foot.name for foot in self.targets)

    @cached_property
    def reach(self) -> Reach:
        """Poses and Jacobians of the frames that the feet are fixed in, seen from the base."""
        frames = tuple(self.robot.frames[foot.frame] for foot in self.targets)
        return self.robot.ends_and_jacobians(self.q, frames=frames)

    @cached_property
    def _shift(self) -> Array | None:
        """(6m, 6m) from the twists of frames to those at points beside their origins."""
        if not any(any(foot.start) for foot in self.targets):
            return None
        m = len(self.targets)
        out = np.zeros((6 * m, 6 * m))
        for k, foot in enumerate(self.targets):
            out[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] = adjoint_inverse(foot.start, np.eye(3))
        return out

    @cached_property
    def P(self) -> Array:
        """(..., 6m, 6) of paper *legs* eq. (9): body-fixed foot twists per unit body-fixed base twist."""
        P = self.reach.carried()
        return _fixed(P if self._shift is None else self._shift @ P)

    @cached_property
    def Q(self) -> Array:
        """(..., 6m, n) of eq. (9): body-fixed foot twists per unit joint rate."""
        Q = self.reach.stacked()
        return _fixed(Q if self._shift is None else self._shift @ Q)

    @cached_property
    def body_rotation(self) -> Array:
        """(..., 3, 3): axes of the base in the world."""
        return _fixed(matrix_from_quaternion(self.base[..., 3:]))

    @cached_property
    def rotations(self) -> Array:
        """(..., m, 3, 3): axes of the feet in the world."""
        return _fixed(self.body_rotation[..., None, :, :] @ self.reach.rotations)

    @cached_property
    def positions(self) -> Array:
        """(..., m, 3) m: the feet in the world."""
        start = np.array([foot.start for foot in self.targets])
        from_base = self.reach.positions + (self.reach.rotations @ start[..., None])[..., 0]
        turned = (self.body_rotation[..., None, :, :] @ from_base[..., None])[..., 0]
        return _fixed(self.base[..., None, :3] + turned)

    @cached_property
    def coordinates(self) -> Array:
        """(..., 6): x, y, z, roll, pitch, yaw of the base, m and rad."""
        return _fixed(coordinates_from_pose(self.base))

    @cached_property
    def coordinate_jacobian(self) -> Array:
        """(..., 6, 6): body-fixed base twist per unit rates of the coordinates."""
        return _fixed(coordinate_jacobian(self.coordinates))

    def with_feet(self, more: Sequence[Foot]) -> Model:
        """The same configuration with further feet behind the present ones."""
        return Model(self.robot, self.q, self.base, (*self.targets, *more), self.aliases)

    def at(self, q: ArrayLike | Mapping[str, ArrayLike], base: ArrayLike | None = None) -> Model:
        """The same robot and feet at another configuration; see :func:`model`."""
        other = Model(self.robot, *_configuration(self.robot, q, base), self.targets, self.aliases)
        other.__dict__["leg_length"] = self.leg_length
        return other

    @cached_property
    def leg_length(self) -> float:
        """m: mean over the chains of their length with all constant links in one line, 1 where that is 0."""
        return leg_length(self.robot)

    def __repr__(self) -> str:
        return f"Model(robot {self.robot.name!r}, feet {', '.join(self.feet)}, batch {self.shape})"


def model(
    robot: Robot,
    q: ArrayLike | Mapping[str, ArrayLike],
    base: ArrayLike | None = None,
    *,
    feet: Sequence[str] | None = None,
) -> Model:
    """A robot at joint coordinates ``q`` (..., n), or by name, rad or m, and base poses ``base`` (..., 7) in the world
    (the identity when None), broadcast against each other.

    ``feet``: what paper *legs* eq. (9) has rows for: names of chains, frames or contacts (default: the end of every
    chain, in chain order). A chain "fl" may be called "fl" or "fl.foot", or by the name of its last frame. A contact
    stands for the point ``start`` of its shape, fixed in its frame (where a frame has the same name, the frame counts).

    Raises InputError for shapes, UnknownNameError for names.
    """
    if not isinstance(robot, Robot):
        raise InputError(f"robot: expected a Robot, got {type(robot).__name__}.")
    joints, pose = _configuration(robot, q, base)
    names = feet_of(robot)
    if feet is None:
        targets = tuple(names[chain.name] for chain in robot.chains)
    else:
        if isinstance(feet, str) or not isinstance(feet, Sequence) or not feet:
            raise InputError(f"feet: expected a sequence of names with at least one, got {feet!r}.")
        targets = tuple(_foot(names, name) for name in feet)
        if len(set(targets)) != len(targets):
            raise InputError(f"feet: the same foot twice in {', '.join(map(str, feet))}.")
    return Model(robot, joints, pose, targets, names)


def _configuration(robot: Robot, q: Any, base: ArrayLike | None) -> tuple[Array, Array]:
    joints = frozen(robot.vector(q))
    pose = IDENTITY_POSE[0] if base is None else base_array(base)
    try:
        np.broadcast_shapes(joints.shape[:-1], pose.shape[:-1])
    except ValueError as error:
        raise InputError(
            f"base: batch shape {pose.shape[:-1]} does not broadcast with that of q, {joints.shape[:-1]}."
        ) from error
    return joints, frozen(pose)


def feet_of(robot: Robot) -> dict[str, Foot]:
    """Every name that a foot of this robot may be called by."""
    frames = {name: Foot(name, i) for i, name in enumerate(robot.frames) if i > 0}
    ends: dict[str, Foot] = {}
    for chain, end in zip(robot.chains, robot.ends, strict=True):
        # unless a frame that is not the end has that name, the end of chain "fl" is "fl.foot" for all that is reported
        alias = f"{chain.name}.{FOOT}"
        taken = alias in frames and frames[alias].frame != end
        foot = Foot(robot.frames[end] if taken else alias, end)
        frames[robot.frames[end]] = foot
        ends[chain.name] = ends[alias] = foot
    points = {
        contact.name: Foot(contact.name, robot.frame_index(contact.frame), contact.start)
        if any(contact.start)
        else frames[contact.frame]
        for contact in robot.contacts
        if contact.frame != "base"
    }
    return points | ends | frames


def leg_length(robot: Robot) -> float:
    """m: mean over the chains of their length with all constant links in one line; 1 where that is 0."""
    lengths = []
    for chain in robot.chains:
        total = 0.0
        for element in chain.elements:
            if isinstance(element, Arc):
                total += element.length
            else:
                total += math.hypot(*(v for v in (element.d, element.a) if isinstance(v, float)))
        lengths.append(total)
    mean = float(np.mean(lengths))
    return mean if mean > 0.0 else 1.0


def _foot(names: Mapping[str, Foot], name: object) -> Foot:
    if name not in names:
        raise UnknownNameError("foot", name, names, where="feet")
    return names[str(name)]


def _fixed(a: Array) -> Array:
    a.flags.writeable = False
    return a
