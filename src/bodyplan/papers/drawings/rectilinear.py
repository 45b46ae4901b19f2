"""Figs. 7, 9 and 10 of paper *rectilinear*."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.gaits.rectilinear import paper_drive, pose
from bodyplan.papers.entries import Drawing
from bodyplan.show.series import EXECUTED, PLANNED

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _moves(x: tuple[float, float, float], figure: Figure) -> None:
    """The stance before and after the moves of tail, middle and head; mm as in the paper."""
    before, drives = np.array(x), paper_drive(np.diff(x))
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    for k, (ax, name) in enumerate(zip(panels, ("tail", "middle", "head"), strict=True)):
        after = before.copy()
        after[k] += drives[k]
        for stance, color, style, label in ((before, PLANNED, "--", "before"), (after, EXECUTED, "-", "after")):
            found = pose([(place, 0.0) for place in stance], 2.0)
            points = np.vstack([[stance[0] - 1.0, 0.0], found.points[:, [0, 2]], [stance[2] + 1.0, 0.0]]) * 1e3
            ax.plot(*points.T, style, color=color, linewidth=1.6, label=label)
            ax.plot(*points[1:-1].T, "o", color=color, markersize=3.5)
        ax.axhline(0.0, color="#555", linewidth=0.8)
        ax.set_title(f"{name} moves {1e3 * drives[k]:.0f} mm", fontsize=9)
        ax.set_aspect("equal")
        ax.set_xlabel("x (mm)")
        ax.locator_params(axis="x", nbins=4)
        before = after
    panels[0].set_ylabel("z (mm)")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=2, fontsize=8)


DRAWINGS = (
    Drawing(
        "Fig. 7", "Configuration 0.3 / 0.7, entering: one cycle by the 60 % rule", partial(_moves, (1.0, 2.2, 5.0)), 1.8
    ),
    Drawing("Fig. 9", "Configuration 0.7 / 0.3, exiting", partial(_moves, (1.0, 3.8, 5.0)), 1.8),
    Drawing("Fig. 10", "Configuration 1 / 1, which stretches its legs fully", partial(_moves, (1.0, 5.0, 9.0)), 1.8),
)
