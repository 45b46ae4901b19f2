"""The parts of a report around the execution: checks, comparison, rates, notes."""

from __future__ import annotations

from collections.abc import Sequence

from bodyplan.check import Line
from bodyplan.show.outcome import Comparison, Outcome, five_point_gaps
from bodyplan.show.overview import options_rows
from bodyplan.show.text import (
    NOTHING,
    degrees,
    esc,
    figure,
    folded,
    pairs,
    percent,
    plot,
    section,
    table,
    unit_of,
    words,
)

#: checks from which the passed ones are folded away
MANY = 15


def checks(outcome: Outcome) -> str:
    """The judge's lines: what failed first, what passed folded away where it is much."""
    lines = outcome.report.lines
    failed = [line for line in lines if line.passed is False]
    untested = [line for line in lines if line.passed is None]
    passed = [line for line in lines if line.passed]
    out = "<p>The judge recomputes every claim of the plan from forward kinematics and the ground alone.</p>"
    if failed:
        out += f'<h3 class="bad">Failed: {len(failed)}</h3>' + _check_table(failed)
    if untested:
        out += f"<h3>Could not be tested: {len(untested)}</h3>" + _check_table(untested)
    if passed:
        out += folded(f"<b>Passed: {len(passed)}</b>", _check_table(passed), opened=len(passed) <= MANY)
    return section("checks", "Checks", out)


def _check_table(lines: Sequence[Line]) -> str:
    marks = {True: ("pass", "✓ pass"), False: ("fail", "✗ fail"), None: ("open", "– not tested")}
    rows = []
    for line in lines:
        kind, mark = marks[line.passed]
        unit = esc(line.unit)
        limit = NOTHING
        if line.limit is not None:
            limit = f"{'≥' if line.at_least else '≤'} {figure(line.limit, unit)}"
        verdict = f'<span class="mark {kind}">{mark}</span>'
        rows.append((verdict, esc(line.what), figure(line.value, unit), limit, esc(line.detail)))
    return table(("verdict", "what", "value", "limit", "detail"), rows, kind="checks", numbers=(2, 3))


def comparison(outcome: Outcome) -> str:
    """This mission beside the others."""
    if not outcome.others:
        return ""
    head: tuple[str, ...] = (
        "mission",
        "title",
        "executed / planned",
        "speed",
        "planned speed",
        "peak joint rate",
        "peak torque",
        "cost of transport",
    )
    compared = (outcome.itself, *outcome.others)
    slips = any(other.slip_angle is not None for other in compared)
    paced = any(other.no_slip_ratio is not None for other in compared)
    head += ("slip angle",) * slips + ("speed / no-slip speed", "along its own heading") * paced
    rows = [_compared(other, i == 0, slips, paced) for i, other in enumerate(compared)]
    return section(
        "comparison", "Beside other missions", table(head, rows, kind="compare", numbers=range(2, len(head)))
    )


def _compared(other: Comparison, mine: bool, slips: bool, paced: bool) -> tuple[str, ...]:
    name = f"<b>{esc(other.name)}</b> (this one)" if mine else esc(other.name)
    status = f"{other.status}: {other.reason}" if other.reason else other.status
    return (
        name + ("" if other.status == "ok" else f" <small>({esc(status)})</small>"),
        esc(other.title),
        percent(other.ratio),
        figure(other.speed, "m/s"),
        figure(other.planned_speed, "m/s"),
        figure(other.peak_joint_rate, "rad/s"),
        figure(other.peak_torque, "N m"),
        figure(other.cost_of_transport, digits=3, zeros=True),
        *((degrees(other.slip_angle),) if slips else ()),
        *((percent(other.no_slip_ratio), percent(other.forward_ratio)) if paced else ()),
    )


def _digits(printed: float) -> int:
    """Significant digits of a printed number, the zeros of a whole one included; three at least."""
    return max(3, len(f"{abs(printed):.15g}".partition("e")[0].replace(".", "").lstrip("0")))


