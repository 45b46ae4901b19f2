"""The fields that a search may change, tried before it begins: a typo costs no points."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args, get_type_hints

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.missions.schema import SECTIONS, Simulate, Time
from bodyplan.search.parameters import Value
from bodyplan.search.payload import Payload, is_file_field
from bodyplan.units import SI_UNITS

CHANGEABLE = ("robot", "gait", "ground", "time", "simulate")
#: points tried where no value of a field goes with the mission as it is
TRIED = 50
_TIMES = ("time.stop", "time.dt", "simulate.dt", "simulate.settle", "simulate.ramp")


def check_fields(
    payload: Payload,
    values: Mapping[str, Sequence[Value]],
    points: Iterable[Sequence[str]],
    simulate: bool,
    option: str,
) -> None:
    """InputError or UnknownNameError for a field that the mission has not, or of which it can take no value.

    ``values`` by field; ``points``: the changes of points to try where no value of a field goes with the mission as it
    is, as one that needs another field changed, too.
    """
    for key, all_values in values.items():
        section = key.partition(".")[0]
        if section not in CHANGEABLE:
            raise UnknownNameError("section", section, CHANGEABLE, where=f"{option} {key}")
        if section == "simulate" and not simulate:
            raise InputError(f"{option} {key}: changes nothing where the mission is not simulated.")
        if is_file_field(payload, key):
            raise InputError(f"{option} {key}: names a file; files travel with a mission and cannot vary: sweep twice.")
        error = _first_error(payload, ([value.override(key)] for value in all_values))
        if error is not None:
            if isinstance(error, UnknownNameError) and error.kind == "field":
                raise error
            if all(_first_error(payload, [point]) is not None for _, point in zip(range(TRIED), points, strict=False)):
                raise InputError(f"{option} {key}: no value of it can be taken. {error}") from error


def _first_error(payload: Payload, attempts: Iterable[Sequence[str]]) -> InputError | None:
    """None where one of ``attempts`` is a mission; else what is wrong with the first one."""
    first: InputError | None = None
    for overrides in attempts:
        try:
            payload.mission(overrides)
        except InputError as error:
            if isinstance(error, UnknownNameError) and error.kind == "field":
                return error
            first = first or error
        else:
            return None
    return first


def whole_fields(data: Mapping[str, Any], keys: Iterable[str]) -> tuple[str, ...]:
    """Those of ``keys`` that take whole numbers only, by the types of their options."""
    return tuple(key for key in keys if _type(data, key) is int)


def unit_of(data: Mapping[str, Any], key: str) -> str:
    """SI unit of a mission's field; empty where it has none."""
    section, _, name = key.partition(".")
    if section in SECTIONS:
        entry = SECTIONS[section].get(str(data[section].get("kind")))
        dimension = None if entry is None else entry[1].get(name)
        return "" if dimension is None else SI_UNITS[dimension]
    return "s" if key in _TIMES else ""


def value_of(data: Mapping[str, Any], key: str) -> Any:
    """What a mission has at ``key``: its own value, else the default of that option; None where there is neither."""
    found: Any = data
    for part in key.split("."):
        if isinstance(found, Mapping):
            found = found.get(part)
        elif isinstance(found, list) and part.isdigit() and int(part) < len(found):
            found = found[int(part)]
        else:
            found = None
    section, _, name = key.partition(".")
    if found is not None or section not in SECTIONS:
        return found
    entry = SECTIONS[section].get(str(data[section].get("kind")))
    option = None if entry is None else inspect.signature(entry[0]).parameters.get(name)
    return None if option is None or option.default is inspect.Parameter.empty else option.default


def labelled(data: Mapping[str, Any], key: str) -> str:
    """ "ground.width (m)"."""
    unit = unit_of(data, key)
    return f"{key} ({unit})" if unit else key


def _type(data: Mapping[str, Any], key: str) -> Any:
    section, _, name = key.partition(".")
    if section in SECTIONS:
        entry = SECTIONS[section].get(str(data[section].get("kind")))
        if entry is None:
            return None
        builder = entry[0]
        hint = get_type_hints(builder.__init__ if inspect.isclass(builder) else builder).get(name)
    else:
        fields = {"time": Time.model_fields, "simulate": Simulate.model_fields}.get(section, {})
        hint = fields[name].annotation if name in fields else None
    parts = [part for part in get_args(hint) if part is not type(None)]
    return parts[0] if len(parts) == 1 else hint
