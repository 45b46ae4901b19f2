"""What the viewer's panel says, as HTML: verdict, key numbers, why there is no plan."""

from __future__ import annotations

from bodyplan.show.live.session import State
from bodyplan.show.remarks import advance_in_words, plan_warnings, went_back
from bodyplan.show.text import counted, esc, figure, percent, unit_of, words

#: facts of a plan that are told first where there are any, and how many are told in all
FIRST = (
    "speed",
    "advance_per_cycle",
    "advance",
    "period",
    "turn_per_cycle",
    "smallest_margin",
    "margin",
    "peak_joint_rate",
    "peak_torque",
)
#: a number below this is rounding
NOTHING = 1e-9
TOLD, FAILURES, WARNINGS = 8, 3, 3
_STYLE = (
    "<style>.bp{padding:.4em .9em;font-size:.875em;line-height:1.45}.bp p{margin:.25em 0}.bp b{font-weight:600}"
    ".bp .good{color:#00664b}.bp .bad{color:#b3261e}.bp .busy{color:#55616d}"
    ".bp table{border-collapse:collapse;width:100%;margin:.3em 0}.bp td{padding:.08em 0;vertical-align:top}"
    ".bp td:last-child{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}</style>"
)


def verdict(state: State) -> str:
    """What the judge says, or that it is at work, and why the latest wish has no plan."""
    lines = []
    if state.problem:
        kept = "" if state.number == 0 else " The last good plan is shown."
        lines.append(f'<p class="bad" data-bp="problem"><b>No such plan:</b> {esc(state.problem)}{kept}</p>')
    if state.planning:
        lines.append('<p class="busy" data-bp="verdict">planning …</p>')
    elif state.report is None:
        text = "checking …" if state.checking or state.preview else "could not be checked"
        lines.append(f'<p class="busy" data-bp="verdict">{text}</p>')
    else:
        failed, count = state.report.failures, len(state.report.lines)
        if failed:
            lines.append(
                f'<p class="bad" data-bp="verdict"><b>✗ {len(failed)} of {counted(count, "check")} failed</b></p>'
            )
            lines += [f'<p class="bad">{esc(f"{line.what}: {line.detail}")}</p>' for line in failed[:FAILURES]]
        else:
            lines.append(f'<p class="good" data-bp="verdict"><b>✓ all {count} checks passed</b></p>')
    lines += [f"<p>{esc(text)}</p>" for text in plan_warnings(state.motion)[:WARNINGS] if not state.problem]
    took = "" if state.plan_time is None else f'<p class="busy" data-bp="took">planned in {state.plan_time:.2g} s</p>'
    return f'{_STYLE}<div class="bp">{"".join(lines)}{_table(numbers(state))}{took}</div>'


def numbers(state: State) -> list[tuple[str, str]]:
    """Key numbers of the plan: names and values with units (HTML)."""
    facts = state.motion.facts
    names = [name for name in FIRST if name in facts]
    names += [name for name in facts if name not in names]
    rows = [("samples", str(len(state.motion.t)))]
    shown = {name: 0.0 if abs(facts[name]) < NOTHING else facts[name] for name in names[:TOLD]}
    return [(esc(words(name)), figure(value, unit_of(name))) for name, value in shown.items()] + rows


def physics(state: State) -> str:
    """What the physics say."""
    if state.physics_waits:
        text = '<p class="busy" data-bp="physics">waits for the plan …</p>'
    elif state.physics is not None:
        text = f'<p class="busy" data-bp="physics">executing … {100.0 * state.physics:.0f} %</p>'
    elif state.physics_problem:
        text = f'<p class="bad" data-bp="physics">Physics: {esc(state.physics_problem)}</p>'
    elif state.trial is None:
        text = '<p class="busy" data-bp="physics">not executed yet</p>'
    else:
        trial = state.trial
        rows = [
            ("executed / planned advance", percent(trial.advance_ratio)),
            ("speed", figure(trial.speed, "m/s")),
            ("peak torque", figure(trial.peak_torque, "N m")),
            ("cost of transport", figure(trial.cost_of_transport)),
        ]
        told = [f"The body went {advance_in_words(trial)}."] if went_back(trial) else []
        warned = "".join(f"<p>{esc(text)}</p>" for text in (*told, *trial.warnings[:WARNINGS]))
        text = f'<p class="good" data-bp="physics"><b>✓ executed</b></p>{_table(rows)}{warned}'
    return f'{_STYLE}<div class="bp">{text}</div>'


def moment(time: float, duration: float, stages: list[str]) -> str:
    """The time, and the stage of the gait that it falls into."""
    at = f"<b>{time:.2f}</b> of {duration:.2f} s"
    named = f" · {esc(', '.join(stages[:3]))}" if stages else ""
    return f'{_STYLE}<div class="bp" data-bp="moment">{at}{named}</div>'


def trouble(text: str) -> str:
    """What went wrong."""
    return f'{_STYLE}<div class="bp"><p class="bad" data-bp="trouble">{esc(text)}</p></div>'


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><td>{name}</td><td>{value}</td></tr>" for name, value in rows)
    return f"<table>{cells}</table>"
