"""Frames along a curve: integrate dT/ds = T [(1, 0, 0; tau, kappa_p, kappa_y)] on SE(3).

Paper *acm* eq. (1), rows e_r, e_p, e_y of the paper being columns of R here:

    e_r' = kappa_y e_p - kappa_p e_y,  e_p' = -kappa_y e_r + tau e_y,  e_y' = kappa_p e_r - tau e_p, c' = e_r.

One step of length h is T <- T exp(Omega) with the Magnus expansion of order 6 from the shape at three Gauss
nodes (Blanes, Casas and Ros, BIT 40 (2000) 434-450), in which brackets change sign here because T stands on
the left. Every step is a rigid displacement: rotations stay orthonormal, and a constant shape (line, arc,
helix) is exact at any step.
"""

# ruff: noqa: E741 - l is the lane, everywhere
from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError, SolveError, Status
from bodyplan.spatial.coefficients import c_coefficient
from bodyplan.spatial.lanes import LANES, inlined, load, sines, strip, table, unload
from bodyplan.spatial.poses import IDENTITY
from bodyplan.spatial.rotations import matrix_from_quaternion

#: places of the shape samples within a step
GAUSS_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_NODES = np.array(GAUSS_NODES)
# the six nodes of two half steps: weights that extrapolate their polynomial to the start, and the gap there
_SIX = np.concatenate([0.5 * _NODES, 0.5 + 0.5 * _NODES])
TO_START = tuple(
    float(np.prod([0.0 - x for x in _SIX if x != xi]) / np.prod([xi - x for x in _SIX if x != xi])) for xi in _SIX
)
OUTER = float(_SIX[0])
Vector = tuple[float, float, float]
FIRST_STEPS = 16
MAX_STEPS = 2_000_000


def curve_frames(
    shape: Callable[[Array], ArrayLike],
    s: ArrayLike,
    start: ArrayLike | None = None,
    *,
    tolerance: float = 1e-10,
) -> tuple[Array, Array]:
    """Points (S, 3) and frames (S, 3, 3), columns e_r, e_p, e_y, of the curve with a given shape.

    ``shape(s)`` -> (S, 3): tau, kappa_p, kappa_y (rad per unit length) at arc lengths ``s`` (S,), vectorised.
    ``s``: not decreasing. ``start``: pose (7,) at ``s[0]``, position and quaternion wxyz; default identity.

    Step rule: every interval of ``s`` is cut into steps no longer than 1/16 of the whole. A step is halved
    until one step and two half steps differ by no more than 8 times its part of ``tolerance``, in position
    plus rotation times (1 + whole length), and the two halves are kept. Their own error is about 1/64 of that
    difference, so every point is within ``tolerance`` (in the unit of s, and rad) with room to spare. A jump
    of the shape is closed in on until it no longer matters.

    Raises InputError for a bad argument or a shape that is not finite, SolveError for too many steps.
    """
    s = finite(s, "s", (None,))
    number(tolerance, "tolerance", at_least=1e-13)
    if len(s) == 0 or np.any(np.diff(s) < 0.0):
        raise InputError("s: needs at least one value, and values that do not decrease.")
    pose = np.array(finite(IDENTITY if start is None else start, "start", (7,)))
    pose[3:] /= _unit_norms(pose[3:])
    length = float(s[-1] - s[0])
    ends, increments = _adaptive(shape, s, length, tolerance)
    poses = np.empty((len(ends) + 1, 7))
    accumulate(pose, increments, poses)
    # a leaf ends exactly at every value of s but the first
    at = np.where(s == s[0], 0, np.searchsorted(ends, s) + 1)
    return poses[at, :3], matrix_from_quaternion(poses[at, 3:])


def frames_from_nodes(shapes: ArrayLike, steps: ArrayLike, start: ArrayLike | None = None) -> Array:
    """Poses (..., M + 1, 7) at the ends of M steps from shapes sampled beforehand: the fast way.

    ``shapes`` (..., M, 3, 3): tau, kappa_p, kappa_y at the three :data:`GAUSS_NODES` of each step (node
    before component). ``steps`` (M,): their lengths, the same for all curves of the batch. ``start`` (7,) or
    (..., 7). No error control: the error of a step is O(h^7) for a smooth shape, none for a constant one.
    """
    u = finite(shapes, "shapes")
    h = finite(steps, "steps", (None,))
    if u.ndim < 3 or u.shape[-3:] != (len(h), 3, 3):
        raise InputError(f"shapes: expected shape (..., {len(h)}, 3, 3), got {u.shape}.")
    lead = u.shape[:-3]
    begin = finite(IDENTITY if start is None else start, "start")
    try:
        begin = np.array(np.broadcast_to(begin, (*lead, 7)))
    except ValueError as error:
        raise InputError(f"start: expected shape (7,) or (..., 7) with batch {lead}, got {begin.shape}.") from error
    begin[..., 3:] /= _unit_norms(begin[..., 3:])
    size = int(np.prod(lead, dtype=np.int64))
    flat = np.require(u.reshape(size * len(h) * 3, 3), requirements=["C", "W"])  # the kernels know one kind of array
    poses = np.empty((size * (len(h) + 1), 7))
    march(flat, np.array(h), begin.reshape(size, 7), poses)
    return poses.reshape(*lead, len(h) + 1, 7)


