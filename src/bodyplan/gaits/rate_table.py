"""Joint rates of a sweep as a table between whose nodes cubics are as good as the sweep itself.

A time warp asks for the largest joint rate at thousands of places. Rates are smooth but for a few where they jump: a
stage begins, or a joint passes a kink of the curve. The table has nodes on both sides of each of them. They are found
from what a sweep gives anyway: the angles at both ends of a cell must differ by the integral of the cubic between them,
and where they do not, the cell is split; where a rate jumps, next to the place where the two parabolas meet that
continue the angles from either end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.sweep import Sweep

#: what a rate between nodes may be off, of the largest one there
TOLERANCE = 1e-3
#: jumps that are smaller, of the largest rate there, need no nodes of their own
JUMP = 5e-3
#: units of progress between a jump's two nodes, at most
NARROW = 1e-5
#: cells at the start, units of progress
CELL = 1.0 / 16.0
#: a body that nearly rests has no largest rate to compare with: then this share of the sweep's mean
RESTING = 1e-2


@dataclass(frozen=True)
class RateTable:
    """Rates (K, m) of the joints by u at ascending ``nodes`` (K,), and their derivatives ``changes`` (K, m)."""

    nodes: Array
    rates: Array
    changes: Array

    def largest(self, u: Array, speed: Array, sides: bool = False) -> Array:
        """Largest joint rate (S,) of the sum of W waves that are at u (W, S), each row ascending, and run at du/dt
        ``speed`` (W, S). ``sides``: between the two nodes of a jump take the larger of both instead of what lies
        between them: the jump may be anywhere."""
        out = np.zeros(u.shape[1])
        for side in (-1.0, 1.0) if sides else (0.0,):
            _largest(u, speed, self.nodes, self.rates, self.changes, side, out)
        return out

    def jumps(self, u: Array) -> BoolArray:
        """True where u, any shape, lies between the two nodes of a jump."""
        cell = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, len(self.nodes) - 2)
        return np.asarray(np.diff(self.nodes)[cell] <= NARROW)


@njit(cache=True)
def _largest(u: Array, speed: Array, nodes: Array, rates: Array, changes: Array, side: float, out: Array) -> None:
    """Raises ``out`` to the largest rates; ``side`` of jumps: -1 before, 1 after, 0 what lies between (kernel)."""
    waves, count = u.shape
    cell, total = np.zeros(waves, dtype=np.int64), np.empty(rates.shape[1])
    for i in range(count):
        total[:] = 0.0
        for k in range(waves):
            c = cell[k]
            while c < nodes.size - 2 and u[k, i] >= nodes[c + 1]:
                c += 1
            cell[k] = c
            h = nodes[c + 1] - nodes[c]
            x = min(max((u[k, i] - nodes[c]) / h, 0.0), 1.0)
            if h <= NARROW and side != 0.0:
                x = 0.0 if side < 0.0 else 1.0
            y, v = 1.0 - x, speed[k, i]
            a, b = v * (1.0 + 2.0 * x) * y * y, v * (1.0 + 2.0 * y) * x * x
            p, q = v * h * x * y * y, v * h * x * x * y
            for j in range(total.size):
                total[j] += a * rates[c, j] + b * rates[c + 1, j] + p * changes[c, j] - q * changes[c + 1, j]
        for j in range(total.size):
            out[i] = max(out[i], abs(total[j]))


def rate_table(sweep: Sweep) -> RateTable:
    """The table of a sweep; of half of it where the other half is the same read from the head."""
    u = _first_nodes(sweep)
    joints = _joints(sweep, u)
    # by the node where a cell begins: what is left of a cell beside an estimated jump is halved next
    halve = np.zeros(u.size, dtype=np.bool_)
    mean = float(np.abs(joints[1]).max(axis=1).mean())
    while (poor := _poor(u, joints, mean))[0].size:
        at, added, flags = _splits(u, joints, poor, halve)
        u, halve = np.insert(u, at, added), np.insert(halve, at, flags)
        joints = np.insert(joints, at, _joints(sweep, added), axis=1)
    _, rates, changes = joints
    if sweep.reversal is not None:
        s = sweep.reversal
        u = np.concatenate([u, -u[::-1]])
        rates = np.concatenate([rates, s * rates[::-1, ::-1]])
        changes = np.concatenate([changes, -s * changes[::-1, ::-1]])
    return RateTable(u, np.ascontiguousarray(rates), np.ascontiguousarray(changes))


def _joints(sweep: Sweep, u: Array) -> Array:
    """Joint angles and their first two derivatives by u, (3, S, m)."""
    return np.diff(np.stack(sweep.at(u)), axis=2)


def _first_nodes(sweep: Sweep) -> Array:
    """Even nodes between the stages' bounds, and one on either side of those."""
    end = sweep.total if sweep.reversal is None else 0.0
    known = [edge for w in sweep.windows for edge in (w.start, w.end)]
    edges = np.array(sorted([*known, sweep.launch_end, sweep.landing_start]))
    edges = np.concatenate([[-sweep.total], edges[(edges > -sweep.total) & (edges < end)], [end]])
    begin, stop = edges[:-1] + 0.45 * NARROW, edges[1:] - 0.45 * NARROW
    parts = [np.linspace(a, b, int((b - a) / CELL) + 2) for a, b in zip(begin, stop, strict=True) if b - a > NARROW]
    return np.concatenate(parts)


