"""Chains of revolute joints out of the plane, in batches: places, axes, exact derivatives, and Newton on them.

A steering snake bends its legs sideways at the yaw joints inside its links. What joins two standing anchors is then a
closed chain in space, small and square, which has no formula as the planar leg has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray

#: most steps of Newton, and the residual (relative to lengths) at which it has converged
STEPS, CONVERGED = 40, 1e-13
#: rad: no joint goes farther in one step
STRIDE = 0.4


@dataclass(frozen=True, eq=False)
class Chain:
    """S chains of k joints: ``places`` (S, k, 3) and ``axes`` (S, k, 3) of the joints in the world, ``ends`` (S, k, 3)
    of the links after them, ``turns`` (S, k, 3, 3) of those links."""

    places: Array
    axes: Array
    ends: Array
    turns: Array

    @classmethod
    def of(cls, kinds: str, lengths: Array, origin: Array, turn: Array, angles: Array) -> Chain:
        """Joints of ``kinds`` "y" (nose-up, about -y) and "z" (to the left), each followed by a link of ``lengths``
        (k,) m along x, from ``origin`` (S, 3) and ``turn`` (S, 3, 3), at ``angles`` (S, k) rad."""
        size = len(angles)
        places, axes, ends = (np.empty((size, len(kinds), 3)) for _ in range(3))
        turns = np.empty((size, len(kinds), 3, 3))
        at, frame = origin, turn
        for k, kind in enumerate(kinds):
            places[:, k] = at
            axes[:, k] = -frame[:, :, 1] if kind == "y" else frame[:, :, 2]
            cos, sin = np.cos(angles[:, k, None]), np.sin(angles[:, k, None])
            x, y, z = (frame[:, :, i] for i in range(3))
            columns = (
                (cos * x + sin * z, y, cos * z - sin * x) if kind == "y" else (cos * x + sin * y, cos * y - sin * x, z)
            )
            frame = np.stack(columns, axis=-1)
            at = at + lengths[k] * frame[:, :, 0]
            ends[:, k], turns[:, k] = at, frame
        return cls(places, axes, ends, turns)

    def place(self, k: int) -> Array:
        """Jacobian (S, 3, joints) of the end of link ``k`` by all angles."""
        out = np.cross(self.axes, self.ends[:, k, None] - self.places)
        out[:, k + 1 :] = 0.0
        return np.swapaxes(out, -1, -2)

    def side(self, k: int) -> Array:
        """Jacobian (S, 3, joints) of the y axis of link ``k``."""
        out = np.cross(self.axes, np.broadcast_to(self.turns[:, k, None, :, 1], self.axes.shape))
        out[:, k + 1 :] = 0.0
        return np.swapaxes(out, -1, -2)

    def drift(self, k: int, rates: Array) -> tuple[Array, Array]:
        """Second derivatives (S, 3), (S, 3) of the end of link ``k`` and of its y axis where the angles change with
        ``rates`` (S, joints) and no accelerations."""
        spin = np.cumsum(rates[..., None] * self.axes, axis=1)
        before = spin - rates[..., None] * self.axes
        axis_rates = np.cross(before, self.axes)
        arm = self.ends[:, k, None] - self.places
        # velocities of the joints' places and of the end
        at = [np.zeros_like(self.ends[:, 0])]
        for j in range(1, self.places.shape[1]):
            at.append(at[-1] + np.cross(spin[:, j - 1], self.places[:, j] - self.places[:, j - 1]))
        velocity = np.stack(at, axis=1)
        end = velocity[:, k] + np.cross(spin[:, k], self.ends[:, k] - self.places[:, k])
        terms = np.cross(axis_rates, arm) + np.cross(self.axes, end[:, None] - velocity)
        y = np.broadcast_to(self.turns[:, k, None, :, 1], self.axes.shape)
        y_rate = np.cross(spin[:, k], self.turns[:, k, :, 1])
        sides = np.cross(axis_rates, y) + np.cross(self.axes, np.broadcast_to(y_rate[:, None], self.axes.shape))
        weight = rates[..., None]
        return (weight * terms)[:, : k + 1].sum(axis=1), (weight * sides)[:, : k + 1].sum(axis=1)

    def spin(self, k: int, rates: Array, seconds: Array) -> tuple[Array, Array]:
        """Angular velocity (S, 3) and acceleration (S, 3) of link ``k``."""
        turning = np.cumsum(rates[..., None] * self.axes, axis=1)
        axis_rates = np.cross(turning - rates[..., None] * self.axes, self.axes)
        gain = seconds[..., None] * self.axes + rates[..., None] * axis_rates
        return turning[:, k], gain[:, : k + 1].sum(axis=1)


def newton(residual: Callable[[Array], tuple[Array, Array]], guess: Array, scale: float) -> tuple[Array, BoolArray]:
    """Angles (S, k) at which ``residual`` (angles -> values (S, k), Jacobian (S, k, k)) vanishes, from a ``guess``; and
    which of them did, to :data:`CONVERGED` of ``scale`` m or a few roundings of it."""
    x = guess.copy()
    best = np.full(len(x), np.inf)
    found = x.copy()
    for _ in range(STEPS):
        value, slope = residual(x)
        size = np.abs(value).max(axis=1) / scale
        better = size < best
        found[better], best = x[better], np.minimum(best, size)
        if not better.any() and best.max() < 1e3 * CONVERGED:
            break
        step = np.linalg.lstsq(slope[0], value[0], rcond=None)[0][None] if len(x) == 1 else _solve(slope, value)
        x = x - np.clip(step, -STRIDE, STRIDE)
    return found, best < 1e3 * CONVERGED


def _solve(slope: Array, value: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(slope, value[..., None])[..., 0])
    except np.linalg.LinAlgError:  # one of the batch is singular: least squares for all
        return np.asarray(np.einsum("sij,sj->si", np.linalg.pinv(slope), value))
