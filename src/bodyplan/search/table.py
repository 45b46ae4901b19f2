"""The table of a search as CSV and Parquet: parameters, every figure, status and reason; a row a point."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bodyplan.errors import MissingExtraError
from bodyplan.files import replacing

#: columns that are not figures
STATUS, REASON = "status", "reason"
Table = dict[str, list[Any]]


def table_of(
    parameters: Sequence[Mapping[str, Any]], rows: Sequence[Any], extra: Mapping[str, Sequence[Any]] | None = None
) -> Table:
    """Columns: the parameters of each row, ``extra`` ones, status, reason, and every figure that a row has (None in
    rows without it), in the order in which they first come."""
    table: Table = {key: [] for values in parameters for key in values}
    for key, column in table.items():
        column += [values.get(key) for values in parameters]
    table |= {key: list(column) for key, column in (extra or {}).items()}
    table[STATUS] = [row.status for row in rows]
    table[REASON] = [row.reason for row in rows]
    names = dict.fromkeys(name for row in rows for name in row.figures)
    return table | {name: [row.figures.get(name) for row in rows] for name in names}


def write_csv(table: Table, path: Path) -> None:
    """Numbers with all their digits; an empty cell where there is none."""
    with replacing(path) as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(table)
        rows.writerows([_cell(value) for value in row] for row in zip(*table.values(), strict=True))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def needs_parquet() -> None:
    """MissingExtraError without pyarrow."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("pyarrow", "cluster", "a Parquet table") from error


def write_parquet(table: Table, path: Path, about: Mapping[str, Any]) -> None:
    """The same as Parquet, with ``about`` (JSON types) as metadata under "bodyplan"."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    columns = {name: pa.array(_alike(values)) for name, values in table.items()}
    made = pa.table(columns).replace_schema_metadata({"bodyplan": json.dumps(dict(about))})
    with replacing(path, "wb") as file:
        parquet.write_table(made, file)


def _alike(values: Sequence[Any]) -> list[Any]:
    """Values of one type: whole numbers, numbers, or texts."""
    kinds = {type(value) for value in values if value is not None}
    if kinds <= {int} and kinds:
        return list(values)
    if kinds <= {int, float}:
        return [None if value is None else float(value) for value in values]
    return [None if value is None else str(value) for value in values]
