"""Bodies on contacts for the tests of statics, and what can be said of their forces without the solver."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

WHEELS = np.array([[0.6, 0.6, 0.0], [0.6, -0.6, 0.0], [-0.6, 0.0, 0.0]])
FLAT = np.tile([0.0, 0.0, 1.0], (3, 1))
UP = np.array([0.0, 0.0, 1.0])


def tilted(slope: float) -> np.ndarray:
    """The turn that makes level ground fall along x."""
    angle = np.arctan(slope)
    return np.array([[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]])


def on_slope(slope: float, height: float = 0.15) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three wheels on a plane that falls along x, with the weight between them."""
    turn = tilted(slope)
    points = WHEELS @ turn.T
    return points, FLAT @ turn.T, points.T @ [0.3, 0.2, 0.5] + height * UP


def rough(seed: int, k: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A body that stands well on ground that is not level."""
    rng = np.random.default_rng(seed)
    angle = np.arange(k) * 2.0 * np.pi / k + rng.uniform(-0.3, 0.3, k)
    points = np.stack([np.cos(angle), np.sin(angle), rng.uniform(-0.1, 0.1, k)], axis=1)
    normals = np.concatenate([rng.uniform(-0.3, 0.3, (k, 2)), np.ones((k, 1))], axis=1)
    return points, normals, np.array([*rng.uniform(-0.1, 0.1, 2), 0.3])


def cast(seed: int, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts anywhere, steep ones too; some of these bodies stand."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(k, 3)) * [1.0, 1.0, 0.3] * np.exp(rng.normal())
    normals = rng.normal(size=(k, 3)) * [0.5, 0.5, 0.2] + UP
    return points, normals, points.T @ rng.dirichlet(np.ones(k)) + rng.uniform(-0.2, 0.5) * UP


def unit(normals: np.ndarray) -> np.ndarray:
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def parts(forces: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normal size (..., k) and tangential part (..., k, 3) of each force."""
    normal = np.sum(forces * unit(normals), axis=-1)
    return normal, forces - normal[..., None] * unit(normals)


def excess(forces: np.ndarray, normals: np.ndarray, mu: float | np.ndarray) -> float:
    """How far forces are outside of their cones, N."""
    normal, tangent = parts(forces, normals)
    return float((np.linalg.norm(tangent, axis=-1) - mu * normal).max())


def left_over(points: np.ndarray, com: np.ndarray, forces: np.ndarray, weight: float) -> float:
    """Force and moment that are not balanced, over the size of what they add up from."""
    arms = points - com
    force = np.abs(forces.sum(axis=0) - weight * UP).max()
    moment = np.abs(np.cross(arms, forces).sum(axis=0)).max()
    return float(max(force, moment / np.linalg.norm(arms, axis=1).max()) / np.abs(forces).max())


def equations(points: np.ndarray, com: np.ndarray) -> np.ndarray:
    """(6, 3k): force and moment about com of unit forces."""
    blocks = [np.vstack([np.eye(3), np.cross(p - com, np.eye(3)).T]) for p in points]
    return np.concatenate(blocks, axis=1)


def outer(normals: np.ndarray, mu: float, ways: np.ndarray, edges: int = 24) -> np.ndarray:
    """Rows a with a . F <= 0 for all forces in the friction cones: planes that touch them, ``edges`` around each and
    those in the direction of tangential forces ``ways`` (k, 3)."""
    k, rows = len(normals), []
    for i, n in enumerate(unit(normals)):
        first, second = np.linalg.svd(n[None])[2][1:]
        around = np.linspace(0.0, 2.0 * np.pi, edges, endpoint=False)
        out = [np.cos(a) * first + np.sin(a) * second for a in around]
        length = np.linalg.norm(ways[i])
        if length > 0.0:
            out.append(ways[i] / length)
        for way in out:
            row = np.zeros((k, 3))
            row[i] = way - mu * n
            rows.append(row.ravel())
        row = np.zeros((k, 3))
        row[i] = -n
        rows.append(row.ravel())
    return np.array(rows)


def most(
    gain: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    com: np.ndarray,
    weight: float,
    mu: float,
    ways: np.ndarray,
) -> float:
    """The largest gain . F over forces in equilibrium and within planes that contain the friction cones: at least that
    of the cones. inf where it has no bound."""
    rows = outer(normals, mu, ways)
    answer = linprog(
        -gain.ravel(),
        A_ub=rows,
        b_ub=np.zeros(len(rows)),
        A_eq=equations(points, com),
        b_eq=[0.0, 0.0, weight, 0.0, 0.0, 0.0],
        bounds=(None, None),
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert answer.status in (0, 3), answer.message
    return float(-answer.fun) if answer.status == 0 else np.inf


def short(points: np.ndarray, normals: np.ndarray, com: np.ndarray, mu: float, ways: np.ndarray) -> float:
    """N by which forces that hold a weight of 1 N must at least be beyond planes that contain the friction cones."""
    rows = outer(normals, mu, ways)
    answer = linprog(
        np.eye(1, rows.shape[1] + 1, rows.shape[1])[0],
        A_ub=np.concatenate([rows, -np.ones((len(rows), 1))], axis=1),
        b_ub=np.zeros(len(rows)),
        A_eq=np.concatenate([equations(points, com), np.zeros((6, 1))], axis=1),
        b_eq=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        bounds=[(None, None)] * rows.shape[1] + [(0.0, None)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert answer.status == 0, answer.message
    return float(answer.fun)


def nearest(z: np.ndarray, normals: np.ndarray, mu: float) -> np.ndarray:
    """The nearest forces to z within friction cones."""
    out = np.zeros_like(z)
    for i, n in enumerate(unit(normals)):
        normal = z[i] @ n
        tangent = z[i] - normal * n
        r = np.linalg.norm(tangent)
        if r <= mu * normal:
            out[i] = z[i]
        elif mu * r > -normal:
            edge = (n + mu * tangent / r) / np.sqrt(1.0 + mu**2)
            out[i] = (z[i] @ edge) * edge
    return out
