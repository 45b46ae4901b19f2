"""Plots of a snake on its anchors: margin, tilt, torque and room under the ceiling over time; speed over height."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.rectilinear.gait import DRIVES
from bodyplan.show.inching import Inching
from bodyplan.show.layout import label, layout, line
from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.series import EXECUTED, LIMIT, PLANNED, SERIES, compact, crest, joint_groups
from bodyplan.simulate.reference import Reference
from bodyplan.spatial.rotations import rotate

Plot = dict[str, Any]
#: most points of a curve
MOST = 750


def drive_name(drive: str, share: float) -> str:
    """What a drive is called."""
    return {"periodic": f"periodic, at most {share:.0%}", "paper": f"{share:.0%} rule"}.get(drive, drive)


def inching_plots(outcome: Outcome, playback: Playback) -> dict[str, Plot | None]:
    """Every plot of the section, by name; empty for other gaits."""
    found = playback.inching
    if not isinstance(found, Inching):
        return {}
    return {
        "support": support(found),
        "tilt": tilt(playback),
        "holding": holding(outcome, playback),
        "holding_joints": holding_by_joint(outcome),
        "under_ceiling": under_ceiling(found, playback),
        "ceilings": ceilings(found),
    }


def support(found: Inching) -> Plot | None:
    """The planned margin over time, red where it tips."""
    if found.margin is None:
        return None
    t, lowest = crest(found.t, -found.margin, MOST)
    margin = -1e3 * lowest  # the least of each stretch of samples
    data = [line(t, margin, "margin", PLANNED, showlegend=False)]
    below = np.where(margin < 0.0, margin, np.nan)
    made = layout("time (s)", "support margin (mm)", 300)
    made["shapes"] = [{"type": "line", "x0": 0, "x1": 1, "xref": "paper", "y0": 0, "y1": 0,
                       "line": {"color": LIMIT, "width": 1.5, "dash": "dot"}}]  # fmt: skip
    if np.isfinite(below).any():
        data.append(line(t, below, "tips", LIMIT, line={"width": 3}, connectgaps=False))
        made["shapes"].append({"type": "rect", "x0": 0, "x1": 1, "xref": "paper", "y0": float(1.1 * np.nanmin(below)),
                               "y1": 0, "fillcolor": LIMIT, "opacity": 0.08, "line": {"width": 0}})  # fmt: skip
    else:
        made["yaxis"]["rangemode"] = "tozero"
    return {"data": data, "layout": made}


def tilts(playback: Playback) -> tuple[Array, Array] | None:
    """Times (k,) s and angles (k,) rad between the planned and the executed z axis of the base; None where nothing was
    executed."""
    if playback.executed is None or not len(playback.executed):
        return None
    up = np.array([0.0, 0.0, 1.0])
    executed = rotate(playback.executed[:, 0, 3:], up)
    planned = rotate(playback.planned[: len(executed), 0, 3:], up)
    sine = np.linalg.norm(np.cross(planned, executed), axis=1)
    angle = np.arctan2(sine, np.sum(planned * executed, axis=1))
    return playback.t[: len(executed)], np.asarray(angle)


def tilt(playback: Playback) -> Plot | None:
    """Tilt of the executed base over time."""
    found = tilts(playback)
    if found is None:
        return None
    made = layout("time (s)", "tilt of the base (°)", 240)
    made["yaxis"]["rangemode"] = "tozero"
    return {"data": [line(found[0], np.degrees(found[1]), "executed", EXECUTED, showlegend=False)], "layout": made}


def holding(outcome: Outcome, playback: Playback) -> Plot | None:
    """The largest torque of all joints over time: what holds the planned pose, and what the servos gave."""
    motion, trial = outcome.motion, outcome.trial
    if motion.torques is None:
        return None
    largest = np.abs(motion.torques).max(axis=1)
    until = float(playback.t[-1])
    t = motion.t - motion.t[0]
    period = Reference.of(motion).period
    if period is not None and until > period:
        inside = t < period * (1.0 - 1e-9)
        turns = np.arange(int(np.ceil(until / period - 1e-9)))
        t = (turns[:, None] * period + t[inside]).ravel()
        largest = np.tile(largest[inside], len(turns))
    kept = t <= until + 1e-9
    data = [line(*crest(t[kept], largest[kept], MOST), "holds the planned pose", PLANNED)]
    if trial is not None and trial.ok:
        measured = trial.t >= trial.start_time - 1e-9
        given = np.abs(trial.torque[measured]).max(axis=1)
        data.append(line(*crest(trial.t[measured] - trial.start_time, given, MOST), "executed", EXECUTED))
    made = layout("time (s)", "largest torque of a joint (N m)", 300)
    made["yaxis"]["rangemode"] = "tozero"
    limit = float(motion.robot.efforts.min())
    if limit <= 2.0 * float(largest.max(initial=0.0)):
        data.append(line([0.0, until], [limit, limit], "smallest effort limit", LIMIT, line={"dash": "dot"}))
    return {"data": data, "layout": made}


def holding_by_joint(outcome: Outcome) -> Plot | None:
    """Peak torque joint by joint, planned and executed."""
    motion, trial = outcome.motion, outcome.trial
    if motion.torques is None:
        return None
    group = joint_groups(motion)[0]
    series = [("holds the planned pose", np.abs(motion.torques).max(axis=0), PLANNED)]
    if trial is not None and trial.torque_peak is not None:
        series.append(("executed", trial.torque_peak, EXECUTED))
    bars = [
        {
            "type": "bar",
            "x": [label(name) for name in group.names],
            "y": compact(peak[group.columns], 4),
            "name": name,
            "marker": {"color": color},
            "hovertemplate": "%{x}: %{y} N m<extra></extra>",
        }
        for name, peak, color in series
    ]
    made = layout("joint", "peak torque (N m)", 300, barmode="group", bargap=0.2)
    made["xaxis"].update({"type": "category", "tickfont": {"size": 10}})
    return {"data": bars, "layout": made}


def under_ceiling(found: Inching, playback: Playback) -> Plot | None:
    """The smallest gap between body and ceiling over time, planned and executed."""
    tracks = [("planned", playback.planned, PLANNED, {"dash": "dash"})]
    if playback.executed is not None and len(playback.executed):
        tracks.append(("executed", playback.executed, EXECUTED, {}))
    data = []
    for name, poses, color, style in tracks:
        gap = found.ceiling_gap(poses)
        if gap is None:
            return None
        t, lowest = crest(playback.t[: len(poses)], -gap, MOST)
        data.append(line(t, -1e3 * lowest, name, color, line=style))
    made = layout("time (s)", "body to ceiling (mm)", 260)
    made["yaxis"]["rangemode"] = "tozero"
    return {"data": data, "layout": made}


def ceilings(found: Inching) -> Plot | None:
    """Speed over the height of a ceiling, a line a drive."""
    rows = found.under
    data = []
    for drive, color in zip(DRIVES, SERIES, strict=False):
        pairs = [(row.ceiling, row.speed[drive]) for row in rows if row.speed[drive] is not None]
        if pairs:
            height, speed = 1e3 * np.array(pairs, dtype=float).T
            style = {"dash": {"fastest": "solid", "periodic": "dash", "paper": "dot"}[drive]}
            data.append(
                line(height, speed, drive_name(drive, found.gait.share), color, mode="lines+markers", line=style)
            )
    if not data:
        return None
    made = layout("ceiling above the line of the anchors (mm)", "speed (mm/s)", 340)
    made["yaxis"]["rangemode"] = "tozero"
    if np.isfinite(found.room) and found.track.level:
        made["shapes"] = [{"type": "line", "x0": 1e3 * found.room, "x1": 1e3 * found.room, "y0": 0, "y1": 1,
                           "yref": "paper", "line": {"color": "#55616d", "width": 1.2, "dash": "dot"}}]  # fmt: skip
        made["annotations"] = [{"x": 1e3 * found.room, "y": 1, "yref": "paper", "text": "here", "showarrow": False,
                                "xanchor": "right", "yanchor": "top", "xshift": -4}]  # fmt: skip
    return {"data": data, "layout": made}
