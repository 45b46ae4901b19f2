"""Segment inverse kinematics (paper *rectilinear*, (35)-(67)): from anchors to the pitch joints of a snake."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, TextArray, finite, frozen, number
from bodyplan.errors import InputError, SolveError, Status
from bodyplan.gaits.rectilinear.legs import REACH, leg
from bodyplan.gaits.rectilinear.transforms import Transform, matrices
from bodyplan.ground.base import Ground
from bodyplan.ground.profile import Levels, Profile

#: relative slack of planes, floors, ceilings and joint limits
SLACK = 1e-12


@dataclass(frozen=True, eq=False)
class Pose:
    """A snake on its anchors: N of them, N - 1 legs of two links each.

    ``joints`` (..., 2 N - 2) rad: the pitch joints in serial order, nose-up positive: first anchor, first elbow, second
    anchor, ..., last elbow. ``closing`` (...,) rad: the joint at the last anchor, which levels the head link; all
    of them sum to 0. ``elbows`` (..., N - 1, k) m, as many coordinates as the anchors have. ``status``: a
    :class:`bodyplan.Status`, or an array (...,) of their texts. ``angles`` (..., 2 N - 2) rad: absolute angles of the
    links. ``points`` (..., 2 N - 1, 3) m: every joint in the world, from the first anchor to the last.

    Angles and elbows of legs that cannot reach are NaN; those of poses refused for another reason are what they are.
    """

    joints: Array
    closing: Array
    elbows: Array
    status: Status | TextArray
    angles: Array
    points: Array

    @property
    def ok(self) -> bool:
        """True where every pose stands."""
        return bool(np.all(np.asarray(self.status) == Status.OK.value))

    @property
    def all_joints(self) -> Array:
        """(..., 2 N - 1) rad: ``joints`` and ``closing`` in one array."""
        return np.concatenate([self.joints, self.closing[..., None]], axis=-1)

    def raise_if_failed(self) -> Pose:
        """This pose, or SolveError with the status of the first that does not stand."""
        status = np.atleast_1d(np.asarray(self.status)).ravel()
        bad = np.flatnonzero(status != Status.OK.value)
        if len(bad):
            index = int(bad[0]) if np.ndim(np.asarray(self.status)) else None
            raise SolveError(str(status[bad[0]]), REASONS[Status(str(status[bad[0]]))], index)
        return self


#: what each refusal means, in the order in which they are told
REASONS = {
    Status.NOT_COPLANAR: "the anchors do not lie in one upright plane",
    Status.WRONG_ORDER: "an anchor is not ahead of the one behind it",
    Status.OUT_OF_REACH: "two neighbouring anchors are farther apart than the links between them reach",
    Status.COLLAPSED: "two neighbouring anchors are nearer to each other than the links between them can fold",
    Status.LIMIT: "a joint is beyond its limits",
    Status.LINKS_CROSSING: "two links cross",
    Status.BELOW_FLOOR: "a link reaches below the floor or through the edge of a step",
    Status.ABOVE_CEILING: "a link reaches above the ceiling",
}


def pose(
    anchors: ArrayLike | Transform,
    links: float | Sequence[float] | Array,
    *,
    floor: Levels | None = None,
    ceiling: Levels | None = None,
    ground: Ground | None = None,
    limits: ArrayLike | None = None,
    radius: float = 0.0,
    heading: float | None = None,
) -> Pose:
    """The pitch joints that set a snake on its anchors, elbows up. Any number N >= 2 of anchors, one pose or a batch.

    ``anchors``: points (..., N, 2) as x, z or (..., N, 3) as x, y, z in m, or transforms (..., N, 4, 4), in serial
    order, tail first; any heights. ``links`` m: one length, or 2 N - 2 of them, those between the pitch joints (in the
    paper an "arm" of 1000 mm is a module: between two pitch joints lie two of them). ``heading`` rad about z of the
    body's way forward; default: the way of the anchors' plane that is nearest to +x.

    ``floor`` and ``ceiling``: z in m, or steps [(x_start, z), ...], as for :class:`bodyplan.Profile`; ``ground``: a
    ground instead. Every link must keep ``radius`` m away from it along its whole length. ``limits`` (2,) or
    (2 N - 1, 2) rad, low and high: of the joints, the closing one last; infinite where there is none.

    Statuses, in the order in which they are told: ``not_coplanar``, ``wrong_order``, ``out_of_reach``, ``collapsed``,
    ``limit``, ``links_crossing``, ``below_floor``, ``above_ceiling``. Reach has a relative slack of 1e-12.

    Corrections: alpha is signed; the middle joint is psi_L + psi_R - alpha_L + alpha_R and the closing one
    beta_R - alpha_R ((58) and (65) miss the head on stairs); the denominators of (47)-(50), (51), (53), see
    :mod:`bodyplan.gaits.rectilinear.legs`. Raises InputError for arguments of the wrong shape, and for transforms that
    are not rigid.
    """
    points, flat = _points(anchors)
    count = points.shape[-2]
    lengths = link_lengths(links, count)
    radius = number(radius, "radius", at_least=0.0)
    scale = float(lengths.max())
    ahead = _ahead(points, heading)
    along = np.einsum("...ij,...j->...i", points[..., :2], ahead)
    across = points[..., 1] * ahead[..., None, 0] - points[..., 0] * ahead[..., None, 1]
    planar = np.ptp(across, axis=-1) <= 1e-9 * (scale + np.ptp(along, axis=-1))
    x, z = np.diff(along, axis=-1), np.diff(points[..., 2], axis=-1)
    a, b = lengths[0::2], lengths[1::2]
    legs = leg(a, b, x, z)
    angles = np.stack([legs.rear, legs.front], axis=-1).reshape(*points.shape[:-2], len(lengths))
    level = np.zeros((*angles.shape[:-1], 1))
    bends = np.diff(np.concatenate([level, angles, level], axis=-1), axis=-1)
    steps = lengths[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    elbow_along = along[..., :-1] + steps[..., 0::2, 0]
    elbow_z = points[..., :-1, 2] + steps[..., 0::2, 1]
    elbows = np.stack(
        [
            elbow_along * ahead[..., None, 0] - across[..., :-1] * ahead[..., None, 1],
            elbow_along * ahead[..., None, 1] + across[..., :-1] * ahead[..., None, 0],
            elbow_z,
        ],
        axis=-1,
    )
    every = np.empty((*points.shape[:-2], 2 * count - 1, 3))
    every[..., 0::2, :], every[..., 1::2, :] = points, elbows
    joint_limits = None
    if limits is not None:
        joint_limits = _limits(limits, 2 * count - 1)
    grounds = _grounds(floor, ceiling, ground, every, radius)
    slack = REACH * (a + b) ** 2
    tests = {
        Status.NOT_COPLANAR: ~planar,
        # anchors in one place are collapsed, not in the wrong order
        Status.WRONG_ORDER: np.any((x < 0.0) | ((x == 0.0) & (z != 0.0)), axis=-1),
        Status.OUT_OF_REACH: np.any(legs.short < -slack, axis=-1),
        Status.COLLAPSED: np.any(legs.folded <= REACH * (a + b) ** 2, axis=-1),
        Status.LIMIT: _beyond(bends, joint_limits),
        Status.LINKS_CROSSING: links_cross(np.stack([_along(every, ahead), every[..., 2]], axis=-1)),
        **{name: _reaches_into(every, solid, radius, scale) for name, solid in grounds.items()},
    }
    status = np.full(planar.shape, Status.OK.value, dtype="U24")
    for name in REASONS:
        if name in tests:
            status[(status == Status.OK.value) & tests[name]] = name.value
    return Pose(
        frozen(bends[..., :-1]),
        frozen(bends[..., -1]),
        frozen(elbows[..., [0, 2]] if flat else elbows),
        Status(str(status)) if status.ndim == 0 else status,
        frozen(angles),
        frozen(every),
    )


def link_lengths(links: float | Sequence[float] | Array, anchors: int) -> Array:
    """Lengths (2 N - 2,) m of the links between N anchors, or InputError."""
    lengths = finite(links, "links")
    count = 2 * anchors - 2
    if lengths.ndim == 0:
        lengths = np.full(count, float(lengths))
    if lengths.shape != (count,):
        raise InputError(f"links: {anchors} anchors need one length or {count}, got shape {lengths.shape}.")
    if np.any(lengths <= 0.0):
        raise InputError(f"links: must be > 0, got {float(lengths.min())}.")
    return lengths


def links_cross(points: Array) -> Any:
    """(...,) True where two links that do not share a joint touch or cross; ``points`` (..., p, 2) m along, up."""
    first, second = np.triu_indices(points.shape[-2] - 1, 2)
    p, q = points[..., first, :], points[..., first + 1, :]
    r, s = points[..., second, :], points[..., second + 1, :]
    with np.errstate(invalid="ignore"):
        sides = [_side(p, q, r), _side(p, q, s), _side(r, s, p), _side(r, s, q)]
        crossing = (sides[0] * sides[1] <= 0.0) & (sides[2] * sides[3] <= 0.0)
        # on one line the sides say nothing: then they touch where their spans do
        low, high = np.maximum(np.minimum(p, q), np.minimum(r, s)), np.minimum(np.maximum(p, q), np.maximum(r, s))
        crossing &= np.all(low <= high, axis=-1)
    return np.any(crossing, axis=-1)


def _side(p: Array, q: Array, point: Array) -> Array:
    """Twice the signed area of a triangle: which side of the line from p to q a point is on."""
    u, v = q - p, point - p
    return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])


def _points(anchors: ArrayLike | Transform) -> tuple[Array, bool]:
    """Positions (..., N, 3), and whether they were given as x, z."""
    values = anchors.matrix if isinstance(anchors, Transform) else finite(anchors, "anchors")
    if values.ndim >= 3 and values.shape[-2:] == (4, 4):
        points, flat = matrices(anchors, "anchors")[..., :3, 3], False
    elif values.ndim >= 2 and values.shape[-1] in (2, 3):
        flat = values.shape[-1] == 2
        points = np.stack([values[..., 0], 0.0 * values[..., 0], values[..., 1]], axis=-1) if flat else values
    else:
        raise InputError(
            f"anchors: expected points (..., N, 2) as x, z or (..., N, 3), or transforms (..., N, 4, 4), got shape "
            f"{values.shape}."
        )
    if points.shape[-2] < 2:
        raise InputError(f"anchors: needs at least two, got {points.shape[-2]}.")
    return points, flat


def _ahead(points: Array, heading: float | None) -> Array:
    """Horizontal unit vector (..., 2) of the way forward."""
    if heading is not None:
        angle = number(heading, "heading")
        return np.broadcast_to([np.cos(angle), np.sin(angle)], (*points.shape[:-2], 2))
    way = points[..., -1, :2] - points[..., 0, :2]
    size = np.linalg.norm(way, axis=-1, keepdims=True)
    way = np.where(size > 0.0, way / np.where(size > 0.0, size, 1.0), [1.0, 0.0])
    back = (way[..., 0] < 0.0) | ((way[..., 0] == 0.0) & (way[..., 1] < 0.0))
    return np.where(back[..., None], -way, way)


def _along(every: Array, ahead: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", every[..., :2], ahead))


def _limits(given: ArrayLike, joints: int) -> Array:
    """Lowest and highest angles (joints, 2) rad, or InputError."""
    try:
        values = np.array(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"limits: expected numbers, got {given!r}.") from error
    if values.shape not in ((2,), (joints, 2)):
        raise InputError(f"limits: expected shape (2,) or ({joints}, 2), got {values.shape}.")
    if not np.all(values[..., 0] <= values[..., 1]):
        raise InputError(f"limits: every low must be <= its high, got {given!r}.")
    return np.broadcast_to(values, (joints, 2))


def _beyond(bends: Array, limits: Array | None) -> Any:
    if limits is None:
        return np.zeros(bends.shape[:-1], dtype=bool)
    slack = SLACK * np.pi
    with np.errstate(invalid="ignore"):
        return np.any((bends < limits[:, 0] - slack) | (bends > limits[:, 1] + slack), axis=-1)


def _grounds(
    floor: Levels | None, ceiling: Levels | None, ground: Ground | None, every: Array, radius: float
) -> dict[Status, Ground]:
    """Floor and ceiling as grounds of their own, so that it is known which of them a link reaches into."""
    if ground is not None:
        if floor is not None or ceiling is not None:
            raise InputError("ground: give either a ground, or floor and ceiling.")
        if not isinstance(ground, Ground):
            raise InputError(f"ground: expected a Ground, got {ground!r}.")
        if not isinstance(ground, Profile):
            return {Status.BELOW_FLOOR: ground}
        levels = ground.to_dict()
        floor, ceiling = levels["floor"], levels["ceiling"]
    out: dict[Status, Ground] = {}
    if floor is not None:
        out[Status.BELOW_FLOOR] = Profile(floor)
    if ceiling is not None:
        profile = Profile(_far_below(ceiling, every, radius), ceiling)
        out[Status.ABOVE_CEILING] = profile
    if floor is not None and ceiling is not None:
        Profile(floor, ceiling)  # says where the ceiling touches the floor
    return out


def _far_below(ceiling: Levels, every: Array, radius: float) -> float:
    """A floor that nothing can touch."""
    heights = every[..., 2][np.isfinite(every[..., 2])].tolist()
    with suppress(TypeError, ValueError):  # Profile says what is wrong with it
        steps: Any = ceiling
        levels = [steps] if isinstance(ceiling, (int, float, np.integer, np.floating)) else [z for _, z in steps]
        heights += [float(z) for z in levels if z is not None and np.isfinite(z)]
    low, high = min(heights, default=0.0), max(heights, default=0.0)
    return low - 10.0 * (high - low + radius + 1.0)


def _reaches_into(every: Array, ground: Ground, radius: float, scale: float) -> Any:
    ends = np.stack([every[..., :-1, :], every[..., 1:, :]], axis=-2)
    known = np.isfinite(ends).all(axis=(-2, -1))
    gap = np.full(known.shape, np.inf)
    if known.any():
        gap[known] = ground.segment_clearance(ends[known]) - radius
    size = scale + np.abs(every[..., 2]).max(initial=0.0, where=np.isfinite(every[..., 2]))
    return np.any(gap < -SLACK * size, axis=-1)
