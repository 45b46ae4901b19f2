"""The page of a sweep: the best points named, heat maps or curves, what failed and why, the points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.search.measures import Measure
from bodyplan.search.sweeps import Sweep
from bodyplan.show.document import document
from bodyplan.show.layout import label, layout, line
from bodyplan.show.series import SERIES, compact
from bodyplan.show.text import counted, elapsed, esc, figure, folded, plot, section, table

#: points that the page lists; the table of the folder has all
LISTED = 500
#: lines of one plot
MOST_LINES = 8
#: a figure may be one to raise or one to lower: both ends are shown; NaN only where all values are
ENDS = {"highest": np.fmax, "lowest": np.fmin}
#: from low to high, apart for every kind of colour vision and in grey
SCALE = "Viridis"


def sweep_page(made: Sweep) -> str:
    """The HTML file."""
    plots: dict[str, Any] = {}
    parts = [_head(made), section("best", "The best points", best_points(made))]
    for i, measure in enumerate(made.measures):
        drawn = measure_plots(made, measure)
        names = [f"measure_{i}_{name}" for name in drawn]
        plots |= dict(zip(names, (plot_ for plot_, _ in drawn.values()), strict=True))
        content = "".join(plot(name, caption) for name, (_, caption) in zip(names, drawn.values(), strict=True))
        parts.append(section(f"measure-{i}", esc(measure.text), content))
    if any(not row.ok for row in made.rows):
        parts.append(section("failed", "Points that are not ok", failures(made.rows)))
    parts.append(section("points", "Points", _points(made)))
    parts.append(section("mission", "The mission", folded("As TOML", f"<pre>{esc(made.mission.text)}</pre>")))
    return document(f"Sweep of {made.mission.name}", parts, {"plots-data": plots}, ("plots",))


def shown(value: Any) -> str:
    """A parameter or a figure as a table shows it; HTML."""
    return esc(value) if isinstance(value, (str, bool)) else figure(value, digits=6)


def _head(made: Sweep) -> str:
    good = sum(row.ok for row in made.rows)
    size = " × ".join(f"{len(axis.values)} of {made.label(axis.key)}" for axis in made.axes)
    tiles = [
        ("Points", str(len(made.rows)), size),
        (
            "All well",
            str(good),
            f"{len(made.rows) - good} are not: see below" if good < len(made.rows) else "all of them",
        ),
        (
            "Time for the points",
            elapsed(sum(row.seconds for row in made.rows)),
            "of one core, all points together",
        ),
    ]
    cells = "".join(
        f'<div class="tile"><dt>{esc(name)}</dt><dd>{esc(value)}<small>{esc(note)}</small></dd></div>'
        for name, value, note in tiles
    )
    stopped = ""
    if not made.complete:
        stopped = (
            f'<div class="warning">Stopped: {len(made.rows)} of {made.total} points are finished. The same command '
            "goes on from here.</div>"
        )
    return (
        f'<header><p class="kicker">bodyplan sweep</p><h1>{esc(made.mission.title)}</h1>'
        f"<p>Each point is the mission with other values of its fields, planned, checked and simulated.</p></header>"
        f'{stopped}<dl class="tiles">{cells}</dl>'
    )


def best_points(made: Sweep) -> str:
    """Where each measure is highest and lowest, and how to run that point."""
    rows = []
    for measure in made.measures:
        for word, lowest in (("highest", False), ("lowest", True)):
            i = made.best(measure, lowest=lowest)
            if i is None:
                continue
            point = made.points[i]
            sets = " ".join(f"--set {_quoted(item)}" for item in point.overrides)
            command = f"<code>bodyplan run {esc(made.mission.name)} {esc(sets)}</code>"
            value = figure(measure.of(made.rows[i].figures), measure.unit.replace("*", " "))
            rows.append((esc(measure.text), word, value, command))
    if not rows:
        return "<p>No point is ok; the table below says why.</p>"
    return table(("figure", "", "value", "how to run it"), rows, kind="best", numbers=(2,))


def _quoted(item: str) -> str:
    return "'" + item.replace("'", "'\\''") + "'" if not item.replace(".", "").replace("=", "").isalnum() else item


def measure_plots(made: Sweep, measure: Measure) -> dict[str, tuple[dict[str, Any], str]]:
    """Plot and caption by name: curves over one field; over two a heat map; over more, the highest and the lowest
    value of the other fields in each cell, and curves of both over each field."""
    values = _grid(made, measure)
    if np.isnan(values).all():
        return {}
    title = f"{measure.text} ({measure.unit})".replace("*", " ") if measure.unit else measure.text
    if len(made.axes) == 1:
        return {"curve": (curve(made, values, title), "Points that are not ok are gaps.")}
    if len(made.axes) == 2:
        out = {"map": (heat_map(made, values, title), "Points that are not ok are blank.")}
        if len(made.axes[1].values) <= MOST_LINES:
            out["curves"] = (curves(made, values, title), "")
        return out
    out = {}
    rest = tuple(range(2, values.ndim))
    for word, end in ENDS.items():
        note = f"In each cell the {word} value over all other fields; blank where no point is ok."
        out[f"map_{word}"] = (heat_map(made, end.reduce(values, axis=rest), f"{title}, {word}"), note)
    for k, axis in enumerate(made.axes):
        others = tuple(i for i in range(values.ndim) if i != k)
        data = []
        for number, (word, end) in enumerate(ENDS.items()):
            best = end.reduce(values, axis=others)
            if axis.numeric:
                data.append(line(_place(made, k), best, word, SERIES[number], mode="lines+markers"))
            else:
                bars = {"type": "bar", "name": word, "x": _place(made, k), "y": compact(best)}
                data.append(bars | {"marker": {"color": SERIES[number]}})
        described = {"data": data, "layout": layout(label(made.label(axis.key)), label(title), 300)}
        out[f"over_{k}"] = (described, f"The highest and the lowest value over all other fields, by {axis.key}.")
    return out


def _grid(made: Sweep, measure: Measure) -> Array:
    """The measure on the grid, one axis a field; NaN where a point is not ok or has no value."""
    shape = tuple(len(axis.values) for axis in made.axes)
    places = [{repr(value.shown): i for i, value in enumerate(axis.values)} for axis in made.axes]
    out = np.full(shape, np.nan)
    for point, row in zip(made.points, made.rows, strict=True):
        value = measure.of(row.figures) if row.ok else None
        if value is not None:
            out[tuple(places[k][repr(point.values[axis.key])] for k, axis in enumerate(made.axes))] = value
    return out


def _place(made: Sweep, k: int) -> Any:
    axis = made.axes[k]
    values = [value.shown for value in axis.values]
    return np.array(values, dtype=float) if axis.numeric else [label(str(value)) for value in values]


def _on_axis(made: Sweep, k: int) -> list[Any]:
    values = _place(made, k)
    return compact(values, 8) if isinstance(values, np.ndarray) else values


def curve(made: Sweep, values: Array, title: str) -> dict[str, Any]:
    """A measure over one field."""
    data: dict[str, Any] = {"type": "scatter", "mode": "lines+markers", "x": _on_axis(made, 0), "y": compact(values),
                            "line": {"color": SERIES[0], "width": 2}, "showlegend": False}  # fmt: skip
    return {"data": [data], "layout": layout(label(made.label(made.axes[0].key)), label(title), 380)}


def curves(made: Sweep, values: Array, title: str) -> dict[str, Any]:
    """A measure over the first of two fields, a line a value of the second."""
    second = made.axes[1]
    data = [
        {"type": "scatter", "mode": "lines+markers", "x": _on_axis(made, 0), "y": compact(values[:, j]),
         "name": label(f"{second.key} = {value.shown}"), "line": {"color": SERIES[j % len(SERIES)], "width": 2}}
        for j, value in enumerate(second.values)
    ]  # fmt: skip
    return {"data": data, "layout": layout(label(made.label(made.axes[0].key)), label(title), 380)}


def heat_map(made: Sweep, values: Array, title: str) -> dict[str, Any]:
    """A measure over two fields: the first to the right, the second up."""
    data = {
        "type": "heatmap",
        "x": _on_axis(made, 0),
        "y": _on_axis(made, 1),
        "z": compact(values.T),
        "colorscale": SCALE,
        "colorbar": {"title": {"text": label(title), "side": "right"}},
        "hoverongaps": False,
    }
    made_layout = layout(label(made.label(made.axes[0].key)), label(made.label(made.axes[1].key)), 440)
    for name, k in (("xaxis", 0), ("yaxis", 1)):
        if not made.axes[k].numeric:
            made_layout[name]["type"] = "category"
    return {"data": [data], "layout": made_layout}


def failures(rows: Sequence[Any]) -> str:
    """How many points have each status, and the reasons of some."""
    counts = Counter(row.status for row in rows if not row.ok)
    said = []
    for status, count in counts.most_common():
        reasons = list(dict.fromkeys(row.reason for row in rows if row.status == status))
        some = "<br>".join(esc(reason[:400]) for reason in reasons[:5])
        more = f"<br>and {counted(len(reasons) - 5, 'other reason')} in the table" if len(reasons) > 5 else ""
        said.append((esc(status), str(count), some + more))
    return table(("status", "points", "reasons"), said, kind="failed", numbers=(1,))


def _points(made: Sweep) -> str:
    head = [*(esc(made.label(axis.key)) for axis in made.axes), *(esc(m.text) for m in made.measures), "status"]
    rows = [
        [
            *(shown(point.values[axis.key]) for axis in made.axes),
            *(figure(measure.of(row.figures), digits=5) for measure in made.measures),
            esc(row.status),
        ]
        for point, row in zip(made.points[:LISTED], made.rows[:LISTED], strict=True)
    ]
    more = f"<p>The first {LISTED} of {len(made.rows)} points.</p>" if len(made.rows) > LISTED else ""
    about = "<p>All figures of all points, in SI units: <code>table.csv</code> and <code>table.parquet</code>.</p>"
    return about + more + table(head, rows, kind="points", numbers=range(len(head) - 1))
