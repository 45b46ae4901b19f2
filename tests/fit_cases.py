"""Plain loops for paper *acm*: what the tests of fits compare with. Nothing here uses bodyplan.fitting or the robot."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation


def Rz(angle):
    return Rotation.from_rotvec([0, 0, angle]).as_matrix()


def Ry(angle):
    return Rotation.from_rotvec([0, angle, 0]).as_matrix()


def bend(curve, a, b, axis):
    """Integral of kappa_p (axis 0) or kappa_y (1), nothing from before the tail; by Gauss's rule on short pieces."""
    a = max(a, 0.0)
    places = [x for x in curve.breaks if a < x < b]
    x, w = np.polynomial.legendre.leggauss(30)
    total = 0.0
    for low, high in zip([a, *places], [*places, b], strict=True):
        edges = np.linspace(low, high, 5)
        for u, v in pairwise(edges):
            total += (v - u) / 2 * float(w @ curve.shape(0.5 * (u + v) + 0.5 * (v - u) * x)[1 + axis])
    return total


def arc_rule(curve, lengths, p, axis):
    """Eqs. (11)-(17) word by word for units of any lengths: (n + 1,) with the virtual unit first."""
    n, ends = len(lengths), np.concatenate([[0.0], np.cumsum(lengths)])
    early, late = ends[:-1] + (1 - p) * lengths, ends[:-1] + p * lengths
    a, b = np.zeros(n + 1), np.zeros(n + 1)
    a[1] = bend(curve, early[0], late[0], axis) / (2 * p - 1)  # (11)
    for i in range(2, n + 1):  # (12)
        a[i] = (bend(curve, late[i - 2], late[i - 1], axis) - a[i - 1] * (1 - p)) / p
    a[0] = bend(curve, 0.0, early[0], axis) - (1 - p) * a[1]  # (13)
    b[n] = bend(curve, early[n - 1], late[n - 1], axis) / (2 * p - 1)  # (14)
    for i in range(n - 1, 0, -1):  # (15)
        b[i] = (bend(curve, early[i - 1], early[i], axis) - b[i + 1] * (1 - p)) / p
    b[0] = bend(curve, 0.0, early[0], axis) - (1 - p) * b[1]  # (16)
    return (a + b) / 2  # (17)


def double_rule(pitch, yaw):
    """Eqs. (33), (34) with their limit at 0 and atan2."""
    theta = np.hypot(pitch, yaw)
    if theta == 0.0:
        return pitch, yaw
    u = np.sin(theta / 2) * np.array([pitch, yaw]) / theta
    return 2 * np.arcsin(u[0]), 2 * np.arctan2(u[1], np.cos(theta / 2))


def curve_path(curve, start, length):
    """s -> points (S, 3) of the curve from ``start`` on, seen from its frame there; eq. (1) by DOP853."""

    def rates(s, y):
        tau, kp, ky = (float(x) for x in curve.shape(start + s))
        R = y[3:].reshape(3, 3)
        # e_r' = ky e_p - kp e_y, e_p' = -ky e_r + tau e_y, e_y' = kp e_r - tau e_p
        return np.concatenate([R[:, 0], (R @ np.array([[0, -ky, kp], [ky, 0, -tau], [-kp, tau, 0]])).ravel()])

    y, solutions = np.concatenate([np.zeros(3), np.eye(3).ravel()]), []
    stops = [0.0, *[b - start for b in curve.breaks if 0 < b - start < length], length]
    for a, b in pairwise(stops):
        out = solve_ivp(rates, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
        y = out.y[:, -1]
        solutions.append((a, b, out.sol))

    def points(s):
        s = np.asarray(s, dtype=float)
        found = np.zeros((len(s), 3))
        for a, b, sol in solutions:
            inside = (s >= a) & (s <= b)
            if inside.any():
                found[inside] = sol(s[inside])[:3].T
        return found

    return points


class Chain:
    """A body put together from rods and arcs; ``points(s)`` (S, 3) of it."""

    def __init__(self, turn):
        self.R, self.at, self.s, self.pieces = turn, np.zeros(3), 0.0, []

    def turn(self, R):
        self.R = self.R @ R

    def rod(self, length):
        self.arc(length, 0.0, 0.0)

    def arc(self, length, pitch, yaw):
        self.pieces.append((self.s, self.s + length, self.at, self.R, pitch, yaw))
        self.at = self.at + self.R @ self._inner(length, length, pitch, yaw)
        self.R = self.R @ Rotation.from_rotvec([0, pitch, yaw]).as_matrix()
        self.s += length

    @staticmethod
    def _inner(h, length, pitch, yaw):
        """Where an arc is after h: a circle of radius length/theta, bending towards (yaw, -pitch)."""
        theta = np.hypot(pitch, yaw)
        if theta < 1e-9:
            return np.array([h, 0.5 * h * h * yaw / length, -0.5 * h * h * pitch / length])
        x = theta * h / length
        across = length / theta * 2 * np.sin(x / 2) ** 2
        return np.array([length / theta * np.sin(x), across * yaw / theta, -across * pitch / theta])

    def points(self, s):
        s = np.asarray(s, dtype=float)
        out = np.zeros((len(s), 3))
        for i, (a, b, at, R, pitch, yaw) in enumerate(self.pieces):
            last = i == len(self.pieces) - 1
            for k in np.flatnonzero((s >= a) & ((s < b) | last)):
                out[k] = at + R @ self._inner(s[k] - a, b - a, pitch, yaw)
        return out


def arc_chain(lengths, pitch, yaw):
    """From (n + 1,) bends with the virtual one first."""
    chain = Chain(Rotation.from_rotvec([0, pitch[0], yaw[0]]).as_matrix())
    for length, p, y in zip(lengths, pitch[1:], yaw[1:], strict=True):
        chain.arc(length, p, y)
    return chain


def double_chain(lengths, pitch, yaw, end_link):
    chain = Chain(Rotation.from_rotvec([0, pitch[0], yaw[0]]).as_matrix())
    for length, p, y in zip(lengths, pitch[1:], yaw[1:], strict=True):
        p, y = double_rule(p, y)
        chain.rod(end_link * length)
        chain.turn(Rz(y / 2) @ Ry(p / 2))
        chain.rod((1 - 2 * end_link) * length)
        chain.turn(Ry(p / 2) @ Rz(y / 2))
        chain.rod(end_link * length)
    return chain


def straight_chain(lengths, pitch, yaw):
    """(N,) bends at s = 0 and at every joint, yaw before pitch."""
    chain = Chain(np.eye(3))
    for length, p, y in zip(lengths, pitch, yaw, strict=True):
        chain.turn(Rz(y) @ Ry(p))
        chain.rod(length)
    return chain


def mean_distance(curve, chain, start=0.0, cells=1200):
    """(E_nm, largest distance found) by Gauss's rule on many cells of the body: 1e-8 of E_nm where the distance dips to
    zero with a corner, better elsewhere."""
    length = chain.s
    x, w = np.polynomial.legendre.leggauss(5)
    total, largest = 0.0, 0.0
    path = curve_path(curve, start, length)
    for a, b, *_ in chain.pieces:
        edges = np.linspace(a, b, max(int(cells * (b - a) / length), 20) + 1)
        h = edges[1] - edges[0]
        s = (edges[:-1, None] + 0.5 * h * (1 + x)).ravel()
        s = np.append(s, np.nextafter(b, a))
        d = np.linalg.norm(path(s) - chain.points(s), axis=1)
        total += 0.5 * h * np.sum(d[:-1].reshape(-1, 5) @ w)
        largest = max(largest, d.max())
    return total / length**2, largest
