"""Checked, read-only arrays: how numbers come in, and how they are handed out."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bodyplan.errors import InputError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
TextArray = NDArray[np.str_]


def frozen(values: ArrayLike) -> Array:
    """A read-only, C-contiguous float64 copy of ``values``."""
    out = np.array(values, dtype=np.float64, order="C")
    out.flags.writeable = False
    return out


def finite(values: ArrayLike, field: str, shape: tuple[int | None, ...] | None = None) -> Array:
    """``values`` as float64, every entry finite; ``None`` in ``shape`` stands for any size.

    Raises InputError with the field, the first bad entry and its index.
    """
    try:
        if np.iscomplexobj(values):
            raise TypeError("complex")
        out: Array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{field}: expected numbers, got {values!r}.") from error
    if shape is not None and (
        out.ndim != len(shape) or any(n is not None and n != m for n, m in zip(shape, out.shape, strict=True))
    ):
        want = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
        raise InputError(f"{field}: expected shape {want}, got {out.shape}.")
    bad = ~np.isfinite(out)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        where = f" at {index}" if index else ""
        raise InputError(f"{field}: every value must be finite, got {out[index]}{where}.")
    return out


def number(
    value: Any,
    field: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
) -> float:
    """One finite float inside the stated bounds, or InputError naming field, value and bounds."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{field}: expected a number, got {value!r}.")
    out = float(value)
    limits = [
        (above is None or out > above, f"> {above}"),
        (at_least is None or out >= at_least, f">= {at_least}"),
        (below is None or out < below, f"< {below}"),
        (at_most is None or out <= at_most, f"<= {at_most}"),
    ]
    wanted = " and ".join(
        text for (_, text), bound in zip(limits, (above, at_least, below, at_most), strict=True) if bound is not None
    )
    if not np.isfinite(out) or not all(ok for ok, _ in limits):
        raise InputError(f"{field}: must be a finite number{' ' + wanted if wanted else ''}, got {value!r}.")
    return out


def whole(value: Any, field: str, *, at_least: int = 0, at_most: int | None = None) -> int:
    """One integer inside the stated bounds, or InputError."""
    good = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not good or value < at_least or (at_most is not None and value > at_most):
        upper = "" if at_most is None else f" and <= {at_most}"
        raise InputError(f"{field}: must be a whole number >= {at_least}{upper}, got {value!r}.")
    return int(value)
