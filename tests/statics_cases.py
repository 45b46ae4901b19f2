"""Bodies on contacts for the tests of statics."""

from __future__ import annotations

import numpy as np

WHEELS = np.array([[0.6, 0.6, 0.0], [0.6, -0.6, 0.0], [-0.6, 0.0, 0.0]])
FLAT = np.tile([0.0, 0.0, 1.0], (3, 1))


def on_slope(slope: float, height: float = 0.15) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three wheels on a plane that falls along x, with the weight between them."""
    angle = np.arctan(slope)
    turn = np.array([[np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0], [-np.sin(angle), 0.0, np.cos(angle)]])
    return WHEELS @ turn.T, FLAT @ turn.T, turn @ np.array([-0.1, 0.0, height])


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
    normals = rng.normal(size=(k, 3)) * [0.5, 0.5, 0.2] + [0.0, 0.0, 1.0]
    return points, normals, points.T @ rng.dirichlet(np.ones(k)) + [0.0, 0.0, rng.uniform(-0.2, 0.5)]


def parts(forces: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normal and tangential size of each force."""
    unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    normal = np.sum(forces * unit, axis=-1)
    return normal, np.linalg.norm(forces - normal[..., None] * unit, axis=-1)


def left_over(points: np.ndarray, com: np.ndarray, forces: np.ndarray, weight: float) -> float:
    """Force and moment that are not balanced, over the size of what they add up from."""
    arms = points - com
    force = np.abs(forces.sum(axis=0) - [0.0, 0.0, weight]).max()
    moment = np.abs(np.cross(arms, forces).sum(axis=0)).max()
    size = np.abs(forces).max()
    return float(max(force, moment / np.linalg.norm(arms, axis=1).max()) / size)
