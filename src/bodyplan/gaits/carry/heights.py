"""The height of a carried body in time: as asked for, or a smooth one that keeps every wheel in reach."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.gaits.carry import hull
from bodyplan.gaits.carry.carriage import Carriage, carriage
from bodyplan.gaits.carry.orientation import Function
from bodyplan.gaits.carry.reach import heights
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground

if TYPE_CHECKING:
    from bodyplan.gaits.carry.gait import Carry

#: m of way between two knots of a planned height, as a share of the body's length, and how many at most
KNOT, MOST_KNOTS = 0.5, 60
#: times between two knots at which wheels must be in reach
BETWEEN = 6
#: share of the largest margin that is kept while the height is made as smooth as it can be
KEPT = 0.95
DEGREE = 5


def height_of(
    gait: Carry, wheels: Wheels, ground: Ground, land: Terrain, ahead: float, until: float
) -> Callable[[Array], Function]:
    """The height as a function of times from 0 to ``until`` s."""
    return gait.height.at if gait.height is not None else planned(gait, wheels, ground, land, ahead, until)


def planned(
    gait: Carry, wheels: Wheels, ground: Ground, land: Terrain, ahead: float, until: float
) -> Callable[[Array], Function]:
    """The quintic spline h(t) that is farthest from the ends of the interval of heights in reach, at all times and for
    every wheel (a linear program); of those within 5 % of that margin the one of least greatest curvature. Where
    nothing is in reach it is the least out of it, and the statuses say so. InputError where there is no ground to plan
    for."""
    from scipy.interpolate import BSpline

    knots = _knots(gait, wheels, until)
    count = BETWEEN * (len(knots) - 1) + 1
    t = np.linspace(0.0, until, count)
    body = carriage(gait, land, ahead, _nothing, t)
    place = np.clip(body.position[:, :2], *land.field_box)
    low, high = heights(wheels, ground, land, place, gait.height_mode, body.turn.matrix)
    lowest, highest = np.maximum(low.max(axis=0), _hull_low(wheels, land, body)), high.min(axis=0)
    known = np.isfinite(lowest) & np.isfinite(highest) & ~body.off_map
    if not known.any():
        raise InputError("height: 'auto' finds no ground below the wheels anywhere on the path.")
    ends = np.concatenate([np.full(DEGREE, knots[0]), knots, np.full(DEGREE, knots[-1])])
    basis = BSpline.design_matrix(np.clip(t, knots[0], knots[-1]), ends, DEGREE).toarray()
    bending = BSpline(ends, np.eye(basis.shape[1]), DEGREE).derivative(2)(t)
    coefficients = _smoothest(basis[known], bending, lowest[known], highest[known])
    spline = BSpline(ends, coefficients, DEGREE)
    rate, gain = spline.derivative(1), spline.derivative(2)

    def at(times: Array) -> Function:
        inside = np.clip(times, 0.0, until)
        return Function(*(np.asarray(f(inside)) for f in (spline, rate, gain)))

    return at


def _hull_low(wheels: Wheels, land: Terrain, body: Carriage) -> Array:
    """Heights (T,) m at which points of the hull's lower faces meet the ground, for bodies at height 0: exact for
    points that are raised straight up, and near enough along the ground's normal."""
    out = np.full(len(body.position), -np.inf)
    for box in hull.boxes(wheels.robot):
        points = body.position[:, None] + np.einsum("tij,pj->tpi", body.turn.matrix, hull.lower_face(box))
        flat = points.reshape(-1, 3)
        above = land.field_height(flat[:, 0], flat[:, 1]) - flat[:, 2]
        out = np.maximum(out, above.reshape(points.shape[:2]).max(axis=1))
    return out


def _smoothest(basis: Array, bending: Array, lowest: Array, highest: Array) -> Array:
    """Coefficients (m,) of the height: largest margin, then least greatest second derivative."""
    from scipy.optimize import linprog

    rows, size = basis.shape
    one, none = np.ones((rows, 1)), np.zeros((rows, 1))
    free = [(None, None)] * size
    # unknowns: coefficients, margin
    inside = np.concatenate([np.concatenate([-basis, one], axis=1), np.concatenate([basis, one], axis=1)])
    room = np.concatenate([-lowest, highest])
    first: Any = linprog(np.append(np.zeros(size), -1.0), A_ub=inside, b_ub=room, bounds=[*free, (None, None)])
    if first.status != 0:
        raise InputError(f"height: 'auto' found none: {first.message}")
    margin = float(first.x[-1])
    kept = KEPT * margin if margin > 0.0 else margin - 1e-6
    # unknowns: coefficients, bound of |h''|
    limit = np.ones((len(bending), 1))
    smooth = np.concatenate(
        [
            np.concatenate([-basis, none], axis=1),
            np.concatenate([basis, none], axis=1),
            np.concatenate([bending, -limit], axis=1),
            np.concatenate([-bending, -limit], axis=1),
        ]
    )
    within = np.concatenate([-lowest - kept, highest - kept, np.zeros(2 * len(bending))])
    second: Any = linprog(np.append(np.zeros(size), 1.0), A_ub=smooth, b_ub=within, bounds=[*free, (0.0, None)])
    return np.asarray((second if second.status == 0 else first).x[:size])


def _knots(gait: Carry, wheels: Wheels, until: float) -> Array:
    """Times (m,) s of the spline's knots: one for half a length of the body, or a twentieth of the time if that is
    less."""
    t = np.linspace(0.0, until, 201)
    speed = np.linalg.norm(gait.course(t).velocity, axis=1)
    way = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t)))
    size = float(np.ptp(wheels.centres[:, :2], axis=0).max()) or float(wheels.wheels[0].range[1])
    return np.linspace(0.0, until, int(np.clip(np.ceil(way / (KNOT * size)), 4, MOST_KNOTS)) + 1)


def _nothing(t: Array) -> Function:
    return Function(np.zeros(len(t)), np.zeros(len(t)), np.zeros(len(t)))
