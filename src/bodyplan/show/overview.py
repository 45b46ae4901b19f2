"""The top of a report: the mission in words, the verdict, the key numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.remarks import advance_in_words, plan_warnings, went_back
from bodyplan.show.text import counted, esc, figure, listed, percent, plain, prose, unit_of, words
from bodyplan.simulate.wheels import turning_remarks

#: failed checks that are told beside the verdict
TOLD = 3


def head(outcome: Outcome, playback: Playback) -> str:
    """Title, what it is about, one sentence, verdict and tiles."""
    about = "".join(f'<p class="about">{prose(part)}</p>' for part in outcome.about.split("\n\n") if part.strip())
    return (
        f'<header><p class="kicker">bodyplan report</p><h1>{esc(outcome.title)}</h1>{about}'
        f"<p>{sentence(outcome, playback)}</p></header>\n{verdict(outcome)}\n{_missed(outcome)}"
        f"{tiles(outcome, playback)}"
    )


def _missed(outcome: Outcome) -> str:
    """What the plan says that nobody may miss: why it stops, warnings."""
    items = [f"<li>{esc(text)}</li>" for text in plan_warnings(outcome.motion)]
    return f'<div class="warning"><b>The plan says</b><ul>{"".join(items)}</ul></div>\n' if items else ""


def sentence(outcome: Outcome, playback: Playback) -> str:
    """Robot, gait, ground and time in a sentence to read aloud (HTML)."""
    motion, trial = outcome.motion, outcome.trial
    robot = motion.robot
    mass = f" and {figure(robot.mass, 'kg', 3)}" if robot.mass > 0.0 else ""
    gait = motion.gait.get("kind")
    moves = f"moves with the <b>{esc(gait)}</b> gait" if gait else "moves as planned"
    length = float(motion.t[-1] - motion.t[0])
    time = f"planned for {figure(length, 's')}"
    if playback.period is not None:
        cycles = length / playback.period
        many = "" if abs(cycles - 1.0) < 1e-9 else "s"
        time += f" ({figure(cycles)} cycle{many} of {figure(playback.period, 's')})"
    if trial is not None:
        executed = counted(trial.cycles, "cycle") if playback.period is not None else figure(trial.period, "s")
        time += f", and executed in physics for {executed}"
    return (
        f"The robot “{esc(robot.name)}”, with {counted(robot.n, 'joint')}{mass}, {moves} on "
        f"{_ground(motion.ground)}; {time}."
    )


def _ground(ground: Any) -> str:
    """The ground and its short properties in words (HTML)."""
    options = ground.to_dict()
    kind = str(options.pop("kind", type(ground).__name__))
    shown = []
    for name, value in options.items():
        if isinstance(value, bool) or value is None:
            continue
        if isinstance(value, (int, float)) and value != 0.0:
            shown.append(f"{words(name)} {figure(float(value), unit_of(name))}")
        elif isinstance(value, str) and len(value) <= 80:
            shown.append(f"{words(name)} {value}")
        elif _steps(value):
            shown.append(f"{words(name)} with {counted(len(value) - 1, 'step')}")
    article = "an" if kind[:1] in "aeiou" else "a"
    return f"{article} <b>{esc(kind)}</b>{f' ({esc(listed(shown))})' if shown else ''}"


def _steps(value: Any) -> bool:
    """True for a list of pairs (x from which on, level), as floors and ceilings have."""
    return isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value)


def verdict(outcome: Outcome) -> str:
    """In large: what the judge and what physics say."""
    lines = outcome.report.lines
    failed, untested = len(outcome.report.failures), sum(line.passed is None for line in lines)
    if failed:
        checks, mood = f"{failed} of {counted(len(lines), 'check')} failed", "bad"
    elif untested:
        checks = f"{len(lines) - untested} checks passed, {untested} could not be made"
        mood = "good"
    else:
        checks, mood = (
            f"All {len(lines)} checks passed" if len(lines) != 1 else "The one check passed",
            "good",
        )
    sign = "✗" if failed else "✓"
    told = [f"{line.what}{': ' if line.detail else ''}{line.detail}" for line in outcome.report.failures[:TOLD]]
    more = failed - len(told)
    told += [f"and {more} more"] if more > 0 else []
    why = "".join(f"<small>{esc(text)}</small>" for text in told)
    physics, tone = _physics(outcome)
    return (
        f'<section class="verdict" aria-label="Verdict"><p class="{mood}"><span aria-hidden="true">{sign}'
        f'</span> {checks}{why}</p><p class="{tone}">{physics}</p></section>'
    )


def _physics(outcome: Outcome) -> tuple[str, str]:
    trial = outcome.trial
    if trial is None:
        return "Not executed in physics", "plain"
    if not trial.ok:
        return f"✗ Physics {esc(trial.status)}: {esc(trial.reason)}", "bad"
    if turning_remarks(outcome.motion.robot, trial.yaw_ratio):
        return f"Physics executed {percent(trial.yaw_ratio)} of the planned turn: it cannot turn", "bad"
    if trial.advance_ratio is None:
        return (
            f"Physics executed it, at a mean speed of {figure(trial.speed, 'm/s', 3)}; no advance is planned",
            "plain",
        )
    if went_back(trial):
        return f"✗ Physics went {advance_in_words(trial)}", "bad"
    return f"Physics executed {advance_in_words(trial)}", "plain"


def tiles(outcome: Outcome, playback: Playback) -> str:
    """The key numbers."""
    motion, trial = outcome.motion, outcome.trial
    measured: dict[str, Any] = dict(trial.metrics()) if trial is not None else {}
    advance = planned_advance(playback)
    a_cycle = "a cycle" if playback.period is not None else "in all"
    none = "not simulated" if trial is None else "" if trial.ok else "physics diverged"
    speed = measured.get("speed_m_s")
    rates = [
        (figure(float(np.abs(motion.qd[:, mine]).max()), unit, 3), "planned")
        for kind, unit in (("angle", "rad/s"), ("length", "m/s"))
        if (mine := np.array([k == kind for k in motion.robot.kinds], dtype=bool)).any()
    ]
    peaks = [
        figure(measured[key], unit, 3, zeros=True)
        for key, unit in (("peak_torque_Nm", "N m"), ("peak_force_N", "N"))
        if measured.get(key)
    ]
    cost = measured.get("cost_of_transport")
    items = [
        ("Planned advance", figure(advance, "m", 3, zeros=True), a_cycle),
        (
            "Executed / planned",
            percent(measured.get("advance_ratio")),
            none or ("it went the other way" if trial and went_back(trial) else "mean of the cycles"),
        ),
        (
            "Speed",
            figure(speed, "m/s", 3, zeros=True),
            none or f"planned {figure(advance / playback.span, 'm/s', 3, zeros=True)}",
        ),
        ("Peak load of a joint", " · ".join(peaks) or figure(None), none or "executed"),
        ("Cost of transport", figure(cost, digits=3, zeros=True), none or "work / (weight × distance)"),
        ("Peak joint rate", " · ".join(value for value, _ in rates) or figure(None), "planned"),
    ]
    cells = "".join(
        f'<div class="tile"><dt>{esc(name)}</dt><dd>{value}<small>{esc(note)}</small></dd></div>'
        for name, value, note in items
    )
    return f'<dl class="tiles">{cells}</dl>\n'


def planned_advance(playback: Playback) -> float:
    """Planned displacement of the centre of mass in the first cycle (or the whole motion), m."""
    return float(playback.planned_advance[0])


def options_rows(outcome: Outcome) -> list[tuple[str, str]]:
    """The gait's and the ground's options as a table's rows."""
    rows = [("gait " + words(k), v) for k, v in outcome.motion.gait.items()]
    rows += [("ground " + words(k), v) for k, v in outcome.motion.ground.to_dict().items()]
    return [(esc(name), esc(_short(plain(value)))) for name, value in rows]


def _short(text: str) -> str:
    return text if len(text) <= 160 else text[:157] + "…"
