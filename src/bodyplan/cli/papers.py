"""bodyplan papers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bodyplan.cli.options import ForceOption
from bodyplan.terminal import bad_input, print_table, progress_bar, say

if TYPE_CHECKING:
    from bodyplan.papers import Results, Row


def _papers() -> list[str]:
    from bodyplan.papers import PAPERS

    return list(PAPERS)


NameArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="[NAME]",
        help="concertina, acm, rectilinear, legs or wheels (default: all).",
        autocompletion=_papers,
    ),
]


def papers(
    name: NameArgument = None,
    json_: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the results as JSON, too.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to write (default: runs/papers, or runs/papers-NAME).")
    ] = None,
    physics: Annotated[bool, typer.Option("--physics", help="Entries that need MuJoCo, too (half a minute).")] = False,
    force: ForceOption = False,
) -> None:
    """Recompute what the papers behind bodyplan print: values, figures, equations, printed beside ours."""
    with bad_input():
        from importlib.util import find_spec

        from bodyplan.errors import MissingExtraError
        from bodyplan.files import refuse_existing, refuse_folder
        from bodyplan.papers import PAPERS, paper, recompute
        from bodyplan.papers.drawn import draw
        from bodyplan.papers.page import WRITTEN, write_folder, write_json

        chosen = [paper(each) for each in (PAPERS if name is None else (name,))]
        folder = out if out is not None else Path("runs") / ("papers" if name is None else f"papers-{name}")
        refuse_folder(folder, force, WRITTEN)
        if json_ is not None:
            refuse_existing(json_, force)
        if physics and find_spec("mujoco") is None:
            raise MissingExtraError("mujoco", "physics", "--physics")
        with progress_bar() as progress:
            results = recompute(chosen, physics, progress)
            drawn = {each.name: draw(each, progress) for each in chosen}
            progress("writing", 0.0)
            page = write_folder(results, chosen, drawn, folder, force)
            if json_ is not None:
                write_json(results, json_)
        _print(results)
        problems = [
            f"{key}, {each.place}: {each.problem}" for key, made in drawn.items() for each in made if each.problem
        ]
        for problem in problems:
            say(f"  not drawn  {problem}", fg=typer.colors.RED)
        typer.echo(f"\n  page       {page}")
        if json_ is not None:
            typer.echo(f"  json       {json_}")
    raise typer.Exit(0 if results.ok and not problems else 1)


#: how a verdict is marked in the table
MARKS = {"reproduced": "=", "corrected": "≠", "not reproducible": "–", "differs": "?", "error": "!"}


def _print(results: Results) -> None:
    typer.echo("\n" + ", ".join(f"{mark} {verdict}" for verdict, mark in MARKS.items()))
    for done in results.papers:
        say(f"\n{done.name}: {done.title}", bold=True)
        print_table(["", "place", "what", "the paper", "here"], [_cells(row) for row in done.rows])
        typer.echo("")
        for verdict in ("error", "differs", "corrected", "not reproducible"):
            # one reason may stand behind several rows
            for why in dict.fromkeys(row.why for row in done.rows if row.verdict == verdict):
                places = "; ".join(
                    dict.fromkeys(row.place for row in done.rows if (row.verdict, row.why) == (verdict, why))
                )
                say(
                    f"  {MARKS[verdict]} {places}: {why}",
                    fg=typer.colors.RED if verdict in ("error", "differs") else None,
                )
    rows = [[done.name, *(str(done.counts[key]) for key in results.counts)] for done in results.papers]
    total = ["all", *(str(count) for count in results.counts.values())]
    typer.echo("")
    print_table(["paper", *results.counts], [*rows, total] if len(rows) > 1 else rows)


def _cells(row: Row) -> list[str]:
    printed, here = row.printed, row.ours_text
    if row.tolerance is not None:
        right = f"{row.correct}, " if row.verdict == "corrected" and row.correct else ""
        printed, here = f"{printed}, {_off(row.printed_off, row.unit)}", f"{right}{_off(row.ours_off, row.unit)}"
    elif row.unit:
        printed, here = (f"{text} {row.unit}" if text else "" for text in (printed, here))
    return [MARKS[row.verdict.value], row.place, row.what, printed, here]


def _off(value: float | None, unit: str) -> str:
    return "undefined" if value is None else f"off by {value:.2g} {unit}".rstrip() if value else "exact"
