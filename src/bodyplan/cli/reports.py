"""bodyplan report: finished runs side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bodyplan.cli.options import ForceOption
from bodyplan.terminal import bad_input, print_table

if TYPE_CHECKING:
    from bodyplan.show.compare import Ran


def report(
    runs: Annotated[list[str], typer.Argument(help="Folders of runs, or their metrics.json; two to six.")],
    out: Annotated[Path | None, typer.Option(help="File to write (default: runs/A-and-B.html).")] = None,
    force: ForceOption = False,
) -> None:
    """Set finished runs side by side: what was asked for, checks, every number, tracks."""
    with bad_input():
        from bodyplan.errors import InputError
        from bodyplan.files import refuse_existing
        from bodyplan.show.compare import key_rows, write_comparison

        found = _told_apart([load_run(Path(run)) for run in runs])
        target = out if out is not None else Path("runs") / f"{'-and-'.join(run.name for run in found)}.html"
        if target.suffix.lower() not in {".html", ".htm"}:
            raise InputError(f"--out {target}: does not end in .html.")
        refuse_existing(target, force)
        if out is None:
            target.parent.mkdir(exist_ok=True)
        write_comparison(found, target)
        print_table(["", *(run.name for run in found)], [[what, *values] for what, values in key_rows(found)])
        typer.echo(f"\nreport  {target}")


def load_run(path: Path) -> Ran:
    """The run of a folder, or of a metrics.json in one. Raises InputError where there is none or it is not ours."""
    from pydantic import ValidationError

    from bodyplan.errors import InputError
    from bodyplan.export import load
    from bodyplan.metrics import Metrics
    from bodyplan.show.compare import Ran

    file = path / "metrics.json" if path.is_dir() else path
    if not file.is_file():
        raise InputError(f"{path}: no run there; expected a folder written by bodyplan run, or its metrics.json.")
    try:
        metrics = Metrics.model_validate_json(file.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputError(f"{file}: not the metrics of a run: {place}: {first['msg']}.") from None
    mission, motion = file.with_name("mission.toml"), file.with_name("motion.npz")
    return Ran(
        file.resolve().parent.name if file.name == "metrics.json" else file.stem,
        metrics.model_dump(mode="json"),
        mission.read_text(encoding="utf-8") if mission.is_file() else "",
        load(motion) if motion.is_file() else None,
    )


def _told_apart(runs: list[Ran]) -> list[Ran]:
    """Runs of one name get a number."""
    from dataclasses import replace

    names = [run.name for run in runs]
    return [
        run if names.count(run.name) == 1 else replace(run, name=f"{run.name}-{names[: k + 1].count(run.name)}")
        for k, run in enumerate(runs)
    ]
