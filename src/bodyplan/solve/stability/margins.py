"""How far a standing robot is from tipping over each edge of its support: paper *legs* eqs. (19)-(21), for any feet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, IntArray, finite
from bodyplan.errors import InputError
from bodyplan.spatial.hulls import support_hull

DOWN = (0.0, 0.0, -1.0)


@dataclass(frozen=True, eq=False)
class Margins:
    """Margins against tipping over the edges of the hull of the feet; ``...`` is the batch shape.

    ``edges`` (..., m, 2): feet (indices) that each edge joins, clockwise seen from above; a hull of fewer than m
    corners leaves the last ones (-1, -1), and infinite margins there. ``count`` (...): number of edges.

    * ``mu`` (..., m): eq. (21), g . s_j with the unit vectors g of gravity and s_j normal to the plane through the
      centre of mass and the edge, eq. (19). In (0, 1] where the robot is stable.
    * ``angle`` (..., m) rad: by how much the robot must turn about the edge until its centre of mass is above it:
      asin(mu / |g perpendicular to the edge|), for a centre of mass that is not below the edge.
    * ``distance`` (..., m) m: of the centre of mass from the edge, both projected along gravity.

    All three are > 0 where the centre of mass is inside of the edge, < 0 outside, and have the same sign.

    Feet in one line have an edge there and one back, with nothing inside. Where the centre of mass is beyond an end of
    the line the robot tips over that foot alone: the edge that it has left, or both, then count the way to the foot,
    and the turn about the level line through the foot across that way. So ``min_distance`` is 0 above the line between
    the feet and minus the distance from it elsewhere.
    """

    edges: IntArray
    count: Any
    mu: Array
    angle: Array
    distance: Array

    @property
    def min_mu(self) -> Any:
        """(...): the smallest mu."""
        return self.mu.min(axis=-1)

    @property
    def min_angle(self) -> Any:
        """(...) rad: the smallest tip angle."""
        return self.angle.min(axis=-1)

    @property
    def min_distance(self) -> Any:
        """(...) m: the smallest distance: negative, that to the farthest edge crossed."""
        return self.distance.min(axis=-1)

    @property
    def tipping_edge(self) -> IntArray:
        """(..., 2): feet of the edge with the smallest tip angle."""
        worst = np.argmin(self.angle, axis=-1)
        return np.take_along_axis(self.edges, worst[..., None, None], axis=-2)[..., 0, :]

    @property
    def stable(self) -> Any:
        """(...): whether every edge's margin is > 0."""
        return self.min_mu > 0.0


class Edges(NamedTuple):
    """The edges of a hull: ``feet`` (..., m, 2) with -1 for none, ``real`` (..., m), ``number`` (...); their ends seen
    from the centre of mass, ``a`` and ``b`` (..., m, 3) m, and unit gravity ``g`` (..., 3). ``over`` (..., m): 1 or 2
    where feet are in one line and the robot tips over the end a or b alone, else 0."""

    feet: IntArray
    real: BoolArray
    number: IntArray
    a: Array
    b: Array
    g: Array
    over: IntArray

    @property
    def ends(self) -> tuple[BoolArray, Array]:
        """(``over`` > 0 (..., m, 1), the end that it names (..., m, 3))."""
        return self.over[..., None] > 0, np.where(self.over[..., None] == 2, self.b, self.a)


def tip_margins(feet: ArrayLike, gravity: ArrayLike = DOWN, com: ArrayLike = (0.0, 0.0, 0.0)) -> Margins:
    """Margins of a robot with its ``feet`` (..., m, 3) m on the ground, m >= 3, and its centre of mass ``com`` (..., 3)
    m, against tipping over any edge of the convex hull of the feet seen along ``gravity`` (..., 3), a vector downwards
    of any length. Feet, com and gravity in one frame, any; batch shapes broadcast.

    The paper cycles over the feet in the order in which they come, and over one too few; mu then has the right sign for
    feet clockwise seen from above only. The hull makes it right for feet in any order, also inside of the hull.

    Raises InputError for fewer than 3 feet, no gravity, feet that lie on one line along gravity.
    """
    return margins(hull_edges(feet, gravity, com))


