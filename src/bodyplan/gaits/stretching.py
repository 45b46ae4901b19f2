"""Stages of stretching a concertina body (paper *concertina*, section IV) and the links' exact answer to them.

Progress runs from 0 to ``total`` in units of one module's stage. Each shape parameter (tail multiplier, gamma of
every body module, gamma of the head) is a :class:`Ramp` of progress. Arrays over parameters are ordered
tail, module 1 .. N_B, head.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.curves import pieces as pc
from bodyplan.curves.concertina import GAUSS_NODES, GAUSS_WEIGHTS, ConcertinaCurve
from bodyplan.fitting.links import chain_rates, place_chain

BLENDS = {"linear": 0, "smooth": 1}


@dataclass(frozen=True)
class Stages:
    """Ramps of the N_B + 2 shape parameters: each goes from ``initial`` to ``final`` during ``start`` .. ``start +
    duration``; ``names`` of the stages, ``order`` in which they begin (head first), ``total`` progress."""

    names: tuple[str, ...]
    initial: Array
    final: Array
    start: Array
    duration: Array
    blend: str

    @property
    def order(self) -> IntArray:
        """Parameters in the order in which their stages begin."""
        return np.argsort(self.start, kind="stable")

    @property
    def total(self) -> float:
        """Progress at which the last stage ends."""
        return float(np.max(self.start + self.duration))

    @property
    def bounds(self) -> Array:
        """Progress at which any stage begins or ends, ascending."""
        return np.unique(np.concatenate([self.start, self.start + self.duration]))

    def parameters(self, progress: Array) -> Array:
        """Values of the parameters, (S, N_B + 2), at progress (S,)."""
        out = np.empty((len(progress), len(self.names), 3))
        for i, s in enumerate(progress):
            _ramps(s, self.initial, self.final, self.start, self.duration, BLENDS[self.blend], out[i])
        return out[:, :, 0]


def stretching(
    body_modules: int, gamma_max: float, rates: Array, overlap: float, blend: str, literal_contraction: bool = False
) -> Stages:
    """Stages of section IV.A: head, then body modules from front to rear, then the tail.

    gamma goes from 0 to ``gamma_max`` in one unit of progress; the tail multiplier from 1 to 0 at the same rate of
    change, so its stage lasts 1/gamma_max (correction 7). ``rates`` (N_B + 2,) speeds up single parameters;
    a stage begins when the fraction ``overlap`` of the one before is still to come (section VI).
    ``literal_contraction`` gives section IV.B as printed instead: the same order with every ramp reversed.
    """
    names = ("tail", *(f"module {k}" for k in range(1, body_modules + 1)), "head")
    top = np.array([1.0, *([gamma_max] * (body_modules + 1))])
    duration = np.where(np.arange(body_modules + 2) == 0, 1.0 / gamma_max, 1.0) / rates
    start = np.zeros(body_modules + 2)
    order = [*range(body_modules + 1, -1, -1)]
    for before, after in pairwise(order):
        start[after] = start[before] + (1.0 - overlap) * duration[before]
    zero = np.zeros_like(top)
    tail = np.arange(body_modules + 2) == 0
    contracted, stretched = np.where(tail, top, zero), np.where(tail, zero, top)
    pair = (stretched, contracted) if literal_contraction else (contracted, stretched)
    return Stages(names, frozen(pair[0]), frozen(pair[1]), frozen(start), frozen(duration), blend)


@njit(cache=True)
def _ramps(s: float, initial: Array, final: Array, start: Array, duration: Array, blend: int, out: Array) -> None:
    """Parameters and their first two derivatives with respect to progress, out (p, 3)."""
    for i in range(initial.size):
        x = (s - start[i]) / duration[i]
        f, f1, f2 = 0.0, 0.0, 0.0
        if x >= 1.0:
            f = 1.0
        elif x >= 0.0:
            if blend == 1:  # the C2 quintic: rates and accelerations vanish at both ends
                f = min(x * x * x * (10.0 + x * (6.0 * x - 15.0)), 1.0)
                f1 = 30.0 * x * x * (1.0 - x) * (1.0 - x)
                f2 = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
            else:
                f, f1 = x, 1.0
        reach = final[i] - initial[i]
        # exact at the ends: a stretched tail must be 0, not 1e-17
        out[i, 0] = final[i] if f >= 1.0 else initial[i] + reach * f
        out[i, 1] = reach * f1 / duration[i]
        out[i, 2] = reach * f2 / (duration[i] * duration[i])


@njit(cache=True)
def body_at(
    s: float,
    ramps: tuple[Array, Array, Array, Array],
    blend: int,
    curve: tuple[float, int, int, float],
    lengths: Array,
    nodes: Array,
    weights: Array,
    parameters: Array,
    pieces: Array,
    points: Array,
    angles: Array,
    rates: Array,
) -> tuple[float, float, float, int]:
    """One chain at one progress (kernel): fills points, angles and their derivatives; returns the extent along x
    with its two derivatives, and the first link that is too tight or -1."""
    initial, final, start, duration = ramps
    omega, crossing, rule, lead = curve
    _ramps(s, initial, final, start, duration, blend, parameters)
    count = pc.build_pieces(parameters[0], parameters[1:], omega, crossing, rule, lead, pieces)
    tight = place_chain(lengths, 0.0, pieces, count, omega, nodes, weights, points, angles)
    chain_rates(points, pieces, count, omega, rates)
    extent, first, second = 0.0, 0.0, 0.0
    for j in range(lengths.size):
        c, si = np.cos(angles[j]) * lengths[j], np.sin(angles[j]) * lengths[j]
        extent += c
        first -= si * rates[0, j]
        second -= c * rates[0, j] ** 2 + si * rates[1, j]
    return extent, first, second, tight


@njit(cache=True)
def _bodies(
    progress: Array,
    ramps: tuple[Array, Array, Array, Array],
    blend: int,
    curve: tuple[float, int, int, float],
    lengths: Array,
    nodes: Array,
    weights: Array,
    angles: Array,
    rates: Array,
    extents: Array,
    tight: IntArray,
) -> None:
    parameters = np.empty((ramps[0].size, 3))
    pieces = np.empty((ramps[0].size + 2, pc.COLUMNS))
    points = np.empty((lengths.size + 1, 2))
    for i in range(progress.size):
        e0, e1, e2, tight[i] = body_at(
            progress[i], ramps, blend, curve, lengths, nodes, weights, parameters, pieces, points, angles[i], rates[i]
        )
        extents[i, 0], extents[i, 1], extents[i, 2] = e0, e1, e2


@dataclass(frozen=True)
class Bodies:
    """A chain at S progress values: ``angles`` (S, n) absolute, ``rates`` (S, 2, n) their first two derivatives by
    progress, ``extents`` (S, 3) length along x with two derivatives, ``tight`` (S,) first link too tight or -1."""

    angles: Array
    rates: Array
    extents: Array
    tight: IntArray


@dataclass(frozen=True)
class StretchingBody:
    """Links of given ``lengths`` (n,) on the curve whose parameters follow ``stages``; curve units."""

    stages: Stages
    lengths: Array
    omega: float
    crossing: int = 2
    lead: float = 0.0

    def at(self, progress: Array) -> Bodies:
        """Angles and exact derivatives at progress (S,)."""
        s = np.ascontiguousarray(progress, dtype=np.float64)
        n = len(self.lengths)
        angles, rates = np.empty((s.size, n)), np.empty((s.size, 2, n))
        extents, tight = np.empty((s.size, 3)), np.empty(s.size, dtype=np.int64)
        _bodies(s, *self.kernel_arguments, angles, rates, extents, tight)
        return Bodies(angles, rates, extents, tight)

    @property
    def kernel_arguments(
        self,
    ) -> tuple[tuple[Array, Array, Array, Array], int, tuple[float, int, int, float], Array, Array, Array]:
        """Leading arguments of the kernels after progress."""
        st = self.stages
        return (
            (st.initial, st.final, st.start, st.duration),
            BLENDS[st.blend],
            (self.omega, self.crossing, pc.CUT, self.lead),
            np.ascontiguousarray(self.lengths),
            GAUSS_NODES,
            GAUSS_WEIGHTS,
        )

    def curve(self, progress: Array) -> ConcertinaCurve:
        """The body curves at progress (S,), a batch."""
        p = self.stages.parameters(np.asarray(progress, dtype=np.float64))
        return ConcertinaCurve(
            p[:, 1:-1], p[:, -1], tail=p[:, 0], omega=self.omega, crossing=self.crossing, lead=self.lead
        )
