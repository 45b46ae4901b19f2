"""What a body can do over one place, by heading and height: reach, friction needed, tipping over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, TextArray, finite, whole
from bodyplan.errors import InputError, Status
from bodyplan.gaits.carry.balance import Stance, friction_of, ready, stands
from bodyplan.gaits.carry.forces import flat
from bodyplan.gaits.carry.pose import pose
from bodyplan.gaits.carry.reach import Reach, reach
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground
from bodyplan.robot.model import Robot
from bodyplan.spatial.hulls import edge_distances

HEADINGS, HEIGHTS = 37, 25


@dataclass(frozen=True)
class Maps:
    """Over ``headings`` (p,) rad and ``heights`` (h,) m of a body at one place. Arrays (h, p):

    ``reached``: every wheel touches within its reach and the hull is clear. ``required``: the friction mu* below which
    nothing holds the body, infinite where it tips over, nan where it is not reached or robots have no statics.
    ``margin`` m: how far, seen from above, the centre of mass is inside the polygon of the contacts, negative outside;
    nan where they are unknown. ``status``: "ok", "slips", "tips_over", or why it is not reached. ``reach``: the heights
    at which every heading is in reach of the wheels, exactly. ``friction`` (k,) of the wheels.
    """

    headings: Array
    heights: Array
    reached: BoolArray
    required: Array
    margin: Array
    status: TextArray
    reach: Reach
    friction: Array


def maps(
    robot: Robot,
    ground: Ground,
    position: ArrayLike,
    *,
    headings: ArrayLike | int = HEADINGS,
    heights: ArrayLike | int = HEIGHTS,
    height_mode: str = "absolute",
    roll: float = 0.0,
    pitch: float = 0.0,
    mu: Any = None,
) -> Maps:
    """Maps over heading and height at ``position`` (2,) m, with ``roll`` and ``pitch`` rad; see
    :func:`bodyplan.gaits.carry.pose`.

    ``headings`` rad and ``heights`` m: values in ascending order, or how many there are to be: headings all the way
    round, heights over all those that are in reach for some heading. ``mu``: as in :func:`bodyplan.gaits.carry.forces`.
    Raises InputError, also where no height is in reach for any heading and none are given; MissingExtraError where
    friction needs Clarabel.
    """
    place = finite(position, "position", (2,))
    psi = _values(headings, "headings")
    psi = np.linspace(-np.pi, np.pi, psi) if isinstance(psi, int) else psi
    wheels = Wheels.of(robot)
    friction = friction_of(wheels, ground, mu)
    ends = reach(robot, ground, place, height_mode, roll, pitch, psi)
    h = _values(heights, "heights")
    if isinstance(h, int):
        low, high = ends.lowest[ends.possible], ends.highest[ends.possible]
        if not len(low):
            raise InputError("heights: none is in reach for any of the headings; give those to look at.")
        h = np.linspace(low.min(), high.max(), h)
    at = pose(robot, ground, place, h[:, None], height_mode, roll, pitch, psi[None, :])
    shape = at.status.shape
    status = at.status.reshape(-1).copy()
    required, margin = np.full(len(status), np.nan), np.full(len(status), np.nan)
    if stands(wheels):
        stance = Stance.of(
            wheels,
            tuple(flat(one) for one in at),
            at.base.reshape(-1, 7),
            at.joints.reshape(-1, robot.n),
            friction,
        )
        known = ready(stance)
        margin[known] = edge_distances(stance.points[known, :, :2], stance.center[known, :2]).min(axis=1)
        rows = np.flatnonzero(known & (status == Status.OK.value))
        if len(rows):
            from bodyplan.solve import contact_forces, required_friction

            some = stance.take(rows)
            given = (some.points, some.normals, some.center, some.weight)
            required[rows] = required_friction(*given, forces=False).mu
            if np.ptp(friction) == 0.0:
                status[rows[required[rows] > friction[0]]] = Status.SLIPS.value
                status[rows[np.isinf(required[rows])]] = Status.TIPS_OVER.value
            else:
                status[rows] = contact_forces(*given, friction).status
    return Maps(
        psi,
        h,
        at.ok,
        required.reshape(shape),
        margin.reshape(shape),
        status.reshape(shape),
        ends,
        friction,
    )


def _values(given: ArrayLike | int, name: str) -> Array | int:
    """Values in ascending order, or how many."""
    if isinstance(given, int):
        return whole(given, name, at_least=2, at_most=1000)
    values = finite(given, name, (None,))
    if not len(values) or np.any(np.diff(values) <= 0.0):
        raise InputError(f"{name}: expected values in ascending order, or how many there are to be, got {given!r}.")
    return values
