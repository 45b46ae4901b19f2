"""Kernel of the support while a leg swings: for one sway of the body after the other, how far the centre of mass is
inside of the feet that stand."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray
from bodyplan.gaits.crawl.leg_kernel import Postures, Tables, chain, moment, placed, room, sides
from bodyplan.kernels import lean
from bodyplan.spatial.hulls import EDGE, edge_distance, edges_of

#: smallest distance m from an edge whose logarithm is taken
LEAST = 1e-6


@lean
def turn_of(pose: Array, R: Array) -> None:
    """Rotation ``R`` (3, 3) = Rz(yaw) Ry(pitch) Rx(roll) of a ``pose`` (6,): x, y, z, roll, pitch, yaw."""
    sr, cr, sp, cp, sy, cy = (
        math.sin(pose[3]),
        math.cos(pose[3]),
        math.sin(pose[4]),
        math.cos(pose[4]),
        math.sin(pose[5]),
        math.cos(pose[5]),
    )
    R[0, 0], R[0, 1], R[0, 2] = cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr
    R[1, 0], R[1, 1], R[1, 2] = sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr
    R[2, 0], R[2, 1], R[2, 2] = -sp, cp * sr, cp * cr


@lean
def seen(R: Array, pose: Array, point: Array, out: Array) -> None:
    """The world ``point`` (3,) in the axes and from the origin of a body at ``pose`` (6,) turned by ``R``."""
    x, y, z = point[0] - pose[0], point[1] - pose[1], point[2] - pose[2]
    for i in range(3):
        out[i] = R[0, i] * x + R[1, i] * y + R[2, i] * z


@njit(cache=True, nogil=True)
def sways(
    T: Tables,
    P: Postures,
    guess: Array,
    limits: Array,
    poses: Array,
    feet: Array,
    leg: int,
    swung: Array,
    enough: float,
    height: float,
    least: Array,
    barrier: Array,
    reached: BoolArray,
    within: BoolArray,
) -> int:
    """Of bodies at ``poses`` (S, 6) on ``feet`` (m, 3) m while ``leg`` swings along ``swung`` (p, 3) m: the ``least``
    (S,) distance m of the centre of mass from an edge of the support, the least sum ``barrier`` (S,) of the logarithms
    of these distances over ``height`` m, which feet are ``reached`` (S, m), and whether all joints stay ``within`` (S,)
    their ``limits`` (n, 2). Joints are found from ``guess`` (n,).

    Ends at the first of which all is right, with ``enough`` m of margin, and returns which it is; else -1."""
    F, W = room(T)
    legs = len(feet)
    bent, R, q = np.empty(legs, dtype=np.int64), np.empty((3, 3)), guess.copy()
    sides(T, guess, bent)
    stance, target = np.empty((legs - 1, 2)), np.empty(3)
    for j in range(legs - 1):
        stance[j, 0], stance[j, 1] = feet[j + (j >= leg), 0], feet[j + (j >= leg), 1]
    edges = np.empty((legs - 1, EDGE))
    edges_of(stance, edges)
    mass = T.body[0] + T.masses.sum()
    standing, all_of = np.empty(3), np.empty(3)
    for k in range(len(poses)):
        pose = poses[k]
        turn_of(pose, R)
        for i in range(3):
            standing[i] = T.body[0] * T.body[1 + i]
        whole = True
        for j in range(legs):
            reached[k, j] = True
            if j != leg:
                seen(R, pose, feet[j], target)
                reached[k, j] = placed(T, P, j, q, guess, target, bent[j], F, W)
                whole = whole and reached[k, j]
                chain(T, j, q, F)
                moment(T, j, F, standing)
        least[k] = barrier[k] = np.inf
        within[k] = True
        for p in range(len(swung)):
            seen(R, pose, swung[p], target)
            if not placed(T, P, leg, q, guess, target, bent[leg], F, W):
                reached[k, leg] = whole = False
            for i in range(len(q)):
                within[k] = within[k] and limits[i, 0] <= q[i] <= limits[i, 1]
            x, y = pose[0], pose[1]
            if mass > 0.0:
                all_of[:] = standing
                chain(T, leg, q, F)
                moment(T, leg, F, all_of)
                for i in range(3):
                    x += R[0, i] * all_of[i] / mass
                    y += R[1, i] * all_of[i] / mass
            logs = 0.0
            for e in range(len(edges)):
                d = edge_distance(edges[e], x, y)
                if d < np.inf:
                    least[k] = min(least[k], d)
                    logs += math.log(max(d, LEAST) / height)
            barrier[k] = min(barrier[k], logs)
        if whole and within[k] and least[k] >= enough:
            return k
    return -1
