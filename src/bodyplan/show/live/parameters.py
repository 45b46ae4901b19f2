"""What of a gait can be changed by hand: its numbers with ranges, its switches and its choices.

Found from the gait's own description (``to_dict``) and its units; ranges lie around the present value and end where the
gait refuses: its constructor is asked.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan import curves
from bodyplan.errors import BodyplanError, UnknownNameError
from bodyplan.gaits.base import Gait
from bodyplan.motion import Motion
from bodyplan.show.text import words

#: place of an option in the description of a gait: names of tables and numbers in lists
Key = tuple[str | int, ...]
Value = float | int | bool | str

#: dimension -> (unit on the screen, its size in SI)
SHOWN = {
    "length": ("mm", 1e-3),
    "angle": ("deg", math.pi / 180.0),
    "time": ("s", 1.0),
    "mass": ("kg", 1.0),
    "speed": ("mm/s", 1e-3),
    "angular_rate": ("deg/s", math.pi / 180.0),
    "force": ("N", 1.0),
    "torque": ("N m", 1.0),
    "curvature": ("1/m", 1.0),
    "frequency": ("Hz", 1.0),
    "none": ("", 1.0),
}
#: a length from which on m say more than mm
METRES = 1.0
#: dimensions of options whose unit a gait does not name because they may also be formulas or tables
BY_NAME = {
    "height": "length",
    "radius": "length",
    "center": "length",
    "roll": "angle",
    "pitch": "angle",
    "heading": "angle",
    "start": "length",
    "end": "length",
}
#: and of numbers of a path
ON_PATH = {"start": "angle"}
#: names of the numbers of some lists
ELEMENTS = {"velocity": ("ahead", "left"), "start": ("x", "y"), "end": ("x", "y"), "center": ("x", "y")}
#: a range goes from LESS to MORE of the present value, in about STEPS steps; whole numbers go so far either way
LESS, MORE, STEPS, WHOLE = 0.25, 2.0, 200, 6
#: longest list whose numbers are shown, most numbers shown in all
MOST_ELEMENTS, MOST = 6, 24
#: halvings with which the end of what a gait allows is found
HALVINGS = 40
#: a text that no gait knows, to be told what it knows
NOTHING = "?"


@dataclass(frozen=True)
class Parameter:
    """A number of a gait: ``value``, ``low``, ``high`` and ``step`` in ``unit`` s on the screen, ``scale`` SI each."""

    key: Key
    label: str
    unit: str
    scale: float
    value: float
    low: float
    high: float
    step: float
    whole: bool = False

    def si(self, shown: float) -> float | int:
        """The option's value at a value on the screen."""
        return round(shown) if self.whole else float(shown) * self.scale


@dataclass(frozen=True)
class Choice:
    """An option of a gait that is one of several texts (``options``) or yes and no (none of them)."""

    key: Key
    label: str
    value: str | bool
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Scale:
    """How large and fast a robot is, for ranges of options that are 0: ``length`` m, ``speed`` m/s, ``time`` s."""

    length: float = 0.5
    speed: float = 0.05
    time: float = 10.0

    @classmethod
    def of(cls, motion: Motion) -> Scale:
        """That of a motion: size of the robot, mean speed of its base, duration."""
        first = motion.robot.forward(motion.q[:1], motion.base[:1]).positions
        size = float(np.linalg.norm(np.ptp(first.reshape(-1, 3), axis=0)))
        time = float(motion.t[-1] - motion.t[0])
        way = float(np.linalg.norm(np.diff(motion.base[:, :3], axis=0), axis=1).sum())
        return cls(size or cls.length, way / time or cls.speed, time)

    def span(self, dimension: str) -> float:
        """Half the range of an option of that dimension that is 0, SI."""
        return {
            "length": 0.5 * self.length,
            "angle": 0.5 * math.pi,
            "time": 0.1 * self.time,
            "speed": self.speed,
            "angular_rate": self.speed / self.length,
            "curvature": 1.0 / self.length,
            "frequency": 1.0 / self.time,
        }.get(dimension, 1.0)


def options_of(gait: Gait) -> dict[str, Any]:
    """The options of a gait by name, as its constructor takes them."""
    return {name: value for name, value in gait.to_dict().items() if name != "kind"}


def changed(gait: Gait, values: Mapping[Key, Value]) -> Gait:
    """The gait with some options changed. Raises InputError where it does not allow them."""
    options = copy.deepcopy(options_of(gait))
    for key, value in values.items():
        table: Any = options
        for part in key[:-1]:
            table = table[part]
        table[key[-1]] = value
    return type(gait)(**options)


