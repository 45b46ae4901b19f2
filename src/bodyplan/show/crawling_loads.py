"""What the feet of a walk carry, and the friction that standing so needs, from statics on the ground's own normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any
from weakref import ref

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.crawl import Crawl
from bodyplan.motion import Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.show.layout import layout, line
from bodyplan.show.series import EXECUTED
from bodyplan.show.text import figure, plot

#: colours of legs, told apart by colour-blind eyes, too
LEGS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
#: samples at which forces are worked out; m/s^2
SAMPLES, GRAVITY = 240, 9.81
#: a coefficient of friction that is none but for rounding
NONE = 1e-6


@dataclass(frozen=True)
class Loads:
    """``t`` (k,) s; ``feet``: names; ``normal`` (k, m) N, across the ground, nan in the air; ``needed`` (k,): the least
    coefficient of friction with which the robot can stand so, inf where none will do."""

    t: Array
    feet: tuple[str, ...]
    normal: Array
    needed: Array

    @property
    def rubs(self) -> bool:
        """Whether it needs any friction where it can stand."""
        return bool(np.any(np.isfinite(self.needed) & (self.needed > NONE)))


def is_crawl(motion: Motion) -> bool:
    """True for the plan of a :class:`bodyplan.Crawl` of a robot with masses."""
    return motion.gait.get("kind") == Crawl.kind and motion.contacts is not None and motion.robot.mass > 0.0


def stood(motion: Motion) -> list[int]:
    """Which contacts are ever meant to carry."""
    return [int(k) for k in np.flatnonzero(np.asarray(motion.contacts).any(axis=0))]


#: text and plots of a report ask for the same loads, one after the other
_last: list[tuple[ref[Motion], Loads | None]] = []


def loads_of(motion: Motion) -> Loads | None:
    """The loads of a walk at rest in its poses, of least square in all; None where nothing can be told."""
    if not _last or _last[0][0]() is not motion:
        _last[:] = [(ref(motion), _worked_out(motion))]
    return _last[0][1]


def _worked_out(motion: Motion) -> Loads | None:
    from bodyplan.solve import contact_forces, required_friction

    robot, feet = motion.robot, stood(motion)
    if not feet:
        return None
    chosen = _chosen(motion)
    poses = robot.forward(motion.q[chosen], motion.base[chosen])
    contacts = [robot.contacts[k] for k in feet]
    centres = np.stack([poses[c.frame][:, :3] for c in contacts], axis=1)
    normals = motion.ground.normal(centres)
    for _ in range(3):  # of the ground where the ball touches it
        normals = motion.ground.normal(centres - np.array([c.radius for c in contacts])[:, None] * normals)
    points = centres - np.array([c.radius for c in contacts])[:, None] * normals
    on = np.asarray(motion.contacts)[chosen][:, feet] > 0.5
    center, weight = center_from_poses(robot, poses.array), robot.mass * GRAVITY
    needed = required_friction(points, normals, center, weight, touching=on)
    mu = np.where(np.isfinite(needed.mu), np.maximum(1.0, 1.1 * needed.mu), 1.0)
    forces = contact_forces(points, normals, center, weight, mu[:, None], touching=on).forces
    normal = np.where(on, np.sum(forces * normals, axis=-1), np.nan)
    return Loads(motion.t[chosen] - motion.t[0], tuple(c.name for c in contacts), normal, np.asarray(needed.mu))


def _chosen(motion: Motion) -> IntArray:
    count = len(motion.t)
    return np.unique(np.linspace(0, count - 1, min(count, SAMPLES)).round().astype(np.int64))


def loads_text(motion: Motion) -> str:
    """What the report says of them, with its plots."""
    found = loads_of(motion)
    if found is None or not np.isfinite(found.normal).any():
        return ""
    k = int(np.nanargmax(np.where(np.isfinite(found.needed), found.needed, -1.0)))
    at, foot = np.unravel_index(int(np.nanargmax(found.normal)), found.normal.shape)
    said = (
        f"<h3>What the feet carry</h3><p>At rest in its poses the robot puts up to <b>"
        f"{figure(float(found.normal[at, foot]), 'N', 3)}</b> on a foot ({found.feet[foot]}, at "
        f"{figure(float(found.t[at]), 's', 3)})"
    )
    if found.rubs:
        said += (
            f", and needs a coefficient of friction of <b>{figure(float(found.needed[k]), '', 2)}</b> (at "
            f"{figure(float(found.t[k]), 's', 3)}): with less the ground cannot hold it, however the feet share."
        )
    else:
        said += ". Wherever it can stand it could do so without friction."
    if np.any(np.isinf(found.needed)):
        first = float(found.t[np.isinf(found.needed)][0])
        said += f" From {figure(first, 's', 3)} on there are times when no friction is enough: <b>there it tips</b>."
    said += "</p>" + plot(
        "walk_loads", "Load of each foot across the ground, of least square in all, in friction cones."
    )
    if found.rubs:
        said += plot("walk_friction", "The least coefficient of friction with which the robot can stand so.")
    return said


def loads_plots(motion: Motion) -> dict[str, dict[str, Any] | None]:
    """Loads and friction over time."""
    found = loads_of(motion)
    if found is None:
        return {}
    curves = [
        line(found.t, load, name, LEGS[j % len(LEGS)], connectgaps=False)
        for j, (name, load) in enumerate(zip(found.feet, found.normal.T, strict=True))
    ]
    mu = np.where(np.isfinite(found.needed), found.needed, np.nan)
    friction = layout("time (s)", "friction needed", 240)
    friction["yaxis"]["rangemode"] = "tozero"
    loads = {"data": curves, "layout": layout("time (s)", "load of a foot (N)", 300)}
    if not found.rubs:
        return {"walk_loads": loads}
    needed = {"data": [line(found.t, mu, "needed", EXECUTED, showlegend=False)], "layout": friction}
    return {"walk_loads": loads, "walk_friction": needed}
