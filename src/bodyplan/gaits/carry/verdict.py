"""Which samples of a carry cannot be done, and why: the wheel and the time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, TextArray
from bodyplan.errors import Status
from bodyplan.gaits.carry.carriage import Carriage
from bodyplan.gaits.carry.rates import JUMPS
from bodyplan.gaits.carry.wheels import Wheels

if TYPE_CHECKING:
    from bodyplan.gaits.carry.gait import Carry
    from bodyplan.gaits.carry.motion import Rolled

#: relative excess of a rate that is rounding
ROUNDING = 1e-9


@dataclass(frozen=True)
class Verdict:
    """``status`` (T,) of every sample; ``reasons``: for every kind of failure a sentence with its first time."""

    status: TextArray
    reasons: tuple[str, ...]

    @property
    def ok(self) -> BoolArray:
        """(T,) True where nothing failed."""
        return np.asarray(self.status == Status.OK.value)


def judge(gait: Carry, wheels: Wheels, body: Carriage, rolled: Rolled, under: BoolArray, t: Array) -> Verdict:
    """The status of every sample; ``under`` (T,) True where the hull touches the ground. What is asked for comes first,
    then the wheels' contacts, the hull, and rates; a sample has the first failure that it meets."""
    status = np.full(len(t), Status.OK.value, dtype="U24")
    reasons: list[tuple[int, str]] = []

    def fail(where: Any, what: Status, why: str | Callable[[int], str]) -> None:
        fresh = np.flatnonzero(where & (status == Status.OK.value))
        if len(fresh):
            first = int(fresh[0])
            count = f"{what.value}, {len(fresh)} of {len(t)} samples"
            text = why if isinstance(why, str) else why(first)
            reasons.append((first, f"At {t[first]:.4g} s {text} ({count})."))
            status[fresh] = what.value

    if gait.heading is None:
        still = body.course.still
        fail(still, Status.STANDS_STILL, "the path stands still and has no direction to head for")
    fail(body.course.ended, Status.CURVE_ENDED, "the path has come to its end")
    fail(body.off_map, Status.NO_CONTACT, "the body is beyond the edge of the ground")
    for one in rolled.wheels:
        for what in (Status.NO_CONTACT, Status.BELOW_FLOOR, Status.NOT_CONVERGED, Status.OUT_OF_REACH):
            fail(one.status == what.value, what, one.reason)
    fail(under, Status.BELOW_FLOOR, "the hull touches the ground")
    for k, wheel in enumerate(wheels):
        leaps = f"the contact of wheel {wheel.name!r} jumps: the ground bends like its rim"
        fail(rolled.of(rolled.found.slack, k) <= JUMPS, Status.JUMPS, leaps)
    with np.errstate(invalid="ignore"):  # a rate without end against no limit
        share = np.abs(rolled.qd) / wheels.robot.rates
    for wheel in wheels:
        endless = f"wheel {wheel.name!r} changes at its largest radius, where no rate of its adjusting joint does that"
        rates = rolled.qd[:, wheel.columns]
        fail(~np.isfinite(rates).all(axis=1), Status.LIMIT, endless)
        for column in wheel.columns:
            fast = f"joint {wheels.robot.joints[column]} is faster than it may be"
            fail(share[:, column] > 1.0 + ROUNDING, Status.LIMIT, fast)
    return Verdict(status, tuple(text for _, text in sorted(reasons)))
