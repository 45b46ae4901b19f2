"""How far hubs turn: their speeds integrated between the times, in panels as short as each wheel needs them.

Four Gauss nodes a panel integrate a speed that is smooth there almost to rounding. Where it is not - the ground, the
path or a formula bends suddenly, or the contact jumps to another place - that shows at the panel's ends, where the
accelerations are known, too: the polynomial through the speeds at the nodes and ends has other slopes there. Such a
panel is halved, for the wheel concerned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry import contact
from bodyplan.gaits.carry.carriage import Carriage
from bodyplan.gaits.carry.pose import planes_of
from bodyplan.gaits.carry.rates import rates, rolling
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.gaits.carry.wheels import Wheels

#: s of a panel before any is halved, how many there are at most, and how often one is halved
PANEL, MOST_PANELS, HALVINGS = 0.05, 20_000, 3
#: rad: a panel with less error than that, or than this share of the largest error of its wheel, is not halved
ENOUGH, SHARE = 1e-11, 2e-2

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


def _slopes() -> Array:
    """(2, 6): the slopes at -1 and 1 of the polynomial of degree 5 through values at -1, the nodes and 1."""
    at, powers = np.concatenate([[-1.0], _NODES, [1.0]]), np.arange(6)
    ends = np.stack([powers * (-1.0) ** (powers - 1), powers.astype(np.float64)])
    return np.asarray(np.linalg.solve(np.vander(at, increasing=True).T, ends.T).T)


_SLOPES = _slopes()
#: share of a difference of those slopes that is the error of the integral over (-1, 1), about, next to a bend of the
#: speed or a jump of it
_DOUBT = 0.04


@dataclass(frozen=True)
class _Panels:
    """Panels of n wheels: the ``wheel`` (n,), the number (n,) of the time that each leads ``into``, ``start`` and
    ``end`` (n,) s, and the speeds rad/s and accelerations rad/s^2 there, (n, 2) each."""

    wheel: IntArray
    into: IntArray
    start: Array
    end: Array
    speeds: Array
    rates: Array

    @property
    def half(self) -> Array:
        """Half their lengths (n,) s."""
        return 0.5 * (self.end - self.start)

    @property
    def nodes(self) -> Array:
        """Their Gauss nodes (n, 4) s."""
        return self.start[:, None] + self.half[:, None] * (1.0 + _NODES)

    def doubt(self, inner: Array) -> Array:
        """About the errors (n,) rad of the integrals of speeds ``inner`` (n, 4) at the nodes."""
        through = np.concatenate([self.speeds[:, :1], inner, self.speeds[:, 1:]], axis=1)
        half = self.half
        off = np.abs(through @ _SLOPES.T - half[:, None] * self.rates).max(axis=1)
        return np.asarray(_DOUBT * np.abs(half) * off)

    def take(self, index: IntArray) -> _Panels:
        """Some of the panels, (k,)."""
        return _Panels(*(getattr(self, f.name)[index] for f in fields(_Panels)))

    def halved(self) -> tuple[_Panels, Array]:
        """The first halves (n,), then the second ones, with nan for what is not known of the middles (n,) s."""
        middle, size = 0.5 * (self.start + self.end), len(self.wheel)
        both = self.take(np.tile(np.arange(size), 2))
        both.end[:size], both.start[size:] = middle, middle
        for known in (both.speeds, both.rates):
            known[:size, 1], known[size:, 0] = np.nan, np.nan
        return both, middle


@dataclass(frozen=True)
class Hubs:
    """The hubs of a body that goes over the ground; ``at`` gives the body at any times."""

    wheels: Wheels
    land: Terrain
    at: Callable[[Array], Carriage]

    def speeds(self, wheel: IntArray, when: Array) -> Array:
        """Speeds (n,) rad/s of hubs ``wheel`` (n,) about their axles at times ``when`` (n,) s; 0 where they do not
        touch."""
        body, index = self._carried(wheel, when)
        found = contact.find(self.land, planes_of(self.wheels, body.position, body.turn.matrix).take(index))
        made = rolling(found, body.carried(self.wheels).take(index))
        return _finite(made, found.outcome == contact.TOUCHES)

    def moving(self, wheel: IntArray, when: Array) -> tuple[Array, Array]:
        """Those speeds, and the accelerations (n,) rad/s^2."""
        body, index = self._carried(wheel, when)
        found = contact.find(self.land, planes_of(self.wheels, body.position, body.turn.matrix).take(index))
        made = rates(self.land, found, body.carried(self.wheels).take(index))
        touches = found.outcome == contact.TOUCHES
        return _finite(made.rolling, touches), _finite(made.rolling_rate, touches)

    def _carried(self, wheel: IntArray, when: Array) -> tuple[Carriage, IntArray]:
        """The body at the times, each once, and where of all wheels at those times the ones asked for are."""
        times, which = np.unique(when, return_inverse=True)
        return self.at(times), wheel * len(times) + which

    def turned(self, t: Array, speeds: Array, rates: Array) -> Array:
        """Angles (T, k) rad by which k hubs have turned from t = 0 to the times ``t`` (T,) s, from their ``speeds``
        and accelerations ``rates`` (T, k) at those times."""
        panels, angle = self._panels(t, speeds, rates), np.zeros((len(self.wheels), len(t)))
        if not len(panels.wheel):
            return np.asarray(angle.T)
        inner = self.speeds(np.repeat(panels.wheel, 4), panels.nodes.ravel()).reshape(-1, 4)
        for left in range(HALVINGS, -1, -1):
            doubt, worst = panels.doubt(inner), np.zeros(len(self.wheels))
            np.maximum.at(worst, panels.wheel, doubt)
            more = (doubt > np.maximum(ENOUGH, SHARE * worst[panels.wheel])) & (left > 0)
            done, part = ~more, (inner @ _WEIGHTS) * panels.half
            np.add.at(angle, (panels.wheel[done], panels.into[done]), part[done])
            if not more.any():
                break
            panels, inner = self._halved(panels.take(np.flatnonzero(more)))
        return np.asarray(np.cumsum(angle, axis=1).T)

    def _halved(self, panels: _Panels) -> tuple[_Panels, Array]:
        """Halves of n panels, (2 n,), and the speeds (2 n, 4) at their nodes."""
        size, (halves, middle) = len(panels.wheel), panels.halved()
        wheel, when = np.repeat(halves.wheel, 4), halves.nodes.ravel()
        speed, rate = self.moving(np.append(wheel, panels.wheel), np.append(when, middle))
        for known, new in ((halves.speeds, speed), (halves.rates, rate)):
            known[:size, 1] = known[size:, 0] = new[len(when) :]
        return halves, speed[: len(when)].reshape(-1, 4)

    def _panels(self, t: Array, speeds: Array, rates: Array) -> _Panels:
        """The panels before any is halved: from 0 to the first time and between the others, in as many equal parts as
        it takes."""
        edges, into = _edges(t)
        count, size = len(self.wheels), len(into)
        known = np.isin(edges, t)
        ends = np.empty((2, count, len(edges)))
        ends[:, :, known] = _finite(np.stack([speeds, rates])[:, np.searchsorted(t, edges[known])].transpose(0, 2, 1))
        other = edges[~known]
        if len(other):
            made = self.moving(np.repeat(np.arange(count), len(other)), np.tile(other, count))
            ends[:, :, ~known] = np.stack(made).reshape(2, count, -1)
        both = np.stack([ends[:, :, :-1], ends[:, :, 1:]], axis=-1).reshape(2, -1, 2)
        wheel = np.repeat(np.arange(count), size)
        return _Panels(wheel, np.tile(into, count), np.tile(edges[:-1], count), np.tile(edges[1:], count), *both)


def _edges(t: Array) -> tuple[Array, IntArray]:
    """Ends (p + 1,) s of panels from 0 over all times, and the number (p,) of the time that each one leads to."""
    times = np.concatenate([[0.0], t]) if t[0] != 0.0 else t
    longest = max(PANEL, float(t[-1]) / MOST_PANELS)
    counts = np.maximum(np.ceil(np.abs(np.diff(times)) / longest * (1.0 - 1e-9)), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(counts)), counts)
    part = np.arange(len(which)) - (np.cumsum(counts) - counts)[which]
    starts = times[which] + part * (np.diff(times) / counts)[which]
    return np.append(starts, times[-1]), which + len(t) - len(counts)


def _finite(values: Array, sure: BoolArray | bool = True) -> Array:
    """The values where they are finite and ``sure``, else 0."""
    return np.where(np.isfinite(values) & sure, values, 0.0)
