"""The report's interactive plots, as plain plotly figure descriptions (data and layout)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.carrying_plots import carrying_plots
from bodyplan.show.crawling import crawling_plots
from bodyplan.show.figures import STRIPES, peak_and_rms
from bodyplan.show.following_page import following_plots
from bodyplan.show.grids import grid_plot
from bodyplan.show.inching_plots import inching_plots
from bodyplan.show.layout import label, layout, line
from bodyplan.show.outcome import Outcome, five_point_gaps, five_point_rates
from bodyplan.show.playback import Playback
from bodyplan.show.schedule import schedule_plot
from bodyplan.show.series import (
    EXECUTED,
    LIMIT,
    PLANNED,
    JointGroup,
    compact,
    crest,
    joint_groups,
    loads,
    one_cycle,
)
from bodyplan.show.stages import few, lag_by_phase, lanes, shades, stage_rows, stages_of

Plot = dict[str, Any]
LIGHT = "#56b4e9"
#: blue for negative, white for zero, red for positive: also apart for colour-blind eyes
DIVERGING = [
    [0.0, "#053061"],
    [0.2, "#2f79b5"],
    [0.4, "#bfdceb"],
    [0.5, "#f7f7f7"],
    [0.6, "#fac8af"],
    [0.8, "#c53e3d"],
    [1.0, "#67001f"],
]


def plots(outcome: Outcome, playback: Playback) -> dict[str, Plot]:
    """Every plot that this outcome gives, by name."""
    made: dict[str, Plot | None] = {
        "advance": advance(playback),
        "slip": slip(outcome, playback),
        "lag": lag(playback),
        "five_point": five_point(outcome),
        "contacts": schedule_plot(playback),
        "grid": grid_plot(outcome.grid),
        **following_plots(playback.following),
        **inching_plots(outcome, playback),
        **crawling_plots(outcome.motion),
        **carrying_plots(outcome, playback.carrying),
    }
    for group in joint_groups(playback.motion):
        made[f"angles_{group.kind}"] = heat_map(playback, group, playback.motion.q, f"joint {group.kind}", group.unit)
        made[f"rates_{group.kind}"] = heat_map(playback, group, playback.motion.qd, "joint rate", group.rate_unit)
        made[f"fastest_{group.kind}"] = fastest(playback, group)
        made[f"load_{group.kind}"] = load_over_time(outcome, group)
        made[f"loads_{group.kind}"] = load_by_joint(outcome, group)
    return {name: plot for name, plot in made.items() if plot is not None}


def _thin(values: Array, most: int = 600) -> Any:
    return np.unique(np.linspace(0, len(values) - 1, min(len(values), most)).round().astype(int))


def advance(playback: Playback) -> Plot:
    """Advance over time, planned and executed, above the stages."""
    chosen = _thin(playback.t)
    planned = 1e3 * playback.advance(playback.planned_centre)
    data = [line(playback.t[chosen], planned[chosen], "planned", PLANNED, line={"dash": "dash"})]
    if playback.executed_centre is not None and len(playback.executed_centre):
        executed = 1e3 * playback.advance(playback.executed_centre)
        shown = chosen[chosen < len(executed)]
        data.append(line(playback.t[shown], executed[shown], "executed", EXECUTED))
    made = layout("time (s)", "advance (mm)", 380)
    made["shapes"] = [
        {
            "type": "line",
            "x0": c * playback.span,
            "x1": c * playback.span,
            "y0": 0,
            "y1": 1,
            "yref": "paper",
            "line": {"color": "#9aa5b1", "width": 1},
        }
        for c in range(1, playback.cycles)
    ]
    return _with_stages({"data": data, "layout": made}, playback, playback.cycles)


def _with_stages(plot: Plot, playback: Playback, cycles: int) -> Plot:
    """The plot with a strip of the stages under it."""
    stages = stages_of(playback)
    if not few(stages, cycles):
        return plot
    lines = 1 + max(lanes(stages))
    share = min(0.07 * lines, 0.3)
    until = float(playback.t[-1]) if cycles > 1 or playback.period is None else playback.span
    bars: list[tuple[float, float, int, str, str]] = []
    for cycle in range(cycles):
        shift = cycle * playback.span
        for (name, start, end), lane, shade in zip(stages, lanes(stages), shades(stages), strict=True):
            stop = min(shift + end, until)
            if stop > shift + start:
                bars.append((shift + start, stop - shift - start, -lane, label(name), STRIPES[shade]))
    left, width, lane_of, names, colors = zip(*bars, strict=True)
    plot["data"].append(
        {
            "type": "bar",
            "orientation": "h",
            "base": compact(left),
            "x": compact(width),
            "y": list(lane_of),
            "width": 0.9,
            "yaxis": "y2",
            "marker": {"color": list(colors)},
            "customdata": list(names),
            "text": list(names),
            "textposition": "inside",
            "insidetextanchor": "middle",
            "constraintext": "inside",
            "textangle": 0,
            "textfont": {"size": 9, "color": "#33404d"},
            "hovertemplate": "%{customdata}<extra></extra>",
            "showlegend": False,
            "cliponaxis": True,
        }
    )
    # names that do not fit into their bar are for the pointer only
    plot["layout"]["uniformtext"] = {"mode": "hide", "minsize": 9}
    plot["layout"]["yaxis"]["domain"] = [share + 0.06, 1.0]
    plot["layout"]["yaxis2"] = {
        "domain": [0.0, share],
        "range": [0.5 - lines, 0.5],
        "visible": False,
        "fixedrange": True,
    }
    plot["layout"]["xaxis"]["anchor"] = "y2"
    plot["layout"]["height"] += 14 * lines
    return plot


def slip(outcome: Outcome, playback: Playback) -> Plot | None:
    """Slip and loss of advance stage by stage."""
    rows = stage_rows(playback, outcome.trial)
    measured = [r for r in rows if r.along is not None or r.lag is not None]
    if not measured:
        return None
    names = [label(row.name) for row in measured]

    def bar(values: Sequence[float | None], name: str, color: str) -> dict[str, Any]:
        scaled = np.array([np.nan if v is None else 1e3 * v for v in values])
        return {
            "type": "bar",
            "orientation": "h",
            "y": names,
            "x": compact(scaled, 4),
            "name": name,
            "marker": {"color": color},
            "hovertemplate": "%{y}: %{x} mm<extra></extra>",
        }

    made = layout(
        f"mm {'a cycle ' if playback.period is not None else ''}along the plan",
        "",
        120 + 26 * len(names),
        barmode="group",
        bargap=0.25,
    )
    made["yaxis"].update({"autorange": "reversed", "tickfont": {"size": 11}, "type": "category"})
    made["xaxis"].update({"zeroline": True, "zerolinecolor": "#555"})
    data = [
        bar([r.along for r in measured], "slip of the parts meant to rest", LIGHT),
        bar([r.lag for r in measured], "executed − planned advance", EXECUTED),
    ]
    return {"data": data, "layout": made}


def lag(playback: Playback) -> Plot | None:
    """Executed minus planned advance through a cycle."""
    found = lag_by_phase(playback)
    if found is None:
        return None
    phase, gained = found
    data = [
        line(phase, 1e3 * one, f"cycle {k + 1}", "#9ecae8", line={"width": 1}, showlegend=False)
        for k, one in enumerate(gained[:20])
    ]
    cyclic = playback.period is not None
    data.append(line(phase, 1e3 * gained.mean(axis=0), "mean of the cycles", EXECUTED, showlegend=cyclic))
    made = layout("time in the cycle (s)" if cyclic else "time (s)", "executed − planned (mm)", 320)
    return _with_stages({"data": data, "layout": made}, playback, 1)


def heat_map(playback: Playback, group: JointGroup, values: Array, name: str, unit: str) -> Plot:
    """A quantity of every joint over one cycle."""
    chosen = one_cycle(playback)
    shown = values[np.ix_(chosen, group.columns)].T
    most = float(np.abs(shown).max(initial=0.0)) or 1.0
    trace = {
        "type": "heatmap",
        "x": compact(playback.motion.t[chosen] - playback.motion.t[0]),
        "y": [label(name) for name in group.names],
        "z": compact(shown, 4),
        "zmin": -most,
        "zmax": most,
        "colorscale": DIVERGING,
        "colorbar": {"title": {"text": unit}, "thickness": 12, "len": 0.9},
        "hovertemplate": "%{y}, %{x} s: %{z} " + unit + "<extra></extra>",
    }
    made = layout("time (s)", "", max(260, 110 + 13 * len(group.names)))
    made["title"] = {"text": f"{name} ({unit})", "font": {"size": 14}, "x": 0.01, "y": 0.985}
    made["yaxis"].update({"tickfont": {"size": 10}, "type": "category"})
    made["margin"]["r"] = 6
    return {"data": [trace], "layout": made}


def fastest(playback: Playback, group: JointGroup) -> Plot:
    """The rate of the fastest joint over one cycle."""
    chosen = one_cycle(playback, 10**6)
    rate = np.abs(playback.motion.qd[np.ix_(chosen, group.columns)]).max(axis=1)
    t = playback.motion.t[chosen] - playback.motion.t[0]
    made = layout("time (s)", f"fastest joint ({group.rate_unit})", 240)
    made["yaxis"]["rangemode"] = "tozero"
    data = [line(*crest(t, rate), "planned", PLANNED, showlegend=False)]
    limit = float(playback.motion.robot.rates[group.columns].min())
    if limit <= 2.0 * float(rate.max(initial=0.0)):
        data.append(line([t[0], t[-1]], [limit, limit], "rate limit", LIMIT, line={"dash": "dot"}))
    return {"data": data, "layout": made}


def load_over_time(outcome: Outcome, group: JointGroup) -> Plot | None:
    """The most loaded joint over time."""
    found = loads(outcome.motion, outcome.trial)
    if found is None:
        return None
    t, load = found
    made = layout("time (s)", f"largest {group.load_name}", 280)
    made["yaxis"]["rangemode"] = "tozero"
    curve = crest(t, np.abs(load[:, group.columns]).max(axis=1))
    return {
        "data": [line(*curve, "largest of all joints", _source_color(outcome), showlegend=False)],
        "layout": made,
    }


def load_by_joint(outcome: Outcome, group: JointGroup) -> Plot | None:
    """Peak and rms load, joint by joint."""
    found = loads(outcome.motion, outcome.trial)
    if found is None:
        return None
    peak, rms = peak_and_rms(found[1], outcome, group)
    bars = [
        {
            "type": "bar",
            "x": [label(name) for name in group.names],
            "y": compact(values, 4),
            "name": name,
            "marker": {"color": color},
            "hovertemplate": "%{x}: %{y} " + group.load + "<extra></extra>",
        }
        for name, values, color in (("peak", peak, _source_color(outcome)), ("rms", rms, LIGHT))
    ]
    made = layout("joint", group.load_name, 300, barmode="group", bargap=0.2)
    made["xaxis"].update({"type": "category", "tickfont": {"size": 10}})
    return {"data": bars, "layout": made}


def _source_color(outcome: Outcome) -> str:
    return EXECUTED if outcome.trial is not None and outcome.trial.ok else PLANNED


def five_point(outcome: Outcome) -> Plot | None:
    """How far the five-point formula is from the exact rates and accelerations, worst joint over time."""
    motion = outcome.motion
    if not five_point_gaps(motion):
        return None
    rate, acceleration = five_point_rates(motion)
    t = motion.t - motion.t[0]
    data = []
    for taken, exact, name, color in (
        (rate, motion.qd, "rate (rad/s)", PLANNED),
        (acceleration, motion.qdd, "acceleration (rad/s²)", EXECUTED),
    ):
        # zero has no place on a logarithmic axis
        gap = np.maximum(np.abs(taken - exact).max(axis=1), 1e-16)
        data.append(line(*crest(t, gap), name, color, line={"width": 1.4}))
    made = layout("time (s)", "five-point − exact, worst joint", 300)
    made["yaxis"].update({"type": "log", "exponentformat": "power"})
    return {"data": data, "layout": made}
