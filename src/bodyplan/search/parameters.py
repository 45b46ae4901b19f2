"""What a search changes: values of a field (a sweep), or a range of it (an optimisation), as a user writes them."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.errors import InputError
from bodyplan.robot.files import toml_value
from bodyplan.units import unit_in_base

#: most values of one field
MOST_VALUES = 10_000
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*([^\d\s.+-].*?)?\s*")


@dataclass(frozen=True)
class Value:
    """One value of a field: ``setting`` as a mission takes it (number, text with a unit, word, list), ``shown`` as a
    table shows it: a number in SI, or a text."""

    setting: Any
    shown: float | int | str

    def override(self, key: str) -> str:
        """The text that sets the field ``key``: "gait.omega=1.2"."""
        return f"{key}={toml_value(self.setting)}"


@dataclass(frozen=True)
class Axis:
    """A field and the values that a sweep gives it."""

    key: str
    values: tuple[Value, ...]

    @property
    def numeric(self) -> bool:
        """True where every value is a number."""
        return all(isinstance(value.shown, (int, float)) for value in self.values)


@dataclass(frozen=True)
class Range:
    """A field and what an optimisation may give it: numbers from ``low`` to ``high`` in ``unit`` (whole ones where
    ``whole``, searched by their logarithm where ``log``), or one of ``choices``."""

    key: str
    low: float = 0.0
    high: float = 0.0
    unit: str = ""
    whole: bool = False
    log: bool = False
    choices: tuple[Value, ...] = ()

    def value(self, found: Any) -> Value:
        """The value for what an optimiser suggests: a number, or a choice as it is shown."""
        if self.choices:
            return next(value for value in self.choices if str(value.shown) == str(found))
        return _of(int(found) if self.whole else float(found), self.unit)

    def ends(self) -> tuple[Value, ...]:
        """The choices, or the two ends."""
        return self.choices or (self.value(self.low), self.value(self.high))


def axes_of(over: Mapping[str, Any] | Iterable[str]) -> tuple[Axis, ...]:
    """The axes of a sweep: texts "gait.omega=1:2:5" or a mapping from fields to such specs or to lists of values."""
    return tuple(_axis(key, spec) for key, spec in _pairs(over, "--over", "gait.overlap=0:0.8:9"))


def ranges_of(vary: Mapping[str, Any] | Iterable[str], whole: Iterable[str] = ()) -> tuple[Range, ...]:
    """The ranges of an optimisation: texts "gait.omega=1:2" or a mapping from fields to such specs, to (low, high)
    or to lists of words; ``whole`` are the fields that take whole numbers only."""
    return tuple(_range(key, spec, key in whole) for key, spec in _pairs(vary, "--vary", "gait.overlap=0:0.8"))


def _pairs(given: Mapping[str, Any] | Iterable[str], option: str, example: str) -> list[tuple[str, Any]]:
    if isinstance(given, str):
        given = [given]
    if isinstance(given, Mapping):
        out = [(str(key).strip(), spec) for key, spec in given.items()]
    else:
        out = []
        for item in given:
            key, equals, spec = str(item).partition("=")
            if not equals or not spec.strip():
                raise InputError(f"{option} {item}: expected FIELD=VALUES, for example {example}.")
            out.append((key.strip(), spec.strip()))
    if not out:
        raise InputError(f"{option}: name at least one field, for example {example}.")
    for i, (key, _) in enumerate(out):
        if not all(part.strip() for part in key.split(".")) or "." not in key:
            raise InputError(f"{option} {key}: name a field of the mission with its section, for example {example}.")
        if key in (other for other, _ in out[:i]):
            raise InputError(f"{option} {key}: is given twice.")
    return out


def _axis(key: str, spec: Any) -> Axis:
    where = f"--over {key}={spec}" if isinstance(spec, str) else f"over {key}"
    values = _values(spec, where)
    if not 1 <= len(values) <= MOST_VALUES:
        raise InputError(f"{where}: {len(values)} values; 1 to {MOST_VALUES} are allowed.")
    if len({repr(value.setting) for value in values}) < len(values):
        raise InputError(f"{where}: a value is there twice.")
    return Axis(key, values)


def _values(spec: Any, where: str) -> tuple[Value, ...]:
    if not isinstance(spec, str):
        if isinstance(spec, np.ndarray):
            spec = spec.tolist()
        return tuple(_value(item, where) for item in (spec if isinstance(spec, Sequence) else [spec]))
    if spec.startswith("["):
        return tuple(_value(item, where) for item in _list(spec, where))
    if "," in spec:
        return tuple(_read(part, where) for part in spec.split(","))
    parts = [_bare(part) for part in spec.split(":")]
    if len(parts) == 1:
        return (_read(parts[0], where),)
    if len(parts) != 3 or not re.fullmatch(r"\d{1,9}", parts[2]):
        raise InputError(f'{where}: write FROM:TO:COUNT, for example 0:0.8:9 or "120 mm":"160 mm":5, or values a,b,c.')
    count = int(parts[2])
    if not 2 <= count <= MOST_VALUES:
        raise InputError(f"{where}: {count} values; from FROM to TO there are 2 to {MOST_VALUES}.")
    low, high, unit = _ends(parts[0], parts[1], where)
    numbers = np.linspace(low, high, count).tolist()
    if not unit and _is_whole(parts[0]) and _is_whole(parts[1]) and all(n == int(n) for n in numbers):
        numbers = [int(n) for n in numbers]
    return tuple(_of(number, unit) for number in numbers)


def _range(key: str, spec: Any, whole: bool) -> Range:
    where = f"--vary {key}={spec}" if isinstance(spec, str) else f"vary {key}"
    if not isinstance(spec, str):
        if isinstance(spec, Sequence) and len(spec) == 2 and not any(isinstance(end, str) for end in spec):
            spec = f"{spec[0]!r}:{spec[1]!r}"
        else:
            return _choices(key, _values(spec, where), where)
    if "," in spec or ":" not in spec:
        return _choices(key, _values(spec, where), where)
    parts = [_bare(part) for part in spec.split(":")]
    log = len(parts) == 3 and parts[2] == "log"
    if len(parts) != 2 and not log:
        raise InputError(f"{where}: write FROM:TO, FROM:TO:log, or choices a,b,c.")
    low, high, unit = _ends(parts[0], parts[1], where)
    if not low < high:
        raise InputError(f"{where}: the range must go up; {low} is not below {high}.")
    if log and low <= 0.0:
        raise InputError(f"{where}: a logarithmic range begins above 0, got {low}.")
    if whole and (low != int(low) or high != int(high)):
        raise InputError(f"{where}: this field takes whole numbers; {low} or {high} is none.")
    return Range(key, low, high, unit, whole, log)


def _choices(key: str, values: tuple[Value, ...], where: str) -> Range:
    if not 2 <= len(values) <= 100:
        raise InputError(f"{where}: give a range FROM:TO, or 2 to 100 choices a,b,c.")
    return Range(key, choices=values)


def _ends(low: str, high: str, where: str) -> tuple[float, float, str]:
    """Numbers of both ends in the unit of the first one that has any."""
    found = [_number(text) for text in (low, high)]
    for text, one in zip((low, high), found, strict=True):
        if one is None:
            raise InputError(f"{where}: {text!r} is not a number, with or without a unit.")
    (a, unit), (b, other) = [one for one in found if one is not None]
    if bool(unit) != bool(other):
        raise InputError(f"{where}: give both ends a unit, or neither.")
    (scale, dimension), (other_scale, other_dimension) = unit_in_base(unit), unit_in_base(other)
    if dimension != other_dimension:
        raise InputError(f"{where}: {low!r} and {high!r} are quantities of different kinds.")
    return a, (b if unit == other else b * other_scale / scale), unit


def _read(text: str, where: str) -> Value:
    """A value as it stands among others: number, quantity, truth, word."""
    plain = _bare(text)
    if not plain:
        raise InputError(f"{where}: a value is empty.")
    found = _number(plain)
    if found is not None:
        number, unit = found
        return _of(int(plain) if not unit and _is_whole(plain) else number, unit)
    if plain in ("true", "false"):
        return Value(plain == "true", plain)
    return Value(plain, plain)


def _value(item: Any, where: str) -> Value:
    """A value given as such: from Python, or out of a TOML list."""
    if isinstance(item, np.generic):
        item = item.item()
    if isinstance(item, str):
        return _read(item, where)
    if isinstance(item, bool):
        return Value(item, str(item).lower())
    if isinstance(item, (int, float)):
        if not math.isfinite(item):
            raise InputError(f"{where}: values must be finite, got {item!r}.")
        return Value(item, item)
    if isinstance(item, (list, tuple, dict)):
        plain = list(item) if isinstance(item, tuple) else item
        return Value(plain, toml_value(plain))
    raise InputError(f"{where}: {item!r:.100} is not a value that a mission can hold.")


def _list(spec: str, where: str) -> list[Any]:
    try:
        return list(tomllib.loads(f"value = {spec}")["value"])
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{where}: not a list: {error}.") from error


def _of(number: float | int, unit: str) -> Value:
    if not unit:
        return Value(number, number)
    return Value(f"{repr(number).removesuffix('.0')} {unit}", number * unit_in_base(unit)[0])


def _number(text: str) -> tuple[float, str] | None:
    """Number and unit of a quantity; None where the text is none."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return None
    unit = match[2] or ""
    try:
        unit_in_base(unit)
    except InputError:
        return None
    return (float(match[1]), unit) if math.isfinite(float(match[1])) else None


def _is_whole(text: str) -> bool:
    return re.fullmatch(r"[+-]?\d{1,15}", text.strip()) is not None


def _bare(text: str) -> str:
    return text.strip().strip("\"'").strip()
