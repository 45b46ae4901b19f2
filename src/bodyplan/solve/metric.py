"""What a rate costs: the metric that says which of infinitely many resolved rates is the smallest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError
from bodyplan.solve.partitions import Partition

#: rates of passive joints cost this much more: they are then 10^-4 of what a motor in their place would do
PASSIVE = 1e4


class Scale(NamedTuple):
    """A metric made ready for one partition. X = ``root`` y with cost |y|^2; ``back`` is its inverse. Both (x, x) or
    (..., x, x), zero rows and columns for the unknowns that are ``free`` (indices in X): they cost nothing and follow
    from the others. ``rows`` (6m,): what the equations are multiplied with to have one unit."""

    root: Array
    back: Array
    free: tuple[int, ...]
    rows: Array


@dataclass(frozen=True, kw_only=True)
class Metric:
    """Cost of rates: the sum of w_i X_i^2 in m^2/s^2, with w_i in m^2/rad^2 for an angle and 1 for a length.

    ``length`` m makes an angle's rate a speed (None: the mean length of the robot's chains, their constant links in one
    line), so that no result depends on whether lengths are in m or mm. Its square times a factor is the weight of an
    angle, the factor alone that of a length. Factors: ``actuated`` and ``passive`` for joints, ``body`` for components
    of the body, ``feet`` for those of feet. ``weights``: w_i by name, instead.

    The default counts how fast motors and body move. Passive joints (ankles that conform to the ground) cost 10^4 times
    as much: they have no motor, and a foot free to turn must not be turned by them to move the body, as a plain
    pseudo-inverse would. Where the orientation of the feet is known, so that passive joints merely follow, a small
    ``passive`` says that this costs nothing. Feet cost nothing by default (0): what is unknown of them follows.

    Raises InputError for a factor that is not > 0 (``feet``: >= 0).
    """

    length: float | None = None
    actuated: float = 1.0
    passive: float = PASSIVE
    body: float = 1.0
    feet: float = 0.0
    weights: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.length is not None:
            number(self.length, "Metric.length", above=0.0)
        for name in ("actuated", "passive", "body"):
            number(getattr(self, name), f"Metric.{name}", above=0.0)
        number(self.feet, "Metric.feet", at_least=0.0)
        if not isinstance(self.weights, Mapping):
            raise InputError(f"Metric.weights: expected a mapping from names to weights, got {self.weights!r}.")
        for name, weight in self.weights.items():
            number(weight, f"Metric.weights[{name!r}]", at_least=0.0)
        object.__setattr__(self, "weights", dict(self.weights))

    def vector(self, partition: Partition) -> Array:
        """(x,) weights of the unknowns of a partition. UnknownNameError for a weight whose name is none of them,
        InputError for weight 0 of anything but a foot."""
        length = self.length_for(partition)
        joints = np.where(partition.model.robot.actuated, self.actuated, self.passive)
        factor = {"foot": self.feet, "body": self.body}
        out = np.array([joints[c.number] if c.kind == "joint" else factor[c.kind] for c in partition.X])
        out[[unit == "rad/s" for unit in partition.unknown_units]] *= length**2
        for name, weight in self.weights.items():
            out[partition.column(name)] = weight
        for i, c in enumerate(partition.X):
            if out[i] == 0.0 and c.kind != "foot":
                raise InputError(
                    f"Metric.weights[{partition.unknown[i]!r}]: must be > 0; only a foot may cost nothing."
                )
        return out

    def length_for(self, partition: Partition) -> float:
        """m: ``length``, or the robot's own."""
        return partition.model.leg_length if self.length is None else self.length


def scale(metric: Metric | ArrayLike | None, partition: Partition) -> Scale:
    """``metric``: a :class:`Metric` (None: the default one), weights (x,) > 0, or symmetric positive definite matrices
    (x, x) or (..., x, x), in the order of ``partition.unknown``. InputError for another shape or a matrix that is not.
    """
    x = len(partition.X)
    if metric is None or isinstance(metric, Metric):
        metric = metric or Metric()
        length = metric.length_for(partition)
        rows = np.tile([1.0, 1.0, 1.0, length, length, length], len(partition.rows) // 6)
        return _diagonal(metric.vector(partition), rows)
    W, rows = finite(metric, "metric"), np.ones(len(partition.rows))
    if W.shape == (x,):
        if np.any(W <= 0.0):
            bad = int(np.argmax(W <= 0.0))
            raise InputError(f"metric: weights must be > 0, got {W[bad]} for {partition.unknown[bad]!r}.")
        return _diagonal(W, rows)
    if W.ndim < 2 or W.shape[-2:] != (x, x):
        raise InputError(f"metric: expected a Metric, ({x},) weights or ({x}, {x}) matrices, got shape {W.shape}.")
    if np.any(np.abs(W - np.swapaxes(W, -1, -2)) > 1e-9 * np.abs(W).max(axis=(-2, -1), keepdims=True, initial=0.0)):
        raise InputError("metric: a matrix must be symmetric.")
    try:
        back = np.swapaxes(np.linalg.cholesky(W), -1, -2)
    except np.linalg.LinAlgError as error:
        raise InputError("metric: a matrix must be positive definite.") from error
    return Scale(np.linalg.inv(back), back, (), rows)


def plain(partition: Partition) -> Scale:
    """No metric: rates count as the numbers that they are, whatever their units."""
    one = np.eye(len(partition.X))
    return Scale(one, one, (), np.ones(len(partition.rows)))


def _diagonal(weights: Array, rows: Array) -> Scale:
    free = tuple(int(i) for i in np.flatnonzero(weights == 0.0))
    root = np.sqrt(weights)
    inverse = np.divide(1.0, root, out=np.zeros_like(root), where=root > 0.0)
    return Scale(np.diag(inverse), np.diag(root), free, rows)
