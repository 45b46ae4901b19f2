"""A curve as a table of quintics: its points anywhere on a stretch, to rounding, without asking the curve again.

Cells are halved until one Lie-group step (:mod:`bodyplan.spatial.frames`) and two half steps agree, and the quintic
through position, tangent and curvature at both ends meets the middle. What is kept are the halves: 64 times better.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import SolveError, Status
from bodyplan.spatial import compose
from bodyplan.spatial.frames import GAUSS_NODES, accumulate, increments
from bodyplan.spatial.poses import IDENTITY

_NODES = np.array(GAUSS_NODES)
#: cells of a body length before any is halved
FIRST_CELLS = 96
#: m a m that a cell may differ from its halves, which are 64 times better; and what is rounding, of the body length
TOLERANCE, ROUNDING = 3e-11, 2e-15
MAX_CELLS = 500_000


@dataclass(frozen=True)
class DenseCurve:
    """``ends`` (M + 1,) m: ends of cells, ascending. ``poses`` (M + 1, 7) there, seen from that at ``ends[0]``.
    ``cells`` (M, 18): coefficients of powers of the share of the cell, three a power. ``error`` m: what the
    checks leave, for all points together. ``curve``: what it was made of (tau = 0)."""

    curve: BodyCurve
    ends: Array
    poses: Array
    cells: Array
    error: float

    def pose(self, s: Array) -> Array:
        """Poses (N, 7) at s (N,) m."""
        cell = self._cell(s)
        return compose(self.poses[cell], _steps(self.curve, self.ends[cell], s))

    def points(self, s: Array) -> Array:
        """Points (..., 3) at s (...,) m."""
        cell = self._cell(s)
        u = (s - self.ends[cell]) / (self.ends[cell + 1] - self.ends[cell])
        out = np.zeros((*s.shape, 3))
        for power in range(5, -1, -1):
            out = out * u[..., None] + self.cells[cell, 3 * power : 3 * power + 3]
        return out

    def _cell(self, s: Array) -> IntArray:
        return np.clip(np.searchsorted(self.ends, s, side="right") - 1, 0, len(self.cells) - 1)


def dense_curve(curve: BodyCurve, low: float, high: float, body: float) -> DenseCurve:
    """``curve`` (tau = 0) on [low, high] m, with cells that end at its breaks; ``body`` m is the length that the
    tolerance refers to. Raises SolveError for a curve that is too rough."""
    breaks = curve.breaks
    stops = np.concatenate([[low, high], breaks])
    stops = np.unique(stops[(low <= stops) & (stops <= high)])
    count = np.maximum(1, np.ceil(np.diff(stops) * (FIRST_CELLS / body) - 1e-9)).astype(np.int64)
    part = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)) / np.repeat(count, count)
    start = np.repeat(stops[:-1], count) + part * np.repeat(np.diff(stops), count)
    end = np.append(start[1:], high)
    whole = _steps(curve, start, end)
    done: list[tuple[Array, Array, Array]] = []
    error, cells, blurred = 0.0, len(start), TOLERANCE
    while len(start):
        middle = start + 0.5 * (end - start)
        edges = np.stack([start, middle, end], axis=1)
        first, last = edges[:, :2].ravel(), edges[:, 1:].ravel()
        halves = _steps(curve, first, last)
        bends = _bends_at_ends(curve, edges, breaks)
        off = np.empty(len(start))
        _differences(whole, halves, bends, end - start, body, off)
        h = end - start
        if not done:
            # far from 0 the places are rounded, and the curvature there with them
            slope = float((np.abs(bends[:, 1] - bends[:, 0]).max(axis=1) / np.repeat(0.5 * h, 2)).max())
            blurred = TOLERANCE + 4.0 * np.spacing(max(abs(low), abs(high))) * slope * body
        good = (off <= np.maximum(blurred * h, ROUNDING * body)) | (middle <= start) | (middle >= end)
        both = np.repeat(good, 2)
        done.append((first[both], halves[both], bends[both]))
        error += float(off[good].sum()) / 32.0
        start, end, whole = first[~both], last[~both], halves[~both]
        cells += len(start)
        if cells > MAX_CELLS:
            reason = f"more than {MAX_CELLS} cells along the curve: it bends too much on the length of a body"
            raise SolveError(Status.NOT_CONVERGED, reason)
    starts, steps, shapes = (np.concatenate(parts) for parts in zip(*done, strict=True))
    order = np.argsort(starts, kind="stable")
    at = np.append(starts[order], high)
    poses, table = np.empty((len(at), 7)), np.empty((len(starts), 18))
    accumulate(np.array(IDENTITY), steps[order], poses)
    _quintics(poses, shapes[order], np.diff(at), table)
    return DenseCurve(curve, at, poses, table, error)


def _steps(curve: BodyCurve, start: Array, end: Array) -> Array:
    """Displacements (M, 7) from ``start`` to ``end`` (M,)."""
    h = end - start
    places = (start[:, None] + h[:, None] * _NODES).ravel()
    out = np.empty((len(h), 7))
    increments(np.ascontiguousarray(np.stack(curve.shape(places), axis=-1)), 0, h, out)
    return out


def _bends_at_ends(curve: BodyCurve, edges: Array, breaks: Array) -> Array:
    """(kappa_p, kappa_y) at both ends of the half cells between ``edges`` (M, 3): (2 M, 2, 2)."""
    places = edges.copy()
    # at a jump the value within the cell counts
    for side, inward in ((0, np.inf), (2, -np.inf)):
        at_break = np.isin(edges[:, side], breaks)
        places[at_break, side] = np.nextafter(edges[at_break, side], inward)
    shape = curve.shape(places)
    bends = np.stack([shape[1], shape[2]], axis=-1)
    return np.ascontiguousarray(np.stack([bends[:, :2], bends[:, 1:]], axis=1).reshape(-1, 2, 2))


# --- kernels --------------------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _turned(pose: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The vector (x, y, z) of the frame ``pose`` (7,)."""
    w, a, b, c = pose[3], pose[4], pose[5], pose[6]
    t, u, v = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return x + w * t + b * v - c * u, y + w * u + c * t - a * v, z + w * v + a * u - b * t


