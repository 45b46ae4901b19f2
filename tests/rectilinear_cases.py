"""References for tests of inching: forward kinematics, swing and legs written down once more, in plain formulas."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np

import bodyplan as bp
from bodyplan.motion import Motion

#: Figs. 8 and 11 of the paper: 1000 mm modules, two of them between pitch joints
MODULES = {"axes": "alternating", "first": "pitch", "radius": 1e-3, "mass": 1.0}


def paper_snake() -> bp.Robot:
    return bp.snake(10, 1.0, **MODULES)


#: what the gait knows to be false of three anchors that move one by one
TIPS = "the centre of mass is over the standing anchors"
OPTIONS = {"axes": "alternating", "first": "pitch", "mass": 0.25}
THIN = OPTIONS | {"radius": 0.005}
FEET = OPTIONS | {"foot_radius": 0.003, "foot_spread": 0.06}


def snake(anchors: int = 3, **options: Any) -> bp.Robot:
    return bp.snake(4 * anchors - 2, 0.1, **(THIN | options))


def planned(robot: bp.Robot, gait: Any, ground: Any = None, samples: int = 121, cycles: float = 1.0) -> Motion:
    """Over a number of cycles where it repeats, or else 6 s."""
    ground = bp.Plane() if ground is None else ground
    period = gait.period(robot, ground)
    return bp.plan(robot, gait, ground, np.linspace(0.0, cycles * (period or 6.0), samples))


def failures(motion: Motion) -> set[str]:
    return {line.what for line in bp.check(motion).failures}


def chain(start: Any, joints: Any, links: Any) -> np.ndarray:
    """Joints' places (..., p, 2) along and up of links in a row: every nose-up joint turns all that is ahead of it."""
    joints, links = np.asarray(joints), np.asarray(links)
    at = np.array(np.broadcast_to(start, (*joints.shape[:-1], 2)), dtype=np.float64)
    places, angle = [at], np.zeros(joints.shape[:-1])
    for k, length in enumerate(links):
        angle = angle + joints[..., k]
        at = at + length * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        places.append(at)
    return np.stack(places, axis=-2)


def anchors_of(spans: Any, rises: Any, start: Any = (0.0, 0.0)) -> np.ndarray:
    """Anchors (N, 2) along and up from the horizontal and vertical steps between them."""
    steps = np.stack([np.asarray(spans, float), np.asarray(rises, float)], axis=-1)
    return np.asarray(start) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def smooth(tau: Any) -> Any:
    return 3 * tau**2 - 2 * tau**3


def swing_by_hand(tau: Any, step: Any, lift: Any, early: Any) -> tuple[Any, Any]:
    """Displacement along and up of a swing in mpmath: the formulas of its docstring, nothing rearranged."""
    u = smooth(tau)
    dx, dz = step
    wait = mp.mpf(0.6) * (1 - early)

    def cycloid(v: Any) -> Any:
        v = min(max(v, mp.mpf(0)), mp.mpf(1))
        return v - mp.sin(2 * mp.pi * v) / (2 * mp.pi)

    if dz >= 0:
        climb, along = cycloid(u / early), cycloid((u - wait) / (1 - wait))
    else:
        climb, along = 1 - cycloid((1 - u) / early), 1 - cycloid((1 - u - wait) / (1 - wait))
    return dx * along, dz * climb + lift * mp.sin(mp.pi * u) ** 2


def angles_by_hand(anchors: list[tuple[Any, Any]], links: Any) -> list[Any]:
    """Absolute angles of the links by the law of cosines, in mpmath."""
    out = []
    for i, ((x0, z0), (x1, z1)) in enumerate(pairwise(anchors)):
        a, b = mp.mpf(float(links[2 * i])), mp.mpf(float(links[2 * i + 1]))
        x, z = x1 - x0, z1 - z0
        length = mp.sqrt(x * x + z * z)
        alpha = mp.atan2(z, x)
        beta = mp.acos(min((a * a + length**2 - b * b) / (2 * a * length), mp.mpf(1)))
        psi = mp.acos(min((b * b + length**2 - a * a) / (2 * b * length), mp.mpf(1)))
        out += [alpha + beta, alpha - psi]
    return out


def joints_by_hand(anchors: Any, links: Any) -> np.ndarray:
    """Nose-up joints (..., 2 N - 1) from anchors (..., N, 2) by the law of cosines; NaN out of reach by more than
    rounding."""
    anchors, links = np.asarray(anchors, float), np.asarray(links, float)
    a, b = links[0::2], links[1::2]
    x, z = np.moveaxis(np.diff(anchors, axis=-2), -1, 0)
    square = x * x + z * z

    def angle(own: Any, other: Any) -> Any:
        cosine = (own * own + square - other * other) / (2 * own * np.sqrt(square))
        known = np.abs(cosine) <= 1.0 + 1e-12
        return np.where(known, np.arccos(np.where(known, np.clip(cosine, -1.0, 1.0), 0.0)), np.nan)

    alpha = np.arctan2(z, x)
    angles = np.stack([alpha + angle(a, b), alpha - angle(b, a)], axis=-1).reshape(*x.shape[:-1], -1)
    level = np.zeros((*angles.shape[:-1], 1))
    return np.diff(np.concatenate([level, angles, level], axis=-1), axis=-1)


def unit_ends(motion: Any, lengths: Any) -> np.ndarray:
    """Ends (T, units + 1, 3) of a snake's units, tail end first, from its base and pitch joints alone: units in a row
    in an upright plane, each bent nose-down against the one behind it."""
    x, y, z, w, i, j, k = motion.base.T
    assert np.all(np.abs(i) + np.abs(j) < 1e-15)
    heading = 2.0 * np.arctan2(k, w)
    pitch = {int(name[5:]): c for c, name in enumerate(motion.robot.joints) if name.startswith("pitch")}
    yaws = [c for c, name in enumerate(motion.robot.joints) if name.startswith("yaw")]
    assert np.all(motion.q[:, yaws] == 0.0)
    angle, at, ends = np.zeros(len(x)), np.stack([x, y, z], axis=-1), []
    ends.append(at)
    for unit, length in enumerate(lengths):
        if unit in pitch:
            angle = angle - motion.q[:, pitch[unit]]
        ahead = np.stack([np.cos(angle) * np.cos(heading), np.cos(angle) * np.sin(heading), np.sin(angle)], axis=-1)
        at = at + length * ahead
        ends.append(at)
    return np.stack(ends, axis=1)
