"""A mechanism beside its curve: both from the tail on, at rest relative to each other; what errors are measured on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray
from bodyplan.curves.base import BodyCurve
from bodyplan.fitting.dense import DenseCurve, dense_curve
from bodyplan.fitting.distance import CELL_TOLERANCE, errors, farthest
from bodyplan.fitting.mechanism import Mechanism, mechanism
from bodyplan.fitting.rules import kink_quaternion
from bodyplan.robot.batch import variable
from bodyplan.robot.elements import Arc
from bodyplan.robot.model import Robot
from bodyplan.spatial import compose, matrix_from_quaternion
from bodyplan.spatial.coefficients import coefficients
from bodyplan.threads import shared

#: cells of the dense curve that one cell of the integral may span at first
SPAN = 16
#: fits from which on a batch is shared between threads
SHARED_FROM = 64


@dataclass(frozen=True)
class Following:
    """T fits to one dense curve. ``starts`` (T,) m; ``stops`` (T, C + 1) m, ``counts`` (T,) and ``owners`` (T, C):
    cells of the body and the segments they lie on; ``segments`` (S, 3)."""

    robot: Robot
    made: Mechanism
    dense: DenseCurve
    starts: Array
    stops: Array
    counts: IntArray
    owners: IntArray
    segments: Array

    def base(self, kink: Array) -> Array:
        """Base poses (T, 7) in the dense curve's own frame for kinks (T, 2)."""
        turn = kink_quaternion(kink, self.made.kind == "straight")
        return compose(self.dense.pose(self.starts), np.concatenate([np.zeros((len(turn), 3)), turn], axis=1))

    def errors(self, q: Array, kink: Array) -> Array:
        """(T, 2): E_nm of eq. (6) and its estimated error."""
        data = segment_data(self.robot, self.made, q, self.base(kink))
        out = np.empty((len(q), 2))
        size = self.made.length**2

        def kernel(first: int, last: int) -> int:
            cut = slice(first, last)
            cells = (self.stops[cut], self.counts[cut], self.owners[cut], self.segments, data[cut])
            errors(self.starts[cut], *cells, self.dense.ends, self.dense.cells, CELL_TOLERANCE * size, out[cut])
            return 0

        shared(kernel, len(q), threaded_from=SHARED_FROM)
        out /= size
        out[:, 1] += self.dense.error / self.made.length + 1e-15
        return out

    def farthest(self, q: Array, kink: Array) -> Array:
        """(T,) m: the largest distance."""
        return self.farthest_from(q, self.base(kink))

    def farthest_from(self, q: Array, base: Array) -> Array:
        """(T,) m: the same for base poses (T, 7) in the dense curve's own frame."""
        data = segment_data(self.robot, self.made, q, base)
        out = np.empty(len(q))
        cells = (self.stops, self.counts, self.owners, self.segments, data)
        farthest(self.starts, *cells, self.dense.ends, self.dense.cells, out)
        return out

    def distance(self, q: Array, kink: Array, s: Array) -> Array:
        """(T, S) m at the places s (S,) of the body."""
        body = body_points(self.robot, self.made, q, self.base(kink), s)
        return np.asarray(np.linalg.norm(body - self.dense.points(self.starts[:, None] + s), axis=-1))


def followings(robot: Robot, made: Mechanism, curve: BodyCurve, starts: Array) -> list[tuple[IntArray, Following]]:
    """Fits to ``curve`` (tau = 0) at ``starts`` (T,) m in groups whose stretches of the curve overlap, each with the
    numbers of its fits."""
    order = np.argsort(starts, kind="stable")
    jumps = np.flatnonzero(np.diff(starts[order]) > made.length) + 1
    out = []
    for group in np.split(order, jumps):
        begin = starts[group]
        dense = dense_curve(curve, float(begin.min()), float(begin.max()) + made.length, made.length)
        out.append((group, Following(robot, made, dense, begin, *_cells(made, dense, begin))))
    return out


def largest_distances(robot: Robot, curve: BodyCurve, starts: ArrayLike, q: Array, turns: Array) -> Array:
    """(T,) m: the largest distance, at equal body length, between ``curve`` (tau = 0) from ``starts`` (T,) m on and the
    mechanism at joints ``q`` (T, n) whose base is turned by quaternions ``turns`` (T, 4) against the curve's frame
    there."""
    begin = np.ascontiguousarray(starts, dtype=np.float64)
    out = np.empty(len(begin))
    for group, found in followings(robot, mechanism(robot), curve, begin):
        turned = np.concatenate([np.zeros((len(group), 3)), turns[group]], axis=1)
        out[group] = found.farthest_from(q[group], compose(found.dense.pose(found.starts), turned))
    return out


