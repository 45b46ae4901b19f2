"""What kernels of wheels ask of a height map: its height, bounds and sections by the planes of wheels.

A ``plane`` (9,) is that of a wheel: its centre, ahead and up. ``land`` is a :class:`Land`, which kernels ask with
:func:`jet_at`, :func:`bounds_at` and :func:`highest_at` only. What is known of a section is a row of numbers; their
names are columns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.ground.heightmap import HeightMap
from bodyplan.ground.spline_kernel import spline_at, spline_bounds

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

#: columns of a section (:class:`bodyplan.gaits.carry.planes.Section`): first those of the ground's jet
F, GX, GY, HXX, HXY, HYY, W, FIRST, SECOND, STEEP, FOUND, COLUMNS = range(12)
#: columns of bounds: lowest and highest of the height, of the second derivatives, and a bound of the third ones
Z_LOW, Z_HIGH, XX, XY, YY, THIRD, BOUNDS = 0, 1, 2, 4, 6, 8, 9
#: notes of minima kept for one wheel
NOTES = 64
#: how often a box of the ground is cut into four at most, and boxes that wait for it
CUTS = 9
_WAITING = 3 * CUTS + 4
#: cells that a search begins with, at most
_FIRST = 64


def lean(kernel: Kernel) -> Kernel:
    """``njit`` for kernels that make no arrays: they do without Numba's counts of references, which take longer than
    the arithmetic of a short kernel. Assigning an array to a slice makes one."""
    compiled: Any = njit
    return cast(Kernel, compiled(cache=True, nogil=True, error_model="numpy", _nrt=False)(kernel))


class Land(NamedTuple):
    """A height map: ``box`` (4,) lowest x, y and highest x, y of it; the Hermite data ``nodes`` of its spline, the
    ``offsets``, ``widths`` and ``tables`` of its bounds, and ``place`` (5,): sides of a cell dx, dy, x and y of the
    first sample, and the level that heights count from."""

    box: Array
    nodes: Array
    offsets: IntArray
    widths: IntArray
    tables: Array
    place: Array

    @staticmethod
    def of(ground: HeightMap) -> Land:
        """The tables of a height map."""
        spline = ground.spline
        return Land(
            np.ascontiguousarray(ground.field_box, dtype=np.float64).ravel(),
            np.ascontiguousarray(spline.nodes),
            *spline.pyramid,
            np.array([*spline.step, *ground.origin, spline.level], dtype=np.float64),
        )


class Room(NamedTuple):
    """Where kernels work: the spline's ``basis``; sections ``here`` and ``middle``; ``bounds``; ``cells`` (2, n, 3) of
    two levels of the search: ends and W in the middle; minima ``noted``: s and distance; ``waiting`` boxes."""

    basis: Array
    here: Array
    middle: Array
    bounds: Array
    cells: Array
    noted: Array
    waiting: Array

    @staticmethod
    def of(cells: int) -> Room:
        """For up to so many cells a level."""
        return Room(
            np.empty((2, 3, 4)),
            np.empty(COLUMNS),
            np.empty(COLUMNS),
            np.empty(BOUNDS),
            np.empty((2, 2 * cells + _FIRST, 3)),
            np.empty((NOTES, 2)),
            np.empty((_WAITING, 4)),
        )


@lean
def jet_at(land: Land, x: float, y: float, room: Room, out: Array) -> None:
    """Height and derivatives at a place, into ``out`` (6+,)."""
    place = land.place
    spline_at(land.nodes, place[0], place[1], x - place[2], y - place[3], room.basis, out)
    out[F] += place[4]


@lean
def bounds_at(land: Land, x: float, y: float, size_x: float, size_y: float, room: Room) -> bool:
    """Bounds over the box (x, y) +- size, into ``room.bounds``; False where the box goes beyond the ground's edge."""
    place, box, out = land.place, land.box, room.bounds
    low_x, low_y, high_x, high_y = x - size_x, y - size_y, x + size_x, y + size_y
    spline_bounds(
        land.nodes.shape[:2], place[0], place[1], land.offsets, land.widths, land.tables,
        low_x - place[2], low_y - place[3], high_x - place[2], high_y - place[3], out,
    )  # fmt: skip
    out[Z_LOW] += place[4]
    out[Z_HIGH] += place[4]
    return bool(low_x >= box[0] and low_y >= box[1] and high_x <= box[2] and high_y <= box[3])


