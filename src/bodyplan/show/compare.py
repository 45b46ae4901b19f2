"""Runs side by side: what was asked for, what the judge says, every number, tracks of the bodies; one page."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.motion import Motion
from bodyplan.show.dimensions import si_unit
from bodyplan.show.document import document
from bodyplan.show.layout import label, layout, line
from bodyplan.show.series import SERIES
from bodyplan.show.text import NOTHING, esc, figure, folded, plain, plot, section, table, words

#: runs that one page can tell apart
MOST = 6
#: relative difference below which two numbers are the same
SAME = 1e-6
#: samples of a curve that are drawn
DRAWN = 600
#: where a number is from -> the word for it
GROUPS = {"plan": "planned", "trial": "physics"}
#: what a reader asks for first, of plan and trial
KEY = (
    ("trial", "advance_ratio"),
    ("trial", "speed_m_s"),
    ("plan", "speed"),
    ("plan", "advance_per_cycle"),
    ("plan", "period"),
    ("trial", "peak_torque_Nm"),
    ("plan", "peak_holding_torque"),
    ("trial", "cost_of_transport"),
    ("plan", "support_margin"),
    ("plan", "peak_joint_rate"),
)


@dataclass(frozen=True)
class Ran:
    """A run as its folder tells it: ``metrics`` (metrics.json as data), the mission's TOML text and the motion where
    the folder has them. ``name`` is unique among the runs of a page."""

    name: str
    metrics: Mapping[str, Any]
    mission: str = ""
    motion: Motion | None = None


def write_comparison(runs: Sequence[Ran], path: Path) -> Path:
    """Write the page. Raises InputError for fewer than two runs or too many, or where it cannot be written."""
    if not 2 <= len(runs) <= MOST:
        raise InputError(f"runs: a comparison is of 2 to {MOST}, got {len(runs)}.")
    with replacing(path) as file:
        file.write(comparison_page(runs))
    return path


def comparison_page(runs: Sequence[Ran]) -> str:
    """The HTML file."""
    names = [run.name for run in runs]
    made = {"track": _tracks(runs), "joints": _joints(runs)}
    parts = [
        _head(runs),
        section("asked", "What differs in what was asked for", _differences(runs)),
        section("checks", "Checks", _checks(runs)),
        section("numbers", "Numbers", _numbers(runs)),
        section("track", "Tracks of the bodies, planned", plot("track", "Seen from above; lengths true.")),
        section("joints", "Fastest joint over time, planned", plot("joints")),
    ]
    parts = [p for p, name in zip(parts, ["", "", "", "", "track", "joints"], strict=True) if not name or made[name]]
    shown = {name: value for name, value in made.items() if value is not None}
    return document(" and ".join(names), parts, {"plots-data": shown}, ("plots",))


def key_rows(runs: Sequence[Ran]) -> list[tuple[str, list[str]]]:
    """The figures that a reader asks for first: (what, one text a run), where a run has any."""
    rows = []
    for group, name in KEY:
        values = [_number(run, group, name) for run in runs]
        if any(value is not None for value in values):
            unit = si_unit(group, name).replace("*", " ").replace("^2", "²")
            rows.append((f"{_said(group, name)} ({GROUPS[group]})", [figure(value, unit) for value in values]))
    return rows


def _head(runs: Sequence[Ran]) -> str:
    verdicts = [
        f'<p class="{"good" if run.metrics["verdict"] == "ok" else "bad"}"><b>{esc(run.name)}</b>: '
        f"{esc(run.metrics['title'])}, {'all checks passed' if run.metrics['verdict'] == 'ok' else 'failed'}</p>"
        for run in runs
    ]
    rows = [(esc(what), *values) for what, values in key_rows(runs)]
    key = table(("", *(esc(run.name) for run in runs)), rows, numbers=range(1, len(runs) + 1))
    title = " and ".join(esc(run.name) for run in runs)
    return f'<header><p class="kicker">bodyplan report</p><h1>{title}</h1>{"".join(verdicts)}</header>{key}'


def _differences(runs: Sequence[Ran]) -> str:
    """Fields of the missions that are not the same in all."""
    fields = [_flat(tomllib.loads(run.mission)) if run.mission else {} for run in runs]
    if not all(fields):
        missing = ", ".join(run.name for run, found in zip(runs, fields, strict=True) if not found)
        return f"<p>No mission.toml beside the metrics of {esc(missing)}.</p>"
    names = list(dict.fromkeys(name for found in fields for name in found))
    rows = [
        (f"<code>{esc(name)}</code>", *(esc(plain(found[name])) if name in found else NOTHING for found in fields))
        for name in names
        if any(found.get(name) != fields[0].get(name) for found in fields)
    ]
    return table(("field", *(esc(run.name) for run in runs)), rows) if rows else "<p>Nothing.</p>"


def _checks(runs: Sequence[Ran]) -> str:
    found = [{line["what"]: line for line in run.metrics["checks"]} for run in runs]
    names = list(dict.fromkeys(name for lines in found for name in lines))
    sign = {True: "✓", False: "✗", None: "not tested"}

    def cell(line: Mapping[str, Any] | None) -> str:
        if line is None:
            return NOTHING
        passed = line["passed"]
        text = f"{sign[passed]} {figure(line['value'], line['unit'], 3)}" if line["value"] is not None else sign[passed]
        return f'<span class="bad">{text}</span>' if passed is False else text

    rows = [(esc(name), *(cell(lines.get(name)) for lines in found)) for name in names]
    return table(("", *(esc(run.name) for run in runs)), rows, numbers=range(1, len(runs) + 1))


def _numbers(runs: Sequence[Ran]) -> str:
    out = []
    for group, title in GROUPS.items():
        names = list(dict.fromkeys(n for run in runs for n in (run.metrics[group] or {})))
        rows = []
        for name in names:
            values = [_number(run, group, name) for run in runs]
            if all(value is None for value in values):
                continue
            unit = si_unit(group, name).replace("*", " ").replace("^2", "²")
            change = [_change(value, values[0]) for value in values[1:]]
            rows.append((esc(_said(group, name)), *(figure(value, unit) for value in values), *change))
        if rows:
            others = [f"{esc(run.name)} beside {esc(runs[0].name)}" for run in runs[1:]]
            head = ("", *(esc(run.name) for run in runs), *others)
            out.append(folded(title.capitalize(), table(head, rows, numbers=range(1, len(head))), opened=True))
    return "".join(out)


def _change(value: float | None, first: float | None) -> str:
    if value is None or first is None:
        return NOTHING
    if abs(value - first) <= SAME * max(abs(value), abs(first)):
        return "same"
    if first == 0.0 or value * first < 0.0:
        return NOTHING
    ratio = value / first
    if not 0.5 < ratio < 2.0:
        return f"{figure(ratio, digits=3)} times"
    return f"{'+' if ratio > 1.0 else ''}{figure(100.0 * (ratio - 1.0), '%', 3)}"


def _number(run: Ran, group: str, name: str) -> float | None:
    value = (run.metrics[group] or {}).get(name)
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def _said(group: str, name: str) -> str:
    """A metric's name as words, without the unit that physics puts at its end."""
    if group == "trial":
        for end in ("_m_s", "_rad", "_Nm", "_N", "_J", "_m", "_s"):
            if name.endswith(end):
                name = name.removesuffix(end)
                break
    return words(name)


