"""Curves from tables, as they stand in mission files: a kind, options, curves inside curves."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from bodyplan.curves.base import BodyCurve
from bodyplan.curves.constant import Constant
from bodyplan.curves.pointfiles import read_points
from bodyplan.curves.sampled import MOST_POINTS, Sampled
from bodyplan.curves.segments import Segments
from bodyplan.curves.serpenoid import Serpenoid
from bodyplan.curves.sinuslift import SinusLift
from bodyplan.curves.spiral import Spiral
from bodyplan.curves.steering import Steering
from bodyplan.curves.sums import Sum
from bodyplan.curves.transition import Transition
from bodyplan.curves.untwisted import Untwisted
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.units import to_si

#: kind -> class, for every body curve
KINDS: dict[str, type[BodyCurve]] = {
    curve.kind: curve
    for curve in (Constant, Sampled, Segments, Serpenoid, SinusLift, Spiral, Steering, Sum, Transition, Untwisted)
}
#: curves inside curves inside ...
DEEPEST = 16
#: options that are a curve, or a list of curves
NESTED = ("curve", "before", "after", "parts")


def from_dict(data: Mapping[str, Any]) -> BodyCurve:
    """The curve of a table: ``kind`` and the options of that class; quantities may be texts such as "30 deg", and the
    points of a sampled curve may be the name of a file that :meth:`bodyplan.Sampled.from_file` reads.

    Raises UnknownNameError for another kind or option, InputError for a missing option, a wrong value, or curves
    nested deeper than :data:`DEEPEST`.
    """
    return _curve(data, "curve", DEEPEST)


def _curve(data: Any, where: str, deeper: int) -> BodyCurve:
    if deeper == 0:
        raise InputError(f"{where}: curves may be nested {DEEPEST} deep.")
    if not isinstance(data, Mapping) or "kind" not in data:
        raise InputError(
            f"{where}: expected a table with a kind, one of {', '.join(sorted(KINDS))}; got {data!r:.200}."
        )
    kind = data["kind"]
    if not isinstance(kind, str) or kind not in KINDS:
        raise UnknownNameError("kind of curve", kind, KINDS, where)
    cls = KINDS[kind]
    parameters = inspect.signature(cls).parameters
    options: dict[str, Any] = {}
    for name, value in data.items():
        if name == "kind":
            continue
        if name not in parameters:
            raise UnknownNameError("option", name, parameters, f"{where} of kind {kind!r}")
        options[name] = _value(cls, name, value, f"{where}.{name}", deeper)
    for name, parameter in parameters.items():
        if parameter.default is inspect.Parameter.empty and name not in options:
            raise InputError(f"{where} of kind {kind!r}: needs {name}.")
    return cls(**options)


def _value(cls: type[BodyCurve], name: str, value: Any, where: str, deeper: int) -> Any:
    if name in NESTED:
        if name != "parts":
            return _curve(value, where, deeper - 1)
        if not isinstance(value, list | tuple):
            raise InputError(f"{where}: expected a list of curves, got {value!r:.200}.")
        return [_curve(item, f"{where}[{i}]", deeper - 1) for i, item in enumerate(value)]
    dimension = cls.UNITS.get(name)
    if dimension is None or value is None:
        return value
    if cls is Sampled and isinstance(value, str):
        return read_points(value, MOST_POINTS)
    return _quantities(value, dimension, where)


def _quantities(value: Any, dimension: str, where: str) -> Any:
    """Numbers in SI of a quantity or of lists of them."""
    if isinstance(value, list | tuple):
        return [_quantities(item, dimension, f"{where}[{i}]") for i, item in enumerate(value)]
    return to_si(value, dimension, where)
