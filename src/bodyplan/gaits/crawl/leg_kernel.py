"""Kernels of legs: poses along a chain of D-H rows, how its foot moves with its joints, and the joints that place it.

A leg is read off :class:`Tables`. Frames along it are rows of 12 numbers: the origin, then the rotation row by row.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.kernels import lean

#: most steps of Newton, and after how many that do not halve the error it gives up; the error in m at which a foot is
#: in place; the longest step of a joint (rad, or m)
STEPS, PATIENCE, PLACED, STRIDE = 60, 15, 1e-13, 0.3
#: most sweeps of rotations that make the columns of a matrix (3, 3) upright to each other
SWEEPS = 30
#: smallest volume that the directions of a leg's joints span at which it can still be told its joints
SINGULAR = 1e-6
#: variables of a row
THETA, D, A, EPSILON = 0, 1, 2, 3


class Tables(NamedTuple):
    """All legs of a robot, row after row. ``starts`` (m + 1,): where rows of legs begin. Of every row and variable
    (theta, d, a, epsilon): ``joints`` (R, 4) that drive it and which of the leg's three ``slots`` they are in (-1:
    none), ``values`` (R, 4) at 0 and ``scales`` (R, 4); ``turns`` (R, 4): cosine and sine of theta and of epsilon,
    where no joint drives them; ``masses`` (R,) kg of the frames after rows and their ``centres`` (R, 3) m. Of every
    leg: ``columns`` (m, 3) of its actuated joints and the foot's place ``local`` (m, 3) m in its last frame. ``body``
    (4,): mass kg of the base and its centre m."""

    starts: IntArray
    joints: IntArray
    slots: IntArray
    values: Array
    scales: Array
    turns: Array
    masses: Array
    centres: Array
    columns: IntArray
    local: Array
    body: Array


class Postures(NamedTuple):
    """Coarse grids over the ranges of the legs' joints, leg after leg. ``starts`` (m + 1,); coordinates ``sets``
    (g, 3), places ``feet`` (g, 3) m, and the ``sides`` (g,) to which the leg is bent."""

    starts: IntArray
    sets: Array
    feet: Array
    sides: IntArray


@lean
def chain(T: Tables, leg: int, q: Array, F: Array) -> None:
    """Frames ``F`` (rows + 1, 12) of a leg at ``q`` (n,), that of the base first."""
    first = T.starts[leg]
    for i in range(12):
        F[0, i] = 1.0 if i in (3, 7, 11) else 0.0
    for k in range(T.starts[leg + 1] - first):
        r = first + k
        c, s, ce, se = T.turns[r, 0], T.turns[r, 1], T.turns[r, 2], T.turns[r, 3]
        d, a = T.values[r, 1], T.values[r, 2]
        if T.joints[r, 0] >= 0:
            theta = T.values[r, 0] + T.scales[r, 0] * q[T.joints[r, 0]]
            c, s = math.cos(theta), math.sin(theta)
        if T.joints[r, 1] >= 0:
            d += T.scales[r, 1] * q[T.joints[r, 1]]
        if T.joints[r, 2] >= 0:
            a += T.scales[r, 2] * q[T.joints[r, 2]]
        if T.joints[r, 3] >= 0:
            epsilon = T.values[r, 3] + T.scales[r, 3] * q[T.joints[r, 3]]
            ce, se = math.cos(epsilon), math.sin(epsilon)
        for i in range(3):
            x, y, z = F[k, 3 + 3 * i], F[k, 4 + 3 * i], F[k, 5 + 3 * i]
            ahead, left = c * x + s * y, c * y - s * x
            F[k + 1, i] = F[k, i] + d * z + a * ahead
            F[k + 1, 3 + 3 * i] = ahead
            F[k + 1, 4 + 3 * i] = ce * left + se * z
            F[k + 1, 5 + 3 * i] = ce * z - se * left


@lean
def moves(T: Tables, leg: int, F: Array, foot: Array, S: Array) -> None:
    """The place ``foot`` (3,) of a leg with frames ``F``, and how it moves with its three joints, ``S`` (3, 3)."""
    first, count = T.starts[leg], T.starts[leg + 1] - T.starts[leg]
    for i in range(3):
        foot[i] = F[count, i]
        for j in range(3):
            foot[i] += F[count, 3 + 3 * i + j] * T.local[leg, j]
            S[i, j] = 0.0
    for k in range(count):
        for v in range(4):
            slot = T.slots[first + k, v]
            if slot < 0:
                continue
            # theta and d along z of the frame before, a and epsilon along x of the frame after
            at, axis = (k, 2) if v < A else (k + 1, 0)
            scale = T.scales[first + k, v]
            x, y, z = F[at, 3 + axis], F[at, 6 + axis], F[at, 9 + axis]
            if v in (THETA, EPSILON):
                u, w, h = foot[0] - F[at, 0], foot[1] - F[at, 1], foot[2] - F[at, 2]
                x, y, z = y * h - z * w, z * u - x * h, x * w - y * u
            S[0, slot] += scale * x
            S[1, slot] += scale * y
            S[2, slot] += scale * z


@lean
def volume(S: Array) -> float:
    """Determinant of ``S`` (3, 3)."""
    return float(
        S[0, 0] * (S[1, 1] * S[2, 2] - S[2, 1] * S[1, 2])
        + S[1, 0] * (S[2, 1] * S[0, 2] - S[0, 1] * S[2, 2])
        + S[2, 0] * (S[0, 1] * S[1, 2] - S[1, 1] * S[0, 2])
    )


@lean
def side_of(S: Array) -> int:
    """1 or -1: to which side a leg is bent, the sign of the determinant of ``S`` (3, 3); 0 where it is singular."""
    size = 1.0
    for j in range(3):
        size *= math.sqrt(S[0, j] ** 2 + S[1, j] ** 2 + S[2, j] ** 2)
    v = volume(S)
    if not abs(v) > SINGULAR * size:
        return 0
    return 1 if v > 0.0 else -1


@lean
def solve(S: Array, b: Array, x: Array, M: Array) -> None:
    """``x`` (3,) of S x = b by Cramer's rule; the least x of least error where ``S`` is all but singular. ``M`` (6, 3):
    room."""
    if not regular(S, b, x):
        least(S, b, x, M)


@lean
def least(S: Array, b: Array, x: Array, M: Array) -> None:
    """The least ``x`` (3,) of least error of S x = b, without directions in which ``S`` moves less than SINGULAR of the
    most: from its singular values by one-sided rotations (Hestenes 1958). ``M`` (6, 3): room."""
    for i in range(3):
        for j in range(3):
            M[j, i], M[3 + j, i] = S[i, j], 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        turned = False
        for p in range(2):
            for r in range(p + 1, 3):
                pp = M[p, 0] * M[p, 0] + M[p, 1] * M[p, 1] + M[p, 2] * M[p, 2]
                rr = M[r, 0] * M[r, 0] + M[r, 1] * M[r, 1] + M[r, 2] * M[r, 2]
                pr = M[p, 0] * M[r, 0] + M[p, 1] * M[r, 1] + M[p, 2] * M[r, 2]
                if abs(pr) <= 1e-16 * math.sqrt(pp * rr):
                    continue
                turned = True
                zeta = 0.5 * (rr - pp) / pr
                t = (1.0 if zeta >= 0.0 else -1.0) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for k in (0, 3):
                    for i in range(3):
                        u, v = M[p + k, i], M[r + k, i]
                        M[p + k, i], M[r + k, i] = c * u - s * v, s * u + c * v
        if not turned:
            break
    most = 0.0
    for k in range(3):
        most = max(most, M[k, 0] * M[k, 0] + M[k, 1] * M[k, 1] + M[k, 2] * M[k, 2])
        x[k] = 0.0
    for k in range(3):
        square = M[k, 0] * M[k, 0] + M[k, 1] * M[k, 1] + M[k, 2] * M[k, 2]
        if square > SINGULAR * SINGULAR * most:
            share = (M[k, 0] * b[0] + M[k, 1] * b[1] + M[k, 2] * b[2]) / square
            for i in range(3):
                x[i] += share * M[3 + k, i]


@lean
def regular(S: Array, b: Array, x: Array) -> bool:
    """``x`` (3,) of S x = b by Cramer's rule; False where ``S`` is all but singular."""
    if side_of(S) == 0:
        return False
    v = volume(S)
    for j in range(3):
        k, m = (j + 1) % 3, (j + 2) % 3
        x[j] = (
            b[0] * (S[1, k] * S[2, m] - S[2, k] * S[1, m])
            + b[1] * (S[2, k] * S[0, m] - S[0, k] * S[2, m])
            + b[2] * (S[0, k] * S[1, m] - S[1, k] * S[0, m])
        ) / v
    return True


