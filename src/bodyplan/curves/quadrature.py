"""Integrals of shape functions by quadrature: an antiderivative as a table of cells, kept with the curve.

A cell holds the polynomials through the shape functions at its Gauss-Legendre nodes; their integrals are the Gauss
rule at the end of the cell and a polynomial inside it, so that any number of integrals costs no further evaluation
of the curve. Cells end at ``curve.breaks`` and are halved until two halves agree with the whole.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen
from bodyplan.errors import InputError, SolveError, Status

if TYPE_CHECKING:
    from bodyplan.curves.base import BodyCurve, Shape

#: Gauss nodes of a cell
ORDER = 16
#: cells kept with a curve, and the most that one call may need
KEPT, MOST = 32768, 500_000
#: rad that the polynomial of a cell may be off, if the halves did not replace it
TOLERANCE = 1e-14

#: Gauss-Legendre rule on [-1, 1]
NODES, WEIGHTS = (frozen(values) for values in legendre.leggauss(ORDER))
# values at the nodes -> Legendre coefficients
_FIT = 0.5 * (2.0 * np.arange(ORDER)[:, None] + 1.0) * legendre.legvander(NODES, ORDER - 1).T * WEIGHTS
#: values at the nodes -> Legendre coefficients (ORDER + 1, ORDER) of the antiderivative from -1 on
ANTIDERIVATIVE = frozen(np.stack([legendre.legint(row, lbnd=-1) for row in np.eye(ORDER)], axis=1) @ _FIT)
# factors (ORDER + 1, 2) of Clenshaw's recurrence for Legendre polynomials
_CLENSHAW = np.array([[(2.0 * k - 1.0) / k, (k - 1.0) / k] if k else [0.0, 0.0] for k in range(ORDER + 1)])
#: values at the nodes -> values of the polynomial at the nodes of the two halves
HALVES = frozen(legendre.legvander(np.concatenate([0.5 * NODES - 0.5, 0.5 * NODES + 0.5]), ORDER - 1) @ _FIT)


def interval(a: ArrayLike, b: ArrayLike) -> tuple[Array, Array]:
    """Ends of intervals, broadcast; InputError where they are not finite or do not fit each other."""
    first, last = finite(a, "a"), finite(b, "b")
    try:
        first, last = np.broadcast_arrays(first, last)
    except ValueError as error:
        raise InputError(f"a, b: shapes {first.shape} and {last.shape} do not broadcast.") from error
    return first, last


def shape_integral(curve: BodyCurve, a: ArrayLike, b: ArrayLike) -> Shape:
    """Integrals of ``curve.shape`` from a to b m (broadcast), rad, to 1e-13 or the rounding of the shape itself.

    The table of the curve grows with the places that are asked for and stays with the curve object (at most
    :data:`KEPT` cells). Raises InputError for places that are not finite, SolveError where the shape is too rough.
    """
    from bodyplan.curves.base import Shape  # the contract imports this module

    first, last = interval(a, b)
    shape = first.shape
    if not first.size:
        return Shape(np.zeros(shape), np.zeros(shape), np.zeros(shape))
    table = _table(curve, float(min(first.min(), last.min())), float(max(first.max(), last.max())))
    # as often as they were given, not as often as they are broadcast
    (start, begun), (end, ended) = (table.at(np.asarray(v, dtype=np.float64)) for v in (a, b))
    turned = np.asarray((end - start) + (ended - begun), dtype=np.float64)
    return Shape(*(np.broadcast_to(turned[..., i], shape).copy() for i in range(3)))


class _Table:
    """Antiderivative on [edges[0], edges[-1]]."""

    def __init__(self, edges: Array, values: Array) -> None:
        """``edges`` (C + 1,) m of the cells; ``values`` (C, ORDER, 3) rad/m of the shape at their nodes."""
        self.edges, self.values = edges, values
        half = 0.5 * np.diff(edges)
        self.series = np.einsum("kn,cnj,c->ckj", ANTIDERIVATIVE, values, half)  # (C, ORDER + 1, 3)
        # sums in extended precision where the machine has it: differences of them are what counts
        ends = np.zeros((len(edges), 3), dtype=np.longdouble)
        np.cumsum(np.einsum("n,cnj,c->cj", WEIGHTS, values, half), axis=0, dtype=np.longdouble, out=ends[1:])
        self.ends = ends

    def at(self, s: Array) -> tuple[Any, Array]:
        """Integrals (..., 3) rad from the first edge to the start of the cell of each place s (...) m, in extended
        precision, and from there to the place."""
        from bodyplan.curves.quadrature_kernel import series_at

        flat = s.ravel()
        cell = np.clip(np.searchsorted(self.edges, flat, side="right") - 1, 0, len(self.edges) - 2)
        low, high = self.edges[cell], self.edges[cell + 1]
        out = np.empty((len(flat), 3))
        series_at(self.series, cell, 2.0 * (flat - low) / (high - low) - 1.0, _CLENSHAW, out)
        return self.ends[cell].reshape(*s.shape, 3), out.reshape(*s.shape, 3)


def _table(curve: BodyCurve, low: float, high: float) -> _Table:
    """A table of the curve that covers [low, high]: the kept one, that one made longer, or a new one."""
    kept: _Table | None = curve.__dict__.get("_antiderivative")
    if kept is not None and kept.edges[0] <= low and high <= kept.edges[-1]:
        return kept
    # whole first cells, so that a curve asked place by place does not get a cell for each place
    size = _first_cell(curve)
    low, high = size * np.floor(low / size), size * (np.floor(high / size) + 1.0)
    near = kept is not None and (max(high, kept.edges[-1]) - min(low, kept.edges[0])) <= 2.0 * (
        (high - low) + (kept.edges[-1] - kept.edges[0])
    )
    if kept is not None and near and len(kept.edges) <= KEPT:
        edges, values = [kept.edges], [kept.values]
        if low < kept.edges[0]:
            more = _cells(curve, low, float(kept.edges[0]), size)
            edges, values = [more[0][:-1], *edges], [more[1], *values]
        if high > kept.edges[-1]:
            more = _cells(curve, float(kept.edges[-1]), high, size)
            edges, values = [*edges, more[0][1:]], [*values, more[1]]
        table = _Table(np.concatenate(edges), np.concatenate(values))
    else:
        table = _Table(*_cells(curve, low, high, size))
    if len(table.edges) <= KEPT + 1:
        curve.__dict__["_antiderivative"] = table
    return table


def _first_cell(curve: BodyCurve) -> float:
    """Length m of a cell before it is halved."""
    return 0.25 * min(curve.period or curve.length, curve.length)


def _cells(curve: BodyCurve, low: float, high: float, size: float) -> tuple[Array, Array]:
    """Edges (C + 1,) m and values (C, ORDER, 3) rad/m of cells that are small enough."""
    count = round((high - low) / size) + 1
    if count > MOST:
        raise _too_rough()
    breaks = curve.breaks
    edges = np.unique(
        np.concatenate([np.linspace(low, high, count + 1), breaks[(low < breaks) & (breaks < high)]]),
    )
    starts, ends = edges[:-1], edges[1:]
    values = _sample(curve, starts, ends)
    done: list[tuple[Array, Array]] = []
    cells = len(starts)
    while len(starts):
        middle = 0.5 * (starts + ends)
        splits = (starts < middle) & (middle < ends)
        first, last = np.stack([starts, middle], 1).ravel(), np.stack([middle, ends], 1).ravel()
        halves = _sample(curve, first, last)
        off = np.abs(np.einsum("mn,cnj->cmj", HALVES, values) - halves.reshape(-1, 2 * ORDER, 3)).max(axis=(1, 2))
        # rounding of the values and, far from 0, of the places
        both = halves.reshape(-1, 2 * ORDER, 3)
        size_, spread = np.abs(both).max(axis=(1, 2)), np.ptp(both, axis=1).max(axis=1)
        far = np.maximum(np.abs(starts), np.abs(ends))
        rounding = 4e-15 * (size_ * (ends - starts) + spread * far)
        good = (off * (ends - starts) <= np.maximum(TOLERANCE, rounding)) | ~splits
        twice = np.repeat(good, 2)
        done.append((first[twice], halves[twice]))
        starts, ends, values = first[~twice], last[~twice], halves[~twice]
        cells += len(starts)
        if cells > MOST:
            raise _too_rough()
    begin = np.concatenate([place for place, _ in done])
    order = np.argsort(begin, kind="stable")
    return np.append(begin[order], edges[-1]), np.concatenate([value for _, value in done])[order]


def _sample(curve: BodyCurve, starts: Array, ends: Array) -> Array:
    """Shapes (C, ORDER, 3) at the nodes of cells (C,)."""
    places = 0.5 * (starts + ends)[:, None] + 0.5 * (ends - starts)[:, None] * NODES
    return np.stack(curve.shape(places), axis=-1)


def _too_rough() -> SolveError:
    return SolveError(Status.NOT_CONVERGED, f"the integral of the shape functions needs more than {MOST} cells")
