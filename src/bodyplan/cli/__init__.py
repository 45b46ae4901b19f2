"""The command line: one file a command, one line each in :data:`COMMANDS`. Exit codes: 0 ok, 1 a failed check (or
physics that diverged), 2 bad input.

Commands import what they need when they run: --help must answer at once.
"""

from __future__ import annotations

from typing import Annotated

import typer

from bodyplan.cli import doctor, exports, fits, lists, models, papers, reports, runs, searches, views

app = typer.Typer(
    name="bodyplan",
    help="Say how the body should move over real ground; see what every joint must do, whether the ground allows it, "
    "and what physics makes of it.",
    epilog="Start with: bodyplan run concertina",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

COMMANDS = (
    runs.run,
    runs.check,
    views.view,
    reports.report,
    exports.export,
    fits.fit,
    lists.missions,
    lists.robots,
    models.model,
    papers.papers,
    searches.sweep,
    searches.optimise,
    doctor.doctor,
)
for _command in COMMANDS:
    app.command()(_command)


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


def main() -> None:
    """Entry point of the ``bodyplan`` command."""
    # rich markup in help texts needs no colour on a pipe; typer decides by itself
    app(prog_name="bodyplan")

    main()
