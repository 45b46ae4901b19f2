"""Stages of stretching a concertina body (paper *concertina*, section IV) and the links' exact answer to them.

Progress runs from 0 to ``total`` in units of one module's stage. Each shape parameter (tail multiplier, gamma of
every body module, gamma of the head) is a :class:`Ramp` of progress. Arrays over parameters are ordered
tail, module 1 .. N_B, head.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.curves import pieces as pc
from bodyplan.curves.concertina import GAUSS_NODES, GAUSS_WEIGHTS, ConcertinaCurve
from bodyplan.fitting.links import chain_rates, place_chain
from bodyplan.kernels import lean

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


@lean
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


class Chain(NamedTuple):
    """A :class:`StretchingBody` for kernels: its ramps and its curve; and from ``pieces`` on the body before any stage,
    whose joints are also those of the stretching body as far as the curve has not changed."""

    initial: Array
    final: Array
    start: Array
    duration: Array
    blend: int
    omega: float
    crossing: int
    lead: float
    lengths: Array
    nodes: Array
    weights: Array
    pieces: Array
    rows: int
    points: Array
    local: Array
    angles: Array
    tight: int


class Scratch(NamedTuple):
    """What a kernel needs for one chain at one progress: parameters (p, 3), pieces, points (n + 1, 2), local
    (n + 1, 5), angles (n,), rates (2, n); and the progress (1,) they belong to."""

    parameters: Array
    pieces: Array
    points: Array
    local: Array
    angles: Array
    rates: Array
    progress: Array


@njit(cache=True)
def scratch_of(chain: Chain) -> Scratch:
    """Room for :func:`body_at` (kernel)."""
    n, p = chain.lengths.size, chain.initial.size
    return Scratch(
        np.empty((p, 3)),
        np.empty((p + 2, pc.COLUMNS)),
        np.empty((n + 1, 2)),
        np.empty((n + 1, 5)),
        np.empty(n),
        np.empty((2, n)),
        np.full(1, np.nan),
    )


@lean
def body_at(s: float, chain: Chain, at: Scratch) -> tuple[float, float, float, int]:
    """One chain at one progress (kernel): fills ``at``; returns the extent along x with its two derivatives, and the
    first link that is too tight or -1."""
    n = chain.lengths.size
    _ramps(s, chain.initial, chain.final, chain.start, chain.duration, chain.blend, at.parameters)
    count = pc.build_pieces(
        at.parameters[0], at.parameters[1:], chain.omega, chain.crossing, pc.CUT, chain.lead, at.pieces
    )
    same = pc.rests_until(at.pieces, count, chain.pieces, chain.rows)
    first = 0
    while first < n and chain.points[first + 1, 0] <= same:
        first += 1
    for j in range(first + 1):  # numba copies what is assigned to a slice, in case it overlaps
        at.points[j, 0], at.points[j, 1] = chain.points[j, 0], chain.points[j, 1]
        for column in range(3):
            at.local[j, column] = chain.local[j, column]
    for j in range(first):
        at.angles[j] = chain.angles[j]
    tight = place_chain(
        first,
        s - at.progress[0],
        chain.lengths,
        at.pieces,
        count,
        chain.omega,
        chain.nodes,
        chain.weights,
        at.points,
        at.local,
        at.angles,
    )
    if 0 <= chain.tight < first:
        tight = chain.tight
    chain_rates(first, at.points, at.local, at.pieces, chain.omega, at.rates)
    at.progress[0] = s
    return at.points[n, 0] - at.points[0, 0], at.local[n, 3], at.local[n, 4], tight


@njit(cache=True)
def _rest(chain: Chain) -> tuple[int, int]:
    """Fills the chain's ``pieces``, ``points``, ``local`` and ``angles`` with the body before any stage; returns their
    number of rows and the first link that is too tight or -1 (kernel)."""
    still = np.zeros((chain.initial.size, 3))
    still[:, 0] = chain.initial
    count = pc.build_pieces(still[0], still[1:], chain.omega, chain.crossing, pc.CUT, chain.lead, chain.pieces)
    tight = place_chain(
        0,
        np.nan,
        chain.lengths,
        chain.pieces,
        count,
        chain.omega,
        chain.nodes,
        chain.weights,
        chain.points,
        chain.local,
        chain.angles,
    )
    return count, tight


@njit(cache=True)
def _bodies(progress: Array, chain: Chain, angles: Array, rates: Array, extents: Array, tight: IntArray) -> None:
    at = scratch_of(chain)
    for i in range(progress.size):
        e0, e1, e2, tight[i] = body_at(progress[i], chain, at)
        extents[i, 0], extents[i, 1], extents[i, 2] = e0, e1, e2
        for j in range(chain.lengths.size):
            angles[i, j], rates[i, 0, j], rates[i, 1, j] = at.angles[j], at.rates[0, j], at.rates[1, j]


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
        _bodies(s, self.chain, angles, rates, extents, tight)
        return Bodies(angles, rates, extents, tight)

    @cached_property
    def chain(self) -> Chain:
        """The body as kernels take it."""
        st, lengths = self.stages, np.ascontiguousarray(self.lengths, dtype=np.float64)
        n, p = lengths.size, len(st.names)
        whole = Chain(
            st.initial,
            st.final,
            st.start,
            st.duration,
            BLENDS[st.blend],
            float(self.omega),
            self.crossing,
            float(self.lead),
            lengths,
            GAUSS_NODES,
            GAUSS_WEIGHTS,
            pieces=np.zeros((p + 2, pc.COLUMNS)),
            rows=0,  # nothing is known to rest yet
            points=np.zeros((n + 1, 2)),
            local=np.zeros((n + 1, 5)),
            angles=np.zeros(n),
            tight=-1,
        )
        count, tight = _rest(whole)
        return whole._replace(rows=count, tight=tight)

    def curve(self, progress: Array) -> ConcertinaCurve:
        """The body curves at progress (S,), a batch."""
        p = self.stages.parameters(np.asarray(progress, dtype=np.float64))
        return ConcertinaCurve(
            p[:, 1:-1], p[:, -1], tail=p[:, 0], omega=self.omega, crossing=self.crossing, lead=self.lead
        )
