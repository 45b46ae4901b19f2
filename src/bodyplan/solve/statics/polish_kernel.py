"""The kernel of :mod:`bodyplan.solve.statics.polish`: Newton's method on three systems of conditions of optimality."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.solve.statics.cones import CONE, RAY

#: which conditions: smallest norm, largest gain, least factor of friction
NORM, GAIN, RATIO = 0, 1, 2
#: residual that is rounding
NOTHING_LEFT = 3e-16
#: forces and multipliers beyond this are those of a solver that went astray
ENDLESS = 1e12
#: condition number (Frobenius) up to which steps that are held back come from the normal equations: right to 1e-8 of
#: themselves, which the next step of Newton's method mends
WELL = 1e4


@njit(cache=True, nogil=True, error_model="numpy")
def nearest(kind: IntArray, mu: Array, ray: Array, z: Array, x: Array, D: Array, by_mu: Array) -> None:
    """Into ``x`` (k, 3) the nearest points to z (k, 3) in cones (:class:`bodyplan.solve.statics.cones.Cones`), into
    ``D`` (k, 3, 3) and ``by_mu`` (k, 3) their derivatives by z and mu."""
    x[:], D[:], by_mu[:] = 0.0, 0.0, 0.0
    for i in range(len(kind)):
        if kind[i] == RAY:
            push = z[i, 0] * ray[i, 0] + z[i, 1] * ray[i, 1] + z[i, 2] * ray[i, 2]
            if push > 0.0:
                for a in range(3):
                    x[i, a] = push * ray[i, a]
                    for b in range(3):
                        D[i, a, b] = ray[i, a] * ray[i, b]
        elif kind[i] == CONE:
            m, r = mu[i], math.hypot(z[i, 1], z[i, 2])
            if m * r <= -z[i, 0]:
                continue
            if r <= m * z[i, 0]:
                for a in range(3):
                    x[i, a], D[i, a, a] = z[i, a], 1.0
                continue
            # r > 0 here: on the axis one of the two before holds
            c, s = z[i, 1] / r, z[i, 2] / r
            square = 1.0 + m * m
            along = (z[i, 0] + m * r) / square
            slope = r / square - 2.0 * m * along / square
            x[i, 0], x[i, 1], x[i, 2] = along, along * m * c, along * m * s
            D[i, 0, 0] = 1.0 / square
            D[i, 0, 1] = D[i, 1, 0] = m * c / square
            D[i, 0, 2] = D[i, 2, 0] = m * s / square
            turns = m * along / r
            D[i, 1, 1] = m * m * c * c / square + turns * (1.0 - c * c)
            D[i, 2, 2] = m * m * s * s / square + turns * (1.0 - s * s)
            D[i, 1, 2] = D[i, 2, 1] = m * m * c * s / square - turns * c * s
            by_mu[i, 0] = slope
            by_mu[i, 1], by_mu[i, 2] = slope * m * c + along * c, slope * m * s + along * s


@njit(cache=True, nogil=True, error_model="numpy")
def conditions(
    which: int,
    A: Array,
    b: Array,
    kind: IntArray,
    mu: Array,
    ray: Array,
    gain: Array,
    slope: Array,
    u: Array,
    rest: Array,
    jacobian: Array,
    near: Array,
) -> float:
    """The residual ``rest`` (n,) of the conditions at ``u`` (n,) and its ``jacobian`` (n, n), with the forces ``near``
    (k, 3); returns the residual's length.

    Unknowns: of NORM y (r,); of GAIN x (3k,) and y, with ``gain`` (3k,); of RATIO x, y and the factor s, where ``mu``
    (k,) are caps of the coefficients s ``slope``.
    """
    r, k = len(b), len(kind)
    size = 3 * k
    first = 0 if which == NORM else size
    z = np.empty((k, 3))
    for j in range(size):
        value = 0.0
        for q in range(r):
            value += A[q, j] * u[first + q]
        if which != NORM:
            value += u[j]
        if which == GAIN:
            value += gain[j]
        z[j // 3, j % 3] = value
    now, rate = mu, slope
    if which == RATIO:
        s = max(u[size + r], 0.0)
        now, rate = np.empty(k), np.empty(k)
        for i in range(k):
            now[i] = min(mu[i], s * slope[i])
            rate[i] = slope[i] if s * slope[i] < mu[i] else 0.0
    D, by_mu = np.empty((k, 3, 3)), np.empty((k, 3))
    nearest(kind, now, ray, z, near, D, by_mu)
    # D A^T, a row for each component
    turned = np.zeros((size, r))
    for i in range(k):
        for a in range(3):
            for c in range(3):
                d = D[i, a, c]
                if d != 0.0:
                    for q in range(r):
                        turned[3 * i + a, q] += d * A[q, 3 * i + c]
    jacobian[:] = 0.0
    if which == NORM:
        for q in range(r):
            value = -b[q]
            for j in range(size):
                value += A[q, j] * near[j // 3, j % 3]
            rest[q] = value
            for p in range(r):
                value = 0.0
                for j in range(size):
                    value += A[q, j] * turned[j, p]
                jacobian[q, p] = value
    else:
        for j in range(size):
            i, a = j // 3, j % 3
            rest[j] = u[j] - near[i, a]
            jacobian[j, j] = 1.0
            for c in range(3):
                jacobian[j, 3 * i + c] -= D[i, a, c]
            for q in range(r):
                jacobian[j, size + q] = -turned[j, q]
            if which == RATIO:
                jacobian[j, size + r] = -by_mu[i, a] * rate[i]
        for q in range(r):
            value = -b[q]
            for j in range(size):
                value += A[q, j] * u[j]
                jacobian[size + q, j] = A[q, j]
            rest[size + q] = value
        if which == RATIO:
            value = -1.0
            for q in range(r):
                value += u[size + q] ** 2
                jacobian[size + r, size + q] = u[size + q]
            rest[size + r] = 0.5 * value
    return math.sqrt(np.sum(rest * rest))


@njit(cache=True, nogil=True, error_model="numpy")
def solved(matrix: Array, right: Array, out: Array) -> bool:
    """Into ``out`` (n,) the solution of ``matrix`` (n, n) out = ``right``, by elimination with the largest pivot of a
    column; False where there is none."""
    n = len(right)
    work = matrix.copy()
    out[:] = right
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(work[i, j]) > abs(work[best, j]):
                best = i
        if not abs(work[best, j]) > 0.0:
            return False
        if best != j:
            for c in range(j, n):
                work[j, c], work[best, c] = work[best, c], work[j, c]
            out[j], out[best] = out[best], out[j]
        for i in range(j + 1, n):
            factor = work[i, j] / work[j, j]
            if factor != 0.0:
                for c in range(j + 1, n):
                    work[i, c] -= factor * work[j, c]
                out[i] -= factor * out[j]
    for j in range(n - 1, -1, -1):
        value = out[j]
        for c in range(j + 1, n):
            value -= work[j, c] * out[c]
        out[j] = value / work[j, j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def factored(normal: Array, damping: float, lower: Array) -> bool:
    """Into ``lower`` (n, n) Cholesky's factor of ``normal`` (n, n) + ``damping`` 1; False where there is none."""
    n = len(normal)
    for j in range(n):
        for i in range(j, n):
            value = normal[i, j] + (damping if i == j else 0.0)
            for c in range(j):
                value -= lower[i, c] * lower[j, c]
            if i > j:
                lower[i, j] = value / lower[j, j]
            elif value > 0.0:
                lower[j, j] = math.sqrt(value)
            else:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def well_conditioned(jacobian: Array, normal: Array, lower: Array) -> bool:
    """Into ``normal`` (n, n) J^T J of a ``jacobian`` J (n, n); whether |J| |J^-1| <= WELL in Frobenius's norm, which
    bounds the condition number from above. ``lower`` (n, n) is room."""
    n = len(jacobian)
    size = 0.0
    for i in range(n):
        for j in range(i + 1):
            value = 0.0
            for c in range(n):
                value += jacobian[c, i] * jacobian[c, j]
            normal[i, j] = value
        size += normal[i, i]
    if not factored(normal, 0.0, lower):
        return False
    # |J^-1| is the norm of the inverse factor, column by column
    inverse, column = 0.0, np.empty(n)
    for j in range(n):
        for i in range(j, n):
            value = 1.0 if i == j else 0.0
            for c in range(j, i):
                value -= lower[i, c] * column[c]
            column[i] = value / lower[i, i]
            inverse += column[i] * column[i]
    return size * inverse <= WELL * WELL


