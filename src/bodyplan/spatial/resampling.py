"""Shapes at the nodes of many steps from samples at few places: for smooth curves that are costly to sample."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.errors import InputError
from bodyplan.spatial.frames import GAUSS_NODES

#: places of a cell
ORDER = 16


class NodeSampling:
    """Where to sample shapes so that those at the :data:`GAUSS_NODES` of ``steps`` (M,) follow by interpolation.

    Steps are put together to cells no longer than ``cell`` (but at least one step), and a cell is sampled at 16
    Gauss-Legendre places, however many steps it has. Exact for shapes that are polynomials of degree 15 within the
    cells; a wave of k rad per unit length is met to about (k cell / 22)^16. No error control, like
    :func:`bodyplan.spatial.frames_from_nodes`, which takes the result: make the cells half as long and compare.

    ``places`` (K,): where to sample, from the start of the first step on. Raises InputError for steps or a cell that
    are not > 0.
    """

    def __init__(self, steps: ArrayLike, cell: float) -> None:
        h = finite(steps, "steps", (None,))
        number(cell, "cell", above=0.0)
        if not len(h) or np.any(h <= 0.0):
            raise InputError("steps: needs at least one step, and steps > 0.")
        ends = np.concatenate([[0.0], np.cumsum(h)])
        nodes = ends[:-1, None] + h[:, None] * np.array(GAUSS_NODES)
        x = legendre.leggauss(ORDER)[0]
        fit = np.linalg.inv(legendre.legvander(x, ORDER - 1))
        first, places = 0, []
        self._cells: list[tuple[slice, Array]] = []
        while first < len(h):
            last = max(first + 1, int(np.searchsorted(ends, ends[first] + cell * (1.0 + 1e-12), side="right")) - 1)
            middle, half = 0.5 * (ends[first] + ends[last]), 0.5 * (ends[last] - ends[first])
            places.append(middle + half * x)
            weights = legendre.legvander((nodes[first:last].ravel() - middle) / half, ORDER - 1) @ fit
            # the three components side by side: one matrix product writes them in place
            self._cells.append((slice(9 * first, 9 * last), frozen(np.kron(weights, np.eye(3)).T)))
            first = last
        self.places = frozen(np.concatenate(places))
        self.steps = frozen(h)

    def nodes(self, shapes: ArrayLike) -> Array:
        """Shapes (..., M, 3, 3) at the nodes of the steps from those (..., K, 3) at the places."""
        u = finite(shapes, "shapes")
        if u.ndim < 2 or u.shape[-2:] != (len(self.places), 3):
            raise InputError(f"shapes: expected shape (..., {len(self.places)}, 3), got {u.shape}.")
        lead, count = u.shape[:-2], len(self.steps)
        flat = u.reshape(-1, len(self._cells), 3 * ORDER)
        out = np.empty((len(flat), 9 * count))
        for i, (part, matrix) in enumerate(self._cells):
            np.matmul(flat[:, i], matrix, out=out[:, part])
        return out.reshape(*lead, count, 3, 3)
