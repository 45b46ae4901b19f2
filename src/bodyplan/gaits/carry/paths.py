"""Where the body goes, seen from above: lines, circles, curves through points, formulas in t, and samples.

A path is asked with the times and, where it is a mere curve, the way along it; it answers with places, directions and
their derivatives by time, all exact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.carry.laws import Law
from bodyplan.gaits.carry.orientation import Function
from bodyplan.units import to_si

#: m/s: a path that moves slower has no direction
STILL = 1e-9


@dataclass(frozen=True)
class Course:
    """A path at T times: ``place``, ``velocity``, ``acceleration`` (T, 2) in m and s; ``direction`` rad with its
    derivatives; ``still`` (T,) True where the path has no direction, ``ended`` (T,) where it has come to its end."""

    place: Array
    velocity: Array
    acceleration: Array
    direction: Function
    still: BoolArray
    ended: BoolArray


class Path(ABC):
    """A path over the ground; equal by value."""

    #: name in mission files
    kind: ClassVar[str] = ""
    #: True for a curve that is gone along at a speed; False where the path itself says when it is where
    curve: ClassVar[bool] = True

    @abstractmethod
    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s; ``way`` is the way along a curve, m."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""

    @property
    def length(self) -> float | None:
        """Length of a curve that has an end or closes, m; None where it goes on."""
        return None

    @property
    def closed(self) -> bool:
        """Whether the curve closes, so that a lap repeats."""
        return False

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Path) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self.to_dict()))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.to_dict().items() if k != 'kind')})"


def _along(place: Array, direction: Array, bend: Array, change: Array, way: Function, ended: BoolArray) -> Course:
    """The course of a curve by arc length: place (T, 2), direction (T,) rad, its curvature and that one's slope."""
    tangent = np.stack([np.cos(direction), np.sin(direction)], axis=1)
    across = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    velocity = way.first[:, None] * tangent
    acceleration = way.second[:, None] * tangent + (bend * way.first**2)[:, None] * across
    turning = Function(direction, bend * way.first, change * way.first**2 + bend * way.second)
    return Course(place, velocity, acceleration, turning, np.zeros(len(place), dtype=np.bool_), ended)


def _by_time(place: Array, velocity: Array, acceleration: Array, third: Array, ended: BoolArray) -> Course:
    """The course of a path given by time; its direction by correction 4 of the notes: psi' = (x'y'' - y'x'')/(x'^2 +
    y'^2)."""
    x1, y1, x2, y2, x3, y3 = (v[:, i] for v in (velocity, acceleration, third) for i in (0, 1))
    square = x1 * x1 + y1 * y1
    still = square <= STILL**2
    safe = np.where(still, 1.0, square)
    first = (x1 * y2 - y1 * x2) / safe
    second = (x1 * y3 - y1 * x3) / safe - 2.0 * first * (x1 * x2 + y1 * y2) / safe
    direction = Function(np.arctan2(y1, x1), np.where(still, 0.0, first), np.where(still, 0.0, second))
    return Course(place, velocity, acceleration, direction, still, ended)


class Line(Path):
    """A straight line from ``start`` (2,) m, to ``end`` (2,) m and on, or in the direction ``heading`` rad."""

    kind = "line"

    def __init__(self, start: ArrayLike = (0.0, 0.0), end: ArrayLike | None = None, heading: float = 0.0) -> None:
        x, y = finite(_lengths(start, "path.start"), "path.start", (2,)).tolist()
        self.start = (x, y)
        self.heading = number(_angle(heading, "path.heading"), "path.heading")
        if end is not None:
            dx, dy = (finite(_lengths(end, "path.end"), "path.end", (2,)) - self.start).tolist()
            if dx == 0.0 and dy == 0.0:
                raise InputError(f"path.end: must not be the start, got {end!r}.")
            self.heading = float(np.arctan2(dy, dx))

    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s."""
        zero, direction = np.zeros(len(t)), np.full(len(t), self.heading)
        place = self.start + way.value[:, None] * np.array([np.cos(self.heading), np.sin(self.heading)])
        return _along(place, direction, zero, zero, way, np.zeros(len(t), dtype=np.bool_))

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, "start": list(self.start), "heading": self.heading}


class Circle(Path):
    """A circle about ``center`` (2,) m of ``radius`` m, from the angle ``start`` rad on, counter-clockwise seen from
    above or ``clockwise``. That of paper *wheels*, x = sin t, y = cos t, starts at pi/2, clockwise, at 1 m/s."""

    kind = "circle"

    def __init__(
        self, radius: float = 1.0, center: ArrayLike = (0.0, 0.0), start: float = 0.0, clockwise: bool = False
    ) -> None:
        self.radius = number(_length(radius, "path.radius"), "path.radius", above=0.0)
        x, y = finite(_lengths(center, "path.center"), "path.center", (2,)).tolist()
        self.center = (x, y)
        self.start = number(_angle(start, "path.start"), "path.start")
        if not isinstance(clockwise, bool):
            raise InputError(f"path.clockwise: must be true or false, got {clockwise!r}.")
        self.clockwise = clockwise

    @property
    def length(self) -> float | None:
        """Length of a lap, m."""
        return 2.0 * np.pi * self.radius

    @property
    def closed(self) -> bool:
        """A lap repeats."""
        return True

    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s."""
        sign = -1.0 if self.clockwise else 1.0
        angle = self.start + sign * way.value / self.radius
        place = self.center + self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        bend = np.full(len(t), sign / self.radius)
        direction = angle + sign * 0.5 * np.pi
        return _along(place, direction, bend, np.zeros(len(t)), way, np.zeros(len(t), dtype=np.bool_))

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, "radius": self.radius, "center": list(self.center), "start": self.start,
                "clockwise": self.clockwise}  # fmt: skip


