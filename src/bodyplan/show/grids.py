"""A mission at several values of one field: table, plot, figure, and where it is ahead of the others in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.show.layout import label, layout, line
from bodyplan.show.outcome import Grid, GridPoint
from bodyplan.show.series import SERIES
from bodyplan.show.text import degrees, esc, figure, listed, percent, plot, section, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: difference of advance ratios that is no difference
SAME = 0.005


def grid_section(grid: Grid | None, mission: str) -> str:
    """The grid as a part of the report; empty where there is none."""
    if grid is None:
        return ""
    head = (esc(grid.label), "mission", "executed / planned", "along its own heading", "speed",
            "executed / no-slip speed", "peak torque", "cost of transport", "slip angle", "status")  # fmt: skip
    rows = [
        (
            figure(point.value),
            f"<b>{esc(point.mission)}</b>" if point.mission == mission else esc(point.mission),
            percent(point.advance_ratio),
            percent(point.forward_ratio),
            figure(point.speed, "m/s", 3),
            figure(point.no_slip_ratio, digits=3, zeros=True),
            figure(point.peak_torque, "N m", 3),
            figure(point.cost_of_transport, digits=3, zeros=True),
            degrees(point.slip_angle),
            esc(point.status if point.status == "ok" else f"{point.status}: {point.reason}"),
        )
        for value in grid.values
        for point in grid.points
        if point.value == value
    ]
    said = "".join(f"<p>{esc(text)}</p>" for text in in_words(grid, mission))
    about = f"<p>Planned and executed once more at every value of <code>{esc(grid.key)}</code>.</p>"
    content = about + said + plot("grid") + table(head, rows, kind="grid", numbers=(0, 2, 3, 4, 5, 6, 7, 8))
    return section("grid", esc(f"Over {grid.label}"), content)


def in_words(grid: Grid, mission: str) -> list[str]:
    """Where the mission keeps more of its advance than each of the others, and where not."""
    mine = {p.value: p.advance_ratio for p in grid.of(mission) if p.advance_ratio is not None}
    out = []
    for other in grid.missions:
        if other == mission:
            continue
        gains = [
            (p.value, mine[p.value] - p.advance_ratio)
            for p in grid.of(other)
            if p.advance_ratio is not None and p.value in mine
        ]
        parts = [
            _said("more", [(v, gain) for v, gain in gains if gain > SAME]),
            _said("as much", [(v, 0.0) for v, gain in gains if abs(gain) <= SAME]),
            _said("less", [(v, -gain) for v, gain in gains if gain < -SAME]),
        ]
        if gains:
            what = f"Of its planned advance, {mission} keeps, beside {other} and by {grid.label}:"
            out.append(f"{what} {'; '.join(part for part in parts if part)}.")
    if not out and len(mine) > 1:
        best, worst = max(mine, key=lambda v: mine[v]), min(mine, key=lambda v: mine[v])
        out.append(
            f"{mission} executes the most of its planned advance, {percent(mine[best])}, at {grid.label} = "
            f"{figure(best)}, and the least, {percent(mine[worst])}, at {figure(worst)}."
        )
    lost = [p for p in grid.points if p.advance_ratio is None]
    if lost:
        out.append(f"{len(lost)} of {len(grid.points)} runs have no figures; the table says why.")
    return out


def _said(what: str, gains: Sequence[tuple[float, float]]) -> str:
    """ "more at 0.2 (by 81 points) and 0.3 (by 40 points)"; empty where there is nothing to say."""
    places = [figure(v) + (f" (by {100.0 * gain:.0f} points)" if gain else "") for v, gain in gains]
    return f"{what} at {listed(places)}" if places else ""


def grid_plot(grid: Grid | None) -> dict[str, Any] | None:
    """Advance ratio against the value, a line a mission."""
    if grid is None:
        return None
    data = []
    for mission, color in zip(grid.missions, _colors(len(grid.missions)), strict=True):
        values, ratios = _ratios(grid.of(mission))
        data.append(line(values, ratios, label(mission), color, mode="lines+markers"))
    made = layout(label(grid.label), "executed / planned advance", 360)
    made["yaxis"].update({"zeroline": True, "zerolinecolor": "#8d97a1"})
    return {"data": data, "layout": made}


def grid_figure(grid: Grid | None, new_figure: Callable[[float], Figure]) -> Figure | None:
    """The same for papers and slides."""
    if grid is None:
        return None
    made = new_figure(3.6)
    ax = made.subplots()
    for mission, color in zip(grid.missions, _colors(len(grid.missions)), strict=True):
        ax.plot(*_ratios(grid.of(mission)), color=color, marker="o", markersize=4, label=mission)
    ax.axhline(0.0, color="#8d97a1", linewidth=0.8)
    ax.set_xlabel(grid.label)
    ax.set_ylabel("executed / planned advance")
    ax.legend(loc="best")
    return made


def _colors(count: int) -> Sequence[str]:
    return [SERIES[i % len(SERIES)] for i in range(count)]


def _ratios(points: Sequence[GridPoint]) -> tuple[Any, Any]:
    ordered = sorted(points, key=lambda point: point.value)
    ratios = [np.nan if p.advance_ratio is None else p.advance_ratio for p in ordered]
    return np.array([p.value for p in ordered]), np.array(ratios)
