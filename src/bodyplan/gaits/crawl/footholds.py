"""Where a foot can stand."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground

#: rings and directions of a search for footholds
RINGS, DIRECTIONS = 8, 24
#: directions in which the ground around a foothold is felt
AROUND = 12
#: m of distances that rounding may change; share of its radius by which a ball may be moved out of a hollow, how often
EXACT, HOLLOW, SETTLES = 1e-10, 1e-2, 20


def footholds(ground: Ground, nominal: Array, radius: float, max_slope: float, search: float) -> tuple[Array, str]:
    """Centres (k, 3) m, the best first, of balls of ``radius`` m on ground no steeper than ``max_slope`` rad at
    ``nominal`` (2,) m or as near to it as can be within ``search`` m; and why there is none (one ball is at ``nominal``
    then, if it can).

    A search prefers footholds with room for the ball at its sides and ground all around it: no riser or edge within a
    radius."""
    tried = nominal[None]
    if search > 0.0:
        rings = search * np.arange(1, RINGS + 1) / RINGS
        tried = np.concatenate([tried, nominal + (rings[:, None, None] * _ways(DIRECTIONS)).reshape(-1, 2)])
    there = _on(ground, tried)
    if not there.any():
        return np.array([[*nominal, radius]]), "no ground " + _where(search)
    tried = tried[there]
    normals = ground.normal(tried)
    centres, stands = _settled(ground, tried, normals, radius)
    flat = np.arccos(np.clip(normals[:, 2], -1.0, 1.0)) <= max_slope + EXACT
    good = np.flatnonzero(stands & flat)
    if not len(good):
        steep = f"the ground is steeper than {np.degrees(max_slope):.3g} deg, or an edge, {_where(search)}"
        return centres[:1], steep + ("" if search > 0.0 else '; foothold = "search" looks around')
    if search > 0.0:
        roomy = _roomy(ground, centres[good], radius, max_slope)
        good = np.concatenate([good[roomy], good[~roomy]])
    return centres[good], ""


def _where(search: float) -> str:
    return f"within {search:.3g} m" if search > 0.0 else "there"


def _ways(count: int) -> Array:
    angles = 2.0 * np.pi * np.arange(count) / count
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _on(ground: Ground, points: Array) -> BoolArray:
    """Which of points (k, 2) have ground below them."""
    try:
        ground.height(points)
    except InputError:
        if len(points) == 1:
            return np.zeros(1, dtype=bool)
        return np.concatenate([_on(ground, part) for part in np.array_split(points, 2)])
    return np.ones(len(points), dtype=bool)


def _settled(ground: Ground, points: Array, normals: Array, radius: float) -> tuple[Array, BoolArray]:
    """Centres (k, 3) of balls on the ground at ``points`` (k, 2), and which of them touch nothing else: a ball in a
    hollow that is hardly narrower than itself is moved out of it."""
    begun = np.concatenate([points, ground.height(points)[:, None]], axis=1) + radius * normals
    centres, gap = begun.copy(), _gap(ground, begun, radius)
    for _ in range(SETTLES):
        inside = np.flatnonzero((gap < -EXACT) & (gap > -HOLLOW * radius))
        if not len(inside):
            break
        centres[inside] -= gap[inside, None] * normals[inside]
        gap[inside] = _gap(ground, centres[inside], radius)
    moved = np.linalg.norm(centres - begun, axis=1)
    return centres, (gap >= -EXACT) & (moved <= 2.0 * HOLLOW * radius)


def _gap(ground: Ground, centres: Array, radius: float) -> Array:
    """Clearance (k,) m of balls; minus infinity beyond the edge of the ground."""
    there = _on(ground, centres[:, :2])
    out = np.full(len(centres), -np.inf)
    out[there] = ground.clearance(centres[there]) - radius
    return out


def _roomy(ground: Ground, centres: Array, radius: float, max_slope: float) -> BoolArray:
    """Which of balls at ``centres`` (k, 3) can rise with a radius of room at their sides, and have ground around them
    that is nowhere far below."""
    above = centres + 2.0 * radius * np.array([0.0, 0.0, 1.0])
    room = _gap(ground, above, radius) >= radius * (1.0 - 1e-3)
    around = centres[:, None, :2] + radius * _ways(AROUND)
    there = _on(ground, around.reshape(-1, 2)).reshape(around.shape[:2])
    depth = np.full(there.shape, np.inf)
    lowest = np.broadcast_to(centres[:, 2:] - radius, there.shape)
    depth[there] = lowest[there] - ground.height(around[there])
    return np.asarray(room & (depth <= radius * (np.tan(max_slope) + 0.5)).all(axis=1))
