"""Interactive plots of a fit: curve and mechanism overlaid, turning along the body, distance, joint angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.fitted import CURVE, MECHANISM, VIEWS, Drawn
from bodyplan.show.layout import AXIS, label, layout, line
from bodyplan.show.series import SERIES, compact
from bodyplan.show.text import settled


def overlay(drawn: Drawn) -> dict[str, Any]:
    """Curve and mechanism from above, and from the side and the front where the curve is not flat."""
    views = drawn.views
    data: list[dict[str, Any]] = []
    made = layout("", "", 430 if len(views) == 1 else 330)
    # room for the labels between the panels on a narrow screen too
    gap = 0.14
    width = (1.0 - gap * (len(views) - 1)) / len(views)
    for i, view in enumerate(views):
        a, b = VIEWS[view]
        suffix = "" if i == 0 else str(i + 1)
        axes = {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}", "showlegend": i == 0}
        data.append(line(drawn.curve[:, a], drawn.curve[:, b], "curve", CURVE, line={"width": 6}, opacity=0.55, **axes))
        data.append(line(drawn.body[:, a], drawn.body[:, b], "mechanism", MECHANISM, **axes))
        marker = {"color": MECHANISM, "size": 6, "line": {"color": "#fff", "width": 1}}
        joints = drawn.joints
        data.append(line(joints[:, a], joints[:, b], "joints", MECHANISM, mode="markers", marker=marker, **axes))
        left = i * (width + gap)
        across, up = f"{'xyz'[a]} (m)", f"{'xyz'[b]} (m)"
        # several panels name both axes below, where they have room
        below = {"text": f"{'xyz'[b]} over {across}<br>from {view}", "font": {"size": 12}}
        made[f"xaxis{suffix}"] = {
            **AXIS,
            "title": below if len(views) > 1 else {"text": across},
            "domain": [left, left + width],
            "anchor": f"y{suffix}",
            "nticks": 6,
        }
        made[f"yaxis{suffix}"] = {
            **AXIS,
            **({} if len(views) > 1 else {"title": {"text": up, "standoff": 4}}),
            "anchor": f"x{suffix}",
            "scaleanchor": f"x{suffix}",
            "scaleratio": 1,
            "nticks": 8,
        }
    return {"data": data, "layout": made}


def turning(drawn: Drawn) -> dict[str, Any] | None:
    """phi(s) of curve and mechanism, as in Figs. 6(c) and 7(c) of paper *acm*."""
    if not drawn.turnings:
        return None
    data = []
    for one, dash in zip(drawn.turnings, ("solid", "dot"), strict=False):
        about = f", {one.axis}" if len(drawn.turnings) > 1 else ""
        style = {"width": 5, "dash": dash}
        data.append(line(drawn.s, one.curve, f"curve{about}", CURVE, line=style, opacity=0.55))
        data.append(line(drawn.s, one.mechanism, f"mechanism{about}", MECHANISM, line={"dash": dash}))
    return {"data": data, "layout": layout("body length from the tail (m)", "turning φ (rad)", 340)}


def distance(drawn: Drawn) -> dict[str, Any]:
    """How far the mechanism is from the curve, along the body."""
    made = layout("body length from the tail (m)", "distance (mm)", 260)
    made["yaxis"]["rangemode"] = "tozero"
    return {"data": [line(drawn.s, 1e3 * drawn.distance, "distance", MECHANISM, showlegend=False)], "layout": made}


def angles(names: Sequence[str], q: Array, limits: Array) -> dict[str, Any]:
    """Joint angles in degrees by joint, pitch and yaw apart, with limits where there are any."""
    data: list[dict[str, Any]] = []
    shown = [label(name) for name in names]
    tidy = np.array([settled(float(angle)) for angle in np.degrees(q)])
    for i, (group, chosen) in enumerate(by_axis(names)):
        x, y = [shown[k] for k in chosen], compact(tidy[chosen], 6)
        data.append({"type": "bar", "x": x, "y": y, "name": group, "marker": {"color": SERIES[i]},
                     "hovertemplate": "%{x}: %{y}°<extra></extra>"})  # fmt: skip
    for side in (0, 1):
        if np.all(np.isfinite(limits[:, side])):
            y = compact(np.degrees(limits[:, side]))
            data.append({"type": "scatter", "mode": "markers", "x": shown, "y": y, "name": "limit",
                         "marker": {"symbol": "line-ew", "size": 10, "line": {"color": "#b3261e", "width": 2}},
                         "showlegend": side == 0, "hoverinfo": "skip"})  # fmt: skip
    made = layout("joint", "angle (deg)", 300, bargap=0.25)
    # else plotly would put all joints of one axis before those of the other
    order = {"categoryorder": "array", "categoryarray": shown}
    made["xaxis"].update({"type": "category", "tickfont": {"size": 10}, **order})
    return {"data": data, "layout": made}


def by_axis(names: Sequence[str]) -> list[tuple[str, list[int]]]:
    """Indices of joints by the letters that their names begin with ("yaw", "pitch")."""
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(names):
        groups.setdefault(name.rstrip("0123456789") or name, []).append(i)
    return list(groups.items()) if len(groups) <= 4 else [("joints", list(range(len(names))))]
