"""The link length whose chain covers the contracted concertina curve exactly (paper *concertina*, section V)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, number, whole
from bodyplan.curves.concertina import GAUSS_NODES, GAUSS_WEIGHTS, ConcertinaCurve
from bodyplan.errors import SolveError, Status
from bodyplan.fitting.links import link_lengths, links_on_curve, place_chain


class ExactLength(float):
    """A link length that knows whether it exists: ``status`` "ok", "no_exact_length" (then the value is nan) or
    "too_tight"; ``flat_from`` is the length of the contracted curve along x. Behaves as the float it is."""

    status: str
    flat_from: float

    def __new__(cls, value: float, status: Status, flat_from: float) -> ExactLength:
        out = super().__new__(cls, value)
        out.status, out.flat_from = status.value, flat_from
        return out

    def raise_if_failed(self) -> ExactLength:
        """This length, or SolveError."""
        if self.status != Status.OK.value:
            raise SolveError(
                self.status, "no link length puts the last joint exactly on the end of the contracted curve"
            )
        return self


@njit(cache=True)
def _chain_ends(
    scales: Array, ratios: Array, pieces: Array, count: int, omega: float, nodes: Array, weights: Array, ends: Array
) -> None:
    """x of the last joint, ``ends`` (S,), of chains with links ``scales`` (S,) times ``ratios`` from x = 0 (kernel)."""
    n = ratios.size
    points, local, angles = np.zeros((n + 1, 2)), np.zeros((n + 1, 5)), np.empty(n)
    for i in range(scales.size):
        place_chain(0, np.nan, scales[i] * ratios, pieces, count, omega, nodes, weights, points, local, angles)
        ends[i] = points[n, 0]


def exact_link_length(
    links: int | ArrayLike, body_modules: int = 4, omega: float = 1.0, *, crossing: int = 2
) -> ExactLength:
    """Link length, in curve units, whose chain of ``links`` covers the contracted curve (all gamma 0) exactly.

    The last joint then lies where the head's curve ends, on the axis. ``links`` may also be a list of relative link
    lengths: the result is the factor that scales them. 0.873938881878 for 26 links, 4 modules, omega 1.
    That such a length exists is not certain where links are long against the folds: then it is a status of the
    result. Raises InputError for bad counts or omega.
    """
    from scipy.optimize import brentq

    ratios = np.ones(whole(links, "links", at_least=1)) if np.ndim(links) == 0 else link_lengths(links, None)
    modules = whole(body_modules, "body_modules", at_least=1)
    number(omega, "omega", above=0.0)
    curve = ConcertinaCurve(np.zeros(modules), 0.0, omega=omega, crossing=crossing)
    end = float(curve.flat_from)
    if not np.isfinite(end):
        return ExactLength(np.nan, Status.NO_EXACT_LENGTH, end)
    pieces, counts = curve.pieces
    table = pieces[0], int(counts[0]), curve.omega, GAUSS_NODES, GAUSS_WEIGHTS

    def misses_at(scales: Array) -> Array:
        ends = np.empty(scales.size)
        _chain_ends(scales, ratios, *table, ends)
        return ends - end

    def miss(scale: float) -> float:
        return float(misses_at(np.array([scale]))[0])

    # the chain is longer than its x extent and not longer than the curve
    low, high = end / ratios.sum(), float(curve.arclength(end)) / ratios.sum()
    grid = np.linspace(low, high, 129)
    misses = misses_at(grid)
    for i in np.flatnonzero((misses[:-1] < 0.0) & (misses[1:] >= 0.0)):
        scale = float(brentq(miss, grid[i], grid[i + 1], xtol=1e-15, rtol=8.9e-16))
        if abs(miss(scale)) <= 1e-10 * end:  # else the chain jumps over the end: a fold was skipped
            fit = links_on_curve(curve, scale * ratios)
            return ExactLength(scale, Status.OK if fit.ok else Status.TOO_TIGHT, end)
    return ExactLength(np.nan, Status.NO_EXACT_LENGTH, end)
