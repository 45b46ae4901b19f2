"""bodyplan missions, robots: what there is to choose from."""

from __future__ import annotations

from typing import Annotated

import typer

from bodyplan.cli.options import missions_like
from bodyplan.terminal import bad_input, print_table


def missions(
    name: Annotated[
        str | None, typer.Argument(help="Print this mission's file, to copy and change.", autocompletion=missions_like)
    ] = None,
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
