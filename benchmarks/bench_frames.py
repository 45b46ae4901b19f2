"""Frames along a curve: bodyplan against scipy.integrate.solve_ivp at equal error.

    python benchmarks/bench_frames.py

The curve is a serpenoid with torsion, 101 stations. solve_ivp (DOP853, a dense right-hand side of 12 numbers)
gets the tolerance at which its error meets that of bodyplan; both errors are measured against a reference of
much smaller tolerance and printed.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from _bench import compare, header
from bodyplan import curves as bc
from bodyplan.spatial import GAUSS_NODES, NodeSampling, curve_frames, frames_from_nodes

LENGTH, STATIONS, CURVES = 5.0, 101, 1000
S = np.linspace(0.0, LENGTH, STATIONS)
STEPS = np.full(STATIONS - 1, LENGTH / (STATIONS - 1))
PLACES = (np.arange(STATIONS - 1)[:, None] + np.array(GAUSS_NODES)) * STEPS[0]
# 16 places a metre instead of the 60 nodes of its 20 steps
SAMPLING = NodeSampling(STEPS, 1.0)


def shape(s: np.ndarray) -> np.ndarray:
    return np.stack([0.3 * np.cos(2 * s), 1.5 * np.sin(3 * s + 0.2), 2 * np.cos(s)], axis=-1)


def rates(s: float, y: np.ndarray) -> np.ndarray:
    R = y[3:].reshape(3, 3)
    tau, pitch, yaw = 0.3 * np.cos(2 * s), 1.5 * np.sin(3 * s + 0.2), 2 * np.cos(s)
    return np.concatenate([R[:, 0], (R @ np.array([[0, -yaw, pitch], [yaw, 0, -tau], [-pitch, tau, 0]])).ravel()])


def integrated(tolerance: float) -> np.ndarray:
    begin = np.concatenate([np.zeros(3), np.eye(3).ravel()])
    out = solve_ivp(rates, (0, LENGTH), begin, method="DOP853", rtol=tolerance, atol=tolerance, t_eval=S)
    return out.y[:3].T


def main() -> None:
    best = integrated(3e-14)

    def error(points: np.ndarray) -> float:
        return float(np.abs(points - best).max())

    fixed = error(frames_from_nodes(SAMPLING.nodes(shape(SAMPLING.places)), STEPS)[:, :3])
    every = error(frames_from_nodes(shape(PLACES), STEPS)[:, :3])
    adaptive = error(curve_frames(shape, S)[0])
    # the loosest tolerance (a third of a decade at a time) at which solve_ivp is as good
    tolerances = 10.0 ** -np.arange(6.0, 13.4, 1 / 3)
    errors = {tolerance: error(integrated(tolerance)) for tolerance in tolerances}
    match = next(t for t in tolerances if errors[t] <= fixed)
    tight = next((t for t in tolerances if errors[t] <= adaptive), tolerances[-1])
    header(f"Points and frames at {STATIONS} stations of a curve")
    print(f"  error of fixed steps {fixed:.1e}, with samples at every node {every:.1e}")
    print(f"  error of solve_ivp at tolerance {match:.1e}: {errors[match]:.1e}")
    print(f"  error of adaptive steps {adaptive:.1e}, of solve_ivp at tolerance {tight:.1e}: {errors[tight]:.1e}")

    u = np.broadcast_to(shape(PLACES), (CURVES, *PLACES.shape, 3)).copy()
    phases = np.linspace(0.0, 1.0, CURVES)[:, None]
    ivp = "solve_ivp, same error"
    compare(
        {
            f"bodyplan, {CURVES} curves": (
                lambda: frames_from_nodes(SAMPLING.nodes(shape(SAMPLING.places + phases)), STEPS),
                CURVES,
            ),
            f"bodyplan, {CURVES} curves, sampled at every node": (
                lambda: frames_from_nodes(shape(PLACES + phases[..., None]), STEPS),
                CURVES,
            ),
            f"bodyplan, {CURVES} curves, shapes given": (lambda: frames_from_nodes(u, STEPS), CURVES),
            "bodyplan, one curve": (lambda: frames_from_nodes(shape(PLACES), STEPS), 1),
            ivp: (lambda: integrated(match), 1),
        },
        unit="curve",
        against=ivp,
    )
    print("  with error control:")
    ivp = "solve_ivp, same error or its best"
    compare(
        {"bodyplan, adaptive": (lambda: curve_frames(shape, S), 1), ivp: (lambda: integrated(tight), 1)},
        unit="curve",
        against=ivp,
    )
    print("  frames of body curves (no table is kept between calls):")
    s = np.linspace(0.0, 1.0, STATIONS)
    wave = bc.Serpenoid(1.0)
    sampled = bc.Sampled(wave.frames(np.linspace(0.0, 1.0, 30))[0])
    bodies = {
        "serpenoid": wave,
        "serpenoid with torsion": wave + bc.Constant(2.0),
        "spiral": bc.Spiral(),
        "sampled": sampled,
    }
    compare(
        {name: (lambda curve=curve: curve.frames(s), 1) for name, curve in bodies.items()},
        unit="curve",
        against="serpenoid",
    )


if __name__ == "__main__":
    main()
