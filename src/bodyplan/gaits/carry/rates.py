"""Rates and accelerations of wheels while the body moves: exact, from the two equations of the contact.

A wheel's centre c moves with c', the body turns with omega. With u, t the directions of contact and rolling, e the
axle, H the ground's Hessian and N = (-f_x, -f_y, 1), the equations h = 0 and N . t = 0 hold at all times
(:mod:`newton`), so that

    R'   = -N . (c' + omega x R u) / (N . u),
    phi' = (N . (omega x t) - t' H a) / (N . u + R t' H t),        a = c' + omega x R u + R' u,

and once more by time. The point p moves with p' = a + R phi' t. The rim's material there moves with a - Omega R t,
Omega the spin about the axle: rolling without slip along t takes Omega = (a . t) / R, whatever is left along n x t is
sideways slip. Where a wheel stands on an edge of the ground, p is where the edge goes through the wheel's plane.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.carry.contact import TOUCHES, Contacts
from bodyplan.gaits.carry.terrain import Terrain

#: slack 1 - kappa R below which the contact angle has no rate: the contact jumps
JUMPS = 1e-7


@dataclass(frozen=True)
class Carried:
    """How n wheels are carried: ``centre`` (n, 3) m, its velocity and acceleration in the world; angular velocity
    ``spin`` and acceleration ``gain`` (n, 3) of the body in the world; unit vectors ``ahead``, ``down``, ``axle`` (n,
    3)."""

    centre: Array
    velocity: Array
    acceleration: Array
    spin: Array
    gain: Array
    ahead: Array
    down: Array
    axle: Array


@dataclass(frozen=True)
class Rates:
    """Of n wheels: contact angle and radius by time, once and twice (rad/s, m/s; per s); ``rolling`` (n,) rad/s, the
    spin that rolls without slip, and its rate; ``slip`` (n,) m/s sideways, positive to the left; ``point`` (n, 3) m/s,
    the velocity of the contact point. nan where the contact jumps."""

    angle: Array
    angle_rate: Array
    radius: Array
    radius_rate: Array
    rolling: Array
    rolling_rate: Array
    slip: Array
    point: Array


def rates(ground: Terrain, found: Contacts, carried: Carried) -> Rates:
    """Rates of contacts that were found at the places of ``carried``."""
    c = carried
    # what does not touch has no rates
    found = replace(found, radius=np.where(found.outcome == TOUCHES, found.radius, np.nan))
    R = found.radius
    sine, cosine = np.sin(found.phi)[:, None], np.cos(found.phi)[:, None]
    u, t = sine * c.ahead + cosine * c.down, cosine * c.ahead - sine * c.down
    smooth = _on_smooth(ground, found, c, u, t)
    if found.corner.any():
        edge = np.flatnonzero(found.corner)
        for mine, other in zip(smooth, _on_edge(ground, found, c, u, t, edge), strict=True):
            mine[edge] = other
    angle, radius, angle_rate, radius_rate = smooth
    # along the wheel's way: the material of a wheel that does not spin
    u_dot = np.cross(c.spin, u) + angle[:, None] * t
    t_dot = np.cross(c.spin, t) - angle[:, None] * u
    arm = R[:, None] * u
    plain = c.velocity + np.cross(c.spin, arm)
    plain_dot = c.acceleration + np.cross(c.gain, arm) + np.cross(c.spin, radius[:, None] * u + R[:, None] * u_dot)
    rolling = np.sum(plain * t, axis=1) / R
    rolling_rate = (np.sum(plain_dot * t + plain * t_dot, axis=1) - rolling * radius) / R
    left = np.cross(found.normal, t)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    slip = np.sum((plain + radius[:, None] * u) * left, axis=1)
    point = plain + radius[:, None] * u + (R * angle)[:, None] * t
    return Rates(angle, angle_rate, radius, radius_rate, rolling, rolling_rate, slip, point)


def _on_smooth(ground: Terrain, found: Contacts, c: Carried, u: Array, t: Array) -> tuple[Array, Array, Array, Array]:
    """phi', R', phi'', R'' where the ground has a tangent."""
    R, H = found.radius, found.hessian
    # any multiple of N serves; this one has z = 1, where the ground is not upright
    upright = np.where(found.corner | (found.normal[:, 2] <= 0.0), 1.0, found.normal[:, 2])
    N = found.normal / upright[:, None]
    with np.errstate(all="ignore"):
        Nu = np.sum(N * u, axis=1)
        along = _times(H, t)  # H t, with z = 0
        bend = np.sum(along * t, axis=1)
        stiff = np.where(found.slack > JUMPS, Nu + R * bend, np.nan)
        w, g = c.spin, c.gain
        plain = c.velocity + np.cross(w, R[:, None] * u)
        radius = -np.sum(N * plain, axis=1) / Nu
        a = plain + radius[:, None] * u
        angle = (np.sum(N * np.cross(w, t), axis=1) - np.sum(along * a, axis=1)) / stiff
        p = a + (R * angle)[:, None] * t
        N_dot = -_times(H, p)
        u_dot, t_dot = np.cross(w, u) + angle[:, None] * t, np.cross(w, t) - angle[:, None] * u
        # p'' but for R'' u and R phi'' t
        rest = (
            c.acceleration
            + 2.0 * radius[:, None] * u_dot
            + R[:, None] * (np.cross(g, u) + np.cross(w, u_dot) + angle[:, None] * t_dot)
        )
        radius_rate = -(np.sum(N_dot * p, axis=1) + np.sum(N * rest, axis=1)) / Nu
        b = rest + radius_rate[:, None] * u
        third = np.zeros_like(H)
        good = np.isfinite(p).all(axis=1)
        third[good] = ground.field_hessian_rate(*found.point[good, :2].T, *p[good, :2].T)
        turning = np.cross(g, t) + np.cross(w, t_dot) - angle[:, None] * u_dot
        angle_rate = (
            np.sum(N * turning, axis=1)
            + 2.0 * np.sum(N_dot * t_dot, axis=1)
            - np.sum(_times(third, p) * t, axis=1)
            - np.sum(along * b, axis=1)
        ) / stiff
    return angle, radius, angle_rate, radius_rate


def _on_edge(
    ground: Terrain, found: Contacts, c: Carried, u: Array, t: Array, edge: IntArray
) -> tuple[Array, Array, Array, Array]:
    """phi', R', phi'', R'' of wheels ``edge`` (k,) on edges of the ground, whose points satisfy h = 0, k(x, y) = 0 and
    e . (p - c) = 0."""
    R, u, t, e = found.radius[edge], u[edge], t[edge], c.axle[edge]
    v, v_dot, w, g = c.velocity[edge], c.acceleration[edge], c.spin[edge], c.gain[edge]
    x, y = found.point[edge, 0], found.point[edge, 1]
    with np.errstate(all="ignore"):
        f_g, f_h = ground.field_jet(x, y)[1:]
        k_g, k_h = _nearest_crease(ground, x, y)
        zero, one = np.zeros(len(edge)), np.ones(len(edge))
        system = np.stack(
            [np.stack([-f_g[:, 0], -f_g[:, 1], one], axis=1), np.stack([k_g[:, 0], k_g[:, 1], zero], axis=1), e], axis=1
        )
        arm = R[:, None] * u
        e_dot = np.cross(w, e)
        e_gain = np.cross(g, e) + np.cross(w, e_dot)
        good = (
            np.abs(np.linalg.det(np.nan_to_num(system))) > 1e-12
        )  # an edge along the wheel's plane has no point in it
        p = _solved(system, np.stack([zero, zero, np.sum(e * v - e_dot * arm, axis=1)], axis=1), good)
        moving = p - v
        right = np.stack(
            [
                np.einsum("ni,nij,nj->n", p[:, :2], f_h, p[:, :2]),
                -np.einsum("ni,nij,nj->n", p[:, :2], k_h, p[:, :2]),
                np.sum(e * v_dot - 2.0 * e_dot * moving - e_gain * arm, axis=1),
            ],
            axis=1,
        )
        gaining = _solved(system, right, good) - v_dot
        about = np.sum(w * e, axis=1)
        radius = np.sum(u * moving, axis=1)
        turn = np.sum(t * moving, axis=1) / R
        angle = turn + about
        u_dot, t_dot = np.cross(w, u) + angle[:, None] * t, np.cross(w, t) - angle[:, None] * u
        radius_rate = np.sum(u_dot * moving + u * gaining, axis=1)
        angle_rate = (np.sum(t_dot * moving + t * gaining, axis=1) - radius * turn) / R + np.sum(g * e, axis=1)
    return angle, radius, angle_rate, radius_rate


def _nearest_crease(ground: Terrain, x: Array, y: Array) -> tuple[Array, Array]:
    """Gradient (k, 2) and Hessian (k, 2, 2) of the crease function whose zero is nearest to x, y (k,)."""
    best, gradient, hessian = np.full(len(x), np.inf), np.full((len(x), 2), np.nan), np.full((len(x), 2, 2), np.nan)
    for crease in ground.field_creases():
        s, gs, hs = crease(x, y)
        away = np.abs(s) / np.linalg.norm(gs, axis=1)
        nearer = away < best
        best[nearer], gradient[nearer], hessian[nearer] = away[nearer], gs[nearer], hs[nearer]
    return gradient, hessian


def _solved(system: Array, right: Array, good: Array) -> Array:
    """Solutions (k, 3) of 3x3 systems, nan where they are not ``good``."""
    out = np.full(right.shape, np.nan)
    if good.any():
        out[good] = np.linalg.solve(system[good], right[good][..., None])[..., 0]
    return out


def _times(H: Array, v: Array) -> Array:
    """(H v_xy, 0), (n, 3)."""
    out = np.zeros_like(v)
    out[:, :2] = np.einsum("nij,nj->ni", H, v[:, :2])
    return out
