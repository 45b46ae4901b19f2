"""Robots in files: TOML (all of a robot) and CSV tables of D-H rows."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.files import replacing
from bodyplan.robot.describe import EFFORTS, RATES, Parts, robot_from_dict
from bodyplan.robot.drive_text import located, quantity, variable
from bodyplan.robot.elements import Body, Chain, Joint, Row

MAX_BYTES = 4_000_000
_NEEDED = ("chain", "from", "to", *Row.VARIABLES)
_OPTIONAL = ("limit_low", "limit_high", "rate", "effort", "mass", "passive")
_BASE_NAMES = ("base", "BY")  # BY is the body frame of paper *legs*
_YES_NO = {"": False, "no": False, "false": False, "0": False, "yes": True, "true": True, "1": True}


def read_toml(path: str | os.PathLike[str]) -> Parts:
    """Arguments of Robot from a TOML file with the fields of :meth:`Robot.to_dict`; numbers may be texts with
    units and variables may be drives as text. InputError names the file and the entry or line."""
    text = read_text(path)
    with located(str(path)):
        try:
            return robot_from_dict(tomllib.loads(text))
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise InputError(str(error)) from error


def write_toml(data: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write what :meth:`Robot.to_dict` gives; the file appears whole or not at all."""
    lines = [f"{key} = {toml_value(value)}" for key, value in data.items() if not isinstance(value, (list, dict))]
    for key, value in data.items():
        if isinstance(value, dict):
            lines += ["", f"[{key}]", *(f"{k} = {toml_value(v)}" for k, v in value.items())]
        elif isinstance(value, list):
            for item in value:
                lines += ["", f"[[{key}]]"]
                for k, v in item.items():
                    nested = isinstance(v, list) and v and isinstance(v[0], dict)
                    text = (
                        "[\n" + "".join(f"  {toml_value(entry)},\n" for entry in v) + "]" if nested else toml_value(v)
                    )
                    lines.append(f"{k} = {text}")
    with replacing(path) as file:
        file.write("\n".join(lines) + "\n")


def toml_value(value: Any) -> str:
    """A value of JSON type as TOML, on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_toml_key(k)} = {toml_value(v)}" for k, v in value.items()) + " }"
    return "[" + ", ".join(toml_value(v) for v in value) + "]"


def _toml_key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else toml_value(key)


def read_table(path: str | os.PathLike[str]) -> tuple[str, tuple[Chain, ...]]:
    """Name (of the file) and chains from a CSV table of the extended D-H parameters, one row a line.

    Columns, in any order: ``chain, from, to, theta, d, a, epsilon`` and optionally ``limit_low, limit_high,
    rate, effort`` (of the one joint in the row), ``passive`` (yes/no: that joint has no actuator) and
    ``mass`` (of the body at the new frame). A header such as ``a [mm]`` gives the unit of plain numbers in
    its column; without one they are SI. A cell may carry its own unit. A driven cell names its joint:
    ``knee``, ``knee + 90 deg``, ``0.5*knee``. Empty is 0 (or nothing). Lines that start with # are comments.

    Within a chain every row starts ``from`` the frame the row before ends in (``to``); the first starts from
    ``base`` (or ``BY``) or from a frame of an earlier chain. InputError names file, line and column.
    """
    rows: dict[str, list[Row]] = {}
    known = {"base"}
    parents: dict[str, str] = {}
    units: dict[str, str | None] = {}
    for line, cells in _csv_lines(path):
        where = f"{path}, line {line}"
        if not units:
            units = _header(cells, where)
            continue
        if len(cells) != len(units):
            raise InputError(f"{where}: {len(cells)} cells, but the header names {len(units)} columns.")
        cell = dict(zip(units, cells, strict=True))
        chain, start, end = cell["chain"], cell["from"], cell["to"]
        for column in ("chain", "from", "to"):
            if not cell[column]:
                raise InputError(f"{where}, column {column}: must not be empty.")
        if chain not in rows:
            rows[chain], parents[chain] = [], "base" if start in _BASE_NAMES else start
        elif start != rows[chain][-1].name:
            raise InputError(
                f"{where}, column from: chain {chain!r} does not meet: the row before ends in frame "
                f"{rows[chain][-1].name!r}, this one starts from {start!r}."
            )
        if not rows[chain] and parents[chain] not in known:
            raise UnknownNameError("frame", start, known, where=f"{where}, column from")
        if end in known or end in _BASE_NAMES:
            raise InputError(f"{where}, column to: a frame {end!r} exists already.")
        known.add(end)
        rows[chain].append(_row(cell, units, end, where))
    if not rows:
        raise InputError(f"{path}: the table has no rows.")
    with located(str(path)):
        return Path(path).stem, tuple(Chain(name, tuple(items), parents[name]) for name, items in rows.items())


def _row(cell: Mapping[str, str], units: Mapping[str, str | None], name: str, where: str) -> Row:
    values: dict[str, Any] = {}
    for field in Row.VARIABLES:
        dimension = "angle" if field in Row.ANGLES else "length"
        if cell[field]:
            values[field] = variable(cell[field], dimension, f"{where}, column {field}", units[field])
    driven = [field for field, value in values.items() if isinstance(value, Joint)]
    kind = "angle" if driven and driven[0] in Row.ANGLES else "length"

    def read(column: str, dimension: str) -> float | None:
        text = cell.get(column, "")
        return quantity(text, dimension, f"{where}, column {column}", units[column]) if text else None

    properties: dict[str, Any] = {"rate": read("rate", RATES[kind]), "effort": read("effort", EFFORTS[kind])}
    low, high = read("limit_low", kind), read("limit_high", kind)
    if (low, high) != (None, None):
        properties["limits"] = (-math.inf if low is None else low, math.inf if high is None else high)
    passive = cell.get("passive", "").lower()
    if passive not in _YES_NO:
        raise InputError(f"{where}, column passive: must be yes or no, got {cell['passive']!r}.")
    properties = {key: value for key, value in properties.items() if value is not None}
    if _YES_NO[passive]:
        properties["actuated"] = False
    if properties and len(driven) != 1:
        raise InputError(
            f"{where}: limits, rate, effort, passive need a row with one joint, this one has {len(driven)}."
        )
    mass = read("mass", "mass")
    with located(where):
        for field in driven:
            values[field] = replace(values[field], **properties)
        return Row(**values, name=name, body=None if mass is None else Body(mass=mass))


def _header(cells: list[str], where: str) -> dict[str, str | None]:
    units: dict[str, str | None] = {}
    for cell in cells:
        found = re.fullmatch(r"(\w+)\s*(?:\[([^\]]{1,30})\])?", cell)
        name = found[1].lower() if found else cell
        if name not in (*_NEEDED, *_OPTIONAL):
            raise UnknownNameError("column", name, (*_NEEDED, *_OPTIONAL), where=where)
        if name in units:
            raise InputError(f"{where}: two columns are named {name!r}.")
        units[name] = found[2] if found else None
    missing = [name for name in _NEEDED if name not in units]
    if missing:
        raise InputError(f"{where}: no column {', '.join(missing)}; a table needs {', '.join(_NEEDED)}.")
    return units


def _csv_lines(path: str | os.PathLike[str]) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(read_text(path).splitlines(), strict=True)
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if any(cells) and not cells[0].startswith("#"):
                yield reader.line_num, cells
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}.") from error


def read_text(path: str | os.PathLike[str]) -> str:
    file = Path(path)
    try:
        if file.exists() and not file.is_file():
            raise InputError(f"{path}: is not a file.")
        if file.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES // 1_000_000} MB.")
        return file.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text.") from error
