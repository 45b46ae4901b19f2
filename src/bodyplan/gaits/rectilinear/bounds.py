"""How far one pose of the snake is beyond what is demanded of it: Numba kernels that moves are tried with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.apart import Apart, all_apart
from bodyplan.gaits.rectilinear.legs import elbow, leg_angles
from bodyplan.gaits.rectilinear.moves import chord_of, swing_one
from bodyplan.gaits.rectilinear.parts import overlap
from bodyplan.gaits.rectilinear.swing import Even, even_at
from bodyplan.kernels import inlined, lean

#: what is demanded, in the order in which it is told; elbows and lifted anchors are highest at different places
DEMANDS = (
    Status.OUT_OF_REACH,
    Status.COLLAPSED,
    Status.ABOVE_CEILING,
    Status.ABOVE_CEILING,
    Status.LIMIT,
    Status.LINKS_CROSSING,
    Status.TIPS_OVER,
)
REACH, COLLAPSED, ELBOWS, ANCHORS, LIMIT, CROSSING, TIPS = range(len(DEMANDS))


class Bounds(NamedTuple):
    """What ``Demands`` says, for kernels: ``limits`` (2 N - 1, 2) rad are infinite and ``limited`` is False where there
    are none; ``link`` (P,), ``ends``, ``need`` and ``leg`` are those of ``Parts``, empty where they are thin; ``most``
    m the largest need; ``apart``: when links are clear of each other whatever their parts; ``weights`` (2 N - 1,) and
    ``shift`` m of the centre of mass; ``margin`` m NaN where it is not asked for; ``size`` m of the longest link."""

    links: Array
    ceiling: float
    limits: Array
    limited: bool
    nearest: float
    link: IntArray
    ends: Array
    need: Array
    leg: BoolArray
    most: float
    apart: Apart
    tail: float
    weights: Array
    shift: float
    margin: float
    size: float


class Pose(NamedTuple):
    """Room for one pose: ``start``, ``offset`` and ``anchors`` (N, 2) m, ``origins`` (2 N, 2) m of all links with the
    tail link and the head link, cosine and sine ``turn`` (2 N, 2) of their angles, ``angles`` (2 N,) rad, ``short`` and
    ``square`` (N - 1,) m^2 of the legs, and room (P, 9) for :func:`overlap`. What moves with no anchor that moves is
    laid and tried once for a move: ``fresh`` (2,) says that it is not there yet, nor the parts on it, ``moved`` (2 N,)
    which links were laid last."""

    start: Array
    offset: Array
    anchors: Array
    origins: Array
    turn: Array
    angles: Array
    short: Array
    square: Array
    work: Array
    fresh: BoolArray
    moved: BoolArray


@njit(cache=True)
def room_for(bounds: Bounds) -> Pose:
    """Room for one pose."""
    count = len(bounds.links) // 2 + 1
    turn = np.zeros((2 * count, 2))
    turn[:, 0] = 1.0
    return Pose(
        np.zeros((count, 2)),
        np.zeros((count, 2)),
        np.zeros((count, 2)),
        np.zeros((2 * count, 2)),
        turn,
        np.zeros(2 * count),
        np.zeros(count - 1),
        np.zeros(count - 1),
        np.zeros((len(bounds.link), 9)),
        np.ones(2, dtype=np.bool_),
        np.ones(2 * count, dtype=np.bool_),
    )


@inlined
def lay(
    bounds: Bounds, before: Array, after: Array, lift: Array, early: Array, m: int, tau: float, even: Even, only: int,
    pose: Pose,
) -> None:  # fmt: skip
    """The snake at ``tau`` of move ``m``, where swings have ``even`` in common; NaN where a leg does not reach.
    ``only``: an anchor that has moved since the last pose, whether it does in this move or not (-1: none)."""
    links, count, fresh = bounds.links, before.shape[1], pose.fresh[0]
    anchors, origins, turn, moved = pose.anchors, pose.origins, pose.turn, pose.moved
    for k in range(2 * count):
        moved[k] = fresh
    for i in range(count):
        moves = before[m, i, 0] != after[m, i, 0] or before[m, i, 1] != after[m, i, 1] or lift[m, i] != 0.0
        if moves or i == only or fresh:
            swing_one(before, after, lift, early, m, i, tau, even, pose.start, pose.offset)
            anchors[i, 0] = pose.start[i, 0] + pose.offset[i, 0]
            anchors[i, 1] = pose.start[i, 1] + pose.offset[i, 1]
        if moves or i == only:
            for k in range(max(2 * i - 1, 0), min(2 * i + 3, 2 * count)):
                moved[k] = True
    for i in range(count - 1):
        a, b, rear = links[2 * i], links[2 * i + 1], 2 * i + 1
        if not moved[rear]:
            continue
        x, z, short = chord_of(pose.start, pose.offset, i, (a + b) ** 2)
        pose.short[i], pose.square[i] = short, x * x + z * z
        along, up = elbow(a, b, x, z, short)
        origins[rear, 0], origins[rear, 1] = anchors[i, 0], anchors[i, 1]
        origins[rear + 1, 0], origins[rear + 1, 1] = anchors[i, 0] + along, anchors[i, 1] + up
        turn[rear, 0], turn[rear, 1] = along / a, up / a
        turn[rear + 1, 0], turn[rear + 1, 1] = (x - along) / b, (z - up) / b
        if bounds.limited:
            pose.angles[rear], pose.angles[rear + 1], _, _ = leg_angles(a, b, x, z, short)
    origins[0, 0], origins[0, 1] = anchors[0, 0] - bounds.tail, anchors[0, 1]
    origins[2 * count - 1, 0], origins[2 * count - 1, 1] = anchors[count - 1, 0], anchors[count - 1, 1]
    pose.fresh[0] = False


@inlined
def excess(bounds: Bounds, swinging: BoolArray, pose: Pose, enough: float, out: Array) -> bool:
    """How far a pose is beyond every one of :data:`DEMANDS`, relative to links or as a share of pi, into ``out`` (7,);
    not positive where it is met, -inf where it is not asked for or the leg is not known. ``swinging`` (N,): the anchors
    that do not carry. What comes after a demand that it is beyond by more than ``enough`` is left at -inf, and True is
    the result; unless that is infinite, legs that were not moved are within it."""
    links, legs, size = bounds.links, len(bounds.links) // 2, bounds.size
    for d in range(len(out)):
        out[d] = -np.inf
    anchors, origins = pose.anchors, pose.origins
    known = True
    for i in range(legs):
        if enough < np.inf and not pose.moved[2 * i + 1]:
            continue
        a, b = links[2 * i], links[2 * i + 1]
        whole = (a + b) ** 2
        least = max(bounds.nearest**2, (a - b) ** 2 + 1e-12 * whole)
        out[REACH] = max(out[REACH], -pose.short[i] / whole)
        out[COLLAPSED] = max(out[COLLAPSED], (least - pose.square[i]) / whole)
        low, high = min(anchors[i, 1], anchors[i + 1, 1]), max(anchors[i, 1], anchors[i + 1, 1])
        top = origins[2 * i + 2, 1]
        if np.isfinite(bounds.ceiling):
            # a lifted anchor may be higher than the elbows beside it
            out[ANCHORS] = max(out[ANCHORS], (high - low - bounds.ceiling) / size)
            if not np.isnan(top):
                out[ELBOWS] = max(out[ELBOWS], (top - low - bounds.ceiling) / size)
        known = known and not np.isnan(top)
    if max(out[REACH], out[COLLAPSED], out[ELBOWS], out[ANCHORS]) > enough:
        return True
    if not np.isnan(bounds.margin) and known:
        out[TIPS] = (bounds.margin - _margin(bounds, swinging, pose)) / size
        if out[TIPS] > enough:
            return True
    if bounds.limited:
        for j in range(2 * legs + 1):
            q = pose.angles[j + 1] - pose.angles[j]
            if not np.isnan(q):
                out[LIMIT] = max(out[LIMIT], (bounds.limits[j, 0] - q) / np.pi, (q - bounds.limits[j, 1]) / np.pi)
        if out[LIMIT] > enough:
            return True
    if len(bounds.link) and known:
        # of those that are clear of each other it does not matter by how much where only that is asked
        least = -bounds.most if enough == np.inf else 0.0
        if least == 0.0 and all_apart(bounds.apart, origins, pose.turn, pose.moved):
            own = other = least
        else:
            if pose.fresh[1]:
                for k in range(len(pose.moved)):
                    pose.moved[k] = True
                pose.fresh[1] = False
            own, other = overlap(
                origins, pose.turn, bounds.link, bounds.ends, bounds.need, bounds.leg, bounds.most, least, pose.moved,
                pose.work,
            )  # fmt: skip
        out[COLLAPSED], out[CROSSING] = max(out[COLLAPSED], own / size), other / size
        return bool(max(out[COLLAPSED], out[CROSSING]) > enough)
    return False


@lean
def _margin(bounds: Bounds, swinging: BoolArray, pose: Pose) -> float:
    """m from the centre of mass to the nearer of the rearmost and the foremost anchor that carries."""
    center, rear, front = bounds.shift, np.inf, -np.inf
    for i in range(len(swinging)):
        x = pose.anchors[i, 0]
        center += bounds.weights[2 * i] * x
        if i < len(swinging) - 1:
            center += bounds.weights[2 * i + 1] * pose.origins[2 * i + 2, 0]
        if not swinging[i]:
            rear, front = min(rear, x), max(front, x)
    return min(center - rear, front - center)


@njit(cache=True)
def worst(
    bounds: Bounds,
    before: Array,
    after: Array,
    lift: Array,
    early: Array,
    swinging: BoolArray,
    met: float,
    coarse: int,
    fine: int,
    rounds: int,
    largest: bool,
    out: Array,
) -> None:
    """The largest excess of every move over each demand into ``out`` (M, 7): at ``coarse`` places, and then in
    ``rounds`` of ``fine`` ones around the worst place of every demand for which that matters. That is where it may be
    broken between the places though it is ``met`` at them; with ``largest``, also where it may be the largest of all
    but reach."""
    pose, found = room_for(bounds), np.empty(len(DEMANDS))
    values, at = np.empty((coarse, len(DEMANDS))), np.empty(len(DEMANDS))
    for m in range(len(before)):
        pose.fresh[:] = True
        for p in range(coarse):
            tau = p / (coarse - 1.0)
            lay(bounds, before, after, lift, early, m, tau, even_at(tau), -1, pose)
            excess(bounds, swinging[m], pose, np.inf, found)
            values[p] = found
        most = out[m]
        reserve = np.zeros(len(DEMANDS))
        for d in range(len(DEMANDS)):
            k = int(np.argmax(values[:, d]))
            most[d], at[d] = values[k, d], k / (coarse - 1.0)
            # between places a smooth peak rises by at most a quarter of what it falls to the lower of its neighbours
            for near in (max(k - 1, 0), min(k + 1, coarse - 1)):
                if values[near, d] > -np.inf:
                    reserve[d] = max(reserve[d], most[d] - values[near, d])
                else:
                    reserve[d] = np.inf
        for d in range(len(DEMANDS)):
            if most[d] == -np.inf:
                continue
            step, where = 1.0 / (coarse - 1.0), at[d]
            for _ in range(rounds):
                wanted = most[d] <= met < most[d] + reserve[d]
                if largest and d != REACH:
                    highest = most[COLLAPSED:].max()
                    wanted = wanted or most[d] + reserve[d] > highest or most[d] == highest
                if not wanted:
                    break
                middle, best = where, -np.inf
                for p in range(fine):
                    tau = min(max(middle + step * (2.0 * p / (fine - 1.0) - 1.0), 0.0), 1.0)
                    lay(bounds, before, after, lift, early, m, tau, even_at(tau), -1, pose)
                    excess(bounds, swinging[m], pose, np.inf, found)
                    if found[d] > best:
                        best, where = found[d], tau
                    for e in range(len(DEMANDS)):
                        most[e] = max(most[e], found[e])
                step *= 2.0 / (fine - 1.0)