class Formula(Path):
    """x and y as formulas in t (s), m: ``Formula("sin(t)", "cos(t)")``."""

    kind = "formula"
    curve = False

    def __init__(self, x: Any, y: Any) -> None:
        self.x, self.y = Law(x, "path.x", "length"), Law(y, "path.y", "length")

    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s."""
        x, y = self.x.at(t), self.y.at(t)
        pairs = [(x.value, y.value), (x.first, y.first), (x.second, y.second), (self.x.third(t), self.y.third(t))]
        place, velocity, acceleration, third = (np.stack(pair, axis=1) for pair in pairs)
        return _by_time(place, velocity, acceleration, third, np.zeros(len(t), dtype=np.bool_))

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, "x": self.x.plain, "y": self.y.plain}


class Samples(Path):
    """Places ``points`` (k, 2) m at the times ``times`` (k,) s, ascending, k >= 4: the quintic spline through them
    (cubic below six), with its exact derivatives."""

    kind = "samples"
    curve = False

    def __init__(self, times: ArrayLike, points: ArrayLike) -> None:
        self.times = finite(times, "path.times", (None,))
        self.points = finite(points, "path.points", (None, 2))
        if len(self.times) != len(self.points) or len(self.times) < 4:
            raise InputError(
                f"path.points: as many as times and at least 4, got {len(self.points)} and {len(self.times)} times."
            )
        if np.any(np.diff(self.times) <= 0.0):
            raise InputError("path.times: must ascend.")

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import make_interp_spline

        return make_interp_spline(self.times, self.points, k=5 if len(self.times) > 5 else 3)

    def at(self, t: Array, way: Function) -> Course:
        """The course at t (T,) s; before and after the samples it has ended."""
        inside = np.clip(t, self.times[0], self.times[-1])
        slack = 1e-9 * (self.times[-1] - self.times[0])
        place, velocity, acceleration, third = (np.asarray(self._spline(inside, k)) for k in range(4))
        return _by_time(place, velocity, acceleration, third, np.abs(t - inside) > slack)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, "times": self.times.tolist(), "points": self.points.tolist()}


def path_of(given: Any) -> Path:
    """A path from what a user gives: a :class:`Path`, a table with ``kind`` and its options, two formulas in t, or
    points (k, 2) m, k >= 2, that a smooth curve goes through. InputError or UnknownNameError for anything else."""
    from bodyplan.gaits.carry.curve import Through

    kinds: dict[str, type[Path]] = {k.kind: k for k in (Line, Circle, Through, Formula, Samples)}
    if isinstance(given, Path):
        return given
    if isinstance(given, Mapping):
        options = {str(k): v for k, v in given.items()}
        kind = options.pop("kind", None)
        if kind not in kinds:
            raise UnknownNameError("kind of path", kind, kinds, where="path")
        return _made(kinds[kind], options)
    if isinstance(given, str) and given in kinds:
        return _made(kinds[given], {})
    if isinstance(given, Sequence) and len(given) == 2 and any(isinstance(part, str) for part in given):
        return Formula(*given)
    try:
        return Through(given)
    except InputError as error:
        raise InputError(
            "path: expected a Path, a table with a kind (" + ", ".join(sorted(kinds)) + "), two formulas in t, or "
            f"points (k, 2), got {given!r}: {error}"
        ) from error


def _made(kind: type[Path], options: Mapping[str, Any]) -> Path:
    import inspect

    taken = inspect.signature(kind).parameters
    for name in options:
        if name not in taken:
            raise UnknownNameError("field", name, taken, where=f"path {kind.kind!r}")
    for name, parameter in taken.items():
        if parameter.default is parameter.empty and name not in options:
            raise InputError(f"path {kind.kind!r}: {name} is missing.")
    return kind(**options)


def _length(value: Any, name: str) -> Any:
    return to_si(value, "length", name) if isinstance(value, str) else value


def _lengths(values: Any, name: str) -> Any:
    return [_length(v, name) for v in values] if isinstance(values, (list, tuple)) else values


def _angle(value: Any, name: str) -> Any:
    return to_si(value, "angle", name) if isinstance(value, str) else value
