"""How far hubs turn: their speeds integrated between the times, in panels as short as each wheel needs them.

A panel whose numbers do not go together (:mod:`bodyplan.gaits.carry.panels`) is cut in two, for the wheel concerned: at
first where the contact jumps from one place of the ground to another, if it does; else in the middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry import contact
from bodyplan.gaits.carry.carriage import Carriage
from bodyplan.gaits.carry.panels import ANGLE, GAUSS, KNOWN, NODES, RADIUS, RATE, SPEED, Panels, edges_of
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.pose import planes_of
from bodyplan.gaits.carry.rates import Carried, rates, rolling
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.field import Field

#: how often a panel is cut
HALVINGS = 3
#: rad: a panel with less error than that, or than this share of the largest error of its wheel, is not cut
ENOUGH, SHARE = 1e-11, 2e-2
#: steps to a jump of the contact; the last one is at most this share of the time in which it is looked for
_STEPS, _NEAR = 2, 0.1
#: rad: contacts less apart are one; share of a radius by which the nearest one may seem nearer
_APART, _SAME = 1e-6, 1e-9


@dataclass(frozen=True)
class Hubs:
    """The hubs of a body that goes over the ground; ``at`` gives the body at any times."""

    wheels: Wheels
    land: Terrain
    at: Callable[[Array], Carriage]

    def known(self, wheel: IntArray, when: Array, *, gains: bool) -> Array:
        """What is known (n, KNOWN) of wheels ``wheel`` (n,) at times ``when`` (n,) s; speeds and accelerations 0 where
        they do not touch; accelerations only with ``gains``."""
        planes, carried = self._carried(wheel, when)
        found = contact.find(self.land, planes)
        out, touches = np.zeros((len(wheel), KNOWN)), found.outcome == contact.TOUCHES
        out[:, ANGLE], out[:, RADIUS] = found.phi, found.radius
        if gains:
            made = rates(self.land, found, carried)
            out[:, SPEED], out[:, RATE] = _finite(made.rolling, touches), _finite(made.rolling_rate, touches)
        else:
            out[:, SPEED] = _finite(rolling(found, carried), touches)
        return out

    def _carried(self, wheel: IntArray, when: Array) -> tuple[Planes, Carried]:
        """The wheels' planes and how they are carried; the body is asked once a time."""
        times, which = np.unique(when, return_inverse=True)
        body, index = self.at(times), wheel * len(times) + which
        planes = planes_of(self.wheels, body.position, body.turn.matrix)
        return planes.take(index), body.carried(self.wheels).take(index)

    def turned(self, t: Array, known: Array) -> Array:
        """Angles (T, k) rad by which k hubs have turned from t = 0 to the times ``t`` (T,) s, from what is ``known``
        (T, k, KNOWN) at those times."""
        panels, angle = self._panels(t, known), np.zeros((len(self.wheels), len(t)))
        if not len(panels):
            return np.asarray(angle.T)

        def add(some: Panels, turns: Array) -> None:
            np.add.at(angle, (some.wheel, some.into), turns)

        inner = self._inner(panels, NODES)
        doubt = panels.doubt_in_a_row(inner[:, :, SPEED])
        for left in range(HALVINGS - 1, -1, -1):
            worst = np.zeros(len(self.wheels))
            np.maximum.at(worst, panels.wheel, doubt)
            more = doubt > np.maximum(ENOUGH, SHARE * worst[panels.wheel])
            if not more.any():
                break
            cut, rest = panels.take(np.flatnonzero(more)), np.flatnonzero(~more)
            inside, panels, inner, doubt = inner[more], panels.take(rest), inner[rest], doubt[rest]
            if left:
                when, sides = self.jumps(cut, inside) if left == HALVINGS - 1 else _nowhere(len(cut))
                parts, inside = self._cut(cut, when, sides)
                panels, inner = panels.join(parts), np.concatenate([inner, inside])
                doubt = np.append(doubt, parts.doubt(inside[:, :, SPEED]))
            else:
                # as short as they get: without the ends, at which a speed may bend or jump
                halves = cut.cut(cut.middle, cut.ends)
                add(halves, halves.integral_of_speeds(self._inner(halves, GAUSS)[:, :, SPEED]))
        add(panels, panels.integral(inner[:, :, SPEED]))
        return np.asarray(np.cumsum(angle, axis=1).T)

    def _inner(self, panels: Panels, at: Array) -> Array:
        """What is known (n, k, KNOWN) at nodes ``at`` (k,), without accelerations."""
        made = self.known(np.repeat(panels.wheel, len(at)), panels.nodes(at).ravel(), gains=False)
        return made.reshape(len(panels), len(at), KNOWN)

    def _cut(self, panels: Panels, when: Array, sides: Array) -> tuple[Panels, Array]:
        """n panels as two of each (2 n,), cut at times ``when`` (n,) s where ``sides`` (n, 2, KNOWN) are known just
        before and after, or, where that is nan, in the middle; and what is known (2 n, 2, KNOWN) at their nodes."""
        halved = np.flatnonzero(np.isnan(when))
        middle = panels.middle[halved]
        when[halved] = middle
        parts = panels.cut(when, sides)
        wheel, nodes = np.repeat(parts.wheel, 2), parts.nodes(NODES).ravel()
        made = self.known(np.append(wheel, panels.wheel[halved]), np.append(nodes, middle), gains=len(halved) > 0)
        parts.ends[halved, 1] = parts.ends[len(panels) + halved, 0] = made[len(nodes) :]
        return parts, made[: len(nodes)].reshape(len(parts), 2, KNOWN)

    def jumps(self, panels: Panels, inner: Array) -> tuple[Array, Array]:
        """Times (n,) s at which contacts jump within n panels, nan where no jump is found, and what is known (n, 2,
        KNOWN) just before and after; ``inner`` (n, 2, KNOWN) is known at the nodes.

        Of the ends and nodes, all of them nearest contacts, two neighbours are on either side of the largest jump: both
        contacts are followed to the time at which they are as near. It is one of a jump if nothing else is nearer then.
        """
        (when, sides), land = _nowhere(len(panels)), self.land
        if not isinstance(land, Field):
            return when, sides
        places = np.concatenate([panels.ends[:, :1], inner, panels.ends[:, 1:]], axis=1)
        times = np.concatenate([panels.start[:, None], panels.nodes(NODES), panels.end[:, None]], axis=1)
        apart = np.abs(np.diff(places[:, :, ANGLE], axis=1))
        some = np.flatnonzero(apart.max(axis=1) > _APART)
        first = apart[some].argmax(axis=1)
        low, high = times[some, first], times[some, first + 1]
        at, found = 0.5 * (low + high), np.stack([places[some, first], places[some, first + 1]], axis=1)
        for left in range(_STEPS - 1, -1, -1):
            if not len(some):
                break
            found, step = self._nearer(land, panels.wheel[some], at, found)
            at = at + step
            good = np.isfinite(found).all(axis=(1, 2)) & (low < at) & (at < high)
            good &= np.abs(found[:, 1, ANGLE] - found[:, 0, ANGLE]) > _APART
            good &= (np.abs(step) <= _NEAR * (high - low)) | (left > 0)
            some, low, high, at, found = some[good], low[good], high[good], at[good], found[good]
        if len(some):
            nearest = self.known(panels.wheel[some], at, gains=False)[:, RADIUS]
            good = nearest >= found[:, :, RADIUS].min(axis=1) * (1.0 - _SAME)
            when[some[good]], sides[some[good]] = at[good], found[good]
        return when, sides

    def _nearer(self, land: Field, wheel: IntArray, when: Array, near: Array) -> tuple[Array, Array]:
        """Two contacts of each of n wheels at times ``when`` (n,) s, from ``near`` (n, 2, KNOWN) on: what is known of
        them when they are as near, a step (n,) s later; nan where they do not come to that."""
        planes, carried = self._carried(np.repeat(wheel, 2), np.repeat(when, 2))
        found = contact.follow(land, planes, near[:, :, ANGLE].ravel(), near[:, :, RADIUS].ravel())
        made = rates(land, found, carried)
        with np.errstate(all="ignore"):
            gap, grows, gains = (
                v[:, 0] - v[:, 1] for v in (a.reshape(-1, 2) for a in (found.radius, made.radius, made.radius_rate))
            )
            # Halley's step: of the parabola through the gap
            step = -gap / (grows - 0.5 * gains * gap / grows)
            step = np.where(np.isfinite(step) & (grows > 0.0), step, np.nan)
            at = np.repeat(step, 2)
            columns = [
                made.rolling + made.rolling_rate * at,
                made.rolling_rate,
                found.phi + made.angle * at,
                found.radius + made.radius * at,
            ]
        return np.stack(columns, axis=1).reshape(-1, 2, KNOWN), step

    def _panels(self, t: Array, known: Array) -> Panels:
        """The panels before any is cut: from 0 to the first time and between the others, in as many equal parts as it
        takes."""
        edges, into = edges_of(t)
        count, size = len(self.wheels), len(into)
        given = np.isin(edges, t)
        ends = np.empty((count, len(edges), KNOWN))
        ends[:, given] = known[np.searchsorted(t, edges[given])].transpose(1, 0, 2)
        other = edges[~given]
        if len(other):
            made = self.known(np.repeat(np.arange(count), len(other)), np.tile(other, count), gains=True)
            ends[:, ~given] = made.reshape(count, -1, KNOWN)
        both = np.stack([ends[:, :-1], ends[:, 1:]], axis=2).reshape(-1, 2, KNOWN)
        wheel = np.repeat(np.arange(count), size)
        return Panels(wheel, np.tile(into, count), np.tile(edges[:-1], count), np.tile(edges[1:], count), both)


def _nowhere(size: int) -> tuple[Array, Array]:
    """No times (n,), and nothing known (n, 2, KNOWN) at them."""
    return np.full(size, np.nan), np.zeros((size, 2, KNOWN))


def _finite(values: Array, sure: BoolArray) -> Array:
    """The values where they are finite and ``sure``, else 0."""
    return np.where(np.isfinite(values) & sure, values, 0.0)
