"""Kernel of a swinging foot: where it is and how it moves, for any number of swings at once."""

from __future__ import annotations

from numba import njit

from bodyplan.arrays import Array

#: how long a step up that rises early waits before it goes along, as a share of what it is early by
WAIT = 0.6


@njit(cache=True, nogil=True)
def swing(start: Array, end: Array, lift: Array, early: Array, tau: Array, out: Array) -> None:
    """Place, velocity and acceleration ``out`` (n, 3, 3) of feet at ``tau`` (n,) of their ways from ``start`` to
    ``end`` (n, 3), as :func:`bodyplan.gaits.crawl.steps.swing_path` says."""
    for k in range(len(tau)):
        t = tau[k]
        wait = WAIT * (1.0 - early[k])
        up = end[k, 2] >= start[k, 2]
        along = _within(t, wait, 1.0) if up else _within(t, 0.0, 1.0 - wait)
        climb = _within(t, 0.0, early[k]) if up else _within(t, 1.0 - early[k], 1.0)
        part, slope = t * (1.0 - t), 1.0 - 2.0 * t
        hump = lift[k] * 64.0 * part * part * part
        for i in range(3):
            way, window = end[k, i] - start[k, i], along if i < 2 else climb
            high = hump if i == 2 else 0.0
            # told from the nearer end, so that feet are exactly there
            out[k, 0, i] = end[k, i] - (way * window[1] - high) if t > 0.5 else start[k, i] + (way * window[0] + high)
            out[k, 1, i] = way * window[2]
            out[k, 2, i] = way * window[3]
        out[k, 1, 2] += lift[k] * 192.0 * part * part * slope
        out[k, 2, 2] += lift[k] * 384.0 * part * (slope * slope - part)


@njit(cache=True, nogil=True)
def _within(tau: float, first: float, last: float) -> tuple[float, float, float, float]:
    """The quintic of :func:`bodyplan.gaits.crawl.steps.blend` from ``first`` to ``last``, 1 less it, and its
    derivatives by tau."""
    span = last - first
    done = min(max((tau - first) / span, 0.0), 1.0)
    rest = min(max((last - tau) / span, 0.0), 1.0)
    rate = 30.0 * done * done * (1.0 - done) * (1.0 - done)
    gain = 60.0 * done * (1.0 - done) * (1.0 - 2.0 * done)
    return _blend(done), _blend(rest), rate / span, gain / (span * span)


@njit(cache=True, nogil=True)
def _blend(t: float) -> float:
    return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
