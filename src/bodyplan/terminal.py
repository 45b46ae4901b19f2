"""What all commands share: errors of the user's making, progress, colour, tables. Loads nothing heavy."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer


@contextmanager
def bad_input() -> Iterator[None]:
    """Errors of the user's making end with one message and exit code 2."""
    from bodyplan.errors import BodyplanError

    try:
        yield
    except BodyplanError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from None
    except BrokenPipeError:
        raise typer.Exit(0) from None
    except OSError as error:
        typer.echo(f"error: {error.strerror or error}: {error.filename or ''}".rstrip(": "), err=True)
        raise typer.Exit(2) from None
    except (MemoryError, RecursionError):
        typer.echo("error: the input is too large or too deeply nested for this machine", err=True)
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        typer.echo("stopped; nothing was written", err=True)
        raise typer.Exit(130) from None


@contextmanager
def progress_bar() -> Iterator[Any]:
    """A progress bar on a terminal, one line a step elsewhere."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.is_terminal:
        said: list[str] = []

        def note(step: str, part: float) -> None:
            if step not in said:
                said.append(step)
                typer.echo(f"{step} ...", err=True)

        yield note
        return
    columns = (
        TextColumn("{task.description:12}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def show(step: str, part: float) -> None:
            bar.update(task, description=step, completed=part)

        yield show


def say(text: str, **style: Any) -> None:
    """Styled, unless the user asked for no colour (NO_COLOR)."""
    typer.secho(text, color=False if os.environ.get("NO_COLOR") else None, **style)


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table without lines, as wide as the terminal."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for title in header:
        table.add_column(title, overflow="fold")
    for row in rows:
        table.add_row(*(str(cell).replace("[", r"\[") for cell in row))
    Console().print(table)


def number_or_text(text: str) -> str | float:
    """A number where the text is one: SI then, as in a mission file."""
    try:
        return float(text)
    except ValueError:
        return text
