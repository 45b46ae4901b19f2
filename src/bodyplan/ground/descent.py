"""Local minima of the distance from points P = (x, y, z) to a ground z = f(u, v).

Half the squared distance, phi = D^2 / 2, has with e = f - z

    gradient  (u - x, v - y) + e grad f
    Hessian   I + grad f grad f' + e Hess f.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bodyplan.arrays import Array, BoolArray

#: (x, y) (n,) -> value (n,), gradient (n, 2) and Hessian (n, 2, 2); value nan where it is undefined
JetFunction = Callable[[Array, Array], tuple[Array, Array, Array]]


def distance(ground: JetFunction, points: Array, uv: Array) -> Array:
    """D (n,) from points (n, 3) to the ground at uv (n, 2)."""
    return np.asarray(np.sqrt(2.0 * half_square(points, uv, ground(uv[:, 0], uv[:, 1])[0])))


def half_square(points: Array, uv: Array, f: Array) -> Array:
    """phi (n,) for the ground height f (n,) at uv (n, 2)."""
    return np.asarray(0.5 * (np.sum((uv - points[:, :2]) ** 2, axis=1) + (f - points[:, 2]) ** 2))


def derivatives(points: Array, uv: Array, f: Array, g: Array, h: Array) -> tuple[Array, Array, Array]:
    """Gradient of phi (n, 2), and the two parts of its Hessian (n, 2, 2): I + grad f grad f' and e Hess f."""
    e = f - points[:, 2]
    slope = uv - points[:, :2] + e[:, None] * g
    return slope, np.eye(2) + g[:, :, None] * g[:, None, :], e[:, None, None] * h


def descend(ground: JetFunction, points: Array, start: Array, low: Array, high: Array) -> tuple[Array, BoolArray]:
    """A local minimum of phi in the box from ``low`` to ``high`` (n, 2), and whether it settled, (n,).

    Newton steps that lower phi, clipped to the box.
    """
    uv, settled = np.array(start), np.ones(len(start), dtype=np.bool_)
    active = np.arange(len(uv))
    rounding = 1e-14 * np.abs(points).max(axis=1, initial=0.0)
    for _ in range(60):
        if not len(active):
            break
        p, here, a, b = points[active], uv[active], low[active], high[active]
        f, g, h = ground(here[:, 0], here[:, 1])
        phi = half_square(p, here, f)
        slope, metric, bend = derivatives(p, here, f, g, h)
        full = metric + bend
        # where phi is not convex, the convex part of its Hessian gives a direction of descent
        convex = (full[:, 0, 0] > 0.0) & (full[:, 0, 0] * full[:, 1, 1] > full[:, 0, 1] ** 2)
        step = _free_step(np.where(convex[:, None, None], full, metric), slope, here, a, b)
        moved, stuck = _backtrack(ground, p, here, step, slope, phi, a, b)
        uv[active] = moved
        length = np.abs(step).max(axis=1)
        done = stuck | (length <= np.maximum(1e-9 * np.sqrt(2.0 * phi), rounding[active]))
        active = active[~done]
    settled[active] = False
    return uv, settled


def _free_step(hessian: Array, slope: Array, here: Array, low: Array, high: Array) -> Array:
    """-hessian^-1 slope in the coordinates that are not held at an end of their range."""
    held = ((here <= low) & (slope > 0.0)) | ((here >= high) & (slope < 0.0))
    h = np.where(held[:, :, None] | held[:, None, :], np.eye(2), hessian)
    r = np.where(held, 0.0, slope)
    determinant = h[:, 0, 0] * h[:, 1, 1] - h[:, 0, 1] * h[:, 1, 0]
    turned = np.stack(
        [h[:, 0, 1] * r[:, 1] - h[:, 1, 1] * r[:, 0], h[:, 1, 0] * r[:, 0] - h[:, 0, 0] * r[:, 1]], axis=1
    )
    step = turned / determinant[:, None]
    return np.where(np.isfinite(step).all(axis=1, keepdims=True), step, 0.0)


def _backtrack(
    ground: JetFunction, p: Array, here: Array, step: Array, slope: Array, phi: Array, low: Array, high: Array
) -> tuple[Array, BoolArray]:
    """The first of here + step / 2^k, clipped to the box, that lowers phi enough; and where there is none."""
    out = here.copy()
    todo = np.arange(len(here))
    noise = 2e-15 * (phi + np.sqrt(phi) * np.abs(p).max(axis=1, initial=0.0))
    for k in range(30):
        trial = np.clip(here[todo] + 0.5**k * step[todo], low[todo], high[todo])
        f = ground(trial[:, 0], trial[:, 1])[0]
        # near the minimum phi changes by less than its rounding, and the full step is right
        wanted = 1e-4 * np.sum(slope[todo] * (trial - here[todo]), axis=1) + noise[todo]
        good = (half_square(p[todo], trial, f) <= phi[todo] + wanted) | np.all(trial == here[todo], axis=1)
        out[todo[good]] = trial[good]
        todo = todo[~good]
        if not len(todo):
            break
    stuck = np.zeros(len(here), dtype=np.bool_)
    stuck[todo] = True
    return out, stuck | np.all(out == here, axis=1)


def descend_crease(ground: JetFunction, crease: JetFunction, p: Array, start: Array, box: Array) -> Array:
    """A stationary point of D on the line s(u, v) = 0 along which the ground has a crease, (n, 2).

    Newton across and along the line: with t its direction, -s grad s/|grad s|^2 across and
    -(grad phi . t) / (t' (Hess phi + l Hess s) t) along, where l = -grad phi . grad s/|grad s|^2. It does
    not matter which side's derivatives f has: the sides differ by a multiple of s. May fail; the caller
    compares distances.
    """
    uv = start.copy()
    for _ in range(30):
        slope, metric, bend = derivatives(p, uv, *ground(uv[:, 0], uv[:, 1]))
        s, gs, hs = crease(uv[:, 0], uv[:, 1])
        size = np.sum(gs * gs, axis=1)
        t = np.stack([-gs[:, 1], gs[:, 0]], axis=1) / np.sqrt(size)[:, None]
        pull = -np.sum(slope * gs, axis=1) / size
        stiffness = np.einsum("ni,nij,nj->n", t, metric + bend + pull[:, None, None] * hs, t)
        along = -np.sum(slope * t, axis=1) / np.abs(stiffness)
        step = -(s / size)[:, None] * gs + along[:, None] * t
        uv = np.clip(np.where(np.isfinite(step), uv + step, uv), *box)
    return uv
