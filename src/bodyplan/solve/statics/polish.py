"""Newton's method on the conditions of optimality, from the nearly exact result of an interior point method."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array
from bodyplan.solve.statics.cones import Cones

#: steps of Newton's method, at most; and from the solution of a similar problem
STEPS, WARM = 40, 8
#: residual that is rounding
NOTHING_LEFT = 3e-16
#: forces and multipliers beyond this are those of a solver that went astray
ENDLESS = 1e12


class Polished(NamedTuple):
    """``x`` (k, 3) in its cones; ``y`` (r,); ``residual`` of the conditions over the size of the forces."""

    x: Array
    y: Array
    residual: float


class PolishedRatio(NamedTuple):
    """As :class:`Polished`, with the factor ``s`` of the cones; ``residual`` is that of forces over the load."""

    x: Array
    y: Array
    s: float
    residual: float


def polish_norm(A: Array, b: Array, cones: Cones, y: Array, steps: int = STEPS) -> Polished:
    """The x of the smallest norm in its cones with A x = b: the nearest in them to A^T y, for the y with which it meets
    the equations (a concave problem in y, smooth but for kinks of its second derivative)."""
    k, r = len(cones.kind), len(b)
    by_contact = A.reshape(r, k, 3)

    def system(y: Array) -> tuple[Array, Array, Array]:
        near, D, _ = cones.nearest((A.T @ y).reshape(k, 3))
        moved = np.einsum("rki,kij->rkj", by_contact, D).reshape(r, 3 * k)
        return A @ near.ravel() - b, moved @ A.T, near

    y, residual = _newton(system, y, steps)
    near = system(y)[2] if np.isfinite(residual) else np.zeros((k, 3))
    return Polished(near, y, residual / max(1.0, float(np.abs(near).max(initial=0.0))))


def polish_gain(A: Array, b: Array, cones: Cones, gain: Array, x: Array, y: Array) -> Polished:
    """The x in its cones with A x = b and the largest gain . x: the nearest in them to x + gain + A^T y with some y."""
    k, r = len(cones.kind), len(b)
    size = 3 * k

    def system(u: Array) -> tuple[Array, Array, Array]:
        near, D, _ = cones.nearest((u[:size] + gain.ravel() + A.T @ u[size:]).reshape(k, 3))
        full = _blocks(D)
        jacobian = np.zeros((size + r, size + r))
        jacobian[:size, :size] = np.eye(size) - full
        jacobian[:size, size:] = -full @ A.T
        jacobian[size:, :size] = A
        return np.concatenate([u[:size] - near.ravel(), A @ u[:size] - b]), jacobian, near

    u, residual = _newton(system, np.concatenate([x.ravel(), y]), STEPS)
    near = system(u)[2] if np.isfinite(residual) else x
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    return Polished(near, u[size:], max(residual, missed) / max(1.0, float(np.abs(near).max(initial=0.0))))


def polish_ratio(
    A: Array,
    b: Array,
    cones: Callable[[float], tuple[Cones, Array]],
    x: Array,
    y: Array,
    s: float,
    steps: int = STEPS,
) -> PolishedRatio:
    """The least factor s of cones, ``cones(s)`` with d mu/ds (k,), with A x = b: x is then the nearest in its cones to
    x + A^T y with a y of length 1, which proves that less is not enough."""
    k, r = len(x), len(b)
    size = 3 * k

    def system(u: Array) -> tuple[Array, Array, Array]:
        now, rate = cones(max(float(u[-1]), 0.0))
        z = u[:size] + A.T @ u[size:-1]
        near, D, by_mu = now.nearest(z.reshape(k, 3))
        full = _blocks(D)
        jacobian = np.zeros((size + r + 1, size + r + 1))
        jacobian[:size, :size] = np.eye(size) - full
        jacobian[:size, size:-1] = -full @ A.T
        jacobian[:size, -1] = -(by_mu * rate[:, None]).ravel()
        jacobian[size:-1, :size] = A
        jacobian[-1, size:-1] = u[size:-1]
        y = u[size:-1]
        rest = [u[:size] - near.ravel(), A @ u[:size] - b, np.array([0.5 * (y @ y - 1.0)])]
        return np.concatenate(rest), jacobian, near

    length = float(np.linalg.norm(y))
    u, residual = _newton(system, np.concatenate([x.ravel(), y / (length if length > 0.0 else 1.0), [s]]), steps)
    near = system(u)[2] if np.isfinite(residual) else x
    missed = float(np.abs(A @ near.ravel() - b).max(initial=0.0))
    return PolishedRatio(near, u[size:-1], float(u[-1]), max(residual, missed))


def _newton(system: Callable[[Array], tuple[Array, Array, Array]], u: Array, steps: int) -> tuple[Array, float]:
    """(u, largest residual): the best that Newton's method gets to. Where solutions are not single points directions
    in which nearly nothing changes are held back, by as much as serves best (Levenberg 1944, Marquardt 1963)."""
    if not np.abs(u).max(initial=0.0) < ENDLESS:
        return u, np.inf
    rest, jacobian, _ = system(u)
    best = float(np.linalg.norm(rest))
    for _ in range(steps):
        if best <= NOTHING_LEFT or not np.all(np.isfinite(jacobian)):
            break
        before = best
        for after in _steps(jacobian, rest, best):
            if not np.abs(u + after).max(initial=0.0) < ENDLESS:
                continue
            tried = system(u + after)
            new = float(np.linalg.norm(tried[0]))
            if new < best:
                step, found, best = after, tried, new
            if best < 0.1 * before:
                break
        if not best < before:
            break
        u, rest, jacobian = u + step, found[0], found[1]
    return u, float(np.abs(rest).max(initial=0.0))


def _steps(jacobian: Array, rest: Array, size: float) -> Iterator[Array]:
    """Newton's step, and others that are damped more and more."""
    with contextlib.suppress(np.linalg.LinAlgError):
        yield np.asarray(np.linalg.solve(jacobian, -rest), dtype=np.float64)
    U, s, V = np.linalg.svd(jacobian)
    turned = U.T @ -rest
    yield V.T @ (turned / np.where(s > 1e-13 * s[0], s, np.inf))
    for damping in (size, size**0.5, size**0.25):
        yield V.T @ (turned * s / (s**2 + damping**2))


def _blocks(D: Array) -> Array:
    """(3k, 3k) with the blocks D (k, 3, 3) on its diagonal."""
    k = len(D)
    out = np.zeros((k, 3, k, 3))
    out[np.arange(k), :, np.arange(k), :] = D
    return out.reshape(3 * k, 3 * k)
