"""How fast the margins of a standing robot change with what moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray
from bodyplan.solve.partitions import Partition
from bodyplan.solve.stability.ascent import Ascent, Psi, standing
from bodyplan.solve.stability.margins import hull_edges, measure_distance


class Slopes(NamedTuple):
    """Margins of a standing robot, one an edge of its support: e pairs of feet that are one somewhere in the batch
    ``...``. ``pairs`` (e names), ``real`` (..., e), ``distance`` (..., e) m, and its derivative ``slope`` (..., e,
    x + y) by the coordinates that the unknown and the known rates of a partition move; 0 where a pair is no edge."""

    pairs: tuple[str, ...]
    real: BoolArray
    distance: Array
    slope: Array


def margin_slopes(partition: Partition, stance: Sequence[str] | None, com: Any, gravity: ArrayLike) -> Slopes:
    """The distances of :func:`~bodyplan.solve.stability.tip_margins` and their slopes; other arguments as those of
    :meth:`~bodyplan.solve.stability.Objective.at`. Raises InputError or UnknownNameError."""
    model = partition.model
    at = standing(model, stance, com)
    edges = hull_edges(at.points, gravity, at.com)
    measure = measure_distance(edges)
    shape, m = edges.number.shape, len(at.feet)
    ends = edges.feet.reshape(-1, m, 2)
    pairs = sorted({(int(i), int(j)) for i, j in ends[ends[..., 0] >= 0]})
    real = np.zeros((*shape, len(pairs)), dtype=np.bool_)
    distance = np.zeros((*shape, len(pairs)))
    slope = np.zeros((*shape, len(pairs), len(partition.X) + len(partition.Y)))
    for p, pair in enumerate(pairs):
        mine = np.all(edges.feet == np.array(pair), axis=-1)
        real[..., p] = mine.any(axis=-1)
        distance[..., p] = np.where(mine, measure.value, 0.0).sum(axis=-1)
        by_a, by_b = (np.where(mine[..., None], by, 0.0).sum(axis=-2) for by in (measure.by_a, measure.by_b))
        by_feet = np.zeros((*shape, m, 3))
        by_feet[..., pair[0], :], by_feet[..., pair[1], :] = by_a, by_b
        psi = Psi(distance[..., p], -(by_a + by_b), by_feet, np.zeros((*shape, 2)))
        by = Ascent(model, at.feet, at.center, at.slope, at.com, psi).by(partition)
        slope[..., p, :] = np.concatenate([by(partition.X), by(partition.Y)], axis=-1)
    names = [model.feet[i] for i in at.feet]
    return Slopes(tuple(f"{names[i]}-{names[j]}" for i, j in pairs), real, distance, slope)
