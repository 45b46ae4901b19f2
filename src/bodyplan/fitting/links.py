"""Straight links on a planar curve by circles (paper *concertina*, section V), certified and differentiated.

Joint i + 1 is where a circle of the link's length about joint i meets the curve **first, going ahead along it**.
The search cannot step over that point: with K a bound of the second derivative of the squared distance ahead,
the parabola through the present value and slope with curvature K stays above the function, so its root is a safe
step, and near the answer it is Newton's (quadratic) step. A bare secant, as in the paper, diverges or runs
backwards once omega is large against the link (95 of 854 links at omega = 3).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, pi, sqrt

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, TextArray, finite, whole
from bodyplan.curves import pieces as pc
from bodyplan.curves.concertina import GAUSS_NODES, GAUSS_WEIGHTS, ConcertinaCurve
from bodyplan.errors import InputError, SolveError, Status
from bodyplan.kernels import lean
from bodyplan.threads import shared

#: a link whose curve is longer than this many link lengths (half a circle over the link) skips a fold
TIGHT_ARC = 0.5 * pi
#: or, where it spans more than a half wave, than this many: a whole fold is cut off
FOLD_ARC = 1.05


@dataclass(frozen=True)
class LinksFit:
    """Links fitted to a curve; unpacks as ``points, angles``.

    ``points`` (..., n + 1, 2) joints from the start on, curve units. ``angles`` (..., n) absolute angles of the links,
    rad, in (-pi/2, pi/2]. ``status`` (...): "ok", or "too_tight" where the curve folds under a link: the arc between
    its joints is longer than half a circle over it, or a whole half wave fits in between; ``link`` (...) the first
    such link, else -1.
    """

    points: Array
    angles: Array
    status: TextArray | str
    link: IntArray | int

    def __iter__(self) -> Iterator[Array]:
        return iter((self.points, self.angles))

    @property
    def ok(self) -> bool:
        """True where every link of every curve fits."""
        return bool(np.all(np.asarray(self.status) == Status.OK.value))

    def raise_if_failed(self) -> LinksFit:
        """This fit, or SolveError naming the first link that is too long for the curve."""
        if not self.ok:
            which = int(np.flatnonzero(np.asarray(self.status).ravel() != Status.OK.value)[0])
            link = int(np.asarray(self.link).ravel()[which])
            raise SolveError(
                Status.TOO_TIGHT, f"the curve folds under link {link + 1}: use shorter links or a smaller omega", link
            )
        return self


@lean
def _bounds(pieces: Array, k: int, omega: float, y: float, slope: float) -> tuple[float, float]:
    """Bounds of |y'| and |y''| on the rest of a piece, from a point with the given y and slope on."""
    if pieces[k, pc.KIND] == pc.FLAT:
        return 0.0, 0.0
    # F'' + 2 g w F' + w^2 F = 0 loses energy (the tail's sine keeps it), so |(F', w F)| never grows
    energy = sqrt(slope * slope + omega * omega * y * y)
    return energy, energy * omega * sqrt(1.0 + 4.0 * pieces[k, pc.G] * pieces[k, pc.G])


