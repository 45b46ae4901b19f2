"""What the equations (19)-(22) of paper *legs* say of a stance; the paper itself draws nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bodyplan.papers.entries import Drawing
from bodyplan.show.series import EXECUTED, LIMIT, SERIES
from bodyplan.solve.stability import Objective, tip_margins

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _margins(figure: Figure) -> None:
    """The least mu and the printed product over places of the centre of mass; psi over its height."""
    feet = np.array([[0.30, 0.28, 0.0], [0.28, -0.31, 0.0], [-0.30, 0.02, 0.0]])
    x, y = np.meshgrid(np.linspace(-0.6, 0.6, 121), np.linspace(-0.6, 0.6, 121))
    com = np.stack([x, y, np.full_like(x, 0.2)], axis=-1)
    mu = tip_margins(feet, com=com).mu
    left, right = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    unstable = (mu.min(axis=-1) <= 0.0) & (mu.prod(axis=-1) > 0.0)
    left.contourf(x, y, unstable, levels=[0.5, 1.5], colors=["#f3c9c5"])
    left.contour(x, y, mu.min(axis=-1), levels=[0.0], colors=[EXECUTED])
    left.plot(*np.vstack([feet, feet[:1]])[:, :2].T, "o", color="#1c2530", markersize=5)
    left.set_title("product of μ > 0 though unstable (red)", fontsize=9)
    left.set_aspect("equal")
    left.set_xlabel("x of the centre of mass (m)")
    left.set_ylabel("y (m)")
    heights = np.linspace(0.0, 0.3, 61)
    places = np.stack([np.full(61, 0.05), np.zeros(61), heights], axis=-1)
    for kind, color in (("printed", LIMIT), ("min_mu", EXECUTED)):
        psi = Objective(kind, k2=0.0, k3=0.0)(feet, places).value
        right.plot(heights, psi, color=color, label={"printed": "(22)", "min_mu": "least μ"}[kind])
    held = Objective("min_mu", k2=0.0, k3=0.0, height=0.2, k4=30.0)(feet, places).value
    right.plot(heights, held, color=SERIES[2], label="least μ, height held")
    right.set_title("what rises when the body sinks", fontsize=9)
    right.set_xlabel("height of the centre of mass (m)")
    right.set_ylabel("ψ")
    right.set_ylim(-0.6, 1.1)
    right.legend(fontsize=8)


DRAWINGS = (Drawing("(19)-(22)", "Three feet: where the product misleads, and why psi crouches", _margins, 3.0),)
