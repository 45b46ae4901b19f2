"""A smooth plane curve through points, gone along at a given speed."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError
from bodyplan.gaits.carry.orientation import Function
from bodyplan.gaits.carry.paths import Course, Path, _along

#: m, as a share of the length: points nearer to each other are one
NEAR = 1e-9
#: pieces of equal parameter between two points, each with ten Gauss nodes, for the arc length
PIECES = 8
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


class Through(Path):
    """The curve through ``points`` (k, 2) m in order, k >= 2, ``closed`` or not: the quintic spline over the lengths
    of the chords (cubic for fewer than six points, straight for two), so that its curvature is smooth. It is gone
    along by arc length; an open one ends at its last point. Raises InputError for two points in one place."""

    kind = "spline"

    def __init__(self, points: ArrayLike, closed: bool = False) -> None:
        given = finite(points, "path.points", (None, 2))
        if not isinstance(closed, bool):
            raise InputError(f"path.closed: must be true or false, got {closed!r}.")
        if closed and len(given) > 1 and np.array_equal(given[0], given[-1]):
            given = given[:-1]
        if len(given) < (3 if closed else 2):
            raise InputError(f"path.points: at least {3 if closed else 2}, got {len(given)}.")
        self.points, self._closed = given, closed
        ring = np.concatenate([given, given[:1]]) if closed else given
        chords = np.linalg.norm(np.diff(ring, axis=0), axis=1)
        if chords.min() <= NEAR * chords.sum():
            raise InputError(f"path.points: points {int(chords.argmin())} and the next are in one place.")
        self._ring, self._knots = ring, np.concatenate([[0.0], np.cumsum(chords)])

    @property
    def closed(self) -> bool:
        """Whether a lap repeats."""
        return self._closed

    @property
    def length(self) -> float | None:
        """Arc length, m."""
        return float(self._lengths[1][-1])

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import make_interp_spline

        count = len(self._ring)
        degree = (5 if count > 5 else 3) if self._closed else 5 if count > 5 else min(3, count - 1)
        return make_interp_spline(self._knots, self._ring, k=degree, bc_type="periodic" if self._closed else None)

    @cached_property
    def _lengths(self) -> tuple[Array, Array, Array]:
        """Parameters, the arc length up to each, and its slope by the parameter there."""
        ends = np.concatenate(
            [np.linspace(a, b, PIECES, endpoint=False) for a, b in zip(self._knots, self._knots[1:], strict=False)]
            + [self._knots[-1:]]
        )
        half = 0.5 * np.diff(ends)
        at = ends[:-1, None] + half[:, None] * (1.0 + _NODES)
        speed = np.linalg.norm(self._spline(at, 1), axis=-1)
        sums = np.concatenate([[0.0], np.cumsum((speed @ _WEIGHTS) * half)])
        return ends, sums, np.linalg.norm(self._spline(ends, 1), axis=-1)

    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s; an open curve stays at its end."""
        total = float(self._lengths[1][-1])
        s = np.mod(way.value, total) if self._closed else np.clip(way.value, 0.0, total)
        ended = np.abs(s - way.value) > 1e-9 * total
        u = self._parameter(s)
        r1, r2, r3 = (np.asarray(self._spline(u, k)) for k in (1, 2, 3))
        speed = np.linalg.norm(r1, axis=1)
        # curvature = (r1 x r2)/|r1|^3, and its slope by arc length
        turn = r1[:, 0] * r2[:, 1] - r1[:, 1] * r2[:, 0]
        bend = turn / speed**3
        change = ((r1[:, 0] * r3[:, 1] - r1[:, 1] * r3[:, 0]) / speed**3
                  - 3.0 * turn * np.sum(r1 * r2, axis=1) / speed**5) / speed  # fmt: skip
        direction = np.arctan2(r1[:, 1], r1[:, 0])
        none = np.zeros(len(t), dtype=np.bool_)
        return _along(np.asarray(self._spline(u)), direction, bend, change, way, none if self._closed else ended)

    def _parameter(self, s: Array) -> Array:
        """The spline's parameter at arc lengths s (T,): Newton, each step with the arc length from the last known
        end."""
        ends, sums, slopes = self._lengths
        k = np.clip(np.searchsorted(sums, s, side="right") - 1, 0, len(ends) - 2)
        a, b = ends[k], ends[k + 1]
        # from the cubic of the inverse with its values and slopes at both ends
        size = sums[k + 1] - sums[k]
        share = (s - sums[k]) / size
        other = 1.0 - share
        u = a + (b - a) * share**2 * (3.0 - 2.0 * share)
        u = np.clip(u + share * other * size * (other / slopes[k] - share / slopes[k + 1]), a, b)
        before, enough = np.zeros(len(s)), 1e-14 * ends[-1]
        for _ in range(8):
            half = 0.5 * (u - a)
            nodes = a[:, None] + half[:, None] * (1.0 + _NODES)
            made = sums[k] + (np.linalg.norm(self._spline(nodes, 1), axis=-1) @ _WEIGHTS) * half
            step = (s - made) / np.linalg.norm(self._spline(u, 1), axis=1)
            u, step = np.clip(u + step, a, b), np.abs(step)
            # steps go with the square of the one before: the next one is about step (step / before)^2
            if np.all((step <= enough) | (step**3 <= 1e-4 * enough * before**2)):
                break
            before = step
        return u

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, "points": self.points.tolist(), "closed": self._closed}
