"""Figures of a run as matplotlib draws them, without any global state: for papers and slides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.errors import MissingExtraError
from bodyplan.show.carrying_figures import wheels_above, wheels_maps
from bodyplan.show.crawling_figures import walk_figure
from bodyplan.show.following_page import following_figure
from bodyplan.show.grids import grid_figure
from bodyplan.show.inching_figures import footholds, side_views
from bodyplan.show.keyframes import body_keyframes
from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.schedule import schedule_figure
from bodyplan.show.series import EXECUTED, LIMIT, PLANNED, JointGroup, crest, joint_groups, loads, one_cycle
from bodyplan.show.stages import Stage, StageRow, few, lag_by_phase, lanes, shades, stage_rows, stages_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: style of all figures; the salt makes equal runs give equal SVG files
STYLE = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "#e4e6e8",
    "axes.axisbelow": True,
    "svg.hashsalt": "bodyplan",
    "figure.constrained_layout.use": True,
    "legend.frameon": False,
}
WIDTH = 8.6  # inches
STRIPES = ("#c3ced9", "#dfe6ec")


def new_figure(height: float) -> Figure:
    """An empty figure of the standard width; MissingExtraError where matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtraError("matplotlib", "report", "drawing figures") from error
    return Figure(figsize=(WIDTH, height))


def figures(outcome: Outcome, playback: Playback) -> dict[str, Figure]:
    """Every figure that this outcome gives, by name."""
    makers: dict[str, Callable[[Outcome, Playback], Figure | None]] = {
        # plates would cover each other: a body on wheels has a figure of its own
        "body_keyframes": lambda o, p: None if p.carrying else body_keyframes(p, new_figure),
        "joint_angles": joint_angles,
        "joint_rates": joint_rates,
        "advance": advance,
        "slip_by_stage": slip_by_stage,
        "torque": torque,
        "curve_and_mechanism": lambda o, p: following_figure(p.following, new_figure),
        "walk": lambda o, p: walk_figure(o.motion, new_figure),
        "wheels_above": lambda o, p: wheels_above(p, new_figure),
        "wheels_maps": lambda o, p: wheels_maps(p.carrying, new_figure),
        "side_views": lambda o, p: side_views(p.inching, new_figure),
        "footholds": lambda o, p: footholds(p.inching, new_figure),
        "contacts": lambda o, p: schedule_figure(p, new_figure),
        "grid": lambda o, p: grid_figure(o.grid, new_figure),
    }
    made = {name: make(outcome, playback) for name, make in makers.items()}
    return {name: figure for name, figure in made.items() if figure is not None}