def parameters_of(gait: Gait, scale: Scale | None = None) -> tuple[Parameter, ...]:
    """The numbers of a gait that can be changed, in its own order; those that it chooses by itself (None) and those
    without room to either side are left out."""
    found = []
    for key, value, dimension in _numbers(options_of(gait), gait.UNITS, ()):
        allowed = _asker(gait, key)
        if isinstance(value, int):
            made = _whole(key, value, allowed)
        else:
            made = _real(key, value, dimension, allowed, scale or Scale())
        if made is not None:
            found.append(made)
        if len(found) == MOST:
            break
    return tuple(found)


def choices_of(gait: Gait) -> tuple[Choice, ...]:
    """The switches of a gait, and its texts of which it says itself what they may be."""
    out = []
    for name, value in options_of(gait).items():
        if isinstance(value, bool):
            out.append(Choice((name,), words(name), value))
        elif isinstance(value, str):
            try:
                changed(gait, {(name,): NOTHING})
            except UnknownNameError as error:
                if value in error.valid and len(error.valid) > 1:
                    out.append(Choice((name,), words(name), value, tuple(error.valid)))
            except BodyplanError:
                pass
    return tuple(out)


def _numbers(table: Mapping[str, Any], units: Mapping[str, str], at: Key) -> Iterator[tuple[Key, Any, str]]:
    """Key, value and dimension of every number in a table of options."""
    for name, value in table.items():
        dimension = units.get(name, BY_NAME.get(name, "none"))
        if _number(value):
            yield (*at, name), value, ON_PATH.get(name, dimension) if at == ("path",) else dimension
        elif isinstance(value, Mapping):
            kind = curves.KINDS.get(str(value.get("kind")))
            yield from _numbers(value, getattr(kind, "UNITS", {}), (*at, name))
        elif isinstance(value, (list, tuple)) and len(value) <= MOST_ELEMENTS and all(map(_number, value)):
            for i, v in enumerate(value):
                yield (*at, name, i), float(v), dimension


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _asker(gait: Gait, key: Key) -> Callable[[float | int], bool]:
    """Whether the gait allows a value of an option."""

    def allowed(value: float | int) -> bool:
        try:
            changed(gait, {key: value})
        except BodyplanError:
            return False
        return True

    return allowed


def _label(key: Key, unit: str) -> str:
    named = [part for part in key if isinstance(part, str)]
    text = words(named[-1])
    if isinstance(key[-1], int):
        names = ELEMENTS.get(named[-1], ())
        text += f" {names[key[-1]]}" if key[-1] < len(names) else f" {key[-1] + 1}"
    return f"{text} ({unit})" if unit else text


def _whole(key: Key, value: int, allowed: Callable[[float | int], bool]) -> Parameter | None:
    for step in (1, 2):  # some gaits take even numbers only
        low = high = value
        while value - low < step * WHOLE and allowed(low - step):
            low -= step
        while high - value < max(step * WHOLE, value) and allowed(high + step):
            high += step
        if low < high:
            return Parameter(key, _label(key, ""), "", 1.0, value, low, high, step, whole=True)
    return None


def _real(
    key: Key, value: float, dimension: str, allowed: Callable[[float | int], bool], scale: Scale
) -> Parameter | None:
    unit, size = SHOWN.get(dimension, SHOWN["none"])
    if dimension == "length" and abs(value) >= METRES:
        unit, size = "m", 1.0
    ends = sorted((LESS * value, MORE * value)) if value else [-scale.span(dimension), scale.span(dimension)]
    low, high = (_reach(value, end, allowed) / size for end in ends)
    step = nice((high - low) / STEPS) if high > low else 0.0
    if step <= 0.0:
        return None
    # a tenth of a step is finer than a hand; the option itself stays as it is until its slider is moved
    shown = _rounded(value / size, 0.1 * step)
    # so that the present value is one that the slider can take
    low, high = (
        shown + step * math.trunc((end - shown) / step + 1e-9 * (1 if end > shown else -1)) for end in (low, high)
    )
    low, high = (_rounded(end, 0.1 * step) for end in (low, high))
    # an end that belongs to what is refused
    low = low if allowed(low * size) else _rounded(low + step, 0.1 * step)
    high = high if allowed(high * size) else _rounded(high - step, 0.1 * step)
    if not (low < high and allowed(low * size) and allowed(high * size)):
        return None
    return Parameter(key, _label(key, unit), unit, size, shown, low, high, step)


def _reach(value: float, end: float, allowed: Callable[[float | int], bool]) -> float:
    """The value nearest to ``end`` on the way there that is allowed."""
    if allowed(end):
        return end
    good, bad = value, end
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        if allowed(middle):
            good = middle
        else:
            bad = middle
    return good


def _rounded(value: float, step: float) -> float:
    return float(f"{round(value / step) * step:.12g}")


def nice(step: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most ``step``."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(f"{max(m for m in (1, 2, 5) if m * power <= step * (1.0 + 1e-9)) * power:.3g}")
