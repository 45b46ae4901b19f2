"""Lines, arcs and helices: the pieces of :class:`bodyplan.curves.Segments`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import finite, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.units import to_si


class Segment(ABC):
    """One piece: its arc length and the shape functions within it."""

    kind: ClassVar[str] = ""
    UNITS: ClassVar[Mapping[str, str]] = {}

    @property
    @abstractmethod
    def size(self) -> float:
        """Arc length, m, > 0."""

    @property
    @abstractmethod
    def constants(self) -> tuple[float, float, float, float]:
        """tau, kappa_p and kappa_y at the start of the piece, and the rate at which the bend turns; all rad/m."""

    def to_dict(self) -> Any:
        """The options that were given, with ``kind``."""
        given = {name: getattr(self, name) for name in self.UNITS}
        return {"kind": self.kind, **{name: value for name, value in given.items() if value is not None}}

    def _checked(self) -> None:
        for name in self.UNITS:
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, name))
        length = getattr(self, "length", None)
        if length is not None:
            number(length, "length", above=0.0)


@dataclass(frozen=True)
class Line(Segment):
    """Straight: ``length`` m; ``twist`` rad/m about e_r."""

    length: float
    twist: float = 0.0

    kind: ClassVar[str] = "line"
    UNITS: ClassVar[Mapping[str, str]] = {"length": "length", "twist": "curvature"}

    def __post_init__(self) -> None:
        self._checked()

    @property
    def size(self) -> float:
        """m."""
        return self.length

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """See :attr:`Segment.constants`."""
        return self.twist, 0.0, 0.0, 0.0


@dataclass(frozen=True)
class Bend(Segment):
    """An arc, by two of: ``length`` m, ``angle`` rad (the whole bend), and one of ``curvature`` 1/m or ``radius`` m.

    ``direction`` rad of the bend: 0 to the left (yaw), pi / 2 up; a negative angle, curvature or radius bends to the
    other side. ``twist`` rad/m about e_r. Raises InputError where these are not given by just two.
    """

    length: float | None = None
    angle: float | None = None
    curvature: float | None = None
    radius: float | None = None
    direction: float = 0.0
    twist: float = 0.0

    kind: ClassVar[str] = "arc"
    UNITS: ClassVar[Mapping[str, str]] = {
        "length": "length",
        "angle": "angle",
        "curvature": "curvature",
        "radius": "length",
        "direction": "angle",
        "twist": "curvature",
    }

    def __post_init__(self) -> None:
        self._checked()
        given = [name for name in ("length", "angle", "curvature", "radius") if getattr(self, name) is not None]
        if len(given) != 2 or given == ["curvature", "radius"]:
            raise InputError(
                "arc: give two of length, angle, and curvature or radius; got " + (", ".join(given) or "none") + "."
            )
        if self.radius == 0.0:
            raise InputError("radius: must not be 0, got 0.0.")
        if self.length is None and (self.angle == 0.0 or self.curvature == 0.0):
            raise InputError("arc: an angle or curvature of 0 needs a length.")

    @property
    def _bend(self) -> tuple[float, float]:
        """Length m and curvature rad/m."""
        angle, k = self.angle or 0.0, self.curvature or 0.0
        if self.radius is not None:
            k = 1.0 / self.radius
        if self.length is None:
            return abs(angle / k), np.copysign(k, k * angle)
        return self.length, k if self.angle is None else angle / self.length

    @property
    def size(self) -> float:
        """m."""
        return self._bend[0]

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """See :attr:`Segment.constants`."""
        k = self._bend[1]
        return self.twist, -k * np.sin(self.direction), k * np.cos(self.direction), 0.0


@dataclass(frozen=True)
class Helix(Segment):
    """A helix, by ``curvature`` and ``torsion`` rad/m, or ``radius`` m and ``pitch`` m (rise per turn, negative for a
    left-handed one); its arc ``length`` m or its number of ``turns``.

    ``direction`` rad of the bend at its start: 0 to the left (yaw), pi / 2 up; from there it turns by the torsion.
    ``twist`` rad/m about e_r comes on top: the points have torsion + twist.
    """

    curvature: float | None = None
    torsion: float | None = None
    radius: float | None = None
    pitch: float | None = None
    length: float | None = None
    turns: float | None = None
    direction: float = 0.0
    twist: float = 0.0

    kind: ClassVar[str] = "helix"
    UNITS: ClassVar[Mapping[str, str]] = {
        "curvature": "curvature",
        "torsion": "curvature",
        "radius": "length",
        "pitch": "length",
        "length": "length",
        "turns": "none",
        "direction": "angle",
        "twist": "curvature",
    }

    def __post_init__(self) -> None:
        self._checked()
        given = [name for name in ("curvature", "torsion", "radius", "pitch") if getattr(self, name) is not None]
        if given not in (["curvature", "torsion"], ["radius", "pitch"]):
            raise InputError(
                "helix: give curvature and torsion, or radius and pitch; got " + (", ".join(given) or "none") + "."
            )
        if self.radius is not None:
            number(self.radius, "radius", above=0.0)
        if (self.length is None) == (self.turns is None):
            raise InputError("helix: give length or turns, one of them.")
        if self.turns is not None:
            number(self.turns, "turns", above=0.0)
            if self.curvature == 0.0 and self.torsion == 0.0:
                raise InputError("turns: a straight line has none; give length.")

    @property
    def _bend(self) -> tuple[float, float]:
        """Curvature and torsion, rad/m."""
        if self.radius is None:
            return self.curvature or 0.0, self.torsion or 0.0
        rise = (self.pitch or 0.0) / (2.0 * np.pi)
        square = self.radius**2 + rise**2
        return self.radius / square, rise / square

    @property
    def size(self) -> float:
        """m."""
        if self.length is not None:
            return self.length
        return float((self.turns or 0.0) * 2.0 * np.pi / np.hypot(*self._bend))

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """See :attr:`Segment.constants`."""
        k, torsion = self._bend
        return self.twist, -k * np.sin(self.direction), k * np.cos(self.direction), torsion


@dataclass(frozen=True)
class Constants(Segment):
    """A piece of constant shape functions: ``length`` m; ``tau``, ``kappa_p``, ``kappa_y`` rad/m."""

    length: float
    tau: float
    kappa_p: float
    kappa_y: float

    UNITS: ClassVar[Mapping[str, str]] = {
        "length": "length",
        "tau": "curvature",
        "kappa_p": "curvature",
        "kappa_y": "curvature",
    }

    def __post_init__(self) -> None:
        self._checked()

    def to_dict(self) -> list[float]:
        """As a list of four numbers."""
        return [self.length, self.tau, self.kappa_p, self.kappa_y]

    @property
    def size(self) -> float:
        """m."""
        return self.length

    @property
    def constants(self) -> tuple[float, float, float, float]:
        """See :attr:`Segment.constants`."""
        return self.tau, self.kappa_p, self.kappa_y, 0.0


#: kind -> class, for tables
SEGMENTS: dict[str, type[Segment]] = {"line": Line, "arc": Bend, "helix": Helix}


def segment_from(piece: Any, where: str) -> Segment:
    """The piece of a table, a tuple of four numbers, or itself; errors name ``where`` it stands."""
    if isinstance(piece, Segment):
        return piece
    try:
        if isinstance(piece, Mapping):
            return _from_table(piece)
        return Constants(*map(float, finite(piece, "a table with a kind, or (length, tau, kappa_p, kappa_y)", (4,))))
    except UnknownNameError as error:
        raise UnknownNameError(error.kind, error.name, error.valid, where) from error
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def _from_table(table: Mapping[str, Any]) -> Segment:
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in SEGMENTS:
        raise UnknownNameError("kind of piece", kind, SEGMENTS)
    cls = SEGMENTS[kind]
    valid = [field.name for field in fields(cls)]  # type: ignore[arg-type]
    options = {}
    for name, value in table.items():
        if name == "kind":
            continue
        if name not in valid:
            raise UnknownNameError("option", name, valid)
        options[name] = to_si(value, cls.UNITS[name], name)
    if cls is Line and "length" not in options:
        raise InputError("line: needs length.")
    return cls(**options)
