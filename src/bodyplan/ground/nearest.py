"""The nearest point of a smooth ground z = f(u, v) to points P, proved to be the global one.

The nearest point lies within the vertical gap of P, and Newton (:mod:`bodyplan.ground.descent`) starts at
the foot of the vertical. Let it end at a distance D, and let M bound the norm of Hess f on the disc of
radius D about (x, y). Where D M < sqrt(3) - 1 no other point is nearer: phi = D^2/2 is convex wherever f is
within 1/M of z, and leaving that band and coming back takes a way of 2 sqrt(2 (1 - D M)) / M in the plane,
more than the 2 D that the disc offers. Elsewhere branch and bound decides: boxes that bounds of f rule out
are dropped, boxes on which phi is convex are left to Newton, the others are cut into four.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.ground.descent import (
    JetFunction,
    derivatives,
    descend,
    descend_crease,
    distance,
    half_square,
)

#: relative error of the distance up to which the search proves that nothing is nearer
TOLERANCE = 1e-11
#: boxes of one point that the search keeps at a time; beyond, those that promise least are left out
MAX_BOXES = 1024
_LEVELS = 60
_TOGETHER = 512
_CERTAIN = float(np.sqrt(3.0) - 1.0)


@dataclass(frozen=True)
class Bounds:
    """What is known of f over n boxes: (lowest, highest) of f in ``z`` (2, n) and of its second derivatives
    in ``hessian`` (2, n, 2, 2); ``change`` (n,) bounds the norm of its third derivatives (inf: unknown). ``gradient``
    (2, n, 2): of its first derivatives, or None."""

    z: Array
    hessian: Array
    change: Array
    gradient: Array | None = None


class SmoothField(Protocol):
    """What the search asks of a ground."""

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Height (n,), gradient (n, 2) and Hessian (n, 2, 2); height nan where the ground is undefined."""

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        """Bounds over boxes with corners (n, 2)."""

    def field_creases(self) -> Sequence[JetFunction]:
        """Functions whose zeros are the lines where the ground has no derivative."""

    @property
    def field_box(self) -> Array:
        """Corners (2, 2) of the rectangle on which the ground is given, perhaps infinite."""


def nearest(field: SmoothField, points: Array) -> Array:
    """The (u, v) (n, 2) of the ground points nearest to ``points`` (n, 3), which lie in the field's rectangle
    where its ground is defined."""
    with np.errstate(all="ignore"):  # an undefined place is a nan, which loses every comparison
        low, high = (np.broadcast_to(end, (len(points), 2)) for end in field.field_box)
        foot = points[:, :2]
        uv, settled = descend(field.field_jet, points, foot, low, high)
        d = np.fmin(distance(field.field_jet, points, uv), distance(field.field_jet, points, foot))
        reach = d[:, None] * (1.0 + 1e-9)
        known = field.field_bounds(np.maximum(foot - reach, low), np.minimum(foot + reach, high))
        bend = _norm(np.abs(known.hessian).max(axis=0))
        # a distance of 0 is the nearest there can be, whatever the bound
        unsure = np.flatnonzero((d > 0.0) & ~(settled & (bend * d < _CERTAIN)))
        for start in range(0, len(unsure), _TOGETHER):
            part = unsure[start : start + _TOGETHER]
            uv[part] = _Search(field, points[part], uv[part]).run()
    return uv


class _Search:
    """Branch and bound for some points; ``best`` (n, 2) and its distance ``value`` (n,) only ever improve."""

    def __init__(self, field: SmoothField, points: Array, guess: Array) -> None:
        self.field, self.points = field, points
        self.best = points[:, :2].copy()
        self.value = distance(field.field_jet, points, self.best)
        self.take(np.arange(len(points)), guess)
        self.follow_creases(np.arange(len(points)))

    def run(self) -> Array:
        """The nearest (u, v) (n, 2)."""
        points, reach = self.points, self.value[:, None]
        owner = np.arange(len(points))
        low = np.maximum(points[:, :2] - reach, self.field.field_box[0])
        high = np.minimum(points[:, :2] + reach, self.field.field_box[1])
        for _ in range(_LEVELS):
            if not len(owner):
                break
            p, centre = points[owner], 0.5 * (low + high)
            f, least, convex = _judge(self.field, p, centre, low, high)
            self.descend_from_best(owner, centre, np.sqrt(2.0 * half_square(p, centre, f)))
            promising = least < self.value[owner] * (1.0 - TOLERANCE)
            simple = np.flatnonzero(promising & convex)  # one minimum: Newton finds it, and the box is done
            found = descend(self.field.field_jet, p[simple], centre[simple], low[simple], high[simple])[0]
            self.take(owner[simple], found)
            wide = (high - low).max(axis=1) > 1e-14 * (np.abs(p).max(axis=1) + self.value[owner])
            promising = least < self.value[owner] * (1.0 - TOLERANCE)
            keep = _most_promising(np.flatnonzero(promising & ~convex & wide), owner, least)
            owner, low, high = _quarters(owner[keep], low[keep], centre[keep], high[keep])
        return self.best

    def descend_from_best(self, owner: IntArray, centre: Array, tried: Array) -> None:
        """Newton from the best box centre of each point for which it beats what is known."""
        first = _first_of_each(owner, tried)
        first = first[tried[first] < self.value[owner[first]]]
        low, high = (np.broadcast_to(end, (len(first), 2)) for end in self.field.field_box)
        self.take(owner[first], centre[first])
        found = descend(self.field.field_jet, self.points[owner[first]], centre[first], low, high)[0]
        self.take(owner[first], found)
        self.follow_creases(owner[first])

    def follow_creases(self, owner: IntArray) -> None:
        """From the best known of the points ``owner``, try the creases of the ground."""
        ground, box = self.field.field_jet, self.field.field_box
        for crease in self.field.field_creases():
            self.take(owner, descend_crease(ground, crease, self.points[owner], self.best[owner], box))

    def take(self, owner: IntArray, uv: Array) -> None:
        """Keep the candidates ``uv`` that are nearer than the best known; a point may have several."""
        d = distance(self.field.field_jet, self.points[owner], uv)
        first = _first_of_each(owner, d)
        first = first[d[first] < self.value[owner[first]]]
        self.best[owner[first]], self.value[owner[first]] = uv[first], d[first]


