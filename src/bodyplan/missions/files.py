"""Mission files: read, override, check against the schema, and build the objects they describe."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.base import Gait
from bodyplan.ground.base import Ground
from bodyplan.missions.schema import SECTIONS, MissionModel, Simulate, Time, options_model
from bodyplan.robot.files import toml_value
from bodyplan.robot.model import Robot

MAX_BYTES = 1_000_000
_PATHS = {("robot", "path"), ("ground", "path")}


@dataclass(frozen=True)
class Mission:
    """A mission: what to plan, on what, for how long, and how to try it in physics. ``text`` is its TOML."""

    name: str
    title: str
    about: str
    robot: Robot
    gait: Gait
    ground: Ground
    time: Time
    simulate: Simulate | None
    compare: tuple[str, ...]
    text: str
    overrides: tuple[str, ...] = ()


def ready_missions() -> dict[str, str]:
    """Name -> TOML text of every mission that comes with bodyplan."""
    folder = resources.files("bodyplan.missions") / "ready"
    found = {p.name.removesuffix(".toml"): p for p in folder.iterdir() if p.name.endswith(".toml")}
    return {name: found[name].read_text(encoding="utf-8") for name in sorted(found)}


def load_mission(name_or_path: str | Path, overrides: Sequence[str] = ()) -> Mission:
    """The ready mission of that name, or the mission in a TOML file; ``overrides`` are texts "gait.omega=1.2".

    Raises InputError (file, line, field, value, what is allowed) or UnknownNameError with the valid names.
    """
    text = str(name_or_path)
    path = Path(name_or_path)
    ready = ready_missions()
    if text in ready:
        return parse_mission(ready[text], text, f"mission {text}", None, overrides)
    if path.suffix != ".toml" and not path.exists():
        raise UnknownNameError("mission", text, ready, where="no such file, and")
    if path.is_dir():
        raise InputError(f"{text or '.'}: is a folder, not a mission file.")
    if not path.is_file():
        raise InputError(f"{path}: no such file.")
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: a mission file of more than {MAX_BYTES} bytes is refused.")
    try:
        content = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not a UTF-8 text ({error.reason} at byte {error.start}).") from error
    return parse_mission(content, path.stem, str(path), path.parent, overrides)


def parse_mission(text: str, name: str, where: str, folder: Path | None, overrides: Sequence[str] = ()) -> Mission:
    """The mission in a TOML ``text``; ``where`` names it in errors, ``folder`` is what its paths are relative to."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{where}: not valid TOML: {error}.") from error
    for item in overrides:
        _override(data, item)
    source = _Source(text, where, tuple(overrides))
    model = source.validate(MissionModel, data, ())
    built = {}
    for section, registry in SECTIONS.items():
        table = dict(getattr(model, section))
        kind = table.pop("kind", None)
        if kind is None:
            raise InputError(
                f"{source.at((section,))}: [{section}] needs a kind, one of: {', '.join(sorted(registry))}."
            )
        if not isinstance(kind, str) or kind not in registry:
            raise UnknownNameError(f"{section} kind", kind, registry, where=source.at((section, "kind")))
        builder, units = registry[kind]
        options = source.validate(options_model(kind, builder, units), table, (section,))
        given = {key: getattr(options, key) for key in options.model_fields_set}
        if (section, "path") in _PATHS and isinstance(given.get("path"), str) and folder is not None:
            given["path"] = str((folder / given["path"]).resolve())
            data[section]["path"] = given["path"]
        try:
            built[section] = builder(**given)
        except InputError as error:
            named = error.kind if isinstance(error, UnknownNameError) else str(error)
            key = next((word for word in re.findall(r"\w+", named.partition(":")[0]) if word in table), None)
            place = source.at((section, key) if key else (section,))
            raise InputError(f"{place}: [{section}] {error}") from error
    for other in model.compare:
        if other not in ready_missions():
            raise UnknownNameError("mission", other, ready_missions(), where=f"{source.at(('compare',))}: compare")
    return Mission(
        name,
        model.title,
        model.about,
        built["robot"],
        built["gait"],
        built["ground"],
        model.time,
        model.simulate,
        tuple(model.compare),
        _effective(text, data, folder, overrides),
        tuple(overrides),
    )


