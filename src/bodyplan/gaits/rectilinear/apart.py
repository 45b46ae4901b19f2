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
def all_apart(apart: Apart, origins: Array, turn: Array, moved: BoolArray) -> bool:
    """True where no two parts of a body can be too near: links from ``origins`` (2 N, 2) m in directions ``turn``
    (2 N, 2). Only links ``moved`` (2 N,) are looked at, and what is near them."""
    keep, fold, count = apart.keep, apart.fold, len(origins)
    for k in range(count - 1):
        if (moved[k] or moved[k + 1]) and fold[k] > 0.0:
            # a point r from the joint is r sin(angle) from a link that turns back, and r or more from one that does not
            if turn[k, 0] * turn[k + 1, 0] + turn[k, 1] * turn[k + 1, 1] < 0.0:
                if abs(turn[k, 0] * turn[k + 1, 1] - turn[k, 1] * turn[k + 1, 0]) < fold[k]:
                    return False
            elif fold[k] >= 1.0:
                return False
    ahead, begin = np.inf, np.inf  # where the links behind the next one begin, and the next one
    for k in range(count - 1, -1, -1):
        low, high = _reach(apart, origins, turn, k, 0)
        if ahead - high < apart.most:
            for j in range(k + 2, count):
                need = keep[k, j]
                if need <= 0.0 or not (moved[k] or moved[j]):
                    continue
                left, right = _reach(apart, origins, turn, j, 0)
                if left - high >= need or low - right >= need:
                    continue
                bottom, top = _reach(apart, origins, turn, k, 1)
                under, over = _reach(apart, origins, turn, j, 1)
                if under - top >= need or bottom - over >= need:
                    continue
                if not (_beside(apart, origins, turn, k, j, need) or _beside(apart, origins, turn, j, k, need)):
                    return False
        ahead, begin = min(ahead, begin), low
    return True


@lean
def _reach(apart: Apart, origins: Array, turn: Array, k: int, c: int) -> tuple[float, float]:
    """m from where to where the parts of link ``k`` reach, along (``c`` = 0) or up (1)."""
    at, first, last = origins[k, c], apart.span[k, 0] * turn[k, c], apart.span[k, 1] * turn[k, c]
    return at + min(first, last), at + max(first, last)


@lean
def _beside(apart: Apart, origins: Array, turn: Array, k: int, j: int, need: float) -> bool:
    """Whether all of link ``j`` lies on one side of the line through link ``k``, ``need`` m from it or farther."""
    cosine, sine = turn[k, 0], turn[k, 1]
    x, z = origins[k, 0] + apart.span[k, 0] * cosine, origins[k, 1] + apart.span[k, 0] * sine
    at, up = origins[j, 0] - x, origins[j, 1] - z
    first = cosine * (up + apart.span[j, 0] * turn[j, 1]) - sine * (at + apart.span[j, 0] * turn[j, 0])
    last = cosine * (up + apart.span[j, 1] * turn[j, 1]) - sine * (at + apart.span[j, 1] * turn[j, 0])
    return bool(min(first, last) >= need or max(first, last) <= -need)
