"""One sweep of extension through a concertina body, from contracted to contracted.

The extension enters at the head and leaves at the tail. With stretch(s) the absolute link angles of the stretching at
progress s in [0, T], rev(.) the same for the chain read from the head, and T - c = r, a sweep is

    angles = stretch(s) + rev(stretch(r)),     s: 0 -> T,   r: T -> 0,

so r = T while the body stretches at its head (launch), s = T while it contracts at its tail (landing), and in
between (transit) gain(s) + gain(r) = G + D keeps the extension in flight D constant; G is the full gain. D = G has no
transit: it is the mirrored gait. All is written in u = s - r, which grows through the whole sweep from -T to T
(ds/du is regular even where a gain stands still).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit

from bodyplan.arrays import Array
from bodyplan.curves import pieces as pc
from bodyplan.errors import InputError
from bodyplan.gaits.stretching import StretchingBody, body_at


@dataclass(frozen=True)
class Window:
    """A stage of a sweep: ``parameter`` of the stages changes while u runs from ``start`` to ``end``; ``stretching``
    tells stretch(s) from rev(stretch(r))."""

    name: str
    parameter: int
    start: float
    end: float
    stretching: bool


class Sweep(Protocol):
    """A sweep: absolute link angles with derivatives over u in [-T, T], and where it launches and lands."""

    front: StretchingBody
    total: float
    gain: float
    launch_end: float
    landing_start: float
    windows: tuple[Window, ...]

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Angles (S, n) and their first and second derivatives by u, for ascending u (S,)."""
        ...


@njit(cache=True)
def _progress_at(
    target: float,
    low: float,
    high: float,
    ramps: tuple[Array, Array, Array, Array],
    blend: int,
    curve: tuple[float, int, int, float],
    lengths: Array,
    nodes: Array,
    weights: Array,
) -> float:
    """Progress in [low, high] at which the extent, which grows, is ``target``: Newton inside a shrinking bracket."""
    parameters = np.empty((ramps[0].size, 3))
    pieces = np.empty((ramps[0].size + 2, pc.COLUMNS))
    points, angles, rates = np.empty((lengths.size + 1, 2)), np.empty(lengths.size), np.empty((2, lengths.size))
    s = 0.5 * (low + high)
    for _ in range(200):
        e, e1, _, _ = body_at(
            s, ramps, blend, curve, lengths, nodes, weights, parameters, pieces, points, angles, rates
        )
        if e < target:
            low = s
        else:
            high = s
        following = s - (e - target) / e1 if e1 > 0.0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - s) <= 1e-15 * (1.0 + abs(s)) or high - low <= 1e-15:
            return following
        s = following
    return s


@njit(cache=True)
def _transit(
    u: Array,
    target: float,
    lows: Array,
    highs: Array,
    front: tuple[tuple[Array, Array, Array, Array], int, tuple[float, int, int, float], Array, Array, Array],
    back: tuple[tuple[Array, Array, Array, Array], int, tuple[float, int, int, float], Array, Array, Array],
    out: Array,
) -> None:
    """s for each u of a transit: gain(s) + gain(s - u) = target; warm-started along ascending u."""
    n = front[3].size
    parameters = np.empty((front[0][0].size, 3))
    pieces = np.empty((front[0][0].size + 2, pc.COLUMNS))
    points, angles, rates = np.empty((n + 1, 2)), np.empty(n), np.empty((2, n))
    s = 0.5 * (lows[0] + highs[0]) if u.size else 0.0
    for i in range(u.size):
        low, high = lows[i], highs[i]
        if not low < s < high:
            s = 0.5 * (low + high)
        for _ in range(200):
            a, a1, _, _ = body_at(
                s,
                front[0],
                front[1],
                front[2],
                front[3],
                front[4],
                front[5],
                parameters,
                pieces,
                points,
                angles,
                rates,
            )
            b, b1, _, _ = body_at(
                s - u[i],
                back[0],
                back[1],
                back[2],
                back[3],
                back[4],
                back[5],
                parameters,
                pieces,
                points,
                angles,
                rates,
            )
            miss, slope = a + b - target, a1 + b1
            if miss < 0.0:
                low = s
            else:
                high = s
            following = s - miss / slope if slope > 0.0 else low
            if not low < following < high:
                following = 0.5 * (low + high)
            done = abs(following - s) <= 1e-14 * (1.0 + abs(s)) or high - low <= 1e-15
            s = following
            if done:
                break
        out[i] = s


