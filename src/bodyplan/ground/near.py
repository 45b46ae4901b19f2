"""Clearance where only little of it matters: exact up to a cap, for a small share of what all of it costs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.ground.base import SEGMENT_POINTS, Ground, segments, spatial_points
from bodyplan.ground.field import Field


def clearance_up_to(ground: Ground, points: ArrayLike, cap: ArrayLike) -> Array:
    """min(``ground.clearance(points)``, ``cap``) (...,) m for points (..., 3) and caps that broadcast to (...,) m.

    Over curved ground a point is farther from it than its cap where bounds of the height around it, as far as the cap,
    say so, often for many points at once; only the others are searched for their nearest point.
    """
    p = spatial_points(points)
    most = np.broadcast_to(np.asarray(cap, dtype=np.float64), p.shape[:-1])
    if not isinstance(ground, Field) or not most.size:
        return np.minimum(ground.clearance(p), most) if most.size else most.copy()
    return ground.nearest_up_to(p.reshape(-1, 1, 3), most.ravel())[1].reshape(most.shape)


def segment_clearance_up_to(ground: Ground, ends: ArrayLike, cap: ArrayLike) -> Array:
    """min(``ground.segment_clearance(ends)``, ``cap``) (...,) m for segments (..., 2, 3)."""
    e = segments(ends)
    most = np.broadcast_to(np.asarray(cap, dtype=np.float64), e.shape[:-2])
    if not isinstance(ground, Field):
        return np.minimum(ground.segment_clearance(e), most)
    s = np.linspace(0.0, 1.0, SEGMENT_POINTS)[:, None]
    points = e[..., None, 0, :] * (1.0 - s) + e[..., None, 1, :] * s
    return ground.nearest_up_to(points.reshape(-1, SEGMENT_POINTS, 3), most.ravel())[1].reshape(most.shape)
