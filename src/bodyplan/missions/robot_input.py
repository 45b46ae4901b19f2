"""A robot as a user names it: a ready one with options, a CSV table, a TOML file, URDF or MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.missions.files import override
from bodyplan.missions.schema import ROBOTS, options_model
from bodyplan.robot.model import Robot

#: kinds that are files, not robots
FILES = ("file", "table", "urdf", "mjcf")
#: suffix -> who reads it
READERS = {".csv": Robot.from_table, ".toml": Robot.from_toml, ".urdf": Robot.from_urdf, ".xml": Robot.from_mjcf}
EXAMPLE = "mass=20 kg"


def load_robot(source: str, overrides: Sequence[str] = ()) -> Robot:
    """The ready robot of that name with the options in ``overrides`` (texts "mass=20 kg"), or the robot in a .csv table
    of extended D-H parameters, in a .toml file, in URDF (.urdf) or in MJCF (.xml).

    Raises InputError or UnknownNameError that names what is wrong and what there is.
    """
    ready = [kind for kind in ROBOTS if kind not in FILES]
    kind = source.strip().lower().replace("-", "_")
    if kind in ready:
        return _ready(kind, overrides)
    path = Path(source)
    suffix = path.suffix.lower()
    if suffix not in READERS:
        endings = ", ".join(READERS)
        raise UnknownNameError("robot", source, ready, where=f"neither a known name nor a file ending in {endings}")
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}.")
    if overrides:
        raise InputError(f"--set {overrides[0]}: a robot from a file has no options; change the file.")
    return READERS[suffix](path)


def _ready(kind: str, overrides: Sequence[str]) -> Robot:
    given: dict[str, Any] = {}
    for item in overrides:
        override(given, item, EXAMPLE)
    builder, units = ROBOTS[kind]
    model = options_model(kind, builder, units)
    for name in given:
        if name not in model.model_fields:
            raise UnknownNameError("option", name, model.model_fields, where=f"--set: robot {kind}")
    missing = [name for name, field in model.model_fields.items() if field.is_required() and name not in given]
    if missing:
        raise InputError(
            f"robot {kind}: needs {', '.join(missing)}; give each with --set, as in --set {missing[0]}=..."
        )
    try:
        options = model.model_validate(given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field, problem = first["loc"][0], first["msg"].removeprefix("Value error, ").removeprefix("value: ")
        raise InputError(f"--set {field}={first['input']!r}: {problem.rstrip('.')}.") from error
    built: Robot = builder(**{name: getattr(options, name) for name in options.model_fields_set})
    return built
