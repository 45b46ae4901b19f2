"""``bp.fit``: joint angles with which a robot lies along a body curve, and how well it does."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, TextArray, finite
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError, SolveError, Status, UnknownNameError
from bodyplan.fitting.angles import JointAngles
from bodyplan.fitting.following import Following, body_points, followings
from bodyplan.fitting.mechanism import PITCH, YAW, Mechanism, mechanism
from bodyplan.fitting.optimal import EXACT, optimal
from bodyplan.fitting.rules import kink_quaternion, rule
from bodyplan.fitting.turning import body_turning
from bodyplan.robot.model import Robot
from bodyplan.spatial import compose, quaternion_from_matrix

METHODS = ("paper", "optimal")
#: m that a robot may stick out of a curve that ends
BEYOND = 1e-9
#: share of the body that rounding of the places on the curve may be
FARTHEST = 1e-6
#: rad: a joint that is so near its limit is at it
AT_LIMIT = 1e-9


class Turning(NamedTuple):
    """Angles (pitch, yaw) rad, (..., S, 2), that the ``curve`` and the ``mechanism`` have turned by at body lengths s
    (paper *acm*, eqs. (7)-(9)): for hinges a staircase, for arcs a polyline."""

    curve: Array
    mechanism: Array


class Fit:
    """A robot along a body curve; ``...`` is the batch shape: curves (if a list was given) x starts (if an array).

    ``q`` (..., n) rad, in the robot's order and by name: ``fit.q["yaw3"]``. ``kink`` (..., 2): (pitch, yaw) rad of the
    virtual joint at the tail; ``base`` (..., 7): pose of the robot's base, the curve's frame at ``start`` turned by
    the kink. ``robot.forward(fit.q, fit.base)`` lies along the curve.
    ``status`` (...): "ok"; "limit" where the paper's rule goes beyond joint limits (it is never clipped);
    "curve_ended" where the robot sticks out of a curve that ends; "not_converged" where the optimiser gave up.
    ``method``, ``p``, ``robot``, ``curve`` (or a tuple of curves) and ``start``: what was asked for.
    What costs more is worked out when first asked for.
    """

    def __init__(
        self,
        robot: Robot,
        curves: tuple[BodyCurve, ...],
        many: bool,
        start: Array,
        method: str,
        p: float | None,
        q: Array,
        kink: Array,
        converged: BoolArray,
        paper: Fit | None = None,
    ) -> None:
        self.robot, self.start, self.method = robot, start, method
        self.curve: BodyCurve | tuple[BodyCurve, ...] = curves if many else curves[0]
        self.p = rule(robot, p).p
        self._curves = tuple(curve.untwisted() for curve in curves)
        self._given = curves
        self._mechanism: Mechanism = mechanism(robot)
        self._paper = paper
        self._shape = ((len(curves),) if many else ()) + start.shape
        n = robot.n
        # everything inside is (curves, starts, ...)
        self._q, self._kink = q.reshape(len(curves), -1, n), kink.reshape(len(curves), -1, 2)
        self._converged = converged.reshape(len(curves), -1)
        self.q = JointAngles(self._q.reshape(*self._shape, n), robot.joints)
        self.kink: Array = self._out(self._kink)

    @property
    def shape(self) -> tuple[int, ...]:
        """Batch shape."""
        return self._shape

    def __len__(self) -> int:
        if not self._shape:
            raise TypeError("a single fit has no length")
        return self._shape[0]

    @property
    def length(self) -> float:
        """Length of the robot, L_t, m."""
        return self._mechanism.length

    def _out(self, values: Any) -> Any:
        """(curves, starts, ...) in the batch shape."""
        return values.reshape(self._shape + values.shape[2:])

    def _scalars(self, values: Array) -> Any:
        out = self._out(values)
        return out if self._shape else out.item()

    # --- pose and points ------------------------------------------------------------------------------------------

    @cached_property
    def base(self) -> Array:
        """(..., 7): pose of the base, m and quaternion wxyz; error <= 1e-10."""
        out: Array = self._out(self._base)
        return out

    @cached_property
    def _base(self) -> Array:
        turn = kink_quaternion(self._kink, self._mechanism.kind == "straight")
        kinks = np.concatenate([np.zeros((*turn.shape[:-1], 3)), turn], axis=-1)
        poses = []
        for curve in self._curves:
            points, turns = curve.frames(self.start.ravel())
            poses.append(np.concatenate([points, quaternion_from_matrix(turns)], axis=-1))
        return compose(np.stack(poses), kinks)

    def points(self, s: ArrayLike) -> Array:
        """Points (..., S, 3) m of the mechanism at body lengths s (S,) m, from 0 at the tail to the robot's length."""
        at = self._places(s)
        size = self._q.shape[:2]
        q, base = self._q.reshape(-1, self.robot.n), self._base.reshape(-1, 7)
        out: Array = self._out(body_points(self.robot, self._mechanism, q, base, at).reshape(*size, len(at), 3))
        return out

    def curve_points(self, s: ArrayLike) -> Array:
        """Points (..., S, 3) m of the curve at ``start + s``, s (S,) m."""
        at = self._places(s)
        places = (self.start.ravel()[:, None] + at).ravel()
        found = [curve.frames(places)[0].reshape(-1, len(at), 3) for curve in self._curves]
        out: Array = self._out(np.stack(found))
        return out

    def turning(self, s: ArrayLike) -> Turning:
        """phi of curve and mechanism at body lengths s (S,) m; see :class:`Turning`."""
        at = self._places(s)
        begin = self.start.ravel()[:, None]
        both = []
        for curve in self._curves:
            _, pitch, yaw = curve.integral(np.broadcast_to(begin, (len(begin), len(at))), begin + at)
            both.append(np.stack([pitch, yaw], axis=-1))
        body = body_turning(self._mechanism, self._q, self._kink, at)
        return Turning(self._out(np.stack(both)), self._out(body))

    def _places(self, s: ArrayLike) -> Array:
        at = np.atleast_1d(finite(s, "s"))
        slack = 1e-9 * self.length
        if at.ndim != 1 or np.any(at < -slack) or np.any(at > self.length + slack):
            raise InputError(f"s: body lengths (S,) must be within 0 .. {self.length}, got {s!r}.")
        return np.clip(at, 0.0, self.length)

    # --- how well -------------------------------------------------------------------------------------------------

    @cached_property
    def _followings(self) -> list[list[tuple[Any, Following]]]:
        starts = self.start.ravel()
        return [followings(self.robot, self._mechanism, curve, starts) for curve in self._curves]

    def _measured(self, tail: tuple[int, ...], measure: Callable[[Following, Array, Array], Array]) -> Array:
        out = np.empty((*self._q.shape[:2], *tail))
        for c, groups in enumerate(self._followings):
            for group, following in groups:
                out[c, group] = measure(following, self._q[c, group], self._kink[c, group])
        return out

    @cached_property
    def _errors(self) -> Array:
        return self._measured((2,), lambda f, q, kink: f.errors(q, kink))

    @property
    def error(self) -> Any:
        """(...): E_nm of eq. (6), the mean distance between curve and mechanism over the robot's length."""
        return self._scalars(self._errors[..., 0])

    @property
    def quadrature_error(self) -> Any:
        """(...): how far ``error`` may be off: quadrature, and the curve that it is measured to."""
        return self._scalars(self._errors[..., 1])

    @cached_property
    def max_distance(self) -> Any:
        """(...) m: the largest distance between curve and mechanism at equal body length."""
        return self._scalars(self._measured((), lambda f, q, kink: f.farthest(q, kink)))

    def distance(self, s: ArrayLike) -> Array:
        """(..., S) m: distance between curve and mechanism at body lengths s (S,) m."""
        at = self._places(s)
        out: Array = self._out(self._measured((len(at),), lambda f, q, kink: f.distance(q, kink, at)))
        return out

    @property
    def paper(self) -> Fit:
        """The fit by the paper's rule: where the optimiser began, without joint limits."""
        return self if self._paper is None else self._paper

    @property
    def gain(self) -> Any:
        """(...): ``error`` over that of the paper's rule; 1 for the rule itself, and where it leaves only rounding.
        Above 1 only where the rule is beyond the joint limits."""
        mine, theirs = self._errors[..., 0], self.paper._errors[..., 0]
        some = theirs > EXACT
        return self._scalars(np.where(some, mine / np.where(some, theirs, 1.0), 1.0))

    # --- limits and status ----------------------------------------------------------------------------------------

    @cached_property
    def _excess(self) -> Array:
        low, high = self.robot.limits.T
        return np.asarray(np.maximum(self._q - high, low - self._q))

    @property
    def excess(self) -> Array:
        """(..., n) rad: how far joints are beyond their limits, 0 within."""
        out: Array = self._out(np.maximum(self._excess, 0.0))
        return out

    @property
    def limits(self) -> dict[str, float]:
        """The joints that saturate somewhere in the batch, and by how much at most they exceed their limits, rad: 0.0
        for a joint that is at its limit."""
        worst = self._excess.reshape(-1, self.robot.n).max(axis=0, initial=-np.inf)
        return {
            name: max(float(x), 0.0) if x > AT_LIMIT else 0.0
            for name, x in zip(self.robot.joints, worst, strict=True)
            if x >= -AT_LIMIT
        }

    @cached_property
    def _status(self) -> TextArray:
        out = np.full(self._q.shape[:2], Status.OK.value, dtype="<U16")
        out[~self._converged] = Status.NOT_CONVERGED.value
        out[np.any(self._excess > AT_LIMIT, axis=-1)] = Status.LIMIT.value
        starts = self.start.ravel()
        for c, curve in enumerate(self._given):
            low, high = curve.extent
            out[c, (starts < low - BEYOND) | (starts + self.length > high + BEYOND)] = Status.CURVE_ENDED.value
        return out

    @property
    def status(self) -> Any:
        """(...) text, a :class:`~bodyplan.errors.Status`; one text for a single fit."""
        out = self._out(self._status)
        return out if self._shape else str(out[()])

    @property
    def ok(self) -> bool:
        """True where every fit of the batch is "ok"."""
        return bool(np.all(self._status == Status.OK.value))

    def raise_if_failed(self) -> Fit:
        """This fit, or SolveError saying why the first fit that failed did."""
        flat = self._status.ravel()
        for index in np.flatnonzero(flat != Status.OK.value):
            status = Status(str(flat[index]))
            where = int(index) if self._shape else None
            if status is Status.CURVE_ENDED:
                curve = self._given[index // self._q.shape[1]]
                at = float(self.start.ravel()[index % self._q.shape[1]])
                raise SolveError(
                    status,
                    f"the robot takes {at:.6g} .. {at + self.length:.6g} m of a curve of {curve.length:.6g} m",
                    where,
                )
            if status is Status.LIMIT:
                excess = self._excess.reshape(-1, self.robot.n)[index]
                worst = int(np.argmax(excess))
                low, high = self.robot.limits[worst]
                q = self._q.reshape(-1, self.robot.n)[index, worst]
                name = self.robot.joints[worst]
                raise SolveError(
                    status, f"joint {name!r} would be at {q:.6g} rad, its limits are ({low}, {high})", where
                )
            raise SolveError(status, "the optimiser stopped before its gradient was small", where)
        return self

    def __repr__(self) -> str:
        batch = f", batch {self._shape}" if self._shape else ""
        return f"Fit({self.method}, robot {self.robot.name!r}{batch}, {'ok' if self.ok else 'not ok'})"


def fit(
    curve: BodyCurve | Sequence[BodyCurve],
    robot: Robot,
    method: str = "paper",
    p: float | None = None,
    start: ArrayLike = 0.0,
) -> Fit:
    """Lay a robot along a body curve: joint angles, the kink of its base, and how well they match.

    ``curve``: a :class:`BodyCurve`, or a list of them. ``robot``: one chain, straight along x at q = 0, of hinges about
    y and z, arcs, or double joints. ``start`` m: arc length of the curve at the robot's tail, a number or an array (a
    travelling wave).

    ``method`` "paper" (*acm*): straight links by (2)-(3), with kappa(s) as the integrand; arcs by (11)-(17); double
    joints by (33)-(34); angles are never clipped to joint limits. "optimal": the angles within joint limits and the
    kink that minimise E_nm, eq. (6), from the paper's rule on; never worse than the rule within those limits.
    The error falls with the square of the number of straight or double joints, with the cube for arcs (Gauss node);
    but in space only as 1/n for straight "universal" joints by the paper's rule, which was made for joints in turns:
    yaw then pitch at one place also rolls what follows. "optimal" makes up for it.
    ``p`` in (0.5, 1]: the parameter of (11)-(16), default the Gauss node 1/2 + 1/(2 sqrt 3); 0.789 is the paper's.

    The joints only bend, so a twisted curve is followed in its frame without roll (``curve.untwisted()``): the points
    are the same. Beyond its ends a curve of pieces or points is straight, and the status "curve_ended"; waves go on.

    Raises InputError for a robot that no rule is known for (saying why), UnknownNameError for another method.
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS, where="fit")
    many = not isinstance(curve, BodyCurve)
    curves = _curves(curve)
    begin = np.array(finite(start, "start"))
    if not begin.size:
        raise InputError("start: needs at least one value.")
    begin.flags.writeable = False
    angles = rule(robot, p)
    length = angles.mechanism.length
    if np.spacing(np.abs(begin).max()) > FARTHEST * length:
        raise InputError(f"start: too far for a body of {length:.6g} m to be told from a point, got {start!r}.")
    bends = [angles.evaluate(each, begin, 0) for each in curves]
    q, kink = np.array([b.q for b in bends]), np.array([b.kink for b in bends])
    fine = np.ones((len(curves), begin.size), dtype=bool)
    paper = Fit(robot, curves, many, begin, "paper", p, q, kink, fine)
    if method == "paper":
        return paper
    axes = [axis for axis in (PITCH, YAW) if axis in angles.mechanism.axes]
    q, kink, fine = optimal(paper._followings, paper._q, paper._kink, axes)
    return Fit(robot, curves, many, begin, "optimal", p, q, kink, fine, paper)


def _curves(curve: Any) -> tuple[BodyCurve, ...]:
    if isinstance(curve, BodyCurve):
        return (curve,)
    given = tuple(curve) if isinstance(curve, Iterable) and not isinstance(curve, (str, bytes)) else (curve,)
    for each in given:
        if not isinstance(each, BodyCurve):
            raise InputError(f"curve: expected a body curve or a list of them, got {type(each).__name__}.")
    if not given:
        raise InputError("curve: needs at least one body curve.")
    return given
