"""The part of a report that shows a snake on its anchors: how it stands, tips, holds itself and fits under ceilings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from bodyplan.gaits.rectilinear.gait import DRIVES
from bodyplan.show import inching_text as words
from bodyplan.show.inching import Inching, NotShown
from bodyplan.show.inching_plots import drive_name, tilts
from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.stages import plain_name
from bodyplan.show.text import (
    NOTHING,
    counted,
    esc,
    figure,
    folded,
    percent,
    picture,
    plot,
    section,
    table,
)
from bodyplan.simulate.trial import Trial

#: cycles from which the table of drives is folded away
MANY_CYCLES = 6
TITLE = "On its anchors"


def inching_section(outcome: Outcome, playback: Playback, pictures: Mapping[str, str]) -> str:
    """The section; empty for other gaits. ``pictures`` are the figures as SVG by name."""
    found = playback.inching
    if found is None:
        return ""
    if isinstance(found, NotShown):
        return section("anchors", TITLE, f"<p>Not drawn: {esc(found.problem)}</p>")
    found_tilts = tilts(playback)
    peak = None
    if found_tilts is not None and outcome.trial is not None and outcome.trial.ok:
        k = int(found_tilts[1].argmax())
        peak = float(found_tilts[0][k]), float(found_tilts[1][k])
    said = [*words.standing(found), words.physics(found, outcome.trial, peak), words.drives(found)]
    out = "".join(f"<p>{text}</p>" for text in said if text)
    if "side_views" in pictures:
        alt = "The body on its anchors from the side at key times, with floor, ceiling, centre of mass and support"
        out += picture(pictures["side_views"], alt)
    if "footholds" in pictures:
        out += picture(pictures["footholds"], "The whole way from the side, and the places where each anchor stood")
    out += _moves(found, outcome.trial) + _drives(found)
    out += plot(
        "support",
        "How far the centre of mass is inside the standing anchors, planned"
        + (", over one cycle." if found.cyclic else "."),
    )
    out += plot("tilt", "Angle between the planned and the executed base; it begins when the robot has settled.")
    loads = words.holding(found, outcome.trial)
    if loads:
        out += f"<h3>What it takes to hold itself</h3><p>{loads}</p>" + plot("holding") + plot("holding_joints")
    if np.isfinite(found.ceiling.z).any():
        out += "<h3>Room under the ceiling</h3>" + plot("under_ceiling", "The smallest gap of the whole body.")
    return section("anchors", TITLE, out + _speeds(found))


class MoveRow(NamedTuple):
    """Moves of one name, so many ``times``: the least ``margin`` m and whether it is to the ``front``, the peak
    ``torque`` N m with its ``joint``, the lift ``planned`` and ``executed`` m of the least share, the largest ``slip``
    m along the way and the farthest, ``far`` m."""

    name: str
    times: int
    margin: float | None
    front: bool
    torque: float | None
    joint: str
    planned: float | None
    executed: float | None
    slip: float | None
    far: float | None


def move_rows(found: Inching, trial: Trial | None) -> list[MoveRow]:
    """One row for all moves of one name."""
    groups: dict[str, list[int]] = {}
    for k, move in enumerate(found.moves):
        groups.setdefault(plain_name(move[0]), []).append(k)
    out = []
    for name, some in groups.items():
        inside = np.unique(np.concatenate([found.inside(found.moves[k]) for k in some])).astype(int)
        margin, front, torque, joint = None, False, None, ""
        if found.margin is not None and found.centre is not None and len(inside):
            k = int(inside[found.margin[inside].argmin()])
            margin = float(found.margin[k])
            front = bool(found.front[k] - found.centre[k, 0] < found.centre[k, 0] - found.rear[k])
        if found.motion.torques is not None and len(inside):
            peaks = np.abs(found.motion.torques[inside]).max(axis=0)
            torque, joint = float(peaks.max(initial=0.0)), found.motion.joints[int(peaks.argmax())]
        lifts, slips = [], []
        if trial is not None and trial.ok:
            lifts = [x for x in trial.lifts if plain_name(x.stage) == name and x.planned > 0.0]
            slips = [x for x in trial.slips if plain_name(x.stage) == name]
        least = min(lifts, key=lambda x: x.executed / x.planned) if lifts else None
        out.append(
            MoveRow(
                name,
                len(some),
                margin,
                front,
                torque,
                joint,
                None if least is None else least.planned,
                None if least is None else least.executed,
                max((x.along for x in slips), key=abs) if slips else None,
                max(x.largest for x in slips) if slips else None,
            )
        )
    return out


def _moves(found: Inching, trial: Trial | None) -> str:
    rows = []
    for row in move_rows(found, trial):
        tips = row.margin is not None and row.margin < -1e-9
        side = "" if row.margin is None else f" to the {'front' if row.front else 'rear'}"
        margin = figure(row.margin, "m", 3) + side
        lifted = NOTHING
        if row.planned is not None and row.executed is not None:
            lifted = f"{figure(row.executed, 'm', 3)} of {figure(row.planned, 'm', 3)}"
        share = None if row.planned is None or row.executed is None else row.executed / row.planned
        rows.append(
            (
                esc(row.name) + (f" ({row.times} times)" if row.times > 1 else ""),
                f'<span class="bad">{margin}, tips</span>' if tips else margin,
                figure(row.torque, "N m", 3) + (f" ({esc(row.joint)})" if row.joint else ""),
                lifted,
                percent(share),
                figure(row.slip, "m", 3),
                figure(row.far, "m", 3),
            )
        )
    if not rows:
        return ""
    head = ("move", "least support margin", "largest holding torque", "rise executed of planned", "share", "slip along",
            "farthest slip")  # fmt: skip
    return "<h3>Move by move</h3>" + table(head, rows, numbers=range(1, 7))


def _drives(found: Inching) -> str:
    """How far each anchor goes, cycle by cycle, where it does not repeat."""
    made = found.drives
    if found.cyclic or not len(made):
        return ""
    names = ["tail", "middle", "head"] if made.shape[1] == 3 else [f"anchor {i + 1}" for i in range(made.shape[1])]
    rows = [
        (str(k + 1), *(figure(float(x), "m", 4) for x in row), figure(float(row.mean()), "m", 4))
        for k, row in enumerate(made)
    ]
    content = table(("cycle", *names, "mean"), rows, numbers=range(len(names) + 2))
    title = f"How far each anchor goes in {counted(len(rows), 'cycle')}"
    return folded(f"<b>{title}</b>", content, opened=len(rows) <= MANY_CYCLES)


def _speeds(found: Inching) -> str:
    """Speed against ceiling height for the three drives."""
    rows = found.under
    if not rows:
        return ""
    cells = [
        (
            figure(row.ceiling, "m", 3),
            *(figure(row.speed[drive], "m/s", 3) for drive in DRIVES),
            *(figure(row.stride[drive], "m", 3) for drive in DRIVES),
        )
        for row in rows
    ]
    names = [drive_name(drive, found.gait.share) for drive in DRIVES]
    head = ("ceiling", *(f"speed, {name}" for name in names), *(f"stride, {name}" for name in names))
    return (
        f"<h3>Speed under lower and higher ceilings</h3><p>{words.speeds(found, rows)}</p>"
        + plot("ceilings")
        + folded(f"Table of {counted(len(rows), 'height')}", table(head, cells, numbers=range(7)), opened=True)
    )
