"""Contacts of wheels on rough ground: certified, in a batch, against loops of scipy.optimize.root on the same
equations.

Both peers solve eqs. (12) and (14) of paper *wheels* for one pose of three wheels; neither proves that the contact is
the nearest one, nor notices a mirror image. "6 unknowns" is the paper's own system (15) with its homogeneous
transforms, "2 unknowns" one wheel at a time with the surface written out in plain Python and an exact Jacobian: what a
careful user would write.

python benchmarks/bench_contacts.py
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import root

import bodyplan as bp
from _bench import compare, header
from bodyplan.gaits.carry import pose

BATCH, FEW = 50_000, 20
ROBOT, GROUND = bp.tri_wheel(), bp.Surface("sin(0.5*(x+y))/15")
RIPPLES = bp.Surface("0.03*sin(20*x)*cos(17*y)")
LINK, RUBBER = 0.3 * math.cos(math.pi / 6), 0.02
MOUNTS = np.array([[0.6, 0.6, 0.0], [0.6, -0.6, 0.0], [-0.6, 0.0, 0.0]])


def by_transforms(xy: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Angles q (n, 3) by the paper's system of six equations, Jacobian by differences."""
    out = np.empty((len(xy), 3))
    for k in range(len(xy)):
        base = np.eye(4)
        base[:2, :2] = [[np.cos(psi[k]), -np.sin(psi[k])], [np.sin(psi[k]), np.cos(psi[k])]]
        base[:3, 3] = [*xy[k], 0.15]

        def system(unknown: np.ndarray, base: np.ndarray = base) -> np.ndarray:
            rows = []
            for mount, beta, q in zip(MOUNTS, unknown[:3], unknown[3:], strict=True):
                T1, T2, T3, T4 = np.eye(4), np.eye(4), np.eye(4), np.eye(4)
                T1[:3, 3] = mount
                T2[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
                T3[:2, :2] = [[np.cos(beta), -np.sin(beta)], [np.sin(beta), np.cos(beta)]]
                T4[1, 3] = -(LINK * np.cos(q / 2) + RUBBER)
                T = base @ T1 @ T2 @ T3 @ T4
                x, y, z = T[:3, 3]
                slope = np.cos(0.5 * (x + y)) / 30
                rows.append((z - np.sin(0.5 * (x + y)) / 15, (T[:3, :3].T @ np.array([-slope, -slope, 1.0]))[0]))
            return np.array([h for h, _ in rows] + [t for _, t in rows])

        out[k] = root(system, [0.0, 0.0, 0.0, 2.0, 2.0, 2.0], tol=1e-13).x[3:]
    return out


def by_wheel(xy: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Angles q (n, 3), wheel by wheel in plain Python."""
    out = np.empty((len(xy), 3))
    for k in range(len(xy)):
        c, s = math.cos(psi[k]), math.sin(psi[k])
        for w, (mx, my, _) in enumerate(MOUNTS.tolist()):
            cx, cy = xy[k, 0] + c * mx - s * my, xy[k, 1] + s * mx + c * my

            def system(unknown: np.ndarray, cx: float = cx, cy: float = cy, c: float = c, s: float = s) -> tuple:
                phi, R = unknown
                sine, cosine = math.sin(phi), math.cos(phi)
                x, y = cx + R * sine * c, cy + R * sine * s
                a = 0.5 * (x + y)
                f, g, b = math.sin(a) / 15, (c + s) * math.cos(a) / 30, -((c + s) ** 2) * math.sin(a) / 60
                h, t = 0.15 - R * cosine - f, sine - g * cosine
                jacobian = [
                    [R * sine - g * R * cosine, -cosine - g * sine],
                    [cosine + g * sine - b * R * cosine * cosine, -b * sine * cosine],
                ]
                return np.array([h, t]), np.array(jacobian)

            R = root(system, [0.0, 0.15], jac=True, tol=1e-13).x[1]
            out[k, w] = 2.0 * math.acos((R - RUBBER) / LINK)
    return out


def main() -> None:
    rng = np.random.default_rng(0)
    xy, psi = rng.uniform(-3, 3, (BATCH, 2)), rng.uniform(-np.pi, np.pi, BATCH)
    few = xy[:FEW], psi[:FEW]
    ours = pose(ROBOT, GROUND, few[0], 0.15, heading=few[1])
    q = np.stack([wheel.q for wheel in ours], axis=1)
    error = max(np.abs(peer(*few) - q).max() for peer in (by_transforms, by_wheel))
    header(f"contacts of three wheels, certified; all agree to {error:.1e} rad")
    compare(
        {
            f"bodyplan, batch of {BATCH} poses": (lambda: pose(ROBOT, GROUND, xy, 0.15, heading=psi), 3 * BATCH),
            "bodyplan, batch of 1000 poses": (lambda: pose(ROBOT, GROUND, xy[:1000], 0.15, heading=psi[:1000]), 3000),
            "bodyplan, one pose a call": (lambda: pose(ROBOT, GROUND, xy[0], 0.15, heading=psi[0]), 3),
            "bodyplan, tight ripples, batch of 1000": (
                lambda: pose(ROBOT, RIPPLES, xy[:1000], 0.15, heading=psi[:1000]),
                3000,
            ),
            "scipy.optimize.root, 6 unknowns, loop": (lambda: by_transforms(*few), 3 * FEW),
            "scipy.optimize.root, 2 unknowns, loop": (lambda: by_wheel(*few), 3 * FEW),
        },
        unit="contact",
        against="scipy.optimize.root, 6 unknowns, loop",
        rounds=7,
    )
    header("a whole mission: 501 poses of the paper's circle, planned and checked")
    t, carry = bp.times(0, 5, dt=0.01), bp.Carry(("sin(t)", "cos(t)"))
    motion = bp.plan(ROBOT, carry, GROUND, t)
    compare(
        {
            "plan: contacts, rates, accelerations, spins, forces": (lambda: bp.plan(ROBOT, carry, GROUND, t), 1),
            "check: 512 points of each rim, rolling, hull, forces": (lambda: bp.check(motion), 1),
        },
        unit="mission",
        against="check: 512 points of each rim, rolling, hull, forces",
        rounds=7,
    )


if __name__ == "__main__":
    main()
