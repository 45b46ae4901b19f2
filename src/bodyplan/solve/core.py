"""The equations of a partition in the units of a metric: what is left for a least-squares inverse to solve."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.solve.metric import Scale
from bodyplan.solve.partitions import Partition


class Core:
    """A y = b, with cost |y|^2: G X = b without the unknown feet that cost nothing and the rows that only say what
    those do. ``b`` (..., 6m) is H Y. :meth:`X` goes back to all unknowns."""

    def __init__(self, partition: Partition, how: Scale, G: Array, b: Array) -> None:
        free = np.array(how.free, dtype=np.int64)
        following = np.array([partition.X[i].number for i in free], dtype=np.int64)
        kept = np.setdiff1d(np.arange(len(partition.rows)), following)
        self._free: IntArray = free
        self._some: IntArray = np.setdiff1d(np.arange(len(partition.X)), free)
        self.kept: IntArray = kept
        self._root, self._back = (M[..., self._some[:, None], self._some] for M in (how.root, how.back))
        self._following = G[..., following[:, None], self._some]
        self._given = b[..., following]
        self.A: Array = how.rows[kept, None] * (G[..., kept[:, None], self._some] @ self._root)
        self.b: Array = how.rows[kept] * b[..., kept]

    def X(self, y: Array) -> Array:
        """All unknowns (..., x) of a y (..., n)."""
        some = _times(self._root, y)
        out = np.empty((*some.shape[:-1], len(self._some) + len(self._free)))
        out[..., self._some] = some
        # their rows of G X = b have one unknown foot each, with coefficient -1
        out[..., self._free] = _times(self._following, some) - self._given
        return out

    def directions(self, basis: Array) -> Array:
        """Changes of the unknowns (..., x, k) for changes of y, the columns of ``basis`` (..., n, k)."""
        some = self._root @ basis
        out = np.empty((*some.shape[:-2], len(self._some) + len(self._free), some.shape[-1]))
        out[..., self._some, :] = some
        out[..., self._free, :] = self._following @ some
        return out

    def y_of_rates(self, rho: Array) -> Array:
        """y of a free vector (..., x)."""
        return _times(self._back, rho[..., self._some])

    def y_of_gradient(self, gradient: Array) -> Array:
        """y of the rates W^-1 gradient (..., x); what a free foot's rate is worth goes to those that it follows."""
        through = _times(np.swapaxes(self._following, -1, -2), gradient[..., self._free])
        return _times(np.swapaxes(self._root, -1, -2), gradient[..., self._some] + through)


def _times(M: Array, v: Array) -> Array:
    return np.asarray((M @ v[..., None])[..., 0])
