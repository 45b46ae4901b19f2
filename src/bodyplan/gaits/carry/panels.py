"""Short panels of time in which a hub's speed is integrated, and how far the integral may be off.

The speeds and accelerations at a panel's ends and the speeds at two nodes in it integrate a speed that is smooth there
almost to rounding. Where it is not - the ground, the path or a formula bends suddenly, or the contact jumps to another
place - the accelerations do not go with the speeds, nor does the polynomial through all of them with the speeds in the
panels beside.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from bodyplan.arrays import Array, IntArray

#: columns of what is known of a wheel at a time: speed rad/s and acceleration rad/s^2 of its hub, contact angle rad and
#: radius m
SPEED, RATE, ANGLE, RADIUS, KNOWN = range(5)
#: s of a panel before any is cut, and how many there are at most
PANEL, MOST_PANELS = 0.05, 20_000
#: nodes for speeds with accelerations at the ends, where they integrate polynomials of degree 7, and for speeds alone:
#: those are right also where the speed bends or jumps at an end
NODES = np.sqrt(1.0 / 7.0) * np.array([-1.0, 1.0])
GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(3)

#: error of the integral over (-1, 1), about, as a share of what does not go together: of slopes, of divided differences
_DOUBT, _DOUBT_BESIDE = 0.1, 1.0
#: half lengths of a panel from its middle: nodes that are nearer do not say how it goes on beside it
_BESIDE = 1.1


def _conditions() -> Array:
    """(6, 6): speeds at -1, the nodes and 1, then slopes at -1 and 1, of the powers 0 to 5."""
    powers = np.arange(6)
    at, ends = np.array([[-1.0], *NODES[:, None], [1.0]]), np.array([[-1.0], [1.0]])
    return np.concatenate([at**powers, powers * ends ** np.maximum(powers - 1, 0)])


#: the polynomial of degree 5 through such numbers, and its integral over (-1, 1)
_THROUGH = np.linalg.inv(_conditions())
_INTEGRAL = np.array([2.0, 0.0, 2.0 / 3.0, 0.0, 2.0 / 5.0, 0.0]) @ _THROUGH
#: (2, 4): slopes at -1 and 1 of the cubic through the speeds alone
_SLOPES = _conditions()[4:, :4] @ np.linalg.inv(_conditions()[:4, :4])


@dataclass(frozen=True)
class Panels:
    """Panels of n wheels: the ``wheel`` (n,), the number (n,) of the time that each leads ``into``, ``start`` and
    ``end`` (n,) s, and what is known at the ``ends`` (n, 2, KNOWN)."""

    wheel: IntArray
    into: IntArray
    start: Array
    end: Array
    ends: Array

    def __len__(self) -> int:
        return len(self.wheel)

    @property
    def half(self) -> Array:
        """Half their lengths (n,) s."""
        return 0.5 * (self.end - self.start)

    @property
    def middle(self) -> Array:
        """(n,) s."""
        return 0.5 * (self.start + self.end)

    def nodes(self, at: Array) -> Array:
        """Times (n, k) s of nodes ``at`` (k,) within (-1, 1)."""
        return self.start[:, None] + self.half[:, None] * (1.0 + at)

    def integral(self, inner: Array) -> Array:
        """(n,) rad, with speeds ``inner`` (n, 2) at the nodes :data:`NODES`."""
        return np.asarray(self.half * (self._numbers(inner) @ _INTEGRAL))

    def integral_of_speeds(self, inner: Array) -> Array:
        """(n,) rad, of speeds ``inner`` (n, 3) at the nodes :data:`GAUSS` alone."""
        return np.asarray(self.half * (inner @ _WEIGHTS))

    def doubt(self, inner: Array) -> Array:
        """About the errors (n,) rad of the integrals, next to a bend or a jump; too much where speeds are smooth."""
        return np.asarray(np.abs(self.half) * _DOUBT * self._off(inner))

    def doubt_in_a_row(self, inner: Array) -> Array:
        """The same where panels stand in order: no more than by how much each one's polynomial misses the nodes of the
        panel before, or of that after it, as a divided difference: nearly nothing where speeds are smooth."""
        off = np.fmin(_DOUBT * self._off(inner), _DOUBT_BESIDE * self._off_beside(inner))
        return np.asarray(np.abs(self.half) * off)

    def take(self, index: IntArray) -> Panels:
        """Some of the panels, (k,)."""
        return Panels(*(getattr(self, f.name)[index] for f in fields(Panels)))

    def join(self, others: Panels) -> Panels:
        """These, then the others."""
        pairs = ((getattr(self, f.name), getattr(others, f.name)) for f in fields(Panels))
        return Panels(*(np.concatenate(pair) for pair in pairs))

    def cut(self, when: Array, sides: Array) -> Panels:
        """The parts before ``when`` (n,) s, then those after it; ``sides`` (n, 2, KNOWN) are known just before and just
        after."""
        size = len(self)
        both = self.take(np.tile(np.arange(size), 2))
        both.end[:size], both.start[size:] = when, when
        both.ends[:size, 1], both.ends[size:, 0] = sides[:, 0], sides[:, 1]
        return both

    def _numbers(self, inner: Array) -> Array:
        """(n, 6): speeds at the start, nodes and end, then accelerations times half a length."""
        speeds, rates = self.ends[:, :, SPEED], self.ends[:, :, RATE]
        return np.concatenate([speeds[:, :1], inner, speeds[:, 1:], self.half[:, None] * rates], axis=1)

    def _off(self, inner: Array) -> Array:
        """(n,): by how much slopes at the ends differ from those of the cubic through the speeds alone."""
        numbers = self._numbers(inner)
        return np.asarray(np.abs(numbers[:, :4] @ _SLOPES.T - numbers[:, 4:]).max(axis=1))

    def _off_beside(self, inner: Array) -> Array:
        """(n,): by how much polynomials differ from the panel before or after, the lesser; inf without such a one."""
        through, half, when = self._numbers(inner) @ _THROUGH.T, self.half, self.nodes(NODES)
        least = np.full(len(self), np.inf)
        before, after = slice(0, len(self) - 1), slice(1, len(self))
        for own, other in ((after, before), (before, after)):
            with np.errstate(all="ignore"):
                x = (when[other] - self.middle[own, None]) / half[own, None]
                value = np.zeros_like(x)
                for k in range(5, -1, -1):
                    value = value * x + through[own, k, None]
                off = np.abs(inner[other] - value) / ((x * x - 1.0) ** 2 * (x * x - NODES[1] ** 2))
            known = np.all(np.abs(x) > _BESIDE, axis=1) & (self.wheel[own] == self.wheel[other]) & (half[own] != 0.0)
            least[own] = np.where(known, np.fmin(least[own], off.max(axis=1)), least[own])
        return least


def edges_of(t: Array) -> tuple[Array, IntArray]:
    """Ends (p + 1,) s of panels from 0 over all times ``t`` (T,), and the number (p,) of the time that each one leads
    to."""
    times = np.concatenate([[0.0], t]) if t[0] != 0.0 else t
    longest = max(PANEL, float(t[-1]) / MOST_PANELS)
    counts = np.maximum(np.ceil(np.abs(np.diff(times)) / longest * (1.0 - 1e-9)), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(counts)), counts)
    part = np.arange(len(which)) - (np.cumsum(counts) - counts)[which]
    starts = times[which] + part * (np.diff(times) / counts)[which]
    return np.append(starts, times[-1]), which + len(t) - len(counts)
