"""What a gait is: options checked where it is built, and a planner from robot, ground and times to a Motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot


def from_zero(t: Array) -> None:
    """InputError for times before 0, where gaits start."""
    if t[0] < 0.0:
        raise InputError(f"t: the gait starts at t = 0, got {t[0]}.")


class Gait(ABC):
    """A way to move. Options are keyword arguments, validated at construction, equal by value."""

    #: name in mission files
    kind: ClassVar[str] = ""
    #: dimension (of ``bodyplan.units``) of every option that has one, for mission files
    UNITS: ClassVar[Mapping[str, str]] = {}
    #: patterns of names of facts that a plan has only where an optional library is installed
    OPTIONAL_FACTS: ClassVar[Sequence[str]] = ()

    @abstractmethod
    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) s. Raises InputError where robot or ground cannot do this gait at all;
        samples that fail have a status."""

    def period(self, robot: Robot, ground: Ground | None = None) -> float | None:
        """Time in s after which the gait repeats with this robot on this ground (None: level, without a ceiling); None
        for a gait that does not."""
        return None

    def variants(self) -> dict[str, Gait]:
        """Gaits to set beside this one in the report, by label (this one included); empty where there are none."""
        return {}

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Gait) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self.to_dict()))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.to_dict().items() if k != 'kind')})"
