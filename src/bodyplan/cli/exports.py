"""bodyplan export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bodyplan.cli.options import ForceOption, MotionArgument, SetOption, motion_of
from bodyplan.terminal import bad_input


def export(
    mission: MotionArgument,
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
        typer.echo(save(motion_of(mission, set_), target))
