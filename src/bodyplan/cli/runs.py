"""bodyplan run, check."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bodyplan.cli.options import ForceOption, MissionArgument, MotionArgument, SetOption, motion_of
from bodyplan.terminal import bad_input, print_table, progress_bar, say

if TYPE_CHECKING:
    from bodyplan.job import Result


def run(
    mission: MissionArgument,
    out: Annotated[Path | None, typer.Option(help="Folder to write (default: runs/NAME).")] = None,
    set_: SetOption = None,
    force: ForceOption = False,
    simulate: Annotated[bool, typer.Option(help="Execute the plan in MuJoCo.")] = True,
    compare: Annotated[bool, typer.Option(help="Run the missions that this one is compared with.")] = True,
) -> None:
    """Plan, check and simulate a mission; write its folder and report.html."""
    with bad_input():
        from bodyplan import job

        with progress_bar() as progress:
            result = job.run(
                mission, out, overrides=set_ or (), force=force, simulate=simulate, compare=compare, progress=progress
            )
        _summary(result)
    raise typer.Exit(0 if result.ok else 1)


def check(mission: MotionArgument, set_: SetOption = None) -> None:
    """Plan a mission (or load a motion) and let the judge test it."""
    with bad_input():
        from bodyplan.check import check as judge

        motion = motion_of(mission, set_)
        report = judge(motion)
        _print_checks(report)
    raise typer.Exit(0 if report.ok else 1)


def _print_checks(report: Any) -> None:
    for line in report:
        colour = {True: None, False: typer.colors.RED, None: typer.colors.YELLOW}[line.passed]
        say(str(line), fg=colour)
    failed = len(report.failures)
    say(
        f"{failed} of {len(report.lines)} checks failed" if failed else f"all {len(report.lines)} checks passed",
        bold=True,
    )


def _figure(value: float | None, unit: str, scale: float = 1.0, digits: int = 3) -> str:
    return "-" if value is None else f"{value * scale:.{digits}g} {unit}".rstrip()


def _summary(result: Result) -> None:
    """One screen: verdict, key figures, the comparison, where the report is."""
    from bodyplan.show.remarks import advance_in_words, gathered, plan_warnings

    outcome, plan = result.outcome, result.outcome.motion.facts
    report, trial = outcome.report, outcome.trial
    say(f"\n{outcome.title}", bold=True)
    for line in report.failures:
        say(str(line), fg=typer.colors.RED)
    failed = len(report.failures)
    warnings = plan_warnings(outcome.motion)
    typer.echo(f"  checks     {len(report.lines) - failed} passed, {failed} failed")
    if "period" in plan and "advance_per_cycle" in plan:
        typer.echo(
            f"  plan       {_figure(plan['advance_per_cycle'], 'mm', 1e3, 4)} a cycle of "
            f"{_figure(plan['period'], 's')}, {_figure(plan['speed'], 'mm/s', 1e3)}"
        )
    elif "advance" in plan and "speed" in plan:
        typer.echo(f"  plan       {_figure(plan['advance'], 'm')} in all, {_figure(plan['speed'], 'mm/s', 1e3)}")
    if trial is not None:
        row = outcome.itself
        if trial.ok:
            advance = advance_in_words(trial, lambda m: _figure(m, "m"), lambda ratio: f"{ratio:.1%}")
            # the words say which way
            speed = None if row.speed is None else abs(row.speed)
            typer.echo(
                f"  physics    {advance}, {_figure(speed, 'mm/s', 1e3)}, "
                f"peak torque {_figure(row.peak_torque, 'N m')}, "
                f"cost of transport {_figure(row.cost_of_transport, '')}"
            )
            if row.no_slip_ratio is not None:
                angle = "" if row.slip_angle is None else f", slip angle {math.degrees(row.slip_angle):.3g} deg"
                own = "" if row.forward_ratio is None else f", {row.forward_ratio:.1%} along its own heading"
                typer.echo(f"             {row.no_slip_ratio:.1%} of the speed without slip{own}{angle}")
            if trial.lift_ratio is not None:
                tilt = "" if trial.tilt is None else f", tilt {_figure(math.degrees(trial.tilt), 'deg')}"
                typer.echo(f"             lifted parts rise to {trial.lift_ratio:.1%} of the plan or more{tilt}")
        else:
            say(f"  physics    {trial.status}: {trial.reason}", fg=typer.colors.RED)
        warnings += gathered(trial, outcome.motion.robot)
    for warning in warnings[:5]:
        typer.echo(f"  warning    {warning}")
    if len(warnings) > 5:
        typer.echo(f"             and {len(warnings) - 5} more in the report")
    if outcome.others:
        typer.echo("")
        print_table(
            ["mission", "executed / planned", "speed"],
            [
                [o.name, "-" if o.ratio is None else f"{o.ratio:.2f}", _figure(o.speed, "mm/s", 1e3)]
                for o in (outcome.itself, *outcome.others)
            ],
        )
    lost = [f"{o.name}: {o.status}, {o.reason}" for o in outcome.others if o.reason]
    if outcome.grid is not None:
        bad = [p for p in outcome.grid.points if p.reason]
        lost += [f"{p.mission} at {outcome.grid.label} = {p.value:.4g}: {p.status}, {p.reason}" for p in bad]
    for text in lost[:3]:
        typer.echo(f"  no figures {text}")
    if len(lost) > 3:
        typer.echo(f"             and {len(lost) - 3} more in the report")
    typer.echo(f"\n  report     {result.report}")