@lean
def next_joint(
    x0: float, y0: float, k: int, steepest: float, length: float, guess: float, pieces: Array, count: int, omega: float
) -> float:
    """x of the first point ahead of (x0, y0) at distance ``length`` (kernel). The point lies on piece k, on the rest
    of which the curve is no steeper than ``steepest``. ``guess`` (or nan) of it is where iteration begins once there
    can be no point before."""
    # the arc is at least as long as the distance
    x = x0 + length / sqrt(1.0 + steepest * steepest)
    if k + 1 < count and x >= pieces[k + 1, pc.START]:
        x = pieces[k + 1, pc.START]
        k += 1
    reach = x0 + length  # the distance is at least x - x0, so the answer is not beyond
    while True:
        end = reach
        if k + 1 < count and pieces[k + 1, pc.START] < end:
            end = pieces[k + 1, pc.START]
        y, slope, curve = pc.piece_value(x, pieces, k, omega)
        while True:
            dx, dy = x - x0, y - y0
            g = (dx - length) * (dx + length) + dy * dy
            if g >= 0.0:
                return x
            g1 = 2.0 * (dx + dy * slope)
            m1, m2 = _bounds(pieces, k, omega, y, slope)
            left = end - x
            if g1 + min(2.0 - 2.0 * (abs(dy) + m1 * left) * m2, 0.0) * left > 0.0:
                # the distance grows all the way to the end: one root at most, any fast iteration finds it
                found = _growing(x0, y0, x, end, length, g, g1, curve, slope, dy, guess, pieces, k, omega)
                if found < np.inf:
                    return found
                break
            bound = 2.0 + 2.0 * m1 * m1 + 2.0 * length * m2
            root = sqrt(g1 * g1 - 2.0 * bound * g)
            # the smaller root of g + g1 h + bound h^2 / 2, without cancellation
            step = (root - g1) / bound if g1 < 0.0 else -2.0 * g / (root + g1)
            if x + step >= end:
                break
            if step <= 2e-16 * length or x + step == x:
                return x
            x += step
            y, slope, curve = pc.piece_value(x, pieces, k, omega)
        if end == reach:
            # only a level link reaches so far, and rounding may put it past the last piece's own answer
            return reach
        x = end
        k += 1


@lean
def _growing(
    x0: float,
    y0: float,
    x: float,
    end: float,
    length: float,
    g: float,
    g1: float,
    curve: float,
    slope: float,
    dy: float,
    guess: float,
    pieces: Array,
    k: int,
    omega: float,
) -> float:
    """Root of the squared distance minus length^2 in (x, end], where it grows: roots of local parabolas in a bracket
    (cubic convergence) from x or the ``guess``; inf where it is negative up to the end (kernel)."""
    low, high, open_end = x, end, True
    if low < guess < high:
        x = guess
        y, slope, curve = pc.piece_value(x, pieces, k, omega)
        dy = y - y0
        g = (x - x0 - length) * (x - x0 + length) + dy * dy
        g1 = 2.0 * (x - x0 + dy * slope)
        if g < 0.0:
            low = x
        else:
            high, open_end = x, False
    for _ in range(100):
        g2 = 2.0 + 2.0 * slope * slope + 2.0 * dy * curve
        inner = g1 * g1 - 2.0 * g * g2
        # root of the local parabola, also where g1 is 0; never small unless g is
        step = -2.0 * g / (g1 + sqrt(inner)) if inner > 0.0 and g1 >= 0.0 else np.inf
        following = x + step
        # cubic convergence: the next error is below rounding
        if abs(step) <= 3e-6 * length and low <= following <= high:
            return following
        if not low < following < high:
            if open_end:
                y = pc.piece_value(end, pieces, k, omega)[0]
                if (end - x0 - length) * (end - x0 + length) + (y - y0) * (y - y0) < 0.0:
                    return np.inf
                open_end = False
            following = 0.5 * (low + high)
            if high - low <= 4e-16 * (abs(high) + length):
                return following
        x = following
        y, slope, curve = pc.piece_value(x, pieces, k, omega)
        dy = y - y0
        g = (x - x0 - length) * (x - x0 + length) + dy * dy
        g1 = 2.0 * (x - x0 + dy * slope)
        if g < 0.0:
            low = x
        elif g > 0.0:
            high, open_end = x, False
        else:
            return x
    return x


@lean
def _tight(
    a: float,
    b: float,
    steepest: float,
    length: float,
    pieces: Array,
    count: int,
    omega: float,
    nodes: Array,
    weights: Array,
) -> bool:
    """True where the curve, no steeper than ``steepest``, folds under the link from x = a to b (kernel):
    the arc is longer than half a circle over the link, or a half wave fits under it. Integrates only where in doubt."""
    whole_fold = (b - a) * omega > pi
    if not whole_fold and (b - a) * sqrt(1.0 + steepest * steepest) <= TIGHT_ARC * length:
        return False
    arc = pc.arc_between(a, b, pieces, count, omega, nodes, weights)
    return arc > TIGHT_ARC * length or (whole_fold and arc > FOLD_ARC * length)


