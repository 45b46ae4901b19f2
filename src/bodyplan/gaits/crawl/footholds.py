"""Where a foot can stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.ground.near import clearance_up_to

#: rings and directions of a search for footholds
RINGS, DIRECTIONS = 8, 24
#: directions in which the ground around a foothold is felt
AROUND = 12
#: m of distances that rounding may change; share of its radius by which a ball may be moved out of a hollow, how often
EXACT, HOLLOW, SETTLES = 1e-10, 1e-2, 20


@dataclass(eq=False)
class Footholds:
    """Where a ball of ``radius`` m can stand on ``ground`` no steeper than ``max_slope`` rad, at ``nominal`` (2,) m or
    as near to it as can be within ``search`` m.

    A search prefers footholds with room for the ball at its sides and ground all around it: no riser or edge within a
    radius."""

    ground: Ground
    nominal: Array
    radius: float
    max_slope: float
    search: float
    _middle: Judged | None = field(init=False, default=None)

    @classmethod
    def look_ahead(cls, several: Sequence[Footholds]) -> None:
        """Judge the middles of footholds on one ground at once: most often a foot stands there."""
        one = several[0]
        tried, radii = np.array([spots.nominal for spots in several]), np.array([spots.radius for spots in several])
        found = _judged(one.ground, tried, radii, one.max_slope, one.search)
        for k, spots in enumerate(several):
            spots._middle = found.of(k)

    @cached_property
    def first(self) -> tuple[Array, str]:
        """The best centre (3,) m; and why there is none (where it would be at ``nominal`` then, if it can)."""
        good: list[Array] = []
        steep: list[Array] = []
        # nearer ones come first, and most often the first of all will do
        for k, tried in enumerate(np.split(self._tried, [1, 1 + DIRECTIONS])):
            known = self._middle if k == 0 else None
            centres, stands, roomy, _ = known or self._judged(tried)
            if roomy.any():
                return centres[roomy.argmax()], ""
            good += [centres[stands][:1]]
            steep += [centres[:1]]
        for found, why in ((np.concatenate(good), ""), (np.concatenate(steep), self._steep)):
            if len(found):
                return found[0], why
        return np.array([*self.nominal, self.radius]), f"no ground {_where(self.search)}"

    @cached_property
    def all(self) -> Array:
        """All centres (k, 3) m, the best first."""
        centres, stands, roomy, _ = self._judged(self._tried)
        return np.concatenate([centres[roomy], centres[stands & ~roomy]])

    @property
    def _tried(self) -> Array:
        """(k, 2) m, from the middle outwards."""
        if not self.search > 0.0:
            return self.nominal[None]
        rings = self.search * np.arange(1, RINGS + 1) / RINGS
        around = (rings[:, None, None] * _ways(DIRECTIONS)).reshape(-1, 2)
        return np.concatenate([self.nominal[None], self.nominal + around])

    @property
    def _steep(self) -> str:
        why = f"the ground is steeper than {np.degrees(self.max_slope):.3g} deg, or an edge, {_where(self.search)}"
        return why + ("" if self.search > 0.0 else '; foothold = "search" looks around')

    def _judged(self, tried: Array) -> Judged:
        return _judged(self.ground, tried, np.full(len(tried), self.radius), self.max_slope, self.search)


class Judged(NamedTuple):
    """Centres (k, 3) m of balls where there is ground below them, which of these can ``stand``, which have ``room``
    there (all, without a search), and ``which`` (k,) of the places that were tried they are at."""

    centres: Array
    stand: BoolArray
    room: BoolArray
    which: IntArray

    def of(self, which: int) -> Judged:
        """Those at one of the places."""
        mine = self.which == which
        return Judged(*(part[mine] for part in self))


def _judged(ground: Ground, tried: Array, radii: Array, max_slope: float, search: float) -> Judged:
    """Balls with ``radii`` (n,) m at ``tried`` (n, 2) m."""
    which = np.flatnonzero(_on(ground, tried)) if len(tried) else np.zeros(0, dtype=np.int64)
    if not len(which):
        return Judged(np.zeros((0, 3)), np.zeros(0, dtype=bool), np.zeros(0, dtype=bool), which)
    tried, radii = tried[which], radii[which]
    normals = ground.normal(tried)
    centres, stands = _settled(ground, tried, normals, radii)
    flat = np.arccos(np.clip(normals[:, 2], -1.0, 1.0)) <= max_slope + EXACT
    good = stands & flat
    roomy = good.copy()
    if search > 0.0 and good.any():
        roomy[good] = _roomy(ground, centres[good], radii[good], max_slope)
    return Judged(centres, good, roomy, which)


def _where(search: float) -> str:
    return f"within {search:.3g} m" if search > 0.0 else "there"


def _ways(count: int) -> Array:
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _on(ground: Ground, points: Array) -> BoolArray:
    """Which of points (k, 2) have ground below them."""
    try:
        ground.height(points)
    except InputError:
        if len(points) == 1:
            return np.zeros(1, dtype=bool)
        return np.concatenate([_on(ground, part) for part in np.array_split(points, 2)])
    return np.ones(len(points), dtype=bool)


def _settled(ground: Ground, points: Array, normals: Array, radii: Array) -> tuple[Array, BoolArray]:
    """Centres (k, 3) of balls with ``radii`` (k,) on the ground at ``points`` (k, 2), and which of them touch nothing
    else: a ball in a hollow that is hardly narrower than itself is moved out of it."""
    begun = np.concatenate([points, ground.height(points)[:, None]], axis=1) + radii[:, None] * normals
    centres, gap = begun.copy(), _gap(ground, begun, radii, 0.0)
    for _ in range(SETTLES):
        inside = np.flatnonzero((gap < -EXACT) & (gap > -HOLLOW * radii))
        if not len(inside):
            break
        centres[inside] -= gap[inside, None] * normals[inside]
        gap[inside] = _gap(ground, centres[inside], radii[inside], 0.0)
    moved = np.linalg.norm(centres - begun, axis=1)
    return centres, (gap >= -EXACT) & (moved <= 2.0 * HOLLOW * radii)


def _gap(ground: Ground, centres: Array, radii: Array, most: Array | float) -> Array:
    """Clearance (k,) m of balls, up to ``most`` m; minus infinity beyond the edge of the ground."""
    there = _on(ground, centres[:, :2])
    out = np.full(len(centres), -np.inf)
    out[there] = clearance_up_to(ground, centres[there], (radii + most)[there]) - radii[there]
    return out


def _roomy(ground: Ground, centres: Array, radii: Array, max_slope: float) -> BoolArray:
    """Which of balls at ``centres`` (k, 3) can rise with a radius of room at their sides, and have ground around them
    that is nowhere far below."""
    above = centres + 2.0 * radii[:, None] * np.array([0.0, 0.0, 1.0])
    room = _gap(ground, above, radii, radii) >= radii * (1.0 - 1e-3)
    around = centres[:, None, :2] + radii[:, None, None] * _ways(AROUND)
    there = _on(ground, around.reshape(-1, 2)).reshape(around.shape[:2])
    depth = np.full(there.shape, np.inf)
    lowest = np.broadcast_to((centres[:, 2] - radii)[:, None], there.shape)
    depth[there] = lowest[there] - ground.height(around[there])
    return np.asarray(room & (depth <= radii[:, None] * (np.tan(max_slope) + 0.5)).all(axis=1))
