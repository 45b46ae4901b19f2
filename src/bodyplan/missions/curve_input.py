"""A body curve as a user names it: a kind with the paper's options, a file of points, a TOML file with a table."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bodyplan import curves
from bodyplan.curves import BodyCurve, Sampled
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.missions.files import MAX_BYTES, override

#: kinds that can be given by name alone, with the options that paper *acm* draws them with
READY: dict[str, dict[str, Any]] = {
    "serpenoid": {"alpha": "60 deg"},
    "spiral": {},
    "sinus-lift": {"alpha": "75 deg", "lift": 0.3},
}
ALIASES = {"sinus-lifting": "sinus-lift"}
POINTS = (".csv", ".npy")
EXAMPLE = "alpha=60 deg"


def load_curve(source: str, overrides: Sequence[str] = ()) -> tuple[str, BodyCurve]:
    """Name and curve: of a kind in :data:`READY`, of the points in a .csv or .npy file, or of a TOML file whose table
    ``[curve]`` (or ``[gait.curve]``, or whose own top) has a kind. ``overrides``: texts "alpha=60 deg".

    Raises InputError or UnknownNameError that names what is wrong and what there is.
    """
    plain = source.strip().lower().replace("_", "-")
    kind = ALIASES.get(plain, plain)
    if kind in READY:
        return kind, _made({"kind": kind, **READY[kind]}, overrides, f"curve {kind}")
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix not in (*POINTS, ".toml"):
        where = "neither a known name nor a file ending in .csv, .npy or .toml"
        raise UnknownNameError("curve", source, READY, where=where)
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}.")
    if suffix in POINTS:
        if overrides:
            raise InputError(f"--set {overrides[0]}: a curve through points has nothing to change.")
        return path.stem, Sampled.from_file(path)
    return path.stem, _made(_table(path), overrides, str(path))


def _table(path: Path) -> dict[str, Any]:
    """The table of the curve in a TOML file."""
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: a curve file of more than {MAX_BYTES} bytes is refused.")
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not a UTF-8 text ({error.reason} at byte {error.start}).") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{path}: not valid TOML: {error}.") from error
    gait = data.get("gait")
    for table in (data.get("curve"), gait.get("curve") if isinstance(gait, Mapping) else None, data):
        if isinstance(table, Mapping) and "kind" in table:
            return dict(table)
    raise InputError(f'{path}: has no table of a curve; write for example [curve] and kind = "serpenoid".')


def _made(table: dict[str, Any], overrides: Sequence[str], where: str) -> BodyCurve:
    for item in overrides:
        override(table, item, EXAMPLE)
    try:
        return curves.from_dict(table)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