def hull_edges(feet: ArrayLike, gravity: ArrayLike, com: ArrayLike) -> Edges:
    """Checked edges of the hull; see :func:`tip_margins`."""
    points, g, c = finite(feet, "feet"), finite(gravity, "gravity"), finite(com, "com")
    if points.ndim < 2 or points.shape[-1] != 3 or points.shape[-2] < 3:
        raise InputError(f"feet: expected shape (..., m, 3) with m >= 3 feet, got {points.shape}.")
    for name, array in (("gravity", g), ("com", c)):
        if array.shape[-1:] != (3,):
            raise InputError(f"{name}: expected shape (..., 3), got {array.shape}.")
    try:
        shape = np.broadcast_shapes(points.shape[:-2], g.shape[:-1], c.shape[:-1])
    except ValueError as error:
        raise InputError(f"feet, gravity, com: batch shapes do not broadcast: {error}.") from error
    size = np.linalg.norm(g, axis=-1, keepdims=True)
    if np.any(size == 0.0):
        raise InputError("gravity: must not be 0.")
    g = np.broadcast_to(g / size, (*shape, 3))
    # from the centre of mass, so that robots far from the origin lose nothing
    w = np.broadcast_to(points - c[..., None, :], (*shape, *points.shape[-2:]))
    right, up = _across(g)
    size = np.abs(points).max(axis=(-1, -2), initial=0.0) + np.abs(c).max(axis=-1, initial=0.0)
    u, v = (np.einsum("...mk,...k->...m", w, axis) for axis in (right, up))
    corners, count = support_hull(u, v, size)
    if np.any(count < 2):
        where = tuple(int(i) for i in np.argwhere(count < 2)[0])
        raise InputError(f"feet: at {where} all lie on one line along gravity: there is no edge to tip over.")
    real = corners >= 0
    after = np.where(
        np.arange(corners.shape[-1]) + 1 < count[..., None], np.roll(corners, -1, axis=-1), corners[..., :1]
    )
    feet_of = np.where(real[..., None], np.stack([corners, after], axis=-1), -1)
    a, b = (np.take_along_axis(w, np.maximum(feet_of[..., k, None], 0), axis=-2) for k in (0, 1))
    return Edges(feet_of, real, count, a, b, g, _ends(a, b, g, count))


def _ends(a: Array, b: Array, g: Array, count: IntArray) -> IntArray:
    """``over`` of :class:`Edges`."""
    out: IntArray = np.zeros(a.shape[:-1], dtype=np.int64)
    rows = np.flatnonzero(np.ravel(count) == 2)
    if not len(rows):
        return out
    a, b = (p.reshape(-1, *p.shape[-2:])[rows, :2] for p in (a, b))
    g = g.reshape(-1, 1, 3)[rows]
    a, b = (p - np.sum(p * g, axis=-1, keepdims=True) * g for p in (a, b))
    e = b - a
    across = np.sum(np.cross(a, e) * g, axis=-1)
    left = across <= across[:, ::-1]  # of the two edges one at least, whatever is rounded
    before, behind = np.sum(a * e, axis=-1) > 0.0, np.sum(b * e, axis=-1) < 0.0
    flat: IntArray = out.reshape(-1, out.shape[-1])
    flat[rows, :2] = np.where(left & before, 1, np.where(left & behind, 2, 0))
    return out


def margins(edges: Edges) -> Margins:
    """The margins of :func:`tip_margins`."""
    real = edges.real
    mu = np.where(real, measure_mu(edges).value, np.inf)
    distance = np.where(real, measure_distance(edges).value, np.inf)
    return Margins(edges.feet, edges.number, mu, np.where(real, _angle(edges), np.inf), distance)


class Measure(NamedTuple):
    """A number for every edge, ``value`` (..., m), and its derivatives ``by_a``, ``by_b`` (..., m, 3) by the ends of
    the edge seen from the centre of mass; by the centre of mass it is minus their sum. 0 for an edge that is none."""

    value: Array
    by_a: Array
    by_b: Array


