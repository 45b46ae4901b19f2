"""A field as kernels see it: arrays, and one place or one box at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.expressions import Expression
from bodyplan.expressions.compiled import INSIDE, Tape
from bodyplan.expressions.tape_kernel import tape_bounds, tape_jet, tape_range
from bodyplan.ground.spline import BicubicSpline
from bodyplan.ground.spline_kernel import spline_at, spline_bounds
from bodyplan.kernels import lean

#: columns of a jet: value, first and second derivatives
F, GX, GY, HXX, HXY, HYY, JET = range(7)
#: columns of bounds: lowest and highest of the value, of the second derivatives, and a bound of the third ones
Z_LOW, Z_HIGH, XX, XY, YY, THIRD, BOUNDS = 0, 1, 2, 4, 6, 8, 9
#: columns of a box that the search keeps: corners, lower bound of the distance, whether half its square is convex
LOW_X, LOW_Y, HIGH_X, HIGH_Y, LEAST, CONVEX, BOX = range(7)


class SplineArrays(NamedTuple):
    """The Hermite data ``nodes`` of a spline, the ``offsets``, ``widths`` and ``tables`` of its bounds, and ``place``
    (5,): sides of a cell dx, dy, x and y of the first sample, and the level that heights count from."""

    nodes: Array
    offsets: IntArray
    widths: IntArray
    tables: Array
    place: Array


class Creases(NamedTuple):
    """Formulas whose zeros are creases, as programs one after another: ``code`` and ``registers``, of which
    ``starts`` (k + 1, 2) tells the first row; ``outputs`` (k, 7)."""

    code: IntArray
    outputs: IntArray
    registers: Array
    starts: IntArray


class FieldArrays(NamedTuple):
    """A field, on ``box`` (2, 2) (:attr:`bodyplan.ground.field.Field.field_box`): a ``spline``, or a ``formula`` with
    programs of its ``jet``, of its ``bounds``, of those of the value alone (``span``), and of its ``creases``. One
    kernel serves both kinds; what a field has not is empty."""

    formula: bool
    box: Array
    spline: SplineArrays
    jet: Tape
    bounds: Tape
    span: Tape
    creases: Creases


class Asking(Protocol):
    """What a kernel's room must have to ask a field: the spline's ``basis`` (2, 3, 4), ``bounds`` (BOUNDS,) and
    registers of programs."""

    @property
    def basis(self) -> Array: ...

    @property
    def bounds(self) -> Array: ...

    @property
    def jet_registers(self) -> Array: ...

    @property
    def bounds_registers(self) -> Array: ...


class Room(NamedTuple):
    """Where kernels work: jets (JET,) ``here``, at a ``trial`` and of a ``crease``; ``bounds`` (BOUNDS,); the spline's
    ``basis`` (2, 3, 4); registers of programs; a ``place`` (2,); ``boxes`` (2, n, BOX) of two levels of the search, and
    ``sizes`` (n,) to sort."""

    here: Array
    trial: Array
    crease: Array
    bounds: Array
    basis: Array
    jet_registers: Array
    bounds_registers: Array
    span_registers: Array
    crease_registers: Array
    place: Array
    boxes: Array
    sizes: Array

    @staticmethod
    def of(field: FieldArrays, boxes: int) -> Room:
        """For up to so many boxes a level."""
        return Room(
            np.empty(JET),
            np.empty(JET),
            np.empty(JET),
            np.empty(BOUNDS),
            np.empty((2, 3, 4)),
            field.jet.registers.copy(),
            field.bounds.registers.copy(),
            field.span.registers.copy(),
            field.creases.registers.copy(),
            np.empty(2),
            np.empty((2, boxes, BOX)),
            np.empty(boxes),
        )


def spline_field(box: Array, spline: BicubicSpline, origin: Sequence[float]) -> FieldArrays:
    """A spline whose first sample is at ``origin``."""
    place = np.array([*spline.step, *origin, spline.level], dtype=np.float64)
    arrays = SplineArrays(np.ascontiguousarray(spline.nodes), *spline.pyramid, place)
    return FieldArrays(False, box, arrays, _tape(()), _tape((2,)), _tape((2,)), _joined(()))


def formula_field(box: Array, formula: Expression) -> FieldArrays:
    """A formula of x and y."""
    none = np.zeros(0, dtype=np.int64)
    spline = SplineArrays(np.zeros((0, 0, 2, 2)), none, none, np.zeros((9, 0)), np.zeros(5))
    creases = _joined([kink.jet_tape for kink in formula.kinks])
    return FieldArrays(True, box, spline, formula.jet_tape, formula.bounds_tape, formula.range_tape, creases)


def _tape(width: tuple[int, ...]) -> Tape:
    """An empty program."""
    return Tape(np.zeros((0, 5), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, *width)))


def _joined(tapes: Sequence[Tape]) -> Creases:
    sizes = np.array([(len(tape.code), len(tape.registers)) for tape in tapes], dtype=np.int64).reshape(-1, 2)
    starts = np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(sizes, axis=0)])
    empty = _tape(())
    return Creases(
        np.concatenate([empty.code, *(tape.code for tape in tapes)]),
        np.array([tape.outputs for tape in tapes], dtype=np.int64).reshape(-1, 7),
        np.concatenate([empty.registers, *(tape.registers for tape in tapes)]),
        starts,
    )


@lean
def jet_at(field: FieldArrays, x: float, y: float, room: Asking, out: Array) -> None:
    """Value and derivatives at a place into ``out`` (JET,); value nan where the ground is undefined."""
    if field.formula:
        tape_jet(field.jet, x, y, room.jet_registers, out)
        return
    place = field.spline.place
    spline_at(field.spline.nodes, place[0], place[1], x - place[2], y - place[3], room.basis, out)
    out[F] += place[4]


@lean
def bounds_at(field: FieldArrays, low_x: float, low_y: float, high_x: float, high_y: float, room: Asking) -> None:
    """Bounds over a box into ``room.bounds``."""
    out = room.bounds
    if field.formula:
        tape_bounds(field.bounds, low_x, low_y, high_x, high_y, room.bounds_registers, out)
        return
    it, place = field.spline, field.spline.place
    a, b, c, d = low_x - place[2], low_y - place[3], high_x - place[2], high_y - place[3]
    spline_bounds(it.nodes.shape[:2], place[0], place[1], it.offsets, it.widths, it.tables, a, b, c, d, out)
    out[Z_LOW] += place[4]
    out[Z_HIGH] += place[4]


@lean
def top_over(field: FieldArrays, low_x: float, low_y: float, high_x: float, high_y: float, room: Room) -> float:
    """No ground over a box is higher than this; infinite unless the ground is known to be defined on all of it."""
    if not field.formula:
        bounds_at(field, low_x, low_y, high_x, high_y, room)
        return float(room.bounds[Z_HIGH])
    tape, registers = field.span, room.span_registers
    _, top = tape_range(tape, low_x, low_y, high_x, high_y, registers)
    first = len(registers) - len(tape.code)
    for k in range(len(tape.code)):
        if not (np.isfinite(registers[first + k, 0]) and np.isfinite(registers[first + k, 1])):
            return np.inf
        if tape.code[k, 0] == INSIDE:  # roots, logarithms: within their domain, rounding apart
            it, low, high = tape.code[k, 1], tape.code[k, 2], tape.code[k, 3]
            slack = 1e-9 * max(abs(registers[it, 0]), abs(registers[it, 1]))
            if not (registers[it, 0] > registers[low, 0] + slack and registers[it, 1] < registers[high, 0] - slack):
                return np.inf
    return top


@lean
def crease_at(field: FieldArrays, k: int, x: float, y: float, room: Room) -> None:
    """Value and derivatives of the k-th crease's formula into ``room.crease``."""
    them = field.creases
    a, b = them.starts[k, 1], them.starts[k + 1, 1]
    tape = Tape(them.code[them.starts[k, 0] : them.starts[k + 1, 0]], them.outputs[k], them.registers[a:b])
    tape_jet(tape, x, y, room.crease_registers[a:b], room.crease)
