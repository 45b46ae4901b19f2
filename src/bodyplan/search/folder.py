"""The folder of a search: what was asked, its finished points, its table and its page."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bodyplan import __version__
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.files import refuse_folder, replacing
from bodyplan.search.measures import Bound
from bodyplan.search.payload import Payload
from bodyplan.search.store import Store, store_at
from bodyplan.search.table import Table, needs_parquet, write_csv, write_parquet

POINTS, ASKED, CSV, PARQUET, PAGE = "points.jsonl", "search.json", "table.csv", "table.parquet", "report.html"
BEST = "best.toml"
#: everything that a search writes; study.db and its companions are Optuna's
WRITTEN = (
    POINTS,
    ASKED,
    CSV,
    PARQUET,
    PAGE,
    BEST,
    "study.db",
    "study.db-journal",
    "study.db-wal",
    "study.db-shm",
)


def folder_of(out: str | os.PathLike[str] | None, kind: str, name: str) -> Path:
    """``out``, or the folder that a search of that kind gets where nobody says: ``runs/<kind>-<name>``."""
    return Path(out) if out is not None else Path("runs") / f"{kind}-{name}"


def settings_of(simulate: bool, bounds: Sequence[Bound] | None = None) -> dict[str, Any]:
    """What a point's row depends on besides its mission; ``bounds``: what a plan has to keep to be executed,
    beside its checks; None where all are executed."""
    versions: dict[str, Any] = {"bodyplan": __version__}
    if simulate:
        from importlib.metadata import PackageNotFoundError, version

        try:
            versions["mujoco"] = version("mujoco")
        except PackageNotFoundError as error:
            raise MissingExtraError("mujoco", "physics", "simulation (or search with --no-simulate)") from error
    first = {} if bounds is None else {"bounds": [bound.text for bound in bounds]}
    return {"simulate": simulate, "versions": versions, **first}


@contextmanager
def opened(folder: Path, asked: Mapping[str, Any], force: bool) -> Iterator[Store]:
    """The finished points in ``folder``, which is made where there is none. A folder of the same search goes on; one of
    another search is refused unless ``force``: its points are kept, its table and page are replaced."""
    needs_parquet()
    _needs_plotly()
    refuse_folder(folder, True, WRITTEN)
    mine = json.loads(json.dumps(dict(asked)))
    old = folder / ASKED
    if old.exists() and not force:
        try:
            theirs = json.loads(old.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(f"{old}: not JSON ({error}); choose another folder with --out.") from error
        differing = sorted(key for key in {*mine, *theirs} if mine.get(key) != theirs.get(key))
        if differing:
            raise InputError(
                f"{folder}: holds another search (its {', '.join(differing)} differ); choose another folder with "
                "--out, or --force to replace its table: points that both have are taken over."
            )
    folder.mkdir(parents=True, exist_ok=True)
    with store_at(folder / POINTS) as store:
        with replacing(old) as file:
            file.write(json.dumps(mine, indent=2) + "\n")
        yield store


def asked_of(kind: str, payload: Payload, simulate: bool, **more: Any) -> dict[str, Any]:
    """What was asked of a search, as JSON types: two searches that agree in it go on from each other."""
    return {
        "format": "bodyplan search 1",
        "kind": kind,
        "mission": payload.name,
        "content": payload.content,
        "simulate": simulate,
        "version": __version__,
        **more,
    }


def write_tables(folder: Path, table: Table, about: Mapping[str, Any]) -> None:
    """table.csv and table.parquet, each whole."""
    write_csv(table, folder / CSV)
    write_parquet(table, folder / PARQUET, about)


def _needs_plotly() -> None:
    from importlib.util import find_spec

    if find_spec("plotly") is None:
        raise MissingExtraError("plotly", "report", "report.html")