@lean
def newton(T: Tables, leg: int, q: Array, target: Array, side: int, F: Array, W: Array) -> bool:
    """Move the joints of a leg in ``q`` (n,) so that its foot is at ``target`` (3,), as near as can be; whether it
    comes there, bent to ``side``. ``F``, ``W`` (13, 3): room for frames and vectors."""
    foot, off, step, found, S, M = W[0], W[1], W[2], W[3], W[4:7], W[7:13]
    columns = T.columns[leg]
    best, bent, idle = np.inf, 0, 0
    scale = max(1.0, max(abs(target[0]), abs(target[1]), abs(target[2])))
    for j in range(3):
        found[j] = q[columns[j]]
    for _ in range(STEPS):
        chain(T, leg, q, F)
        moves(T, leg, F, foot, S)
        for i in range(3):
            off[i] = target[i] - foot[i]
        size = math.sqrt(off[0] ** 2 + off[1] ** 2 + off[2] ** 2)
        idle = 0 if size < 0.5 * best else idle + 1
        if size < best:
            best, bent = size, side_of(S)
            for j in range(3):
                found[j] = q[columns[j]]
        if not (best > PLACED * scale and idle < PATIENCE):
            break
        solve(S, off, step, M)
        longest = max(abs(step[0]), abs(step[1]), abs(step[2]))
        share = min(1.0, STRIDE / max(longest, 1e-300))
        for j in range(3):
            q[columns[j]] += step[j] * share
    for j in range(3):
        q[columns[j]] = found[j]
    return bool(best <= 100.0 * PLACED * scale and bent == side and bent != 0)


