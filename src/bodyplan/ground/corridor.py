"""A floor between two walls."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, number
from bodyplan.ground.base import Ground, Solid, coulomb, region, spatial_points
from bodyplan.ground.outline import distance_to_edges


class Corridor(Ground):
    """A corridor along x: floor at z = ``floor``, walls at y = +-``width``/2, ``height`` above the floor (m).

    The walls are solid outwards without end, so that their top is the ground beyond them: ``height(x, y)`` is
    the floor for \\|y\\| < width/2 and the wall top elsewhere. ``friction`` and ``wall_friction``: Coulomb
    coefficients or None; a wall without its own has none. Raises InputError for a width or height <= 0.
    """

    kind = "corridor"

    def __init__(
        self,
        width: float,
        *,
        height: float = 0.1,
        floor: float = 0.0,
        friction: float | None = None,
        wall_friction: float | None = None,
    ) -> None:
        self.width = number(width, "Corridor.width", above=0.0)
        self.wall_height = number(height, "Corridor.height", above=0.0)
        self.floor = number(floor, "Corridor.floor")
        self.friction = coulomb(friction, "Corridor.friction")
        self.wall_friction = coulomb(wall_friction, "Corridor.wall_friction")

    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        between = np.abs(y) < 0.5 * self.width
        z = np.where(between, self.floor, self.floor + self.wall_height)
        return z, np.zeros((*z.shape, 2)), np.zeros((*z.shape, 2, 2))

    def clearance(self, points: ArrayLike) -> Array:
        """Signed distance (...,) in m from points (..., 3) to floor, walls and wall tops."""
        p = spatial_points(points)
        y, z = np.abs(p[..., 1]), p[..., 2]
        half, low, top = 0.5 * self.width, self.floor, self.floor + self.wall_height
        edges = [(-half, low, half, low), (half, low, half, top), (half, top, np.inf, top)]
        inside = (z < low) | ((y > half) & (z < top))
        return np.asarray(np.where(inside, -1.0, 1.0) * distance_to_edges(y, z, edges))

    def solids(self, low: ArrayLike, high: ArrayLike) -> list[Solid]:
        """The floor as a plane, and a box for each wall, as thick as the corridor is wide or wider."""
        a, b = region(low, high)
        half, x = 0.5 * self.width, float(0.5 * (a[0] + b[0]))
        solids = [Solid("floor", "plane", "floor", (x, 0.0, self.floor), friction=self.friction)]
        # from below the floor, so that nothing can be caught in the seam
        z0, z1 = self.floor - self.wall_height, self.floor + self.wall_height
        for name, sign, reach in (("left wall", 1.0, b[1]), ("right wall", -1.0, -a[1])):
            outer = max(float(reach), half + self.width)
            at = (x, sign * 0.5 * (half + outer), 0.5 * (z0 + z1))
            size = (float(0.5 * (b[0] - a[0])), 0.5 * (outer - half), 0.5 * (z1 - z0))
            solids.append(Solid(name, "box", "wall", at, half=size, friction=self.wall_friction))
        return solids

    def to_dict(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "width": self.width,
            "height": self.wall_height,
            "floor": self.floor,
            "friction": self.friction,
            "wall_friction": self.wall_friction,
        }
