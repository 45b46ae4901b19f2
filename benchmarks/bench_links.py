"""Links on a curve: certified circles against a loop of scipy.optimize.brentq, same curve, same answers.

python benchmarks/bench_links.py
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

import bodyplan as bp
from _bench import compare, header
from bodyplan.curves.dynamic import crossing_of

LINKS, LENGTH, MODULES, BATCH = 26, 0.873938881878, 4, 10_000


def python_curve(gammas: np.ndarray, head: float):
    """The concertina curve as one would write it for brentq: scalar, closed form, rule "cut"."""
    pieces, value, x = [(0.0, 0.0, None)], 1.0, np.pi / 2
    flat = None
    for gamma in gammas:
        pieces.append((x, value, gamma))
        delta = np.sqrt(1 - gamma * gamma)
        end = np.exp(-gamma * np.pi) / delta * np.sin(delta * np.pi + np.arccos(gamma))
        if end >= 0:
            flat = x + crossing_of(gamma, 1.0, 1)
            break
        value, x = value * end, x + np.pi
    if flat is None:
        pieces.append((x, value, head))
        flat = x + crossing_of(head, 1.0, 2)
    table = [
        (start, v, g, 0.0 if g is None else np.sqrt(1 - g * g), 0.0 if g is None else np.arccos(g))
        for start, v, g in pieces
    ]
    exp, sin = np.exp, np.sin

    def y(x: float) -> float:
        if x >= flat:
            return 0.0
        for start, v, g, delta, theta in reversed(table):
            if x >= start:
                return (
                    float(sin(x))
                    if g is None
                    else float(v * exp(-g * (x - start)) / delta * sin(delta * (x - start) + theta))
                )
        return 0.0

    return y


def miss(s: float, x0: float, y0: float, y) -> float:
    return (s - x0) ** 2 + (y(s) - y0) ** 2 - LENGTH**2


def by_brentq(curves: list) -> np.ndarray:
    out = np.zeros((len(curves), LINKS + 1, 2))
    for k, y in enumerate(curves):
        x, here = 0.0, 0.0
        for i in range(LINKS):
            x0, y0 = x, here
            x = brentq(miss, x0, x0 + LENGTH * (1 + 1e-12), args=(x0, y0, y), xtol=1e-13)
            here = y(x)
            out[k, i + 1] = x, here
    return out


def main() -> None:
    rng = np.random.default_rng(0)
    gammas, heads = rng.uniform(0, 0.8, (BATCH, MODULES)), rng.uniform(0, 0.8, BATCH)
    few = 20
    slow = [python_curve(g, h) for g, h in zip(gammas[:few], heads[:few], strict=True)]
    error = np.abs(
        by_brentq(slow) - bp.links_on_curve(bp.ConcertinaCurve(gammas[:few], heads[:few]), LENGTH, LINKS).points
    ).max()
    header(f"{LINKS} links on concertina curves; the two agree to {error:.1e}")
    compare(
        {
            f"bodyplan, batch of {BATCH} curves (curves built too)": (
                lambda: bp.links_on_curve(bp.ConcertinaCurve(gammas, heads), LENGTH, LINKS),
                BATCH,
            ),
            "bodyplan, one curve a call": (
                lambda: bp.links_on_curve(bp.ConcertinaCurve(gammas[0], heads[0]), LENGTH, LINKS),
                1,
            ),
            "scipy.optimize.brentq, loop": (lambda: by_brentq(slow), few),
        },
        unit="fit",
        against="scipy.optimize.brentq, loop",
    )


if __name__ == "__main__":
    main()
