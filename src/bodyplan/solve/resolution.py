"""``bp.solve.resolve``: the unknown rates of a partition, by the pseudo-inverse, a metric, or within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, TextArray, finite, number
from bodyplan.errors import InputError, Status
from bodyplan.solve.conflict import TOLERANCE, conflict, described
from bodyplan.solve.core import Core
from bodyplan.solve.inverse import solve
from bodyplan.solve.limits import Limits, inequalities
from bodyplan.solve.metric import Metric, plain, scale
from bodyplan.solve.partitions import Partition
from bodyplan.solve.rates import Rates
from bodyplan.solve.within import keep_within

METHODS = ("min_norm", "weighted", "qp")
#: a singular value below this share of the largest is damped by default: rates would be a million times the command
NEAR = 1e-6

Vector = ArrayLike | Mapping[str, ArrayLike]


def resolve(
    partition: Partition,
    Y: Vector,
    *,
    method: str | None = None,
    metric: Metric | ArrayLike | None = None,
    rho: Vector | None = None,
    gradient: Vector | None = None,
    d: ArrayLike = 1.0,
    damping: str | float = "auto",
    near: float = NEAR,
    limits: Limits | None = None,
) -> Rates:
    """Unknown rates X with G X = H Y for known rates ``Y``: an array (..., y) in the order of ``partition.known``, or a
    mapping from names to values (see :meth:`Partition.values`). Batch shapes broadcast.

    ``method``:

    * "min_norm": X = G# H Y + d (I - G# G) rho with the pseudo-inverse: paper *legs* eq. (18) with its missing H. It
      adds squares of m/s and of rad/s, so that the result depends on the unit of length, and it uses passive joints as
      if they were motors.
    * "weighted": the X with the smallest cost in a ``metric``, by default that of :class:`Metric`; the same formula
      with the weighted inverse W^-1/2 (G W^-1/2)# and the projector that belongs to it.
    * "qp": the X nearest to d rho in that metric with G X = H Y and within ``limits`` (:class:`Limits`); where it
      reaches none of them the same X as "weighted". Needs the extra "solve".

    When None: "qp" if there are limits, "weighted" if there is a metric, else "min_norm". ``metric``: a
    :class:`Metric`, weights (x,), or symmetric positive definite matrices (..., x, x).

    ``rho`` (..., x), or by name (0 where not named): the free vector. Or ``gradient``, alike, of a quantity to be
    raised: rho = W^-1 gradient is its steepest ascent in the metric and never lowers it, which the oblique projector
    of a weighted inverse may do to the bare gradient. ``d`` (...): how much of it.

    ``damping``: "auto" holds down directions whose singular value is below ``near`` times the largest, and only those:
    rates are then at most the commanded over ``near``. In the default metric a singular value is a speed of feet over a
    speed of joints; ``near`` = 0.02 keeps a knee from rushing where it is almost straight. A number: lambda of damped
    least squares in all directions; 0: never. Damped stance feet slip: see ``residual``, and the status "damped".

    Raises InputError for options that do not go together or have a wrong shape, UnknownNameError for a name.
    """
    if not isinstance(partition, Partition):
        raise InputError(f"partition: expected a Partition, got {type(partition).__name__}.")
    method = _method(method, metric, limits)
    strength = _damping(damping)
    number(near, "near", above=0.0, below=1.0)
    how = plain(partition) if method == "min_norm" else scale(metric, partition)
    y, factor = partition.values(Y), finite(d, "d")
    free, ascends = _free_vector(partition, rho, gradient)
    batches = {"Y": y.shape[:-1], "d": factor.shape, "metric": how.root.shape[:-2]}
    if free is not None:
        batches["gradient" if ascends else "rho"] = free.shape[:-1]
    shape = _batch(partition.shape, batches)
    G, H = (np.broadcast_to(M, (*shape, *M.shape[-2:])) for M in (partition.G, partition.H))
    y = np.broadcast_to(y, (*shape, y.shape[-1]))
    core = Core(partition, how, G, (H @ y[..., None])[..., 0])
    pull = None
    if free is not None:
        pull = (core.y_of_gradient if ascends else core.y_of_rates)(factor[..., None] * free)
    found = solve(core.A, core.b, pull, strength, near, full=method == "qp")
    size = TOLERANCE * (how.rows * (np.abs(H) @ np.abs(y)[..., None])[..., 0]).max(axis=-1)
    status: TextArray = np.full(shape, Status.OK.value, dtype="<U16")
    status[found.missed > size] = Status.DAMPED.value
    status[found.outside > size] = Status.CONFLICT.value
    X = core.X(found.y)
    told = found.rank + len(how.free), np.array(found.condition), np.array(found.damped)
    if method != "qp":
        return Rates(partition, X, y, *told, status, _reasons(partition, G, H, y, found.missed, status, None))
    rows = inequalities(partition, limits or Limits())
    held = keep_within(X, y, core, found, rows, status)
    why = _reasons(partition, G, H, y, found.missed, status, held.reason)
    return Rates(partition, held.X, y, *told, status, why, rows.labels, held.excess, held.pushing)


def _reasons(
    partition: Partition,
    G: Array,
    H: Array,
    Y: Array,
    missed: Array,
    status: TextArray,
    infeasible: Callable[[int], str] | None,
) -> Callable[[int], str]:
    """Why the sample of a flat index failed: worked out for those only that someone asks about."""

    def reason(index: int) -> str:
        at = np.unravel_index(index, status.shape)
        outcome = str(status[at])
        if outcome == Status.CONFLICT.value:
            found = conflict(G[at], H[at], Y[at])
            if found is None:
                return "the known rates contradict each other by little more than rounding"
            return described(found, partition.rows, partition.known, partition.known_units)
        if outcome == Status.DAMPED.value:
            return f"near a singularity; damping misses the command by {missed[at]:.3g}"
        if outcome == Status.INFEASIBLE.value and infeasible is not None:
            return infeasible(index)
        return "the solver found neither rates within the limits nor which limits contradict each other"

    return reason


def _method(method: str | None, metric: object, limits: object) -> str:
    if method is None:
        method = "qp" if limits is not None else "min_norm" if metric is None else "weighted"
    if method not in METHODS:
        raise InputError(f"method: must be one of {', '.join(METHODS)}, got {method!r}.")
    if method == "min_norm" and metric is not None:
        raise InputError("metric: method 'min_norm' has none; use 'weighted'.")
    if method != "qp" and limits is not None:
        raise InputError(f"limits: method {method!r} keeps none; use 'qp'.")
    if limits is not None and not isinstance(limits, Limits):
        raise InputError(f"limits: expected Limits, got {type(limits).__name__}.")
    return method


def _damping(damping: str | float) -> float | None:
    if isinstance(damping, str):
        if damping != "auto":
            raise InputError(f"damping: must be 'auto' or a number >= 0, got {damping!r}.")
        return None
    return number(damping, "damping", at_least=0.0)


def _free_vector(partition: Partition, rho: Vector | None, gradient: Vector | None) -> tuple[Array | None, bool]:
    """(rho or gradient (..., x), whether it is the gradient)."""
    if rho is not None and gradient is not None:
        raise InputError("rho, gradient: give one of them.")
    field, given = ("gradient", gradient) if rho is None else ("rho", rho)
    if given is None:
        return None, False
    x = len(partition.X)
    if isinstance(given, Mapping):
        columns = {partition.column(name): finite(value, f"{field}[{name!r}]") for name, value in given.items()}
        try:
            shape = np.broadcast_shapes(*(value.shape for value in columns.values()))
        except ValueError as error:
            raise InputError(f"{field}: shapes of the values do not broadcast: {error}.") from error
        out = np.zeros((*shape, x))
        for i, value in columns.items():
            out[..., i] = value
    else:
        out = finite(given, field)
        if out.ndim == 0 or out.shape[-1] != x:
            raise InputError(f"{field}: expected shape (..., {x}), one for each unknown, got {out.shape}.")
    return out, rho is None


def _batch(shape: tuple[int, ...], others: Mapping[str, tuple[int, ...]]) -> tuple[int, ...]:
    for name, other in others.items():
        try:
            shape = np.broadcast_shapes(shape, other)
        except ValueError as error:
            raise InputError(f"{name}: batch shape {other} does not broadcast with {shape}.") from error
    return shape
