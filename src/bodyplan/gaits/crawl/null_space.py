"""What the null space of paper *legs*, (18), buys: the crawl with x, y and yaw commanded evenly, without sway, and the
height, roll and pitch left to resolved rates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, number
from bodyplan.errors import UnknownNameError
from bodyplan.gaits.crawl.planner import Planner
from bodyplan.gaits.crawl.poses import base_of, seen_from
from bodyplan.gaits.crawl.steps import Step
from bodyplan.ground.base import Ground
from bodyplan.robot.masses import center_of_mass
from bodyplan.robot.model import Robot
from bodyplan.spatial.hulls import edge_distances

if TYPE_CHECKING:
    from bodyplan.gaits.crawl.gait import Crawl

#: what is compared: no objective, eq. (22) as printed, as its text says, and ours
CHOICES = ("off", "printed", "text", "barrier")
#: s of a step of the integration (classical Runge-Kutta), and gain of the ascent
DT, GAIN = 0.2, 0.5
#: weights of roll and pitch (1/rad^2), of height (1/m^2), and of the barrier beside them
LEVEL, HEIGHT, BARRIER = 20.0, 200.0, 0.02


@dataclass(frozen=True)
class Benefit:
    """One choice over the span: least support ``margin`` m, largest ``roll`` and ``pitch`` rad, lowest and highest body
    ``low``, ``high`` m over where its feet are at the beginning, and the ``status``: "ok", or why and when it ended."""

    choice: str
    margin: float
    roll: float
    pitch: float
    low: float
    high: float
    status: str


def null_space(
    robot: Robot, gait: Crawl, ground: Ground, span: float, choices: tuple[str, ...] = CHOICES
) -> list[Benefit]:
    """The table of the null space: (18) with the objectives of :mod:`bodyplan.solve.stability`.

    The feet step as in ``gait``; the body's x, y and yaw go evenly, as the paper commands them, and its z, roll and
    pitch follow X = G# H Y + d (I - G# G) rho for ``span`` s, from level. Joints come from the feet and the body by
    inverse kinematics, so that nothing drifts. Only z, roll and pitch are free, so that the margin can hardly change:
    the table says how much. Raises InputError as ``gait.plan``.
    """
    number(span, "span", above=0.0)
    for choice in choices:
        if choice not in CHOICES:
            raise UnknownNameError("choice", choice, CHOICES)
    planner = gait.planner(robot, ground)
    plan = planner.made(span)
    if not plan.steps:
        return [Benefit(choice, 0.0, 0.0, 0.0, planner.height, planner.height, plan.reason) for choice in choices]
    walk = _Walk(planner, plan.steps, plan.feet, plan.guess, choices)
    (x, y), heading = planner.course.at(0.0)
    level = planner.pose(np.array([x, y]), heading, plan.feet)[2:5]
    end = min(span, plan.steps[-1].touch_down)
    count = max(1, int(np.ceil(end / DT)))
    h = end / count
    free = np.repeat(level[None], len(choices), axis=0)
    track = [free]
    status = ["ok"] * len(choices)
    for k in range(count):
        t = k * h
        k1, lost = walk.rates(t, free)
        k2, _ = walk.rates(t + 0.5 * h, free + 0.5 * h * k1)
        k3, _ = walk.rates(t + 0.5 * h, free + 0.5 * h * k2)
        k4, _ = walk.rates(t + h, free + h * k3)
        for row in np.flatnonzero(lost):
            if status[row] == "ok":
                status[row] = f"a foot is out of reach at {t:.3g} s"
        going = np.array([text == "ok" for text in status])
        free = free + going[:, None] * h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        track.append(free)
    path = np.array(track)
    margins = np.array([walk.margins(k * h, at) for k, at in enumerate(path)])
    low, high = (planner.height + extreme(path[..., 0], axis=0) - level[0] for extreme in (np.min, np.max))
    tilt = np.abs(path[..., 1:]).max(axis=0)
    return [
        Benefit(
            choice,
            float(margins[:, i].min()),
            float(tilt[i, 0]),
            float(tilt[i, 1]),
            float(low[i]),
            float(high[i]),
            status[i],
        )
        for i, choice in enumerate(choices)
    ]


@dataclass(frozen=True, eq=False)
class _Walk:
    """The even walk with one body a choice: feet and bodies at any time."""

    planner: Planner
    steps: tuple[Step, ...]
    feet: Array
    guess: Array
    choices: tuple[str, ...]

    def rates(self, t: float, free: Array) -> tuple[Array, BoolArray]:
        """Rates (C, 3) of z, roll and pitch at ``t`` s, and which bodies (C,) cannot reach their feet (0 there)."""
        from bodyplan import solve

        legs = self.planner.legs
        place, velocity, swinging = self._feet(t)
        base, q, placed = self._joints(t, free, place)
        names = [legs.robot.frames[leg.frame] for leg in legs.legs]
        known = [f"{name}.v" for name in names] + ["body.x", "body.y", "body.yaw"]
        model = solve.model(legs.robot, q, base=base)
        part = solve.partition(model, known=known, axes="world")
        vx, vy = self.planner.course.velocity
        _, heading = self.planner.course.at(t)
        c, s = np.cos(heading), np.sin(heading)
        wanted = {f"{name}.v": velocity[j] for j, name in enumerate(names)} | {
            "body.x": c * vx - s * vy,
            "body.y": s * vx + c * vy,
            "body.yaw": self.planner.course.yaw_rate,
        }
        on = [j for j in range(len(names)) if j != swinging]
        center = center_of_mass(legs.robot, q, base)[:, 2]
        height = float(place[on, 2].mean()) + self.planner.height + float((center - base[:, 2]).mean())
        gradient = np.zeros((len(self.choices), part.G.shape[-1]))
        for i, choice in enumerate(self.choices):
            if choice != "off":
                psi = _objective(choice, height).at(model, [names[j] for j in on])
                gradient[i] = np.asarray(psi.rho(part))[i]
        found = solve.resolve(part, wanted, method="weighted", gradient=gradient, d=GAIN)
        out = np.stack([np.asarray(found[name]) for name in ("body.z", "body.roll", "body.pitch")], axis=-1)
        return np.where(placed[:, None], out, 0.0), ~placed

    def margins(self, t: float, free: Array) -> Array:
        """Support margins (C,) m."""
        place, _, swinging = self._feet(t)
        base, q, _ = self._joints(t, free, place)
        on = [j for j in range(len(place)) if j != swinging]
        center = center_of_mass(self.planner.legs.robot, q, base)[:, :2]
        return np.asarray(edge_distances(np.repeat(place[None, on, :2], len(center), axis=0), center).min(axis=-1))

    def _joints(self, t: float, free: Array, place: Array) -> tuple[Array, Array, BoolArray]:
        (x, y), heading = self.planner.course.at(t)
        poses = np.zeros((len(free), 6))
        poses[:, 0], poses[:, 1], poses[:, 5] = x, y, heading
        poses[:, 2:5] = free
        base = base_of(poses)
        q, placed = self.planner.legs.place(seen_from(base, np.repeat(place[None], len(free), axis=0)), self.guess)
        return base, q, np.asarray(placed.all(axis=1))

    def _feet(self, t: float) -> tuple[Array, Array, int]:
        """Centres (m, 3) of the feet, their velocities, and who swings (-1: none)."""
        velocity = np.zeros_like(self.feet)
        step = next((step for step in self.steps if t < step.touch_down), None)
        if step is None:
            return self.steps[-1].after, velocity, -1
        if t <= step.lift_off:
            return step.before, velocity, -1
        place = step.before.copy()
        span = step.touch_down - step.lift_off
        at, speed, _ = step.foot(np.array([(t - step.lift_off) / span]))
        place[step.leg], velocity[step.leg] = at[0], speed[0] / span
        return place, velocity, step.leg


def _objective(choice: str, height: float) -> Any:
    from bodyplan import solve

    if choice == "barrier":
        return solve.stability.Objective(choice, k1=BARRIER, k2=LEVEL, k3=LEVEL, height=height, k4=HEIGHT)
    return solve.stability.Objective(choice, k2=LEVEL, k3=LEVEL)