def measure_mu(edges: Edges) -> Measure:
    """mu_j = g . s_j, s_j = w_j x w_j+1 / |w_j x w_j+1|. With c the product, d mu = (g - mu s) . dc / |c|.

    For a centre of mass on the line of the edge no plane is defined: 0. Over an end p alone, mu is
    -|p - (g . p) g| / |p|.
    """
    g = edges.g[..., None, :]
    c = np.cross(edges.a, edges.b)
    length = np.linalg.norm(c, axis=-1, keepdims=True)
    some = edges.real[..., None] & (length > 0.0)
    safe = np.where(some, length, 1.0)
    mu = np.where(some, np.sum(c * g, axis=-1, keepdims=True) / safe, 0.0)
    u = np.where(some, (g - mu * c / safe) / safe, 0.0)
    value, by_a, by_b = mu, np.cross(edges.b, u), np.cross(u, edges.a)
    if np.any(edges.over):
        over, p = edges.ends
        away, unit = _level(p, g)
        far = np.where(over, np.linalg.norm(p, axis=-1, keepdims=True), 1.0)
        by_p = away * p / far**3 - unit / far
        value = np.where(over, -away / far, value)
        by_a, by_b = _by_ends(edges, by_p, by_a, by_b)
    return Measure(value[..., 0], by_a, by_b)


def measure_distance(edges: Edges) -> Measure:
    """Distance from the centre of mass to the edges, projected along gravity: g . (a x b) / |e - (e . g) g| with
    e = b - a. Over an end p alone, -|p - (g . p) g|."""
    g = edges.g[..., None, :]
    e = edges.b - edges.a
    e = e - np.sum(e * g, axis=-1, keepdims=True) * g
    length = np.linalg.norm(e, axis=-1, keepdims=True)
    some = edges.real[..., None]
    safe = np.where(some, length, 1.0)
    e = e / safe
    # with the projected end instead of a: the product of parallel parts along g must not cost digits
    distance = np.where(some, np.sum(np.cross(edges.a, e) * g, axis=-1, keepdims=True), 0.0)
    by_a = np.where(some, (np.cross(edges.b, g) + distance * e) / safe, 0.0)
    by_b = np.where(some, (np.cross(g, edges.a) - distance * e) / safe, 0.0)
    if np.any(edges.over):
        over, p = edges.ends
        away, unit = _level(p, g)
        distance = np.where(over, -away, distance)
        by_a, by_b = _by_ends(edges, -unit, by_a, by_b)
    return Measure(distance[..., 0], by_a, by_b)


def _level(p: Array, g: Array) -> tuple[Array, Array]:
    """(size (..., 1), direction (..., 3)) of the part of p across g."""
    level = p - np.sum(p * g, axis=-1, keepdims=True) * g
    size = np.linalg.norm(level, axis=-1, keepdims=True)
    return size, level / np.where(size > 0.0, size, 1.0)


def _by_ends(edges: Edges, by_p: Array, by_a: Array, by_b: Array) -> tuple[Array, Array]:
    """Derivatives by the ends of all edges, ``by_p`` (..., m, 3) by the one end of those that are left over it."""
    over = edges.over[..., None]
    return (
        np.where(over == 0, by_a, np.where(over == 1, by_p, 0.0)),
        np.where(over == 0, by_b, np.where(over == 2, by_p, 0.0)),
    )


def _angle(edges: Edges) -> Array:
    """asin(mu / |g perpendicular to the edge|), as an arc tangent: exact also near 90 deg."""
    e = edges.b - edges.a
    e = e / np.where(edges.real[..., None], np.linalg.norm(e, axis=-1, keepdims=True), 1.0)
    g = edges.g[..., None, :] - np.sum(edges.g[..., None, :] * e, axis=-1, keepdims=True) * e
    # from the edge to the centre of mass, perpendicular to the edge
    r = np.sum(edges.a * e, axis=-1, keepdims=True) * e - edges.a
    out = np.arctan2(np.sum(np.cross(g, r) * -e, axis=-1), np.abs(np.sum(g * r, axis=-1)))
    if np.any(edges.over):
        over, p = edges.ends
        down = edges.g[..., None, :]
        away = _level(p, down)[0][..., 0]
        out = np.where(over[..., 0], -np.arctan2(away, np.abs(np.sum(p * down, axis=-1))), out)
    return np.asarray(out)


def _across(g: Array) -> tuple[Array, Array]:
    """Unit vectors to the right and up on a sheet seen from above: right x up = -g."""
    least = np.eye(3)[np.argmin(np.abs(g), axis=-1)]
    right = np.cross(least, -g)
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    return right, np.cross(-g, right)
