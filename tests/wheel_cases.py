"""Wheels by another road: contacts by brute force over the ground under a wheel, and the paper's transforms."""

from __future__ import annotations

import numpy as np

import bodyplan as bp

COS_30 = np.cos(np.radians(30.0))


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Ry(pitch) Rx(roll) Rz(yaw), eq. (4) with the sign of T_y mended."""
    cr, sr, cp, sp, cy, sy = (f(v) for v in (roll, pitch, yaw) for f in (np.cos, np.sin))
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return Ry @ Rx @ Rz


def nearest_by_brute_force(ground: bp.Surface, centre: np.ndarray, R: np.ndarray, reach: float) -> float:
    """Distance from a wheel's centre to the ground in the plane of the body's x and z axes: rays in 720 directions,
    each followed to its first hit by steps and bisection, then the best direction by golden section."""

    def height(points: np.ndarray) -> np.ndarray:
        return points[..., 2] - ground.height(points)

    def first_hit(phi: np.ndarray) -> np.ndarray:
        u = np.sin(phi)[:, None] * R[:, 0] - np.cos(phi)[:, None] * R[:, 2]
        steps = np.linspace(0.0, reach, 200)
        over = height(centre + steps[None, :, None] * u[:, None])
        hit = over <= 0.0
        found = hit.any(axis=1)
        k = np.maximum(hit.argmax(axis=1), 1)
        low, high = steps[k - 1], steps[k]
        for _ in range(45):
            middle = 0.5 * (low + high)
            inside = height(centre + middle[:, None] * u) <= 0.0
            low, high = np.where(inside, low, middle), np.where(inside, middle, high)
        return np.where(found, high, np.inf)

    grid = np.linspace(-np.pi, np.pi, 721)
    distance = first_hit(grid)
    best = int(distance.argmin())
    a, b = grid[best] - 5e-3 * np.pi, grid[best] + 5e-3 * np.pi
    ratio = 0.5 * (np.sqrt(5.0) - 1.0)
    for _ in range(36):
        c, d = b - ratio * (b - a), a + ratio * (b - a)
        left, right = first_hit(np.array([c, d]))
        a, b = (a, d) if left < right else (c, b)
    return float(min(distance.min(), first_hit(np.array([0.5 * (a + b)]))[0]))


def paper_system(
    ground: bp.Surface, robot: bp.Robot, base: np.ndarray, R: np.ndarray, wheel: str, phi: float, q: float
) -> np.ndarray:
    """(h, T) of eqs. (12) and (14) for one wheel, from forward kinematics of the axle and the paper's formulas."""
    zero = robot.forward(np.zeros(robot.n))
    centre = base + R @ zero[f"{wheel}.axle"][:3]
    radius = 0.3 * np.cos(q / 2.0) * COS_30 + 0.02
    u = R @ np.array([np.sin(phi), 0.0, -np.cos(phi)])
    t = R @ np.array([np.cos(phi), 0.0, np.sin(phi)])
    p = centre + radius * u
    gx, gy = ground.gradient(p[:2])
    return np.array([p[2] - ground.height(p[:2]), np.array([-gx, -gy, 1.0]) @ t])
