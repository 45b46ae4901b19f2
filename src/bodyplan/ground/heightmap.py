"""Ground from measured heights on a grid."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.ground.base import Ground, check_arguments, coulomb, planar
from bodyplan.ground.field import Field
from bodyplan.ground.heightfiles import check_size, pair, read_grid
from bodyplan.ground.nearest import Bounds
from bodyplan.ground.spline import BicubicSpline

if TYPE_CHECKING:
    from bodyplan.ground.field_kernel import FieldArrays

#: beyond this many samples a map is described by its bytes, not by lists
_LISTED = 4096
#: mean radius of the Earth in m, for degrees to metres
_EARTH = 6_371_008.8

#: m; differences of larger heights would overflow or mean nothing
HIGHEST = 1e9


class HeightMap(Field):
    """Ground through heights ``z`` (ny, nx) in m.

    Row j lies at y = origin[1] + j dy, column i at x = origin[0] + i dx.

    **Rows go up in y.** Images and geographic grids have the north row first: turn them with
    ``np.flipud`` (:meth:`from_file` does that for .asc and .png).

    ``cell``: spacing dx = dy or (dx, dy) in m. ``origin``: (x, y) of the first sample. ``scale`` multiplies
    the heights. ``friction``: Coulomb coefficient or None. Between samples the ground is the C2 bicubic
    spline through them (not-a-knot), with exact derivatives.

    Raises InputError for a height that is not finite (with its index), fewer than 2 x 2 samples or more
    than 2048 x 2048, and later for points outside the map.
    """

    kind = "height_map"

    def __init__(
        self,
        z: ArrayLike,
        cell: float | tuple[float, float],
        origin: tuple[float, float] = (0.0, 0.0),
        *,
        scale: float = 1.0,
        friction: float | None = None,
    ) -> None:
        heights = finite(z, "HeightMap.z", (None, None))
        rows, columns = heights.shape
        check_size(rows, columns, "HeightMap.z")
        if np.abs(heights).max() > HIGHEST:
            raise InputError(f"HeightMap.z: heights beyond {HIGHEST:g} m are refused, got {np.abs(heights).max():.4g}.")
        dx, dy = pair(cell, "HeightMap.cell")
        self._cell = (number(dx, "HeightMap.cell", above=0.0), number(dy, "HeightMap.cell", above=0.0))
        self._origin = tuple(float(x) for x in finite(origin, "HeightMap.origin", (2,)))
        self._z = frozen(heights * number(scale, "HeightMap.scale"))
        self._spline = BicubicSpline(self._z, np.array(self._cell))
        size = np.array(self._cell) * (np.array([columns, rows]) - 1)
        self._box = frozen([np.array(self._origin), np.array(self._origin) + size])
        self.friction = coulomb(friction, "HeightMap.friction")

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *,
        cell: float | tuple[float, float] | None = None,
        origin: tuple[float, float] | None = None,
        scale: float = 1.0,
        height_range: tuple[float, float] | None = None,
        fill: float | None = None,
        friction: float | None = None,
    ) -> HeightMap:
        """A map from a file; ``cell`` and ``origin`` given here outweigh those of the file.

        * ``.npy``: the array z, rows over y ascending.
        * ``.npz``: arrays ``z``, and if it has them ``cell`` (one or two numbers) and ``origin`` (2,).
        * ``.asc``: ESRI ASCII grid (ncols, nrows, cellsize or dx and dy, xllcorner or xllcenter and the
          same for y, nodata_value), north row first. Without ``fill``, a height for them, samples without
          data are refused.
        * ``.png``: greyscale, up to 16 bits, top row at the largest y; ``height_range`` is (z of black,
          z of white).

        Raises InputError for a file that is missing, too large or not of its kind, and as the class does.
        """
        grid = read_grid(path, height_range, fill)
        cell = grid.cell if cell is None else cell
        if cell is None:
            raise InputError(f"height map {str(path)!r}: the file does not say its cell size; give cell= in m.")
        origin = (grid.origin or (0.0, 0.0)) if origin is None else origin
        return cls(grid.z, cell, origin, scale=scale, friction=friction)

    @classmethod
    def jacksboro(
        cls,
        *,
        scale: float = 1e-4,
        relief: float = 1.0,
        size: float | None = None,
        friction: float | None = None,
    ) -> HeightMap:
        """Real terrain shrunk to a robot's size: the Jacksboro fault, Tennessee, from matplotlib's samples.

        In nature about 30 km x 32 km with 840 m of relief and samples every 74 m x 93 m; ``scale`` 1e-4 makes
        that 3.0 m x 3.2 m, 84 mm and 7.4 mm x 9.3 mm. ``relief`` exaggerates the heights further. ``size``:
        keep only the middle square of this side in m. The map is centred on the origin, its lowest point at
        z = 0.
        """
        number(scale, "scale", above=0.0)
        try:
            from matplotlib.cbook import get_sample_data
        except ImportError as error:
            raise MissingExtraError("matplotlib", "report", "the Jacksboro terrain") from error
        sample: Any = get_sample_data("jacksboro_fault_dem.npz")
        with sample as data:
            z = np.asarray(data["elevation"], dtype=np.float64)[::-1]  # north row first
            degrees = np.array([float(data["dx"]), float(data["dy"])])
            latitude = np.radians(0.5 * (float(data["ymin"]) + float(data["ymax"])))
        cell = scale * _EARTH * np.radians(degrees) * np.array([np.cos(latitude), 1.0])
        if size is not None:
            half = 0.5 * number(size, "size", above=0.0)
            rows, columns = (
                slice(
                    max(0, int(np.floor(0.5 * (n - 1) - half / d))),
                    int(np.ceil(0.5 * (n - 1) + half / d)) + 1,
                )
                for n, d in zip(z.shape, cell[::-1], strict=True)
            )
            z = z[rows, columns]
        origin = -0.5 * cell * (np.array(z.shape[::-1]) - 1)
        rise = scale * number(relief, "relief", above=0.0)
        return cls(z - z.min(), (cell[0], cell[1]), (origin[0], origin[1]), scale=rise, friction=friction)

    @classmethod
    def from_arguments(cls, arguments: Mapping[str, Any]) -> Ground:
        """As for every ground; or ``file`` with the other arguments of :meth:`from_file`."""
        given = dict(arguments)
        if "file" in given:
            given["path"] = given.pop("file")
            check_arguments(cls.from_file, given, f"ground {cls.kind!r}")
            return cls.from_file(**given)
        if isinstance(given.get("z"), Mapping):
            given["z"] = _unpacked(given["z"])
        return super().from_arguments(given)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, HeightMap)
            and (self._cell, self._origin, self.friction) == (other._cell, other._origin, other.friction)
            and np.array_equal(self._z, other._z)
        )

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        # of numbers only: that of text or None would be another one in a process that gets a copy of this map
        return hash((self._z.shape, self._cell, self._origin, float(self._z.min()), float(self._z.max())))

    @property
    def z(self) -> Array:
        """Heights at the samples (ny, nx) in m, read-only."""
        return self._z

    @property
    def cell(self) -> tuple[float, float]:
        """Spacing (dx, dy) of the samples in m."""
        return self._cell

    @property
    def origin(self) -> tuple[float, ...]:
        """(x, y) of the first sample in m."""
        return self._origin

    @property
    def spline(self) -> BicubicSpline:
        """The spline through the samples, in coordinates from the first one."""
        return self._spline

    @property
    def field_box(self) -> Array:
        return self._box

    def height(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Floor height z (...,) in m."""
        bx, by = planar(x, y)
        self._check_inside(bx, by)
        return self._spline.value(bx.ravel() - self._origin[0], by.ravel() - self._origin[1]).reshape(bx.shape)

    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        self._check_inside(x, y)
        z, g, h = self.field_jet(x.ravel(), y.ravel())
        return z.reshape(x.shape), g.reshape((*x.shape, 2)), h.reshape((*x.shape, 2, 2))

    @cached_property
    def field_arrays(self) -> FieldArrays:
        from bodyplan.ground.field_kernel import spline_field

        return spline_field(self._box, self._spline, self._origin)

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        return self._spline.jet(x - self._origin[0], y - self._origin[1])

    def field_height(self, x: Array, y: Array) -> Array:
        return self._spline.value(x - self._origin[0], y - self._origin[1])

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        return self._spline.bounds(low - self._origin, high - self._origin)

    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        return self._spline.hessian_rate(x - self._origin[0], y - self._origin[1], dx, dy)

    def to_dict(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "z": self._z.tolist() if self._z.size <= _LISTED else _packed(self._z),
            "cell": list(self._cell),
            "origin": list(self._origin),
            "friction": self.friction,
        }


def _packed(z: Array) -> dict[str, Any]:
    """Heights as text: little-endian float64, row by row, base64."""
    return {"float64": base64.b64encode(z.astype("<f8").tobytes()).decode("ascii"), "shape": list(z.shape)}


def _unpacked(data: Mapping[str, Any]) -> Array:
    try:
        rows, columns = (int(n) for n in data["shape"])
        check_size(rows, columns, "HeightMap.z")
        raw = base64.b64decode(data["float64"], validate=True)
        return np.frombuffer(raw, dtype="<f8").astype(np.float64).reshape(rows, columns)
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            "HeightMap.z: expected lists of numbers, or float64 (base64 text) and shape (rows, columns)."
        ) from error