@lean
def highest_at(land: Land, x: float, y: float, size_x: float, size_y: float) -> float:
    """A bound of the height over the box (x, y) +- size, inf where the box goes beyond the ground's edge: that of
    :func:`bounds_at` alone."""
    place, box = land.place, land.box
    low_x, low_y, high_x, high_y = x - size_x, y - size_y, x + size_x, y + size_y
    if not (low_x >= box[0] and low_y >= box[1] and high_x <= box[2] and high_y <= box[3]):
        return np.inf
    last_x, last_y = land.nodes.shape[1] - 2, land.nodes.shape[0] - 2
    # within the box these are not negative but for rounding
    ax = min(max(int((low_x - place[2]) / place[0] - 1e-9), 0), last_x)
    ay = min(max(int((low_y - place[3]) / place[1] - 1e-9), 0), last_y)
    bx = min(int((high_x - place[2]) / place[0] + 1e-9), last_x)
    by = min(int((high_y - place[3]) / place[1] + 1e-9), last_y)
    # the level on which the box meets at most two blocks along each axis
    span, level = max(bx - ax, by - ay), 0
    while (1 << level) < span:
        level += 1
    ax, ay, bx, by = ax >> level, ay >> level, bx >> level, by >> level
    start, width, table = land.offsets[level], land.widths[level], land.tables[Z_HIGH]
    lower, upper = start + ay * width, start + by * width
    lowest = min(min(table[lower + ax], table[lower + bx]), min(table[upper + ax], table[upper + bx]))
    return float(place[4] - lowest)


@lean
def upright(plane: Array) -> bool:
    """Whether the plane is upright: its section is the height along a line."""
    return bool(plane[6] == 0.0 and plane[7] == 0.0)


@lean
def farthest(plane: Array) -> float:
    """Largest coordinate of the centre, m."""
    return float(max(abs(plane[0]), abs(plane[1]), abs(plane[2])))


@lean
def section_at(land: Land, plane: Array, s: float, guess: float, close: float, room: Room, out: Array) -> None:
    """The ground curve of one plane at ``s`` into ``out`` (COLUMNS,), by Newton in w from ``guess`` until a step is
    ``close``; see :func:`bodyplan.gaits.carry.planes.section`."""
    vertical = upright(plane)
    w, n, step = 0.0 if vertical else guess, 0.0, 0.0
    for _ in range(40):
        x = plane[0] + s * plane[3] + w * plane[6]
        y = plane[1] + s * plane[4] + w * plane[7]
        jet_at(land, x, y, room, out)
        n = plane[8] - (out[GX] * plane[6] + out[GY] * plane[7])
        step = (out[F] - (plane[2] + s * plane[5] + w * plane[8])) / n
        w += step
        if vertical or not abs(step) > close:
            break
    first = (out[GX] * plane[3] + out[GY] * plane[4]) / n
    ax, ay = plane[3] + first * plane[6], plane[4] + first * plane[7]
    out[W], out[FIRST], out[STEEP] = w, first, n
    out[SECOND] = (ax * ax * out[HXX] + 2.0 * ax * ay * out[HXY] + ay * ay * out[HYY]) / n
    found = vertical or (n > 0.0 and abs(step) <= 1e3 * close + 1e-9 * abs(w))
    out[FOUND] = 1.0 if found and math.isfinite(w) else 0.0


@lean
def foot_at(land: Land, plane: Array, s: float, room: Room, out: Array) -> None:
    """The same to rounding, from nowhere."""
    section_at(land, plane, s, 0.0, 1e-15 * (1.0 + farthest(plane)), room, out)