def _cells(made: Mechanism, dense: DenseCurve, starts: Array) -> tuple[Array, IntArray, IntArray, Array]:
    """``stops``, ``counts``, ``owners``, ``segments`` of :class:`Following`."""
    segments = np.array([[s.start, s.end, float(s.arc)] for s in made.segments])
    edges = np.append(segments[:, 0], made.length)
    spans = np.diff(np.searchsorted(dense.ends, starts[:, None] + edges), axis=1).max(axis=0)
    parts = np.maximum(1, -(-spans // SPAN))
    share = (np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(parts, parts)
    even = np.append(np.repeat(edges[:-1], parts) + share * np.repeat(np.diff(edges), parts), made.length)
    T = len(starts)
    breaks = dense.curve.breaks
    near = (breaks > starts.min()) & (breaks < starts.max() + made.length)
    if not near.any():
        owner = np.repeat(np.arange(len(segments)), parts)
        return np.tile(even, (T, 1)), np.full(T, len(owner)), np.tile(owner, (T, 1)), segments
    # every fit has the breaks at its own places; those of others do no harm as cells of no length
    own = np.clip(breaks[near] - starts[:, None], 0.0, made.length)
    stops = np.sort(np.concatenate([np.tile(even, (T, 1)), own], axis=1), axis=1)
    middle = 0.5 * (stops[:, 1:] + stops[:, :-1])
    owners = np.clip(np.searchsorted(edges, middle, side="right") - 1, 0, len(segments) - 1)
    return stops, np.full(T, owners.shape[1]), owners, segments


def segment_data(robot: Robot, made: Mechanism, q: Array, base: Array) -> Array:
    """(T, S, 17) of :mod:`bodyplan.fitting.distance`: origins of the frames at both ends of every segment (6), axes of
    the first frame (9), pitch and yaw of an arc (2); the base frame included."""
    poses = robot.forward(q, base).array
    first = np.array([s.first for s in made.segments])
    out = np.zeros((len(q), len(first), 17))
    out[:, :, :3], out[:, :, 3:6] = poses[:, first, :3], poses[:, first + 1, :3]
    arcs = np.flatnonzero([s.arc for s in made.segments])
    if len(arcs):
        turns = matrix_from_quaternion(poses[:, first[arcs], 3:])
        out[:, arcs, 6:15] = turns.swapaxes(-1, -2).reshape(len(q), len(arcs), 9)
        column = {name: i for i, name in enumerate(robot.joints)}
        for i in arcs:
            element = robot.elements[first[i]]
            assert isinstance(element, Arc)
            for k, bend in enumerate((element.pitch, element.yaw)):
                out[:, i, 15 + k] = variable(bend, q, column)
    return out


def body_points(robot: Robot, made: Mechanism, q: Array, base: Array, s: Array) -> Array:
    """Points (T, S, 3) of the mechanism at body lengths s (S,) m, seen from where ``base`` (T, 7) is seen from."""
    data = segment_data(robot, made, q, base)
    edges = np.array([segment.start for segment in made.segments])
    which = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, len(edges) - 1)
    ends = np.array([segment.end for segment in made.segments])[which]
    u = ((s - edges[which]) / (ends - edges[which]))[:, None]
    mine = data[:, which]
    out = mine[..., :3] + u * (mine[..., 3:6] - mine[..., :3])
    arcs = np.flatnonzero(np.array([segment.arc for segment in made.segments])[which])
    if len(arcs):
        part = mine[:, arcs]
        pitch, yaw = part[..., 15] * u[arcs, 0], part[..., 16] * u[arcs, 0]
        a, b, _ = coefficients(np.hypot(pitch, yaw))
        reach = (s - edges[which])[arcs]
        inner = np.stack([reach * a, reach * b * yaw, -reach * b * pitch], axis=-1)
        axes = part[..., 6:15].reshape(*part.shape[:-1], 3, 3)
        out[:, arcs] = part[..., :3] + np.einsum("tsa,tsai->tsi", inner, axes)
    return np.asarray(out)