@lean
def place_chain(
    first: int,
    step: float,
    lengths: Array,
    pieces: Array,
    count: int,
    omega: float,
    nodes: Array,
    weights: Array,
    points: Array,
    local: Array,
    angles: Array,
) -> int:
    """One chain on one curve from joint ``first`` on, whose x is points[first, 0] (kernel): fills points (n + 1, 2),
    local (n + 1, 3 and more) slope and second derivative of the curve there and the piece, and angles (n,); returns the
    first link too tight of those placed, or -1. Where points are those of the same chain before the curve went on by
    ``step`` and local[:, 3:5] the speed and acceleration along x that they had, it is done sooner; else nan."""
    x = points[first, 0]
    k = pc.piece_at(x, pieces, count)
    y, slope, curve = pc.piece_value(x, pieces, k, omega)
    points[first, 1] = y
    local[first, 0], local[first, 1], local[first, 2] = slope, curve, k
    tight = -1
    for i in range(first, lengths.size):
        length = lengths[i]
        steepest = _bounds(pieces, k, omega, y, slope)[0]
        guess = points[i + 1, 0] + step * (local[i + 1, 3] + 0.5 * step * local[i + 1, 4])
        xn = next_joint(x, y, k, steepest, length, guess, pieces, count, omega)
        before = k
        while k + 1 < count and xn >= pieces[k + 1, pc.START]:
            k += 1
        if tight < 0:
            for j in range(before + 1, k + 1):  # a piece is steepest for its energy at the start, |V| omega
                steepest = max(steepest, abs(pieces[j, pc.V]) * omega)
            if _tight(x, xn, steepest, length, pieces, count, omega, nodes, weights):
                tight = i
        yn, slope, curve = pc.piece_value(xn, pieces, k, omega)
        angles[i] = atan2(yn - y, xn - x)
        x, y = xn, yn
        points[i + 1, 0], points[i + 1, 1] = x, y
        local[i + 1, 0], local[i + 1, 1], local[i + 1, 2] = slope, curve, k
    return tight


@lean
def chain_rates(first: int, points: Array, local: Array, pieces: Array, omega: float, rates: Array) -> None:
    """First and second derivative of the links' angles by the curve's progress t, (2, n), for joints that
    :func:`place_chain` put on the curve, of which those up to ``first`` rest (kernel); and local[:, 3:5], their speed
    and acceleration along x."""
    x, y = points[first, 0], points[first, 1]
    _, _, yd, _, ydd = _moving(first, points, local, pieces, omega)
    xd, xdd = 0.0, 0.0
    for i in range(first):
        rates[0, i], rates[1, i] = 0.0, 0.0
        local[i, 3], local[i, 4] = 0.0, 0.0
    local[first, 3], local[first, 4] = 0.0, 0.0
    for i in range(first, rates.shape[1]):
        xn, yn = points[i + 1, 0], points[i + 1, 1]
        yx, yxx, yt, yxt, ytt = _moving(i + 1, points, local, pieces, omega)
        ux, uy = xn - x, yn - y
        # u . u' = 0 along t, twice: the new joint's speed and acceleration along x
        across = ux + uy * yx
        xnd = (ux * xd + uy * (yd - yt)) / across
        ynd = yx * xnd + yt
        vx, vy = xnd - xd, ynd - yd
        bend = yxx * xnd * xnd + 2.0 * yxt * xnd + ytt
        xndd = (ux * xdd + uy * (ydd - bend) - vx * vx - vy * vy) / across
        yndd = yx * xndd + bend
        square = ux * ux + uy * uy
        rates[0, i] = (ux * vy - uy * vx) / square
        rates[1, i] = (ux * (yndd - ydd) - uy * (xndd - xdd)) / square
        x, y, xd, yd, xdd, ydd = xn, yn, xnd, ynd, xndd, yndd
        local[i + 1, 3], local[i + 1, 4] = xd, xdd


