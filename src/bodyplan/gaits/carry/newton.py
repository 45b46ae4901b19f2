"""Batched damped Newton for the contact of a wheel: two equations in its contact angle and its radius.

With u = sin(chi) ahead - cos(chi) up and t = du/dchi (:mod:`planes`), the point p = c + R u touches the ground where

    h = p_z - f(p_x, p_y) = 0          (paper *wheels*, eq. (12)),
    T = N . t = 0,  N = (-f_x, -f_y, 1)  (eqs. (3), (14), with the normal of the corrections).

Each wheel is a system of its own. Its derivatives are

    dh/dchi = R N.t,   dh/dR = N.u,   dT/dchi = -N.u - R t'Ht,   dT/dR = -u'Ht,   H = Hess f,

with the determinant (N.u)^2 (1 - kappa R) at a solution, kappa = -t'Ht/(N.u) the curvature of the ground's section.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.kernels import lean

MOST_STEPS = 80
#: m, as a share of how far from the origin: steps below it are rounding
ROUNDING = 1e-14
#: largest turn of one step, rad, and largest share of the radius
TURN, SHARE = 0.6, 0.5
#: columns of the state: chi, R of the trial; of the best so far; the step from there; its merit; halvings
CHI, RADIUS, BEST_CHI, BEST_RADIUS, STEP_CHI, STEP_RADIUS, MERIT, HALVINGS = range(8)
#: what a trial says
GOES_ON, SETTLED, GIVES_UP = range(3)


def solve(ground: Terrain, planes: Planes, chi: Array, radius: Array) -> tuple[Array, Array, BoolArray]:
    """(chi (n,) rad, R (n,) m, settled (n,)): solutions near the guesses ``chi`` and ``radius`` (n,) > 0; R stays
    positive, so that no mirror image of a wheel is found."""
    count = len(planes)
    state = np.zeros((count, 8))
    state[:, CHI], state[:, RADIUS] = chi, radius
    state[:, BEST_CHI], state[:, BEST_RADIUS], state[:, MERIT] = chi, radius, np.inf
    settled = np.zeros(count, dtype=np.bool_)
    active = np.arange(count)
    points = np.empty((count, 2))
    with np.errstate(all="ignore"):
        for _ in range(MOST_STEPS):
            if not len(active):
                break
            places = points[: len(active)]
            trial_points(active, planes.centre, planes.ahead, planes.up, state, places)
            f, g, hessian = ground.field_jet(places[:, 0], places[:, 1])
            left = advance(
                active, planes.centre, planes.ahead, planes.up, f, np.ascontiguousarray(g), hessian, state, settled
            )
            active = active[:left]
    return state[:, BEST_CHI].copy(), state[:, BEST_RADIUS].copy(), settled


@njit(cache=True, nogil=True)
def trial_points(active: IntArray, centre: Array, ahead: Array, up: Array, state: Array, out: Array) -> None:
    """x, y of the trial points of the ``active`` wheels, into ``out``."""
    for i, k in enumerate(active):
        s = state[k, RADIUS] * math.sin(state[k, CHI])
        w = -state[k, RADIUS] * math.cos(state[k, CHI])
        out[i, 0] = centre[k, 0] + s * ahead[k, 0] + w * up[k, 0]
        out[i, 1] = centre[k, 1] + s * ahead[k, 1] + w * up[k, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def advance(
    active: IntArray,
    centre: Array,
    ahead: Array,
    up: Array,
    f: Array,
    g: Array,
    hessian: Array,
    state: Array,
    settled: BoolArray,
) -> int:
    """One trial of every active wheel judged, and the next one laid out; those that go on are moved to the front of
    ``active``, their number is returned."""
    left = 0
    plane, at = np.empty(9), np.empty(6)
    for i in range(len(active)):
        k = active[i]
        for j in range(3):
            plane[j], plane[3 + j], plane[6 + j] = centre[k, j], ahead[k, j], up[k, j]
        at[0], at[1], at[2] = f[i], g[i, 0], g[i, 1]
        at[3], at[4], at[5] = hessian[i, 0, 0], hessian[i, 0, 1], hessian[i, 1, 1]
        outcome = tried(state[k], plane, at)
        if outcome == GOES_ON:
            active[left] = k
            left += 1
        else:
            settled[k] = outcome == SETTLED
    return left


@lean
def tried(x: Array, plane: Array, at: Array) -> int:
    """The trial of one wheel's state ``x`` (8,) judged by the ground's jet ``at`` (6+,) there, and the next one laid
    out; ``plane`` (9,): centre, ahead, up."""
    sine, cosine, radius = math.sin(x[CHI]), math.cos(x[CHI]), x[RADIUS]
    ge = at[1] * plane[3] + at[2] * plane[4]
    nv = plane[8] - at[1] * plane[6] - at[2] * plane[7]
    h = plane[2] - radius * cosine * plane[8] - at[0]
    tangent = -ge * cosine + nv * sine
    merit = h * h + (radius * tangent) ** 2
    tiny = ROUNDING * (1.0 + abs(plane[0]) + abs(plane[1]) + abs(plane[2]))
    if merit < x[MERIT]:
        x[BEST_CHI], x[BEST_RADIUS], x[MERIT], x[HALVINGS] = x[CHI], x[RADIUS], merit, 0.0
        hee, hev, hvv = _plane_hessian(at, plane)
        bend = cosine * cosine * hee + 2.0 * sine * cosine * hev + sine * sine * hvv
        mixed = sine * cosine * (hee - hvv) + (sine * sine - cosine * cosine) * hev
        a, b = radius * tangent, -ge * sine - nv * cosine
        c, d = -b - radius * bend, -mixed
        determinant = a * d - b * c
        step_chi = -(d * h - b * tangent) / determinant
        step_radius = -(a * tangent - c * h) / determinant
        if not (math.isfinite(step_chi) and math.isfinite(step_radius)):
            # no direction here: straight on to the ground
            step_chi, step_radius = 0.0, -h / b if b != 0.0 else -0.5 * radius
        cut = min(1.0, TURN / max(abs(step_chi), 1e-300), SHARE * radius / max(abs(step_radius), 1e-300))
        x[STEP_CHI], x[STEP_RADIUS] = cut * step_chi, cut * step_radius
        if abs(x[STEP_CHI]) * radius + abs(x[STEP_RADIUS]) <= tiny:
            return SETTLED
    else:
        x[HALVINGS] += 1.0
        x[STEP_CHI] *= 0.5
        x[STEP_RADIUS] *= 0.5
        # the best is as good as rounding allows where even a tiny step does not improve it
        if abs(x[STEP_CHI]) * radius + abs(x[STEP_RADIUS]) <= tiny or x[HALVINGS] > 60.0:
            return SETTLED if x[MERIT] <= 100.0 * tiny * tiny else GIVES_UP
    x[CHI], x[RADIUS] = x[BEST_CHI] + x[STEP_CHI], x[BEST_RADIUS] + x[STEP_RADIUS]
    return GOES_ON


@lean
def _plane_hessian(at: Array, plane: Array) -> tuple[float, float, float]:
    """ahead' H ahead, ahead' H up, up' H up, of the jet ``at``."""
    ex, ey, vx, vy = plane[3], plane[4], plane[6], plane[7]
    xx, xy, yy = at[3], at[4], at[5]
    hx, hy = xx * ex + xy * ey, xy * ex + yy * ey
    return hx * ex + hy * ey, hx * vx + hy * vy, vx * (xx * vx + xy * vy) + vy * (xy * vx + yy * vy)
