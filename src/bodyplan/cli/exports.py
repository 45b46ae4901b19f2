"""bodyplan export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bodyplan.cli.options import ForceOption, MotionArgument, SetOption, motion_of
from bodyplan.export import FORMATS
from bodyplan.terminal import bad_input, number_or_text, print_table

_NAMES = ", ".join(FORMATS)


def _list(value: bool) -> None:
    if value:
        rows = [
            [form.name, " ".join((form.suffix, *form.aliases)), form.about, form.extra or ""]
            for form in FORMATS.values()
        ]
        print_table(["format", "suffix", "what it is", "extra"], rows)
        raise typer.Exit()


def export(
    mission: MotionArgument,
    to: Annotated[
        str, typer.Option(metavar="FORMAT", help=f"{_NAMES} (see --list).", autocompletion=lambda: list(FORMATS))
    ],
    out: Annotated[
        Path | None, typer.Option(help="File to write (default: NAME and the format's suffix here).")
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", metavar="KEY=VALUE", help="An option of the format, for example dtype=double."),
    ] = None,
    set_: SetOption = None,
    force: ForceOption = False,
    list_: Annotated[
        bool, typer.Option("--list", callback=_list, is_eager=True, help="List the formats and what they are.")
    ] = False,
) -> None:
    """Write a motion in another format: for a robot, ROS 2, a 3D program, a simulator, a table."""
    with bad_input():
        from bodyplan.errors import InputError, SolveError
        from bodyplan.export import format_named, save
        from bodyplan.files import refuse_existing

        form = format_named(to)
        suffixes = (form.suffix, *form.aliases)
        target = out if out is not None else Path(Path(mission).resolve().stem + form.ending)
        if target.suffix.lower() not in suffixes:
            raise InputError(f"--out {target}: does not end in {' or '.join(suffixes)}.")
        options = {}
        for text in option or ():
            key, equals, value = text.partition("=")
            if not equals or not key:
                raise InputError(f"--option {text}: must be KEY=VALUE.")
            options[key.strip()] = number_or_text(value.strip())
        refuse_existing(target, force)
        motion = motion_of(mission, set_)
        try:
            motion.raise_if_failed()
        except SolveError as error:
            typer.echo(f"warning: this plan is not solved everywhere ({error}); it is written as it is", err=True)
        typer.echo(save(motion, target, **options))