@njit(cache=True, nogil=True, error_model="numpy")
def _differences(whole: Array, halves: Array, bends: Array, h: Array, body: float, off: Array) -> None:
    """How far cells (M,) are from their halves (2 M,): position + ``body`` x rotation of the end, and the quintic of
    the cell in its middle."""
    pair, both = np.empty((2, 7)), np.empty((3, 7))
    start = np.zeros(7)
    start[3] = 1.0
    for m in range(len(h)):
        pair[0], pair[1] = halves[2 * m], halves[2 * m + 1]
        accumulate(start, pair, both)
        end = both[2]
        p = q = r = 0.0
        for i in range(3):
            p += (end[i] - whole[m, i]) ** 2
        for i in range(3, 7):
            q += (end[i] - whole[m, i]) ** 2
            r += (end[i] + whole[m, i]) ** 2
        tangent = _turned(end, 1.0, 0.0, 0.0)
        bend = _turned(end, 0.0, bends[2 * m + 1, 1, 1], -bends[2 * m + 1, 1, 0])
        first = (1.0, 0.0, 0.0)
        begin = (0.0, bends[2 * m, 0, 1], -bends[2 * m, 0, 0])
        c, d = h[m] * 5.0 / 32.0, h[m] * h[m] / 64.0
        gap = 0.0
        for i in range(3):
            gap += (0.5 * end[i] + c * (first[i] - tangent[i]) + d * (begin[i] + bend[i]) - both[1, i]) ** 2
        off[m] = math.sqrt(p) + 2.0 * body * math.sqrt(min(q, r)) + math.sqrt(gap)


@njit(cache=True, nogil=True, error_model="numpy")
def _quintics(poses: Array, bends: Array, h: Array, cells: Array) -> None:
    """Coefficients (M, 18) of the quintics through position, tangent and curvature at both ends of cells."""
    for m in range(len(h)):
        a, b = poses[m], poses[m + 1]
        t0, t1 = _turned(a, 1.0, 0.0, 0.0), _turned(b, 1.0, 0.0, 0.0)
        k0 = _turned(a, 0.0, bends[m, 0, 1], -bends[m, 0, 0])
        k1 = _turned(b, 0.0, bends[m, 1, 1], -bends[m, 1, 0])
        for i in range(3):
            c1, c2 = h[m] * t0[i], 0.5 * h[m] * h[m] * k0[i]
            d = b[i] - a[i] - c1 - c2
            e = h[m] * t1[i] - c1 - 2.0 * c2
            f = h[m] * h[m] * k1[i] - 2.0 * c2
            cells[m, i], cells[m, 3 + i], cells[m, 6 + i] = a[i], c1, c2
            cells[m, 9 + i] = 10.0 * d - 4.0 * e + 0.5 * f
            cells[m, 12 + i] = -15.0 * d + 7.0 * e - f
            cells[m, 15 + i] = 6.0 * d - 3.0 * e + 0.5 * f
