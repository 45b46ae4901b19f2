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
from bodyplan.errors import InputError
from bodyplan.gaits.stretching import Chain, Scratch, StretchingBody, body_at, scratch_of
from bodyplan.kernels import lean


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
    #: s where the angles at -u are s times those at u, read from the head; None where there is no such symmetry
    reversal: float | None

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Angles (S, n) and their first and second derivatives by u, for ascending u (S,)."""
        ...


#: progress to which the two chains of a transit are brought together; what is left is corrected to second order
CLOSE = 1e-11


@njit(cache=True)
def _progress_at(target: float, low: float, high: float, chain: Chain) -> float:
    """Progress in [low, high] at which the extent, which grows, is ``target``: Newton inside a shrinking bracket."""
    at = scratch_of(chain)
    s = 0.5 * (low + high)
    for _ in range(200):
        e, e1, _, _ = body_at(s, chain, at)
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


@lean
def _ahead(u: float, before: Array, last: Array) -> float:
    """s at u, from u, s, s' and s'' at one or two places before (kernel): the quintic through both, where the second
    is not much nearer to u than to the first; else a parabola."""
    h, k = u - last[0], last[0] - before[0]
    if not 0.0 < h <= 2.0 * k:  # also where there is only one (nan)
        return float(last[1] + h * (last[2] + 0.5 * h * last[3]))
    # Taylor's terms from the last place; third to fifth order meet the place before
    d0 = (before[1] - (last[1] - k * (last[2] - 0.5 * k * last[3]))) / (k * k * k)
    d1 = (before[2] - (last[2] - k * last[3])) / (k * k)
    d2 = (before[3] - last[3]) / k
    # -c3 + c4 - c5 = d0, 3 c3 - 4 c4 + 5 c5 = d1, -6 c3 + 12 c4 - 20 c5 = d2 with c in units of k
    c3 = -10.0 * d0 - 4.0 * d1 - 0.5 * d2
    c4 = -15.0 * d0 - 7.0 * d1 - d2
    c5 = -6.0 * d0 - 3.0 * d1 - 0.5 * d2
    x = h / k
    return float(last[1] + h * (last[2] + 0.5 * h * last[3]) + k * k * k * x**3 * (c3 + x * (c4 + x * c5)))


@njit(cache=True)
def _sweep(
    u: Array,
    launch_end: float,
    landing_start: float,
    s_launch: float,
    r_landing: float,
    total: float,
    target: float,
    sign: float,
    front: Chain,
    back: Chain,
    out: tuple[Array, Array, Array, Array],
) -> None:
    """:func:`_along` with room of its own (kernel)."""
    a, b = scratch_of(front), scratch_of(back)
    before, last = np.full(4, np.nan), np.full(4, np.nan)
    launch = launch_end, landing_start, s_launch, r_landing, total, target, sign
    _along(u, launch, front, back, a, b, before, last, out)


@lean
def _along(
    u: Array,
    launch: tuple[float, float, float, float, float, float, float],
    front: Chain,
    back: Chain,
    a: Scratch,
    b: Scratch,
    before: Array,
    last: Array,
    out: tuple[Array, Array, Array, Array],
) -> None:
    """Angles and derivatives of the sweep at ascending u, and s and r (kernel). ``before`` and ``last``: u, s, s', s''
    at the places before, nan if there are none.

    In transit s is a root of gain(s) + gain(s - u) = target, found by Newton in a bracket that shrinks, from a
    prediction by the places before it. The bodies of its last evaluation are the result.
    """
    launch_end, landing_start, s_launch, r_landing, total, target, sign = launch
    angles, first, second, progress = out
    n = front.lengths.size
    for i in range(u.size):
        moving = launch_end < u[i] < landing_start
        slip = 0.0
        if not moving:
            s = u[i] + total if u[i] <= launch_end else total
            s = min(max(s, 0.0), total)
            r = min(max(s - u[i], 0.0), total)
            if s != a.progress[0]:
                body_at(s, front, a)
            if r != b.progress[0]:
                body_at(r, back, b)
            s1, s2 = 1.0 if u[i] < landing_start else 0.0, 0.0
        else:
            low, high = max(s_launch, u[i] + r_landing), min(total, u[i] + total)
            s = _ahead(u[i], before, last)
            if not low < s < high:
                s = 0.5 * (low + high)
            for _ in range(200):
                e, a1, a2, _ = body_at(s, front, a)
                f, b1, b2, _ = body_at(s - u[i], back, b)
                miss, slope = e + f - target, a1 + b1
                if miss < 0.0:
                    low = s
                else:
                    high = s
                slip = -miss / slope if slope > 0.0 else low - s
                # a miss of rounding is none: where the gains stand still, s cannot be told better
                if abs(slip) <= CLOSE or abs(miss) <= 4e-16 * target or high - low <= 1e-15:
                    break
                following = s + slip
                if not low < following < high:
                    following = 0.5 * (low + high)
                if following == s:
                    break
                s = following
            if slope <= 0.0 or abs(slip) > CLOSE:
                slip = 0.0
            # gain'(s) s' + gain'(r) r' = 0 with s' - r' = 1
            s1, s2 = (b1 / slope, 0.0) if slope > 0.0 else (0.5, 0.0)
            both = slope if slope > 0.0 else 1.0
            s2 = (b2 * (s1 - 1.0) * a1 - b1 * a2 * s1) / both**2
            r = s - u[i]
            for k in range(4):
                before[k] = last[k]
            last[0], last[1], last[2], last[3] = u[i], s + slip, s1, s2
        r1 = s1 - 1.0
        progress[i, 0], progress[i, 1] = s + slip, r + slip
        for j in range(n):
            k = n - 1 - j
            a1j, a2j, b1j, b2j = a.rates[0, j], a.rates[1, j], sign * b.rates[0, k], sign * b.rates[1, k]
            angles[i, j] = a.angles[j] + sign * b.angles[k] + slip * (a1j + b1j)
            first[i, j] = (a1j + slip * a2j) * s1 + (b1j + slip * b2j) * r1
            second[i, j] = a2j * s1 * s1 + b2j * r1 * r1 + (a1j + b1j) * s2


class ExtensionSweep:
    """The sweep of the module docstring. ``front`` is the body, ``back`` the same with its links in reverse order,
    ``extension`` = D/G in (0, 1], ``sign`` +1 for even N_B; -1 for odd, whose contracted curve is its own mirror
    image (x -> -x) instead of its own point reflection.

    Raises InputError when extension < 1 and the stretching does not lengthen the body all the way.
    """

    def __init__(self, front: StretchingBody, back: StretchingBody, extension: float, sign: float = 1.0) -> None:
        self.front, self.back, self.sign = front, back, sign
        same = np.array_equal(front.lengths, back.lengths) and front.lead == back.lead
        self.reversal: float | None = sign if same else None
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
        return float(_progress_at(extent, 0.0, self.total, body.chain))

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
        both = self._at(u)[3]
        return both[:, 0], both[:, 1]

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Angles (S, n) and their first and second derivatives by u, for ascending u (S,) in [-T, T]."""
        return self._at(u)[:3]

    def _at(self, u: Array) -> tuple[Array, Array, Array, Array]:
        u = np.ascontiguousarray(u, dtype=np.float64)
        angles, first, second = np.empty((3, u.size, len(self.front.lengths)))
        progress = np.empty((u.size, 2))
        _sweep(
            u,
            self.launch_end,
            self.landing_start,
            self.s_launch,
            self.r_landing,
            self.total,
            self.target,
            self.sign,
            self.front.chain,
            self.back.chain,
            (angles, first, second, progress),
        )
        return angles, first, second, progress


class LiteralSweep:
    """Stretching, then section IV.B as printed: gamma back to 0 head first, the tail multiplier last. With y = 0
    upstream the body stays flat until the tail's stage, then everything folds at once (correction 6)."""

    def __init__(self, front: StretchingBody, contraction: StretchingBody) -> None:
        self.front, self.contraction = front, contraction
        self.total = front.stages.total
        self.launch_end = self.landing_start = 0.0
        self.reversal: float | None = None
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
