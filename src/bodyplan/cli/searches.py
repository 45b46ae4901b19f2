"""bodyplan sweep, optimise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bodyplan.cli.options import ForceOption, MissionArgument, SetOption
from bodyplan.terminal import bad_input, print_table, say

if TYPE_CHECKING:
    from bodyplan.search import Search, Sweep

WorkersOption = Annotated[int | None, typer.Option(help="Processes on this machine (default: one a core).")]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Use the workers of a running dask cluster: tcp://host:8786.")
]
SimulateOption = Annotated[bool, typer.Option(help="Execute each plan in MuJoCo.")]


def sweep(
    mission: MissionArgument,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="FIELD=VALUES",
            help='FROM:TO:COUNT or a,b,c: gait.overlap=0:0.8:9, ground.width="120 mm":"160 mm":5.',
        ),
    ],
    metric: Annotated[
        list[str] | None, typer.Option(metavar="FIGURE", help="What the report shows, for example trial.speed.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write (default: runs/sweep-NAME).")] = None,
    set_: SetOption = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    simulate: SimulateOption = True,
    force: ForceOption = False,
) -> None:
    """Run a mission at every combination of some values; a table, and a report with the best points."""
    with bad_input():
        from bodyplan.search import sweep as do

        with stoppable() as progress:
            made = do(
                mission,
                over,
                out,
                metrics=metric or (),
                overrides=set_ or (),
                simulate=simulate,
                workers=workers,
                scheduler=scheduler,
                force=force,
                progress=progress,
            )
        _swept(made)


def optimise(
    mission: MissionArgument,
    vary: Annotated[
        list[str],
        typer.Option(metavar="FIELD=RANGE", help="FROM:TO, FROM:TO:log, or choices a,b,c: gait.overlap=0:0.8."),
    ],
    maximise: Annotated[
        list[str] | None, typer.Option(metavar="FIGURE", help="Make it as large as possible: trial.speed.")
    ] = None,
    minimise: Annotated[list[str] | None, typer.Option(metavar="FIGURE", help="Make it as small as possible.")] = None,
    subject_to: Annotated[
        list[str] | None, typer.Option(metavar="BOUND", help='For example "trial.peak_torque<=1.2".')
    ] = None,
    trials: Annotated[int, typer.Option(help="Points to try in all.")] = 96,
    out: Annotated[Path | None, typer.Option(help="Folder to write (default: runs/optimise-NAME).")] = None,
    storage: Annotated[
        str | None, typer.Option(metavar="URL", help="Database of the study (default: SQLite in the folder).")
    ] = None,
    sampler: Annotated[
        str | None, typer.Option(help="tpe (default), cmaes, nsga2 (default for two figures) or random.")
    ] = None,
    seed: Annotated[int, typer.Option(help="What is random begins with it.")] = 0,
    batch: Annotated[int, typer.Option(help="Points suggested at a time; no fewer than there are workers.")] = 8,
    set_: SetOption = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    simulate: SimulateOption = True,
    force: ForceOption = False,
) -> None:
    """Search for the values that make a figure best, within bounds; a study, a report, and the best mission."""
    with bad_input():
        from bodyplan.search import optimise as do

        with stoppable() as progress:
            made = do(
                mission,
                vary,
                maximise=maximise or (),
                minimise=minimise or (),
                subject_to=subject_to or (),
                trials=trials,
                out=out,
                storage=storage,
                sampler=sampler,
                seed=seed,
                batch=batch,
                overrides=set_ or (),
                simulate=simulate,
                workers=workers,
                scheduler=scheduler,
                force=force,
                progress=progress,
            )
        _optimised(made)


@contextmanager
def stoppable() -> Iterator[Callable[[int, int], None]]:
    """The bar of a search that ctrl-C ends with a word."""
    try:
        with points_bar() as progress:
            yield progress
    except KeyboardInterrupt:
        typer.echo("stopped; finished points are kept and in the table, the same command goes on", err=True)
        raise typer.Exit(130) from None


@contextmanager
def points_bar() -> Iterator[Callable[[int, int], None]]:
    """Points done, their rate and the time left: a bar on a terminal, a line now and then elsewhere."""
    from time import monotonic

    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    begun: list[tuple[float, int]] = []

    def rate(done: int) -> float:
        if not begun:
            begun.append((monotonic(), done))
        start, before = begun[0]
        return (done - before) / max(monotonic() - start, 1e-9)

    if not console.is_terminal:
        said = [monotonic()]

        def note(done: int, total: int) -> None:
            speed = rate(done)
            if done == total or monotonic() - said[0] > 10.0:
                said[0] = monotonic()
                left = f", {(total - done) / speed:.0f} s left" if speed and done < total else ""
                typer.echo(f"{done} of {total} points, {speed:.3g} a second{left}", err=True)

        yield note
        return
    columns = (TextColumn("points"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
               TextColumn("left"), TimeRemainingColumn())  # fmt: skip
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None, rate="")

        def show(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, rate=f"{rate(done):.3g} a second")

        yield show


def _swept(made: Sweep) -> None:
    """One screen: how many points, the best ones, what failed, where the report is."""
    from collections import Counter

    from bodyplan.show.text import figure

    say(f"\n{made.mission.title}", bold=True)
    counts = Counter(row.status for row in made.rows)
    said = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    typer.echo(f"  points     {len(made.rows)}: {said}")
    rows = []
    for measure in made.measures:
        for word, lowest in (("highest", False), ("lowest", True)):
            i = made.best(measure, lowest=lowest)
            if i is not None:
                value = figure(measure.of(made.rows[i].figures), measure.unit.replace("*", " "))
                rows.append([f"{word} {measure.text}", value, ", ".join(made.points[i].overrides)])
    if rows:
        print_table(["", "value", "at"], rows)
    else:
        first = next(row for row in made.rows if not row.ok)
        say(f"  no point is ok; the first: {first.status}, {first.reason}", fg=typer.colors.RED)
    typer.echo(f"\n  table      {made.folder / 'table.csv'}, table.parquet\n  report     {made.report}")
    if not rows:
        raise typer.Exit(1)


def _optimised(made: Search) -> None:
    """One screen: the best trial, the front, where the report is."""
    from bodyplan.search.studies import feasible
    from bodyplan.show.text import figure

    say(f"\n{made.mission.title}", bold=True)
    kept = sum(feasible(trial.row, made.bounds) for trial in made.trials)
    typer.echo(f"  trials     {len(made.trials)}, {kept} within all bounds")
    best = made.best
    if best is None:
        say("  nothing was found that keeps all bounds; the report says why", fg=typer.colors.RED)
    else:
        trial = made.trials[best]
        rows = [[m.text, figure(m.of(trial.row.figures), m.unit.replace("*", " "))] for m in made.measures]
        rows += [[one.key, str(value.setting)] for one, value in zip(made.ranges, trial.values, strict=True)]
        print_table([f"trial {trial.number}", "best"], rows)
        if len(made.objectives) > 1:
            typer.echo(f"  front      {len(made.front)} trials, in the report")
        typer.echo(f"\n  mission    {made.folder / 'best.toml'}")
    typer.echo(f"  table      {made.folder / 'table.csv'}, table.parquet\n  report     {made.report}")
    if best is None:
        raise typer.Exit(1)
