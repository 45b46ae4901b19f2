"""Random robots, and their kinematics by another road: products of 4x4 matrices with complex-step derivatives.

Nothing here uses the library's formulas: rows are products of four elementary matrices, an arc is the matrix
exponential of its constant screw, and derivatives are imaginary parts, exact to rounding.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.linalg import expm

from bodyplan.robot import Arc, Joint, Robot, Row, WheelRadius

STEP = 1e-30


def random_robot(rng: np.random.Generator, chains: int, variable: float = 0.4, share: float = 0.0) -> Robot:
    """Chains of 3-7 elements, about one in five an arc; a variable is driven with probability ``variable``, by a
    joint met before with probability ``share``. A later chain hangs on a frame of an earlier one at times."""
    known: dict[str, list[str]] = {"angle": [], "length": []}
    frames: list[str] = ["base"]
    rows: dict[str, list[Row | Arc]] = {}
    parents: dict[str, str] = {}

    def value(kind: str) -> Any:
        if rng.random() >= variable:
            plain = rng.uniform(-3, 3) if kind == "angle" else rng.uniform(-0.4, 0.4)
            return 0.0 if rng.random() < 0.3 else plain
        if kind == "length" and rng.random() < 0.15:
            name = f"w{len(known['angle'])}"
            known["angle"].append(name)
            return WheelRadius(Joint(name), rng.uniform(0.1, 0.3), rng.uniform(0.0, 0.05))
        if known[kind] and rng.random() < share:
            name = str(rng.choice(known[kind]))
        else:
            name = f"{kind[0]}{len(known[kind])}"
            known[kind].append(name)
        scale = 1.0 if rng.random() < 0.5 else rng.uniform(0.3, 2.0) * rng.choice([-1.0, 1.0])
        return Joint(name, offset=rng.uniform(-1, 1), scale=scale)

    for c in range(chains):
        name = f"chain{c}"
        parents[name] = str(rng.choice(frames)) if rng.random() < 0.4 else "base"
        rows[name] = []
        for i in range(rng.integers(3, 8)):
            if rng.random() < 0.2:
                rows[name].append(Arc(rng.uniform(0.05, 0.5), pitch=value("angle"), yaw=value("angle")))
            else:
                rows[name].append(
                    Row(theta=value("angle"), d=value("length"), a=value("length"), epsilon=value("angle"))
                )
            frames.append(f"{name}.{i + 1}")
    if not known["angle"] and not known["length"]:
        rows["chain0"][0] = Row(theta=Joint("a0"))
    return Robot.from_rows(rows, parents=parents)


def _rotation(axis: int, angle: complex) -> np.ndarray:
    T = np.eye(4, dtype=complex)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    T[i, i] = T[j, j] = np.cos(angle)
    T[j, i], T[i, j] = np.sin(angle), -np.sin(angle)
    return T


def _translation(axis: int, length: complex) -> np.ndarray:
    T = np.eye(4, dtype=complex)
    T[axis, 3] = length
    return T


def screw(xi: np.ndarray) -> np.ndarray:
    """4x4 generator of a twist (v, omega), complex."""
    x, y, z = xi[3:]
    G = np.zeros((4, 4), dtype=complex)
    G[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    G[:3, 3] = xi[:3]
    return G


def element_matrix(element: Row | Arc, q: dict[str, complex]) -> np.ndarray:
    """T of one element at joint values ``q``."""

    def value(v: Any) -> complex:
        if isinstance(v, WheelRadius):
            return v.link * np.cos(q[v.joint.name] / 2) * math.cos(math.radians(30)) + v.rubber
        return v.offset + v.scale * q[v.name] if isinstance(v, Joint) else v

    if isinstance(element, Arc):
        return expm(screw(np.array([element.length, 0, 0, 0, value(element.pitch), value(element.yaw)])))
    theta, d, a, epsilon = (value(getattr(element, f)) for f in ("theta", "d", "a", "epsilon"))
    return _rotation(2, theta) @ _translation(2, d) @ _translation(0, a) @ _rotation(0, epsilon)


def frame_matrices(robot: Robot, q: np.ndarray) -> dict[str, np.ndarray]:
    """T (complex 4x4) of every frame seen from the base."""
    joints = dict(zip(robot.joints, q, strict=True))
    out = {"base": np.eye(4, dtype=complex)}
    for chain in robot.chains:
        T = out[chain.parent]
        for i, element in enumerate(chain.elements):
            T = T @ element_matrix(element, joints)
            out[chain.frame_name(i)] = T
    return out


def body_twist(T: np.ndarray, dT: np.ndarray) -> np.ndarray:
    """(v, omega) of T^-1 dT."""
    G = np.linalg.inv(T) @ dT
    return np.array([*G[:3, 3], G[2, 1], G[0, 2], G[1, 0]])


def reference_jacobians(robot: Robot, q: np.ndarray) -> dict[str, np.ndarray]:
    """Body-fixed Jacobian (6, n) of every frame by complex steps."""
    at = {name: T.real for name, T in frame_matrices(robot, q).items()}
    out = {name: np.zeros((6, robot.n)) for name in at}
    for k in range(robot.n):
        moved = frame_matrices(robot, q + 1j * STEP * np.eye(robot.n)[k])
        for name, T in moved.items():
            out[name][:, k] = body_twist(at[name], T.imag / STEP)
    return out
