"""Proof that a contact is the globally nearest one, and the search for it where it is not.

The distance of a ground curve w = W(s) (:mod:`planes`) from the wheel's centre is D(s), Phi = D^2/2 = (s^2 + W^2)/2,

    Phi' = s + W W',   Phi'' = 1 + W'^2 + W W''.

Let a contact lie at the distance D, and let \\|W''\\| <= M for \\|s\\| <= D. Where D M < sqrt(3) - 1 no other point is
nearer: Phi is convex wherever \\|W\\| < 1/M, and leaving that band and coming back takes a way of 2 sqrt(2 (1 - D
M))/M, more than the 2 D that there are (as in :mod:`bodyplan.ground.nearest`, one dimension down).

Elsewhere branch and bound decides over cells of s: cells in which W is bounded away are dropped, so are those whose
quadratic lower bound of Phi is too high; cells on which Phi is convex have one minimum, which Newton finds; the others
are halved. Bounds of W'' come from those of the ground's second derivatives, W within a cell from its value, slope and
those; at an edge of the ground, where there are none, from bounds of its height. Every other minimum that is as near as
the best one is a second contact.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry.planes import Planes, Section, section
from bodyplan.gaits.carry.terrain import Terrain

#: relative error of the distance up to which the proof holds
TOLERANCE = 1e-11
#: relative difference of two distances that count as the same: a wheel that touches twice
TWICE = 1e-9
#: m along the ground, as a share of the distance, from which on two contacts are two
APART = 1e-4
#: cells of one wheel kept at a time; more mean that pieces of ground tie
MOST_CELLS = 512
_LEVELS = 64
#: how often a box of the map is cut into four at most
_CUTS = 9
#: D M below which a contact is the nearest
CERTAIN = float(np.sqrt(3.0) - 1.0)


@dataclass(frozen=True)
class Found:
    """The nearest ground on n sections: at ``s`` (n,) m, ``distance`` (n,) m away; ``second`` (n,) m is the s of a
    contact as near as that, nan where there is none; ``certified`` (n,): nothing is nearer."""

    s: Array
    distance: Array
    second: Array
    certified: BoolArray


def certain(ground: Terrain, planes: Planes, foot: Section, distance: Array) -> BoolArray:
    """(n,) True where a look at the bounds proves that no other ground is as near as ``distance`` (n,) m; ``foot`` is
    the section at s = 0."""
    sure = certain_in_region(ground, planes, distance)
    reach = distance * (1.0 + TWICE)
    rest = np.flatnonzero(~sure)
    if len(rest):
        at = Section(*(getattr(foot, f.name)[rest] for f in fields(Section)))
        known = _known(ground, planes.take(rest), at, np.zeros(len(rest)), reach[rest])
        bends = np.maximum(np.abs(known.low), np.abs(known.high))
        sure[rest] = known.valid & (bends * reach[rest] < CERTAIN)
    return sure


def certain_in_region(ground: Terrain, planes: Planes, distance: Array) -> BoolArray:
    """The same by the bounds of the region of all wheels alone: for those that do not lean."""
    reach = distance * (1.0 + TWICE)
    if not len(reach):
        return np.zeros(0, dtype=np.bool_)
    place = planes.centre[:, :2]
    _, bend = ground.region_bounds((place - reach[:, None]).min(axis=0), (place + reach[:, None]).max(axis=0))
    return planes.upright & (bend * reach < CERTAIN)


def nearest(ground: Terrain, planes: Planes, guess: Array) -> Found:
    """The nearest ground of every section; ``guess`` (n,) m is where it may be. The ground at s = 0 must be below the
    centre."""
    return _Search(ground, planes, guess).run()


def limits() -> Array:
    """Numbers of this module that the kernel takes."""
    return np.array([TOLERANCE, TWICE, APART, MOST_CELLS, _LEVELS])


class _Search:
    def __init__(self, ground: Terrain, planes: Planes, guess: Array) -> None:
        self.ground, self.planes = ground, planes
        count = len(planes)
        self.best = np.zeros(count)
        self.value = np.full(count, np.inf)
        self.open = ~one_curve(ground, planes)
        self.minima: list[tuple[IntArray, Array, Array]] = []
        for start in (np.zeros(count), guess):
            at = section(ground, planes, start)
            self.take(np.arange(count), start, np.where(at.found, np.hypot(start, at.w), np.nan))

    def run(self) -> Found:
        owner = np.arange(len(self.planes))
        low, high = -self.value * (1.0 + TWICE), self.value * (1.0 + TWICE)
        with np.errstate(all="ignore"):
            for _ in range(_LEVELS):
                if not len(owner):
                    break
                owner, low, high = self.level(owner, low, high)
        self.open[owner] = True
        return Found(self.best, self.value, self.second(), ~self.open)

    def level(self, owner: IntArray, low: Array, high: Array) -> tuple[IntArray, Array, Array]:
        """Judge all cells; the halves of those that are still open."""
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        planes = self.planes.take(owner)
        at = section(self.ground, planes, middle)
        self.take(owner, middle, np.where(at.found, np.hypot(middle, at.w), np.nan))
        least, convex = self.judge(planes, at, middle, half)
        near = least < self.value[owner] * (1.0 + TWICE)
        simple = np.flatnonzero(near & convex)
        judged = np.zeros(len(owner), dtype=np.bool_)
        judged[simple] = self.descend(owner[simple], low[simple], high[simple])
        promising = near & ~judged & (least < self.value[owner] * (1.0 - TOLERANCE))
        # a cell this small holds an edge of the ground, and its middle is it
        wide = half > 1e-14 * (np.abs(planes.centre).max(axis=1) + self.value[owner])
        self.note(np.flatnonzero(promising & ~wide), owner, middle, at)
        keep = self.capped(np.flatnonzero(promising & wide), owner, least)
        return (
            np.tile(owner[keep], 2),
            np.concatenate([low[keep], middle[keep]]),
            np.concatenate([middle[keep], high[keep]]),
        )

    def judge(self, planes: Planes, at: Section, middle: Array, half: Array) -> tuple[Array, BoolArray]:
        """Lower bounds (n,) of D over cells, and whether Phi is convex on them."""
        known = _known(self.ground, planes, at, middle, half)
        aside = np.maximum(np.abs(middle) - half, 0.0)
        least = np.hypot(aside, np.maximum(np.maximum(known.w_low, -known.w_high), 0.0))
        steepness = np.maximum(np.abs(at.first) - np.maximum(np.abs(known.low), np.abs(known.high)) * half, 0.0)
        corners = np.array([w * b for w in (known.w_low, known.w_high) for b in (known.low, known.high)])
        mu = 1.0 + steepness**2 + corners.min(axis=0)
        # Phi >= Phi(m) + Phi'(m) d + mu/2 d^2 over |d| <= half
        pull = np.abs(middle + at.w * at.first)
        way = np.where(mu > 0.0, np.minimum(pull / mu, half), half)
        lowered = middle**2 + at.w**2 - 2.0 * pull * way + mu * way**2
        least = np.where(known.valid, np.fmax(least, np.sqrt(np.maximum(lowered, 0.0))), least)
        # a cell without ground in its middle has not been judged
        return np.where(at.found, least, aside), np.asarray(known.valid & (mu > 0.0))

    def descend(self, owner: IntArray, low: Array, high: Array) -> BoolArray:
        """The one minimum of Phi in each of these cells: Newton on Phi', kept inside by bisection. (n,) False where the
        section was not found on the way, and nothing is known."""
        planes = self.planes.take(owner)
        (first, *_, begins), (last, *_, ends) = (self.slopes(planes, end) for end in (low, high))
        known = begins & ((first >= 0.0) | ends)
        # at an end of a cell there is no minimum: the curve goes on
        inner = np.flatnonzero(known & (first < 0.0) & (last > 0.0))
        owner, a, b = owner[inner], low[inner], high[inner]
        planes, s = planes.take(inner), 0.5 * (a + b)
        active = np.arange(len(owner))
        for _ in range(60):
            if not len(active):
                break
            here = s[active]
            slope, bend, distance, found = self.slopes(planes.take(active), here)
            known[inner[active[~found]]] = False
            a[active] = np.where(slope < 0.0, here, a[active])
            b[active] = np.where(slope > 0.0, here, b[active])
            newton = here - slope / bend
            inside = (newton >= a[active]) & (newton <= b[active]) & (bend > 0.0)
            s[active] = np.where(inside, newton, 0.5 * (a[active] + b[active]))
            active = active[found & (np.abs(s[active] - here) > 1e-10 * distance)]
        at = section(self.ground, planes, s)
        known[inner[~at.found]] = False
        self.take(owner, s, np.where(at.found, np.hypot(s, at.w), np.nan))
        self.note(np.flatnonzero(known[inner]), owner, s, at)
        return known

    def slopes(self, planes: Planes, s: Array) -> tuple[Array, Array, Array, BoolArray]:
        """Phi', Phi'' and D at s (n,), and where the section was found."""
        at = section(self.ground, planes, s)
        return s + at.w * at.first, 1.0 + at.first**2 + at.w * at.second, np.hypot(s, at.w), at.found

    def note(self, index: IntArray, owner: IntArray, s: Array, at: Section) -> None:
        """Remember minima at ``s``."""
        if len(index):
            self.minima.append((owner[index], s[index], np.hypot(s, at.w)[index]))

    def take(self, owner: IntArray, s: Array, distance: Array) -> None:
        """Keep what is nearer than the best known; a wheel may have several candidates."""
        order = np.lexsort((distance, owner))
        first = order[np.unique(owner[order], return_index=True)[1]]
        first = first[distance[first] < self.value[owner[first]]]
        self.best[owner[first]], self.value[owner[first]] = s[first], distance[first]

    def capped(self, keep: IntArray, owner: IntArray, least: Array) -> IntArray:
        """``keep`` without the cells beyond MOST_CELLS of one wheel; that wheel has no proof then."""
        if len(keep) <= MOST_CELLS:
            return keep
        order = keep[np.lexsort((least[keep], owner[keep]))]
        _, first, counts = np.unique(owner[order], return_index=True, return_counts=True)
        rank = np.arange(len(order)) - np.repeat(first, counts)
        self.open[owner[order[rank >= MOST_CELLS]]] = True
        return np.asarray(order[rank < MOST_CELLS])

    def second(self) -> Array:
        """The s of another minimum as near as the best one, (n,); nan where there is none."""
        out = np.full(len(self.planes), np.nan)
        for owner, s, distance in self.minima:
            same = distance <= self.value[owner] * (1.0 + TWICE)
            other = np.abs(s - self.best[owner]) > APART * self.value[owner]
            out[owner[same & other]] = s[same & other]
        return out


