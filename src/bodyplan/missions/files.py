"""Mission files: read, override, check against the schema, and build the objects they describe."""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.base import Gait
from bodyplan.ground.base import Ground
from bodyplan.missions.schema import SECTIONS, Grid, MissionModel, PaperRow, Simulate, Time, options_model
from bodyplan.robot.files import toml_value
from bodyplan.robot.model import Robot
from bodyplan.show.beside import check_row

MAX_BYTES = 1_000_000
#: options that name a file; a relative one is seen from the mission's folder
_PATHS = {("robot", "path"), ("robot", "file"), ("ground", "path")}


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
    grid: Grid | None = None
    paper: tuple[PaperRow, ...] = ()


def ready_missions() -> dict[str, str]:
    """Name -> TOML text of every mission that comes with bodyplan."""
    folder = resources.files("bodyplan.missions") / "ready"
    found = {p.name.removesuffix(".toml"): p for p in folder.iterdir() if p.name.endswith(".toml")}
    return {name: found[name].read_text(encoding="utf-8") for name in sorted(found)}


def saved_motion(mission: str | Path, overrides: Iterable[str] = ()) -> Path | None:
    """The .npz file that ``mission`` names, itself or by the folder of a run; None for missions, ready ones first.
    InputError where a saved motion is to be changed by ``overrides``."""
    saved = Path(mission)
    if str(mission) not in ready_missions() and (saved / "motion.npz").is_file():
        saved /= "motion.npz"
    if saved.suffix != ".npz":
        return None
    if tuple(overrides):
        raise InputError("--set: a saved motion cannot be changed; give its mission instead.")
    return saved


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
        raise UnknownNameError("mission", text, ready, where="neither a ready mission nor a file")
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
        override(data, item)
    _settle_time(data, overrides)
    source = _Source(text, where, tuple(overrides))
    model = source.validate(MissionModel, data, ())
    built = {section: _build(source, model, section, data, folder) for section in SECTIONS}
    for other in model.compare:
        if other not in ready_missions():
            raise UnknownNameError("mission", other, ready_missions(), where=f"{source.at(('compare',))}: compare")
    _check_paper(source, model, name)
    if model.grid is not None:
        _check_grid(source, model.grid, data, folder, name)
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
        model.grid,
        tuple(model.paper),
    )


def _settle_time(data: Any, overrides: Sequence[str]) -> None:
    """An override of how long takes the place of what the file says: stop or cycles."""
    keys = {item.partition("=")[0].strip() for item in overrides}
    time = data.get("time")
    if isinstance(time, dict):
        for mine, other in (("stop", "cycles"), ("cycles", "stop")):
            if f"time.{mine}" in keys and f"time.{other}" not in keys:
                time.pop(other, None)


def _build(source: _Source, model: MissionModel, section: str, data: dict[str, Any], folder: Path | None) -> Any:
    """The robot, gait or ground of a mission; a relative path in ``data`` is made absolute."""
    registry = SECTIONS[section]
    table = dict(getattr(model, section))
    kind = table.pop("kind", None)
    if kind is None:
        raise InputError(f"{source.at((section,))}: [{section}] needs a kind, one of: {', '.join(sorted(registry))}.")
    if not isinstance(kind, str) or kind not in registry:
        raise UnknownNameError(f"{section} kind", kind, registry, where=source.at((section, "kind")))
    builder, units = registry[kind]
    options = source.validate(options_model(kind, builder, units), table, (section,))
    given = {key: getattr(options, key) for key in options.model_fields_set}
    for name in ("path", "file"):
        if (section, name) in _PATHS and isinstance(given.get(name), str) and folder is not None:
            given[name] = data[section][name] = str((folder / given[name]).resolve())
    try:
        return builder(**given)
    except InputError as error:
        named = error.kind if isinstance(error, UnknownNameError) else str(error)
        key = next((word for word in re.findall(r"\w+", named.partition(":")[0]) if word in table), None)
        place = source.at((section, key) if key else (section,))
        raise InputError(f"{place}: [{section}] {error}") from error


def _check_paper(source: _Source, model: MissionModel, name: str) -> None:
    """The rows of ``paper`` name units and metrics that exist."""
    cycles = 1 if model.simulate is None else model.simulate.cycles
    for i, row in enumerate(model.paper):
        try:
            check_row(row.ours, row.unit, name, model.compare, cycles)
        except InputError as error:
            field = "unit" if str(error).startswith("unit") else "ours"
            raise InputError(f"{source.at(('paper', i, field))}: paper, row {row.what!r}: {error}") from error