def _unit_norms(quaternions: Array) -> Array:
    """Lengths (..., 1) of ``start`` quaternions, InputError where they are not 1 to 1e-9."""
    norms = np.asarray(np.linalg.norm(quaternions, axis=-1, keepdims=True))
    if np.any(np.abs(norms - 1.0) > 1e-9):
        raise InputError("start: quaternions (w, x, y, z) must have length 1 to 1e-9.")
    return norms


def _adaptive(shape: Callable[[Array], ArrayLike], s: Array, length: float, tolerance: float) -> tuple[Array, Array]:
    """Ends (N,) of the accepted steps in order, and their displacements (N, 7)."""
    if length == 0.0:
        return np.empty(0), np.empty((0, 7))
    low, high = _first_steps(s, max(length / FIRST_STEPS, np.finfo(np.float64).tiny))
    whole, _, _ = _displacements(shape, low, high, low[:0])
    done: list[tuple[Array, Array]] = []
    steps = len(low)
    while len(low):
        middle = low + 0.5 * (high - low)
        middle = np.where(low < middle, middle, high)
        starts, ends = np.stack([low, middle], 1), np.stack([middle, high], 1)
        # a jump of the shape nearer to an end than the outermost node shows only at the end
        # (the values just within the step: a jump exactly at an end belongs to a neighbour)
        outer = np.concatenate([np.nextafter(low, high), np.nextafter(high, low)])
        halves, u, at_ends = _displacements(shape, starts.ravel(), ends.ravel(), outer)
        error = np.empty(len(low))
        differences(whole, halves, u, at_ends, high - low, 1.0 + length, error)
        # 8: the halves are some 64 times better than the difference. The first floor lets a jump be passed (a
        # hundred of them use up the tolerance), the second is rounding.
        share = np.maximum(8.0 * tolerance * np.maximum((high - low) / length, 1e-3), 2e-15 * (1.0 + length))
        good = (error <= share) | (middle == high)
        both = np.repeat(good, 2)
        done.append((ends[good].ravel(), halves[both]))
        low, high, whole = starts[~good].ravel(), ends[~good].ravel(), halves[~both]
        steps += len(low)
        if steps > MAX_STEPS:
            raise SolveError(Status.NOT_CONVERGED, f"more than {MAX_STEPS} steps along the curve")
    accepted = np.concatenate([end for end, _ in done])
    order = np.argsort(accepted, kind="stable")
    return accepted[order], np.concatenate([increment for _, increment in done])[order]


def _first_steps(s: Array, longest: float) -> tuple[Array, Array]:
    """Starts and ends of steps no longer than ``longest``, with an end at every value of ``s``."""
    a, b = s[:-1][np.diff(s) > 0.0], s[1:][np.diff(s) > 0.0]
    count = np.maximum(1, np.ceil((b - a) / longest - 1e-9)).astype(np.int64)
    last = np.cumsum(count)
    index = np.arange(last[-1]) - np.repeat(last - count, count)
    low = np.repeat(a, count) + index * np.repeat((b - a) / count, count)
    high = np.append(low[1:], b[-1])
    high[last - 1] = b
    return low, high


def _displacements(
    shape: Callable[[Array], ArrayLike], low: Array, high: Array, also: Array
) -> tuple[Array, Array, Array]:
    """Displacements (M, 7) of single steps from ``low`` to ``high`` (M,), the shapes (3 M, 3) at their nodes, and
    those (..., 3) at the places ``also``."""
    h = high - low
    places = np.concatenate([(low[:, None] + h[:, None] * _NODES).ravel(), also])
    values = np.array(finite(shape(places), "shape(s)", (len(places), 3)))
    nodes = 3 * len(h)
    out = np.empty((len(h), 7))
    increments(values, 0, h, out)
    return out, values[:nodes], values[nodes:]


