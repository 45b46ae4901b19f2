"""Forces of the ground on wheels that hold a body at rest, and the torques of all motors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bodyplan.arrays import Array, TextArray
from bodyplan.errors import InputError, SolveError, Status, UnknownNameError
from bodyplan.gaits.carry.balance import Stance, friction_of, ready, stands
from bodyplan.gaits.carry.loads import paper_torque
from bodyplan.gaits.carry.pose import Pose, WheelContact
from bodyplan.gaits.carry.wheels import Wheels


@dataclass(frozen=True)
class WheelForce:
    """What one wheel carries over a batch of poses (...,); nan where the status of the pose is not ok.

    ``force`` (..., 3) N of the ground on it, in the world; ``load`` (...,) N its part along the ground's normal and
    ``ratio`` (...,) that of friction to load. ``adjust`` (...,) N m of the adjusting motor, eq. (34) signed so that
    ``adjust`` times the rate of q is the power that it gives (negative under load; 0 for a fixed radius); ``paper``
    (...,) N m by the paper's estimate (35); ``hub`` (...,) N m of the motor that turns the wheel forward. ``lowest``,
    ``highest`` (...,) N m: between them lie the torques of the adjusting motor under all forces that hold the body.
    """

    name: str
    force: Array
    load: Array
    ratio: Array
    adjust: Array
    paper: Array
    hub: Array
    lowest: Array
    highest: Array


@dataclass(frozen=True)
class Forces:
    """Statics of a batch of poses (...,). ``forces["fl"]`` is the :class:`WheelForce` of a wheel.

    ``joints`` (..., n) N m torques of the robot's joints. ``required`` (...,): the friction mu* below which nothing
    holds the body, the same on all wheels; infinite where it tips over. ``friction`` (k,): what was given, by wheel.
    ``status`` (...,): that of the pose where it is not ok, else ``slips`` (mu* is more than what is given),
    ``tips_over`` (no friction would do), ``not_converged`` or ``ok``.
    """

    wheels: Mapping[str, WheelForce]
    joints: Array
    required: Array
    friction: Array
    status: TextArray
    pose: Pose

    def __getitem__(self, name: str) -> WheelForce:
        if name not in self.wheels:
            raise UnknownNameError("wheel", name, self.wheels)
        return self.wheels[name]

    def __iter__(self) -> Iterator[WheelForce]:
        return iter(self.wheels.values())

    def reason(self, index: Any = ()) -> str:
        """Why the status at an index of the batch is what it is; empty where it is ok."""
        status, given = str(self.status[index]), ", ".join(f"{mu:.4g}" for mu in dict.fromkeys(self.friction.tolist()))
        if status == Status.SLIPS:
            return f"the wheels need a friction of {float(self.required[index]):.4g}, and have {given}"
        if status == Status.TIPS_OVER:
            return "no forces between the wheels and the ground keep the body from tipping over"
        if status == Status.NOT_CONVERGED:
            return "the search for forces did not converge"
        return self.pose.reason(index)

    def raise_if_failed(self) -> Forces:
        """These forces, or SolveError with the first pose of the batch that is not held."""
        bad = np.argwhere(self.status != Status.OK.value)
        if len(bad):
            index = tuple(int(i) for i in bad[0])
            flat = int(np.ravel_multi_index(index, self.status.shape)) if index else None
            raise SolveError(str(self.status[index]), self.reason(index), flat)
        return self


def forces(pose: Pose, mu: Any = None, objective: str = "min_norm", *, interval: bool = True) -> Forces:
    """Forces that hold the body of ``pose`` at rest, the wheels locked (paper *wheels*, eqs. (25) to (34), with the
    notes' corrections: the sum along z is +m g, moments are cross products, F . n >= 0).

    ``mu``: friction coefficient >= 0 of all wheels, of each (k,), or of those that a mapping names; default that of the
    ground, or else of the rims, or else 0.5. ``objective``: "min_norm", the forces of least square, or "min_ratio",
    those that need the least friction. ``interval``: False leaves ``lowest`` and ``highest`` out (nan), which cost two
    cone programs a wheel. Statics of 3k components under 6 equations: whichever is chosen is one of many.

    Raises InputError for values out of range, for a robot without mass and for one of fewer than three wheels, which
    stands nowhere; UnknownNameError for a wheel or an objective; MissingExtraError where forces need Clarabel.
    """
    from bodyplan.solve import contact_forces, required_friction, torque_interval

    wheels = Wheels.of(pose.robot)
    if not stands(wheels):
        raise InputError(f"robot {pose.robot.name!r}: statics need a mass and three wheels or more.")
    friction = friction_of(wheels, pose.ground, mu)
    shape = pose.status.shape
    base, q = pose.base.reshape(-1, 7), pose.joints.reshape(-1, pose.robot.n)
    found = tuple(flat(one) for one in pose)
    stance = Stance.of(wheels, found, base, q, friction)
    status = pose.status.reshape(-1).copy()
    count, size = len(status), len(wheels)
    rows = np.flatnonzero((status == Status.OK.value) & ready(stance))
    held, required = np.full((count, size, 3), np.nan), np.full(count, np.nan)
    low, high = np.full((count, size), np.nan), np.full((count, size), np.nan)
    some = stance.take(rows)
    given = (some.points, some.normals, some.center, some.weight)
    if objective not in ("min_norm", "min_ratio"):
        raise UnknownNameError("objective", objective, ("min_norm", "min_ratio"))
    if len(rows):
        solved = contact_forces(*given, friction, objective)
        held[rows], status[rows] = solved.forces, solved.status
        required[rows] = required_friction(*given, forces=False).mu
        if interval:
            low[rows], high[rows] = torque_interval(*given, friction, some.levers)
    adjust, hub = stance.adjust(held), stance.hub(held)
    joints = np.where((status == Status.OK.value)[:, None], stance.joints(wheels, np.nan_to_num(held)), np.nan)
    made = {}
    for k, wheel in enumerate(wheels):
        load = np.sum(held[:, k] * stance.normals[:, k], axis=1)
        across = np.linalg.norm(held[:, k] - load[:, None] * stance.normals[:, k], axis=1)
        none = np.abs(load) <= 0.0
        ratio = np.where(none, 0.0, across / np.where(none, 1.0, load))
        paper = paper_torque(pose.robot.mass, wheel, found[k].q, size)
        columns = (load, ratio, adjust[:, k], paper, hub[:, k], low[:, k], high[:, k])
        made[wheel.name] = WheelForce(
            wheel.name, held[:, k].reshape(*shape, 3), *(np.reshape(v, shape) for v in columns)
        )
    return Forces(
        made,
        joints.reshape(*shape, pose.robot.n),
        required.reshape(shape),
        friction,
        status.reshape(shape),
        pose,
    )


def flat(one: WheelContact) -> WheelContact:
    """With one axis for the batch."""
    return replace(
        one,
        angle=one.angle.reshape(-1),
        radius=one.radius.reshape(-1),
        q=one.q.reshape(-1),
        point=one.point.reshape(-1, 3),
        normal=one.normal.reshape(-1, 3),
    )