class ExtensionSweep:
    """The sweep of the module docstring. ``front`` is the body, ``back`` the same with its links in reverse order,
    ``extension`` = D/G in (0, 1], ``sign`` +1 for even N_B; -1 for odd, whose contracted curve is its own mirror
    image (x -> -x) instead of its own point reflection.

    Raises InputError when extension < 1 and the stretching does not lengthen the body all the way.
    """

    def __init__(self, front: StretchingBody, back: StretchingBody, extension: float, sign: float = 1.0) -> None:
        self.front, self.back, self.sign = front, back, sign
        total = self.total = front.stages.total
        grid = np.linspace(0.0, total, 257)
        extents = front.at(grid).extents[:, 0]
        whole = extension >= 1.0
        if not whole and np.any(np.diff(extents) < -1e-12 * extents[-1]):
            worst = grid[int(np.argmin(np.diff(extents)))]
            raise InputError(
                f"body_modules, omega: the body shortens while it stretches (at {worst / total:.0%} of its stages); an "
                "extension wave needs a gain that grows. The folds are too small for the links (use fewer "
                "body_modules or a smaller omega), or stages overlap too much."
            )
        shortest, longest = extents[0], extents[-1]
        self.gain = float(longest - shortest)
        #: extent(s) + extent(r) in transit
        self.target = float(longest + shortest + extension * self.gain)
        self.s_launch = total if whole else self._invert(front, self.target - longest)
        self.r_landing = total if whole else self._invert(back, self.target - longest)
        self.launch_end = self.s_launch - total
        self.landing_start = total - self.r_landing
        self.windows = self._windows()

    def _invert(self, body: StretchingBody, extent: float) -> float:
        return float(_progress_at(extent, 0.0, self.total, *body.kernel_arguments))

    def _u_at(self, progress: float, stretching: bool) -> float:
        """u at which s (or r) passes a given progress."""
        body, other = (self.front, self.back) if stretching else (self.back, self.front)
        launched = self.s_launch if stretching else self.r_landing
        side = 1.0 if stretching else -1.0
        if progress <= launched:
            return side * (progress - self.total)
        extent = float(body.at(np.array([progress])).extents[0, 0])
        return side * (progress - self._invert(other, self.target - extent))

    def _windows(self) -> tuple[Window, ...]:
        st = self.front.stages
        out = []
        for i in st.order:
            a, b = float(st.start[i]), float(st.start[i] + st.duration[i])
            out.append(Window(f"stretch {st.names[i]}", int(i), self._u_at(a, True), self._u_at(b, True), True))
        for i in st.order[::-1]:
            # read from the head, the chain's "tail" parameter shapes the head's end
            a, b = float(st.start[i]), float(st.start[i] + st.duration[i])
            name = f"contract {_mirrored(st.names, int(i))}"
            out.append(Window(name, int(i), self._u_at(b, False), self._u_at(a, False), False))
        return tuple(out)

    def progress(self, u: Array) -> tuple[Array, Array]:
        """s (S,) and r (S,) for ascending u (S,) in [-T, T]."""
        total = self.total
        s = np.where(u <= self.launch_end, u + total, total)
        moving = (u > self.launch_end) & (u < self.landing_start)
        if moving.any():
            inner = np.ascontiguousarray(u[moving])
            found = np.empty_like(inner)
            lows = np.maximum(self.s_launch, inner + self.r_landing)
            highs = np.minimum(total, inner + total)
            arguments = self.front.kernel_arguments, self.back.kernel_arguments
            _transit(inner, self.target, lows, highs, *arguments, found)
            s[moving] = found
        return np.clip(s, 0.0, total), np.clip(s - u, 0.0, total)

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Angles (S, n) and their first and second derivatives by u, for ascending u (S,) in [-T, T]."""
        u = np.asarray(u, dtype=np.float64)
        s, r = self.progress(u)
        a, b = self.front.at(s), self.back.at(r)
        a1, a2 = a.extents[:, 1], a.extents[:, 2]
        b1, b2 = b.extents[:, 1], b.extents[:, 2]
        moving = (u > self.launch_end) & (u < self.landing_start)
        both = np.where(a1 + b1 > 0.0, a1 + b1, 1.0)
        # launch: s' = 1; landing: r' = -1; transit: gain'(s) s' + gain'(r) r' = 0 with s' - r' = 1
        s1 = np.where(moving, np.where(a1 + b1 > 0.0, b1 / both, 0.5), np.where(u < self.landing_start, 1.0, 0.0))
        if self.launch_end >= self.landing_start:
            s1 = np.where(u < self.landing_start, 1.0, 0.0)
        r1 = s1 - 1.0
        s2 = np.where(moving, (b2 * r1 * a1 - b1 * a2 * s1) / both**2, 0.0)
        flip = self.sign
        angles = a.angles + flip * b.angles[:, ::-1]
        first = a.rates[:, 0] * s1[:, None] + flip * b.rates[:, 0, ::-1] * r1[:, None]
        second = (
            a.rates[:, 1] * (s1**2)[:, None]
            + a.rates[:, 0] * s2[:, None]
            + flip * (b.rates[:, 1, ::-1] * (r1**2)[:, None] + b.rates[:, 0, ::-1] * s2[:, None])
        )
        return angles, first, second


class LiteralSweep:
    """Stretching, then section IV.B as printed: gamma back to 0 head first, the tail multiplier last. With y = 0
    upstream the body stays flat until the tail's stage, then everything folds at once (correction 6)."""

    def __init__(self, front: StretchingBody, contraction: StretchingBody) -> None:
        self.front, self.contraction = front, contraction
        self.total = front.stages.total
        self.launch_end = self.landing_start = 0.0
        extents = front.at(np.array([0.0, self.total])).extents[:, 0]
        self.gain = float(extents[1] - extents[0])
        out = []
        for body, offset, word in ((front, -self.total, "stretch"), (contraction, 0.0, "contract")):
            st = body.stages
            for i in st.order:
                a = float(st.start[i]) + offset
                out.append(Window(f"{word} {st.names[i]}", int(i), a, a + float(st.duration[i]), word == "stretch"))
        self.windows = tuple(out)

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Angles (S, n) and their derivatives by u, for u (S,) in [-T, T]."""
        u = np.asarray(u, dtype=np.float64)
        a, b = self.front.at(np.clip(u + self.total, 0.0, self.total)), self.contraction.at(np.clip(u, 0.0, self.total))
        early = (u < 0.0)[:, None]
        return (
            np.where(early, a.angles, b.angles),
            np.where(early, a.rates[:, 0], b.rates[:, 0]),
            np.where(early, a.rates[:, 1], b.rates[:, 1]),
        )


def _mirrored(names: tuple[str, ...], i: int) -> str:
    """Place of parameter i when the chain is read from the head: "head" for the tail's, module N_B + 1 - k for k's."""
    modules = len(names) - 2
    if i == 0:
        return "head"
    return "tail" if i == modules + 1 else f"module {modules + 1 - i}"