# --- kernels ------------------------------------------------------------------------------------------------


@inlined
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def _magnus(h: float, u1: Vector, u2: Vector, u3: Vector) -> tuple[Vector, Vector]:
    """Omega = (v, w) of one step of length ``h`` from the shapes at its three Gauss nodes.

    a1 = h X2, a2 = sqrt(15)/3 h (X3 - X1), a3 = 10/3 h (X3 - 2 X2 + X1) with the twists X = (e_x; u):
    C1 = -[a1, a2], C2 = [a1, 2 a3 + C1]/60, Omega = a1 + a3/12 - [-20 a1 - a3 + C1, a2 + C2]/240.
    """
    r2, r3 = h * math.sqrt(15.0) / 3.0, h * 10.0 / 3.0
    w1 = (h * u2[0], h * u2[1], h * u2[2])
    w2 = (r2 * (u3[0] - u1[0]), r2 * (u3[1] - u1[1]), r2 * (u3[2] - u1[2]))
    w3 = (
        r3 * (u3[0] - 2.0 * u2[0] + u1[0]),
        r3 * (u3[1] - 2.0 * u2[1] + u1[1]),
        r3 * (u3[2] - 2.0 * u2[2] + u1[2]),
    )
    v1 = (h, 0.0, 0.0)  # v of a2 and a3 is 0
    c, d = _cross(w1, w2), _cross(v1, w2)
    cw, cv = (-c[0], -c[1], -c[2]), (-d[0], -d[1], -d[2])
    # x = 2 a3 + C1, C2 = [a1, x]/60
    xw = (2.0 * w3[0] + cw[0], 2.0 * w3[1] + cw[1], 2.0 * w3[2] + cw[2])
    p, q, r = _cross(w1, xw), _cross(w1, cv), _cross(v1, xw)
    # y = -20 a1 - a3 + C1, z = a2 + C2
    zw = (w2[0] + p[0] / 60.0, w2[1] + p[1] / 60.0, w2[2] + p[2] / 60.0)
    zv = ((q[0] + r[0]) / 60.0, (q[1] + r[1]) / 60.0, (q[2] + r[2]) / 60.0)
    yw = (-20.0 * w1[0] - w3[0] + cw[0], -20.0 * w1[1] - w3[1] + cw[1], -20.0 * w1[2] - w3[2] + cw[2])
    yv = (-20.0 * h + cv[0], cv[1], cv[2])
    p, q, r = _cross(yw, zw), _cross(yw, zv), _cross(yv, zw)
    v = (h - (q[0] + r[0]) / 240.0, -(q[1] + r[1]) / 240.0, -(q[2] + r[2]) / 240.0)
    return v, (
        w1[0] + w3[0] / 12.0 - p[0] / 240.0,
        w1[1] + w3[1] / 12.0 - p[1] / 240.0,
        w1[2] + w3[2] / 12.0 - p[2] / 240.0,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def increments(u: Array, first: int, h: Array, out: Array) -> None:
    """Displacements ``out`` (M, 7) of M single steps: the exponentials of their Omega, in lanes of steps.

    ``h`` (M,) are their lengths; the shapes of step 0 are the rows 3 ``first``... of ``u`` (..., 3), three a step.
    """
    L, M = LANES, h.shape[0]
    # u (9), h, v (3), w (3), |w|/2 with its sine and cosine; then the displacements
    scratch = np.empty(19 * L)
    U, rows = table(scratch, 0, 9, L), table(scratch, 9 * L, 1, 10 * L)
    flat, result = strip(u, 0, u.size), strip(out, 0, 7 * M)
    for m in range(0, M, L):
        lanes = min(L, M - m)
        load(flat, 9 * (first + m), 9, 9, lanes, U, 1)
        for l in range(L):
            rows[0, l] = h[m + min(l, lanes - 1)]
        for l in range(L):
            u1, u2, u3 = (U[0, l], U[1, l], U[2, l]), (U[3, l], U[4, l], U[5, l]), (U[6, l], U[7, l], U[8, l])
            v, w = _magnus(rows[0, l], u1, u2, u3)
            rows[0, L + l], rows[0, 2 * L + l], rows[0, 3 * L + l] = v
            rows[0, 4 * L + l], rows[0, 5 * L + l], rows[0, 6 * L + l] = w
            rows[0, 7 * L + l] = 0.5 * math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
        sines(rows, 0, 7 * L, 8 * L, 9 * L, 1.0, 1)
        for l in range(L):
            v = (rows[0, L + l], rows[0, 2 * L + l], rows[0, 3 * L + l])
            w = (rows[0, 4 * L + l], rows[0, 5 * L + l], rows[0, 6 * L + l])
            half, cosine = rows[0, 7 * L + l], rows[0, 9 * L + l]
            # below 1e-150 squares underflow; there sin(x)/x is 1 to the last digit
            ratio = rows[0, 8 * L + l] / half if half > 1e-150 else 1.0
            b = 0.5 * ratio * ratio
            c = c_coefficient(4.0 * half * half, ratio * cosine)
            # V(w) v = v + B w x v + C w x (w x v)
            once = _cross(w, v)
            twice = _cross(w, once)
            U[0, l] = v[0] + b * once[0] + c * twice[0]
            U[1, l] = v[1] + b * once[1] + c * twice[1]
            U[2, l] = v[2] + b * once[2] + c * twice[2]
            U[3, l] = cosine
            U[4, l], U[5, l], U[6, l] = 0.5 * ratio * w[0], 0.5 * ratio * w[1], 0.5 * ratio * w[2]
        unload(scratch, 0, 7, lanes, result, 7 * m, 7, 1)
    scratch[0] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _compose(a: Array, i: int, b: Array, j: int, out: Array, k: int) -> None:
    """out[k] = a[i] b[j] for poses (7,); one Newton step keeps the quaternion at length 1."""
    w, x, y, z = a[i, 3], a[i, 4], a[i, 5], a[i, 6]
    p = (b[j, 0], b[j, 1], b[j, 2])
    n = (x, y, z)
    t = _cross(n, p)
    t = (2.0 * t[0], 2.0 * t[1], 2.0 * t[2])
    r = _cross(n, t)
    for c in range(3):
        out[k, c] = a[i, c] + p[c] + w * t[c] + r[c]
    e, f, g, h = b[j, 3], b[j, 4], b[j, 5], b[j, 6]
    qw = w * e - x * f - y * g - z * h
    qx = w * f + x * e + y * h - z * g
    qy = w * g - x * h + y * e + z * f
    qz = w * h + x * g - y * f + z * e
    scale = 1.5 - 0.5 * (qw * qw + qx * qx + qy * qy + qz * qz)
    out[k, 3], out[k, 4], out[k, 5], out[k, 6] = scale * qw, scale * qx, scale * qy, scale * qz


@njit(cache=True, nogil=True, error_model="numpy")
def accumulate(start: Array, increment: Array, out: Array) -> None:
    """Poses ``out`` (M + 1, 7) from ``start`` (7,) on through the displacements (M, 7)."""
    out[0] = start
    for m in range(increment.shape[0]):
        _compose(out, m, increment, m, out, m + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def march(u: Array, h: Array, start: Array, out: Array) -> None:
    """Poses ``out`` (B (M + 1), 7) of curves: ``start`` (B, 7), shapes ``u`` (3 B M, 3), steps ``h``."""
    M = h.shape[0]
    steps = np.empty((M, 7))
    for b in range(start.shape[0]):
        k = b * (M + 1)
        out[k] = start[b]
        increments(u, b * M, h, steps)
        for m in range(M):
            _compose(out, k + m, steps, m, out, k + m + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def differences(whole: Array, halves: Array, u: Array, at_ends: Array, h: Array, weight: float, error: Array) -> None:
    """How far step i (M, 7) is from half steps 2 i and 2 i + 1 (2 M, 7): position + ``weight`` x rotation.

    The rotation includes what may hide between the outermost nodes and the ends: there the shape ``at_ends``
    (2 M, 3) should be the polynomial through its values ``u`` (6 M, 3) at the six nodes.
    """
    both = np.empty((1, 7))
    for m in range(whole.shape[0]):
        _compose(halves, 2 * m, halves, 2 * m + 1, both, 0)
        p = q = r = 0.0
        for i in range(3):
            p += (both[0, i] - whole[m, i]) ** 2
        for i in range(3, 7):
            q += (both[0, i] - whole[m, i]) ** 2
            r += (both[0, i] + whole[m, i]) ** 2
        hidden = 0.0
        for i in range(3):
            first, last = at_ends[m, i], at_ends[whole.shape[0] + m, i]
            for n in range(6):
                first -= TO_START[n] * u[6 * m + n, i]
                last -= TO_START[5 - n] * u[6 * m + n, i]
            hidden += abs(first) + abs(last)
        error[m] = math.sqrt(p) + weight * (2.0 * math.sqrt(min(q, r)) + OUTER * h[m] * hidden)
