"""Where a body curve begins and ends."""

from __future__ import annotations

import numpy as np

from bodyplan.curves.base import BodyCurve

#: kinds of curve that are straight beyond their ends
FINITE = ("segments", "sampled")


def extent(curve: BodyCurve) -> tuple[float, float]:
    """(first, last) arc length m of what a curve describes; infinite for curves with a formula."""
    inner = getattr(curve, "curve", None)
    parts = getattr(curve, "parts", None)
    if curve.kind in FINITE:
        return 0.0, curve.length
    if curve.kind == "untwisted" and isinstance(inner, BodyCurve):
        return extent(inner)
    if curve.kind == "sum" and parts:
        # a sum goes on as long as one of its parts does
        spans = [extent(part) for part in parts]
        return min(low for low, _ in spans), max(high for _, high in spans)
    return -np.inf, np.inf
