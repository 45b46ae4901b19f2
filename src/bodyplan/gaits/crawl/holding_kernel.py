"""Kernels of a robot at rest on its feet: where its weight is, and what drives hold."""

from __future__ import annotations

import numpy as np
from numba import njit

from bodyplan.arrays import Array
from bodyplan.gaits.crawl.leg_kernel import EPSILON, THETA, A, Tables, chain, moment, room


@njit(cache=True, nogil=True)
def weighed(T: Tables, q: Array, centers: Array, feet: Array) -> None:
    """Centres of mass ``centers`` (B, 3) and of the ``feet`` (B, m, 3), m in the base, at ``q`` (B, n)."""
    F, _ = room(T)
    mass = T.body[0] + T.masses.sum()
    for b in range(len(q)):
        for i in range(3):
            centers[b, i] = T.body[0] * T.body[1 + i]
        for leg in range(feet.shape[1]):
            chain(T, leg, q[b], F)
            moment(T, leg, F, centers[b])
            _foot(T, leg, F, feet[b, leg])
        for i in range(3):
            centers[b, i] /= mass


@njit(cache=True, nogil=True)
def held(T: Tables, q: Array, up: Array, loads: Array, gravity: float, torques: Array) -> None:
    """Add to ``torques`` (B, n) N m (N of slides) what joints at ``q`` (B, n) hold against the weights of legs, and
    against ``loads`` (B, m) N of their feet, along ``up`` (B, 3), which is upright in the axes of the base."""
    F, _ = room(T)
    foot, beyond = np.empty(3), np.empty(3)
    for b in range(len(q)):
        u, v, w = up[b, 0], up[b, 1], up[b, 2]
        for leg in range(loads.shape[1]):
            chain(T, leg, q[b], F)
            _foot(T, leg, F, foot)
            first, mass = T.starts[leg], 0.0
            beyond[:] = 0.0
            for k in range(T.starts[leg + 1] - first - 1, -1, -1):
                r = first + k
                for i in range(3):
                    place = F[k + 1, i]
                    for j in range(3):
                        place += F[k + 1, 3 + 3 * i + j] * T.centres[r, j]
                    beyond[i] += T.masses[r] * place
                mass += T.masses[r]
                for d in range(4):
                    if T.joints[r, d] < 0:
                        continue
                    # theta and d along z of the frame before, a and epsilon along x of the frame after
                    at, axis = (k, 2) if d < A else (k + 1, 0)
                    x, y, z = F[at, 3 + axis], F[at, 6 + axis], F[at, 9 + axis]
                    if d in (THETA, EPSILON):
                        # up x axis, times the levers of the weights and of the load
                        x, y, z = y * w - z * v, z * u - x * w, x * v - y * u
                        torque = 0.0
                        for i, c in enumerate((x, y, z)):
                            torque += c * (gravity * (mass * F[at, i] - beyond[i]))
                            torque -= c * (loads[b, leg] * (F[at, i] - foot[i]))
                    else:
                        torque = (gravity * mass - loads[b, leg]) * (x * u + y * v + z * w)
                    torques[b, T.joints[r, d]] += T.scales[r, d] * torque


@njit(cache=True, nogil=True)
def _foot(T: Tables, leg: int, F: Array, out: Array) -> None:
    """The place ``out`` (3,) of the foot of a leg with frames ``F``."""
    count = T.starts[leg + 1] - T.starts[leg]
    for i in range(3):
        out[i] = F[count, i]
        for j in range(3):
            out[i] += F[count, 3 + 3 * i + j] * T.local[leg, j]