def _judge(field: SmoothField, p: Array, centre: Array, low: Array, high: Array) -> tuple[Array, Array, BoolArray]:
    """Of boxes: f at the centre, a lower bound of D, and whether phi is convex."""
    half = 0.5 * (high - low)
    radius = np.sqrt(np.sum(half**2, axis=1))
    f, g, h = field.field_jet(centre[:, 0], centre[:, 1])
    known = field.field_bounds(low, high)
    # how far Hess f may be from its value at the centre, and how large it may be
    change = np.fmin(_norm(np.abs(known.hessian - h).max(axis=0)), known.change * radius)
    bend = _norm(np.abs(h)) + change
    # f by its own bounds and by its Taylor series
    spread = np.sum(np.abs(g) * half, axis=1) + 0.5 * bend * radius**2
    e_low = np.fmax(known.z[0], f - spread) - p[:, 2]
    e_high = np.fmin(known.z[1], f + spread) - p[:, 2]
    aside = np.maximum(np.maximum(low - p[:, :2], p[:, :2] - high), 0.0)
    above = np.maximum(np.maximum(e_low, -e_high), 0.0)
    least = np.sqrt(np.sum(aside**2, axis=1) + above**2)
    # the smallest eigenvalue of Hess phi = I + grad f grad f' + e Hess f: from the range of e and of the
    # eigenvalues of Hess f, or from its value at the centre and how far each part may be from that
    slope, metric, curved = derivatives(p, centre, f, g, h)
    lambdas = _eigenvalues(h)[:, [0, 1]] + change[:, None] * [-1.0, 1.0]
    mu_range = 1.0 + np.min([e * lam for e in (e_low, e_high) for lam in lambdas.T], axis=0)
    size, turn = np.sqrt(np.sum(g * g, axis=1)), bend * radius
    drift = (2.0 * size + turn) * turn + np.abs(f - p[:, 2]) * change + (size + 0.5 * turn) * radius * bend
    mu = np.fmax(mu_range, _eigenvalues(metric + curved)[:, 0] - drift)
    # phi >= phi(c) + grad phi . d + mu/2 |d|^2 over the box, least where |d_i| = t_i
    pull = np.abs(slope)
    t = np.where(mu[:, None] > 0.0, np.minimum(pull / mu[:, None], half), half)
    lowered = 2.0 * half_square(p, centre, f) + np.sum(-2.0 * pull * t + mu[:, None] * t * t, axis=1)
    least = np.fmax(least, np.sqrt(np.maximum(lowered, 0.0)))
    return f, least, np.asarray((mu > 0.0) & np.isfinite(f))


def _norm(size: Array) -> Array:
    """Gershgorin's bound of the norm of symmetric (n, 2, 2) matrices, from the sizes of their entries."""
    return np.asarray(np.maximum(size[:, 0, 0], size[:, 1, 1]) + size[:, 0, 1])


def _eigenvalues(a: Array) -> Array:
    """Eigenvalues (n, 2), ascending, of symmetric (n, 2, 2) matrices."""
    mean, half = 0.5 * (a[:, 0, 0] + a[:, 1, 1]), 0.5 * (a[:, 0, 0] - a[:, 1, 1])
    radius = np.hypot(half, a[:, 0, 1])
    return np.stack([mean - radius, mean + radius], axis=1)


def _first_of_each(owner: IntArray, value: Array) -> IntArray:
    """For every owner the index of its smallest value (nan last)."""
    order = np.lexsort((value, owner))
    return np.asarray(order[np.unique(owner[order], return_index=True)[1]])


def _most_promising(keep: IntArray, owner: IntArray, least: Array) -> IntArray:
    """``keep`` without the boxes beyond MAX_BOXES of one point, those of largest lower bound."""
    order = keep[np.lexsort((least[keep], owner[keep]))]
    _, first, counts = np.unique(owner[order], return_index=True, return_counts=True)
    rank = np.arange(len(order)) - np.repeat(first, counts)
    return np.asarray(order[rank < MAX_BOXES])


def _quarters(owner: IntArray, low: Array, centre: Array, high: Array) -> tuple[IntArray, Array, Array]:
    """Each box cut into four at its centre."""
    sides = [np.array([right, upper]) for right in (False, True) for upper in (False, True)]
    lows = np.concatenate([np.where(side, centre, low) for side in sides])
    highs = np.concatenate([np.where(side, high, centre) for side in sides])
    return np.tile(owner, 4), lows, highs
