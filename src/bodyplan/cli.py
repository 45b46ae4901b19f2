"""The command line. Exit codes: 0 ok, 1 a failed check (or physics that diverged), 2 bad input."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bodyplan.terminal import bad_input, number_or_text, print_table, progress_bar, say

# everything else is imported inside the commands: --help must answer at once
if TYPE_CHECKING:
    from bodyplan.job import Result
    from bodyplan.missions import Mission
    from bodyplan.motion import Motion

app = typer.Typer(
    name="bodyplan",
    help="Say how the body should move over real ground; see what every joint must do, whether the ground allows it, "
    "and what physics makes of it.",
    epilog="Start with: bodyplan run concertina",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

MissionArgument = Annotated[
    str, typer.Argument(help="A ready mission's name (see: bodyplan missions) or a .toml file.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a field, for example gait.omega=1.1. May be repeated."),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def _version(value: bool) -> None:
    if value:
        from bodyplan import __version__

        typer.echo(f"bodyplan {__version__}")
        raise typer.Exit()


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
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


@app.command()
def check(
    mission: Annotated[str, typer.Argument(help="A mission, or a motion saved as .npz.")], set_: SetOption = None
) -> None:
    """Plan a mission (or load a motion) and let the judge test it."""
    with bad_input():
        from bodyplan.check import check as judge

        motion = _motion(mission, set_)
        report = judge(motion)
        _print_checks(report)
    raise typer.Exit(0 if report.ok else 1)


@app.command()
def export(
    mission: Annotated[str, typer.Argument(help="A mission, or a motion saved as .npz.")],
    to: Annotated[str, typer.Option(help="Format: csv, npz or xml (MJCF).")],
    out: Annotated[Path | None, typer.Option(help="File to write (default: NAME.FORMAT here).")] = None,
    set_: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Write a motion in another format."""
    with bad_input():
        from bodyplan.errors import InputError, UnknownNameError
        from bodyplan.export import FORMATS, save
        from bodyplan.files import refuse_existing

        suffix = "." + to.lower().lstrip(".")
        if suffix not in FORMATS:
            raise UnknownNameError("format", to, (name[1:] for name in FORMATS))
        target = out if out is not None else Path(Path(mission).stem + suffix)
        if target.suffix.lower() != suffix:
            raise InputError(f"--out {target}: does not end in {suffix}.")
        refuse_existing(target, force)
        typer.echo(save(_motion(mission, set_), target))


@app.command()
def fit(
    curve: Annotated[
        str,
        typer.Argument(help="serpenoid, spiral, sinus-lift; points in a .csv or .npy; or a .toml with a \\[curve]."),
    ],
    joints: Annotated[int, typer.Option(help="Joints that bend (of straight links: links).")] = 10,
    joint: Annotated[str, typer.Option(help="straight, arc or double.")] = "arc",
    axes: Annotated[
        str | None, typer.Option(help="yaw, pitch, alternating or universal (default: what the curve needs).")
    ] = None,
    end_link: Annotated[float, typer.Option(help="R_s of double joints: end links as a share of the joint.")] = 0.18,
    limit: Annotated[str | None, typer.Option(help='Largest joint angle, for example "75 deg".')] = None,
    method: Annotated[str, typer.Option(help="paper (its rule) or optimal (smallest error).")] = "paper",
    p: Annotated[float | None, typer.Option(help="Parameter of the rule for arcs (default: 0.788675).")] = None,
    start: Annotated[str, typer.Option(help='Where on the curve the tail is, for example "0.1 m".')] = "0",
    set_: SetOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder, .html, .png, .svg or .pdf to write (default: runs/fit-NAME).")
    ] = None,
    convergence: Annotated[bool, typer.Option("--convergence", help="Errors over the number of joints, too.")] = False,
    force: ForceOption = False,
) -> None:
    """Fit the joints of a snake to a body curve; print and draw how well they match."""
    with bad_input():
        from bodyplan import job
        from bodyplan.errors import SolveError
        from bodyplan.missions.curve_input import load_curve
        from bodyplan.show.fit_outcome import FitOutcome
        from bodyplan.show.fit_text import fit_text
        from bodyplan.units import to_si

        name, body_curve = load_curve(curve, set_ or ())
        target = job.fit_target(name, out, force)
        with progress_bar() as progress:
            outcome = FitOutcome.of(
                name,
                body_curve,
                joints=joints,
                joint=joint,
                axes=axes,
                end_link=end_link,
                limit=None if limit is None else to_si(number_or_text(limit), "angle", "limit"),
                method=method,
                p=p,
                start=to_si(number_or_text(start), "length", "start"),
                convergence=convergence,
                progress=progress,
            )
            progress("writing", 0.0)
            written = job.write_fit(outcome, target, force)
        say(f"\n{outcome.title}", bold=True)
        typer.echo(fit_text(outcome))
        if not outcome.ok:
            try:
                outcome.fit.raise_if_failed()
            except SolveError as error:
                say(f"\n  status     {error}", fg=typer.colors.RED)
        typer.echo(f"\n  written    {written}")
    raise typer.Exit(0 if outcome.ok else 1)


