"""A plane, level or tilted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.ground.base import Ground, Solid, coulomb, region, segments


class Plane(Ground):
    """The plane ``z = height + slope[0] x + slope[1] y`` (m; slopes are tangents, without unit).

    ``friction``: Coulomb coefficient or None. Raises InputError for a number that is not finite.
    """

    kind = "plane"

    def __init__(self, height: float = 0.0, *, slope: ArrayLike = (0.0, 0.0), friction: float | None = None) -> None:
        self.level = number(height, "Plane.height")
        sx, sy = finite(slope, "Plane.slope", (2,))
        self.slope = (float(sx), float(sy))
        self.friction = coulomb(friction, "Plane.friction")

    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        sx, sy = self.slope
        z = np.asarray(self.level + sx * x + sy * y)
        return z, np.broadcast_to(self.slope, (*z.shape, 2)).copy(), np.zeros((*z.shape, 2, 2))

    def clearance(self, points: ArrayLike) -> Array:
        """Signed distance (...,) in m from points (..., 3) to the plane: gap / sqrt(1 + |slope|^2)."""
        return np.asarray(self.gap(points) / np.sqrt(1.0 + self.slope[0] ** 2 + self.slope[1] ** 2))

    def segment_clearance(self, ends: ArrayLike) -> Array:
        """Signed distance (...,) in m of the lower end of segments (..., 2, 3) to the plane, exact."""
        return np.asarray(self.clearance(segments(ends)).min(axis=-1))

    def solids(self, low: ArrayLike, high: ArrayLike) -> list[Solid]:
        """One plane, anchored under the middle of the box."""
        a, b = region(low, high)
        x, y = 0.5 * (a[:2] + b[:2])
        at = (float(x), float(y), float(self.height(x, y)))
        return [Solid("floor", "plane", "floor", at, _upright_to(self.normal(x, y)), friction=self.friction)]

    def to_dict(self) -> dict[str, Any]:
        return {"kind": self.kind, "height": self.level, "slope": list(self.slope), "friction": self.friction}


def _upright_to(normal: Array) -> tuple[float, float, float, float]:
    """The shortest turn (wxyz) of the z axis into an upward unit normal n: (1 + n_z, z x n), normalised."""
    q = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0])
    w, x, y, z = q / np.linalg.norm(q)
    return float(w), float(x), float(y), float(z)
