"""The paper's rules for joint angles along a curve (paper *acm*, eqs. (2)-(3), (11)-(17), (33)-(34)).

Every bend is a weighted sum of the antiderivative Phi of the curvature at a few fixed places of the body: the rule is
a matrix that is built once a robot. Corrections to the paper: in (2), (3) the integrand is kappa(s), not kappa(l i);
the virtual joint at the tail (a kink between the curve's frame and the base) is not optional; (33), (34) are used in
their regular form at 0 and with atan2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, finite, frozen, number, whole
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError
from bodyplan.fitting.double import Jet, double_angles
from bodyplan.fitting.mechanism import PITCH, YAW, Mechanism, mechanism
from bodyplan.robot.model import Robot
from bodyplan.spatial import matrix_from_quaternion, multiply, quaternion_exp

#: p of eqs. (11)-(16): the Gauss node, from p (1 - p) = 1/6. The paper's 0.789 is near it.
GAUSS_P = 0.5 + 0.5 / np.sqrt(3.0)
#: weights below this are dropped; the recursions (12), (15) forget by (1 - p)/p a unit
NEGLIGIBLE = 1e-20
#: entries from which on a weight matrix is kept sparse
DENSE_UP_TO = 1_000_000


@dataclass(frozen=True)
class Bends:
    """Joint coordinates and the kink of the base frame, with derivatives where they were asked for, else None.

    ``q``, ``q1``, ``q2`` (..., n) in the robot's joint order. ``kink``, ``kink1``, ``kink2`` (..., 2): (pitch, yaw)
    rad of the virtual joint at the tail. ``kink_quaternion`` (..., 4) and ``kink_rotation`` (..., 3, 3): the base as
    seen from the curve's frame at the tail, Rz(yaw) Ry(pitch) for hinges and exp((0, pitch, yaw)) for arcs and doubles.
    """

    q: Array
    kink: Array
    q1: Array | None = None
    kink1: Array | None = None
    q2: Array | None = None
    kink2: Array | None = None
    hinged: bool = True

    @property
    def kink_quaternion(self) -> Array:
        """(..., 4) wxyz."""
        return kink_quaternion(self.kink, self.hinged)

    @property
    def kink_rotation(self) -> Array:
        """(..., 3, 3)."""
        return matrix_from_quaternion(self.kink_quaternion)


def kink_quaternion(kink: ArrayLike, hinged: bool) -> Array:
    """Quaternions (..., 4) of kinks (..., 2) = (pitch, yaw) rad; see :class:`Bends`."""
    angles = np.asarray(kink, dtype=np.float64)
    pitch, yaw = np.zeros((*angles.shape[:-1], 3)), np.zeros((*angles.shape[:-1], 3))
    pitch[..., 1], yaw[..., 2] = angles[..., 0], angles[..., 1]
    return multiply(quaternion_exp(yaw), quaternion_exp(pitch)) if hinged else quaternion_exp(pitch + yaw)


class Rule:
    """The rule of one robot. ``nodes`` (K,) m: the places of the body, from its tail, at which the curve is asked.
    ``joints``: names of the n joint coordinates. ``p``: the parameter of (11)-(16) (nothing to straight links)."""

    def __init__(self, robot: Robot, p: float | None = None) -> None:
        self.mechanism: Mechanism = mechanism(robot)
        self.joints: tuple[str, ...] = self.mechanism.joints
        self.p = GAUSS_P if p is None else number(p, "p", above=0.5, at_most=1.0)
        rows = {axis: _rows(self.mechanism, axis, self.p) for axis in (PITCH, YAW)}
        # Phi is counted from the tail: it is 0 there
        places = sorted({s for table in rows.values() for row in table for s in row} - {0.0})
        column = {s: k for k, s in enumerate(places)}
        self.nodes: Array = frozen(places)
        self._weights = [_matrix(rows[axis], column) for axis in (PITCH, YAW)]
        self._joints_of = [self.mechanism.joints_of(axis) for axis in (PITCH, YAW)]
        place = self.mechanism.joint_place
        both = np.intersect1d(place[self._joints_of[PITCH]], place[self._joints_of[YAW]])
        double = self.mechanism.kind == "double"
        self._double: IntArray = both if double else both[:0]
        self._rows_of = [np.searchsorted(place[self._joints_of[axis]], self._double) + 1 for axis in (PITCH, YAW)]
        self._yaw_outer = self.mechanism.outer[self._double] == YAW

    @property
    def hinged(self) -> bool:
        """True for straight links, whose kink is two hinges."""
        return self.mechanism.kind == "straight"

    def apply(self, phi: ArrayLike, phi1: ArrayLike | None = None, phi2: ArrayLike | None = None) -> Bends:
        """Joint coordinates from ``phi`` (..., K, 2): the integrals of (kappa_p, kappa_y) from the tail to the nodes,
        rad. ``phi1``, ``phi2``: its first and second derivatives with respect to any one parameter, same shape; the
        results then have theirs. Raises InputError for a wrong shape, or a second derivative without the first."""
        if phi1 is None and phi2 is not None:
            raise InputError("phi2: needs phi1 as well.")
        names = ("phi", "phi1", "phi2")
        given = [self._checked(x, name) for x, name in zip((phi, phi1, phi2), names, strict=True) if x is not None]
        jets = [Jet(*(_times(x[..., axis], self._weights[axis]) for x in given)) for axis in (PITCH, YAW)]
        kinks = [np.stack([jets[axis][order][..., 0] for axis in (PITCH, YAW)], axis=-1) for order in range(len(given))]
        if len(self._double):
            pitch, yaw = (jet.at(rows) for jet, rows in zip(jets, self._rows_of, strict=True))
            for jet, rows, new in zip(jets, self._rows_of, double_angles(pitch, yaw, self._yaw_outer), strict=True):
                jet.put(rows, new)
        angles = []
        for order in range(len(given)):
            q = np.empty((*jets[0].value.shape[:-1], len(self.joints)))
            for axis in (PITCH, YAW):
                q[..., self._joints_of[axis]] = jets[axis][order][..., 1:]
            angles.append(q / self.mechanism.gain)
        first = (angles[1], kinks[1]) if len(given) > 1 else (None, None)
        second = (angles[2], kinks[2]) if len(given) > 2 else (None, None)
        return Bends(angles[0], kinks[0], first[0], first[1], second[0], second[1], self.hinged)

    def evaluate(self, curve: BodyCurve, start: ArrayLike = 0.0, derivatives: int = 2) -> Bends:
        """Joint coordinates where the tail is at arc length ``start`` (...,) m of the curve and the place s of the body
        at ``start + s``; with ``derivatives`` (0, 1 or 2) with respect to ``start``, rad/m and rad/m^2.

        Joints that only bend cannot roll: the curve is untwisted first, which keeps its points.
        """
        if not isinstance(curve, BodyCurve):
            raise InputError(f"curve: expected a body curve, got {type(curve).__name__}.")
        whole(derivatives, "derivatives", at_most=2)
        flat = curve.untwisted()
        begin = finite(start, "start")[..., None]
        ends = begin + self.nodes
        phi = _two(flat.integral(np.broadcast_to(begin, ends.shape), ends))
        phi1 = _two(flat.shape(ends)) - _two(flat.shape(begin)) if derivatives else None
        phi2 = _two(flat.slope(ends)) - _two(flat.slope(begin)) if derivatives > 1 else None
        return self.apply(phi, phi1, phi2)

    def _checked(self, values: ArrayLike, name: str) -> Array:
        out = finite(values, name)
        if out.ndim < 2 or out.shape[-2:] != (len(self.nodes), 2):
            raise InputError(
                f"{name}: expected shape (..., {len(self.nodes)}, 2), a row for each node, got {out.shape}."
            )
        return out


_CACHE: dict[tuple[int, float], tuple[Mechanism, Rule]] = {}
_CACHED = 64


def rule(robot: Robot, p: float | None = None) -> Rule:
    """The rule of a robot, made once. ``p`` in (0.5, 1]: the parameter of eqs. (11)-(16), default the Gauss node
    1/2 + 1/(2 sqrt 3); the paper has 0.789. Raises InputError for another p, or a robot that no rule is known for."""
    made = mechanism(robot)
    key = (id(made), GAUSS_P if p is None else number(p, "p", above=0.5, at_most=1.0))
    held = _CACHE.get(key)
    if held is not None and held[0] is made:
        return held[1]
    if len(_CACHE) >= _CACHED:
        _CACHE.clear()
    _CACHE[key] = (made, Rule(robot, p))
    return _CACHE[key][1]


def _two(shape: tuple[Array, Array, Array]) -> Array:
    return np.stack([shape[1], shape[2]], axis=-1)


def _times(phi: Array, weights: Any) -> Array:
    """(..., K) by the weights (J, K)."""
    if isinstance(weights, np.ndarray):
        # BLAS wants numbers side by side
        return np.asarray(np.ascontiguousarray(phi) @ weights.T)
    return np.asarray((weights @ phi.reshape(-1, phi.shape[-1]).T).T).reshape(*phi.shape[:-1], -1)


# --- the rows of the matrix -----------------------------------------------------------------------------------

Weights = dict[float, float]  # of Phi, by place


def _rows(made: Mechanism, axis: int, p: float) -> list[Weights]:
    """Weights of the virtual joint and of every joint that bends about ``axis``, from the tail on."""
    joints = made.joints_of(axis)
    at = made.joint_place[joints]
    if len(at) == 0:
        return [{}]
    if made.kind == "straight" or len(at) < len(made.places):
        return _windows(made, at)
    return _matched(made.units, p)


def _windows(made: Mechanism, at: IntArray) -> list[Weights]:
    """Eqs. (2), (3): a joint takes what the curve bends between half way to its neighbours of the same axis, counted
    in links. The virtual joint takes what lies before the first window, but nothing from before the tail."""
    count = len(made.places)
    knots = np.concatenate([[0.0], made.places, [made.length]])
    # how far joints of one axis are apart: the pattern's step where one axis has a single joint
    gaps = [np.diff(made.joint_place[made.joints_of(axis)]) for axis in made.axes]
    steps = np.concatenate(gaps)
    usual = float(steps.min()) if len(steps) else count / len(at)
    own = np.diff(at).astype(np.float64) if len(at) > 1 else np.array([usual])
    number_of = at + 1.0
    low = number_of - 0.5 * np.concatenate([own[:1], own[: len(at) - 1]])
    high = number_of + 0.5 * np.concatenate([own[: len(at) - 1], own[-1:]])
    inside = np.clip(np.stack([low, high], axis=1), 0.0, count + 1.0)
    ends = np.interp(inside, np.arange(count + 2.0), knots).tolist()
    virtual: Weights = {ends[0][0]: 1.0}
    return [virtual, *(_sum((1.0, {b: 1.0}), (-1.0, {a: 1.0})) for a, b in ends)]


def _matched(units: Array, p: float) -> list[Weights]:
    """Eqs. (11)-(17) for units (N, 2) of any lengths: the turning of the polyline is that of the curve at a share p
    and 1 - p of every unit, met from the tail, then from the head; the mean of the two."""
    start, length = units[:, 0], units[:, 1] - units[:, 0]
    early, late = (start + (1.0 - p) * length).tolist(), (start + p * length).tolist()
    n = len(units)
    forward: list[Weights] = [_sum((1.0 / (2.0 * p - 1.0), {late[0]: 1.0}), (-1.0 / (2.0 * p - 1.0), {early[0]: 1.0}))]
    for i in range(1, n):
        forward.append(_sum((1.0 / p, {late[i]: 1.0}), (-1.0 / p, {late[i - 1]: 1.0}), ((p - 1.0) / p, forward[-1])))
    # the same from the head on
    back: list[Weights] = [_sum((1.0 / (2.0 * p - 1.0), {late[-1]: 1.0}), (-1.0 / (2.0 * p - 1.0), {early[-1]: 1.0}))]
    for i in range(n - 2, -1, -1):
        back.append(_sum((1.0 / p, {early[i + 1]: 1.0}), (-1.0 / p, {early[i]: 1.0}), ((p - 1.0) / p, back[-1])))
    bends = [_sum((0.5, a), (0.5, b)) for a, b in zip(forward, reversed(back), strict=True)]
    virtual = _sum((1.0, {early[0]: 1.0}), (p - 1.0, bends[0]))
    return [virtual, *bends]


def _sum(*terms: tuple[float, Mapping[float, float]]) -> Weights:
    out: Weights = {}
    for factor, weights in terms:
        for place, weight in weights.items():
            out[place] = out.get(place, 0.0) + factor * weight
    return {place: weight for place, weight in out.items() if abs(weight) > NEGLIGIBLE}


def _matrix(rows: list[Weights], column: Mapping[float, int]) -> Any:
    """(J, K), sparse where large."""
    entries = [(j, column[s], w) for j, row in enumerate(rows) for s, w in row.items() if s in column]
    j, k, w = (np.array(part) for part in zip(*entries, strict=True)) if entries else (np.zeros(0, int),) * 3
    shape = (len(rows), len(column))
    if shape[0] * shape[1] > DENSE_UP_TO:
        from scipy.sparse import csr_matrix

        return csr_matrix((w, (j, k)), shape=shape)
    out = np.zeros(shape)
    out[j, k] = w
    return out
