"""Distance to ground whose cross-section is bounded by level and upright edges."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bodyplan.arrays import Array

#: an edge from (u, w) to (u, w); the ends may lie at infinity, for level edges only
Edge = tuple[float, float, float, float]


def distance_to_edges(u: Array, w: Array, edges: Sequence[Edge]) -> Array:
    """Distance (...,) from points (u, w) to the nearest of the edges, each level or upright.

    For such edges the nearest point is the point itself, clipped to the edge coordinate by coordinate.
    """
    best = np.full(np.shape(u), np.inf)
    for u0, w0, u1, w1 in edges:
        du = u - np.clip(u, min(u0, u1), max(u0, u1))
        dw = w - np.clip(w, min(w0, w1), max(w0, w1))
        np.minimum(best, np.hypot(du, dw), out=best)
    return best
