"""Statics of a robot on its feet: what each carries, and the torques that hold it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.gaits.crawl.holding_kernel import held, weighed
from bodyplan.gaits.crawl.legs import Legs
from bodyplan.spatial import matrix_from_quaternion

GRAVITY = 9.81
#: squared width of a stance, as a share of its squared size, below which feet count as standing in a line
FLAT = 1e-4


@dataclass(frozen=True, eq=False)
class Holding:
    """``loads`` (T, m) N, upright, of the feet, negative where the ground would have to pull; ``torques`` (T, n) N m (N
    of slides); ``peak`` N m."""

    loads: Array
    torques: Array
    peak: float


def holding(legs: Legs, q: Array, base: Array, standing: BoolArray) -> Holding | None:
    """Statics without friction at ``q`` (T, n), ``base`` (T, 7) with feet ``standing`` (T, m): the loads of least
    square that hold. None for a robot without masses."""
    tables = legs.tables
    mass = float(tables.body[0] + tables.masses.sum())
    if not mass > 0.0:
        return None
    q = np.ascontiguousarray(q)
    center, feet = np.empty((len(q), 3)), np.empty((*standing.shape, 3))
    weighed(tables, q, center, feet)
    turn = matrix_from_quaternion(base[:, 3:])
    away = np.einsum("tij,tmj->tmi", turn[:, :2], feet - center[:, None])
    loads = mass * GRAVITY * _shares(away, standing)
    torques = np.zeros_like(q)
    held(tables, q, np.ascontiguousarray(turn[:, 2]), loads, GRAVITY, torques)
    return Holding(loads, torques, float(np.abs(torques).max(initial=0.0)))


def _shares(away: Array, standing: BoolArray) -> Array:
    """The shares (T, m) of the weight of least square that feet ``standing`` (T, m) carry, from where they are seen
    from the centre of mass, ``away`` (T, m, 2) m. Where feet in a line cannot hold it, those of least error."""
    on = standing.astype(np.float64)
    count = on.sum(axis=1, keepdims=True)
    middle = (away * on[..., None]).sum(axis=1, keepdims=True) / count[..., None]
    off = (away - middle) * on[..., None]
    x, y = off[..., 0], off[..., 1]
    xx, xy, yy = ((a * b).sum(axis=1, keepdims=True) for a, b in ((x, x), (x, y), (y, y)))
    wide = xx * yy - xy * xy
    flat = ~(wide > FLAT * (xx + yy) ** 2)[:, 0]
    wide[flat] = 1.0
    mx, my = middle[..., 0], middle[..., 1]
    out = on / count - (x * (yy * mx - xy * my) + y * (xx * my - xy * mx)) / wide
    if flat.any():
        balance = np.concatenate([np.ones((*away.shape[:2], 1)), away], axis=2)[flat] * on[flat, :, None]
        out[flat] = np.linalg.pinv(np.swapaxes(balance, 1, 2))[:, :, 0]
    return np.asarray(out)