@app.command()
def missions(
    name: Annotated[str | None, typer.Argument(help="Print this mission's file, to copy and change.")] = None,
    schema: Annotated[bool, typer.Option("--schema", help="Print the options of every kind as JSON Schema.")] = False,
) -> None:
    """List the ready missions, or print one."""
    with bad_input():
        from bodyplan.errors import UnknownNameError
        from bodyplan.missions import load_mission, ready_missions

        if schema:
            import json

            from bodyplan.missions.schema import json_schema

            typer.echo(json.dumps(json_schema(), indent=2))
            return
        ready = ready_missions()
        if name is not None:
            if name not in ready:
                raise UnknownNameError("mission", name, ready)
            typer.echo(ready[name], nl=False)
            return
        print_table(["mission", "what it is"], [[n, load_mission(n).title] for n in ready])
        typer.echo("bodyplan missions NAME prints one: save it as my.toml, change it, and bodyplan run my.toml")


@app.command()
def robots() -> None:
    """List the robots that a mission can name, with their options."""
    with bad_input():
        import inspect

        from bodyplan.missions.schema import ROBOTS

        rows = []
        for kind, (builder, units) in ROBOTS.items():
            about = (inspect.getdoc(builder) or "").split("\n")[0]
            options = [
                f"{p.name}{f' [{units[p.name]}]' if p.name in units else ''}"
                + ("" if p.default is inspect.Parameter.empty else f" = {p.default}")
                for p in inspect.signature(builder).parameters.values()
            ]
            rows.append([kind, about, ", ".join(options)])
        print_table(["kind", "what it is", "options"], rows)


@app.command()
def model(
    robot: Annotated[
        str, typer.Argument(help="A robot's .csv (extended D-H table) or .toml, or a name (see: bodyplan robots).")
    ],
    symbolic: Annotated[
        bool, typer.Option("--symbolic", help="Write the formulas: NAME.tex (LaTeX) and NAME.py (NumPy).")
    ] = False,
    c: Annotated[
        Path | None, typer.Option("--c", metavar="DIR", help="Write C99 source, NAME.h and NAME.c, into this folder.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the formulas (default: that of --c, or runs/model-NAME).")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help='An option of a named robot, for example mass="20 kg".'),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Print a robot's chains, rows and joints; write its kinematics as formulas and as C."""
    with bad_input():
        from bodyplan.errors import InputError
        from bodyplan.missions.robot_input import load_robot
        from bodyplan.robot.summary import summary

        if out is not None and not symbolic:
            raise InputError(f"--out {out}: is the folder for formulas; ask for them with --symbolic.")
        loaded = load_robot(robot, set_ or ())
        written: list[Path] = []
        if symbolic or c is not None:
            from bodyplan.robot.symbolic.writing import write_model

            written = write_model(loaded.symbolic(), symbolic=symbolic, c=c, out=out, force=force)
        head, tables = summary(loaded)
        say(head, bold=True)
        for title, header, rows in tables:
            say(f"\n{title}", bold=True)
            print_table(header, rows)
        for path in written:
            typer.echo(f"{'' if path is not written[0] else chr(10)}written  {path}")


def _motion(mission: str, overrides: list[str] | None) -> Motion:
    from bodyplan.errors import InputError

    if mission.endswith(".npz"):
        from bodyplan.export import load

        if overrides:
            raise InputError("--set: a saved motion cannot be changed; give its mission instead.")
        return load(mission)
    from bodyplan.job import plan_mission
    from bodyplan.missions import load_mission

    loaded: Mission = load_mission(mission, overrides or ())
    return plan_mission(loaded)


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
    from bodyplan.show.remarks import gathered, plan_warnings

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
            ratio = "no advance planned" if row.ratio is None else f"{row.ratio:.1%} of the planned advance"
            typer.echo(
                f"  physics    {ratio}, {_figure(row.speed, 'mm/s', 1e3)}, "
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


def main() -> None:
    """Entry point of the ``bodyplan`` command."""
    # rich markup in help texts needs no colour on a pipe; typer decides by itself
    app(prog_name="bodyplan")


if __name__ == "__main__":
    main()
