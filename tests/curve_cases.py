"""Body curves of every kind, and what they should do by other means."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import quad, solve_ivp

from bodyplan import curves as bc

_PIECES = [
    {"kind": "line", "length": 0.2, "twist": 2.0},
    {"kind": "arc", "radius": 0.1, "angle": -1.3, "direction": 0.3, "twist": -1.0},
    {"kind": "helix", "radius": 0.05, "pitch": 0.03, "turns": 0.8, "direction": 1.0, "twist": 0.7},
    (0.3, 1.0, 2.0, 3.0),
    bc.Helix(curvature=3.0, torsion=-5.0, length=0.3),
]
_POINTS = np.array(
    [[0, 0, 0], [0.2, 0.05, 0.02], [0.35, 0.2, 0.05], [0.5, 0.22, 0.2], [0.7, 0.1, 0.3], [0.9, 0.1, 0.25]]
)

SEGMENTS = bc.Segments(_PIECES)
SAMPLED = bc.Sampled(_POINTS)
CURVES: dict[str, bc.BodyCurve] = {
    "serpenoid": bc.Serpenoid(np.pi / 3),
    "serpenoid pitch": bc.Serpenoid(1.9, 0.7, 1.2, phase=0.4, plane="pitch"),
    "spiral": bc.Spiral(),
    "spiral phase": bc.Spiral(5.0, -7.0, 0.8, phase=0.9),
    "spiral without twist": bc.Spiral(5.0, 0.0, phase=2.0),
    "sinus-lift": bc.SinusLift(1.3, 0.3, 0.8, phase=0.3),
    "sinus-lift paper": bc.SinusLift(1.0, 0.2, c1="paper"),
    "constant": bc.Constant(1.5, -2.0, 3.0),
    "segments": SEGMENTS,
    "sampled": SAMPLED,
    "sum": bc.Serpenoid(0.7) + bc.Serpenoid(0.4, 0.5, plane="pitch") + bc.Constant(2.0, 0.1, 0.5),
    "sum of pieces": SEGMENTS + SAMPLED,
    "untwisted": (bc.Serpenoid(0.8) + bc.Constant(3.0)).untwisted(),
    "untwisted segments": SEGMENTS.untwisted(),
    "transition": bc.Transition(bc.Serpenoid(1.0), bc.SinusLift(1.3, 0.3) + bc.Constant(0.5), 0.3, 0.7),
    "transition of pieces": bc.Transition(SEGMENTS, SAMPLED, 0.25, 0.4),
    "steering": bc.Steering([0.1, 0.4, 1.2], [1.0, -2.0, 0.5], 0.5, initial=0.3),
    "steered": bc.Spiral(3.0, 2.0) + bc.Steering([0.2], [1.0], 0.5),
}


def stops(curve: bc.BodyCurve, a: float, b: float) -> list[float]:
    """a, the breaks between, b."""
    return [a, *(float(x) for x in curve.breaks if a < x < b), b]


def integrated(curve: bc.BodyCurve, a: float, b: float) -> np.ndarray:
    """Integrals (3,) of the shape functions from a to b > a by scipy.integrate.quad."""
    total = np.zeros(3)
    for low, high in pairwise(stops(curve, a, b)):
        for k in range(3):
            # several pieces: quad's estimate of its error stops at 1e-14 or so
            for x, y in pairwise(np.linspace(low, high, 5)):
                total[k] += quad(lambda s, k=k: float(curve.shape(s)[k]), x, y, epsabs=1e-14, epsrel=1e-11)[0]
    return total


def followed(curve: bc.BodyCurve, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Point (3,) and rotation (3, 3) at s = ``end`` from the identity at s = 0: eq. (1) by DOP853, row by row."""

    def rates(s: float, y: np.ndarray, low: float, high: float) -> np.ndarray:
        # within the piece: at a jump one of two values counts
        inside = min(max(s, np.nextafter(low, high)), np.nextafter(high, low))
        tau, kappa_p, kappa_y = (float(v) for v in curve.shape(inside))
        e_r, e_p, e_y = y[3:6], y[6:9], y[9:12]
        return np.concatenate(
            [e_r, kappa_y * e_p - kappa_p * e_y, -kappa_y * e_r + tau * e_y, kappa_p * e_r - tau * e_p]
        )

    y = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    places = stops(curve, min(0.0, end), max(0.0, end))
    for a, b in pairwise(places if end > 0.0 else places[::-1]):
        y = solve_ivp(rates, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-13, args=(min(a, b), max(a, b))).y[:, -1]
    return y[:3], y[3:].reshape(3, 3).T
