"""bodyplan view."""

from __future__ import annotations

from typing import Annotated

import typer

from bodyplan.cli.options import MotionArgument, SetOption
from bodyplan.terminal import bad_input, say


def view(
    mission: MotionArgument,
    set_: SetOption = None,
    port: Annotated[
        int | None, typer.Option(help="Port on this machine; 0: any free one (default: 8080, or any if it is busy).")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    simulate: Annotated[bool, typer.Option(help="Execute the plan in MuJoCo at once.")] = False,
) -> None:
    """Watch a mission live in the browser and change its gait by hand. Served on this machine only."""
    with bad_input():
        from bodyplan.viewing import view as start

        viewer = start(mission, overrides=set_ or (), port=port, simulate=simulate)
        with viewer:
            try:
                say(viewer.session.source.title, bold=True)
                typer.echo(f"  watch      {viewer.url}  (on this machine only; ctrl-C ends it)")
                if browser:
                    viewer.open()
                viewer.wait()
            except KeyboardInterrupt:  # as soon as the address is told, before anybody waits
                pass
        typer.echo("stopped", err=True)
