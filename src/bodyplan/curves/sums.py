"""The sum of curves: their shape functions added, such as a wave and the arc that makes it turn."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, frozen
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.errors import InputError

#: how far, relative, the longest period may be from a multiple of another
SAME_PERIOD = 1e-12


class Sum(BodyCurve):
    """Curves added: ``Sum([a, b])`` is ``a + b``. Sums of sums are one sum; ``length`` and ``start`` are those of the
    first part.

    ``period``: the longest one where it is a multiple of all others to 1e-12 (constants fit any), else None.
    Raises InputError where a part is no curve, or there is none.
    """

    kind: ClassVar[str] = "sum"

    def __init__(self, parts: Iterable[BodyCurve]) -> None:
        try:
            given = tuple(parts)
        except TypeError as error:
            raise InputError(f"parts: expected curves, got {parts!r}.") from error
        for i, part in enumerate(given):
            if not isinstance(part, BodyCurve):
                raise InputError(f"parts: expected curves, got {part!r} at {i}.")
        if not given:
            raise InputError("parts: needs at least one curve.")
        self.parts: tuple[BodyCurve, ...] = tuple(
            inner for part in given for inner in (part.parts if isinstance(part, Sum) else (part,))
        )
        self.length = self.parts[0].length

    def to_dict(self) -> dict[str, Any]:
        """The parts as tables, with ``kind``."""
        return {"kind": self.kind, "parts": [part.to_dict() for part in self.parts]}

    @property
    def start(self) -> Array:
        """See :attr:`BodyCurve.start`."""
        return self.parts[0].start

    @property
    def extent(self) -> tuple[float, float]:
        """See :attr:`BodyCurve.extent`: a sum goes on as long as one of its parts does."""
        spans = [part.extent for part in self.parts]
        return min(low for low, _ in spans), max(high for _, high in spans)

    @cached_property
    def breaks(self) -> Array:
        """See :attr:`BodyCurve.breaks`."""
        return frozen(np.unique(np.concatenate([part.breaks for part in self.parts])))

    @property
    def period(self) -> float | None:
        """See the class."""
        periods = [part.period for part in self.parts]
        known = [period for period in periods if period is not None]
        longest = max(known, default=0.0)
        ratios = np.array([longest / period for period in known if period])
        if len(known) < len(periods) or np.any(np.abs(ratios - np.round(ratios)) > SAME_PERIOD * ratios):
            return None
        return longest

    @property
    def twisted(self) -> bool:
        """See :attr:`BodyCurve.twisted`."""
        return any(part.twisted for part in self.parts)

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        return _added(part.shape(s) for part in self.parts)

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        return _added(part.slope(s) for part in self.parts)

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """The sum of the parts' integrals, as exact as they are."""
        return _added(part.integral(a, b) for part in self.parts)


def _added(shapes: Iterable[Shape]) -> Shape:
    return Shape(*(np.asarray(sum(terms)) for terms in zip(*shapes, strict=True)))
