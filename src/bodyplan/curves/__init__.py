"""Body curves and shape functions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bodyplan.curves.concertina import ConcertinaCurve
from bodyplan.curves.dynamic import GAMMA_STAR, dynamic_curve, dynamic_slope
from bodyplan.errors import UnknownNameError

__all__ = ["CURVES", "GAMMA_STAR", "ConcertinaCurve", "dynamic_curve", "dynamic_slope", "from_parameters"]

#: curves that a claim can name
CURVES = {"concertina": ConcertinaCurve}


def from_parameters(name: str, parameters: Mapping[str, Any]) -> ConcertinaCurve:
    """The curve of that name with these keyword arguments; UnknownNameError for a name that does not exist."""
    if name not in CURVES:
        raise UnknownNameError("curve", name, CURVES)
    return CURVES[name](**parameters)
