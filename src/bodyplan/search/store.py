"""Finished points on disk: one line of JSON each, appended when it is known, so that a search killed at any moment
goes on where it was."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from bodyplan.errors import InputError
from bodyplan.search.point import PASSING, Row

FORMAT = "bodyplan points 1"


class Store:
    """The points that a file holds, by key; ``add`` appends one. A line that was not written to its end is left
    out, and taken away before the next one is written."""

    def __init__(self, file: IO[bytes], rows: dict[str, Row]) -> None:
        self._file, self._rows = file, rows

    def get(self, key: str) -> Row | None:
        """The finished point of that key; None where there is none."""
        return self._rows.get(key)

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, key: str, row: Row, point: Mapping[str, Any]) -> None:
        """Keep a point; one that is there already stays as it is. ``point``: its parameters, for readers of the file.
        Points that may turn out otherwise the next time are not kept."""
        if key in self._rows or row.status in PASSING:
            return
        line = {
            "key": key,
            "point": dict(point),
            "status": row.status,
            "reason": row.reason,
            "seconds": round(row.seconds, 4),
            "figures": dict(row.figures),
        }
        self._file.write(json.dumps(line, allow_nan=False, separators=(",", ":")).encode("utf-8") + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())
        self._rows[key] = row


@contextmanager
def store_at(path: Path) -> Iterator[Store]:
    """The store in the file ``path``, made where there is none. InputError where it is not a store, or another
    process writes into it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+b") as file:
        _lock(file, path)
        file.seek(0)
        rows, end = _read(file, path)
        file.truncate(end)
        if end == 0:
            file.write(json.dumps({"format": FORMAT}).encode("utf-8") + b"\n")
            file.flush()
        yield Store(file, rows)


def _read(file: IO[bytes], path: Path) -> tuple[dict[str, Row], int]:
    """Rows of whole lines, and where the last of them ends."""
    rows: dict[str, Row] = {}
    end = 0
    for i, line in enumerate(file):
        if not line.endswith(b"\n"):
            break
        try:
            data = json.loads(line)
            if i == 0:
                if data["format"] != FORMAT:
                    raise ValueError(data["format"])
            else:
                row = Row(data["status"], data["reason"], data["figures"], data["seconds"])
                rows.setdefault(data["key"], row)
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(
                f"{path}, line {i + 1}: not a point of a search; remove the file to begin anew."
            ) from error
        end += len(line)
    return rows, end


def _lock(file: IO[bytes], path: Path) -> None:
    """Refuse a second writer; the system lets go of the lock when a process ends, however it ends."""
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise InputError(f"{path}: another process is writing into it.") from error