def one_curve(ground: Terrain, planes: Planes) -> BoolArray:
    """(n,) True where the ground cuts a plane in one curve over s, as far as the ground below its centre is away: in
    upright planes always, in others where n > 0. Boxes of the map in which bounds say so are done, others are cut into
    four; one in whose middle the ground is too steep says no."""
    out = planes.upright
    owner = np.flatnonzero(~out)
    out[owner] = True
    leaning = planes.take(owner)
    half = np.abs(section(ground, leaning, np.zeros(len(owner))).w)
    middle = leaning.centre[:, :2].copy()
    with np.errstate(all="ignore"):
        for _ in range(_CUTS):
            if not len(owner):
                break
            up = planes.up[owner]
            known = ground.field_bounds(middle - half[:, None], middle + half[:, None])
            _, g, _ = ground.field_jet(middle[:, 0], middle[:, 1])
            across = np.sum(g * up[:, :2], axis=1)
            drift = np.hypot(up[:, 0], up[:, 1]) * _norm(*known.hessian) * np.sqrt(2.0) * half
            most = across + drift
            if known.gradient is not None:
                most = np.fmin(most, (known.gradient * up[:, :2]).max(axis=0).sum(axis=1))
            out[owner[~(across < up[:, 2])]] = False
            left = np.flatnonzero(~(most < up[:, 2]) & out[owner])
            owner, half = np.repeat(owner[left], 4), np.repeat(0.5 * half[left], 4)
            corners = np.tile([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]], (len(left), 1))
            middle = np.repeat(middle[left], 4, axis=0) + half[:, None] * corners
    out[owner] = False
    return out


