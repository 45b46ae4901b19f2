"""The part of a report that lays the mechanism over the curve that it follows, and says how well it does so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show import fitted_plots
from bodyplan.show.fitted import VIEWS, Drawn
from bodyplan.show.fitted_figures import draw_overlay, draw_turning
from bodyplan.show.following import Following
from bodyplan.show.layout import layout, line
from bodyplan.show.series import EXECUTED, PLANNED
from bodyplan.show.text import esc, figure, percent, picture, plot, section, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def following_section(found: Following | None, pictures: Mapping[str, str]) -> str:
    """Curve and mechanism as a part of the report; ``pictures`` are the figures as SVG by name."""
    if found is None:
        return ""
    if found.problem:
        return section("following", "Curve and mechanism", f"<p>Not drawn: {esc(found.problem)}</p>")
    rows = [
        (f"{figure(t, 's', 3)}", figure(d.error, digits=4), figure(d.quadrature_error, digits=2),
         figure(d.max_distance, "m", 4), percent(d.max_distance / found.length))
        for t, d in zip(found.key_times, found.keys, strict=True)
    ]  # fmt: skip
    head = ("time", "E_nm", "its quadrature error", "largest distance", "of the body’s length")
    out = f"<p>{in_words(found)}</p>" + table(head, rows, numbers=(0, 1, 2, 3, 4))
    if "curve_and_mechanism" in pictures:
        alt = "Curve and mechanism at key times, and their turning along the body"
        out += "<h3>At key times</h3>" + picture(pictures["curve_and_mechanism"], alt)
    out += plot("overlay", f"Curve and mechanism at {figure(float(found.key_times[0]), 's', 3)}, lengths true.")
    out += plot(
        "turning",
        "The sum of the joint angles up to a place against the turning of the curve: a staircase for hinges, a "
        "polyline for arcs.",
    )
    return section("following", "Curve and mechanism", out + plot("fit_error"))


def in_words(found: Following) -> str:
    """The fit over the cycle in a sentence (HTML)."""
    worst = int(np.argmax(found.distance))
    small, large = float(found.error.min()), float(found.error.max())
    between = f"between {figure(small)} and {figure(large)}" if large > 1.001 * small else f"{figure(large)} throughout"
    when, far = ("cycle" if found.cyclic else "motion"), float(found.distance[worst])
    return (
        f"Over the {when} the mean distance between mechanism and curve, as a share of the body’s length (E_nm), is "
        f"<b>{between}</b>. The largest distance is <b>{figure(far, 'm')}</b> ({percent(far / found.length)} of the "
        f"body), at {figure(float(found.t[worst]), 's', 3)}."
    )


def following_plots(found: Following | None) -> dict[str, dict[str, Any] | None]:
    """Overlay and turning at the first key time; error and distance over the cycle."""
    if found is None or not found.keys:
        return {}
    first = found.keys[0]
    return {
        "overlay": fitted_plots.overlay(first),
        "turning": fitted_plots.turning(first),
        "fit_error": _error_plot(found),
    }


def _error_plot(found: Following) -> dict[str, Any]:
    data = [
        line(found.t, found.error, "E_nm", PLANNED),
        line(found.t, 1e3 * found.distance, "largest distance", EXECUTED, yaxis="y2"),
    ]
    made = layout("time (s)", "E_nm", 300)
    made["yaxis"].update({"rangemode": "tozero", "exponentformat": "power"})
    made["yaxis2"] = {
        "title": {"text": "largest distance (mm)", "standoff": 6},
        "overlaying": "y",
        "side": "right",
        "rangemode": "tozero",
        "showgrid": False,
        "automargin": True,
        "tickmode": "auto",
        "nticks": 6,
    }
    return {"data": data, "layout": made}


def following_figure(found: Following | None, new_figure: Callable[[float], Figure]) -> Figure | None:
    """Curve and mechanism at the key times from above (and from the side where the curve is not flat), and their
    turning at the first."""
    if found is None or not found.keys:
        return None
    spread = np.ptp(found.keys[0].body, axis=0)
    along = "the side" if spread[0] >= spread[1] else "the front"
    views = [view for view in ("above", along) if any(view in drawn.views for drawn in found.keys)]
    boxes = {view: [_box(drawn, view) for drawn in found.keys] for view in views}
    # one size for all key times, at the same scale in all views
    sizes = {view: np.max([high - low for low, high in boxes[view]], axis=0) for view in views}
    width = max(float(size[0]) for size in sizes.values())
    heights = [float(np.clip(2.0 * sizes[view][1] / width, 0.5, 3.0)) + 0.75 for view in views]
    made = new_figure(sum(heights) + 2.8)
    rows: Any = made.subfigures(len(views) + 1, 1, height_ratios=[*heights, 2.8])
    for view, row in zip(views, rows, strict=False):
        axes = row.subplots(1, len(found.keys), squeeze=False)[0]
        for i, (ax, drawn, t) in enumerate(zip(axes, found.keys, found.key_times, strict=True)):
            draw_overlay(ax, drawn, view, named=i == 0)
            low, high = boxes[view][i]
            middle, half = 0.5 * (low + high), 0.5 * np.array([width, sizes[view][1]])
            ax.set_aspect("equal", adjustable="box")
            ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
            ax.set_ylim(middle[1] - half[1], middle[1] + half[1])
            ax.locator_params(axis="x", nbins=4)
            ax.locator_params(axis="y", nbins=4 if sizes[view][1] > 0.3 * width else 2)
            ax.set_title(f"{t:.2f} s" if view == views[0] else "", fontsize=8)
            ax.tick_params(labelsize=7)
            if i:
                ax.set_ylabel("")
    draw_turning(rows[-1].subplots(), found.keys[0])
    return made


def _box(drawn: Drawn, view: str) -> tuple[Array, Array]:
    """Corners (2,), (2,) m of a box around curve and mechanism in a view, with some room."""
    points = np.concatenate([drawn.curve, drawn.body])[:, VIEWS[view]]
    low, high = points.min(axis=0), points.max(axis=0)
    room = 0.06 * float((high - low).max())
    return low - room, high + room