@lean
def _moving(
    j: int, points: Array, local: Array, pieces: Array, omega: float
) -> tuple[float, float, float, float, float]:
    """y_x, y_xx, y_t, y_xt, y_tt at joint j (kernel)."""
    k = int(local[j, 2])
    if pc.rests(pieces, k):
        return local[j, 0], local[j, 1], 0.0, 0.0, 0.0
    _, yx, yxx, yt, yxt, ytt = pc.piece_jet(points[j, 0], pieces, k, omega)
    return yx, yxx, yt, yxt, ytt


#: curves from which on a batch is shared between threads
SHARED_FROM = 256


@njit(cache=True, nogil=True)
def _fit_range(
    begin: int,
    end: int,
    lengths: Array,
    start: Array,
    pieces: Array,
    counts: IntArray,
    omega: float,
    nodes: Array,
    weights: Array,
    points: Array,
    angles: Array,
    tight: IntArray,
) -> int:
    """:func:`place_chain` for the curves begin .. end - 1 (kernel)."""
    local = np.empty((lengths.size + 1, 5))
    for b in range(begin, end):
        points[b, 0, 0] = start[b]
        tight[b] = place_chain(
            0, np.nan, lengths, pieces[b], counts[b], omega, nodes, weights, points[b], local, angles[b]
        )
    return 0


def link_lengths(link_length: ArrayLike, links: int | None) -> Array:
    """Link lengths (n,) from one length and a count, or from a sequence; InputError if they disagree."""
    lengths = finite(link_length, "link_length")
    if lengths.ndim > 1:
        raise InputError(f"link_length: expected a number or a list of them, got shape {lengths.shape}.")
    if lengths.ndim == 0:
        if links is None:
            raise InputError("links: say how many when link_length is one number.")
        lengths = np.full(whole(links, "links", at_least=1), float(lengths))
    elif links is not None and whole(links, "links", at_least=1) != lengths.size:
        raise InputError(f"links: {links} links, but link_length lists {lengths.size}.")
    if lengths.size == 0 or np.any(lengths <= 0.0):
        raise InputError(f"link_length: every link must be longer than 0, got {lengths.min(initial=0.0)}.")
    return np.ascontiguousarray(lengths)


def links_on_curve(
    curve: ConcertinaCurve, link_length: ArrayLike, links: int | None = None, start: ArrayLike = 0.0
) -> LinksFit:
    """Fit straight links to a curve by circles, each joint the nearest intersection ahead along the curve.

    ``curve`` may be a batch; ``link_length`` one length (then ``links`` says how many) or a list of lengths, in
    curve units; ``start`` x of the first joint, a number or one a curve. Points (..., n + 1, 2) lie on the curve
    and are one link apart to 1e-12 or better. Returns a :class:`LinksFit`; a curve too tight for the links is its
    status. Raises InputError for non-positive lengths or a start before the tail.
    """
    if not isinstance(curve, ConcertinaCurve):
        raise InputError(f"curve: expected a ConcertinaCurve, got {type(curve).__name__}.")
    lengths = link_lengths(link_length, links)
    pieces, counts = curve.pieces
    first = np.ascontiguousarray(np.broadcast_to(finite(start, "start"), curve.batch)).reshape(-1)
    if np.any(first < 0.0):
        raise InputError(f"start: the curve starts at its tail, x = 0, got {first.min()}.")
    size = counts.size
    points, angles = np.empty((size, lengths.size + 1, 2)), np.empty((size, lengths.size))
    tight = np.empty(size, dtype=np.int64)
    arguments = (lengths, first, pieces, counts, curve.omega, GAUSS_NODES, GAUSS_WEIGHTS, points, angles, tight)
    shared(lambda begin, end: int(_fit_range(begin, end, *arguments)), size, threaded_from=SHARED_FROM)
    points, angles = points.reshape(*curve.batch, *points.shape[1:]), angles.reshape(*curve.batch, -1)
    status = np.where(tight < 0, Status.OK.value, Status.TOO_TIGHT.value).reshape(curve.batch)
    if not curve.batch:
        return LinksFit(points, angles, str(status), int(tight[0]))
    return LinksFit(points, angles, status, tight.reshape(curve.batch))
