"""A bend that changes along s: added to a wave, it steers the body that follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval
from bodyplan.curves.transition import blend, blend_integral, blend_slope
from bodyplan.errors import InputError


class Steering(BodyCurve):
    """kappa_y = ``initial`` rad/m, then from ``places[i]`` m on over to ``values[i]`` rad/m within ``width`` m.

    Every change is a quintic smoothstep (value, first and second slope continuous); changes nearer than ``width``
    overlap and add up. ``length`` m of the body. Raises InputError for places that do not ascend, another number of
    values, or a width or length <= 0.
    """

    kind: ClassVar[str] = "steering"
    UNITS: ClassVar[Mapping[str, str]] = {
        "places": "length",
        "values": "curvature",
        "width": "length",
        "length": "length",
        "initial": "curvature",
    }

    def __init__(
        self, places: ArrayLike, values: ArrayLike, width: float, length: float = 1.0, *, initial: float = 0.0
    ) -> None:
        self.places, self.values = frozen(finite(places, "places", (None,))), frozen(finite(values, "values", (None,)))
        if len(self.places) != len(self.values):
            raise InputError(f"values: expected {len(self.places)}, one for each place, got {len(self.values)}.")
        if np.any(np.diff(self.places) <= 0.0):
            raise InputError(f"places: must ascend, got {self.places.tolist()}.")
        self.width, self.length = number(width, "width", above=0.0), number(length, "length", above=0.0)
        self.initial = number(initial, "initial")
        self._changes = frozen(np.diff(self.values, prepend=self.initial))

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        lists = {"places": self.places.tolist(), "values": self.values.tolist()}
        return {"kind": self.kind, **lists, "width": self.width, "length": self.length, "initial": self.initial}

    @property
    def breaks(self) -> Array:
        """Ends of the changes, where the third slope jumps."""
        return frozen(np.unique(np.concatenate([self.places, self.places + self.width])))

    @property
    def period(self) -> float | None:
        """0 where nothing ever changes."""
        return None if np.any(self._changes) else 0.0

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        u = self._progress(finite(s, "s"))
        return _yaw(self.initial + np.sum(self._changes * blend(u), axis=-1))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        u = self._progress(finite(s, "s"))
        return _yaw(np.sum(self._changes * blend_slope(u), axis=-1) / self.width)

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact."""
        first, last = interval(a, b)
        ramps = self._changes * blend_integral(self._progress(first), self._progress(last))
        return _yaw(self.initial * (last - first) + self.width * np.sum(ramps, axis=-1))

    def _progress(self, s: Array) -> Array:
        return np.asarray((s[..., None] - self.places) / self.width)


def _yaw(values: Array) -> Shape:
    kappa_y = np.asarray(values)
    none = np.zeros(kappa_y.shape)
    return Shape(none, none, kappa_y)
