"""The concertina curve as a table of pieces: Numba kernels shared by the curve and by the fit of links.

A piece is a row of :data:`COLUMNS` numbers. Rates are with respect to one progress variable t along which
the shape parameters change, so that the fit can differentiate exactly.
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.curves.dynamic import crossing_of, dynamic_jet, dynamic_value
from bodyplan.kernels import lean

START, KIND, ORIGIN, V, VD, VDD, G, GD, GDD = range(9)
COLUMNS = 9
TAIL, MODULE, FLAT = 0.0, 1.0, 2.0
CUT, PRODUCT, NATURAL = 0, 1, 2
RULES = {"cut": CUT, "product": PRODUCT, "natural": NATURAL}


@lean
def _flat(out: Array, k: int, start: float) -> None:
    """Make row k a straight line on the axis from ``start`` on (kernel)."""
    for column in range(COLUMNS):
        out[k, column] = 0.0
    out[k, START], out[k, KIND] = start, FLAT


@lean
def build_pieces(tail: Array, gammas: Array, omega: float, crossing: int, rule: int, lead: float, out: Array) -> int:
    """Fill ``out`` (>= N_B + 4, COLUMNS) for one curve; returns the number of pieces (kernel).

    A straight line of length ``lead`` (>= 0) stands before the tail.

    ``tail`` (3,): multiplier of the tail, its first and second rate. ``gammas`` (N_B + 1, 3): gamma of the body
    modules from tail to head, then of the head, with rates. Rates are exact for the rules cut and product,
    whose junctions stand still.
    """
    modules = gammas.shape[0] - 1
    p = 0
    if lead > 0.0:
        _flat(out, 0, 0.0)
        p = 1
    _flat(out, p, lead)
    out[p, KIND], out[p, ORIGIN] = TAIL, lead
    v, vd, vdd = tail[0], tail[1], tail[2]
    out[p, V], out[p, VD], out[p, VDD] = v, vd, vdd
    x = lead + 0.5 * pi / omega
    known, f, fg, fgg = -1.0, 0.0, 0.0, 0.0
    for k in range(modules + 1):
        g, gd, gdd = gammas[k, 0], gammas[k, 1], gammas[k, 2]
        p += 1
        out[p, START], out[p, KIND], out[p, ORIGIN] = x, MODULE, x
        out[p, V], out[p, VD], out[p, VDD] = v, vd, vdd
        out[p, G], out[p, GD], out[p, GDD] = g, gd, gdd
        head = k == modules
        span = pi / omega
        if rule == NATURAL and g < 1.0:
            span = pi / (omega * sqrt(1.0 - g * g))
        if g != known:  # modules at rest share their gamma, and so their end
            f, _, _, fg, _, fgg = dynamic_jet(span, g, omega)
            known = g
        if head or (rule == CUT and f >= 0.0):
            # correction 3: a module that no longer crosses zero is followed to its own first zero, then y = 0
            p += 1
            _flat(out, p, x + crossing_of(g, omega, crossing if head else 1))
            return p + 1
        fd = fg * gd
        fdd = fgg * gd * gd + fg * gdd
        v, vd, vdd = v * f, vd * f + v * fd, vdd * f + 2.0 * vd * fd + v * fdd
        x += span
    return p + 1  # not reached: the head always returns


@lean
def piece_at(x: float, pieces: Array, count: int) -> int:
    """Index of the piece that holds x, the right-hand one at a junction (kernel)."""
    i = count - 1
    while i > 0 and x < pieces[i, START]:
        i -= 1
    return i


@lean
def rests(pieces: Array, k: int) -> bool:
    """True where the curve does not change along a piece (kernel)."""
    return bool(pieces[k, VD] == 0.0 and pieces[k, VDD] == 0.0 and pieces[k, GD] == 0.0 and pieces[k, GDD] == 0.0)


@lean
def rests_until(pieces: Array, count: int, other: Array, others: int) -> float:
    """x up to which a curve rests and is the same as another one, given by its own pieces; inf if it is all the same
    (kernel)."""
    for k in range(min(count, others)):
        begin = min(pieces[k, START], other[k, START])
        if pieces[k, START] != other[k, START] or not rests(pieces, k):
            return float(begin)
        for column in (KIND, ORIGIN, V, G):
            if pieces[k, column] != other[k, column]:
                return float(begin)
    if count == others:
        return np.inf
    return float(pieces[others, START] if count > others else other[count, START])


@lean
def piece_jet(x: float, pieces: Array, k: int, omega: float) -> tuple[float, float, float, float, float, float]:
    """y, y_x, y_xx, y_t, y_xt, y_tt of one piece at x (kernel)."""
    if pieces[k, KIND] == FLAT:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    v, vd, vdd = pieces[k, V], pieces[k, VD], pieces[k, VDD]
    if pieces[k, KIND] == TAIL:
        X = omega * (x - pieces[k, ORIGIN])
        s, c = sin(X), omega * cos(X)
        return v * s, v * c, -omega * omega * v * s, vd * s, vd * c, vdd * s
    gd, gdd = pieces[k, GD], pieces[k, GDD]
    f, fx, fxx, fg, fxg, fgg = dynamic_jet(x - pieces[k, ORIGIN], pieces[k, G], omega)
    return (
        v * f,
        v * fx,
        v * fxx,
        vd * f + v * fg * gd,
        vd * fx + v * fxg * gd,
        vdd * f + 2.0 * vd * fg * gd + v * (fgg * gd * gd + fg * gdd),
    )


@lean
def piece_value(x: float, pieces: Array, k: int, omega: float) -> tuple[float, float, float]:
    """y, y_x, y_xx of one piece at x (kernel)."""
    if pieces[k, KIND] == FLAT:
        return 0.0, 0.0, 0.0
    v = pieces[k, V]
    if pieces[k, KIND] == TAIL:
        X = omega * (x - pieces[k, ORIGIN])
        s = v * sin(X)
        return s, v * omega * cos(X), -omega * omega * s
    f, fx, fxx = dynamic_value(x - pieces[k, ORIGIN], pieces[k, G], omega)
    return v * f, v * fx, v * fxx


@njit(cache=True)
def evaluate(x: Array, pieces: Array, counts: IntArray, omega: float, y: Array, slope: Array) -> None:
    """y and slope (B, S) of B curves at x (B, S) (kernel)."""
    for b in range(x.shape[0]):
        for i in range(x.shape[1]):
            k = piece_at(x[b, i], pieces[b], counts[b])
            y[b, i], slope[b, i], _ = piece_value(x[b, i], pieces[b], k, omega)


@njit(cache=True)
def build_batch(
    tail: Array, gammas: Array, omega: float, crossing: int, rule: int, lead: float, out: Array, counts: IntArray
) -> None:
    """:func:`build_pieces` for B curves without rates: tail (B,), gammas (B, N_B + 1) (kernel)."""
    t = np.zeros(3)
    g = np.zeros((gammas.shape[1], 3))
    for b in range(tail.size):
        t[0] = tail[b]
        g[:, 0] = gammas[b]
        counts[b] = build_pieces(t, g, omega, crossing, rule, lead, out[b])


@lean
def arc_between(a: float, b: float, pieces: Array, count: int, omega: float, nodes: Array, weights: Array) -> float:
    """Arc length from x = a to x = b >= a, Gauss-Legendre in steps of at most a quarter radian of the wave (kernel)."""
    total = 0.0
    k = piece_at(a, pieces, count)
    x = a
    while x < b:
        end = b
        if k + 1 < count and pieces[k + 1, START] < end:
            end = pieces[k + 1, START]
        if pieces[k, KIND] == FLAT:
            total += end - x
        elif end > x:
            steps = int((end - x) * omega * 4.0) + 1
            h = (end - x) / steps
            for j in range(steps):
                for m in range(nodes.size):
                    at = x + h * (j + nodes[m])
                    slope = piece_value(at, pieces, k, omega)[1]
                    total += weights[m] * h * sqrt(1.0 + slope * slope)
        x = end
        k += 1
    return total