def _effective(text: str, data: Mapping[str, Any], folder: Path | None, overrides: Sequence[str]) -> str:
    """The mission as it runs: its own text, or written anew where overrides or relative paths changed it."""
    if not overrides and not any("path" in data.get(section, {}) for section in SECTIONS):
        return text
    lines = [f"# with --set {item}" for item in overrides]
    lines += [f"{key} = {toml_value(value)}" for key, value in data.items() if not isinstance(value, dict)]
    for section, table in data.items():
        if isinstance(table, dict):
            lines += ["", f"[{section}]", *(f"{key} = {toml_value(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class _Source:
    """Where a mission came from, to say where an error is."""

    text: str
    where: str
    overrides: tuple[str, ...]

    def at(self, place: tuple[str | int, ...]) -> str:
        """ "file, line N" of a field, or of its section; the override that set it, if one did."""
        dotted = ".".join(str(p) for p in place)
        for item in self.overrides:
            key = item.partition("=")[0].strip()
            if key and (dotted == key or dotted.startswith(key + ".")):
                return f"--set {item}"
        line = _line_of(self.text, [str(p) for p in place if not isinstance(p, int)])
        return self.where if line is None else f"{self.where}, line {line}"

    def validate(self, model: type[BaseModel], data: Mapping[str, Any], section: tuple[str, ...]) -> Any:
        try:
            return model.model_validate(data)
        except ValidationError as error:
            # of a choice of types, the table's own errors say more than "not a number"
            rank = {"extra_forbidden": 2, "missing": 1}
            first = max(error.errors(include_url=False), key=lambda e: rank.get(e["type"], 0))
            place = (*section, *_named(model, first["loc"]))
            field = ".".join(str(p) for p in place)
            if first["type"] == "extra_forbidden":
                valid = _fields_at(model, first["loc"][:-1])
                inside = f" in [{'.'.join(str(p) for p in place[:-1])}]" if len(place) > 1 else ""
                raise UnknownNameError("field", place[-1], valid, where=self.at(place) + inside) from error
            if first["type"] == "missing":
                raise InputError(f"{self.at(place[:-1])}: {field} is missing.") from error
            problem = first["msg"].removeprefix("Value error, ").removeprefix("value: ")
            raise InputError(f"{self.at(place)}: {field} = {first['input']!r}: {problem.rstrip('.')}.") from error


def _named(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str | int]:
    """The parts of an error's place that the user wrote: pydantic also names the branch of a choice of types."""
    branches = {"float", "int", "str", "bool", "none", *(m.__name__ for m in BaseModel.__subclasses__())}
    return [part for i, part in enumerate(loc) if i == 0 or not (part in branches or "-" in str(part))]


def _fields_at(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """Names of the fields of the (sub)model that a validation error is about."""
    current = model
    for part in loc:
        field = current.model_fields.get(str(part))
        if field is None:
            continue
        candidates = [field.annotation, *getattr(field.annotation, "__args__", ())]
        found = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
        if found is not None:
            current = found
    return list(current.model_fields)


def _line_of(text: str, place: Sequence[str]) -> int | None:
    """Line (from 1) that sets a field, else of its table's header; None where neither is found."""
    header, key = ".".join(place[:-1]), place[-1] if place else ""
    current, best = "", None
    for i, line in enumerate(text.splitlines(), start=1):
        table = re.match(r"\s*\[\s*([^\[\]]+?)\s*\]\s*(#.*)?$", line)
        if table:
            current = table.group(1).replace(" ", "")
            if current == ".".join(place):
                return i
            if current == header:
                best = i
        elif current == header and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*[.=]", line):
            return i
    return best


def _override(data: dict[str, Any], item: str) -> None:
    key, equals, value = item.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise InputError(f"--set {item}: expected section.field=value, for example gait.omega=1.2.")
    try:
        parsed = tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()  # a bare word or a quantity: 30 deg
    table: Any = data
    for part in parts[:-1]:
        table = table.setdefault(part, {}) if isinstance(table, dict) else None
        if not isinstance(table, dict):
            raise InputError(f"--set {item}: {part} is not a table.")
    table[parts[-1]] = parsed
