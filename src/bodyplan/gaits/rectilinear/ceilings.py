"""Speed under ceilings: the 60 % rule, the drive that repeats and the fastest one, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import finite
from bodyplan.errors import InputError, Status
from bodyplan.gaits.rectilinear.course import least_time, stride_on_level
from bodyplan.gaits.rectilinear.demands import Demands
from bodyplan.gaits.rectilinear.gait import DRIVES, Rectilinear
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.robot.model import Robot

#: most ceilings in one table
MOST_CEILINGS = 200


@dataclass(frozen=True)
class UnderCeiling:
    """A row: the ``ceiling`` m above the line of the anchors, and for each drive by name the stride m and the speed m/s
    of the gait that repeats there, None where it does not fit (or, for the paper's rule, does not repeat)."""

    ceiling: float
    stride: dict[str, float | None]
    speed: dict[str, float | None]


def under_ceilings(robot: Robot, gait: Rectilinear, ceilings: Sequence[float]) -> list[UnderCeiling]:
    """Strides and speeds over level ground under each of ``ceilings`` (m above the line of the anchors' axes), with the
    gait's anchors, lift, spacing, times and schedule. The paper's rule is that of a wave; with two phases its column
    has the same share of a straight leg as stride. Raises InputError for ceilings that are not > 0."""
    heights = finite(ceilings, "ceilings", (None,))
    if len(heights) > MOST_CEILINGS or np.any(heights <= 0.0):
        raise InputError(f"ceilings: at most {MOST_CEILINGS} heights > 0, got {len(heights)}, {heights.min()}.")
    snake = InchingSnake.of(robot, gait.anchors, gait.joints)
    rows = []
    for height in heights:
        demands = snake.demands(float(height), gait.least_margin)
        stride: dict[str, float | None] = {}
        speed: dict[str, float | None] = {}
        for drive in DRIVES:
            options = gait.to_dict() | {"drive": drive}
            if drive == "paper" and gait.schedule != "wave":
                options["drive"] = [gait.share * float(gait.spacings(demands).min())] * gait.anchors
            kind = Rectilinear(**{name: value for name, value in options.items() if name != "kind"})
            stride[drive], speed[drive] = _figures(kind, demands)
        rows.append(UnderCeiling(float(height), stride, speed))
    return rows


def _figures(gait: Rectilinear, demands: Demands) -> tuple[float | None, float | None]:
    found = stride_on_level(gait, demands, least_time(gait, demands))
    if found is None or found.status != Status.OK:
        return None, None
    return found.stride, found.speed(gait.dwell)