def _flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, Mapping):
            out |= _flat(value, f"{prefix}{key}.")
        else:
            out[f"{prefix}{key}"] = value
    return out


def _drawn(runs: Sequence[Ran], curve: Callable[[Motion], tuple[Any, Any]]) -> list[dict[str, Any]]:
    out = []
    for k, run in enumerate(runs):
        if run.motion is None:
            continue
        x, y = curve(run.motion)
        some = np.unique(np.linspace(0, len(x) - 1, min(len(x), DRAWN)).astype(int))
        out.append(line(x[some], y[some], label(run.name), SERIES[k % len(SERIES)]))
    return out


def _tracks(runs: Sequence[Ran]) -> dict[str, Any] | None:
    """Centres of the frames over time, seen from above: a base may be at a tail."""

    def middle(motion: Motion) -> tuple[Any, Any]:
        positions = motion.robot.forward(motion.q, motion.base).positions.mean(axis=1)
        return positions[:, 0], positions[:, 1]

    curves = _drawn(runs, middle)
    if not curves:
        return None
    made = layout("x (m)", "y (m)", 380)
    made["yaxis"] |= {"scaleanchor": "x"}
    return {"data": curves, "layout": made}


def _joints(runs: Sequence[Ran]) -> dict[str, Any] | None:
    curves = _drawn(runs, lambda motion: (motion.t, np.abs(motion.qd).max(axis=1)))
    return {"data": curves, "layout": layout("time (s)", "rad/s, m/s")} if curves else None
