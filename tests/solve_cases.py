"""Velocity equations by another road: P and Q from complex steps, G and H by selecting their rows and columns."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import bodyplan as bp
from bodyplan.spatial import matrix_from_quaternion
from robot_cases import STEP, body_twist, frame_matrices, random_robot, reference_jacobians

PARTS = ("vx", "vy", "vz", "wx", "wy", "wz")
COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
LEGS = ("fl", "fr", "hl", "hr")


def random_base(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Poses anywhere, with any attitude."""
    turn = rng.normal(size=(*shape, 4))
    return np.concatenate([rng.normal(size=(*shape, 3)), turn / np.linalg.norm(turn, axis=-1, keepdims=True)], axis=-1)


def coordinate_matrix(c: np.ndarray) -> np.ndarray:
    """Complex 4x4 pose of x, y, z, roll, pitch, yaw."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(c[3:]), np.cos(c[3:])
    one, zero = 1.0, 0.0
    Rz = np.array([[cy, -sy, zero], [sy, cy, zero], [zero, zero, one]])
    Ry = np.array([[cp, zero, sp], [zero, one, zero], [-sp, zero, cp]])
    Rx = np.array([[one, zero, zero], [zero, cr, -sr], [zero, sr, cr]])
    T = np.eye(4, dtype=complex)
    T[:3, :3], T[:3, 3] = Rz @ Ry @ Rx, c[:3]
    return T


class Reference(NamedTuple):
    """P, Q (6m, ...) of the ends of all chains, in the axes and for the body asked for, and the names of rows and
    columns."""

    P: np.ndarray
    Q: np.ndarray
    feet: list[str]
    body: list[str]
    joints: list[str]

    def split(self, known: list[str]) -> tuple[np.ndarray, np.ndarray, list[str], list[str]]:
        """G, H and the names of X and Y, of correction 4 of the notes."""
        full = {"joint": self.Q, "foot": -np.eye(len(self.feet)), "body": self.P}
        names = {"joint": self.joints, "foot": self.feet, "body": self.body}
        X = [(k, i) for k in ("joint", "foot", "body") for i, n in enumerate(names[k]) if n not in known]
        Y = [(k, i) for k in ("foot", "body", "joint") for i, n in enumerate(names[k]) if n in known]
        G, H = (np.stack([s * full[k][:, i] for k, i in side], axis=1) for side, s in ((X, 1.0), (Y, -1.0)))
        return G, H, [names[k][i] for k, i in X], [names[k][i] for k, i in Y]


def reference(robot: bp.Robot, q: np.ndarray, base: np.ndarray, axes: str, body: str) -> Reference:
    frames, jacobians = frame_matrices(robot, q), reference_jacobians(robot, q)
    ends = [robot.frames[end] for end in robot.ends]
    R0 = matrix_from_quaternion(base[3:])
    P, Q = [], []
    for end in ends:
        T = frames[end].real
        carry = np.array([body_twist(T, twist_matrix(xi) @ T) for xi in np.eye(6)]).T
        R = R0 @ T[:3, :3] if axes == "world" else np.eye(3)
        turn = np.kron(np.eye(2), R)
        P.append(turn @ carry)
        Q.append(turn @ jacobians[end])
    J = np.eye(6)
    if body == "world":
        J = np.kron(np.eye(2), R0.T)
    if body == "coordinates":
        c = bp.solve.coordinates_from_pose(base)
        moved = [coordinate_matrix(c + 1j * STEP * e).imag / STEP for e in np.eye(6)]
        J = np.array([body_twist(coordinate_matrix(c).real, dT) for dT in moved]).T
    # a frame that has the name of a chain's foot without being its end would be another foot: not in these robots
    feet = [f"{chain.name}.foot.{part}" for chain in robot.chains for part in PARTS]
    parts = COORDINATES if body == "coordinates" else PARTS
    return Reference(np.vstack(P) @ J, np.vstack(Q), feet, [f"body.{p}" for p in parts], list(robot.joints))


def twist_matrix(xi: np.ndarray) -> np.ndarray:
    x, y, z = xi[3:]
    return np.array([[0, -z, y, xi[0]], [z, 0, -x, xi[1]], [-y, x, 0, xi[2]], [0, 0, 0, 0]])


class Case(NamedTuple):
    robot: bp.Robot
    q: np.ndarray
    base: np.ndarray
    known: list[str]
    axes: str
    body: str
    want: Reference

    def partition(self) -> Any:
        at = bp.solve.model(self.robot, self.q, self.base)
        return bp.solve.partition(at, known=self.known, axes=self.axes, body=self.body)


def random_case(seed: int) -> Case:
    """Robots of 3-6 chains of 3-7 elements, sliding joints among them, and any known rates."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, int(rng.integers(3, 7)), variable=rng.uniform(0.2, 0.6), share=0.1)
    q, base = rng.uniform(-2.0, 2.0, robot.n), random_base(rng)
    axes, body = str(rng.choice(["own", "world"])), str(rng.choice(["twist", "world", "coordinates"]))
    want = reference(robot, q, base, axes, body)
    share = rng.uniform(0.1, 0.7)
    every = [*want.feet, *want.body, *want.joints]
    known = [name for name in every if rng.random() < (share if ".foot." in name else 0.3)]
    known = known or [every[0]]
    return Case(robot, q, base, list(rng.permutation(known)), axes, body, want)


def crouching(robot: bp.Robot, rng: np.random.Generator | None = None, spread: float = 0.2) -> np.ndarray:
    """Joint coordinates of a walker standing with bent knees, a little at random."""
    values = {"knee": np.radians(-120.0)}
    q = np.array([values.get(name.split(".")[-1], 0.0) for name in robot.joints])
    return q if rng is None else q + rng.uniform(-spread, spread, robot.n)
