"""What every ground can do, and the solids it hands to physics and pictures."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError, UnknownNameError

#: points of a segment at which a ground that knows no better looks for its clearance
SEGMENT_POINTS = 9


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
    part (``_jet``) for grounds that are a graph z(x, y), or overrides the methods.
    """

    #: name in mission files, set by each subclass and used as the registry key
    kind: str = ""

    def height(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Floor height z (...,) in m."""
        return self._jet(*planar(x, y))[0]

    def gradient(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """(f_x, f_y) of the floor, shape (..., 2)."""
        return self._jet(*planar(x, y))[1]

    def hessian(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Second derivatives of the floor, shape (..., 2, 2), in 1/m."""
        return self._jet(*planar(x, y))[2]

    def normal(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Unit upward normal (-f_x, -f_y, 1)/|.|, shape (..., 3) (paper *wheels* eq. (3), corrected)."""
        g = self.gradient(x, y)
        n = np.concatenate([-g, np.ones((*g.shape[:-1], 1))], axis=-1)
        return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))

    def curvature(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Principal curvatures of the floor, shape (..., 2), ascending, 1/m; positive where it bends up
        (a valley)."""
        _, g, h = self._jet(*planar(x, y))
        w = np.sqrt(1.0 + np.sum(g * g, axis=-1))
        metric = np.eye(2) + g[..., :, None] * g[..., None, :]
        # eigenvalues of metric^-1 h / w through the symmetric form L^-1 h L^-T
        lower = np.linalg.cholesky(metric)
        inner = np.linalg.solve(lower, np.swapaxes(np.linalg.solve(lower, h), -1, -2))
        return np.asarray(np.linalg.eigvalsh(inner) / w[..., None])

    def gap(self, points: ArrayLike) -> Array:
        """Vertical distance (...,) in m from the floor up to points (..., 3): z - height(x, y)."""
        p = spatial_points(points)
        return np.asarray(p[..., 2] - self.height(p))

    @abstractmethod
    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Height (...,), gradient (..., 2) and Hessian (..., 2, 2) of the floor at broadcast x, y."""

    @abstractmethod
    def clearance(self, points: ArrayLike) -> Array:
        """Signed distance (...,) in m from points (..., 3) to the nearest ground (floor, wall or ceiling):
        positive in free space, negative inside."""

    def segment_clearance(self, ends: ArrayLike) -> Array:
        """Signed distance (...,) in m to the nearest ground of the nearest, or deepest, point of segments from
        ``ends[..., 0, :]`` to ``ends[..., 1, :]`` (..., 2, 3): the smallest :meth:`clearance` along each.

        Here it is that of 9 points, evenly spaced with both ends; grounds that can do so give it exactly.
        """
        e = segments(ends)
        s = np.linspace(0.0, 1.0, SEGMENT_POINTS)[:, None]
        points = e[..., None, 0, :] * (1.0 - s) + e[..., None, 1, :] * s
        return np.asarray(self.clearance(points).min(axis=-1))

    @abstractmethod
    def solids(self, low: ArrayLike, high: ArrayLike) -> list[Solid]:
        """The ground inside the box from ``low`` (3,) to ``high`` (3,) as solids for physics and pictures."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """JSON-able description; :func:`bodyplan.ground.from_dict` gives an equal ground back."""

    @classmethod
    def from_arguments(cls, arguments: Mapping[str, Any]) -> Ground:
        """A ground of this class from its arguments by name, as :meth:`to_dict` lists them.

        Raises UnknownNameError for an argument that the class does not take, InputError for a missing one.
        """
        check_arguments(cls, arguments, f"ground {cls.kind!r}")
        return cls(**arguments)

    def __setattr__(self, name: str, value: Any) -> None:
        if name in self.__dict__:
            raise AttributeError(f"{type(self).__name__}.{name}: a ground cannot be changed; make another one.")
        super().__setattr__(name, value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Ground) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self.to_dict()))

    def __repr__(self) -> str:
        args = ", ".join(f"{k}={v!r}" for k, v in self.to_dict().items() if k != "kind")
        return f"{type(self).__name__}({args if len(args) < 200 else '...'})"


def planar(x: ArrayLike, y: ArrayLike | None) -> tuple[Array, Array]:
    """x and y of one broadcast shape (...,), from two arrays or from points (..., 2) or (..., 3)."""
    if y is None:
        points = finite(x, "points")
        if points.ndim == 0 or points.shape[-1] not in (2, 3):
            raise InputError(f"points: expected shape (..., 2) or (..., 3), got {points.shape}.")
        return points[..., 0], points[..., 1]
    checked = finite(x, "x"), finite(y, "y")
    try:
        bx, by = np.broadcast_arrays(*checked)
    except ValueError as error:
        raise InputError(f"x, y: shapes {checked[0].shape} and {checked[1].shape} do not broadcast.") from error
    return bx, by


def check_arguments(function: Callable[..., Any], arguments: Mapping[str, Any], where: str) -> None:
    """UnknownNameError for an argument that ``function`` does not take, InputError for one that it misses."""
    parameters = inspect.signature(function).parameters
    for name in arguments:
        if name not in parameters:
            raise UnknownNameError("field", name, parameters, where)
    for name, parameter in parameters.items():
        if parameter.default is parameter.empty and name not in arguments:
            raise InputError(f"{where}: {name} is missing.")


def spatial_points(points: ArrayLike) -> Array:
    """Points (..., 3) as finite float64, or InputError."""
    p = finite(points, "points")
    if p.ndim == 0 or p.shape[-1] != 3:
        raise InputError(f"points: expected shape (..., 3), got {p.shape}.")
    return p


def segments(ends: ArrayLike) -> Array:
    """Ends (..., 2, 3) of segments as finite float64, or InputError."""
    e = finite(ends, "ends")
    if e.ndim < 2 or e.shape[-2:] != (2, 3):
        raise InputError(f"ends: expected shape (..., 2, 3), got {e.shape}.")
    return e


def coulomb(value: Any, field: str) -> float | None:
    """A friction coefficient >= 0, or None where the ground names none."""
    return None if value is None else number(value, field, at_least=0.0)


def region(low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """The corners (3,) of a box of positive size along x and y, or InputError."""
    a, b = finite(low, "low", (3,)), finite(high, "high", (3,))
    if np.any(a[:2] >= b[:2]) or a[2] > b[2]:
        raise InputError(f"low, high: every coordinate of low must be below that of high, got {a} and {b}.")
    return a, b
