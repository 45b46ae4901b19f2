"""Body curves and shape functions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.concertina import ConcertinaCurve
from bodyplan.curves.constant import Constant
from bodyplan.curves.dynamic import GAMMA_STAR, dynamic_curve, dynamic_slope
from bodyplan.curves.sampled import Sampled
from bodyplan.curves.segment_kinds import Bend, Helix, Line
from bodyplan.curves.segments import Segments
from bodyplan.curves.serpenoid import Serpenoid
from bodyplan.curves.sinuslift import SinusLift
from bodyplan.curves.spiral import Spiral
from bodyplan.curves.steering import Steering
from bodyplan.curves.sums import Sum
from bodyplan.curves.tables import KINDS, from_dict
from bodyplan.curves.transition import Transition
from bodyplan.curves.untwisted import Untwisted
from bodyplan.errors import UnknownNameError

__all__ = [
    "CURVES",
    "GAMMA_STAR",
    "KINDS",
    "Bend",
    "BodyCurve",
    "ConcertinaCurve",
    "Constant",
    "Helix",
    "Line",
    "Sampled",
    "Segments",
    "Serpenoid",
    "Shape",
    "SinusLift",
    "Spiral",
    "Steering",
    "Sum",
    "Transition",
    "Untwisted",
    "dynamic_curve",
    "dynamic_slope",
    "from_dict",
    "from_parameters",
]

#: curves that a claim can name
CURVES = {"concertina": ConcertinaCurve}


def from_parameters(name: str, parameters: Mapping[str, Any]) -> ConcertinaCurve:
    """The curve of that name with these keyword arguments; UnknownNameError for a name that does not exist."""
    if name not in CURVES:
        raise UnknownNameError("curve", name, CURVES)
    return CURVES[name](**parameters)
