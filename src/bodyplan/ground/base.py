"""What every ground can do, and the solids it hands to physics and pictures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError


@dataclass(frozen=True)
class Solid:
    """A piece of ground for physics and drawing. ``kind`` is one of

    ``"plane"`` (through ``position`` with outward normal the z axis of ``quaternion``),
    ``"box"`` (centred at ``position``, ``half`` sizes along the axes of ``quaternion``),
    ``"field"`` (heights ``z`` (rows over y, columns over x), spacing ``cell`` (dx, dy), first sample at
    ``position`` x, y; heights are absolute in world z).

    Lengths in m, quaternion wxyz. ``role`` is ``"floor"``, ``"wall"`` or ``"ceiling"``; ``friction`` the
    Coulomb coefficient or None (then the robot's contact or the caller says).
    """

    name: str
    kind: str
    role: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    half: tuple[float, float, float] = (0.0, 0.0, 0.0)
    z: Array | None = field(default=None, repr=False)
    cell: tuple[float, float] = (0.0, 0.0)
    friction: float | None = None


class Ground(ABC):
    """Ground under, around and above a robot. World: x forward, y left, z up; metres.

    Every method takes ``(x, y)`` arrays that broadcast, or one array of points (..., 2) or (..., 3)
    whose first two columns are x and y; any leading batch shape. A subclass implements the scalar-field
    part (``_height`` with its derivatives) for grounds that are a graph z(x, y), or overrides the methods.
    """

    #: name in mission files, set by each subclass and used as the registry key
    kind: str = ""

    def height(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Floor height z (...,) in m."""
        return self._jet(*_xy(x, y))[0]

    def gradient(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """(f_x, f_y) of the floor, shape (..., 2)."""
        return self._jet(*_xy(x, y))[1]

    def hessian(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Second derivatives of the floor, shape (..., 2, 2), in 1/m."""
        return self._jet(*_xy(x, y))[2]

    def normal(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Unit upward normal (-f_x, -f_y, 1)/|.|, shape (..., 3) (paper *wheels* eq. (3), corrected)."""
        g = self.gradient(x, y)
        n = np.concatenate([-g, np.ones((*g.shape[:-1], 1))], axis=-1)
        return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))

    def curvature(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Principal curvatures of the floor, shape (..., 2), ascending, 1/m; positive where it bends up (a valley)."""
        _, g, h = self._jet(*_xy(x, y))
        w = np.sqrt(1.0 + np.sum(g * g, axis=-1))
        metric = np.eye(2) + g[..., :, None] * g[..., None, :]
        # eigenvalues of metric^-1 h / w through the symmetric form L^-1 h L^-T
        lower = np.linalg.cholesky(metric)
        inner = np.linalg.solve(lower, np.swapaxes(np.linalg.solve(lower, h), -1, -2))
        return np.asarray(np.linalg.eigvalsh(inner) / w[..., None])

    @abstractmethod
    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Height (...,), gradient (..., 2) and Hessian (..., 2, 2) of the floor at broadcast x, y."""

    @abstractmethod
    def clearance(self, points: ArrayLike) -> Array:
        """Signed distance (...,) in m from points (..., 3) to the nearest ground (floor, wall or ceiling):
        positive in free space, negative inside."""

    @abstractmethod
    def solids(self, low: ArrayLike, high: ArrayLike) -> list[Solid]:
        """The ground inside the box from ``low`` (3,) to ``high`` (3,) as solids for physics and pictures."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """JSON-able description; :func:`bodyplan.ground.from_dict` gives an equal ground back."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Ground) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self.to_dict()))

    def __repr__(self) -> str:
        args = ", ".join(f"{k}={v!r}" for k, v in self.to_dict().items() if k != "kind")
        return f"{type(self).__name__}({args if len(args) < 200 else '...'})"


def _xy(x: ArrayLike, y: ArrayLike | None) -> tuple[Array, Array]:
    if y is None:
        points = finite(x, "points")
        if points.ndim == 0 or points.shape[-1] not in (2, 3):
            raise InputError(f"points: expected shape (..., 2) or (..., 3), got {points.shape}.")
        return points[..., 0], points[..., 1]
    bx, by = np.broadcast_arrays(finite(x, "x"), finite(y, "y"))
    return bx, by
