"""The C2 bicubic spline through heights on a grid, and bounds of it over boxes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.ground.nearest import Bounds

#: Hermite data of one cell side (value and slope at 0, value and slope at 1) -> Bezier control values
_TO_BEZIER = np.array(
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0 / 3.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0 / 3.0], [0.0, 0.0, 1.0, 0.0]]
)


#: 3! / (3 - k)!: the factor that the k-th derivative of a cubic brings to differences of control values
_FALLING = (1.0, 3.0, 6.0, 6.0)


class BicubicSpline:
    """The tensor product of not-a-knot cubic splines through ``z`` (ny, nx); samples ``step`` (dx, dy) apart.

    In each cell it is bicubic, given by value, slopes and mixed derivative at the four corners; it
    interpolates, is twice continuously differentiable, and reproduces bicubic polynomials.
    With 3 samples along an axis it is a parabola along it, with 2 a line.
    """

    def __init__(self, z: Array, step: Array) -> None:
        # rounding in second derivatives grows with the level, which they do not depend on
        self.level = float(z.mean())
        self.step = step
        values = z - self.level
        slopes_x = _slopes(values, 1)
        # (ny, nx, order in y, order in x), derivatives with respect to cell lengths
        self.nodes: Array = np.stack(
            [
                np.stack([values, slopes_x], axis=-1),
                np.stack([_slopes(values, 0), _slopes(slopes_x, 0)], axis=-1),
            ],
            axis=-2,
        )

    def jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Value (n,), gradient (n, 2) and Hessian (n, 2, 2) at x, y (n,); edge cells continue outwards."""
        from bodyplan.ground.spline_kernel import spline_jet

        n = len(x)
        value, gradient, hessian = np.empty(n), np.empty((n, 2)), np.empty((n, 2, 2))
        at_x, at_y = (np.ascontiguousarray(v, dtype=np.float64) for v in (x, y))
        dx, dy = (float(v) for v in self.step)
        spline_jet(self.nodes, dx, dy, at_x, at_y, value, gradient, hessian)
        return value + self.level, gradient, hessian

    def value(self, x: Array, y: Array) -> Array:
        """Value (n,) at x, y (n,); that of :meth:`jet`, for less."""
        from bodyplan.ground.spline_kernel import spline_values

        value = np.empty(len(x))
        at_x, at_y = (np.ascontiguousarray(v, dtype=np.float64) for v in (x, y))
        spline_values(self.nodes, float(self.step[0]), float(self.step[1]), self.level, at_x, at_y, value)
        return value

    def hessian_rate(self, x: Array, y: Array, vx: Array, vy: Array) -> Array:
        """Rate (n, 2, 2) of the Hessian at x, y (n,) for points that move by vx, vy (n,) a unit of time; third
        derivatives jump between cells, those of the cell at hand count."""
        u, v, cells = self._at(x, y)
        across = np.concatenate([_hermite(v), np.broadcast_to(_THIRD, (len(v), 1, 4))], axis=1)
        along = np.concatenate([_hermite(u), np.broadcast_to(_THIRD, (len(u), 1, 4))], axis=1)
        d = across @ cells @ np.swapaxes(along, -1, -2)
        dx, dy = self.step
        xxx, xxy, xyy, yyy = (
            d[:, 0, 3] / dx**3,
            d[:, 1, 2] / (dx**2 * dy),
            d[:, 2, 1] / (dx * dy**2),
            d[:, 3, 0] / dy**3,
        )
        mixed = xxy * vx + xyy * vy
        return np.stack([xxx * vx + xxy * vy, mixed, mixed, xyy * vx + yyy * vy], axis=-1).reshape(-1, 2, 2)

    def _at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Places (n,) within cells, in cell lengths, and the Hermite data (n, 4, 4) of the cells."""
        ny, nx = self.nodes.shape[:2]
        u, v = x / self.step[0], y / self.step[1]
        i = np.clip(np.floor(u), 0, nx - 2).astype(np.int64)
        j = np.clip(np.floor(v), 0, ny - 2).astype(np.int64)
        return u - i, v - j, self._cells(j, i)

    def bounds(self, low: Array, high: Array) -> Bounds:
        """Bounds over boxes with corners (n, 2): those of the control values of the cells around them."""
        offsets, widths, tables = self._pyramid
        last = np.array(self.nodes.shape[1::-1]) - 2
        a = np.clip(np.floor(low / self.step - 1e-9), 0, last).astype(np.int64)
        b = np.clip(np.floor(high / self.step + 1e-9), 0, last).astype(np.int64)
        # the level on which the box meets at most two blocks along each axis
        span = (b - a).max(axis=1, initial=0)
        level = np.ceil(np.log2(np.maximum(span, 1))).astype(np.int64)
        a, b = a >> level[:, None], b >> level[:, None]
        blocks = [offsets[level] + y * widths[level] + x for y in (a[:, 1], b[:, 1]) for x in (a[:, 0], b[:, 0])]
        lowest = np.minimum.reduce([tables[:, block] for block in blocks])
        z, xx, xy, yy = (np.stack([lowest[k], -lowest[k + 1]]) for k in (0, 2, 4, 6))
        hessian = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
        return Bounds(z + self.level, hessian, -lowest[8])

    def _cells(self, j: IntArray, i: IntArray) -> Array:
        """Hermite data (n, 4, 4) of cells, rows in y, columns in x: along each axis value and slope at the
        lower end, then at the upper end."""
        corners = self.nodes[(j[:, None] + [0, 1])[:, :, None], (i[:, None] + [0, 1])[:, None, :]]
        return np.asarray(np.swapaxes(corners, 2, 3).reshape(-1, 4, 4))

    @property
    def pyramid(self) -> tuple[IntArray, IntArray, Array]:
        """Bounds of blocks of cells, for kernels: see :func:`bodyplan.ground.spline_kernel.spline_bounds`."""
        return self._pyramid

    @cached_property
    def _pyramid(self) -> tuple[IntArray, IntArray, Array]:
        """The tables of the cells, then of blocks of 2 x 2, 4 x 4, ... cells, by minima.

        Returns the offset and the row width of each level in the flat tables (9, n).
        """
        levels = [self._cell_tables()]
        while levels[-1].shape[1] > 1 or levels[-1].shape[2] > 1:
            table = levels[-1]
            pad = [(0, 0), (0, table.shape[1] % 2), (0, table.shape[2] % 2)]
            table = np.pad(table, pad, constant_values=np.inf)
            levels.append(np.minimum.reduce([table[:, p::2, q::2] for p in (0, 1) for q in (0, 1)]))
        sizes = [t.shape[1] * t.shape[2] for t in levels]
        offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
        widths = np.array([t.shape[2] for t in levels], dtype=np.int64)
        return offsets, widths, np.concatenate([t.reshape(9, -1) for t in levels], axis=1)

    def _cell_tables(self) -> Array:
        """Of every cell (9, ny - 1, nx - 1): lowest and -highest of f, f_xx, f_xy, f_yy, and minus a bound of
        the third derivatives. They come from Bezier control values; those of a derivative are differences of
        those of f."""
        ny, nx = self.nodes.shape[:2]
        dx, dy = self.step
        out = np.empty((9, ny - 1, nx - 1))
        for row in range(ny - 1):
            net = _TO_BEZIER @ self._cells(np.full(nx - 1, row), np.arange(nx - 1)) @ _TO_BEZIER.T

            def control(in_x: int, in_y: int, net: Array = net) -> Array:
                factor = _FALLING[in_x] * _FALLING[in_y] / (dx**in_x * dy**in_y)
                return np.asarray(factor * np.diff(np.diff(net, n=in_x, axis=2), n=in_y, axis=1))

            for k, orders in enumerate([(0, 0), (2, 0), (1, 1), (0, 2)]):
                values = control(*orders)
                slack = 1e-11 * np.abs(values).max(axis=(1, 2))
                out[2 * k, row] = values.min(axis=(1, 2)) - slack
                out[2 * k + 1, row] = -(values.max(axis=(1, 2)) + slack)
            third = [np.abs(control(*o)).max(axis=(1, 2)) for o in ((3, 0), (2, 1), (1, 2), (0, 3))]
            weighted = [third[0], np.sqrt(3.0) * third[1], np.sqrt(3.0) * third[2], third[3]]
            out[8, row] = -(1.0 + 1e-11) * np.sqrt(np.sum(np.square(weighted), axis=0))
        return out


#: third derivatives of the Hermite basis of :func:`_hermite`
_THIRD = np.array([12.0, 6.0, -12.0, 6.0])


def _slopes(values: Array, axis: int) -> Array:
    """Slopes at the samples of the not-a-knot cubic splines along ``axis``, for unit spacing."""
    from scipy.interpolate import CubicSpline

    where = np.arange(values.shape[axis], dtype=np.float64)
    return np.asarray(CubicSpline(where, values, axis=axis, bc_type="not-a-knot")(where, 1))


def _weights(t: Array) -> Array:
    """Hermite basis (value, slope at 0; value, slope at 1) at t (n,): (n, 4)."""
    r = 1.0 - t
    return np.stack([(1.0 + 2.0 * t) * r * r, t * r * r, t * t * (3.0 - 2.0 * t), -t * t * r], axis=1)


def _hermite(t: Array) -> Array:
    """Hermite basis (value, slope at 0; value, slope at 1) with two derivatives at t (n,): (n, 3, 4)."""
    r = 1.0 - t
    out = np.empty((len(t), 3, 4))
    out[:, 0] = _weights(t)
    out[:, 1] = np.stack([-6.0 * t * r, r * (1.0 - 3.0 * t), 6.0 * t * r, t * (3.0 * t - 2.0)], axis=1)
    out[:, 2] = np.stack([12.0 * t - 6.0, 6.0 * t - 4.0, 6.0 - 12.0 * t, 6.0 * t - 2.0], axis=1)
    return out
