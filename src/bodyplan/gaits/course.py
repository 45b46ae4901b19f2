"""The curve that a steered or changing body runs along: one curve at rest in space; the leading end is first on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bodyplan.curves.base import BodyCurve
from bodyplan.curves.constant import Constant
from bodyplan.curves.steering import Steering
from bodyplan.curves.transition import Transition

if TYPE_CHECKING:
    from bodyplan.gaits.serpentine import Serpentine


def course_of(gait: Serpentine, before: BodyCurve, length: float) -> BodyCurve:
    """The curve under way: what the leading end takes over from a time on holds from there on."""
    ahead = gait.pace.direction > 0

    def leading(time: float) -> float:
        return float(gait.pace.at(np.asarray(time))[0]) + (length if ahead else 0.0)

    course = before
    for time, after in gait.changes:
        width = gait.change_length or after.period or 0.5 * length
        at, new = leading(time), after.untwisted()
        course = Transition(course, new, at, width) if ahead else Transition(new, course, at - width, width)
    if isinstance(gait.steer, tuple):
        width = gait.change_length or gait.curve.period or 0.5 * length
        places: list[float] = []
        values: list[float] = []
        for time, value in gait.steer:
            place = leading(time) - (0.0 if ahead else width)
            # while a ramp begins or ends the body may not move between two times: the later value holds
            if places and gait.pace.direction * (place - places[-1]) <= 0.0:
                values[-1] = value
                continue
            places.append(place)
            values.append(value)
        if ahead:
            return course + Steering(places, values, width)
        return course + Steering(places[::-1], [*values[-2::-1], 0.0], width, initial=values[-1])
    return course + Constant(kappa_y=gait.steer) if gait.steer else course
