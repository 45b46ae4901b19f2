"""Fits of a body curve: bodyplan against a loop of scipy.optimize.least_squares.

    python benchmarks/bench_fits.py

A travelling wave laid on ten two-axis arcs. The loop minimises, for one place of the wave after the other, the gaps
between curve and mechanism at 41 places of the body (NumPy forward kinematics, SciPy's own differences, from the
angles of the place before). It is what one writes without a rule; its E_nm is printed beside those of bodyplan.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

import bodyplan as bp
from _bench import compare, header

N, STARTS, LOOP, SAMPLES = 10, 1000, 4, 41
CURVE = bp.Spiral()
ROBOT = bp.snake(N, 1.0 / N, "arc", axes="universal")
PLACES = np.linspace(0.0, 1.0, STARTS)
S = np.linspace(0.0, 1.0, SAMPLES)


def rotation(pitch: float, yaw: float) -> np.ndarray:
    """exp of (0, pitch, yaw)."""
    x = np.hypot(pitch, yaw)
    skew = np.array([[0.0, -yaw, pitch], [yaw, 0.0, 0.0], [-pitch, 0.0, 0.0]])
    a, b = np.sinc(x / np.pi), 0.5 * np.sinc(0.5 * x / np.pi) ** 2
    return np.eye(3) + a * skew + b * skew @ skew


def body(x: np.ndarray, samples: int = SAMPLES) -> np.ndarray:
    """Points at ``samples`` even places of the arcs with the bends x[:-2] (pitch, yaw a unit) and the kink x[-2:]."""
    R, at, out = rotation(x[-2], x[-1]), np.zeros(3), np.empty((samples, 3))
    for i in range(N):
        pitch, yaw = x[2 * i], x[2 * i + 1]
        low = i * (samples - 1) // N
        u = np.arange(1, (samples - 1) // N + 1) * N / (samples - 1)
        angle = u * np.hypot(pitch, yaw)
        a, b = np.sinc(angle / np.pi), 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
        inner = (u / N)[:, None] * np.stack([a, b * u * yaw, -b * u * pitch], axis=-1)
        out[low] = at
        out[low + 1 : low + 1 + len(u)] = at + inner @ R.T
        at, R = out[low + len(u)], R @ rotation(pitch, yaw)
    return out


def loop(places: np.ndarray) -> np.ndarray:
    """Bends (T, 2 N + 2) by least squares, from a straight body on."""
    x, out = np.zeros(2 * N + 2), []
    for start in places:
        points, turns = CURVE.frames(start + S)
        goal = (points - points[0]) @ turns[0]
        x = least_squares(lambda y, goal=goal: (body(y) - goal).ravel(), x).x
        out.append(x)
    return np.array(out)


def mean_distance(bends: np.ndarray, start: float) -> float:
    """E_nm of eq. (6) by the trapezoid rule on fine samples: to three digits."""
    fine = 2001
    points, turns = CURVE.frames(start + np.linspace(0.0, 1.0, fine))
    return float(np.trapezoid(np.linalg.norm(body(bends, fine) - (points - points[0]) @ turns[0], axis=1)) / (fine - 1))


def main() -> None:
    header(f"Fits of a wave to {N} arcs with two axes")
    few = PLACES[:LOOP]
    errors = [mean_distance(x, s) for x, s in zip(loop(few), few, strict=True)]
    rule, best = bp.fit(CURVE, ROBOT), bp.fit(CURVE, ROBOT, "optimal")
    print(f"  E_nm: rule {rule.error:.3e}, optimal {best.error:.3e}, loop {np.mean(errors):.3e}")
    name = f"least_squares, {LOOP} fits in a loop"
    compare(
        {
            f"rule, {STARTS} fits": (lambda: bp.fit(CURVE, ROBOT, start=PLACES), STARTS),
            f"rule with E_nm, {STARTS} fits": (lambda: bp.fit(CURVE, ROBOT, start=PLACES).error, STARTS),
            "rule with E_nm, one fit": (lambda: bp.fit(CURVE, ROBOT).error, 1),
            "optimal, 4 fits": (lambda: bp.fit(CURVE, ROBOT, "optimal", start=few), LOOP),
            name: (lambda: loop(few), LOOP),
        },
        unit="fit",
        against=name,
        rounds=9,
    )


if __name__ == "__main__":
    main()
