"""Whether all links of a body are so far from each other that no two parts on them can be too near: a Numba kernel.

Links are segments here, as long as the parts on them reach, and keep from each other what their parts need and as much
as these stand off to the side. Most poses are told clear by this, for much less than the distances of all parts take.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.gaits.rectilinear.parts import Parts
from bodyplan.kernels import inlined, lean

#: relative to the longest link, by how much more links keep from each other: far above rounding
MORE = 1e-9


class Apart(NamedTuple):
    """For 2 N links, tail and head link included: ``span`` (2 N, 2) m from where to where along each of them its parts
    reach; ``keep`` (2 N, 2 N) m: how far the segments of two links must be apart for all of their parts to be clear,
    0 where these may touch; ``fold`` (2 N - 1,): of links that meet at a joint, the sine of the angle between them from
    which on they are clear, infinite where no angle is enough; ``most`` m the largest ``keep``."""

    span: Array
    keep: Array
    fold: Array
    most: float


def apart_of(parts: Parts, lengths: Array) -> Apart:
    """For links of ``lengths`` (2 N,) m, tail first."""
    count, more = len(lengths), MORE * float(lengths.max())
    ends = np.sort(parts.ends[..., 0], axis=1)
    aside = np.abs(parts.ends[..., 1]).max(axis=1)
    span, keep, fold = np.zeros((count, 2)), np.zeros((count, count)), np.zeros(count - 1)
    for k in np.unique(parts.link):
        mine = ends[parts.link == k]
        span[k] = mine[:, 0].min(), mine[:, 1].max()
    for i, j in np.argwhere(parts.need > 0.0):
        rear, front = parts.link[i], parts.link[j]
        need = float(parts.need[i, j] + aside[i] + aside[j]) + more
        keep[rear, front] = keep[front, rear] = max(keep[rear, front], need)
        if front == rear + 1:
            # how far from the joint both begin; beyond it there is no angle between them
            begin = np.array([lengths[rear] - ends[i, 1], ends[j, 0]])
            far = float(begin.max()) if begin.min() > -more else 0.0
            fold[rear] = max(fold[rear], need / far if far > need else np.inf)
    return Apart(span, keep, fold, float(keep.max(initial=0.0)))


@inlined
def all_apart(apart: Apart, origins: Array, turn: Array, moved: BoolArray, work: Array) -> bool:
    """True where no two parts of a body can be too near: links from ``origins`` (2 N, 2) m in directions ``turn``
    (2 N, 2). Only links ``moved`` (2 N,) are looked at, and what is near them. ``work`` (2 N, 9) is room."""
    span, keep, fold, count = apart.span, apart.keep, apart.fold, len(origins)
    for k in range(count - 1):
        if (moved[k] or moved[k + 1]) and fold[k] > 0.0:
            # a point r from the joint is r sin(angle) from a link that turns back, and r or more from one that does not
            if turn[k, 0] * turn[k + 1, 0] + turn[k, 1] * turn[k + 1, 1] < 0.0:
                if abs(turn[k, 0] * turn[k + 1, 1] - turn[k, 1] * turn[k + 1, 0]) < fold[k]:
                    return False
            elif fold[k] >= 1.0:
                return False
    if _in_line(apart, origins, turn):
        return True
    for k in range(count):
        x, z, cosine, sine = origins[k, 0], origins[k, 1], turn[k, 0], turn[k, 1]
        work[k, 0], work[k, 1] = x + span[k, 0] * cosine, z + span[k, 0] * sine
        work[k, 2], work[k, 3] = x + span[k, 1] * cosine, z + span[k, 1] * sine
        work[k, 4], work[k, 5] = min(work[k, 0], work[k, 2]), max(work[k, 0], work[k, 2])
        work[k, 6], work[k, 7] = min(work[k, 1], work[k, 3]), max(work[k, 1], work[k, 3])
    work[count - 1, 8] = work[count - 1, 4]
    for k in range(count - 2, -1, -1):
        work[k, 8] = min(work[k, 4], work[k + 1, 8])  # what is ahead begins there
    for k in range(count - 2):
        for j in range(k + 2, count):
            if work[j, 8] - work[k, 5] >= apart.most:
                break
            need = keep[k, j]
            if need <= 0.0 or not (moved[k] or moved[j]):
                continue
            if work[j, 4] - work[k, 5] >= need or work[k, 4] - work[j, 5] >= need:
                continue
            if work[j, 6] - work[k, 7] >= need or work[k, 6] - work[j, 7] >= need:
                continue
            if not (_beside(work, turn, k, j, need) or _beside(work, turn, j, k, need)):
                return False
    return True


@lean
def _in_line(apart: Apart, origins: Array, turn: Array) -> bool:
    """Whether all links that do not meet come one after the other along the way, far enough from each other."""
    ahead, second = np.inf, np.inf
    for k in range(len(origins) - 1, -1, -1):
        x, one, other = origins[k, 0], apart.span[k, 0] * turn[k, 0], apart.span[k, 1] * turn[k, 0]
        # ``ahead`` of this link and the next one all others begin
        if ahead - (x + max(one, other)) < apart.most:
            return False
        ahead, second = min(ahead, second), x + min(one, other)
    return True


@lean
def _beside(work: Array, turn: Array, k: int, j: int, need: float) -> bool:
    """Whether all of link ``j`` lies on one side of the line through link ``k``, ``need`` m from it or farther."""
    x, z, cosine, sine = work[k, 0], work[k, 1], turn[k, 0], turn[k, 1]
    first = cosine * (work[j, 1] - z) - sine * (work[j, 0] - x)
    last = cosine * (work[j, 3] - z) - sine * (work[j, 2] - x)
    return bool(min(first, last) >= need or max(first, last) <= -need)
