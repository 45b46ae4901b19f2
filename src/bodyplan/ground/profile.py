"""Floor and ceiling in steps along x: stairs, gaps under beams, pipes seen from the side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground, Solid, coulomb, region, segments, spatial_points
from bodyplan.ground.outline import Edge, distance_to_edges
from bodyplan.ground.steps import steps_clearance

MAX_STEPS = 10_000

#: one z for all x, or steps (x_start, z); None stands for minus infinity as x, for "open" as z of a ceiling
Levels = float | Sequence[tuple[float | None, float | None]]


class Profile(Ground):
    """Floor and ceiling, piecewise constant in x and the same for every y (m).

    ``floor`` and ``ceiling``: one z for all x, or steps ``[(x_start, z), ...]`` in ascending x: the level is
    z from x_start on. The first level also holds before its start, which may be -inf or None. ``ceiling``
    None is open; a step of the ceiling may be open too (z = inf or None).

    The ground is a closed solid with upright faces: at a step itself the floor is the higher level, the
    ceiling the lower one. Raises InputError where the ceiling touches the floor or lies below it.
    """

    kind = "profile"

    def __init__(self, floor: Levels = 0.0, ceiling: Levels | None = None, *, friction: float | None = None) -> None:
        self._floor_x, self._floor_z = _levels(floor, "Profile.floor", may_be_open=False)
        self._ceiling_x, self._ceiling_z = _levels(np.inf if ceiling is None else ceiling, "Profile.ceiling")
        self.friction = coulomb(friction, "Profile.friction")
        # a step is as tight as both of its sides, so the steps tell for all x
        x = self.breaks if len(self.breaks) else np.zeros(1)
        floor_z, ceiling_z = self.height(x, 0.0), self.ceiling_height(x)
        for i in np.flatnonzero(ceiling_z <= floor_z)[:1]:
            raise InputError(
                f"Profile.ceiling: must be above the floor everywhere, at x = {x[i]} the ceiling is "
                f"{ceiling_z[i]} and the floor {floor_z[i]}."
            )

    @property
    def breaks(self) -> Array:
        """The x of all steps of floor and ceiling (k,), ascending, in m."""
        return frozen(np.union1d(self._floor_x, self._ceiling_x))

    @property
    def floor_levels(self) -> tuple[Array, Array]:
        """The x of the floor's steps (k,), ascending, and the levels (k + 1,) between them, m."""
        return self._floor_x, self._floor_z

    @property
    def ceiling_levels(self) -> tuple[Array, Array]:
        """The same of the ceiling; a level is inf where it is open."""
        return self._ceiling_x, self._ceiling_z

    def ceiling_height(self, x: ArrayLike) -> Array:
        """Ceiling z (...,) in m at x (...,); inf where it is open."""
        at = finite(x, "x")
        return np.asarray(np.minimum(*_both_sides(at, self._ceiling_x, self._ceiling_z)))

    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        z = np.asarray(np.maximum(*_both_sides(x, self._floor_x, self._floor_z)))
        return z, np.zeros((*z.shape, 2)), np.zeros((*z.shape, 2, 2))

    def clearance(self, points: ArrayLike) -> Array:
        """Signed distance (...,) in m from points (..., 3) to floor, ceiling and the faces of their steps;
        exact everywhere."""
        p = spatial_points(points)
        x, z = p[..., 0], p[..., 2]
        edges = _edges(self._floor_x, self._floor_z) + _edges(self._ceiling_x, self._ceiling_z)
        inside = (z < self.height(p)) | (z > self.ceiling_height(x))
        return np.asarray(np.where(inside, -1.0, 1.0) * distance_to_edges(x, z, edges))

    def segment_clearance(self, ends: ArrayLike) -> Array:
        """Smallest :meth:`clearance` (...,) in m along segments from ``ends[..., 0, :]`` to ``ends[..., 1, :]``
        (..., 2, 3), exact: also where a corner reaches through a segment whose ends are outside."""
        e = segments(ends)
        flat = np.ascontiguousarray(e[..., ::2]).reshape(-1, 2, 2)
        out = np.full(len(flat), np.inf)
        steps_clearance(flat, self._floor_x, self._floor_z, out)
        # a ceiling is a floor upside down
        steps_clearance(flat * (1.0, -1.0), self._ceiling_x, -self._ceiling_z, out)
        return out.reshape(e.shape[:-2])

    def floor_alone(self) -> Profile:
        """The same floor under an open sky."""
        starts = [-np.inf, *map(float, self._floor_x)]
        return Profile(list(zip(starts, map(float, self._floor_z), strict=True)), friction=self.friction)

    def solids(self, low: ArrayLike, high: ArrayLike) -> list[Solid]:
        """A box for each level of floor and ceiling between the x of ``low`` and ``high``."""
        a, b = region(low, high)
        closed = self._ceiling_z[np.isfinite(self._ceiling_z)]
        levels = [float(a[2]), float(b[2]), *map(float, self._floor_z), *map(float, closed)]
        margin = 0.25 * max(float(b[0] - a[0]), max(levels) - min(levels))
        bottom, top = min(levels) - margin, max(levels) + margin
        y = (float(a[1]), float(b[1]))
        solids = []
        for role, xs, zs in (
            ("floor", self._floor_x, self._floor_z),
            ("ceiling", self._ceiling_x, self._ceiling_z),
        ):
            starts, ends = np.append(a[0], np.clip(xs, a[0], b[0])), np.append(np.clip(xs, a[0], b[0]), b[0])
            for i, (x0, x1, z) in enumerate(zip(starts, ends, zs, strict=True)):
                if x1 > x0 and np.isfinite(z):
                    other = bottom if role == "floor" else top
                    solids.append(_box(f"{role} {i}", role, (x0, x1), y, sorted((z, other)), self.friction))
        return solids

    def to_dict(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "floor": _plain(self._floor_x, self._floor_z),
            "ceiling": _plain(self._ceiling_x, self._ceiling_z),
            "friction": self.friction,
        }