@lean
def placed(
    T: Tables, P: Postures, leg: int, q: Array, guess: Array, target: Array, side: int, F: Array, W: Array
) -> bool:
    """The joints of a leg in ``q`` (n,) for its foot at ``target`` (3,): by Newton from ``guess`` (n,), or else from
    the posture on the same side whose foot is nearest. Whether it comes there."""
    for j in range(3):
        q[T.columns[leg, j]] = guess[T.columns[leg, j]]
    if newton(T, leg, q, target, side, F, W):
        return True
    return _placed_from_afar(T, P, leg, q, target, side, F, W)


@lean
def _placed_from_afar(T: Tables, P: Postures, leg: int, q: Array, target: Array, side: int, F: Array, W: Array) -> bool:
    nearest, far = -1, np.inf
    for k in range(P.starts[leg], P.starts[leg + 1]):
        if P.sides[k] == side:
            x, y, z = P.feet[k, 0] - target[0], P.feet[k, 1] - target[1], P.feet[k, 2] - target[2]
            d = x * x + y * y + z * z
            if d < far:
                nearest, far = k, d
    if nearest < 0:
        return False
    columns = T.columns[leg]
    kept = (q[columns[0]], q[columns[1]], q[columns[2]])
    for j in range(3):
        q[columns[j]] = P.sets[nearest, j]
    if newton(T, leg, q, target, side, F, W):
        return True
    for j in range(3):
        q[columns[j]] = kept[j]
    return False


@njit(cache=True, nogil=True)
def sides(T: Tables, q: Array, out: IntArray) -> None:
    """To which sides ``out`` (m,) all legs are bent at ``q`` (n,)."""
    F, W = room(T)
    for leg in range(len(out)):
        chain(T, leg, q, F)
        moves(T, leg, F, W[0], W[4:7])
        out[leg] = side_of(W[4:7])


@njit(cache=True, nogil=True)
def room(T: Tables) -> tuple[Array, Array]:
    """Arrays for the frames of a leg and for vectors."""
    most = 0
    for leg in range(len(T.starts) - 1):
        most = max(most, T.starts[leg + 1] - T.starts[leg])
    return np.empty((most + 1, 12)), np.empty((13, 3))


@njit(cache=True, nogil=True)
def place(T: Tables, P: Postures, targets: Array, guess: Array, q: Array, came: BoolArray) -> None:
    """Joints ``q`` (B, n) that put feet at ``targets`` (B, m, 3), and which of them ``came`` (B, m) there."""
    F, W = room(T)
    legs = targets.shape[1]
    bent = np.empty(legs, dtype=np.int64)
    sides(T, guess, bent)
    for b in range(len(targets)):
        q[b] = guess
        for leg in range(legs):
            target = targets[b, leg]
            # most feet stand still in the body's axes while one of them swings
            if b > 0 and same(target, targets[b - 1, leg]):
                came[b, leg] = came[b - 1, leg]
                for j in range(3):
                    q[b, T.columns[leg, j]] = q[b - 1, T.columns[leg, j]]
            else:
                came[b, leg] = placed(T, P, leg, q[b], guess, target, bent[leg], F, W)


