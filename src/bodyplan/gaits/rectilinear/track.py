"""The ground under the body's way: floor and ceiling along a line, level or in steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.gaits.rectilinear.terrain import Steps
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
    ``breaks`` (e,) m are the s of all steps.
    """

    ground: Ground
    origin: tuple[float, float]
    heading: float
    level: bool
    floor: float
    ceiling: float
    breaks: Array = field(default_factory=lambda: np.zeros(0))

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
        return cls(ground, origin, heading, False, floor, ceiling, np.asarray(ground.breaks) - origin[0])

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

    def ceiling_at(self, s: Array) -> Array:
        """Ceiling (...,) m at s; inf where it is open."""
        if not isinstance(self.ground, Profile):
            return np.full(np.shape(s), np.inf)
        return self.ground.ceiling_height(self.origin[0] + s)

    @cached_property
    def steps(self) -> Steps:
        """Floor and ceiling for kernels; of a level ground those at its place."""
        if not isinstance(self.ground, Profile):
            none, inf = np.zeros(0), np.full(1, np.inf)
            return Steps(none, np.array([self.floor]), none, -inf, none, inf)
        floor_x, floor_z = self.ground.floor_levels
        roof_x, roof_z = self.ground.ceiling_levels
        starts, ends = np.append(-np.inf, self.breaks), np.append(self.breaks, np.inf)
        after, until = np.maximum(starts, np.minimum(ends, 0.0) - 1.0), np.minimum(ends, np.maximum(starts, 0.0) + 1.0)
        inside = 0.5 * (after + until)
        return Steps(
            floor_x - self.origin[0],
            np.array(floor_z),
            roof_x - self.origin[0],
            -np.asarray(roof_z),
            np.array(self.breaks),
            self.ceiling_at(inside) - self.height(inside),
        )
