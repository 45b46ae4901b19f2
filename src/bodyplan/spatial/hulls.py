"""Standing on feet: distance of the centre of mass from the edges of the support polygon, seen from above."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array


def edge_distances(feet: Array, center: Array) -> Array:
    """Distances (..., p) m of ``center`` (..., 2) from the edges of the hull of ``feet`` (..., k, 2), positive inside;
    inf where a pair of feet is no edge. p = k (k - 1) pairs.

    A pair of points is an edge of their hull where all others lie to one side of it. Feet in one line, or in one place,
    have nothing inside: the smallest distance is 0 on the line between them and negative elsewhere.
    """
    count = feet.shape[-2]
    i, j = (index.ravel() for index in np.nonzero(~np.eye(count, dtype=bool)))
    start, way = feet[..., i, :], feet[..., j, :] - feet[..., i, :]
    length = np.hypot(way[..., 0], way[..., 1])
    ahead = way / np.where(length > 0.0, length, 1.0)[..., None]
    normal = np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
    apart = feet[..., None, :, :] - start[..., None, :]
    others = np.einsum("...pkc,...pc->...pk", apart, normal)
    slack = 1e-12 * (1.0 + length[..., None])
    edge = (others >= -slack).all(axis=-1) & (length > 0.0)
    away = center[..., None, :] - start
    inside = np.einsum("...pc,...pc->...p", away, normal)
    flat = edge & (others <= slack).all(axis=-1)
    if np.any(flat):  # then both ends count, too
        along, at = np.einsum("...pkc,...pc->...pk", apart, ahead), np.einsum("...pc,...pc->...p", away, ahead)
        ends = np.minimum(at - along.min(axis=-1), along.max(axis=-1) - at)
        inside = np.where(flat, np.minimum(inside, ends), inside)
    out = np.where(edge, inside, np.inf)
    together = ~(length > 0.0).any(axis=-1)
    if np.any(together):
        out[together] = -np.linalg.norm(away, axis=-1)[together]
    return np.asarray(out)


def margin(feet: Array, center: Array) -> Array:
    """(...,) m: the smallest of :func:`edge_distances`."""
    return np.asarray(edge_distances(feet, center).min(axis=-1))