@njit(cache=True, nogil=True, error_model="numpy")
def held_back(jacobian: Array, rest: Array, normal: Array, damping: float, lower: Array, step: Array) -> bool:
    """Into ``step`` (n,) the solution of (J^T J + damping 1) step = -J^T rest, with J^T J in ``normal``."""
    n = len(rest)
    if not factored(normal, damping, lower):
        return False
    for i in range(n):
        value = 0.0
        for c in range(n):
            value -= jacobian[c, i] * rest[c]
        for c in range(i):
            value -= lower[i, c] * step[c]
        step[i] = value / lower[i, i]
    for i in range(n - 1, -1, -1):
        value = step[i]
        for c in range(i + 1, n):
            value -= lower[c, i] * step[c]
        step[i] = value / lower[i, i]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def newton(
    which: int,
    A: Array,
    b: Array,
    kind: IntArray,
    mu: Array,
    ray: Array,
    gain: Array,
    slope: Array,
    u: Array,
    steps: int,
    near: Array,
) -> float:
    """Improves ``u`` (n,) by Newton's method, with the forces ``near`` (k, 3); returns the largest residual, inf where
    nothing can be said. Arguments as of :func:`conditions`.

    Where solutions are not single points directions in which nearly nothing changes are held back, by as much as
    serves best (Levenberg 1944, Marquardt 1963).
    """
    n = len(u)
    if n == 0:
        return 0.0
    if not np.abs(u).max() < ENDLESS:
        return np.inf
    rest, jacobian = np.empty(n), np.empty((n, n))
    tried_rest, tried_jacobian, tried_near = np.empty(n), np.empty((n, n)), np.empty_like(near)
    next_rest, next_jacobian, next_near = np.empty(n), np.empty((n, n)), np.empty_like(near)
    step, trial, following = np.empty(n), np.empty(n), np.empty(n)
    normal, lower = np.empty((n, n)), np.empty((n, n))
    best = conditions(which, A, b, kind, mu, ray, gain, slope, u, rest, jacobian, near)
    for _ in range(steps):
        if best <= NOTHING_LEFT or not np.all(np.isfinite(jacobian)):
            break
        before = best
        U, s, V = jacobian, rest, jacobian
        well = False
        for attempt in range(5):
            damping = 0.0 if attempt <= 1 else before ** (0.5 ** (attempt - 2))
            if attempt == 0:
                if not solved(jacobian, -rest, step):
                    continue
            elif attempt == 1 and well_conditioned(jacobian, normal, lower):
                # nothing is to be left out: the step is that of the first attempt
                well = True
                continue
            elif well:
                if not held_back(jacobian, rest, normal, damping * damping, lower, step):
                    continue
            else:
                if attempt == 1:
                    U, s, V = np.linalg.svd(jacobian)
                step[:] = 0.0
                for j in range(n):
                    if attempt > 1 or s[j] > 1e-13 * s[0]:
                        turned = 0.0
                        for i in range(n):
                            turned -= U[i, j] * rest[i]
                        turned *= 1.0 / s[j] if attempt == 1 else s[j] / (s[j] * s[j] + damping * damping)
                        for i in range(n):
                            step[i] += V[j, i] * turned
            trial[:] = u + step
            if not np.abs(trial).max() < ENDLESS:
                continue
            new = conditions(which, A, b, kind, mu, ray, gain, slope, trial, tried_rest, tried_jacobian, tried_near)
            if new < best:
                best = new
                following[:], next_rest[:], next_jacobian[:], next_near[:] = (
                    trial,
                    tried_rest,
                    tried_jacobian,
                    tried_near,
                )
            if best < 0.1 * before:
                break
        if not best < before:
            break
        u[:], rest[:], jacobian[:], near[:] = following, next_rest, next_jacobian, next_near
    return float(np.abs(rest).max())