def _levels(given: Levels, field: str, may_be_open: bool = True) -> tuple[Array, Array]:
    """The x of the steps (k,) and the levels (k + 1,) between them; steps of no height are left out."""
    wanted = f"{field}: expected one z or steps [(x_start, z), ...]"
    if isinstance(given, (int, float, np.integer, np.floating)):
        given = [(None, float(given))]
    try:
        steps = [(-np.inf if x is None else float(x), np.inf if z is None else float(z)) for x, z in given]
    except (TypeError, ValueError) as error:
        raise InputError(f"{wanted}, got {given!r}.") from error
    if not steps or len(steps) > MAX_STEPS:
        raise InputError(f"{wanted}, at least one and at most {MAX_STEPS}, got {len(steps)}.")
    for i, (x, z) in enumerate(steps):
        if not (np.isfinite(x) or (i == 0 and x == -np.inf)):
            raise InputError(f"{field}: step {i} must start at a finite x, got {x} (the first may start at -inf).")
        if not (np.isfinite(z) or (may_be_open and z == np.inf)):
            raise InputError(f"{field}: step {i} must have a finite z, got {z}.")
        if i and x <= steps[i - 1][0]:
            raise InputError(f"{field}: steps must start at ascending x, step {i} starts at {x}.")
    xs, zs = np.array(steps, dtype=np.float64).T
    real = np.append(True, zs[1:] != zs[:-1])
    return frozen(xs[real][1:]), frozen(zs[real])


def _both_sides(x: Array, xs: Array, zs: Array) -> tuple[Array, Array]:
    """The levels just before and just after x, each (...,)."""
    return zs[np.searchsorted(xs, x, side="left")], zs[np.searchsorted(xs, x, side="right")]


def _edges(xs: Array, zs: Array) -> list[Edge]:
    """The treads and the upright faces, open parts left out."""
    ends = [-np.inf, *map(float, xs), np.inf]
    levels = list(map(float, zs))
    treads = [(a, z, b, z) for a, b, z in zip(ends, ends[1:], levels, strict=False) if np.isfinite(z)]
    faces = [(x, p, x, q) for x, p, q in zip(ends[1:], levels, levels[1:], strict=False)]
    return treads + faces


def _box(
    name: str,
    role: str,
    x: tuple[float, float],
    y: tuple[float, float],
    z: Sequence[float],
    friction: float | None,
) -> Solid:
    low, high = np.array([x[0], y[0], z[0]]), np.array([x[1], y[1], z[1]])
    cx, cy, cz = map(float, 0.5 * (low + high))
    hx, hy, hz = map(float, 0.5 * (high - low))
    return Solid(name, "box", role, (cx, cy, cz), half=(hx, hy, hz), friction=friction)


def _plain(xs: Array, zs: Array) -> float | list[list[float | None]] | None:
    """JSON form: None for minus infinity and for open."""
    levels = [float(z) if np.isfinite(z) else None for z in zs]
    if len(levels) == 1:
        return levels[0]
    return [[None if i == 0 else float(xs[i - 1]), z] for i, z in enumerate(levels)]