def beside_the_paper(outcome: Outcome) -> str:
    """What the paper prints, and what was found here."""
    if not outcome.paper:
        return ""
    rows = [
        (
            esc(row.what),
            figure(row.printed, row.unit, _digits(row.printed)),
            NOTHING if row.value is None else figure(row.value, row.unit, _digits(row.printed)),
            f"<code>{esc(row.ours)}</code>" + (f" ({esc(row.problem)})" if row.problem else ""),
            esc(row.source),
        )
        for row in outcome.paper
    ]
    head = ("what", "the paper", "here", "here it is", "source")
    return section("paper", "Beside the paper", table(head, rows, kind="compare", numbers=(1, 2)))


def rates(outcome: Outcome) -> str:
    """Exact rates against the five-point formula, and the variants of the gait."""
    out = _gaps(outcome)
    if outcome.variants:
        head = ("variant", "peak rate, exact", "by five points", "peak acceleration, exact", "by five points")
        rows = [
            (
                esc(variant.label),
                figure(variant.peak_rate, "rad/s"),
                figure(variant.five_point_rate, "rad/s"),
                figure(variant.peak_acceleration, "rad/s²"),
                figure(variant.five_point_acceleration, "rad/s²"),
            )
            for variant in outcome.variants
        ]
        out += "<h3>Variants of the gait</h3>" + table(head, rows, numbers=range(1, 5))
    if not out:
        return ""
    out += (
        "<p>Where a rate jumps by Δ from one piece of the motion to the next, the exact acceleration is that "
        "within the pieces; the five-point formula takes the jump for an acceleration of about 0.6 Δ/h, "
        "which grows as 1/h when the step h is made smaller.</p>"
    )
    return section("rates", "Joint rates: exact and by the five-point formula", out)


def _gaps(outcome: Outcome) -> str:
    gaps = five_point_gaps(outcome.motion)
    if not gaps:
        return ""
    rows = [
        (what, figure(gaps[f"{what}_gap_rms"], unit), figure(gaps[f"{what}_gap_max"], unit))
        for what, unit in (("rate", "rad/s"), ("acceleration", "rad/s²"))
    ]
    step = figure(float(outcome.motion.t[1] - outcome.motion.t[0]), "s", 3)
    return (
        "<p>bodyplan’s rates and accelerations are exact; the five-point formula, taken from the samples "
        f"{step} apart, differs from them by:</p>"
        + table(("", "rms", "largest"), rows, numbers=(1, 2))
        + plot("five_point")
    )


def notes(outcome: Outcome) -> str:
    """Corrections, facts, mission text, versions, and how to load the data."""
    out = ""
    if outcome.motion.notes:
        out += "<ul>" + "".join(f"<li>{esc(note)}</li>" for note in outcome.motion.notes) + "</ul>"
    facts = [(esc(words(k)), figure(v, unit_of(k), 6)) for k, v in outcome.motion.facts.items()]
    if facts:
        out += folded("Numbers of the plan (SI units, rad)", pairs(facts))
    out += folded("Options of gait and ground (SI units, rad)", pairs(options_rows(outcome)))
    if outcome.mission_text.strip():
        changed = "".join(f"<p>Changed for this run: <code>{esc(item)}</code></p>" for item in outcome.overrides)
        out += folded("Mission file (TOML)", f"{changed}<pre>{esc(outcome.mission_text.strip())}</pre>")
    out += folded("Load the motion in Python", f"<pre>{esc(LOAD)}</pre>")
    versions = ", ".join(f"{name} {version}" for name, version in outcome.versions.items())
    return section("notes", "Notes and data", out + f'<p class="versions">Made with {esc(versions)}.</p>')


LOAD = """import bodyplan as bp
motion = bp.load("motion.npz")  # motion.t, .q, .qd, .qdd, .base, .robot, .ground, ...
import pandas; table = pandas.read_csv("motion.csv")  # the columns are named with their units"""
