"""bodyplan model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bodyplan.cli.options import ForceOption
from bodyplan.terminal import bad_input, print_table, say


def model(
    robot: Annotated[
        str,
        typer.Argument(
            help="A robot's .csv (extended D-H table), .toml, .urdf or .xml (MJCF), or a name (see: bodyplan robots)."
        ),
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
