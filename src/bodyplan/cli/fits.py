"""bodyplan fit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bodyplan.cli.options import ForceOption, SetOption
from bodyplan.terminal import bad_input, number_or_text, progress_bar, say


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
