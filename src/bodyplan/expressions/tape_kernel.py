"""The interpreter of a formula's programs (:mod:`bodyplan.expressions.compiled`), at one place or at many.

Other kernels call :func:`tape_jet`, :func:`tape_bounds` and :func:`tape_range`, one place or box at a time;
:class:`bodyplan.expressions.Expression` takes all of its places at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.expressions.compiled import (
    ADD,
    ARCCOS,
    ARCSIN,
    ARCTAN,
    ARCTAN2,
    BEND,
    COS,
    COSH,
    CUT,
    DIV,
    EXP,
    INSIDE,
    LOG,
    MUL,
    NEG,
    ORDER,
    PICK,
    PICK_ROUGH,
    POWER,
    SIN,
    SINH,
    SQRT,
    SQUARE,
    STEP,
    SUB,
    TAN,
    TANH,
    Tape,
)
from bodyplan.kernels import lean

#: more than the number of any node
_NONE = 1 << 30


@lean
def tape_jet(tape: Tape, x: float, y: float, room: Array, out: Array) -> None:
    """Of a formula of x and y at one place: value, slopes along x and y, second derivatives xx, xy, yy into ``out``
    (6+,); the value is nan where the formula is undefined or the place not finite. ``tape``: of
    :func:`bodyplan.expressions.compiled.jet_program`; ``room``: a copy of its registers to work in."""
    if not (np.isfinite(x) and np.isfinite(y)):
        for k in range(6):
            out[k] = np.nan
        return
    room[0], room[1] = x, y
    undefined = run_numbers(tape.code, room) != _NONE
    for k in range(5):
        out[k] = room[tape.outputs[k]]
    out[5] = room[tape.outputs[6]]
    if undefined:
        out[0] = np.nan


@lean
def tape_bounds(tape: Tape, low_x: float, low_y: float, high_x: float, high_y: float, room: Array, out: Array) -> None:
    """Of a formula of x and y over one box, as :meth:`bodyplan.expressions.Expression.enclosure`: lowest and highest
    value, second derivatives xx, xy, yy, and inf (nothing is known of third ones) into ``out`` (9,), or slopes along x
    and y, too, into ``out`` (13,). ``tape``: of :func:`bodyplan.expressions.compiled.bounds_program`, with derivatives;
    ``room``: a copy of its registers to work in."""
    room[0, 0], room[0, 1] = low_x, high_x
    room[1, 0], room[1, 1] = low_y, high_y
    empty = run_intervals(tape.code, room)
    out[0], out[1] = (np.inf, -np.inf) if empty else _wider(room, tape.outputs[0])
    out[2], out[3] = _wider(room, tape.outputs[3])
    out[4], out[5] = _wider(room, tape.outputs[4])
    out[6], out[7] = _wider(room, tape.outputs[6])
    out[8] = np.inf
    if len(out) > 9:
        out[9], out[10] = _wider(room, tape.outputs[1])
        out[11], out[12] = _wider(room, tape.outputs[2])


@lean
def tape_slopes(tape: Tape, room: Array) -> tuple[float, float, float, float]:
    """Lowest and highest slope along x, then along y, over the box of the last :func:`tape_bounds` in ``room``."""
    low_x, high_x = _wider(room, tape.outputs[1])
    low_y, high_y = _wider(room, tape.outputs[2])
    return low_x, high_x, low_y, high_y


@lean
def tape_range(
    tape: Tape, low_x: float, low_y: float, high_x: float, high_y: float, room: Array
) -> tuple[float, float]:
    """Lowest and highest value over one box, as :func:`tape_bounds`, for less. ``tape``: of
    :func:`bodyplan.expressions.compiled.bounds_program`, with or without derivatives."""
    room[0, 0], room[0, 1] = low_x, high_x
    room[1, 0], room[1, 1] = low_y, high_y
    if run_intervals(tape.code, room):
        return np.inf, -np.inf
    return _wider(room, tape.outputs[0])


@njit(cache=True, nogil=True, error_model="numpy")
def tape_numbers(tape: Tape, points: Array, value: Array, gradient: Array, hessian: Array) -> int:
    """Of a formula of n variables at ``points`` (m, n): ``value`` (m,), and ``gradient`` (m, n) and ``hessian``
    (m, n n), or as many of them as there are. Value is nan where the formula is undefined; returns the least number of
    a node that is, anywhere, or more than any."""
    room, first, second = tape.registers.copy(), gradient.shape[1], hessian.shape[1]
    culprit = _NONE
    for k in range(len(points)):
        for i in range(points.shape[1]):
            room[i] = points[k, i]
        node = run_numbers(tape.code, room)
        value[k] = room[tape.outputs[0]] if node == _NONE else np.nan
        for i in range(first):
            gradient[k, i] = room[tape.outputs[1 + i]]
        for i in range(second):
            hessian[k, i] = room[tape.outputs[1 + first + i]]
        culprit = min(culprit, node)
    return culprit


@njit(cache=True, nogil=True, error_model="numpy")
def tape_intervals(tape: Tape, low: Array, high: Array, value: Array, gradient: Array, hessian: Array) -> None:
    """Of a formula of n variables over boxes with corners ``low`` and ``high`` (m, n): lowest and highest ``value``
    (2, m), ``gradient`` (2, m, n) and ``hessian`` (2, m, n n), or as many of them as there are."""
    room, first, second = tape.registers.copy(), gradient.shape[2], hessian.shape[2]
    for k in range(len(low)):
        for i in range(low.shape[1]):
            room[i, 0], room[i, 1] = low[k, i], high[k, i]
        empty = run_intervals(tape.code, room)
        value[0, k], value[1, k] = (np.inf, -np.inf) if empty else _wider(room, tape.outputs[0])
        for i in range(first):
            gradient[0, k, i], gradient[1, k, i] = _wider(room, tape.outputs[1 + i])
        for i in range(second):
            hessian[0, k, i], hessian[1, k, i] = _wider(room, tape.outputs[1 + first + i])


@lean
def run_numbers(code: IntArray, registers: Array) -> int:
    """Fill the registers of all instructions; the least number of a node whose value is not finite, or more than
    any."""
    start, culprit = len(registers) - len(code), _NONE
    for k in range(len(code)):
        op = code[k, 0]
        a, b = registers[code[k, 1]], registers[code[k, 2]]
        if op == MUL:
            v = a * b
        elif op == ADD:
            v = a + b
        elif op == SUB:
            v = a - b
        elif op == DIV:
            v = a / b
        elif op == NEG:
            v = -a
        elif op == POWER:
            v = a**b
        elif op == ORDER:
            v = 1.0 if a >= b else 0.0
        elif op == PICK:
            v = b if a != 0.0 else registers[code[k, 3]]
        elif op == STEP:
            v = 1.0 if a >= 0.0 else -1.0
        elif op == ARCTAN2:
            v = np.arctan2(a, b)
        elif op == SIN:
            v = np.sin(a)
        elif op == COS:
            v = np.cos(a)
        elif op == TAN:
            v = np.tan(a)
        elif op == ARCSIN:
            v = np.arcsin(a)
        elif op == ARCCOS:
            v = np.arccos(a)
        elif op == ARCTAN:
            v = np.arctan(a)
        elif op == SINH:
            v = np.sinh(a)
        elif op == COSH:
            v = np.cosh(a)
        elif op == TANH:
            v = np.tanh(a)
        elif op == EXP:
            v = np.exp(a)
        elif op == LOG:
            v = np.log(a)
        elif op == SQRT:
            v = np.sqrt(a)
        else:  # ABS
            v = abs(a)
        registers[start + k] = v
        if code[k, 4] > 0 and not np.isfinite(v):
            culprit = min(culprit, code[k, 4] - 1)
    return culprit


@lean
def run_intervals(code: IntArray, registers: Array) -> bool:
    """Fill the registers (r, 2) of all instructions; whether the formula is defined nowhere in the box."""
    start, empty = len(registers) - len(code), False
    for k in range(len(code)):
        op = code[k, 0]
        a, b, c = code[k, 1], code[k, 2], code[k, 3]
        al, ah, bl, bh = registers[a, 0], registers[a, 1], registers[b, 0], registers[b, 1]
        cl, ch = registers[c, 0], registers[c, 1]
        if op == MUL:
            low, high = _product(al, ah, bl, bh)
        elif op == ADD:
            low, high = al + bl, ah + bh
        elif op == SUB:
            low, high = al - bh, ah - bl
        elif op == DIV:
            if bl > 0.0 or bh < 0.0:
                low, high = _product(al, ah, 1.0 / bh, 1.0 / bl)
            else:
                low, high = _product(al, ah, -np.inf, np.inf)
        elif op == NEG:
            low, high = -ah, -al
        elif op == SQUARE:
            low, high = _size(al, ah)
            low, high = low * low, high * high
        elif op == POWER:
            low, high = al**bl, ah**bl
        elif op == ORDER:  # a lies above b, below it
            low, high = (1.0 if al > bh else 0.0), (1.0 if ah < bl else 0.0)
        elif op in (PICK, PICK_ROUGH):
            if al != 0.0:
                low, high = bl, bh
            elif ah != 0.0:
                low, high = cl, ch
            elif op == PICK:
                low, high = min(bl, cl), max(bh, ch)
            else:
                low, high = -np.inf, np.inf
        elif op == STEP:
            low, high = (1.0 if al >= 0.0 else -1.0), (-1.0 if ah < 0.0 else 1.0)
        elif op == BEND:
            low, high = (-np.inf, np.inf) if al <= 0.0 and ah >= 0.0 else (0.0, 0.0)
        elif op == ARCTAN2:
            low, high = (-np.pi, np.pi) if _meets_cut(al, ah, bl) else _angles(al, ah, bl, bh)
        elif op == CUT:
            low, high = (-np.inf, np.inf) if _meets_cut(al, ah, bl) else (cl, ch)
        elif op == INSIDE:
            empty = empty or ah < bl or al > cl
            low, high = min(max(al, bl), cl), min(max(ah, bl), cl)
        elif op == SIN:
            p, q = np.sin(al), np.sin(ah)
            low = -1.0 if _between(al, ah, -0.5 * np.pi, 2.0 * np.pi) else np.minimum(p, q)
            high = 1.0 if _between(al, ah, 0.5 * np.pi, 2.0 * np.pi) else np.maximum(p, q)
        elif op == TAN:
            if _between(al, ah, 0.5 * np.pi, np.pi):
                low, high = -np.inf, np.inf
            else:
                low, high = np.tan(al), np.tan(ah)
        elif op == ARCSIN:
            low, high = np.arcsin(al), np.arcsin(ah)
        elif op == ARCCOS:
            low, high = np.arccos(ah), np.arccos(al)
        elif op == ARCTAN:
            low, high = np.arctan(al), np.arctan(ah)
        elif op == SINH:
            low, high = np.sinh(al), np.sinh(ah)
        elif op == COSH:
            low, high = np.cosh(al), np.cosh(ah)
        elif op == TANH:
            low, high = np.tanh(al), np.tanh(ah)
        elif op == EXP:
            low, high = np.exp(al), np.exp(ah)
        elif op == LOG:
            empty = empty or ah <= 0.0
            low, high = np.log(al), np.log(ah)
        elif op == SQRT:
            low, high = np.sqrt(al), np.sqrt(ah)
        else:  # ABS
            low, high = _size(al, ah)
        # inf - inf and 0 * inf: nothing is known
        registers[start + k, 0] = -np.inf if np.isnan(low) else low
        registers[start + k, 1] = np.inf if np.isnan(high) else high
    return empty


@lean
def _wider(registers: Array, at: int) -> tuple[float, float]:
    """A register's interval, widened for rounding; infinite where nothing is known."""
    low, high = registers[at, 0], registers[at, 1]
    low = low - (1e-12 * abs(low) + 1e-300) if np.isfinite(low) else -np.inf
    high = high + (1e-12 * abs(high) + 1e-300) if np.isfinite(high) else np.inf
    return low, high


