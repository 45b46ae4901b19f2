"""Figs. 6, 7, 10, 12 and 13 of paper *acm*."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.curves import Serpenoid, SinusLift, Spiral
from bodyplan.fitting import fit
from bodyplan.papers.entries import Drawing
from bodyplan.robot import Robot, snake
from bodyplan.show.fitted import CURVE, MECHANISM
from bodyplan.show.series import EXECUTED, PLANNED

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

P = 0.789
#: view of the spiral: x and y of the screen in the curve's axes
SLANT = np.array([[0.87, -0.35, 0.0], [0.25, 0.45, 0.85]])


def _made(kind: str) -> tuple[Robot, Robot]:
    """The robots for serpenoid and spiral: 10 links, 10 arcs, 10 double joints."""
    if kind == "straight":
        return snake(10, 0.1), snake(20, 0.05, axes="alternating")
    return snake(10, 0.1, kind), snake(10, 0.1, kind, axes="universal")


def _fits(kind: str, figure: Figure) -> None:
    planar, spatial = _made(kind)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.25, 1.0, 1.25))
    _overlay(left, "(a) serpenoid", Serpenoid(np.pi / 3.0), planar, np.eye(3)[:2])
    _overlay(middle, "(b) spiral", Spiral(), spatial, SLANT)
    found = fit(Serpenoid(np.pi / 3.0), planar, p=None if kind == "straight" else P)
    s = np.linspace(0.0, 1.0, 600)
    turning = found.turning(s)
    right.plot(s, turning.curve[:, 1], color=CURVE, linewidth=4.0, alpha=0.5)
    right.plot(s, turning.mechanism[:, 1], color=MECHANISM, linewidth=1.2)
    right.set_title("(c) turning of the serpenoid", fontsize=9)
    right.set_xlabel("s / L")
    right.set_ylabel("φ (rad)")


def _overlay(ax: Axes, title: str, curve: Any, robot: Robot, view: Any) -> None:
    found = fit(curve, robot, p=None if "straight" in robot.name else P)
    s = np.linspace(0.0, 1.0, 401)
    ax.plot(*(view @ found.curve_points(s).T), color=CURVE, linewidth=4.0, alpha=0.5, label="curve")
    ax.plot(*(view @ found.points(s).T), color=MECHANISM, linewidth=1.4, label="mechanism")
    ax.set_aspect("equal", adjustable="datalim")
    mantissa, power = f"{float(found.error):.2e}".split("e")
    ax.set_title(f"{title}: $E_{{nm}}$ = {mantissa}·10$^{{{int(power)}}}$", fontsize=9)
    ax.set_xticks([])
    ax.set_yticks([])
    ax.legend(fontsize=7, loc="upper left")


def _tips(figure: Figure) -> None:
    ax, theta = figure.subplots(), np.linspace(-np.pi, np.pi, 181)
    arc = snake(1, 1.0, "arc").forward(theta[:, None])["link1"]
    double = snake(1, 1.0, "double", end_link=0.18).forward(theta[:, None])["link1"]
    ax.plot(arc[:, 0], arc[:, 1], color=EXECUTED, label="arc")
    ax.plot(double[:, 0], double[:, 1], "--", color=PLANNED, label="double joint, R_s = 0.18")
    inner = np.abs(np.abs(theta) - 0.5 * np.pi) < 0.01
    ax.plot(arc[inner, 0], arc[inner, 1], "o", color=EXECUTED, markersize=4, label="±90°")
    ax.set_aspect("equal")
    ax.set_xlabel("x / length")
    ax.set_ylabel("y / length")
    ax.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.02, 0.5))


def _lifted(figure: Figure) -> None:
    alpha, lift = 5.0 * np.pi / 12.0, 0.3
    s = np.linspace(0.0, 3.0, 700)
    top, side = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    level = SinusLift(alpha, lift).frames(s)[0]
    # it starts where it bends neither way, with its belly down: its own z is up
    way = level[-1, :2] / np.linalg.norm(level[-1, :2])
    curves = (
        (SinusLift(alpha, lift, c1="paper"), PLANNED, "--", "c1 by (37)"),
        (SinusLift(alpha, lift), EXECUTED, "-", "level"),
    )
    for curve, color, style, name in curves:
        points = curve.frames(s)[0]
        top.plot(
            points[:, :2] @ way, points[:, :2] @ [-way[1], way[0]], style, color=color, label=f"{name}, {curve.c1:.4f}"
        )
        side.plot(points[:, :2] @ way, points[:, 2], style, color=color)
    top.set_ylabel("y / L_a")
    side.set_ylabel("z / L_a")
    side.set_xlabel("x / L_a")
    figure.legend(loc="outside upper right", fontsize=8, ncols=2)


DRAWINGS = (
    Drawing("Fig. 6", "Straight links: 10 on the serpenoid, 20 on the spiral", partial(_fits, "straight"), 2.9),
    Drawing("Fig. 7", "10 arc-shaped joints, p = 0.789", partial(_fits, "arc"), 2.9),
    Drawing("Fig. 10", "Tips of an arc and of a double joint of equal length and angle, ±180°", _tips, 3.4),
    Drawing("Fig. 12", "10 double joints, R_s = 0.18", partial(_fits, "double"), 2.9),
    Drawing("Fig. 13", "Sinus-lifting over three wavelengths, from above and from the side", _lifted, 3.4),
)
