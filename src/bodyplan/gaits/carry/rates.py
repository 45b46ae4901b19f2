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

from dataclasses import dataclass, fields, replace

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

    def take(self, index: IntArray) -> Carried:
        """Some of the wheels, (k,)."""
        return Carried(*(getattr(self, f.name)[index] for f in fields(Carried)))


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
    from bodyplan.gaits.carry.rates_kernel import ROLLED, SMOOTH, accelerations, rollings, velocities

    c, count = carried, len(found.phi)
    # what does not touch has no rates
    found = replace(found, radius=np.where(found.outcome == TOUCHES, found.radius, np.nan))
    ways, contacts = np.concatenate([getattr(c, f.name) for f in fields(Carried)], axis=1), _rows(found)
    of_contact, point, third = np.empty((count, SMOOTH)), np.empty((count, 2)), np.zeros((count, 2, 2))
    velocities(ways, contacts, JUMPS, of_contact, point)
    good = np.isfinite(point).all(axis=1)
    third[good] = ground.field_hessian_rate(*found.point[good, :2].T, *point[good].T)
    accelerations(ways, contacts, third, of_contact)
    if found.corner.any():
        edge = np.flatnonzero(found.corner)
        of_contact[edge] = np.stack(_on_edge(ground, found, c, edge), axis=1)
    of_wheel = np.empty((count, ROLLED))
    rollings(ways, contacts, of_contact, of_wheel)
    angle, radius, angle_rate, radius_rate = of_contact.T
    rolling, rolling_rate, slip = of_wheel[:, :3].T
    return Rates(angle, angle_rate, radius, radius_rate, rolling, rolling_rate, slip, of_wheel[:, 3:])


def rolling(found: Contacts, carried: Carried) -> Array:
    """The spin (n,) rad/s that rolls without slip: that of :func:`rates`, which needs nothing of the ground."""
    from bodyplan.gaits.carry.rates_kernel import rolls

    radius, out = np.where(found.outcome == TOUCHES, found.radius, np.nan), np.empty(len(found.phi))
    rolls(carried.velocity, carried.spin, carried.ahead, carried.down, found.phi, radius, out)
    return out


def _rows(found: Contacts) -> Array:
    """Contacts (n, 9) as kernels take them."""
    bends = found.hessian.reshape(-1, 4)[:, [0, 1, 3]]
    ends = [found.phi[:, None], found.radius[:, None], found.normal, bends, found.slack[:, None]]
    return np.concatenate(ends, axis=1)


def _on_edge(ground: Terrain, found: Contacts, c: Carried, edge: IntArray) -> tuple[Array, Array, Array, Array]:
    """phi', R', phi'', R'' of wheels ``edge`` (k,) on edges of the ground, whose points satisfy h = 0, k(x, y) = 0 and
    e . (p - c) = 0."""
    R, e = found.radius[edge], c.axle[edge]
    sine, cosine = np.sin(found.phi[edge])[:, None], np.cos(found.phi[edge])[:, None]
    u, t = sine * c.ahead[edge] + cosine * c.down[edge], cosine * c.ahead[edge] - sine * c.down[edge]
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
