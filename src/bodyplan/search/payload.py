"""A mission as data that can be sent to another machine: its TOML, and the content of the files that it names."""

from __future__ import annotations

import hashlib
import json
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from bodyplan.errors import InputError
from bodyplan.missions import Mission, load_mission
from bodyplan.missions.files import alone
from bodyplan.robot.files import toml_value

#: bytes of all files that a mission names: they travel to every worker
MOST_BYTES = 64_000_000
#: fields that say what a mission is called, not what it does
_WORDS = ("title", "about")


@dataclass(frozen=True)
class Payload:
    """A mission without its comparisons: ``text`` is its TOML, in which ``files`` (their content by mark) are named by
    their marks. ``content`` is a hash of all of it that does not depend on where the files lie, nor on title and
    description."""

    name: str
    text: str
    files: Mapping[str, bytes] = field(default_factory=dict)

    @property
    def content(self) -> str:
        data = {key: value for key, value in tomllib.loads(self.text).items() if key not in _WORDS}
        return _hash(json.dumps(data, sort_keys=True, default=str).encode("utf-8"))

    def mission(self, overrides: Sequence[str] = ()) -> Mission:
        """The mission with ``overrides`` on this machine; raises as :func:`bodyplan.load_mission`."""
        return alone(unpacked(self), self.name, overrides)


def begun(mission: Mission | str | Path, overrides: Sequence[str], simulate: bool) -> tuple[Mission, Payload, bool]:
    """What every search begins with: the mission, as data too, and whether its points are executed."""
    if not isinstance(mission, Mission):
        mission = load_mission(mission, tuple(overrides))
    elif overrides:
        raise InputError("overrides: give them to load_mission.")
    return mission, payload_of(mission), simulate and mission.simulate is not None


def payload_of(mission: Mission) -> Payload:
    """``mission`` as data. InputError where a file that it names is not there or too large."""
    text = alone(mission.text, mission.name).text
    files: dict[str, bytes] = {}
    for path in sorted(set(_paths(tomllib.loads(text)))):
        content = _content(path, MOST_BYTES - sum(map(len, files.values())))
        mark = f"bodyplan-file-{_hash(content)}{Path(path).suffix}"
        files[mark] = content
        text = text.replace(toml_value(path), toml_value(mark))
    return Payload(mission.name, text, files)


def key_of(payload: Payload, overrides: Sequence[str], settings: Mapping[str, Any]) -> str:
    """What a point is known by: a hash of the mission, of what is changed in it and of ``settings``."""
    said = json.dumps([payload.content, sorted(overrides), dict(settings)], sort_keys=True)
    return _hash(said.encode("utf-8"))[:32]


def is_file_field(payload: Payload, key: str) -> bool:
    """True where the field ``key`` of the mission names a file."""
    found: Any = tomllib.loads(payload.text)
    for part in key.split("."):
        found = found.get(part) if isinstance(found, Mapping) else None
    return (isinstance(found, str) and found in payload.files) or key in ("robot.path", "ground.path")


def _paths(data: Mapping[str, Any]) -> Iterator[str]:
    """Every file that a mission names: robots, grounds, points of sampled curves."""
    for section in ("robot", "ground"):
        path = data[section].get("path")
        if isinstance(path, str):
            yield path
    yield from _point_files(data["gait"])


def _point_files(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        points = value.get("points")
        if isinstance(points, str):
            yield points
        for item in value.values():
            yield from _point_files(item)
    elif isinstance(value, list):
        for item in value:
            yield from _point_files(item)


def _content(path: str, most: int) -> bytes:
    try:
        size = Path(path).stat().st_size
        if size > most:
            raise InputError(
                f"{path}: {size} bytes; the files that a mission names may have {MOST_BYTES} in all, since each worker "
                "gets them."
            )
        return Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); the mission names it.") from error


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []


def unpacked(payload: Payload) -> str:
    """The mission's TOML with its files in a folder of this process, which goes when the process ends."""
    text = payload.text
    for mark, content in payload.files.items():
        text = text.replace(toml_value(mark), toml_value(_placed(mark, content)))
    return text


@lru_cache(maxsize=64)
def _placed(mark: str, content: bytes) -> str:
    if not _FOLDERS:
        _FOLDERS.append(tempfile.TemporaryDirectory(prefix="bodyplan-"))
    place = Path(_FOLDERS[0].name) / mark
    place.write_bytes(content)
    return place.as_posix()