@lean
def same(a: Array, b: Array) -> bool:
    """Whether two points (3,) are the same."""
    return bool(a[0] == b[0] and a[1] == b[1] and a[2] == b[2])


@lean
def moment(T: Tables, leg: int, F: Array, out: Array) -> None:
    """Add the masses of a leg with frames ``F`` times their places, kg m in the base, to ``out`` (3,)."""
    first = T.starts[leg]
    for k in range(T.starts[leg + 1] - first):
        mass = T.masses[first + k]
        if mass > 0.0:
            for i in range(3):
                place = F[k + 1, i]
                for j in range(3):
                    place += F[k + 1, 3 + 3 * i + j] * T.centres[first + k, j]
                out[i] += mass * place


@lean
def drift(T: Tables, leg: int, qd: Array, F: Array, out: Array) -> None:
    """Acceleration ``out`` (3,) of the foot of a leg with frames ``F`` where joints move with rates ``qd`` (n,) and
    none accelerates: carried along the chain, row by row."""
    first, count = T.starts[leg], T.starts[leg + 1] - T.starts[leg]
    # angular velocity and acceleration so far
    wx = wy = wz = gx = gy = gz = 0.0
    out[0] = out[1] = out[2] = 0.0
    for k in range(count + 1):
        tx = ty = tz = 0.0  # velocity of slides
        if k < count:
            r = first + k
            end = F[k + 1]
            rx, ry, rz = end[0] - F[k, 0], end[1] - F[k, 1], end[2] - F[k, 2]
            if T.joints[r, 0] >= 0:
                rate = T.scales[r, 0] * qd[T.joints[r, 0]]
                ex, ey, ez = rate * F[k, 5], rate * F[k, 8], rate * F[k, 11]
                gx, gy, gz = gx + wy * ez - wz * ey, gy + wz * ex - wx * ez, gz + wx * ey - wy * ex
                wx, wy, wz = wx + ex, wy + ey, wz + ez
            if T.joints[r, 1] >= 0:
                rate = T.scales[r, 1] * qd[T.joints[r, 1]]
                tx, ty, tz = tx + rate * F[k, 5], ty + rate * F[k, 8], tz + rate * F[k, 11]
            if T.joints[r, 2] >= 0:
                rate = T.scales[r, 2] * qd[T.joints[r, 2]]
                tx, ty, tz = tx + rate * end[3], ty + rate * end[6], tz + rate * end[9]
        else:
            end = F[count]
            rx, ry, rz = 0.0, 0.0, 0.0
            for j in range(3):
                rx += end[3 + j] * T.local[leg, j]
                ry += end[6 + j] * T.local[leg, j]
                rz += end[9 + j] * T.local[leg, j]
        # w x (w x r + 2 t) + g x r
        ux, uy, uz = wy * rz - wz * ry + 2.0 * tx, wz * rx - wx * rz + 2.0 * ty, wx * ry - wy * rx + 2.0 * tz
        out[0] += wy * uz - wz * uy + gy * rz - gz * ry
        out[1] += wz * ux - wx * uz + gz * rx - gx * rz
        out[2] += wx * uy - wy * ux + gx * ry - gy * rx
        if k < count and T.joints[first + k, 3] >= 0:
            rate = T.scales[first + k, 3] * qd[T.joints[first + k, 3]]
            ex, ey, ez = rate * end[3], rate * end[6], rate * end[9]
            gx, gy, gz = gx + wy * ez - wz * ey, gy + wz * ex - wx * ez, gz + wx * ey - wy * ex
            wx, wy, wz = wx + ex, wy + ey, wz + ez


@njit(cache=True, nogil=True)
def rates(T: Tables, q: Array, velocity: Array, acceleration: Array, qd: Array, qdd: Array) -> None:
    """Joint rates ``qd`` and accelerations ``qdd`` (B, n), zero before, at ``q`` (B, n) for feet that move with
    ``velocity`` and ``acceleration`` (B, m, 3)."""
    F, W = room(T)
    foot, bias, x, S, M = W[0], W[1], W[2], W[4:7], W[7:13]
    for b in range(len(q)):
        for leg in range(velocity.shape[1]):
            columns = T.columns[leg]
            chain(T, leg, q[b], F)
            moves(T, leg, F, foot, S)
            solve(S, velocity[b, leg], x, M)
            for j in range(3):
                qd[b, columns[j]] = x[j]
            drift(T, leg, qd[b], F, bias)
            for i in range(3):
                bias[i] = acceleration[b, leg, i] - bias[i]
            solve(S, bias, x, M)
            for j in range(3):
                qdd[b, columns[j]] = x[j]
