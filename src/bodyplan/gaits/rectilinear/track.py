"""The ground under the body's way: floor and ceiling along a line, level or in steps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.ground.corridor import Corridor
from bodyplan.ground.plane import Plane
from bodyplan.ground.profile import Profile

#: rad: a way along x
ALONG_X = 1e-12


@dataclass(frozen=True, eq=False)
class Track:
    """``ground`` along the way from ``origin`` (2,) m in direction ``heading`` rad; s m is the distance on it.

    ``level``: the same everywhere, with ``floor`` and ``ceiling`` m. For steps these hold where the way begins;
    ``breaks`` (e,) m are the s of all steps, ``corners`` (k, 2) m the edges of the floor's, along and up; ``below`` and
    ``above`` floor and ceiling as grounds of their own (None: open).
    """

    ground: Ground
    origin: tuple[float, float]
    heading: float
    level: bool
    floor: float
    ceiling: float
    breaks: Array = field(default_factory=lambda: np.zeros(0))
    corners: Array = field(default_factory=lambda: np.zeros((0, 2)))
    below: Ground | None = None
    above: Ground | None = None

    @classmethod
    def of(cls, ground: Ground, origin: tuple[float, float], heading: float) -> Track:
        """InputError for grounds that are neither level nor made of steps, and for a way across steps."""
        at = (np.array(origin[0]), np.array(origin[1]))
        if (isinstance(ground, Plane) and not any(ground.slope)) or isinstance(ground, Corridor):
            return cls(ground, origin, heading, True, float(ground.height(*at)), np.inf)
        if not isinstance(ground, Profile):
            raise InputError(
                "Rectilinear: needs a level floor or steps: a Plane without slope, a Corridor or a Profile, not "
                f"{ground!r}."
            )
        floor, ceiling = float(ground.height(*at)), float(ground.ceiling_height(at[0]))
        if not len(ground.breaks):
            return cls(ground, origin, heading, True, floor, ceiling)
        if abs(np.sin(heading)) > ALONG_X or np.cos(heading) < 0.0:
            raise InputError(
                f"Rectilinear: heading must be 0 on a profile with steps, which run across x; got {heading:.4g} rad."
            )
        levels = ground.to_dict()
        corners = [(x - origin[0], max(before, after)) for x, before, after in _steps(levels["floor"])]
        lowest = min([floor, *(z for _, z in corners)])
        above = None if levels["ceiling"] is None else Profile(lowest - 1e3, levels["ceiling"])
        return cls(
            ground,
            origin,
            heading,
            False,
            floor,
            ceiling,
            np.asarray(ground.breaks) - origin[0],
            np.array(corners).reshape(-1, 2),
            ground.floor_alone(),
            above,
        )

    @property
    def along(self) -> Array:
        """(3,) unit vector of the way."""
        return np.array([np.cos(self.heading), np.sin(self.heading), 0.0])

    def world(self, points: Array) -> Array:
        """Points (..., 2) along and up -> (..., 3) m."""
        out = np.empty((*points.shape[:-1], 3))
        out[..., 0] = self.origin[0] + points[..., 0] * np.cos(self.heading)
        out[..., 1] = self.origin[1] + points[..., 0] * np.sin(self.heading)
        out[..., 2] = points[..., 1]
        return out

    def height(self, s: Array) -> Array:
        """Floor (...,) m at s."""
        at = self.world(np.stack([s, 0.0 * s], axis=-1))
        return self.ground.height(at[..., 0], at[..., 1])

    def lowest(self, low: Array, high: Array) -> Array:
        """(...,) m: the least height between floor and ceiling from s = ``low`` to ``high`` (...,), each place by
        itself; inf where it is open."""
        starts, ends = np.append(-np.inf, self.breaks), np.append(self.breaks, np.inf)
        out = np.full(np.shape(low), np.inf)
        for a, b in zip(starts, ends, strict=True):
            inside = 0.5 * (max(a, min(b, 0.0) - 1.0) + min(b, max(a, 0.0) + 1.0))
            x = np.array(self.origin[0] + inside)
            height = float(self.ground.ceiling_height(x)) - float(self.height(np.array(inside)))  # type: ignore[attr-defined]
            out = np.where((low < b) & (high > a), np.minimum(out, height), out)
        return out

    def ceiling_at(self, s: Array) -> Array:
        """Ceiling (...,) m at s; inf where it is open."""
        if not isinstance(self.ground, Profile):
            return np.full(np.shape(s), np.inf)
        return self.ground.ceiling_height(self.origin[0] + s)

    def gaps(self, ends: Array) -> tuple[Array, Array, Array]:
        """Distances (...,) m of segments ``ends`` (..., 2, 2), along and up, from the floor, from the ceiling and from
        the nearest edge of the floor; inf where there is none."""
        corner = np.full(ends.shape[:-2], np.inf)
        ceiling = corner if self.above is None else self.above.segment_clearance(self.world(ends))
        if len(self.corners):
            start, way = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
            square = np.sum(way * way, axis=-1)
            for at in self.corners:
                share = np.sum((at - start) * way, axis=-1) / np.where(square > 0.0, square, 1.0)
                off = at - start - np.clip(share, 0.0, 1.0)[..., None] * way
                corner = np.minimum(corner, np.hypot(off[..., 0], off[..., 1]))
        return self.floor_gap(ends), ceiling, corner

    def floor_gap(self, ends: Array) -> Array:
        """Distances (...,) m of segments ``ends`` (..., 2, 2) from the floor."""
        return np.asarray((self.below or self.ground).segment_clearance(self.world(ends)))


def _steps(levels: float | list[list[float | None]] | None) -> list[tuple[float, float, float]]:
    """(x, level before, level after) of every step; an open ceiling is at inf."""
    if not isinstance(levels, list):
        return []
    heights = [np.inf if z is None else float(z) for _, z in levels]
    return [(float(x or 0.0), a, b) for (x, _), a, b in zip(levels[1:], heights, heights[1:], strict=False)]
