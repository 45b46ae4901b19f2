"""Ground that is one smooth graph z = f(x, y), on the whole plane or on a rectangle of it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, frozen, number
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground, Solid, region, spatial_points
from bodyplan.ground.nearest import Bounds, JetFunction, nearest

if TYPE_CHECKING:
    from bodyplan.ground.field_kernel import FieldArrays

#: samples along each side of a field for physics and pictures
MAX_SIDE = 1024
#: regions whose bounds are remembered
_REGIONS = 4096


class Field(Ground):
    """A smooth height field. A subclass gives its values, derivatives and bounds (``field_...``).

    ``friction``: Coulomb coefficient or None.
    """

    friction: float | None

    @property
    @abstractmethod
    def field_box(self) -> Array:
        """Corners (2, 2) of the rectangle on which the ground is given, lowest x, y first, perhaps inf."""

    @abstractmethod
    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Height, gradient and Hessian at x, y (n,) in the rectangle; height nan where it is undefined."""

    def field_height(self, x: Array, y: Array) -> Array:
        """The height (n,) alone, to rounding."""
        return self.field_jet(x, y)[0]

    @abstractmethod
    def field_bounds(self, low: Array, high: Array) -> Bounds:
        """Bounds of the height and its derivatives over boxes with corners (n, 2)."""

    @abstractmethod
    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        """Rate (n, 2, 2) of the Hessian at x, y (n,) for a point that moves by dx, dy (n,) a unit of time."""

    def region_bounds(self, low: Array, high: Array) -> tuple[float, float]:
        """(highest ground m, largest norm of its Hessian 1/m) over a box with corners (2,): loose bounds, over a larger
        box on a grid as wide as this one, remembered for the next boxes nearby. Infinite where nothing is known."""
        side = 2.0 ** np.ceil(np.log2(max(float((high - low).max()), 1e-9)))
        a, b = np.floor(low / side) * side, np.ceil(high / side) * side
        key = (*a.tolist(), *b.tolist())
        known = self._regions.get(key)
        if known is None:
            bounds = self.field_bounds(a[None], b[None])
            size = np.abs(bounds.hessian[:, 0]).max(axis=0)
            known = float(bounds.z[1, 0]), float(max(size[0, 0], size[1, 1]) + size[0, 1])
            if len(self._regions) >= _REGIONS:
                self._regions.clear()
            self._regions[key] = known
        return known

    @cached_property
    def _regions(self) -> dict[tuple[float, ...], tuple[float, float]]:
        return {}

    @property
    @abstractmethod
    def field_arrays(self) -> FieldArrays:
        """The field for kernels."""

    def field_creases(self) -> Sequence[JetFunction]:
        """Functions whose zeros are the lines where the ground has no derivative."""
        return ()

    @property
    def extent(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(lowest, highest) x and y of the rectangle on which the ground is given, m; may be infinite."""
        (x0, y0), (x1, y1) = self.field_box
        return (float(x0), float(x1)), (float(y0), float(y1))

    def nearest(self, points: ArrayLike) -> Array:
        """The ground points (..., 3) nearest to points (..., 3).

        The distance is the smallest there is to 1e-11 of itself (see :mod:`bodyplan.ground.nearest`). Where
        more pieces of ground tie than the search can keep apart, as at the centre of a spherical bowl, the
        best one found is taken, without that proof. Ground ends at the edge of its rectangle and where its
        formula is undefined. Raises InputError for a point beyond the edge or above no ground.
        """
        p = spatial_points(points)
        flat = p.reshape(-1, 1, 3)
        uv, _ = self.nearest_up_to(flat, np.full(len(flat), np.inf))
        return np.concatenate([uv, self.field_jet(uv[:, 0], uv[:, 1])[0][:, None]], axis=1).reshape(p.shape)

    def clearance(self, points: ArrayLike) -> Array:
        """Signed Euclidean distance (...,) in m from points (..., 3) to the ground: that of :meth:`nearest`,
        negative below the ground."""
        p = spatial_points(points)
        flat = p.reshape(-1, 1, 3)
        return self.nearest_up_to(flat, np.full(len(flat), np.inf))[1].reshape(p.shape[:-1])

    def nearest_up_to(self, points: Array, caps: Array) -> tuple[Array, Array]:
        """Of groups of ``points`` (n, k, 3): the place (n, 2) of the nearest ground and its signed distance (n,) m, the
        smallest of the group; nan and the cap where nothing is nearer than ``caps`` (n,) m.

        Raises InputError for a point beyond the edge or above no ground.
        """
        found, distance, refused = nearest(self.field_arrays, points, caps)
        if refused >= 0:
            flat = points.reshape(-1, 3)
            self.height(flat)
            raise InputError(f"{type(self).__name__}: no ground below the point {flat[refused]} (index {refused}).")
        return found, distance

    def solids(self, low: ArrayLike, high: ArrayLike, *, cell: float | None = None) -> list[Solid]:
        """The ground in the box's x and y as one grid of samples, edges included.

        ``cell``: largest spacing in m; None: fine enough for flat facets to stay within 0.1 mm of the
        ground, as far as 1024 samples a side allow. Raises InputError where that many do not suffice for
        ``cell``, and where the box lies outside the ground.
        """
        wanted = np.stack([corner[:2] for corner in region(low, high)])
        a, b = np.maximum(wanted[0], self.field_box[0]), np.minimum(wanted[1], self.field_box[1])
        if np.any(a >= b):
            raise InputError(f"{type(self).__name__}: no ground from {wanted[0]} to {wanted[1]}; {self._covers()}.")
        size = b - a
        if cell is None:
            spacing = np.clip(self._spacing_for(a, b, 1e-4), size.max() / (MAX_SIDE - 1), size.max() / 32)
        else:
            spacing = number(cell, "cell", at_least=float(size.max()) / (MAX_SIDE - 1))
        nx, ny = np.ceil(size / spacing * (1.0 - 1e-12)).astype(int) + 1
        x, y = np.linspace(a[0], b[0], nx), np.linspace(a[1], b[1], ny)
        z = frozen(self.height(x[None, :], y[:, None]))
        steps = (float(size[0] / (nx - 1)), float(size[1] / (ny - 1)))
        at = (float(a[0]), float(a[1]), 0.0)
        return [Solid("floor", "field", "floor", at, z=z, cell=steps, friction=self.friction)]

    def _spacing_for(self, low: Array, high: Array, sag: float) -> float:
        """Grid spacing that keeps facets within about ``sag`` of the ground: |Hess f| spacing^2 / 4 = sag."""
        x, y = np.meshgrid(*np.linspace(low, high, 65).T)
        hessian = self.hessian(x, y)
        bend = float(np.linalg.norm(hessian, axis=(-2, -1)).max())
        return float(np.sqrt(4.0 * sag / bend)) if bend > 0.0 else np.inf

    def _covers(self) -> str:
        (x0, x1), (y0, y1) = self.extent
        return f"it covers x from {x0} to {x1} and y from {y0} to {y1}"

    def _check_inside(self, x: Array, y: Array) -> None:
        """InputError naming the first point beyond the edge (rounding of the edge itself is forgiven)."""
        low, high = self.field_box
        if x.size and low[0] <= x.min() and low[1] <= y.min() and x.max() <= high[0] and y.max() <= high[1]:
            return
        xy = np.stack([x, y], axis=-1)
        slack = 1e-12 * np.where(np.isfinite(high - low), high - low, 0.0)
        outside = np.any((xy < low - slack) | (xy > high + slack), axis=-1)
        if outside.any():
            index = tuple(int(i) for i in np.argwhere(outside)[0])
            where = f" (index {index})" if index else ""
            raise InputError(
                f"{type(self).__name__}: the point x = {xy[index][0]}, y = {xy[index][1]}{where} is outside; "
                f"{self._covers()}."
            )
