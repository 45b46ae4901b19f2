"""What kernels of wheels ask of a height map or a formula: its height, bounds and sections by the planes of wheels.

A ``plane`` (9,) is that of a wheel: its centre, ahead and up. ``land`` is the ground, which kernels ask with
:func:`jet_at`, :func:`bounds_at` and :func:`highest_at` only. What is known of a section is a row of numbers; their
names are columns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.expressions.tape_kernel import tape_range, tape_slopes
from bodyplan.ground import field_kernel
from bodyplan.ground.field_kernel import BOUNDS, GX, GY, HXX, HXY, HYY, JET, Z_HIGH, F, FieldArrays, jet_at
from bodyplan.ground.spline_kernel import blocks_over
from bodyplan.kernels import lean

#: columns of a section (:class:`bodyplan.gaits.carry.planes.Section`), after those of the ground's jet
W, FIRST, SECOND, STEEP, FOUND, COLUMNS = range(JET, JET + 6)
#: notes of minima kept for one wheel
NOTES = 64
#: how often a box of the ground is cut into four at most, and boxes that wait for it
CUTS = 9
_WAITING = 3 * CUTS + 4
#: cells that a search begins with, at most
_FIRST = 64


class Room(NamedTuple):
    """Where kernels work: the spline's ``basis``; registers of a formula's programs; sections ``here`` and ``middle``;
    ``bounds``; ``cells`` (2, n, 3) of two levels of the search: ends and W in the middle; minima ``noted``: s and
    distance; ``waiting`` boxes."""

    basis: Array
    jet_registers: Array
    bounds_registers: Array
    span_registers: Array
    here: Array
    middle: Array
    bounds: Array
    cells: Array
    noted: Array
    waiting: Array

    @staticmethod
    def of(land: FieldArrays, cells: int) -> Room:
        """For up to so many cells a level."""
        return Room(
            np.empty((2, 3, 4)),
            land.jet.registers.copy(),
            land.bounds.registers.copy(),
            land.span.registers.copy(),
            np.empty(COLUMNS),
            np.empty(COLUMNS),
            np.empty(BOUNDS),
            np.empty((2, 2 * cells + _FIRST, 3)),
            np.empty((NOTES, 2)),
            np.empty((_WAITING, 4)),
        )


@lean
def bounds_at(land: FieldArrays, x: float, y: float, size_x: float, size_y: float, room: Room) -> None:
    """Bounds over the box (x, y) +- size, into ``room.bounds``."""
    field_kernel.bounds_at(land, x - size_x, y - size_y, x + size_x, y + size_y, room)


@lean
def steepest_at(land: FieldArrays, way_x: float, way_y: float, room: Room) -> float:
    """A bound of the slope times a way over the box of the last :func:`bounds_at`, besides that of second derivatives:
    a formula knows one, inf elsewhere."""
    if not land.formula:
        return np.inf
    low_x, high_x, low_y, high_y = tape_slopes(land.bounds, room.bounds_registers)
    return max(low_x * way_x, high_x * way_x) + max(low_y * way_y, high_y * way_y)


@lean
def highest_at(land: FieldArrays, x: float, y: float, size_x: float, size_y: float, room: Room) -> float:
    """A bound of the height over the box (x, y) +- size, inf where the box goes beyond the ground's edge: that of
    :func:`bounds_at` alone."""
    box = land.box
    low_x, low_y, high_x, high_y = x - size_x, y - size_y, x + size_x, y + size_y
    if not (low_x >= box[0, 0] and low_y >= box[0, 1] and high_x <= box[1, 0] and high_y <= box[1, 1]):
        return np.inf
    if land.formula:
        return tape_range(land.span, low_x, low_y, high_x, high_y, room.span_registers)[1]
    it, place, table = land.spline, land.spline.place, land.spline.tables[Z_HIGH]
    a, b, c, d = low_x - place[2], low_y - place[3], high_x - place[2], high_y - place[3]
    one, two, three, four = blocks_over(it.nodes.shape[:2], place[0], place[1], it.offsets, it.widths, a, b, c, d)
    lowest = min(min(table[one], table[two]), min(table[three], table[four]))
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
def section_at(land: FieldArrays, plane: Array, s: float, guess: float, close: float, room: Room, out: Array) -> None:
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
def foot_at(land: FieldArrays, plane: Array, s: float, room: Room, out: Array) -> None:
    """The same to rounding, from nowhere."""
    section_at(land, plane, s, 0.0, 1e-15 * (1.0 + farthest(plane)), room, out)
