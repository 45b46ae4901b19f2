"""Clearance where only little of it matters: exact up to a cap, for a small share of what all of it costs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.ground.base import SEGMENT_POINTS, Ground, segments, spatial_points
from bodyplan.ground.field import Field

#: points whose surroundings are bounded at once; smallest reach, m
_CHUNK, _LEAST = 32_768, 1e-9


def clearance_up_to(ground: Ground, points: ArrayLike, cap: ArrayLike) -> Array:
    """min(``ground.clearance(points)``, ``cap``) (...,) m for points (..., 3) and caps that broadcast to (...,) m.

    Over curved ground a point is farther from it than its cap where bounds of the height around it, as far as the cap,
    say so; only the others are searched for their nearest point.
    """
    p = spatial_points(points)
    most = np.broadcast_to(np.asarray(cap, dtype=np.float64), p.shape[:-1])
    if not isinstance(ground, Field) or not most.size:
        return np.minimum(ground.clearance(p), most) if most.size else most.copy()
    flat, out = p.reshape(-1, 3), most.flatten()
    ground.height(flat)  # refuses a point beyond the edge or without ground
    low, high = ground.field_box
    for k in range(0, len(flat), _CHUNK):
        part, reach = flat[k : k + _CHUNK], np.maximum(out[k : k + _CHUNK], _LEAST)
        around = (part[:, :2] - reach[:, None], part[:, :2] + reach[:, None])
        top = ground.field_bounds(*(np.clip(corner, low, high) for corner in around)).z[1]
        near = k + np.flatnonzero(~(part[:, 2] - top > reach))  # what is not known is near
        if len(near):
            out[near] = np.minimum(ground.clearance(flat[near]), out[near])
    return out.reshape(most.shape)


def segment_clearance_up_to(ground: Ground, ends: ArrayLike, cap: ArrayLike) -> Array:
    """min(``ground.segment_clearance(ends)``, ``cap``) (...,) m for segments (..., 2, 3)."""
    e = segments(ends)
    most = np.broadcast_to(np.asarray(cap, dtype=np.float64), e.shape[:-2])
    if not isinstance(ground, Field):
        return np.minimum(ground.segment_clearance(e), most)
    s = np.linspace(0.0, 1.0, SEGMENT_POINTS)[:, None]
    points = e[..., None, 0, :] * (1.0 - s) + e[..., None, 1, :] * s
    return np.asarray(clearance_up_to(ground, points, most[..., None]).min(axis=-1))
