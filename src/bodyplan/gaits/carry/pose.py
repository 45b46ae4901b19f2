"""Wheels at one pose of the body, or at many: contact angles, radii, joint angles, contact points, and why not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, IntArray, TextArray, finite
from bodyplan.errors import InputError, SolveError, Status, UnknownNameError
from bodyplan.gaits.carry import contact, hull, orientation
from bodyplan.gaits.carry.contact import Contacts
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.terrain import Terrain, terrain
from bodyplan.gaits.carry.wheels import Wheel, Wheels
from bodyplan.ground.base import Ground
from bodyplan.robot.model import Robot
from bodyplan.spatial import matrix_from_quaternion, quaternion_from_matrix

MODES = ("absolute", "normal", "vertical")
#: m: a wheel of fixed radius touches where the ground is this near to its rim
TOUCH = 1e-6

_OUTCOMES = {
    contact.LIES_FLAT: (Status.NO_CONTACT, "lies on its side"),
    contact.NO_GROUND: (Status.NO_CONTACT, "has no ground below its axle"),
    contact.AXLE_BELOW: (Status.BELOW_FLOOR, "has its axle in the ground"),
    contact.UNPROVED: (Status.NOT_CONVERGED, "has no contact that can be proved the nearest: pieces of ground tie"),
    contact.OFF_THE_MAP: (Status.NO_CONTACT, "touches beyond the edge of the ground"),
}


@dataclass(frozen=True)
class WheelContact:
    """Where one wheel touches, over a batch of poses (...,). Values mean nothing where ``status`` is ``no_contact``,
    ``below_floor`` or ``not_converged``.

    ``angle`` (...,) rad: the contact angle phi, 0 below the axle, positive ahead. ``radius`` (...,) m from the axle to
    the contact, also where it is out of reach; ``q`` (...,) rad the adjusting angle that makes it, at its nearest
    limit where out of reach, 0 for a wheel of fixed radius. ``point`` and ``normal`` (..., 3): the contact and the
    ground's unit normal there, in the world. ``residual`` (...,) m of eqs. (12) and (14). ``slack`` (...,): 1 - kappa
    R, 0 where the ground bends like the rim. ``double`` (...,): another place is as near, at the contact angle
    ``second`` (...,) rad (else nan). ``corner`` (...,): the wheel stands on an edge of the ground; ``normal`` then
    points to its centre. ``status`` (...,).
    """

    name: str
    angle: Array
    radius: Array
    q: Array
    point: Array
    normal: Array
    residual: Array
    slack: Array
    double: BoolArray
    second: Array
    corner: BoolArray
    status: TextArray
    wheel: Wheel = field(repr=False)
    outcome: IntArray = field(repr=False)

    def reason(self, index: Any = ()) -> str:
        """Why the status at an index of the batch is what it is; empty where it is ok."""
        status, outcome = str(self.status[index]), int(self.outcome[index])
        if outcome in _OUTCOMES:
            return f"wheel {self.name!r} {_OUTCOMES[outcome][1]}"
        radius, (low, high) = float(self.radius[index]), self.wheel.range
        if status == Status.OUT_OF_REACH:
            return f"wheel {self.name!r} needs a radius of {radius:.4g} m; {low:.4g} to {high:.4g} m are in its reach"
        if status == Status.NO_CONTACT:
            return f"wheel {self.name!r} of {low:.4g} m hangs {1e3 * (radius - low):.3g} mm above the ground"
        if status == Status.BELOW_FLOOR:
            return f"wheel {self.name!r} of {low:.4g} m would sink {1e3 * (low - radius):.3g} mm into the ground"
        return ""


@dataclass(frozen=True)
class Pose:
    """Wheels at a batch of poses (...,) of a body. ``pose["fl"]`` is the :class:`WheelContact` of a wheel.

    ``base`` (..., 7) pose of the base, world_from_base, wxyz. ``joints`` (..., n) joint coordinates of the robot with
    the contact angles and adjusting angles, hubs at 0: ``robot.forward(pose.joints, pose.base)["fl"]`` is the contact
    of "fl". ``status`` (...,): that of the first wheel that fails, else ``below_floor`` where the hull touches the
    ground (``hull`` (...,)), else ``ok``.
    """

    robot: Robot
    ground: Ground
    base: Array
    wheels: Mapping[str, WheelContact]
    hull: BoolArray
    joints: Array
    status: TextArray

    def __getitem__(self, name: str) -> WheelContact:
        if name not in self.wheels:
            raise UnknownNameError("wheel", name, self.wheels)
        return self.wheels[name]

    def __iter__(self) -> Iterator[WheelContact]:
        return iter(self.wheels.values())

    @property
    def ok(self) -> BoolArray:
        """(...,) True where every wheel touches within its reach and the hull is clear."""
        return np.asarray(self.status == Status.OK.value)

    def reason(self, index: Any = ()) -> str:
        """Why the status at an index of the batch is what it is: the wheel and what is wrong; empty where it is ok."""
        for wheel in self:
            if wheel.status[index] != Status.OK.value:
                return wheel.reason(index)
        return "the hull touches the ground" if self.hull[index] else ""

    def raise_if_failed(self) -> Pose:
        """This pose, or SolveError with the first failed one of the batch."""
        bad = np.argwhere(~self.ok)
        if len(bad):
            index = tuple(int(i) for i in bad[0])
            flat = int(np.ravel_multi_index(index, self.status.shape)) if index else None
            raise SolveError(str(self.status[index]), self.reason(index), flat)
        return self


def pose(
    robot: Robot,
    ground: Ground,
    position: ArrayLike,
    height: ArrayLike = 0.15,
    height_mode: str = "absolute",
    roll: ArrayLike = 0.0,
    pitch: ArrayLike = 0.0,
    heading: ArrayLike = 0.0,
) -> Pose:
    """What the wheels must do so that the body has a pose (paper *wheels*, eqs. (4) to (17), with corrections 1 to 3).

    ``position`` (..., 2) m: x, y of the base, or with ``height_mode`` "normal" of the ground point that it stands
    over. ``height`` (...,) m: of the base's origin "absolute" in the world (as in the paper's missions), "vertical"
    above the ground at x, y, or along the ground's "normal" (eq. (6)). ``roll``, ``pitch`` (...,) rad: turns about the
    world's x and y axes, R = Ry(pitch) Rx(roll) Rz(yaw). ``heading`` (...,) rad: the direction of the body's x axis
    seen from above. All broadcast.

    Every contact is the globally nearest ground in its wheel's plane, proved by bounds of the ground's second
    derivatives: the rim penetrates nowhere. Raises InputError for a ground that is none of plane, surface, height map,
    a robot without wheels, a position off the ground's map; what cannot be reached is a status.
    """
    wheels, land = Wheels.of(robot), terrain(ground)
    if height_mode not in MODES:
        raise UnknownNameError("height_mode", height_mode, MODES)
    place = finite(position, "position")
    if place.ndim == 0 or place.shape[-1] != 2:
        raise InputError(f"position: expected shape (..., 2), x and y, got {place.shape}.")
    angles = {name: finite(v, name) for name, v in
              {"height": height, "roll": roll, "pitch": pitch, "heading": heading}.items()}  # fmt: skip
    for name in ("roll", "pitch"):
        if np.any(np.abs(angles[name]) >= 0.5 * np.pi):
            raise InputError(
                f"{name}: must be within +-pi/2 rad, got {angles[name].flat[np.abs(angles[name]).argmax()]}."
            )
    try:
        shape = np.broadcast_shapes(place.shape[:-1], *(v.shape for v in angles.values()))
    except ValueError as error:
        raise InputError(f"position, height, roll, pitch, heading: shapes do not broadcast: {error}.") from error
    flat = {name: np.broadcast_to(v, shape).reshape(-1) for name, v in angles.items()}
    xy = np.broadcast_to(place, (*shape, 2)).reshape(-1, 2)
    yaw = orientation.yaw(flat["heading"], flat["roll"], flat["pitch"])
    rotation = orientation.matrix(yaw, flat["roll"], flat["pitch"])
    return solved(wheels, ground, land, stands(ground, xy, flat["height"], height_mode), rotation, shape)


def pose_of(robot: Robot, ground: Ground, base: ArrayLike) -> Pose:
    """As :func:`pose`, for bases (..., 7): position m and unit quaternion wxyz, world_from_base."""
    given = finite(base, "base")
    if given.ndim == 0 or given.shape[-1] != 7 or np.any(np.abs(np.linalg.norm(given[..., 3:], axis=-1) - 1.0) > 1e-9):
        raise InputError(f"base: expected poses (..., 7) with unit quaternions wxyz, got shape {given.shape}.")
    flat = given.reshape(-1, 7)
    wheels, land = Wheels.of(robot), terrain(ground)
    return solved(wheels, ground, land, flat[:, :3], matrix_from_quaternion(flat[:, 3:]), given.shape[:-1])


def stands(ground: Ground, xy: Array, height: Array, mode: str) -> Array:
    """Positions (n, 3) m of the base over x, y (n, 2) at ``height`` (n,) m of a mode (:data:`MODES`)."""
    if mode == "absolute":
        return np.concatenate([xy, height[:, None]], axis=1)
    foot = np.concatenate([xy, ground.height(xy)[:, None]], axis=1)
    if mode == "vertical":
        return np.asarray(foot + height[:, None] * np.array([0.0, 0.0, 1.0]))
    return np.asarray(foot + height[:, None] * ground.normal(xy))


def planes_of(wheels: Wheels, position: Array, rotation: Array) -> Planes:
    """Planes of all wheels at n bases, wheel after wheel: (k n,)."""
    centre = position[None] + np.einsum("nij,kj->kni", rotation, wheels.centres)
    ahead = np.einsum("nij,kj->kni", rotation, wheels.axes[:, 0])
    axle = np.einsum("nij,kj->kni", rotation, wheels.axes[:, 2])
    return Planes.of(centre.reshape(-1, 3), ahead.reshape(-1, 3), axle.reshape(-1, 3))


def solved(
    wheels: Wheels, ground: Ground, land: Terrain, position: Array, rotation: Array, shape: tuple[int, ...]
) -> Pose:
    """The pose at bases ``position`` (n, 3) m, ``rotation`` (n, 3, 3); ``shape`` is that of the batch."""
    found = contact.find(land, planes_of(wheels, position, rotation))
    count = len(position)
    robot = wheels.robot
    joints = np.zeros((count, robot.n))
    status = np.full(count, Status.OK.value, dtype="U24")
    made: dict[str, WheelContact] = {}
    for k, wheel in enumerate(wheels):
        one = wheel_contact(wheel, found, slice(k * count, (k + 1) * count))
        joints[:, wheel.angle] = wheel.joint_angle(np.where(np.isfinite(one.angle), one.angle, 0.0))
        if wheel.adjust is not None:
            joints[:, wheel.adjust] = np.where(np.isfinite(one.q), one.q, 0.0)
        status = np.where(status == Status.OK.value, one.status, status)
        made[wheel.name] = one
    under = hull.touches(robot, land, position, rotation)
    status[(status == Status.OK.value) & under] = Status.BELOW_FLOOR.value
    base = np.concatenate([position, quaternion_from_matrix(rotation)], axis=1)
    return Pose(
        robot,
        ground,
        base.reshape(*shape, 7),
        {name: _shaped(one, shape) for name, one in made.items()},
        under.reshape(shape),
        joints.reshape(*shape, robot.n),
        status.reshape(shape),
    )


def wheel_contact(wheel: Wheel, found: Contacts, part: slice) -> WheelContact:
    """The contacts of one wheel, judged against its reach."""
    outcome, radius = found.outcome[part], found.radius[part]
    touching = outcome == contact.TOUCHES
    q, inside = wheel.angle_of(np.where(np.isfinite(radius), radius, wheel.range[0]))
    status = np.full(len(outcome), Status.OK.value, dtype="U24")
    if wheel.adjust is None:
        status[radius > wheel.range[1] + TOUCH] = Status.NO_CONTACT.value
        status[radius < wheel.range[0] - TOUCH] = Status.BELOW_FLOOR.value
    else:
        status[~inside] = Status.OUT_OF_REACH.value
    for code, (what, _) in _OUTCOMES.items():
        status[outcome == code] = what.value
    angle = np.remainder(found.phi[part] + np.pi, 2.0 * np.pi) - np.pi
    return WheelContact(
        name=wheel.name,
        angle=np.where(touching, angle, np.nan),
        radius=np.where(touching, radius, np.nan),
        q=np.where(touching, q, np.nan),
        point=np.where(touching[:, None], found.point[part], np.nan),
        normal=np.where(touching[:, None], found.normal[part], np.nan),
        residual=np.where(touching, found.residual[part], np.nan),
        slack=np.where(touching, found.slack[part], np.nan),
        double=np.isfinite(found.second[part]) & touching,
        second=found.second[part],
        corner=found.corner[part] & touching,
        status=status,
        wheel=wheel,
        outcome=outcome,
    )


def _shaped(one: WheelContact, shape: tuple[int, ...]) -> WheelContact:
    """With the shape of the batch."""
    arrays = {name: np.reshape(getattr(one, name), (*shape, *getattr(one, name).shape[1:]))
              for name in ("angle", "radius", "q", "point", "normal", "residual", "slack", "double", "second", "corner",
                           "status", "outcome")}  # fmt: skip
    return WheelContact(name=one.name, wheel=one.wheel, **arrays)
