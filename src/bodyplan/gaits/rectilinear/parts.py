"""How far the parts of a body that bends in an upright plane keep from each other: a Numba kernel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.kernels import lean
from bodyplan.robot.model import Robot
from bodyplan.robot.neighbours import separate_contacts


@dataclass(frozen=True, eq=False)
class Parts:
    """P capsules and balls on the links of a snake, tail first.

    ``link`` (P,): 0 the tail link, 1 to 2 N - 2 those between pitch joints, then the head link. ``ends`` (P, 2, 2) m in
    the frame of the link, from its rear joint along and up. ``need`` (P, P) m: how far two of them must be apart in the
    plane; 0 for those that are always clear of each other or may touch. ``leg`` (P, P): both are on one leg.
    """

    link: IntArray
    ends: Array
    need: Array
    leg: BoolArray

    @classmethod
    def of(cls, robot: Robot, columns: IntArray, stations: Array, share: float) -> Parts | None:
        """The contacts of ``robot`` on the links that the joints ``columns`` (2 N - 1,) at ``stations`` (2 N - 1,) m
        bend, to be kept apart by ``share`` more than their radii. None where all of them may touch."""
        rest = robot.forward(np.zeros(robot.n))
        bent = np.zeros((len(columns), robot.n))
        bent[np.arange(len(columns)), columns] = 0.1
        turned = np.abs(robot.forward(bent).quaternions - rest.quaternions).max(axis=-1) > 1e-6
        behind = np.concatenate([[0.0], stations])
        some = [k for k, c in enumerate(robot.contacts) if c.shape in ("capsule", "sphere")]
        frames = np.array([robot.frame_index(robot.contacts[k].frame) for k in some], dtype=np.int64)
        link = turned.sum(axis=0)[frames]
        order = np.argsort(link, kind="stable")
        place = {some[k]: p for p, k in enumerate(order)}
        ends, across, radius = np.zeros((len(some), 2, 2)), np.zeros(len(some)), np.zeros(len(some))
        for p, k in enumerate(order):
            contact, frame = robot.contacts[some[k]], frames[k]
            shape = contact.start if contact.shape == "sphere" else contact.end
            points = np.array([contact.start, shape]) @ rest.rotations[frame].T + rest.positions[frame]
            ends[p] = points[:, [0, 2]] - [behind[link[k]], 0.0]
            across[p], radius[p] = points[:, 1].mean(), contact.radius
        need = np.zeros((len(some), len(some)))
        for a, b in separate_contacts(robot):
            if a in place and b in place:
                i, j = sorted((place[a], place[b]))
                apart = (1.0 + share) * (radius[i] + radius[j])
                need[i, j] = np.sqrt(max(apart**2 - (across[i] - across[j]) ** 2, 0.0))
        links = link[order]
        need[links[:, None] == links] = 0.0
        if not need.any():
            return None
        number = np.where((links > 0) & (links < len(columns)), (links - 1) // 2, -1 - links)
        return cls(links, ends, need, np.asarray(number[:, None] == number))

    def merged(self) -> Parts:
        """With parts that lie in each other in the plane as one, such as left and right feet. It is as far from others
        as any of them must be, so that the largest overlaps are the same."""
        at = np.column_stack([self.link, self.ends.reshape(len(self.link), 4)])
        one, which = np.unique(at, axis=0, return_index=True, return_inverse=True)[1:]
        order = np.argsort(one)  # in the order of links still
        one, which = one[order], np.argsort(order)[which.ravel()]
        need = np.zeros((len(one), len(one)))
        i, j = which[:, None], which
        np.maximum.at(need, (np.minimum(i, j), np.maximum(i, j)), self.need)
        return Parts(self.link[one], self.ends[one], need, self.leg[np.ix_(one, one)])

    def overlaps(self, points: Array, angles: Array, tail: float) -> Array:
        """(..., 2) m: by how much two parts of one leg, and two parts of different legs, are nearer to each other than
        they must be; negative where all are clear, but not below minus the largest ``need``; minus infinity where the
        pose is not known. ``points`` (..., 2 N - 1, 2) m of the joints, ``angles`` (..., 2 N - 2) rad of the links,
        ``tail`` m."""
        shape = points.shape[:-2]
        level = np.zeros((*shape, 1))
        origins = np.concatenate([points[..., :1, :] - [tail, 0.0], points], axis=-2).reshape(
            -1, points.shape[-2] + 1, 2
        )
        turns = np.concatenate([level, angles, level], axis=-1).reshape(len(origins), -1)
        out = np.full((len(origins), 2), -np.inf)
        known = np.flatnonzero(np.isfinite(origins).all(axis=(1, 2)))
        _overlaps(origins, turns, known, self.link, self.ends, self.need, self.leg, out)
        return out.reshape(*shape, 2)


@njit(cache=True)
def _overlaps(
    origins: Array, turns: Array, known: IntArray, link: IntArray, ends: Array, need: Array, leg: BoolArray, out: Array
) -> None:
    """Largest need - distance of two parts, into ``out`` (S, 2), of the states ``known``."""
    turn, work = np.empty((turns.shape[1], 2)), np.empty((len(link), 9))
    most, all_links = need.max(), np.ones(turns.shape[1], dtype=np.bool_)
    for s in known:
        for k in range(len(turn)):
            turn[k, 0], turn[k, 1] = np.cos(turns[s, k]), np.sin(turns[s, k])
        out[s, 0], out[s, 1] = overlap(origins[s], turn, link, ends, need, leg, most, -most, all_links, work)


@lean
def overlap(
    origins: Array,
    turn: Array,
    link: IntArray,
    ends: Array,
    need: Array,
    leg: BoolArray,
    most: float,
    least: float,
    moved: BoolArray,
    work: Array,
) -> tuple[float, float]:
    """Largest need - distance m of two parts of one leg, and of two of different legs, but not below ``least``, in one
    pose: ``origins`` (2 N, 2) m of all links, cosine and sine of their angles ``turn`` (2 N, 2). ``most``: the largest
    ``need``. Only links ``moved`` (2 N,) are looked at: what else there is lies in ``work`` (P, 9) from the last time,
    and two parts of it were clear of each other then."""
    count = len(link)
    at, low, high, ahead, bottom, top = work[:, :4], work[:, 4], work[:, 5], work[:, 6], work[:, 7], work[:, 8]
    own = other = least
    for p in range(count):
        k = link[p]
        if not moved[k]:
            continue
        for e in range(2):
            x, z = ends[p, e]
            at[p, 2 * e] = origins[k, 0] + turn[k, 0] * x - turn[k, 1] * z
            at[p, 2 * e + 1] = origins[k, 1] + turn[k, 1] * x + turn[k, 0] * z
        low[p], high[p] = min(at[p, 0], at[p, 2]), max(at[p, 0], at[p, 2])
        bottom[p], top[p] = min(at[p, 1], at[p, 3]), max(at[p, 1], at[p, 3])
    ahead[count - 1] = low[count - 1]
    for p in range(count - 2, -1, -1):
        ahead[p] = min(low[p], ahead[p + 1])
    for i in range(count):
        mine = moved[link[i]]
        for j in range(i + 1, count):
            if most - (ahead[j] - high[i]) <= min(own, other):
                break
            if need[i, j] <= 0.0 or not (mine or moved[link[j]]):
                continue
            found = own if leg[i, j] else other
            apart = max(low[j] - high[i], low[i] - high[j], bottom[j] - top[i], bottom[i] - top[j])
            if need[i, j] - apart > found:
                found = max(found, need[i, j] - _distance(at[i], at[j]))
                if leg[i, j]:
                    own = found
                else:
                    other = found
    return own, other


@lean
def _distance(p: Array, q: Array) -> float:
    """Of two segments (4,): x and z of both ends."""
    a, b, c, d = _side(p, q[0], q[1]), _side(p, q[2], q[3]), _side(q, p[0], p[1]), _side(q, p[2], p[3])
    if ((a > 0.0 > b) or (a < 0.0 < b)) and ((c > 0.0 > d) or (c < 0.0 < d)):
        return 0.0
    return min(_to(p, q[0], q[1]), _to(p, q[2], q[3]), _to(q, p[0], p[1]), _to(q, p[2], p[3]))


@lean
def _side(p: Array, x: float, z: float) -> float:
    return float((p[2] - p[0]) * (z - p[1]) - (p[3] - p[1]) * (x - p[0]))


@lean
def _to(p: Array, x: float, z: float) -> float:
    """Distance of a point from a segment."""
    ux, uz, vx, vz = p[2] - p[0], p[3] - p[1], x - p[0], z - p[1]
    square = ux * ux + uz * uz
    share = min(max((ux * vx + uz * vz) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return float(np.hypot(vx - share * ux, vz - share * uz))
