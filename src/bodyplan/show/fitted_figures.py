"""The same pictures of a fit by matplotlib, for papers and slides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.fitted import CURVE, MECHANISM, VIEWS, Drawn
from bodyplan.show.fitted_plots import by_axis
from bodyplan.show.series import LIMIT, SERIES

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_overlay(ax: Axes, drawn: Drawn, view: str, *, named: bool = True) -> None:
    """Curve and mechanism in one view, lengths true."""
    a, b = VIEWS[view]
    names = ("curve", "mechanism") if named else (None, None)
    ax.plot(drawn.curve[:, a], drawn.curve[:, b], color=CURVE, linewidth=4.5, alpha=0.5, label=names[0])
    ax.plot(drawn.body[:, a], drawn.body[:, b], color=MECHANISM, linewidth=1.5, label=names[1])
    ax.plot(drawn.joints[:, a], drawn.joints[:, b], "o", color=MECHANISM, markersize=3.5, markeredgecolor="white",
            markeredgewidth=0.5)  # fmt: skip
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(f"{'xyz'[a]} (m)")
    ax.set_ylabel(f"{'xyz'[b]} (m)")


def draw_turning(ax: Axes, drawn: Drawn) -> None:
    """phi(s) of curve and mechanism."""
    for one, style in zip(drawn.turnings, ("-", ":"), strict=False):
        about = f", {one.axis}" if len(drawn.turnings) > 1 else ""
        ax.plot(drawn.s, one.curve, style, color=CURVE, linewidth=3.5, alpha=0.5, label=f"curve{about}")
        ax.plot(drawn.s, one.mechanism, style, color=MECHANISM, linewidth=1.2, label=f"mechanism{about}")
    ax.set_xlabel("body length from the tail (m)")
    ax.set_ylabel("turning φ (rad)")
    ax.legend(loc="best", fontsize=7)


def draw_distance(ax: Axes, drawn: Drawn) -> None:
    """Distance of the mechanism from the curve along the body."""
    ax.plot(drawn.s, 1e3 * drawn.distance, color=MECHANISM)
    ax.set_ylim(0.0)
    ax.set_xlabel("body length from the tail (m)")
    ax.set_ylabel("distance (mm)")


def draw_angles(ax: Axes, names: Sequence[str], q: Array, limits: Array) -> None:
    """Joint angles by joint, with limits where there are any."""
    for i, (group, chosen) in enumerate(by_axis(names)):
        ax.bar(np.array(chosen), np.degrees(q[chosen]), 0.7, color=SERIES[i], label=group)
    for side in (0, 1):
        if np.all(np.isfinite(limits[:, side])):
            place, bound = np.arange(len(names)), np.degrees(limits[:, side])
            ax.plot(place, bound, "_", color=LIMIT, markersize=8, label="limit" if side == 0 else None)
    step = max(1, -(-len(names) // 40))
    ax.set_xticks(np.arange(0, len(names), step), names[::step], rotation=90, fontsize=7)
    ax.axhline(0.0, color="#555", linewidth=0.8)
    ax.set_ylabel("joint angle (deg)")
    if len(names) > 1:
        ax.legend(loc="best", fontsize=7, ncols=3)
