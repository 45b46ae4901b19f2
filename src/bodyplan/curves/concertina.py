"""The concertina curve: tail, body modules and head of dynamic curves (paper *concertina*, section III)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, finite, frozen, number, whole
from bodyplan.curves import pieces as pc
from bodyplan.errors import InputError, UnknownNameError

#: Gauss-Legendre rule on [0, 1]
GAUSS_NODES, GAUSS_WEIGHTS = (
    frozen(values)
    for values in ((np.polynomial.legendre.leggauss(12)[0] + 1) / 2, np.polynomial.legendre.leggauss(12)[1] / 2)
)


class ConcertinaCurve:
    """Body curve y(x), x >= 0, of a concertina snake; all lengths in curve units.

    With X = omega x the tail is ``tail sin X`` on [0, pi/2] (eq. (2), sign corrected); body module k is
    ``V_k F(x - x_k; gamma_k)`` with V_1 = tail and V_{k+1} = V_k F(module end; gamma_k), which carries the sign,
    so that (3)'s alternating factor is not applied again; the head is a dynamic curve up to its
    ``crossing``-th zero (eqs. (5)-(7), with /omega everywhere), then y = 0.

    ``body_gammas`` (..., N_B) from tail to head, ``head_gamma`` (...) and ``tail`` (...) may carry a batch
    shape. ``rule``:

    * ``"cut"`` (default): once a module ends on the side it started on (gamma >= 0.676454...), follow it to its own
      first zero, then y = 0 for the rest of the body. Continuous; starting the line at the junction would jump by
      up to 0.0777.
    * ``"product"``: the amplitude rule alone; a stretched body keeps a small wave.
    * ``"natural"``: modules of length pi/(omega sqrt(1 - gamma^2)), whose junctions are C1.

    ``lead`` puts a straight line of that length before the tail; everything else moves on by as much.

    Raises InputError for gamma outside [0, 1] (below 1 for "natural"), omega <= 0, crossing < 1, no body module.
    """

    def __init__(
        self,
        body_gammas: ArrayLike,
        head_gamma: ArrayLike,
        tail: ArrayLike = 1.0,
        omega: float = 1.0,
        crossing: int = 2,
        rule: str = "cut",
        lead: float = 0.0,
    ) -> None:
        body = finite(body_gammas, "body_gammas")
        if body.ndim == 0 or body.shape[-1] == 0:
            raise InputError("body_gammas: needs at least one body module.")
        head, multiplier = finite(head_gamma, "head_gamma"), finite(tail, "tail")
        if rule not in pc.RULES:
            raise UnknownNameError("rule", rule, pc.RULES)
        try:
            shape = np.broadcast_shapes(body.shape[:-1], head.shape, multiplier.shape)
        except ValueError as error:
            raise InputError(
                f"batch shapes do not broadcast: body_gammas {body.shape}, head_gamma {head.shape}, "
                f"tail {multiplier.shape}."
            ) from error
        for field, values in (("body_gammas", body), ("head_gamma", head)):
            wrong = (values < 0.0) | ((values >= 1.0) if rule == "natural" else (values > 1.0))
            if np.any(wrong):
                top = "1)" if rule == "natural" else "1]"
                raise InputError(f"{field}: gamma must lie in [0, {top}, got {values[wrong].flat[0]}.")
        self.rule = rule
        self.omega = number(omega, "omega", above=0.0)
        self.crossing = whole(crossing, "crossing", at_least=1)
        self.lead = number(lead, "lead", at_least=0.0)
        self.batch = shape
        modules = body.shape[-1]
        self.body_gammas = frozen(np.broadcast_to(body, (*shape, modules)))
        self.head_gamma = frozen(np.broadcast_to(head, shape))
        self.tail = frozen(np.broadcast_to(multiplier, shape))
        size = int(np.prod(shape))
        gammas = np.concatenate([self.body_gammas, self.head_gamma[..., None]], axis=-1).reshape(size, modules + 1)
        table = np.zeros((size, modules + 4, pc.COLUMNS))
        counts = np.zeros(size, dtype=np.int64)
        pc.build_batch(self.tail.ravel(), gammas, self.omega, self.crossing, pc.RULES[rule], self.lead, table, counts)
        self._pieces, self._counts = table, counts

    @property
    def pieces(self) -> tuple[Array, IntArray]:
        """Table (B, p, COLUMNS) of :mod:`bodyplan.curves.pieces` and its row counts (B,), B the batch size."""
        return self._pieces, self._counts

    @property
    def body_modules(self) -> int:
        """N_B."""
        return int(self.body_gammas.shape[-1])

    @property
    def flat_from(self) -> Any:
        """x' from which y = 0, shape of the batch (a float for one curve); inf where gamma = 1 never crosses."""
        flat = self._pieces[np.arange(len(self._counts)), self._counts - 1, pc.START].reshape(self.batch)
        return float(flat) if not self.batch else flat

    @property
    def breaks(self) -> Array:
        """x of the junctions after the tail, flat_from included, ascending, shape (..., N_B + 2); where a module is
        cut short, the unused ones repeat flat_from."""
        first = 2 if self.lead > 0.0 else 1
        starts = self._pieces[:, first : first + self.body_modules + 2, pc.START].copy()
        for row, count in zip(starts, self._counts, strict=True):
            row[count - first :] = row[count - first - 1]
        return starts.reshape(*self.batch, starts.shape[1])

    def _evaluate(self, x: ArrayLike) -> tuple[Array, Array]:
        xs = finite(x, "x")
        if np.any(xs < 0.0):
            raise InputError(f"x: the curve starts at its tail, x = 0, got {xs.min()}.")
        # a batch of curves: leading axes of x are the batch, or x is shared by all curves
        if self.batch:
            if xs.shape[: len(self.batch)] != self.batch:
                xs = np.broadcast_to(xs, (*self.batch, *xs.shape))
            rows = xs.reshape(len(self._counts), int(np.prod(xs.shape[len(self.batch) :])))
        else:
            rows = xs.reshape(1, -1)
        y, slope = np.empty(rows.shape), np.empty(rows.shape)
        pc.evaluate(np.ascontiguousarray(rows), self._pieces, self._counts, self.omega, y, slope)
        return y.reshape(xs.shape), slope.reshape(xs.shape)

    def __call__(self, x: ArrayLike) -> Array:
        """y(x). For one curve the shape is that of x; for a batch, x is (*batch, ...) or shared by all curves,
        and the result is (*batch, ...)."""
        return self._evaluate(x)[0]

    def slope(self, x: ArrayLike) -> Array:
        """dy/dx, the right-hand one at a junction; shapes as for the call."""
        return self._evaluate(x)[1]

    def offset(self, x: Array, y: Array) -> Array:
        """Distance, to first order, of points (x, y) from the curve: |y - y(x)| / sqrt(1 + slope^2), negative below.

        Shapes as for the call. Points behind the start (by rounding at most) are measured from the start.
        """
        ahead = np.maximum(x, 0.0)
        value, slope = self._evaluate(ahead)
        off = (np.asarray(y) - value) / np.sqrt(1.0 + slope * slope)
        return np.where(np.asarray(x) < 0.0, np.hypot(off, ahead - x), off)

    def arclength(self, x: ArrayLike) -> Array:
        """Arc length from the tail end to x, shapes as for the call, error <= 1e-13 relative."""
        xs = finite(x, "x")
        if np.any(xs < 0.0):
            raise InputError(f"x: the curve starts at its tail, x = 0, got {xs.min()}.")
        if self.batch and xs.shape[: len(self.batch)] != self.batch:
            xs = np.broadcast_to(xs, (*self.batch, *xs.shape))
        rows = np.ascontiguousarray(xs.reshape(len(self._counts), int(np.prod(xs.shape[len(self.batch) :]))))
        out = np.empty(rows.shape)
        _arclengths(rows, self._pieces, self._counts, self.omega, GAUSS_NODES, GAUSS_WEIGHTS, out)
        return out.reshape(xs.shape)

    def __repr__(self) -> str:
        if self.batch:
            return f"ConcertinaCurve(batch {self.batch}, {self.body_modules} body modules, rule={self.rule!r})"
        return (
            f"ConcertinaCurve({self.body_gammas.tolist()}, {float(self.head_gamma)}, tail={float(self.tail)}, "
            f"omega={self.omega}, crossing={self.crossing}, rule={self.rule!r})"
        )


@njit(cache=True)
def _arclengths(
    x: Array, pieces: Array, counts: IntArray, omega: float, nodes: Array, weights: Array, out: Array
) -> None:
    for b in range(x.shape[0]):
        for i in range(x.shape[1]):
            out[b, i] = pc.arc_between(0.0, x[b, i], pieces[b], counts[b], omega, nodes, weights)