def _poor(u: Array, joints: Array, mean: float) -> tuple[IntArray, IntArray, BoolArray]:
    """Cells that must be split, in each the joint whose rate jumps most, and whether it jumps at all."""
    angles, rates, changes = joints
    h = np.diff(u)[:, None]
    integral = h * (0.5 * (rates[1:] + rates[:-1]) + h / 12.0 * (changes[:-1] - changes[1:]))
    # a cubic that misses its integral by h^5 f''''/720 is off by h^4 f''''/384 at most
    off = np.abs(np.diff(angles, axis=0) - integral) * (720.0 / 384.0) / h
    jump = np.abs(np.diff(rates, axis=0) - 0.5 * h * (changes[1:] + changes[:-1]))
    speed = np.abs(rates).max(axis=1)
    scale = np.maximum(np.maximum(speed[1:], speed[:-1]), RESTING * mean)
    most = jump.argmax(axis=1)
    jumps = jump[np.arange(most.size), most]
    cells = np.flatnonzero(((off.max(axis=1) > TOLERANCE * scale) | (jumps > JUMP * scale)) & (h[:, 0] > NARROW))
    return cells, most[cells], jumps[cells] > JUMP * scale[cells]


def _splits(
    u: Array, joints: Array, poor: tuple[IntArray, IntArray, BoolArray], halve: BoolArray
) -> tuple[IntArray, Array, BoolArray]:
    """Ascending nodes that split cells, where to insert them, and their flags for ``halve``, which is brought up to
    date: two nodes about the place where the joint that jumps must do so, else one in the middle."""
    cells, most, jumps = poor
    h = u[cells + 1] - u[cells]
    (a0, v0, c0), (a1, v1, c1) = joints[:, cells, most], joints[:, cells + 1, most]
    # parabolas from both ends: (a0 + v0 x + c0 x^2/2) - (a1 - v1 (h - x) + c1 (h - x)^2/2) = p + q x + r x^2
    p, q, r = a0 - a1 + h * (v1 - 0.5 * h * c1), v0 - v1 + h * c1, 0.5 * (c0 - c1)
    root = np.sqrt(np.maximum(q * q - 4.0 * p * r, 0.0))
    below = q + np.copysign(root, q)
    x = np.divide(-2.0 * p, below, out=np.full(h.size, -1.0), where=below != 0.0)
    # the place is off by the cubic terms over the jump, some h^3
    w = np.maximum(2.0 * h * h, 0.4 * NARROW)
    near = jumps & ~halve[cells] & (x > 0.0) & (x < h) & (w < 0.25 * h)
    x = np.where(near, np.clip(x, 1.5 * w, h - 1.5 * w), 0.5 * h)
    w = np.where(near, w, 0.0)
    halve[cells] = near
    added = np.stack([u[cells] + x - w, u[cells] + x + w], axis=1)
    keep = np.stack([np.ones(h.size, dtype=np.bool_), near], axis=1)
    flags = np.stack([np.zeros(h.size, dtype=np.bool_), near], axis=1)
    return np.stack([cells + 1, cells + 1], axis=1)[keep], added[keep], flags[keep]
