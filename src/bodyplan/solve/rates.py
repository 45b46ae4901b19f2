"""Resolved rates: the unknown motions of feet, body and joints, and how well they meet what was commanded."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray, TextArray
from bodyplan.errors import SolveError, Status
from bodyplan.solve.partitions import Partition


class Rates:
    """Solution X of G X = H Y; ``...`` is the batch shape of the partition and Y.

    ``X`` (..., x) in the order of ``partition.unknown`` and ``Y`` (..., y), m/s and rad/s; by name, unknown or known:
    ``rates["fl.knee"]`` (...), a group ``rates["fl.foot.v"]`` (..., 3). ``qd`` (..., n) rates of all joints, ``twist``
    (..., 6) body-fixed twist of the base: what moves the robot on.

    ``rank`` (...) of G; ``condition`` (...) its largest over its smallest non-zero singular value, in the metric used
    (without the feet that cost nothing). ``residuals`` (..., 6m) = G X - H Y, ``residual`` (...) the largest of them.
    ``damped`` (...): whether a singularity was near enough for rates to be held down.

    ``status`` (...): "ok"; "conflict" where no rates do all that is commanded (X is then the nearest in least squares);
    "damped" where damping misses the command; "infeasible" where no rates keep within the limits (X then exceeds them
    by as little as possible, see ``excess``). ``reason`` says why, naming the equations or limits in conflict.

    Of the method "qp": ``limits`` names of the L inequalities, ``excess`` (..., L) m/s or rad/s by how much X exceeds
    each (0 within), ``pushing`` (..., L) where a limit holds X back or, of an infeasible request, takes part in the
    conflict.
    """

    def __init__(
        self,
        partition: Partition,
        X: Array,
        Y: Array,
        rank: IntArray,
        condition: Array,
        damped: BoolArray,
        status: TextArray,
        reason: Callable[[int], str],
        limits: tuple[str, ...] = (),
        excess: Array | None = None,
        pushing: BoolArray | None = None,
    ) -> None:
        self.partition = partition
        self.shape: tuple[int, ...] = X.shape[:-1]
        self.X, self.Y = X, np.array(np.broadcast_to(Y, (*self.shape, Y.shape[-1])))
        self.rank, self.condition, self.damped = (np.array(a) for a in (rank, condition, damped))
        self._status = np.array(status)
        self._reason = reason
        self.limits = limits
        self.excess = np.zeros((*self.shape, 0)) if excess is None else excess
        self.pushing = np.zeros((*self.shape, 0), dtype=bool) if pushing is None else pushing
        for array in (self.X, self.Y, self.rank, self.condition, self.damped, self._status, self.excess, self.pushing):
            array.flags.writeable = False

    def __getitem__(self, name: str) -> Array:
        components = self.partition.names.find(name, "rates")
        parts = []
        for component in components:
            unknown, i = self.partition.place(component)
            parts.append((self.X if unknown else self.Y)[..., i])
        return np.stack(parts, axis=-1) if len(parts) > 1 else parts[0]

    def _all(self, kind: str) -> Array:
        names = self.partition.names
        return np.stack([self[name] for name in names.of[kind]], axis=-1)

    @cached_property
    def qd(self) -> Array:
        """(..., n) rad/s or m/s: rates of all joints, known and unknown, columns as ``robot.joints``."""
        return self._all("joint")

    @cached_property
    def twist(self) -> Array:
        """(..., 6): body-fixed twist (v, omega) of the base, m/s and rad/s."""
        return np.asarray((self.partition.body_jacobian @ self._all("body")[..., None])[..., 0])

    @cached_property
    def residuals(self) -> Array:
        """(..., 6m) m/s or rad/s: G X - H Y, one a row of the partition."""
        left, right = ((M @ v[..., None])[..., 0] for M, v in ((self.partition.G, self.X), (self.partition.H, self.Y)))
        return np.asarray(left - right)

    @cached_property
    def residual(self) -> Any:
        """(...): the largest of ``residuals`` by size."""
        return np.abs(self.residuals).max(axis=-1)

    @property
    def status(self) -> Any:
        """(...) text, a :class:`~bodyplan.errors.Status`; one text for a single configuration."""
        return self._status if self.shape else str(self._status[()])

    @property
    def ok(self) -> bool:
        """True where every solve of the batch is "ok"."""
        return bool(np.all(self._status == Status.OK.value))

    @cached_property
    def reason(self) -> Any:
        """(...) text: why a solve is not "ok", empty where it is."""
        out = np.full(self.shape, "", dtype=object)
        for index in np.flatnonzero(self._status.ravel() != Status.OK.value):
            out[np.unravel_index(index, self.shape)] = self._reason(int(index))
        return out if self.shape else str(out[()])

    def raise_if_failed(self) -> Rates:
        """These rates, or SolveError with the status and reason of the first solve that failed."""
        flat = self._status.ravel()
        for index in np.flatnonzero(flat != Status.OK.value):
            raise SolveError(Status(str(flat[index])), self._reason(int(index)), int(index) if self.shape else None)
        return self

    def __repr__(self) -> str:
        return f"Rates({self.X.shape[-1]} unknown, batch {self.shape}, {'ok' if self.ok else 'not ok'})"
