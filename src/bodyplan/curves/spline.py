"""A cubic spline through points by its arc length, with a frame that does not roll."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.curves.quadrature import ANTIDERIVATIVE, HALVES, NODES, ORDER, WEIGHTS
from bodyplan.errors import InputError

#: refits of the parameter to the measured arc lengths, and the relative change at which they end
REFITS, SETTLED = 12, 1e-10
#: how well the polynomials of a cell must fit before it is halved once more and kept
FITTED = 2e-14
#: how badly they may fit where rounding of the tangent allows no better
BLURRED = 1e-9
#: smallest cell as a part of its span: below it the curve has a cusp
SMALLEST = 1e-7
#: slowest speed at the end of a cell, as a part of the fastest
SLOWEST = 1e-5


class Jet(NamedTuple):
    """What the curve does at N places."""

    points: Array  # (N, 3)
    rotations: Array  # (N, 3, 3), columns e_r, e_p, e_y
    bend: Array  # (N, 3) curvature vector, 1/m
    bend_slope: Array  # (N, 3) its derivative across the curve, 1/m^2


class ArcLengthSpline:
    """C2 cubic spline (not-a-knot) through ``points`` (M, 3), M >= 4, on 0 <= s <= ``length``.

    Each span is cut into cells that hold polynomials for the arc length and for the roll of the reference frame: the
    tangent at the start of the cell is carried along by the smallest rotation, whose spin about the tangent t is
    a . (t' x t) / (1 + a . t) with a the tangent at the start; rolled back by its integral the frame does not roll.
    """

    def __init__(self, points: Array) -> None:
        knots, self._terms = _fitted(points)
        self._knots = knots
        self._span, self._low, self._high = self._cut()
        speed, tangents, slopes = self._cell_values(self._span, self._low, self._high)
        half = 0.5 * (self._high - self._low)
        # at a knot too the curve may turn back: its speed is 0 there
        ends = np.linalg.norm(
            self._rate(np.repeat(self._span, 2), np.stack([self._low, self._high], 1).ravel()), axis=1
        )
        if ends.min() < SLOWEST * ends.max():
            raise hairpin(int(self._span[np.argmin(ends) // 2]), "has a cusp")
        self._arcs = np.einsum("kn,cn->kc", ANTIDERIVATIVE, speed) * half
        first = tangents[:, 0]
        spin = np.einsum("cj,cnj->cn", first, np.cross(slopes, tangents[:, 1:-1]))
        spin /= 1.0 + np.einsum("cj,cnj->cn", first, tangents[:, 1:-1])
        self._rolls = np.einsum("kn,cn->kc", ANTIDERIVATIVE, spin) * half
        sizes = (WEIGHTS * speed).sum(axis=1) * half
        self._starts = frozen(np.concatenate([[0.0], np.cumsum(sizes)]))
        self.length = float(self._starts[-1])
        turned = (WEIGHTS * np.linalg.norm(slopes, axis=2)).sum(axis=1) * half
        worst = np.bincount(self._span, weights=turned)
        if worst.max() >= np.pi:
            raise hairpin(int(np.argmax(worst)), f"turns by {worst.max():.3g} rad")
        #: arc lengths (M,) of the points
        self.stations = frozen(np.append(self._starts[np.flatnonzero(np.diff(self._span, prepend=-1))], self.length))
        self._frames = _carried(first, tangents[:, -1], (WEIGHTS * spin).sum(axis=1) * half)

    def at(self, s: Array) -> Jet:
        """The jet at s (N,), 0 <= s <= length; at a knot that of the piece behind it."""
        cell, u = self._parameter(s)
        span = self._span[cell]
        x = u[:, None]
        a, b, c, d = (self._terms[k][span] for k in range(4))
        rate, second, third = c + x * (2.0 * b + 3.0 * x * a), 2.0 * b + 6.0 * x * a, 6.0 * a
        speed = np.linalg.norm(rate, axis=1, keepdims=True)
        t = rate / speed
        along = _dot(t, second)
        bend = (second - along * t) / speed**2
        slope = (third - _dot(t, third) * t - 3.0 * along * speed * bend) / speed**3
        low, high = self._low[cell], self._high[cell]
        local = 2.0 * (u - low) / (high - low) - 1.0
        roll = legendre.legval(local, self._rolls[:, cell], tensor=False)
        return Jet(d + x * (c + x * (b + x * a)), _rolled(_moved(self._frames[cell], t), -roll), bend, slope)

    def _parameter(self, s: Array) -> tuple[IntArray, Array]:
        """Cells (N,) and parameters (N,) in their spans of arc lengths s (N,), by Newton's method within the cell."""
        cell = np.clip(np.searchsorted(self._starts, s, side="right") - 1, 0, len(self._span) - 1)
        span, low = self._span[cell], self._low[cell]
        half = 0.5 * (self._high[cell] - low)
        wanted, series = s - self._starts[cell], self._arcs[:, cell]
        x = 2.0 * wanted / (self._starts[cell + 1] - self._starts[cell]) - 1.0
        for _ in range(8):
            gap = legendre.legval(x, series, tensor=False) - wanted
            step = gap / (half * np.linalg.norm(self._rate(span, low + half * (x + 1.0)), axis=1))
            x = np.clip(x - step, -1.0, 1.0)
            if not len(x) or np.max(np.abs(step)) < 1e-15:
                break
        return np.asarray(cell), np.asarray(low + half * (x + 1.0))

    def _rate(self, span: IntArray, u: Array) -> Array:
        """dc/du (..., 3) at parameters u (...,) from the starts of the spans (...,)."""
        x = u[..., None]
        return np.asarray(self._terms[2][span] + x * (2.0 * self._terms[1][span] + 3.0 * x * self._terms[0][span]))

    def _cell_values(self, span: IntArray, low: Array, high: Array) -> tuple[Array, Array, Array]:
        """Speed (C, n) and dt/du (C, n, 3) at the nodes of cells; tangents (C, n + 2, 3), both ends too."""
        x = np.concatenate([[-1.0], NODES, [1.0]])
        u = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * x
        # the ends exactly, so that cells meet
        u[:, 0], u[:, -1] = low, high
        index = np.broadcast_to(span[:, None], u.shape)
        rate = self._rate(index, u)
        speed = np.linalg.norm(rate, axis=-1)
        tangents = rate / np.where(speed > 0.0, speed, 1.0)[..., None]
        inner = tangents[:, 1:-1]
        local = u[:, 1:-1, None]
        second = 2.0 * self._terms[1][span][:, None] + 6.0 * local * self._terms[0][span][:, None]
        slopes = (second - _dot(inner, second) * inner) / np.where(speed > 0.0, speed, 1.0)[:, 1:-1, None]
        return speed[:, 1:-1], tangents, slopes

    def _cut(self) -> tuple[IntArray, Array, Array]:
        """Spans, starts and ends (C,) of cells on which arc length and tangent are polynomials to rounding.

        Parameters are counted from the start of their span: far along a curve, or where points crowd, those from its
        beginning would have too few digits left for cells ever to be good.
        """
        span = np.arange(len(self._knots) - 1)
        sizes = np.diff(self._knots)
        low, high = np.zeros(len(span)), sizes
        third, second, first_order = (np.linalg.norm(terms, axis=1) for terms in self._terms[:3])
        # of dc/du, whose terms cancel where the curve slows down; the tangent there is no better, however small a cell
        rounding = 8.0 * np.finfo(float).eps * (first_order + sizes * (2.0 * second + 3.0 * sizes * third))
        done: list[tuple[IntArray, Array, Array]] = []
        while len(span):
            small = high - low < SMALLEST * sizes[span]
            if small.any():
                raise hairpin(int(span[small][0]), "has a cusp")
            middle = 0.5 * (low + high)
            first, last = np.stack([low, middle], 1).ravel(), np.stack([middle, high], 1).ravel()
            twice = np.repeat(span, 2)
            whole, halves = self._fields(span, low, high), self._fields(twice, first, last)
            both = halves.reshape(-1, 2 * ORDER, 4)
            off = np.abs(np.einsum("mn,cnj->cmj", HALVES, whole) - both).max(axis=(1, 2))
            slow, fast = both[:, :, 0].min(axis=1), both[:, :, 0].max(axis=1)
            blurred = np.minimum(rounding[span] / np.maximum(slow, np.finfo(float).tiny), BLURRED)
            good = off <= np.maximum(FITTED * np.maximum(1.0, fast), blurred)
            kept = np.repeat(good, 2)
            done.append((twice[kept], first[kept], last[kept]))
            span, low, high = twice[~kept], first[~kept], last[~kept]
        spans, lows, highs = (np.concatenate([part[k] for part in done]) for k in range(3))
        order = np.lexsort((lows, spans))
        return spans[order], lows[order], highs[order]

    def _fields(self, span: IntArray, low: Array, high: Array) -> Array:
        """Speed and tangent (C, n, 4) at the nodes of cells."""
        speed, tangents, _ = self._cell_values(span, low, high)
        return np.concatenate([speed[..., None], tangents[:, 1:-1]], axis=-1)


def hairpin(index: int, what: str) -> InputError:
    """The error of a piece that no smooth body follows."""
    return InputError(f"points: the spline {what} between points {index} and {index + 1}; give more points there.")


def _fitted(points: Array) -> tuple[Array, Array]:
    """Knots (M,) close to the arc length and terms (4, M - 1, 3), cubic first, of the spline."""
    from scipy.interpolate import CubicSpline  # loads scipy.optimize

    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    terms = np.asarray(CubicSpline(knots, points, axis=0, bc_type="not-a-knot").c)
    last = np.inf
    for _ in range(REFITS):
        x = 0.5 * np.diff(knots)[:, None] * (NODES + 1.0)
        rate = terms[2][:, None] + x[..., None] * (2.0 * terms[1][:, None] + 3.0 * x[..., None] * terms[0][:, None])
        sizes = (WEIGHTS * np.linalg.norm(rate, axis=2)).sum(axis=1) * 0.5 * np.diff(knots)
        change = np.max(np.abs(sizes / np.diff(knots) - 1.0))
        # rough points: there may be no parameter that is the arc length, the best so far has to do
        if change < SETTLED or change >= last:
            break
        knots, last = np.concatenate([[0.0], np.cumsum(sizes)]), change
        terms = np.asarray(CubicSpline(knots, points, axis=0, bc_type="not-a-knot").c)
    return frozen(knots), frozen(terms)


def _carried(first: Array, last: Array, roll: Array) -> Array:
    """Frames (C, 3, 3) at the starts of cells that do not roll from one to the next.

    ``first``, ``last`` (C, 3): tangents at the ends of the cells; ``roll`` (C,) rad of the smallest rotation. Any
    frames are put at the starts, and the angles between what arrives and what was put there are summed.
    """
    helper = np.eye(3)[np.argmin(np.abs(first), axis=1)]
    # straight up or down: as a level curve would arrive there that pitches by a quarter turn
    helper[0] = (0.0, 0.0, 1.0) if abs(first[0, 2]) < 1.0 - 1e-9 else (-np.sign(first[0, 2]), 0.0, 0.0)
    # e_y as near to the helper as can be
    e_p = np.cross(helper, first)
    e_p /= np.linalg.norm(e_p, axis=1, keepdims=True)
    put = np.stack([first, e_p, np.cross(first, e_p)], axis=-1)
    arrived = _rolled(_moved(put[:-1], last[:-1]), -roll[:-1])[:, :, 1]
    angles = np.arctan2(
        np.sum(arrived * put[1:, :, 2], axis=1),
        np.sum(arrived * put[1:, :, 1], axis=1),
    )
    return frozen(_rolled(put, np.concatenate([[0.0], np.cumsum(angles)])))


def _moved(frames: Array, t: Array) -> Array:
    """Frames (N, 3, 3) carried by the smallest rotation of their e_r to t (N, 3)."""
    a = frames[:, :, 0]
    weight = 1.0 + np.sum(a * t, axis=1, keepdims=True)
    out = np.empty(frames.shape)
    out[:, :, 0] = t
    for k in (1, 2):
        e = frames[:, :, k]
        out[:, :, k] = e - np.sum(e * t, axis=1, keepdims=True) / weight * (a + t)
    return out


def _rolled(frames: Array, angle: Array) -> Array:
    """Frames (N, 3, 3) turned about their e_r by angles (N,)."""
    c, n = np.cos(angle)[:, None], np.sin(angle)[:, None]
    e_p, e_y = frames[:, :, 1], frames[:, :, 2]
    return np.stack([frames[:, :, 0], c * e_p + n * e_y, c * e_y - n * e_p], axis=-1)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1, keepdims=True))
