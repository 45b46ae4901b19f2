"""Numerical rates as paper *concertina* takes them: the five-point formula.

bodyplan's own rates are exact; this is for comparing with the paper and for measured data.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError

# weights of the end-point formulas times h, at offsets 0..4 and -1..3 (Burden and Faires)
_FIRST = np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / 12.0
_SECOND = np.array([-3.0, -10.0, 18.0, -6.0, 1.0]) / 12.0


@overload
def five_point(f: Callable[[Any], Any], h: float) -> Callable[[Any], Any]: ...
@overload
def five_point(f: ArrayLike, h: float) -> Array: ...
def five_point(f: Any, h: float) -> Any:
    """Derivative by the five-point formula, error O(h^4): ``(f(-2h) - 8 f(-h) + 8 f(h) - f(2h)) / 12h``.

    ``f``: samples (T, ...) at even spacing ``h``, T >= 5; the result has the same shape, with the one-sided
    five-point formulas at the two first and two last samples. Or a function: then a function is returned.
    Twice applied it gives accelerations. Raises InputError for fewer than five samples or h <= 0.
    """
    number(h, "h", above=0.0)
    if callable(f):
        return lambda x: (f(x - 2 * h) - 8 * f(x - h) + 8 * f(x + h) - f(x + 2 * h)) / (12 * h)
    values = finite(f, "f")
    if values.ndim == 0 or len(values) < 5:
        raise InputError(f"f: the five-point formula needs at least 5 samples, got shape {values.shape}.")
    out = np.empty_like(values)
    out[2:-2] = (values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]) / (12.0 * h)
    for i, weights in ((0, _FIRST), (1, _SECOND)):
        out[i] = np.tensordot(weights, values[:5], 1) / h
        out[-1 - i] = -np.tensordot(weights, values[:-6:-1], 1) / h
    return out
