"""Least-squares inverses of batches of matrices: ranks told, damped only near a singularity, exact projectors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray

#: singular values up to this share of the largest are zero: kinematics are good to some 1e-15
ZERO = 1e-12


class Inverse(NamedTuple):
    """Solution of A y = b for a batch.

    ``y`` (..., n) = A# b + (I - A^+ A) y0; ``rank``; ``condition`` (...): largest over smallest non-zero singular
    value; ``damped`` (...): whether A# differs from the pseudo-inverse A^+; ``outside`` (...): size of the part of b
    that A cannot reach; ``missed`` (...): size of what damping leaves of the part that it can reach; ``basis``
    (..., n, k): right singular vectors as columns, by falling singular value; in full (k = n) those from ``rank`` on
    span the null space.
    """

    y: Array
    rank: IntArray
    condition: Array
    damped: BoolArray
    outside: Array
    missed: Array
    basis: Array


def solve(A: Array, b: Array, y0: Array | None, damping: float | None, near: float, *, full: bool = False) -> Inverse:
    """A (..., m, n), b (..., m), y0 (..., n), broadcast.

    ``damping`` None: 1/s of singular values s below ``near`` times the largest, e, gives way to s/e^2, that is
    s/(s^2 + lambda^2) with lambda^2 = e^2 - s^2: as in Nakamura and Hanafusa 1986 with the lambda that bounds |A#| by
    1/e and keeps it continuous. A number: lambda for all directions; 0: none. The projector is never damped: I - A# A
    would not be one, and y0 would then move what b commands. ``full``: basis of the null space, too.
    """
    U, s, Vt = _svd(A, full)
    k = s.shape[-1]
    U, V = U[..., :k], np.swapaxes(Vt[..., :k, :], -1, -2)
    largest = s.max(axis=-1, keepdims=True, initial=0.0)
    counts = s > ZERO * largest
    safe = np.where(counts, s, 1.0)
    if damping is None:
        threshold = near * largest
        weak = counts & (s < threshold)
        gain = np.where(weak, s / np.where(weak, threshold, 1.0) ** 2, 1.0 / safe)
    else:
        weak = counts & (damping > 0.0)
        gain = np.where(weak, s / (safe**2 + damping**2), 1.0 / safe)
    gain = np.where(counts, gain, 0.0)
    seen = _times(np.swapaxes(U, -1, -2), b)
    y = _times(V, gain * seen)
    if y0 is not None:
        y = y + y0 - _times(V, counts * _times(np.swapaxes(V, -1, -2), y0))
    rank = counts.sum(axis=-1)
    smallest = np.where(counts, s, np.inf).min(axis=-1, initial=np.inf)
    return Inverse(
        y,
        np.asarray(rank, dtype=np.int64),
        np.where(rank > 0, largest[..., 0] / np.where(rank > 0, smallest, 1.0), 1.0),
        np.asarray(weak.any(axis=-1)),
        np.linalg.norm(b - _times(U, counts * seen), axis=-1),
        np.linalg.norm(counts * (1.0 - gain * s) * seen, axis=-1),
        np.swapaxes(Vt, -1, -2),
    )


def _svd(A: Array, full: bool) -> tuple[Array, Array, Array]:
    m, n = A.shape[-2:]
    if m and n:
        U, s, Vt = np.linalg.svd(A, full_matrices=full)
        return U, s, Vt
    batch, size = A.shape[:-2], n if full else 0
    return np.zeros((*batch, m, 0)), np.zeros((*batch, 0)), np.broadcast_to(np.eye(n)[:size], (*batch, size, n))


def _times(M: Array, v: Array) -> Array:
    return np.asarray((M @ v[..., None])[..., 0])