@lean
def _product(al: float, ah: float, bl: float, bh: float) -> tuple[float, float]:
    p, q, r, s = al * bl, al * bh, ah * bl, ah * bh
    if np.isnan(p + q + r + s) and (np.isnan(p) or np.isnan(q) or np.isnan(r) or np.isnan(s)):
        return -np.inf, np.inf
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))


@lean
def _size(low: float, high: float) -> tuple[float, float]:
    p, q = abs(low), abs(high)
    return (0.0 if low <= 0.0 and high >= 0.0 else min(p, q)), max(p, q)


@lean
def _between(low: float, high: float, point: float, period: float) -> bool:
    """Whether point + k period lies between for a whole k (also where an end is infinite)."""
    return not np.floor((high - point) / period) - np.ceil((low - point) / period) < 0.0


@lean
def _meets_cut(y_low: float, y_high: float, x_low: float) -> bool:
    """Whether atan2 jumps (or is undefined) in the box: it contains a point with y = 0 and x <= 0."""
    return y_low <= 0.0 and y_high >= 0.0 and x_low <= 0.0


@lean
def _angles(yl: float, yh: float, xl: float, xh: float) -> tuple[float, float]:
    p, q, r, s = np.arctan2(yl, xl), np.arctan2(yl, xh), np.arctan2(yh, xl), np.arctan2(yh, xh)
    return min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
