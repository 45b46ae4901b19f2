"""The part of a report that holds the plan against its execution, and says where the advance is lost."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bodyplan.robot.model import Robot
from bodyplan.show.outcome import Outcome, no_slip_ratio
from bodyplan.show.playback import Playback
from bodyplan.show.remarks import advance_in_words, gathered, went_back
from bodyplan.show.stages import stage_rows, worst
from bodyplan.show.text import (
    counted,
    degrees,
    esc,
    figure,
    folded,
    listed,
    pairs,
    percent,
    plain,
    plot,
    section,
    table,
    words,
)
from bodyplan.simulate.trial import Trial

#: warnings from which the rest is folded away
MANY = 8
#: key of Trial.metrics -> (what it is, unit)
MEASURES = {
    "turned_rad": ("turned to the left of the planned heading, last cycle", "°"),
    "tilt_rad": ("tilted from the planned base, largest", "°"),
    "height_rms_m": ("higher or lower than planned, rms", "m"),
    "height_max_m": ("higher or lower than planned, at most", "m"),
    "yaw_ratio": ("turn made / turn planned, by heading", "%"),
    "slip_angle_rad": ("slip angle: how far the body moves across its own axis", "°"),
    "tracking_rms_rad": ("servo error, rms", "rad"),
    "tracking_max_rad": ("servo error, largest", "rad"),
    "tracking_rms_m": ("servo error of lengths, rms", "m"),
    "tracking_max_m": ("servo error of lengths, largest", "m"),
    "rms_torque_Nm": ("torque, rms of all joints", "N m"),
    "peak_torque_Nm": ("torque, peak", "N m"),
    "rms_force_N": ("force, rms of all joints", "N"),
    "peak_force_N": ("force, peak", "N"),
    "positive_work_J": ("positive work of the motors", "J"),
    "absolute_work_J": ("absolute work of the motors", "J"),
    "cost_of_transport": ("cost of transport, positive work / (m g distance)", ""),
}
#: units of the settings that have one
SETTINGS = {"dt": "s", "settle": "s", "ramp": "s", "record_dt": "s", "armature": "kg m²"}
SETTINGS["walls_stood_back_m"] = "m"
SLIP = "Slip is the mean move, along the planned advance, of the parts that the plan says stand still."


def execution(outcome: Outcome, playback: Playback) -> str:
    """What physics made of the plan."""
    trial = outcome.trial
    below = " Below: the stages; point at one." if outcome.motion.stages else ""
    advance = plot("advance", f"Advance of the centre of mass along the planned direction.{below}")
    title = "Planned and executed"
    if trial is None:
        out = "<p>This motion was not executed in physics, so there is nothing to compare the plan with.</p>"
        return section("execution", title, out + advance + _load_plots(outcome))
    out = ""
    if not trial.ok:
        out += (
            f'<p class="bad">The physics {esc(trial.status)}: {esc(trial.reason)}. There are no measures; '
            "the replay shows the run up to there.</p>"
        )
    head = ("", "planned", "executed", "executed / planned")
    out += _warnings(trial, outcome.motion.robot) + table(
        head, _figures(trial, playback), kind="pairs", numbers=(1, 2, 3)
    )
    out += advance + _losses(trial, playback) + _load_plots(outcome)
    return section("execution", title, out + folded("Settings of the physics", pairs(_settings(trial))))


def _warnings(trial: Trial, robot: Robot) -> str:
    items = [f"<li>{esc(text)}</li>" for text in gathered(trial, robot)]
    if not items:
        return ""
    shown = f"<b>{counted(len(items), 'warning')}</b><ul>{''.join(items[:MANY])}</ul>"
    if len(items) > MANY:
        shown += folded(f"{len(items) - MANY} more", f"<ul>{''.join(items[MANY:])}</ul>")
    return f'<div class="warning">{shown}</div>'


def _figures(trial: Trial, playback: Playback) -> list[tuple[str, str, str, str]]:
    """Rows of the table: what, planned, executed, executed / planned."""
    found: dict[str, Any] = dict(trial.metrics())
    planned, cyclic = [float(x) for x in playback.planned_advance], playback.period is not None
    mean = sum(planned) / len(planned)
    name = "advance a cycle, mean" if cyclic else "advance in all"
    rows = [(name, figure(mean, "m"), figure(found["advance_m"], "m"), percent(found["advance_ratio"]))]
    if cyclic and trial.cycles > 1:
        for i, size in enumerate(planned):
            ratio = found.get(f"advance_ratio_cycle_{i + 1}")
            made = None if ratio is None else ratio * size
            rows.append((f"advance in cycle {i + 1}", figure(size, "m"), figure(made, "m"), percent(ratio)))
    speed, reached = mean / playback.span, found["speed_m_s"]
    share = reached / speed if reached is not None and speed > 0.0 else None
    rows.append(("speed", figure(speed, "m/s"), figure(reached, "m/s"), percent(share)))
    drift = "drift to the left" + (" a cycle" if cyclic else "")
    rows.append((drift, figure(0.0, "m"), figure(found["sideways_m"], "m"), ""))
    own = found.get("forward_ratio")
    if own is not None:
        rows.append(
            ("advance along the heading that it took itself", figure(mean, "m"), figure(own * mean, "m"), percent(own))
        )
    ratio = no_slip_ratio(playback.motion, trial)
    if ratio is not None:
        no_slip = playback.motion.facts["no_slip_speed"]
        rows.append(("speed against that without slip", figure(no_slip, "m/s"), figure(reached, "m/s"), percent(ratio)))
    lifts = [lift for lift in trial.lifts if lift.planned > 0.0]
    if lifts:
        least = min(lifts, key=lambda lift: lift.executed / lift.planned)
        rise, made = figure(least.planned, "m"), figure(least.executed, "m")
        rows.append(("rise of the part that is lifted least", rise, made, percent(trial.lift_ratio)))
    return rows + [
        (what, "", _measure(found[key], unit), "") for key, (what, unit) in MEASURES.items() if _shown(key, found)
    ]


def _shown(key: str, found: Mapping[str, Any]) -> bool:
    """Whether a measure has a row: a ratio of turns only where one was planned."""
    return key in found and not (key == "yaw_ratio" and found[key] is None)


def _measure(value: float | None, unit: str) -> str:
    if unit == "%":
        return percent(value)
    return degrees(value) if unit == "°" else figure(value, unit)


def _losses(trial: Trial, playback: Playback) -> str:
    """Stage by stage: what slipped, and how much advance was lost."""
    rows = stage_rows(playback, trial)
    if all(row.lag is None and row.along is None for row in rows):
        return ""
    cells = [
        (
            esc(row.name),
            f"{row.start:.2f} – {row.end:.2f} s",
            figure(row.along, "m"),
            figure(row.largest, "m"),
            figure(row.lag, "m"),
        )
        for row in rows
    ]
    cyclic = playback.period is not None
    head = (
        "stage",
        "time in the cycle" if cyclic else "time",
        "slip along",
        "largest slip",
        "executed − planned advance",
    )
    return (
        f"<h3>Where the advance goes</h3>\n<p>{_loss_in_words(trial, playback)}</p>"
        + plot("slip", "Negative: backwards. Stages may overlap, then their losses do not add up to the whole.")
        + plot(
            "lag",
            f"The executed advance less the planned one{' within a cycle' if cyclic else ''}: falling where physics "
            "falls behind the plan, rising where it gains on it.",
        )
        + folded(f"Table of all {counted(len(cells), 'stage')}", table(head, cells, numbers=(1, 2, 3, 4)))
    )


def _loss_in_words(trial: Trial, playback: Playback) -> str:
    ratio = trial.advance_ratio
    if ratio is None:
        return SLIP
    planned = float(playback.planned_advance.mean())
    lost = (1.0 - ratio) * planned
    if lost <= 0.0:
        return f"The executed advance is no shorter than the planned one ({percent(ratio)}). {SLIP}"
    most = listed(f"{esc(row.name)} ({figure(row.lag, 'm', 3)})" for row in worst(stage_rows(playback, trial)))
    cycle = "a cycle" if playback.period is not None else "in all"
    if went_back(trial):
        return f"<b>The body went {advance_in_words(trial)}</b>{f', most of it in {most}' if most else ''}. {SLIP}"
    return (
        f"<b>{figure(lost, 'm', 3)} of the planned {figure(planned, 'm')} {cycle} "
        f"({percent(1.0 - ratio)}) are lost</b>{f', most of it in {most}' if most else ''}. {SLIP}"
    )


def _load_plots(outcome: Outcome) -> str:
    """Where the plots of torques and forces go; there are none where neither plan nor trial know any."""
    kinds = [kind for kind in ("angle", "length") if kind in outcome.motion.robot.kinds]
    known = outcome.motion.torques is not None or (outcome.trial is not None and outcome.trial.ok)
    if not kinds or not known:
        return ""
    return "<h3>Load of the joints</h3>" + "".join(plot(f"load_{k}") + plot(f"loads_{k}") for k in kinds)


def _settings(trial: Trial) -> list[tuple[str, str]]:
    rows = []
    for name, value in trial.settings.items():
        shown, label = plain(value), words(name.removesuffix("_m"))
        if name == "friction" and value is None:
            shown = "that of the ground, or else of the contact"
        elif name in SETTINGS and isinstance(value, (int, float)):
            shown = figure(float(value), SETTINGS[name])
        elif name == "servo":
            label = "servo kp, kv (N m/rad, N m s/rad; of lengths N/m, N s/m)"
        rows.append((esc(label), esc(shown)))
    return rows
