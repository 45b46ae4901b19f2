"""The kernels of :mod:`bodyplan.gaits.carry.rates`: its equations wheel by wheel, on vectors of three numbers.

A wheel's carriage is a row (24,): centre, velocity, acceleration, spin, gain, ahead, down, axle, three numbers each.
Its contact is a row: contact angle, radius, normal, second derivatives xx, xy, yy of the ground, slack 1 - kappa R.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array

#: columns of a carriage, of a contact, and of what moves
VELOCITY, ACCELERATION, SPIN, GAIN, AHEAD, DOWN, CARRIED = 3, 6, 9, 12, 15, 18, 24
PHI, RADIUS, NORMAL, XX, XY, YY, SLACK, FOUND = 0, 1, 2, 5, 6, 7, 8, 9
ANGLE_1, RADIUS_1, ANGLE_2, RADIUS_2, SMOOTH = range(5)
ROLLING, ROLLING_1, SLIP, POINT, ROLLED = 0, 1, 2, 3, 6

Vector = tuple[float, float, float]


@njit(cache=True, nogil=True, error_model="numpy")
def velocities(carried: Array, found: Array, jumps: float, out: Array, point: Array) -> None:
    """First rates of n contacts into ``out`` (n, SMOOTH), those of their points along x and y into ``point`` (n, 2);
    nan where the slack is at most ``jumps``."""
    for k in range(len(carried)):
        c, at = carried[k], found[k]
        R, spin = at[RADIUS], _at(c, SPIN)
        u, t, N, along = _frame(c, at)
        upward = _dot(N, u)
        plain = _plus(_at(c, VELOCITY), 1.0, _cross(spin, _times(R, u)))
        radius = -_dot(N, plain) / upward
        a = _plus(plain, radius, u)
        stiff = upward + R * _dot(along, t)
        angle = (_dot(N, _cross(spin, t)) - _dot(along, a)) / stiff
        if not at[SLACK] > jumps:
            angle = np.nan
        out[k, ANGLE_1], out[k, RADIUS_1] = angle, radius
        p = _plus(a, R * angle, t)
        point[k, 0], point[k, 1] = p[0], p[1]


@njit(cache=True, nogil=True, error_model="numpy")
def accelerations(carried: Array, found: Array, third: Array, out: Array) -> None:
    """Second rates of n contacts beside the first ones in ``out`` (n, SMOOTH); ``third`` (n, 2, 2): the rate of the
    ground's Hessian along their points' ways."""
    for k in range(len(carried)):
        c, at = carried[k], found[k]
        R, spin, gain = at[RADIUS], _at(c, SPIN), _at(c, GAIN)
        angle, radius = out[k, ANGLE_1], out[k, RADIUS_1]
        u, t, N, along = _frame(c, at)
        plain = _plus(_at(c, VELOCITY), 1.0, _cross(spin, _times(R, u)))
        p = _plus(_plus(plain, radius, u), R * angle, t)
        upward = _dot(N, u)
        stiff = upward + R * _dot(along, t)
        N_dot = _times(-1.0, _bent(at[XX], at[XY], at[YY], p))
        u_dot, t_dot = _plus(_cross(spin, u), angle, t), _plus(_cross(spin, t), -angle, u)
        # p'' but for R'' u and R phi'' t
        turned = _plus(_plus(_cross(gain, u), 1.0, _cross(spin, u_dot)), angle, t_dot)
        rest = _plus(_plus(_at(c, ACCELERATION), 2.0 * radius, u_dot), R, turned)
        radius_rate = -(_dot(N_dot, p) + _dot(N, rest)) / upward
        b = _plus(rest, radius_rate, u)
        turning = _plus(_plus(_cross(gain, t), 1.0, _cross(spin, t_dot)), -angle, u_dot)
        bend = _bent(third[k, 0, 0], third[k, 0, 1], third[k, 1, 1], p)
        out[k, ANGLE_2] = (_dot(N, turning) + 2.0 * _dot(N_dot, t_dot) - _dot(bend, t) - _dot(along, b)) / stiff
        out[k, RADIUS_2] = radius_rate


@njit(cache=True, nogil=True, error_model="numpy")
def rollings(carried: Array, found: Array, rates: Array, out: Array) -> None:
    """Of n wheels with the ``rates`` (n, SMOOTH) of their contacts: spin that rolls without slip and its rate, slip,
    and the velocity of the contact point into ``out`` (n, ROLLED)."""
    for k in range(len(carried)):
        c, at = carried[k], found[k]
        R, spin = at[RADIUS], _at(c, SPIN)
        angle, radius = rates[k, ANGLE_1], rates[k, RADIUS_1]
        u, t, _, _ = _frame(c, at)
        # along the wheel's way: the material of a wheel that does not spin
        u_dot, t_dot = _plus(_cross(spin, u), angle, t), _plus(_cross(spin, t), -angle, u)
        arm = _times(R, u)
        plain = _plus(_at(c, VELOCITY), 1.0, _cross(spin, arm))
        gaining = _plus(_at(c, ACCELERATION), 1.0, _cross(_at(c, GAIN), arm))
        gaining = _plus(gaining, 1.0, _cross(spin, _plus(_times(radius, u), R, u_dot)))
        rolling = _dot(plain, t) / R
        left = _cross(_at(at, NORMAL), t)
        moving = _plus(plain, radius, u)
        point = _plus(moving, R * angle, t)
        out[k, ROLLING] = rolling
        out[k, ROLLING_1] = (_dot(gaining, t) + _dot(plain, t_dot) - rolling * radius) / R
        out[k, SLIP] = _dot(moving, left) / math.sqrt(_dot(left, left))
        out[k, POINT], out[k, POINT + 1], out[k, POINT + 2] = point


@njit(cache=True, nogil=True, error_model="numpy")
def rolls(velocity: Array, spin: Array, ahead: Array, down: Array, phi: Array, radius: Array, out: Array) -> None:
    """The spins of :func:`rollings` alone, from columns (n, 3) of their carriages, into ``out`` (n,)."""
    for k in range(len(phi)):
        sine, cosine = math.sin(phi[k]), math.cos(phi[k])
        a, d = _at(ahead[k], 0), _at(down[k], 0)
        u, t = _plus(_times(sine, a), cosine, d), _plus(_times(cosine, a), -sine, d)
        plain = _plus(_at(velocity[k], 0), 1.0, _cross(_at(spin[k], 0), _times(radius[k], u)))
        out[k] = _dot(plain, t) / radius[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _frame(c: Array, at: Array) -> tuple[Vector, Vector, Vector, Vector]:
    """u, t, N with z = 1 where the ground is not upright, and H t."""
    sine, cosine = math.sin(at[PHI]), math.cos(at[PHI])
    ahead, down = _at(c, AHEAD), _at(c, DOWN)
    u, t = _plus(_times(sine, ahead), cosine, down), _plus(_times(cosine, ahead), -sine, down)
    n = _at(at, NORMAL)
    # any multiple of N serves
    upright = n[2] if n[2] > 0.0 else 1.0
    return u, t, (n[0] / upright, n[1] / upright, n[2] / upright), _bent(at[XX], at[XY], at[YY], t)


@njit(cache=True, nogil=True, error_model="numpy")
def _at(row: Array, column: int) -> Vector:
    return row[column], row[column + 1], row[column + 2]


@njit(cache=True, nogil=True, error_model="numpy")
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _times(share: float, a: Vector) -> Vector:
    return share * a[0], share * a[1], share * a[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _plus(a: Vector, share: float, b: Vector) -> Vector:
    """a + share b."""
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _bent(xx: float, xy: float, yy: float, v: Vector) -> Vector:
    """(H v_xy, 0)."""
    return xx * v[0] + xy * v[1], xy * v[0] + yy * v[1], 0.0
