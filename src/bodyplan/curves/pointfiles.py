"""Points from files: .csv and .npy; sizes are bounded."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError

KINDS_OF_FILE = (".csv", ".npy")
_MAX_BYTES = 32 * 1024 * 1024
_COLUMNS = ("x", "y", "z")


def read_points(path: str | Path, most: int) -> Array:
    """Points (M, 3) or (M, 2), M <= ``most``; see :meth:`bodyplan.Sampled.from_file`."""
    file = Path(path)
    where = f"curve {str(path)!r}"
    if file.suffix.lower() not in KINDS_OF_FILE:
        raise UnknownNameError("kind of file", file.suffix, KINDS_OF_FILE, where)
    if not file.is_file():
        raise InputError(f"{where}: there is no such file.")
    if file.stat().st_size > _MAX_BYTES:
        raise InputError(f"{where}: larger than the {_MAX_BYTES // 2**20} MiB allowed.")
    try:
        if file.suffix.lower() == ".npy":
            # mapped, so that a header cannot claim more than the file holds
            return finite(np.array(np.load(file, mmap_mode="r", allow_pickle=False)), where)
        return _csv(file, where, most)
    except (OSError, EOFError, ValueError, csv.Error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{where}: cannot be read: {error}.") from error


def _csv(file: Path, where: str, most: int) -> Array:
    with file.open(encoding="utf-8-sig", newline="") as text:
        rows = [(line, row) for line, row in enumerate(csv.reader(text), start=1) if any(cell.strip() for cell in row)]
    if not rows:
        raise InputError(f"{where}: has no points.")
    columns = list(range(len(rows[0][1])))
    if not all(_is_number(cell) for cell in rows[0][1]):
        names = [cell.strip().lower() for cell in rows[0][1]]
        for name in ("x", "y"):
            if name not in names:
                raise InputError(f"{where}: its header needs columns x, y and perhaps z, got {rows[0][1]}.")
        columns = [names.index(name) for name in _COLUMNS if name in names]
        rows = rows[1:]
    elif len(columns) not in (2, 3):
        raise InputError(f"{where}: needs 2 or 3 columns, or a header with x, y and z; got {len(columns)} columns.")
    if len(rows) > most:
        raise InputError(f"{where}: has {len(rows)} points, at most {most} are allowed.")
    points = np.empty((len(rows), len(columns)))
    for i, (line, row) in enumerate(rows):
        try:
            points[i] = [float(row[k]) for k in columns]
        except (IndexError, ValueError) as error:
            raise InputError(f"{where}: line {line} is not a point: {row}.") from error
    return finite(points, where)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