def write_figures(outcome: Outcome, playback: Playback, folder: Path) -> dict[str, str]:
    """Write every figure as PNG and SVG into ``folder`` and return the SVG texts by name."""
    new_figure(1.0)  # says what is missing before anything else fails
    from matplotlib import rc_context

    folder.mkdir(parents=True, exist_ok=True)
    with rc_context(STYLE):  # type: ignore[arg-type]  # the stubs list every key
        for name, figure in figures(outcome, playback).items():
            figure.savefig(folder / f"{name}.png", dpi=150, metadata={"Software": None})
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
    return {path.stem: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.svg"))}


def joint_angles(outcome: Outcome, playback: Playback) -> Figure | None:
    """Joint coordinates over one cycle: all as a map, and as curves."""
    return _joint_figure(playback, playback.motion.q, lambda g: f"joint {g.kind} ({g.unit})", False)


def joint_rates(outcome: Outcome, playback: Playback) -> Figure | None:
    """Joint rates over one cycle: all as a map, and the fastest joint with its limit."""
    return _joint_figure(playback, playback.motion.qd, lambda g: f"joint rate ({g.rate_unit})", True)


def _joint_figure(playback: Playback, values: Any, label: Callable[[JointGroup], str], rates: bool) -> Figure | None:
    groups = joint_groups(playback.motion)
    if not groups:
        return None
    chosen = one_cycle(playback)
    t = playback.motion.t[chosen] - playback.motion.t[0]
    figure = new_figure(5.2 * len(groups))
    axes = figure.subplots(2 * len(groups), 1, sharex=True, squeeze=False, height_ratios=[1.5, 1.0] * len(groups))[:, 0]
    for group, (top, below) in zip(groups, axes.reshape(-1, 2), strict=True):
        shown = values[np.ix_(chosen, group.columns)]
        most = float(np.abs(shown).max(initial=0.0)) or 1.0
        rows = np.arange(len(group.names)) + 1
        mesh = top.pcolormesh(
            t, rows, shown.T, cmap="RdBu_r", vmin=-most, vmax=most, shading="nearest", rasterized=True
        )
        top.grid(False)
        top.set_ylabel("joint")
        _name_rows(top, group.names)
        figure.colorbar(mesh, ax=top, label=label(group), pad=0.01)
        below.set_ylabel(label(group))
        if rates:
            below.plot(t, np.abs(shown).max(axis=1), color=PLANNED)
            below.set_ylabel(f"fastest joint ({group.rate_unit})")
            limit = playback.motion.robot.rates[group.columns].min()
            if limit <= 2.0 * most:
                below.axhline(limit, color=LIMIT, linestyle="--", label="smallest rate limit")
                below.legend(loc="lower right")
            below.set_ylim(0.0)
        else:
            _lines(below, t, shown, group.names)
    axes[-1].set_xlabel("time (s)")
    return figure


def _lines(ax: Axes, t: Any, values: Any, names: Sequence[str]) -> None:
    from matplotlib import colormaps

    colours = colormaps["viridis"](np.linspace(0.0, 0.92, len(names)))
    for k, name in enumerate(names):
        ax.plot(t, values[:, k], color=colours[k], linewidth=0.9, label=name)
    if len(names) <= 12:
        ax.legend(loc="upper right", ncols=min(len(names), 6), fontsize=7)


def _name_rows(ax: Axes, names: Sequence[str]) -> None:
    step = max(1, -(-len(names) // 14))
    ax.set_yticks(np.arange(1, len(names) + 1, step), names[::step], fontsize=7)


def advance(outcome: Outcome, playback: Playback) -> Figure:
    """Advance over time, planned and executed, above the stages."""
    stages = stages_of(playback) if few(stages_of(playback), playback.cycles) else []
    figure = new_figure(3.6 + (0.12 * (max(lanes(stages)) + 1) if stages else 0.0))
    if stages:
        top, strip = figure.subplots(2, 1, sharex=True, height_ratios=[10.0, 0.8 + 0.4 * max(lanes(stages))])
        _strip(strip, stages, playback)
    else:
        top = figure.subplots()
    top.plot(
        playback.t,
        1e3 * playback.advance(playback.planned_centre),
        color=PLANNED,
        linestyle="--",
        label="planned",
    )
    if playback.executed_centre is not None:
        time = playback.t[: len(playback.executed_centre)]
        top.plot(time, 1e3 * playback.advance(playback.executed_centre), color=EXECUTED, label="executed")
    for cycle in range(1, playback.cycles):
        top.axvline(cycle * playback.span, color="#9aa5b1", linewidth=0.8)
    top.set_ylabel("advance of the centre of mass (mm)")
    top.legend(loc="upper left")
    figure.axes[-1].set_xlabel("time (s)")
    return figure


def _strip(ax: Axes, stages: Sequence[Stage], playback: Playback) -> None:
    """The stages as bars, line under line where they overlap, in every cycle; named where there is room."""
    until = float(playback.t[-1])
    for cycle in range(playback.cycles):
        for (name, start, end), lane, shade in zip(stages, lanes(stages), shades(stages), strict=True):
            left, width = cycle * playback.span + start, min(end, until - cycle * playback.span) - start
            if width <= 0.0:
                continue
            ax.broken_barh([(left, width)], (-lane - 0.45, 0.9), color=STRIPES[shade])
            if width / until > 0.011 * len(name):
                ax.text(left + 0.5 * width, -lane, name, ha="center", va="center", fontsize=6)
    ax.set_yticks([])
    ax.set_ylabel("stages", rotation=0, ha="right", va="center")
    ax.grid(False)
    ax.spines["left"].set_visible(False)


def slip_by_stage(outcome: Outcome, playback: Playback) -> Figure | None:
    """Where the advance is lost: slip and lag of every stage, and the lag through a cycle."""
    rows = stage_rows(playback, outcome.trial)
    gained = lag_by_phase(playback)
    if gained is None or not rows:
        return None
    cyclic = playback.period is not None
    figure = new_figure(max(3.2, 1.1 + 0.24 * len(rows)))
    bars, curve = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
    _slip_bars(bars, rows)
    bars.set_xlabel(f"mm {'a cycle ' if cyclic else ''}along the planned advance")
    phase, lag = gained
    for k, one in enumerate(lag):
        curve.plot(
            phase,
            1e3 * one,
            color=EXECUTED,
            alpha=0.35,
            linewidth=0.8,
            label="each cycle" if k == 0 else None,
        )
    curve.plot(phase, 1e3 * lag.mean(axis=0), color=EXECUTED, label="mean")
    curve.axhline(0.0, color="#555", linewidth=0.8)
    curve.set_xlabel("time in the cycle (s)" if cyclic else "time (s)")
    curve.set_ylabel("executed − planned advance (mm)")
    curve.set_title(f"Advance lost{' through a cycle' if cyclic else ''}")
    curve.legend(loc="lower left")
    return figure


def _slip_bars(ax: Axes, rows: Sequence[StageRow]) -> None:
    place = np.arange(len(rows))
    slip = [np.nan if row.along is None else 1e3 * row.along for row in rows]
    lag = [np.nan if row.lag is None else 1e3 * row.lag for row in rows]
    ax.barh(place - 0.2, slip, 0.38, color="#56b4e9", label="slip of the parts meant to rest")
    ax.barh(place + 0.2, lag, 0.38, color=EXECUTED, label="executed − planned advance")
    ax.axvline(0.0, color="#555", linewidth=0.8)
    ax.set_yticks(place, [row.name for row in rows], fontsize=7)
    ax.invert_yaxis()
    ax.set_title("Stage by stage")
    ax.legend(loc="upper center", bbox_to_anchor=(0.4, -0.12 - 0.25 / len(rows)), fontsize=7, ncols=2)


def torque(outcome: Outcome, playback: Playback) -> Figure | None:
    """Load of the actuators: the most loaded joint over time, and peak and rms joint by joint."""
    found = loads(playback.motion, outcome.trial)
    groups = joint_groups(playback.motion)
    if found is None or not groups:
        return None
    t, load = found
    trial = outcome.trial
    figure = new_figure(4.6 * len(groups))
    axes = figure.subplots(2 * len(groups), 1, squeeze=False)[:, 0]
    colour = PLANNED if trial is None or not trial.ok else EXECUTED
    for group, (over_time, by_joint) in zip(groups, axes.reshape(-1, 2), strict=True):
        mine = np.abs(load[:, group.columns])
        over_time.plot(*crest(t, mine.max(axis=1)), color=colour, linewidth=0.9)
        over_time.set_ylabel(f"largest {group.load_name}")
        over_time.set_xlabel("time (s)")
        over_time.set_ylim(0.0)
        peak, rms = peak_and_rms(load, outcome, group)
        place = np.arange(len(group.names))
        by_joint.bar(place - 0.2, peak, 0.4, color=colour, label="peak")
        by_joint.bar(place + 0.2, rms, 0.4, color="#56b4e9", label="rms")
        by_joint.set_xticks(place, group.names, rotation=90, fontsize=7)
        by_joint.set_ylabel(group.load_name)
        by_joint.legend(loc="upper right", ncols=2)
    return figure


def peak_and_rms(load: Any, outcome: Outcome, group: JointGroup) -> tuple[Any, Any]:
    """Largest and root mean square load (g,) of a group of joints: of every time step where the trial has
    them, else of the samples ``load`` (k, n)."""
    trial = outcome.trial
    if trial is not None and trial.torque_peak is not None and trial.torque_rms is not None:
        return trial.torque_peak[group.columns], trial.torque_rms[group.columns]
    mine = load[:, group.columns]
    return np.abs(mine).max(axis=0), np.sqrt(np.mean(mine**2, axis=0))