class _Known(NamedTuple):
    """What is known of n cells: bounds of W'', of W (infinite where unknown), and where those of W'' hold."""

    low: Array
    high: Array
    w_low: Array
    w_high: Array
    valid: BoolArray


def _known(ground: Terrain, planes: Planes, at: Section, middle: Array, half: Array) -> _Known:
    """Bounds over the cells middle +- half (n,); ``at`` is the section in the middles."""
    with np.errstate(all="ignore"):
        upright = planes.upright
        # W stays within this of its middle, or nothing is said
        room = np.where(upright, 0.0, 2.0 * (1.0 + np.abs(at.first)) * half)
        size = np.abs(planes.ahead[:, :2]) * half[:, None] + np.abs(planes.up[:, :2]) * room[:, None]
        place = planes.points(middle, np.where(upright, 0.0, at.w))[:, :2]
        known = ground.field_bounds(place - size, place + size)
        # the Hessian by its own bounds and by how far it may be from that in the middle
        spread = (known.change * np.linalg.norm(size, axis=1))[:, None, None]
        spread = np.where(np.isfinite(spread), spread, np.inf)
        low, high = np.fmax(known.hessian[0], at.hessian - spread), np.fmin(known.hessian[1], at.hessian + spread)
        e_low, e_high = _quadratic(planes.ahead, low, high)
        # how far the gradient, n and W' may be from their values in the middle
        drift = _norm(low, high) * np.linalg.norm(size, axis=1)
        lean = np.hypot(planes.up[:, 0], planes.up[:, 1])
        n_low, n_high = at.steep - drift * lean, at.steep + drift * lean
        slope = lean * (np.abs(np.sum(at.gradient * planes.ahead[:, :2], axis=1)) + drift) / n_low
        aside = _norm(low, high) * slope * (2.0 + slope)
        b_low = np.where(upright, e_low, np.minimum((e_low - aside) / n_low, (e_low - aside) / n_high))
        b_high = np.where(upright, e_high, np.maximum((e_high + aside) / n_low, (e_high + aside) / n_high))
        rise = np.abs(at.first) * half + 0.5 * np.maximum(np.abs(b_low), np.abs(b_high)) * half**2
        valid = at.found & np.isfinite(b_low) & np.isfinite(b_high) & (upright | ((n_low > 0.0) & (rise <= room)))
        # in an upright plane bounds of the height serve as well, and at an edge they are all there is
        z = np.where(upright, known.z - planes.centre[:, 2], [[-np.inf], [np.inf]])
        w_low = np.fmax(np.where(valid, at.w - rise, -np.inf), z[0])
        w_high = np.fmin(np.where(valid, at.w + rise, np.inf), z[1])
    return _Known(b_low, b_high, w_low, w_high, np.asarray(valid))


def _norm(low: Array, high: Array) -> Array:
    """Gershgorin's bound (n,) of the norm of symmetric matrices between ``low`` and ``high`` (n, 2, 2)."""
    size = np.maximum(np.abs(low), np.abs(high))
    return np.asarray(np.maximum(size[:, 0, 0], size[:, 1, 1]) + size[:, 0, 1])


def _quadratic(a: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Bounds (n,) of a'Ha for a (n, 2+) over symmetric H between ``low`` and ``high`` (n, 2, 2)."""
    weights = np.stack([a[:, 0] ** 2, 2.0 * a[:, 0] * a[:, 1], a[:, 1] ** 2], axis=1)
    ends = [np.stack([m[:, 0, 0], m[:, 0, 1], m[:, 1, 1]], axis=1) for m in (low, high)]
    # a weight of 0 needs no bound
    one, two = (np.where(weights == 0.0, 0.0, weights * end) for end in ends)
    return np.minimum(one, two).sum(axis=1), np.maximum(one, two).sum(axis=1)