def _check_grid(source: _Source, grid: Grid, data: dict[str, Any], folder: Path | None, name: str) -> None:
    """The field of the grid may take every value, here and in the missions run beside."""
    ready = ready_missions()
    for other in grid.missions:
        if other not in ready or other == name:
            others = set(ready) - {name}
            raise UnknownNameError("mission", other, others, where=f"{source.at(('grid', 'missions'))}: grid.missions")
    if model_section(grid.key) in ("grid", "compare", "paper", "title", "about"):
        raise InputError(f"{source.at(('grid', 'key'))}: grid.key = {grid.key!r}: nothing to vary; name a number.")
    for value in grid.values:
        item = f"{grid.key}={value!r}"

        def here(item: str = item) -> None:
            changed = copy.deepcopy(data)
            override(changed, item)
            there = _Source(source.text, source.where, (*source.overrides, item))
            model = there.validate(MissionModel, changed, ())
            if model_section(grid.key) in SECTIONS:
                _build(there, model, model_section(grid.key), changed, folder)

        at = f"{source.at(('grid', 'key'))}: grid.key = {grid.key!r}"
        _taken(at, grid.key, f"mission {name}", data, here)
        for other in grid.missions:
            _taken(
                at,
                grid.key,
                f"mission {other}",
                tomllib.loads(ready[other]),
                partial(alone, ready[other], other, (item,)),
            )


def _taken(at: str, key: str, mission: str, data: Mapping[str, Any], attempt: Callable[[], Any]) -> None:
    """Attempt to change a field of ``mission``; the error says what is missing there."""
    try:
        attempt()
    except InputError as error:
        table, _, field = key.rpartition(".")
        found: Any = data
        for part in table.split(".") if table else ():
            found = found.get(part.strip()) if isinstance(found, Mapping) else None
        if isinstance(found, Mapping):
            raise InputError(f"{at}: {mission} cannot take it: {error}") from error
        said = f"{mission} has no table {table} in which {field} could vary"
        if found is not None:
            said += f": {table} is {found!r} there"
        raise InputError(f"{at}: {said} ({str(error).rpartition(': ')[2].rstrip('.')}).") from error


def model_section(key: str) -> str:
    """The section of a mission that a dotted key is in."""
    return key.partition(".")[0].strip()


def alone(text: str, name: str, overrides: Sequence[str] = ()) -> Mission:
    """The mission in ``text`` (its paths absolute) without its comparisons and its grid."""
    data = tomllib.loads(text)
    kept = {k: v for k, v in data.items() if k not in ("grid", "compare", "paper")}
    return parse_mission(_written(kept, []), name, f"mission {name}", None, overrides)


def _effective(text: str, data: Mapping[str, Any], folder: Path | None, overrides: Sequence[str]) -> str:
    """The mission as it runs: its own text, or written anew where overrides or relative paths changed it."""
    if not overrides and not any(name in data.get(section, {}) for section, name in _PATHS):
        return text
    return _written(data, [f"# with --set {item}" for item in overrides])


def _written(data: Mapping[str, Any], head: Sequence[str]) -> str:
    """A mission as TOML, under lines of comment."""
    lines = [*head, *(f"{key} = {toml_value(value)}" for key, value in data.items() if not isinstance(value, dict))]
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
        line = _line_of(self.text, place)
        return self.where if line is None else f"{self.where}, line {line}"

    def validate(self, model: type[BaseModel], data: Mapping[str, Any], section: tuple[str, ...]) -> Any:
        try:
            return model.model_validate(data)
        except ValidationError as error:
            # of a choice of types, the table's own errors say more than "not a number"
            rank = {"extra_forbidden": 2, "missing": 1, "float_type": -1, "model_type": -1}
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


def _line_of(text: str, place: Sequence[str | int]) -> int | None:
    """Line (from 1) that sets a field, else of its table's header; None where neither is found. A number in the place
    says which of several [[tables]] of one name."""
    names = [p for p in place if isinstance(p, str)]
    which = next((p for p in place if isinstance(p, int)), 0)
    header, key = ".".join(names[:-1]), names[-1] if names else ""
    current, best, seen = "", None, -1
    for i, line in enumerate(text.splitlines(), start=1):
        table = re.match(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$", line)
        if table:
            current = table.group(2).replace(" ", "")
            if table.group(1) == "[[" and current in (header, ".".join(names)):
                seen += 1
                current = current if seen == which else ""
            if current and current == ".".join(names):
                return i
            if current == header:
                best = i
        elif current == header and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*[.=]", line):
            return i
    return best


def override(data: dict[str, Any], item: str, example: str = "gait.omega=1.2") -> None:
    """Set a field of a table by a text such as ``example``, or a place in a list by "gait.velocity.0=0.02"; InputError
    where it is not one."""
    key, equals, value = item.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        form = "section.field=value" if "." in example else "field=value"
        raise InputError(f"--set {item}: expected {form}, for example {example}.")
    try:
        parsed = tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()  # a bare word or a quantity: 30 deg
    table: Any = data
    for part in parts[:-1]:
        if isinstance(table, list):
            table = table[_place(table, part, item)]
        else:
            table = table.setdefault(part, {}) if isinstance(table, dict) else None
        if not isinstance(table, dict | list):
            raise InputError(f"--set {item}: {part} is not a table.")
    last: Any = parts[-1]
    table[_place(table, last, item) if isinstance(table, list) else last] = parsed


def _place(values: list[Any], part: str, item: str) -> int:
    """The place in a list that a part of a key names, from 0."""
    if not re.fullmatch(r"[0-9]{1,6}", part) or int(part) >= len(values):
        raise InputError(f"--set {item}: {part!r} is no place in a list of {len(values)}: 0 to {len(values) - 1}.")
    return int(part)
