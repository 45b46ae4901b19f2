"""Quantities to be raised by a robot's free motions: how stable, how level and how high it stands, with gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite, number
from bodyplan.errors import InputError
from bodyplan.solve.configuration import Model
from bodyplan.solve.stability.ascent import Ascent, Psi, ascent
from bodyplan.solve.stability.margins import DOWN, Edges, hull_edges, measure_distance, measure_mu

KINDS = ("printed", "text", "min_mu", "barrier")


@dataclass(frozen=True)
class Objective:
    """psi, to be raised. With mu_j of paper *legs* eq. (21) for the edges of the hull of the feet, distances d_j of
    :func:`tip_margins`, and roll alpha, pitch beta of the body:

    * "printed": k1 prod_j (mu_j - k2 alpha^2 - k3 beta^2), eq. (22) as printed. Kept for comparison.
    * "text": k1 prod_j mu_j - k2 alpha^2 - k3 beta^2, which the paper describes. A product is no test of stability: it
      is positive, too, where two mu_j are negative.
    * "min_mu": k1 times a smooth minimum of mu_j, -log(sum_j exp(-sharpness mu_j)) / sharpness, at most log(m) /
      sharpness below the true one; - k2 alpha^2 - k3 beta^2.
    * "barrier": k1 sum_j log(d_j / relax), carried on from d_j = ``relax`` m downwards by its parabola, so that it is
      smooth and defined outside of the support, too; - k2 alpha^2 - k3 beta^2.

    mu_j grows when the body sinks: "printed" and "text" crouch, and so does "min_mu" unless ``height`` m (of the centre
    of mass, upwards in the frame of gravity) adds - k4 (height of the com - height)^2. The barrier does not see height.

    ``k1`` > 0 and ``k2``, ``k3`` in 1/rad^2, ``k4`` in 1/m^2, >= 0. Feet that join or leave the hull change the number
    of edges and let psi jump; feet at rest do not.

    Raises InputError for a kind that does not exist and for numbers out of range.
    """

    kind: str = "barrier"
    k1: float = 1.0
    k2: float = 1.0
    k3: float = 1.0
    height: float | None = None
    k4: float = 1.0
    sharpness: float = 50.0
    relax: float = 0.005

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"Objective.kind: must be one of {', '.join(KINDS)}, got {self.kind!r}.")
        for name in ("k1", "sharpness", "relax"):
            number(getattr(self, name), f"Objective.{name}", above=0.0)
        for name in ("k2", "k3", "k4"):
            number(getattr(self, name), f"Objective.{name}", at_least=0.0)
        if self.height is not None:
            number(self.height, "Objective.height")

    def __call__(
        self, feet: ArrayLike, com: ArrayLike, attitude: ArrayLike | None = None, gravity: ArrayLike = DOWN
    ) -> Psi:
        """psi for ``feet`` (..., m, 3) m, m >= 3, ``com`` (..., 3) m, ``attitude`` (..., 2) roll and pitch in rad
        (needed unless k2 = k3 = 0), ``gravity`` (..., 3) of any length. Batch shapes broadcast. Raises InputError as
        :func:`tip_margins`."""
        edges = hull_edges(feet, gravity, com)
        shape = edges.number.shape
        if attitude is None:
            if self.k2 or self.k3:
                raise InputError("attitude: needed for k2 alpha^2 + k3 beta^2; give (roll, pitch), or k2 = k3 = 0.")
            attitude = np.zeros(2)
        turn = finite(attitude, "attitude")
        if turn.shape[-1:] != (2,) or np.broadcast_shapes(shape, turn.shape[:-1]) != shape:
            raise InputError(f"attitude: expected shape (..., 2) that broadcasts to {(*shape, 2)}, got {turn.shape}.")
        weights = np.array([self.k2, self.k3])
        tilt, by_turn = (weights * turn**2).sum(axis=-1), np.broadcast_to(2.0 * weights * turn, (*shape, 2))
        margin = measure_distance(edges) if self.kind == "barrier" else measure_mu(edges)
        if self.kind == "printed":
            value, by_margin = _product(margin.value - tilt[..., None], edges.real)
            by_tilt = -self.k1 * by_margin.sum(axis=-1)
            value = self.k1 * value
        else:
            of = {"text": _product, "min_mu": self._smooth_minimum, "barrier": self._barrier}[self.kind]
            value, by_margin = of(margin.value, edges.real)
            value, by_tilt = self.k1 * value - tilt, np.full(shape, -1.0)
        scaled = self.k1 * by_margin[..., None]
        by_com, by_feet = _gather(edges, scaled * margin.by_a, scaled * margin.by_b)
        if self.height is not None:
            up = -edges.g
            over = (up * np.asarray(com)).sum(axis=-1) - self.height
            value = value - self.k4 * over**2
            by_com = by_com - 2.0 * self.k4 * over[..., None] * up
        return Psi(value, by_com, by_feet, by_tilt[..., None] * by_turn)

    def at(
        self,
        model: Model,
        stance: Sequence[str] | None = None,
        com: str | ArrayLike | None = None,
        gravity: ArrayLike = DOWN,
    ) -> Ascent:
        """psi of a robot that stands on the feet ``stance`` (names of the model's feet; None: all of them), and its
        gradient by whatever moves.

        ``com``: "mass", the centre of mass of all its bodies, which moves with every joint; "base", the base's origin,
        as the paper has it; or a point (3,) m fixed in the base. None: "mass" where the robot has any, else "base".
        ``gravity`` (..., 3) in the world. Raises InputError or UnknownNameError.
        """
        return ascent(self, model, stance, com, gravity)

    def _smooth_minimum(self, mu: Array, real: BoolArray) -> tuple[Array, Array]:
        least = np.where(real, mu, np.inf).min(axis=-1, keepdims=True)
        share = np.where(real, np.exp(-self.sharpness * (mu - least)), 0.0)
        total = share.sum(axis=-1, keepdims=True)
        return (least - np.log(total) / self.sharpness)[..., 0], share / total

    def _barrier(self, distance: Array, real: BoolArray) -> tuple[Array, Array]:
        x = np.where(real, distance / self.relax, 1.0)
        inside = x > 1.0
        safe = np.where(inside, x, 1.0)
        value = np.where(inside, np.log(safe), (x - 1.0) - 0.5 * (x - 1.0) ** 2)
        slope = np.where(inside, 1.0 / safe, 2.0 - x) / self.relax
        return value.sum(axis=-1), np.where(real, slope, 0.0)


def _product(factors: Array, real: BoolArray) -> tuple[Array, Array]:
    """Product of the factors that are real, and its derivatives: products from both sides, so that nothing is divided
    by a factor."""
    f = np.where(real, factors, 1.0)
    one = np.ones((*f.shape[:-1], 1))
    before = np.cumprod(np.concatenate([one, f[..., :-1]], axis=-1), axis=-1)
    behind = np.cumprod(np.concatenate([one, f[..., :0:-1]], axis=-1), axis=-1)[..., ::-1]
    return before[..., -1] * f[..., -1], np.where(real, before * behind, 0.0)


def _gather(edges: Edges, by_a: Array, by_b: Array) -> tuple[Array, Array]:
    """(by com (..., 3), by feet (..., m, 3)) of derivatives by the ends of the edges seen from the centre of mass."""
    m = edges.real.shape[-1]
    feet = np.zeros((*edges.number.shape, m, 3))
    for k, by in enumerate((by_a, by_b)):
        # one row a foot: 1 where it is that end of the edge
        is_end = edges.feet[..., None, :, k] == np.arange(m)[:, None]
        feet += is_end.astype(np.float64) @ np.where(edges.real[..., None], by, 0.0)
    return -feet.sum(axis=-2), feet
