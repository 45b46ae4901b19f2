"""Standing on feet: distance of the centre of mass from the edges of the support polygon, seen from above."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array


def edge_distances(feet: Array, center: Array) -> Array:
    """Distances (..., p) m of ``center`` (..., 2) from the edges of the hull of ``feet`` (..., k, 2), positive inside;
    inf where a pair of feet is no edge. p = k (k - 1) pairs.

    A pair of points is an edge of their hull where all others lie to one side of it.
    """
    count = feet.shape[-2]
    i, j = (index.ravel() for index in np.nonzero(~np.eye(count, dtype=bool)))
    start, way = feet[..., i, :], feet[..., j, :] - feet[..., i, :]
    length = np.hypot(way[..., 0], way[..., 1])
    normal = np.stack([-way[..., 1], way[..., 0]], axis=-1) / np.where(length > 0.0, length, 1.0)[..., None]
    others = np.einsum("...pkc,...pc->...pk", feet[..., None, :, :] - start[..., None, :], normal)
    edge = (others >= -1e-12 * (1.0 + length[..., None])).all(axis=-1) & (length > 0.0)
    inside = np.einsum("...pc,...pc->...p", center[..., None, :] - start, normal)
    return np.asarray(np.where(edge, inside, np.inf))


def margin(feet: Array, center: Array) -> Array:
    """(...,) m: the smallest of :func:`edge_distances`."""
    return np.asarray(edge_distances(feet, center).min(axis=-1))
