"""What ``bodyplan fit`` writes: a page, figures, the angles as CSV, every number as JSON."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.files import replacing
from bodyplan.show import fitted_plots
from bodyplan.show.document import document
from bodyplan.show.figures import STYLE, new_figure
from bodyplan.show.fit_outcome import STRAIGHT, FitOutcome, saturated
from bodyplan.show.fitted_figures import draw_angles, draw_distance, draw_overlay, draw_turning
from bodyplan.show.layout import layout, line
from bodyplan.show.series import SERIES
from bodyplan.show.text import (
    NOTHING,
    degrees,
    esc,
    figure,
    folded,
    pairs,
    percent,
    plain,
    plot,
    section,
    table,
    words,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = ("pitch", "yaw")
#: how a mechanism and a rule are drawn among the others
LINES = {"paper": "solid", "optimal": "dot"}


def write_fit_page(outcome: FitOutcome, path: Path) -> Path:
    """One HTML file that opens anywhere. Raises InputError where it cannot be written, MissingExtraError without
    plotly."""
    with replacing(path) as file:
        file.write(fit_page(outcome))
    return path


def write_fit_figure(outcome: FitOutcome, path: Path) -> Path:
    """The pictures as one PNG, SVG or PDF, as the suffix says. Raises as :func:`write_fit_page`, for matplotlib."""
    made = fit_figure(outcome)
    from matplotlib import rc_context

    suffix = path.suffix.lower().removeprefix(".")
    stable: dict[str, Any] = {"svg": {"Date": None}, "png": {"Software": None}}.get(suffix, {})
    with rc_context(STYLE), replacing(path, "wb") as file:  # type: ignore[arg-type]  # the stubs list every key
        made.savefig(file, format=suffix, dpi=150, metadata=stable)
    return path


def write_fit_folder(outcome: FitOutcome, folder: Path) -> Path:
    """fit.html, fit.png, fit.svg, angles.csv and fit.json in a folder that exists; returns the page."""
    write_fit_page(outcome, folder / "fit.html")
    for suffix in ("png", "svg"):
        write_fit_figure(outcome, folder / f"fit.{suffix}")
    with replacing(folder / "angles.csv") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["joint", "angle [rad]", "angle [deg]"])
        for name, value in angles(outcome):
            rows.writerow([name, repr(value), repr(float(np.degrees(value)))])
    with replacing(folder / "fit.json") as file:
        file.write(json.dumps(outcome.to_dict(), indent=2, allow_nan=False) + "\n")
    return folder / "fit.html"


def angles(outcome: FitOutcome) -> list[tuple[str, float]]:
    """Names and angles (rad) of the joints from the tail on."""
    values = np.asarray(outcome.fit.q, dtype=float).tolist()
    return list(zip(outcome.fit.robot.joints, values, strict=True))


def fit_page(outcome: FitOutcome) -> str:
    """The HTML file."""
    drawn = outcome.drawn
    convergence = outcome.convergence
    made = {
        "overlay": fitted_plots.overlay(drawn),
        "turning": fitted_plots.turning(drawn),
        "distance": fitted_plots.distance(drawn),
        "angles": fitted_plots.angles(outcome.fit.robot.joints, np.asarray(outcome.fit.q), outcome.fit.robot.limits),
        "convergence": None if convergence is None else convergence_plot(convergence),
    }
    turning = (
        "The sum of the joint angles up to a place against the turning of the curve: a staircase for hinges, a "
        "polyline for arcs (Figs. 6(c) and 7(c) of Yamada and Hirose)."
    )
    parts = [
        _head(outcome),
        section("overlay", "Curve and mechanism", plot("overlay", "Lengths true; x forward from the tail.")),
        section("turning", "Turning along the body", plot("turning", turning)),
        section("distance", "Distance from the curve", plot("distance")),
        section("angles", "Joint angles", plot("angles") + _angle_table(outcome)),
        section("mechanisms", "Beside other mechanisms", _mechanisms(outcome)),
    ]
    if convergence is not None:
        parts.append(section("convergence", "Over the number of joints", plot("convergence") + _orders(convergence)))
    parts.append(section("data", "Data", _data(outcome)))
    return document(outcome.title, parts, {"plots-data": {k: v for k, v in made.items() if v is not None}}, ("plots",))


def _head(outcome: FitOutcome) -> str:
    found, length = outcome.fit, float(outcome.drawn.s[-1])
    rule = "the paper’s rule" if found.method == "paper" else "the smallest error"
    tiles = [
        ("Error E_nm", figure(float(found.error), digits=5), f"± {figure(float(found.quadrature_error), digits=2)}"),
        ("Largest distance", figure(float(found.max_distance), "m"),
         f"{percent(float(found.max_distance) / length)} of the length"),
        ("Largest angle", degrees(float(np.abs(np.asarray(found.q)).max())), limits_in_words(outcome)),
    ]  # fmt: skip
    if found.method == "optimal":
        beyond = "; the rule’s angles are beyond the limits" if outcome.beyond else ""
        tiles.append(("Beside the paper’s rule", percent(float(found.gain)), f"of its error{beyond}"))
    cells = "".join(
        f'<div class="tile"><dt>{esc(name)}</dt><dd>{value}<small>{esc(note)}</small></dd></div>'
        for name, value, note in tiles
    )
    status = "" if outcome.ok else f'<p class="bad">Status: {esc(found.status)}</p>'
    about = (
        f"A mechanism of {esc(outcome.mechanism)} ({esc(outcome.axes)}) on "
        f"{figure(length, 'm')} of the curve, by {rule}; E_nm is the mean distance between the two as a share of the "
        "length."
    )
    status += "".join(f'<div class="warning">Warning: {esc(text)}</div>' for text in outcome.warnings)
    return (
        f'<header><p class="kicker">bodyplan fit</p><h1>{esc(outcome.title.capitalize())}</h1><p>{about}</p></header>'
        f'{status}<dl class="tiles">{cells}</dl>'
    )


def limits_in_words(outcome: FitOutcome) -> str:
    """Which joints are at or beyond their limits."""
    if not np.all(np.isfinite(outcome.fit.robot.limits)):
        return "no limits given"
    names = saturated(outcome.fit)
    return f"at or beyond the limit: {', '.join(names)}" if names else "all within their limits"


def _angle_table(outcome: FitOutcome) -> str:
    kink = np.asarray(outcome.fit.kink, dtype=float)
    rows = [(f"virtual joint at the tail, {axis}", degrees(float(x), 6)) for axis, x in zip(AXES, kink, strict=True)]
    rows += [(esc(name), degrees(value, 6)) for name, value in angles(outcome)]
    about = "<p>The virtual joint is a kink between the curve and the tail; it turns the base, not a motor.</p>"
    return about + folded("Table of the angles", pairs(rows), opened=len(rows) <= 24)


def _mechanisms(outcome: FitOutcome) -> str:
    best = {row.mechanism: row.error for row in outcome.rows if row.rule == "paper"}
    rows = [
        (
            f"<b>{esc(row.mechanism)}</b>" if row.mine else esc(row.mechanism),
            esc(row.rule),
            NOTHING if row.joints is None else str(row.joints),
            figure(row.error, digits=5),
            figure(row.quadrature_error, digits=2),
            percent(row.error / beside) if row.error is not None and (beside := best.get(row.mechanism)) else "",
            figure(row.max_distance, "m"),
            esc(f"{row.status}: {row.reason}" if row.reason else row.status),
        )
        for row in outcome.rows
    ]
    head = ("mechanism", "rule", "degrees of freedom", "E_nm", "its quadrature error", "of the paper’s rule",
            "largest distance", "status")  # fmt: skip
    return table(head, rows, numbers=range(2, 7))


def _orders(convergence: Any) -> str:
    rows = [
        (esc(row.mechanism), esc(row.rule), str(row.joints), figure(row.error, digits=5),
         figure(row.quadrature_error, digits=2), figure(row.order, digits=3, zeros=True))
        for row in convergence.rows
    ]  # fmt: skip
    about = (
        "<p>The order is how fast the error falls: at order 2, twice the joints leave a quarter of it. Straight links "
        f"and double joints are of order 2, arcs of order 3 with p at the Gauss node.</p><p>{esc(STRAIGHT)}</p>"
    )
    head = ("mechanism", "rule", "joints", "E_nm", "its quadrature error", "order")
    return about + table(head, rows, numbers=range(2, 6))


def _lines_of(convergence: Any) -> list[tuple[str, str, str, list[int], list[float]]]:
    """Mechanism, rule, colour, joints and errors of every line of the table."""
    kinds = list(dict.fromkeys(row.mechanism for row in convergence.rows))
    out = []
    for mechanism, rule in dict.fromkeys((row.mechanism, row.rule) for row in convergence.rows):
        mine = [row for row in convergence.rows if (row.mechanism, row.rule) == (mechanism, rule)]
        color = SERIES[kinds.index(mechanism) % len(SERIES)]
        out.append((mechanism, rule, color, [row.joints for row in mine], [row.error for row in mine]))
    return out


def convergence_plot(convergence: Any) -> dict[str, Any]:
    """E_nm over the number of joints, both logarithmic."""
    data = [
        line(np.array(n), np.array(error), f"{mechanism}, {rule}", color, mode="lines+markers",
             line={"dash": LINES.get(rule, "solid")})
        for mechanism, rule, color, n, error in _lines_of(convergence)
    ]  # fmt: skip
    made = layout("joints", "E_nm", 420)
    made["xaxis"].update({"type": "log", "tickvals": sorted({row.joints for row in convergence.rows})})
    made["yaxis"].update({"type": "log", "exponentformat": "power"})
    return {"data": data, "layout": made}


def _data(outcome: FitOutcome) -> str:
    options = [(esc(words(str(k))), esc(plain(v))) for k, v in outcome.curve.to_dict().items() if k != "points"]
    code = (
        "import bodyplan as bp\n"
        f"curve = bp.curves.from_dict({outcome.curve.to_dict()!r:.2000})\n"
        f"fit = bp.fit(curve, robot, method={outcome.fit.method!r})  # fit.q, fit.base, fit.error, fit.points(s)"
    )
    return folded("The curve (SI units, rad)", pairs(options)) + folded("The same in Python", f"<pre>{esc(code)}</pre>")


def fit_figure(outcome: FitOutcome) -> Figure:
    """Curve and mechanism, turning, distance, angles, and the convergence where it was asked for, on one sheet."""
    new_figure(1.0)  # says what is missing before anything else fails
    from matplotlib import rc_context

    drawn, views = outcome.drawn, outcome.drawn.views
    rows = 4 if outcome.convergence is None else 5
    heights = [3.2, 2.4, 1.8, 2.2, 3.0][:rows]
    with rc_context(STYLE):  # type: ignore[arg-type]  # the stubs list every key
        made = new_figure(sum(heights) + 0.4)
        parts: Any = made.subfigures(rows, 1, height_ratios=heights)
        top = parts[0].subplots(1, len(views), squeeze=False)[0]
        for i, (ax, view) in enumerate(zip(top, views, strict=True)):
            draw_overlay(ax, drawn, view, named=i == 0)
            if len(views) > 1:
                ax.set_title(f"from {view}", fontsize=8)
        top[0].legend(loc="best", fontsize=7)
        draw_turning(parts[1].subplots(), drawn)
        draw_distance(parts[2].subplots(), drawn)
        draw_angles(parts[3].subplots(), outcome.fit.robot.joints, np.asarray(outcome.fit.q), outcome.fit.robot.limits)
        if outcome.convergence is not None:
            _draw_convergence(parts[4].subplots(), outcome.convergence)
        made.suptitle(f"{outcome.title}: E_nm = {float(outcome.fit.error):.4g}", fontsize=10)
    return made


def _draw_convergence(ax: Any, convergence: Any) -> None:
    for mechanism, rule, color, n, error in _lines_of(convergence):
        style = ":" if LINES.get(rule) == "dot" else "-"
        ax.loglog(n, error, style, color=color, marker="o", markersize=4, label=f"{mechanism}, {rule}")
    ticks = sorted({row.joints for row in convergence.rows})
    ax.set_xticks(ticks, [str(tick) for tick in ticks])
    ax.minorticks_off()
    ax.set_xlabel("joints")
    ax.set_ylabel("E_nm")
    ax.legend(loc="best", fontsize=7, ncols=2)
