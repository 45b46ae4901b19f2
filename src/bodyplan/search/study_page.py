"""The page of an optimisation: the best mission beside the one it began with, the history, the front, every field."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.search.optimising import Search
from bodyplan.search.studies import Objective, Trial, feasible
from bodyplan.search.sweep_page import LISTED, failures, shown
from bodyplan.show.document import document
from bodyplan.show.layout import label, layout
from bodyplan.show.series import EXECUTED, PLANNED, SERIES, compact
from bodyplan.show.text import NOTHING, elapsed, esc, figure, folded, plot, section, table

GREY = "#9aa3ab"


def study_page(made: Search) -> str:
    """The HTML file."""
    plots: dict[str, Any] = {}
    parts = [_head(made), section("best", "What was found", _best(made))]
    if len(made.objectives) > 1:
        plots["front"] = front_plot(made)
        note = (
            "Trials on the front are better than every other one in one figure at least, of those that keep all bounds."
        )
        parts.append(section("front", "The front", plot("front", note) + _front(made)))
    for i, objective in enumerate(made.objectives):
        plots[f"history_{i}"] = history(made, objective)
        content = plot(f"history_{i}", "Grey: a bound is missed, or a check. The line is the best one so far.")
        for k, one in enumerate(made.ranges):
            name = f"over_{i}_{k}"
            plots[name] = over_field(made, objective, k)
            content += plot(name, one.key)
        parts.append(section(f"objective-{i}", esc(objective.text.capitalize()), content))
    rows = [trial.row for trial in made.trials]
    if any(not row.ok for row in rows):
        parts.append(section("failed", "Trials that are not ok", failures(rows)))
    parts.append(section("trials", "Trials", _trials(made)))
    parts.append(section("mission", "The mission", folded("As TOML", f"<pre>{esc(made.mission.text)}</pre>")))
    return document(f"Optimisation of {made.mission.name}", parts, {"plots-data": plots}, ("plots",))


def _head(made: Search) -> str:
    kept = sum(feasible(trial.row, made.bounds) for trial in made.trials)
    seconds = sum(trial.row.seconds for trial in made.trials)
    tiles = [
        ("Trials", str(len(made.trials)), f"suggested by Optuna ({made.sampler})"),
        ("Within all bounds", str(kept), "and well in plan, checks and physics"),
        ("Time", elapsed(seconds), "all trials one after another"),
    ]
    cells = "".join(
        f'<div class="tile"><dt>{esc(name)}</dt><dd>{esc(value)}<small>{esc(note)}</small></dd></div>'
        for name, value, note in tiles
    )
    wanted = "; ".join([*(one.text for one in made.objectives), *(f"with {one.text}" for one in made.bounds)])
    stopped = ""
    if not made.complete:
        stopped = (
            f'<div class="warning">Stopped: {len(made.trials)} of {made.total} trials are finished. The same command '
            "goes on from here.</div>"
        )
    return (
        f'<header><p class="kicker">bodyplan optimise</p><h1>{esc(made.mission.title)}</h1>'
        f'<p>{esc(wanted)}</p></header>{stopped}<dl class="tiles">{cells}</dl>'
    )


def _best(made: Search) -> str:
    best = made.best
    if best is None:
        return "<p>No trial keeps all bounds and is ok; the table below says why.</p>"
    first = next((i for i, trial in enumerate(made.trials) if trial.number == 0 and _is_start(made, trial)), None)
    places = [*([] if first is None else [first]), best]
    head = ("", *(["as it was"] if first is not None else []), "best")
    rows = [
        (esc(made.label(one.key)), *(shown(made.trials[i].values[k].shown) for i in places))
        for k, one in enumerate(made.ranges)
    ]
    rows += [
        (f"<b>{esc(m.text)}</b>", *(figure(m.of(made.trials[i].row.figures), m.unit.replace("*", " ")) for i in places))
        for m in made.measures
    ]
    about = (
        f"<p>Trial {made.trials[best].number}; it is in <code>best.toml</code>: <code>bodyplan run best.toml</code></p>"
    )
    return about + table(head, rows, kind="best", numbers=range(1, len(head)))


def _is_start(made: Search, trial: Trial) -> bool:
    from bodyplan.search.optimising import starting

    start = starting(made.mission, made.ranges)
    values = {one.key: value.shown for one, value in zip(made.ranges, trial.values, strict=True)}
    return all(one.key in start and one.value(start[one.key]).shown == values[one.key] for one in made.ranges)


def _values(made: Search, objective: Objective) -> tuple[Any, Any]:
    """Value of every trial (NaN where there is none), and whether it keeps all bounds."""
    values = [objective.measure.of(trial.row.figures) for trial in made.trials]
    kept = [feasible(trial.row, made.bounds) for trial in made.trials]
    return np.array([np.nan if v is None else v for v in values], dtype=float), np.array(kept, dtype=bool)


def _dots(x: Any, y: Any, chosen: Any, name: str, color: str) -> dict[str, Any]:
    xs = compact(x[chosen], 8) if x.dtype.kind == "f" else [label(str(v)) for v in x[chosen]]
    return {"type": "scatter", "mode": "markers", "x": xs, "y": compact(y[chosen]), "name": name,
            "marker": {"color": color, "size": 6}}  # fmt: skip


def history(made: Search, objective: Objective) -> dict[str, Any]:
    """The objective by trial, and the best one so far."""
    values, kept = _values(made, objective)
    numbers = np.array([trial.number for trial in made.trials], dtype=float)
    counted = np.where(kept & ~np.isnan(values), values, -np.inf if objective.maximise else np.inf)
    best = np.maximum.accumulate(counted) if objective.maximise else np.minimum.accumulate(counted)
    line = {"type": "scatter", "mode": "lines", "x": compact(numbers), "y": compact(best), "name": "best so far",
            "line": {"color": PLANNED, "width": 2, "shape": "hv"}}  # fmt: skip
    data = [
        _dots(numbers, values, ~kept, "misses a bound", GREY),
        _dots(numbers, values, kept, "trial", EXECUTED),
        line,
    ]
    return {"data": data, "layout": layout("trial", _title(objective), 360)}


def over_field(made: Search, objective: Objective, k: int) -> dict[str, Any]:
    """The objective over one field."""
    values, kept = _values(made, objective)
    one = made.ranges[k]
    shown_values = [trial.values[k].shown for trial in made.trials]
    x = np.array([str(v) for v in shown_values]) if one.choices else np.array(shown_values, dtype=float)
    described = layout(label(made.label(one.key)), _title(objective), 280)
    if one.log:
        described["xaxis"]["type"] = "log"
    data = [_dots(x, values, ~kept, "misses a bound", GREY), _dots(x, values, kept, "trial", EXECUTED)]
    return {"data": data, "layout": described}


def front_plot(made: Search) -> dict[str, Any]:
    """The first two objectives against each other."""
    (x, kept), (y, _) = (_values(made, objective) for objective in made.objectives[:2])
    on_front = np.array([trial.number in made.front for trial in made.trials], dtype=bool)
    data = [
        _dots(x, y, ~kept, "misses a bound", GREY),
        _dots(x, y, kept & ~on_front, "trial", EXECUTED),
        _dots(x, y, on_front, "front", SERIES[1]),
    ]
    return {"data": data, "layout": layout(_title(made.objectives[0]), _title(made.objectives[1]), 440)}


def _title(objective: Objective) -> str:
    unit = objective.measure.unit.replace("*", " ")
    return label(f"{objective.measure.text} ({unit})" if unit else objective.measure.text)


def _front(made: Search) -> str:
    return _table(made, [trial for trial in made.trials if trial.number in made.front])


def _trials(made: Search) -> str:
    more = f"<p>The first {LISTED} of {len(made.trials)} trials.</p>" if len(made.trials) > LISTED else ""
    about = "<p>All figures of all trials, in SI units: <code>table.csv</code> and <code>table.parquet</code>.</p>"
    return about + more + _table(made, list(made.trials[:LISTED]))


def _table(made: Search, trials: list[Trial]) -> str:
    measures = made.measures
    head = ["trial", *(esc(made.label(one.key)) for one in made.ranges), *(esc(m.text) for m in measures), "bounds",
            "status"]  # fmt: skip
    rows = [
        [
            str(trial.number),
            *(shown(value.shown) for value in trial.values),
            *(figure(m.of(trial.row.figures), digits=5) for m in measures),
            "kept" if feasible(trial.row, made.bounds) else ("missed" if trial.row.ok else NOTHING),
            esc(trial.row.status),
        ]
        for trial in trials
    ]
    return table(head, rows, kind="points", numbers=range(len(head) - 2))
